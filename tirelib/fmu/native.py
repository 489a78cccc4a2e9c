"""Pack an FMU without Python: prebuilt binaries, and calibration or response surface as numbers.

The binaries of ``fmu_src/binaries`` are the same for every FMU (``build/native_fmu.py`` makes
them); what differs stands in ``resources/StrainTire.core`` or ``VirtualTire.core``, whose format
`resource_file` writes.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import FormatError
from tirelib.core.version import __version__
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.core_table import flat_table
from tirelib.fmu.describe3 import build_description, flat_names, model_description
from tirelib.fmu.parts import Identity, check_writable, identity_of, source_file, write_fmu
from tirelib.fmu.spec import SlaveSpec
from tirelib.fmu.variables import Variable

FORMAT = "tirelib-core/1"
NO_FRAME = (0.0, 0.0, 0.0, math.nan)
"""Numbers of a file that is only a calibration: samples, buffer, rate, missing."""
BINARIES = (
    "linux64/StrainTire.so",
    "aarch64-linux/StrainTire.so",
    "win64/StrainTire.dll",
    "darwin64/StrainTire.dylib",
)
"""By platform, as FMI 2.0 names it; each holds the functions of FMI 2.0 and 3.0."""
PLATFORMS: Mapping[int, Mapping[str, Sequence[str]]] = {
    2: {name: (name.split("/")[0],) for name in BINARIES},
    3: {
        BINARIES[0]: ("x86_64-linux",),
        BINARIES[1]: ("aarch64-linux",),
        BINARIES[2]: ("x86_64-windows",),
        BINARIES[3]: ("x86_64-darwin", "aarch64-darwin"),
    },
}
"""By version of FMI: the folders that a binary stands in."""


def pack(
    spec: SlaveSpec,
    title: str,
    data: FloatArray,
    out: str | Path,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write the FMU of `spec` around the core.

    Parameters
    ----------
    spec : SlaveSpec
    title : str
        Name of the tire.
    data : array, shape (n,)
        What the core reads: `flat_table` of a calibration or of a response surface, and so on.
    out : path
    progress : callable, optional

    Raises
    ------
    FormatError
        If the FMU cannot be written.
    """
    tell = progress or (lambda _: None)
    target = Path(out)
    check_writable(target)
    tell("described")
    sources = core_sources(spec.fmi)
    computing = {
        f"binaries/{folder}/{spec.model}{Path(name).suffix}": binary
        for name, folders in PLATFORMS[spec.fmi].items()
        for binary in (source_file(f"binaries/{name}").read_bytes(),)
        for folder in folders
    }
    computing |= {f"sources/{name}": source_file(name).read_bytes() for name in sources}
    if spec.fmi == 3:
        computing["sources/buildDescription.xml"] = build_description(spec.model, sources)
    identity = identity_of(
        spec, {**computing, "data": data.tobytes(), "texts": "\n".join(spec.texts)}
    )
    usual = {"buffered": 0.0, "missing": math.nan}
    core = hashed_file(
        title,
        data,
        guid=identity.guid,
        table=flat_names(spec.table) if spec.fmi == 3 else spec.table,
        numbers=[
            float(spec.settings.get(name, usual.get(name, math.nan)))
            for name in ("samples_per_step", "buffered", "sample_rate", "missing")
        ],
        texts=spec.texts,
    )
    files = {
        **computing,
        **{f"resources/{name}": part for name, part in spec.resources.items()},
        "resources/settings.json": json.dumps(dict(spec.settings), indent=1).encode(),
        f"resources/{spec.model}.core": core,
        "modelDescription.xml": _description_of_3(spec, identity)
        if spec.fmi == 3
        else _description(spec, identity, sources),
    }
    tell("collected")
    write_fmu(files, spec, identity, target)
    tell("packed")
    return target


def core_sources(fmi: int) -> list[str]:
    """Return the C files of the FMU, relative to ``fmu_src``, in the order of their names."""
    folder = source_file("core/wheel.c").parents[1]
    rooms = ("core", "tire", "slave", f"fmi{fmi}")
    found = (path for room in rooms for path in (folder / room).glob("*.[ch]"))
    return sorted(path.relative_to(folder).as_posix() for path in found)


def core_file(calibration: Calibration) -> bytes:
    """Return the file that the parameter `calibration` of an FMU takes.

    Raises
    ------
    FormatError
        If the tire's name has more than one line, or the core does not know a regressor.
    """
    table = flat_table(calibration)
    return hashed_file(calibration.tire, table, guid=f"{_hash(table.astype('<f8').tobytes()):016x}")


def _hash(data: bytes) -> int:
    """Return the FNV-1a hash of bytes, as `state_hash` of the core does, so that damage is seen."""
    found, factor, low_bits = 14695981039346656037, 1099511628211, (1 << 64) - 1
    for byte in data:
        found = (found ^ byte) * factor & low_bits
    return found


def hashed_file(
    title: str,
    data: FloatArray,
    *,
    guid: str,
    table: Sequence[Variable] = (),
    numbers: Sequence[float] = NO_FRAME,
    texts: Sequence[str] = (),
) -> bytes:
    """Return such a file whose first line holds the hash of all that follows."""
    file = resource_file(title, data, guid=guid, table=table, numbers=numbers, texts=texts)
    rest = file.removeprefix(f"{FORMAT}\n".encode())
    return f"{FORMAT} {_hash(rest):016x}\n".encode() + rest


def resource_file(
    title: str,
    data: FloatArray,
    *,
    guid: str = "-",
    table: Sequence[Variable] = (),
    numbers: Sequence[float] = NO_FRAME,
    texts: Sequence[str] = (),
) -> bytes:
    """Return the file that the core reads: lines of text, then doubles, least byte first.

    Parameters
    ----------
    title : str
        Name of the tire.
    data : array, shape (n,)
    guid : str
        Identifier of the FMU, as in the model description, in braces; the hash of `data` in a file
        without FMU.
    table : sequence of Variable
        Its variables.
    numbers : four floats
        Samples of a frame, whether it is buffered, sample rate [Hz], what stands for a missing
        value.
    texts : sequence of str
        What is logged, a line each.

    Raises
    ------
    FormatError
        If the name has more than one line.
    """
    if "\n" in title:
        raise FormatError(f"tire = {title!r}; a name of one line is needed; mend it")
    lines = [FORMAT, guid, title, f"{len(table)} {len(texts)}"]
    lines += [*(f"{v.kind[0]}{v.causality[0]}{v.name}" for v in table), *texts]
    values = np.concatenate((np.array(numbers, dtype=np.float64), data))
    return "\n".join((*lines, "")).encode() + values.astype("<f8").tobytes()


def _description_of_3(spec: SlaveSpec, identity: Identity) -> bytes:
    return model_description(
        spec.table,
        model=spec.model,
        description=spec.description,
        token=identity.guid,
        version=identity.version,
        step_size=spec.step_size,
        known=spec.start_depends_on or (),
    )


def _description(spec: SlaveSpec, identity: Identity, sources: Sequence[str]) -> bytes:
    """Return the model description without what `described` adds."""
    root = Xml.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": spec.model,
            "guid": identity.guid,
            "description": spec.description,
            "author": "The tirelib developers",
            "version": identity.version,
            "license": "MIT",
            "generationTool": f"tirelib {__version__}",
            "variableNamingConvention": "flat",
        },
    )
    simulation = Xml.SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": spec.model,
            "needsExecutionTool": "false",
            "canHandleVariableCommunicationStepSize": "true",
            "canBeInstantiatedOnlyOncePerProcess": "false",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
        },
    )
    listed = Xml.SubElement(simulation, "SourceFiles")
    for name in sources:
        if name.endswith(".c"):
            Xml.SubElement(listed, "File", {"name": name})
    Xml.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0.0", "stopTime": "1.0", "stepSize": f"{spec.step_size!r}"},
    )
    scalars = Xml.SubElement(root, "ModelVariables")
    outputs = Xml.SubElement(Xml.SubElement(root, "ModelStructure"), "Outputs")
    for number, variable in enumerate(spec.table):
        fixed = variable.causality == "parameter"
        about = {
            "name": variable.name,
            "valueReference": str(number),
            "description": variable.description,
            "causality": variable.causality,
            "variability": "fixed" if fixed else "discrete",
        }
        kind = Xml.SubElement(Xml.SubElement(scalars, "ScalarVariable", about), variable.kind)
        if variable.causality == "output":
            Xml.SubElement(outputs, "Unknown", {"index": str(number + 1)})
        else:
            kind.set("start", _start(variable))
    text: bytes = Xml.tostring(root, encoding="UTF-8")
    return text


def _start(variable: Variable) -> str:
    """Return a start value as XML has it."""
    if variable.kind == "Boolean":
        return "true" if variable.start else "false"
    if isinstance(variable.start, float):
        return "NaN" if math.isnan(variable.start) else f"{variable.start:.16g}"
    return str(variable.start)
