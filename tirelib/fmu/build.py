"""Build an FMU from a slave of ``fmu_src``. Same input and code, same bytes."""

import json
import math
import re
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from types import ModuleType
from uuid import UUID, uuid5

from tirelib import __version__
from tirelib.errors import FormatError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.fmu.bundle import BROUGHT, collect, content_hash, write_package
from tirelib.fmu.describe import described, repack
from tirelib.fmu.spec import SlaveSpec

_NAMESPACE = UUID("5b1f6a2e-3c7d-5e84-9a10-7469726c6962")
_OPTIONS = {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True}
_FOREIGN = re.compile(r"^(\s*(?:from|import)\s+)pythonfmu(?=[.\s])", re.MULTILINE)
_MODULE = re.compile(r"^import (\S+\.pythonfmu)$", re.MULTILINE)
_LAUNCHER = '''"""Finds the slave. pythonfmu 0.7.0 runs this file anew for every instance.

Whatever class it finds among the names that are new, it never lets go, so there is none, and it
looks for a name without letters in the module. It gives up a reference to the module's names that
it never took; one more is taken here.
"""

import ctypes

import {package}.{module} as slave

globals().update(dict.fromkeys(("", "{model}"), slave.{model}))
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
'''
DEFAULT_RATE = 1e4


def build_fmu(
    calibration: str | Path,
    out: str | Path,
    *,
    samples_per_step: int = 1,
    sample_rate: float = DEFAULT_RATE,
    buffered: bool = False,
    missing: float = math.nan,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write ``StrainTire.fmu``: an FMI 2.0 co-simulation unit that estimates with a calibration.

    Parameters
    ----------
    calibration : path
        Made by ``tirelib calibrate``; it is embedded.
    out : path
        The FMU to write.
    samples_per_step : int
        Samples of every gage that one communication step brings, or at most brings.
    sample_rate : float, [Hz]
        Start value of the parameter of that name.
    buffered : bool
        Whether an input says how many samples of a frame are new, so that communication steps may
        have any length.
    progress : callable, optional
        Called with what was done.

    Raises
    ------
    ParameterError
        If a number is out of range.
    FormatError
        If the calibration cannot be read, or the FMU cannot be written.
    """
    from tirelib.fmu.strain_spec import strain_tire  # it describes itself with this module's help

    _check_writable(Path(out))
    spec = strain_tire(
        calibration,
        samples_per_step=samples_per_step,
        sample_rate=sample_rate,
        buffered=buffered,
        missing=missing,
    )
    return export(spec, out, progress)


def export(spec: SlaveSpec, out: str | Path, progress: Callable[[str], None] | None = None) -> Path:
    """Write the FMU of a slave.

    Every module inside is named by version and content, pythonfmu's included, so that FMUs of
    several versions can live in one process.

    Raises
    ------
    FormatError
        If pythonfmu is not installed, or the FMU cannot be written.
    """
    tell = progress or (lambda _: None)
    target = Path(out)
    _check_writable(target)
    slave = source_file(spec.script)
    sources = {**collect(slave), slave.name: slave.read_text(encoding="utf-8")}
    gate = source_file("gate/linux64.so").read_bytes()
    settings = {**spec.settings, "description": spec.description, "step_size": spec.step_size}
    digest = content_hash(
        {
            **sources,
            "launcher": _LAUNCHER,
            "settings": json.dumps(settings),
            "pythonfmu": _pythonfmu(),
            **{f"resources/{k}": v.hex() for k, v in spec.resources.items()},
            **{f"documentation/{k}": v.hex() for k, v in spec.documentation.items()},
            "icon": spec.icon.hex(),
            "gate": gate.hex(),
        }
    )
    settings["guid"] = f"{{{uuid5(_NAMESPACE, digest)}}}"
    settings["version"] = f"{__version__}+{digest}"
    suffix = f"{re.sub(r'[^0-9a-zA-Z]', '_', __version__)}_{digest}"
    package = f"tirelib_{suffix}"
    tell("modules collected")
    with tempfile.TemporaryDirectory(prefix="tirelib_fmu_") as name:
        folder = Path(name)
        script = folder / f"{slave.stem}_{suffix}.py"
        launcher = _LAUNCHER.format(package=package, module=slave.stem, model=spec.model)
        script.write_text(launcher, encoding="utf-8")
        content = [write_package(folder, sources, package)]
        for path, data in {
            **spec.resources,
            "settings.json": json.dumps(settings, indent=1).encode(),
            "guid.txt": str(settings["guid"]).encode(),
        }.items():
            place = folder / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
            top = folder / Path(path).parts[0]
            content += [top] if top not in content else []
        raw = _export(script, folder / "raw" / f"{spec.model}.fmu", content, suffix)
        tell("exported by pythonfmu")
        files = _own_pythonfmu(_unzipped(raw), slave.name, package)
    files |= _gated(files, f"binaries/linux64/{spec.model}.so", gate)
    files |= {
        "modelDescription.xml": described(
            files["modelDescription.xml"], spec.table, spec.start_depends_on
        ),
        "model.png": spec.icon,
        **_licenses(),
    }
    for path, data in spec.documentation.items():
        filled = data.replace(b"{version}", str(settings["version"]).encode())
        files[f"documentation/{path}"] = filled
    try:
        repack(files, target)
    except OSError as error:
        raise _unwritable(target, error) from None
    tell("described and packed")
    return target


def _check_writable(target: Path) -> None:
    """Refuse a name that is no FMU's or cannot be written before the work is done, not after."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=target.parent):
            pass
        if target.is_dir():
            raise IsADirectoryError(21, "is a folder")
    except OSError as error:
        raise _unwritable(target, error) from None
    if target.suffix.lower() != ".fmu":
        raise FormatError(
            f"{target}: ends in {target.suffix!r}; allowed is .fmu, the ending that importers "
            "expect; choose another name"
        )


def _unwritable(target: Path, error: OSError) -> FormatError:
    return FormatError(f"{target}: cannot be written ({error.strerror}); choose another file")


def _pythonfmu() -> str:
    """Return the version of pythonfmu."""
    try:
        return metadata.version("pythonfmu")
    except metadata.PackageNotFoundError:
        raise FormatError(
            "fmu build: the package pythonfmu, which writes the FMU, is not installed; install it "
            "with pip install 'tirelib[fmu]'"
        ) from None


def source_file(name: str) -> Path:
    """Return a file of ``fmu_src``: beside the package in a checkout, inside it when installed.

    Raises
    ------
    FormatError
        If it is in neither.
    """
    package = Path(__file__).parents[1]
    for folder in (package.parent / "fmu_src", package / "fmu_src"):
        if (folder / name).is_file():
            return folder / name
    raise FormatError(
        f"{package.parent}: holds no fmu_src/{name}, a source of the FMU; install tirelib from its "
        "repository or its wheel"
    )


def _export(script: Path, target: Path, content: list[Path], suffix: str) -> Path:
    """Let pythonfmu write the FMU."""
    from pythonfmu import FmuBuilder

    target.parent.mkdir()
    with _imports_undone(suffix):
        FmuBuilder.build_FMU(script, dest=target, project_files=content, **_OPTIONS)
    return target


@contextmanager
def _imports_undone(suffix: str) -> Iterator[None]:
    """Forget what the builder imports and where it looked: it runs the slave in this process.

    Modules of the same FMU, loaded here by an importer, stand aside meanwhile.
    """
    path, bytecode = list(sys.path), sys.dont_write_bytecode
    loaded = _take_out(suffix)
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.dont_write_bytecode = bytecode
        sys.path[:] = path
        _take_out(suffix)
        sys.modules.update(loaded)


def _take_out(suffix: str) -> dict[str, ModuleType]:
    """Remove the modules of an FMU from this process and return them."""
    names = [name for name in sys.modules if name.split(".")[0].endswith(suffix)]
    return {name: sys.modules.pop(name) for name in names}


def _unzipped(raw: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(raw) as archive:
        return {name: archive.read(name) for name in archive.namelist() if name[-1] != "/"}


def _own_pythonfmu(files: Mapping[str, bytes], slave: str, package: str) -> dict[str, bytes]:
    """Move pythonfmu's modules into the FMU's own package, where no other version can be met."""
    moved = {}
    for name, data in files.items():
        if name == f"resources/{package}/{slave}":
            text = _FOREIGN.sub(rf"\g<1>{package}.pythonfmu", data.decode())
            moved[name] = _MODULE.sub(r"import \1 as pythonfmu", text).encode()
        else:
            place = name.replace("resources/pythonfmu/", f"resources/{package}/pythonfmu/", 1)
            moved[place] = data
    return moved


def _gated(files: Mapping[str, bytes], library: str, gate: bytes) -> dict[str, bytes]:
    """Return the gate in the place of pythonfmu's library, and that among the resources."""
    return {"resources/binaries/linux64/pythonfmu.so": files[library], library: gate}


def _licenses() -> dict[str, bytes]:
    """Return the licences of all that is inside."""
    own = Path(__file__).parents[2] / "LICENSE"
    texts = {"license.txt": own.read_bytes() if own.is_file() else _installed_license("tirelib")}
    texts |= {f"{name}.txt": _installed_license(name) for name in ("pythonfmu", BROUGHT)}
    return {f"documentation/licenses/{name}": text for name, text in texts.items() if text}


def _installed_license(package: str) -> bytes:
    for file in metadata.files(package) or []:
        if file.name.upper().startswith("LICENSE"):
            return Path(str(file.locate())).read_bytes()
    return b""


def embedded_calibration(fmu: str | Path) -> Calibration:
    """Read the calibration that an FMU carries.

    Raises
    ------
    FormatError
        If the file is no FMU of this kind.
    """
    try:
        with zipfile.ZipFile(fmu) as archive, tempfile.TemporaryDirectory() as folder:
            with (
                archive.open("resources/calibration.toml") as source,
                (Path(folder) / "calibration.toml").open("wb") as target,
            ):
                shutil.copyfileobj(source, target)
            return read_calibration(Path(folder) / "calibration.toml")
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise FormatError(
            f"{fmu}: is not an FMU made by `tirelib fmu build` ({error}); build it again"
        ) from None
