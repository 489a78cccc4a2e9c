"""Pack ``StrainTire.fmu`` without Python: prebuilt binaries, and the calibration as numbers.

The binaries of ``fmu_src/binaries`` are the same for every FMU (``build/native_fmu.py`` makes
them); what differs stands in ``resources/StrainTire.core``, whose format `core_file` writes.
"""

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from uuid import uuid5
from xml.etree import ElementTree as Xml

import numpy as np

from tirelib import __version__
from tirelib.errors import FormatError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.fmu.build import (
    _NAMESPACE,
    _check_writable,
    _installed_license,
    _unwritable,
    source_file,
)
from tirelib.fmu.bundle import content_hash
from tirelib.fmu.calibration_table import flat_table
from tirelib.fmu.describe import described, repack
from tirelib.fmu.spec import SlaveSpec
from tirelib.fmu.strain_spec import strain_tire
from tirelib.fmu.variables import Variable

FORMAT = "tirelib-core/1"
BINARIES = (
    "linux64/StrainTire.so",
    "aarch64-linux/StrainTire.so",
    "win64/StrainTire.dll",
    "darwin64/StrainTire.dylib",
)
"""By platform, as FMI names it."""


def build_native(
    calibration: str | Path,
    out: str | Path,
    *,
    samples_per_step: int = 1,
    sample_rate: float = 1e4,
    buffered: bool = False,
    missing: float = math.nan,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write the FMU; parameters and errors as `tirelib.fmu.build.build_fmu`."""
    tell = progress or (lambda _: None)
    target = Path(out)
    _check_writable(target)
    spec = strain_tire(
        calibration,
        samples_per_step=samples_per_step,
        sample_rate=sample_rate,
        buffered=buffered,
        missing=missing,
        native=True,
    )
    tell("described")
    binaries = {name: source_file(f"binaries/{name}").read_bytes() for name in BINARIES}
    parts = {f"binaries/{name}": data for name, data in binaries.items()}
    parts |= {f"resources/{name}": data for name, data in spec.resources.items()}
    parts |= {f"documentation/{name}": data for name, data in spec.documentation.items()}
    settings = json.dumps({**spec.settings, "description": spec.description})
    texts = {name: data.hex() for name, data in parts.items()}
    digest = content_hash({**texts, "settings": settings, "icon": spec.icon.hex()})
    guid, version = f"{{{uuid5(_NAMESPACE, digest)}}}", f"{__version__}+{digest}"
    core = core_file(
        read_calibration(calibration),
        guid=guid,
        table=spec.table,
        numbers=(samples_per_step, buffered, sample_rate, missing),
    )
    files = {
        **{name: data.replace(b"{version}", version.encode()) for name, data in parts.items()}
        | {name: data for name, data in parts.items() if name.startswith("binaries/")},
        "resources/StrainTire.core": core,
        "modelDescription.xml": described(
            _description(spec, guid, version), spec.table, spec.start_depends_on
        ),
        "model.png": spec.icon,
    }
    own = Path(__file__).parents[2] / "LICENSE"
    files["documentation/licenses/license.txt"] = (
        own.read_bytes() if own.is_file() else _installed_license("tirelib")
    )
    tell("collected")
    try:
        repack(files, target)
    except OSError as error:
        raise _unwritable(target, error) from None
    tell("packed")
    return target


def core_file(
    calibration: Calibration,
    *,
    guid: str = "-",
    table: Sequence[Variable] = (),
    numbers: Sequence[float] = (0.0, 0.0, 0.0, math.nan),
) -> bytes:
    """Return the file that the core reads: lines of text, then doubles, least byte first.

    Parameters
    ----------
    calibration : Calibration
    guid : str
        Identifier of the FMU, as in the model description, in braces.
    table : sequence of Variable
        Its variables.
    numbers : four floats
        Samples of a frame, whether it is buffered, sample rate [Hz], what stands for a missing
        value.

    Raises
    ------
    FormatError
        If the tire's name has more than one line, or the core does not know a regressor.
    """
    if "\n" in calibration.tire:
        raise FormatError(
            f"calibration: tire = {calibration.tire!r}; a name of one line is needed; mend it"
        )
    lines = [FORMAT, guid, calibration.tire, str(len(table))]
    lines += [f"{v.kind[0]}{v.causality[0]}{v.name}" for v in table]
    values = np.concatenate((np.array(numbers, dtype=np.float64), flat_table(calibration)))
    return "\n".join((*lines, "")).encode() + values.astype("<f8").tobytes()


def _description(spec: SlaveSpec, guid: str, version: str) -> bytes:
    """Return the model description without what `described` adds."""
    root = Xml.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": spec.model,
            "guid": guid,
            "description": spec.description,
            "author": "The tirelib developers",
            "version": version,
            "license": "MIT",
            "generationTool": f"tirelib {__version__}",
            "variableNamingConvention": "flat",
        },
    )
    Xml.SubElement(
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
