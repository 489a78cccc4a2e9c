"""Build ``StrainTire.fmu`` from a calibration. Same calibration and code, same bytes."""

import json
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from uuid import UUID, uuid5

from tirelib import __version__
from tirelib.errors import FormatError, ParameterError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.fmu.bundle import collect, content_hash, renamed, write_package
from tirelib.fmu.describe import described, page, repack
from tirelib.fmu.variables import inputs, outputs, parameters
from tirelib.stream.estimator import RATES

MODEL = "StrainTire"
MOST_SAMPLES = 256
"""Largest frame: a turn must be longer than a frame, or its estimate would be overwritten."""
DEFAULT_RATE = 1e4
_NAMESPACE = UUID("5b1f6a2e-3c7d-5e84-9a10-7469726c6962")
_OPTIONS = {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True}


def build_fmu(
    calibration: str | Path,
    out: str | Path,
    *,
    samples_per_step: int = 1,
    sample_rate: float = DEFAULT_RATE,
) -> Path:
    """Write an FMI 2.0 co-simulation FMU that estimates with a calibration.

    Parameters
    ----------
    calibration : path
        Made by ``tirelib calibrate``; it is embedded.
    out : path
        The FMU to write.
    samples_per_step : int
        Samples of every gage that one communication step brings.
    sample_rate : float, [Hz]
        Start value of the parameter of that name.

    Raises
    ------
    ParameterError
        If a number is out of range.
    FormatError
        If the calibration cannot be read, or the FMU cannot be written.
    """
    if not 1 <= samples_per_step <= MOST_SAMPLES:
        raise ParameterError(
            f"samples per step = {samples_per_step}; allowed are 1 .. {MOST_SAMPLES}; a frame must "
            "be shorter than a turn of the wheel"
        )
    low, high = RATES
    if not low <= sample_rate <= high:
        raise ParameterError(
            f"sample rate = {sample_rate} Hz; allowed are {low:g} .. {high:g} Hz; give the rate of "
            "the gages"
        )
    loaded = read_calibration(calibration)
    text = Path(calibration).read_text(encoding="utf-8")
    slave = slave_file()
    sources = collect(slave)
    settings: dict[str, int | float | str] = {
        "samples_per_step": samples_per_step,
        "sample_rate": sample_rate,
    }
    digest = content_hash(
        {
            **sources,
            "slave": slave.read_text(encoding="utf-8"),
            "calibration": text,
            "settings": json.dumps(settings),
            "pythonfmu": _pythonfmu(),
        }
    )
    guid = str(uuid5(_NAMESPACE, digest))
    settings |= {"guid": f"{{{guid}}}", "version": f"{__version__}+{digest}"}
    package = f"tirelib_{digest}"
    target = Path(out)
    with tempfile.TemporaryDirectory(prefix="tirelib_fmu_") as name:
        folder = Path(name)
        script = folder / f"strain_tire_{digest}.py"
        script.write_text(renamed(slave.read_text(encoding="utf-8"), package), encoding="utf-8")
        (folder / "calibration.toml").write_text(text, encoding="utf-8")
        (folder / "settings.json").write_text(json.dumps(settings, indent=1), encoding="utf-8")
        content = [
            write_package(folder, sources, package),
            folder / "calibration.toml",
            folder / "settings.json",
        ]
        raw = _export(script, folder / "raw" / f"{MODEL}.fmu", content)
        try:
            repack(raw, target, _additions(raw, loaded, settings))
        except OSError as error:
            raise FormatError(f"{target}: cannot be written ({error.strerror}); choose another "
                              "file") from None  # fmt: skip
    return target


def _pythonfmu() -> str:
    """Return the version of pythonfmu."""
    try:
        return metadata.version("pythonfmu")
    except metadata.PackageNotFoundError:
        raise FormatError(
            "fmu build: pythonfmu is not installed; it writes the FMU; `pip install tirelib[fmu]`"
        ) from None


def slave_file() -> Path:
    """Return the slave's source: beside the package in a checkout, inside it when installed."""
    package = Path(__file__).parents[1]
    for folder in (package.parent / "fmu_src", package / "fmu_src"):
        if (folder / "strain_tire.py").is_file():
            return folder / "strain_tire.py"
    raise FormatError(
        f"{package.parent}: holds no fmu_src/strain_tire.py, the source of the FMU; install "
        "tirelib from its repository or its wheel"
    )


def _export(script: Path, target: Path, content: list[Path]) -> Path:
    """Let pythonfmu write the FMU."""
    from pythonfmu import FmuBuilder

    target.parent.mkdir()
    with _imports_undone():
        FmuBuilder.build_FMU(script, dest=target, project_files=content, **_OPTIONS)
    return target


@contextmanager
def _imports_undone() -> Iterator[None]:
    """Forget what the builder imports and where it looked: it runs the slave in this process."""
    path, modules, bytecode = list(sys.path), set(sys.modules), sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.dont_write_bytecode = bytecode
        sys.path[:] = path
        for name in set(sys.modules) - modules:
            if name.startswith(("tirelib_", "strain_tire_")):
                del sys.modules[name]


def _additions(
    raw: Path, calibration: Calibration, settings: dict[str, int | float | str]
) -> dict[str, bytes]:
    """Return the files that pythonfmu does not write, or not well."""
    samples, rate = int(settings["samples_per_step"]), float(settings["sample_rate"])
    table = [
        *parameters(rate, RATES),
        *inputs(calibration.lateral, samples),
        *outputs(calibration.lateral),
    ]
    facts = {
        "tire": calibration.tire,
        "gages": ", ".join(f"{1e3 * y:+g}" for y in calibration.lateral) + " mm, ISO 8855",
        "samples per step": str(samples),
        "sample rate": f"{rate:g} Hz (parameter)",
        "axis systems": "iso (default), sae, adapted_sae (parameter)",
        "needs": "CPython 3.11 or newer with numpy and scipy; linux64 or win64",
        "version": str(settings["version"]),
    }
    with zipfile.ZipFile(raw) as archive:
        description = archive.read("modelDescription.xml")
    files = {
        "modelDescription.xml": described(description, table),
        "documentation/index.html": page(MODEL, facts, table).encode(),
    }
    license_file = slave_file().parents[1] / "LICENSE"
    if license_file.is_file():
        files["documentation/licenses/license.txt"] = license_file.read_bytes()
    return files


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
            f"{fmu}: is no FMU made by `tirelib fmu build` ({error}); build it anew"
        ) from None
