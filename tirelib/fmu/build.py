"""Build ``StrainTire.fmu``, and read what one carries."""

import json
import math
import tempfile
import zipfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from tirelib.core.errors import FormatError, ParameterError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration, read_with_provenance
from tirelib.estimators.core_table import flat_table
from tirelib.fmu.export import export
from tirelib.fmu.native import pack
from tirelib.fmu.parts import DEFAULT_RATE, check_writable
from tirelib.fmu.strain_spec import CALIBRATION, strain_tire


def build_fmu(
    calibration: str | Path,
    out: str | Path,
    *,
    samples_per_step: int = 1,
    sample_rate: float = DEFAULT_RATE,
    buffered: bool = False,
    missing: float = math.nan,
    python: bool = False,
    sealed: bool = False,
    fmi: int = 2,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write ``StrainTire.fmu``: a co-simulation unit that estimates with a calibration.

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
    missing : float
        What Real outputs show where there is no value; NaN or a finite number.
    python : bool
        Whether Python computes in the FMU, where it runs, instead of the compiled core.
    sealed : bool
        Whether the FMU leaves out the calibration file (names and statistics of the campaigns, a
        measured turn): the core's table of numbers is inside only, and no reference signals.
    fmi : int
        Version of FMI: 2, or 3 with arrays and a clock.
    progress : callable, optional
        Called with what was done.

    Raises
    ------
    ParameterError
        If a number is out of range, or a Python FMU shall be sealed or of FMI 3.0.
    FormatError
        If the calibration cannot be read, or the FMU cannot be written.
    """
    check_writable(Path(out))
    if python and sealed:
        raise ParameterError(
            "fmu build: --python and --sealed; only one of them is allowed, because the Python FMU "
            "reads the calibration file; leave out --python"
        )
    if fmi not in (2, 3) or (python and fmi == 3):
        raise ParameterError(
            f"fmu build: FMI {fmi}{' with --python' if python else ''}; allowed are 2, and 3 "
            "without --python; leave one of the options out"
        )
    loaded, document = read_with_provenance(calibration)
    spec = strain_tire(
        loaded,
        Path(calibration).read_text(encoding="utf-8"),
        document,
        samples_per_step=samples_per_step,
        sample_rate=sample_rate,
        buffered=buffered,
        missing=missing,
        python=python,
        sealed=sealed,
        fmi=fmi,
    )
    if python:
        return export(spec, out, progress)
    return pack(spec, loaded.tire, flat_table(loaded), out, progress)


def embedded_calibration(fmu: str | Path) -> Calibration:
    """Read the calibration that an FMU carries.

    Raises
    ------
    FormatError
        If the file is no FMU of this kind, or a sealed one.
    """
    try:
        with zipfile.ZipFile(fmu) as archive:
            if not _sealed(archive):
                return _read(archive.read(f"resources/{CALIBRATION}"))
    except OSError as error:
        raise FormatError(
            f"{fmu}: cannot be read ({error.strerror}); an FMU is needed; check the path"
        ) from None
    except KeyError:
        raise FormatError(
            f"{fmu}: is not an FMU made by `tirelib fmu build`, because it holds no calibration; a "
            "strain tire is needed; step a virtual tire in any importer"
        ) from None
    except (ValueError, zipfile.BadZipFile) as error:
        raise FormatError(
            f"{fmu}: is not an FMU made by `tirelib fmu build` ({error}); build it again"
        ) from None
    raise FormatError(
        f"{fmu}: is sealed, so it holds no calibration file; one built without --sealed is needed; "
        "step this one in any importer, or check it with `tirelib fmu check`"
    )


@lru_cache(maxsize=2)
def _read(content: bytes) -> Calibration:
    """Read a calibration's file; the wheels of a vehicle carry the same one, of a megabyte."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / CALIBRATION
        file.write_bytes(content)
        return read_calibration(file)


def _sealed(archive: zipfile.ZipFile) -> bool:
    """Tell whether an FMU was sealed."""
    settings = json.loads(archive.read("resources/settings.json"))
    return isinstance(settings, dict) and settings.get("sealed") is True
