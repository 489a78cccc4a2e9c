"""The compiled core of signal, features, estimators and stream, loaded through ctypes.

The library that a compiled FMU carries is the one that is loaded here, so that a campaign, a live
signal and an FMU are computed by the same instructions. Where no library fits the machine, the
numpy code of the same modules computes: it is the readable reference, agrees to 1e-9 and takes
ten to thirty times as long. ``TIRELIB_CORE=numpy`` in the environment asks for it.
"""

import ctypes as c
import os
import platform
import sys
import warnings
from array import array
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ShapeError

GAGES, ANGLES = 16, 361
"""Most gages of a wheel, and wheel angles of a turn: sizes with which the core is compiled."""
QUANTITIES = 4
REAL, WHOLE = c.c_double, c.c_int
_ROW, _TRACE = REAL * GAGES, REAL * (GAGES * ANGLES)
_BINARIES = {
    ("Linux", "x86_64"): "linux64/StrainTire.so",
    ("Linux", "aarch64"): "aarch64-linux/StrainTire.so",
    ("Windows", "AMD64"): "win64/StrainTire.dll",
    ("Darwin", "x86_64"): "darwin64/StrainTire.dylib",
    ("Darwin", "arm64"): "darwin64/StrainTire.dylib",
}
CONDITIONS = ("speed", "pressure", "camber", "friction", "tread_depth", "tread_temperature")
TURN_SCALARS = (
    *("time", "ready", "period", "omega", "angle_std", "slip_std", "pulse", "axis_shift"),
    *CONDITIONS,
)
TURN_ROWS = ("offset", "offset_std", "mean")
FEATURE_ROWS = (
    *("lead", "trail", "rate_lead", "rate_trail", "cp1", "cp2", "tp"),
    *("cp1_angle", "cp2_angle", "tp_angle", "e_vertical", "e_friction", "skew"),
)


class TurnStruct(c.Structure):
    """Turn of ``turns.h``."""

    _fields_ = [
        *((name, REAL) for name in TURN_SCALARS),
        *((name, _ROW) for name in TURN_ROWS),
        ("strain", _TRACE),
        ("rate", _TRACE),
        ("gage_flags", WHOLE * GAGES),
        ("flags", WHOLE),
    ]


class HeadStruct(c.Structure):
    """TurnHead of ``turns.h``."""

    _fields_ = TurnStruct._fields_[: len(TURN_SCALARS) + len(TURN_ROWS)]


class FeatureStruct(c.Structure):
    """Features of ``features.h``."""

    _fields_ = [
        *((name, _ROW) for name in FEATURE_ROWS),
        ("gage_flags", WHOLE * GAGES),
        ("flags", WHOLE),
    ]


class EstimateStruct(c.Structure):
    """Estimates of ``estimates.h``."""

    _fields_ = [
        ("value", REAL * QUANTITIES),
        ("std", REAL * QUANTITIES),
        ("radius", REAL),
        ("contact_length", _ROW),
        ("contact_length_std", _ROW),
        ("valid", WHOLE * QUANTITIES),
        *((name, WHOLE) for name in ("turn_valid", "flags", "notes", "rolling")),
    ]


class OutputStruct(c.Structure):
    """Outputs of ``wheel.h``."""

    _fields_ = [
        *(("value", REAL * QUANTITIES), ("std", REAL * QUANTITIES)),
        *(("contact_length", _ROW), ("contact_length_std", _ROW)),
        *((name, REAL) for name in ("rolling_radius", "turn_rate", "contact_time", "age")),
        ("turn", c.c_int64),
        *((name, WHOLE) for name in ("flags", "notes", "valid")),
        *(("valid_of", WHOLE * QUANTITIES), ("rolling", WHOLE)),
    ]


class LowPassStruct(c.Structure):
    """LowPass of ``lowpass.h``."""

    _fields_ = [("order", REAL), ("cut_off", REAL)]


class Column(c.Structure):
    """Column of ``ring.h``: samples that lie `step` doubles apart; 0: one that is held."""

    _fields_ = [("first", c.c_void_p), ("step", c.c_int64)]


_STRUCTURES = (TurnStruct, HeadStruct, FeatureStruct, EstimateStruct, OutputStruct, Column)
_SIGNATURES: dict[str, tuple[Any, list[Any]]] = {
    "sizes": (None, [c.c_void_p]),
    "calibration_size": (c.c_size_t, []),
    "calibration_read": (c.c_size_t, [c.c_void_p, c.c_void_p, c.c_size_t]),
    "estimate_scratch": (c.c_size_t, [c.c_void_p]),
    "cutter_size": (c.c_size_t, [WHOLE, REAL]),
    "cutter_start": (c.c_void_p, [c.c_void_p, WHOLE, c.c_void_p, REAL, c.c_void_p]),
    "cut": (c.c_int64, [c.c_void_p, c.c_void_p, c.c_int64, c.c_void_p, c.c_void_p, c.c_int64]),
    "cut_features": (
        c.c_int64,
        [*[c.c_void_p] * 2, c.c_int64, *[c.c_void_p] * 4, c.c_int64],
    ),
    "features": (None, [c.c_void_p, c.c_int64, WHOLE, c.c_void_p]),
    "estimates": (
        None,
        [c.c_void_p, c.c_void_p, c.c_void_p, c.c_int64, c.c_void_p, c.c_void_p],
    ),
    "wheel_size": (c.c_size_t, [c.c_void_p, REAL]),
    "wheel_start": (c.c_void_p, [c.c_void_p, c.c_void_p, REAL]),
    "wheel_take": (
        WHOLE,
        [c.c_void_p, c.c_void_p, c.c_int64, c.c_void_p, c.c_void_p, c.c_void_p, c.c_void_p],
    ),
    "wheel_wait": (None, [c.c_void_p, REAL]),
    "wheel_time": (REAL, [c.c_void_p]),
    "wheel_elapsed": (REAL, [c.c_void_p]),
    "wheel_outputs": (None, [c.c_void_p, c.c_void_p]),
    "state_size": (c.c_size_t, [c.c_void_p]),
    "state_save": (None, [c.c_void_p, c.c_void_p]),
    "state_restore": (WHOLE, [c.c_void_p, c.c_char_p, c.c_size_t]),
}
"""Result and arguments of the functions of ``library.h``, without ``tirelib_``."""


class Core:
    """The functions of a loaded library.

    Parameters
    ----------
    path : path
        The library.

    Attributes
    ----------
    source : str
        Hash of the sources from which it was made: what tells a build from others.

    Raises
    ------
    OSError
        If it cannot be loaded, or is of another version.
    """

    def __init__(self, path: Path) -> None:
        library = c.CDLL(str(path))
        for name, (result, arguments) in _SIGNATURES.items():
            try:
                function = getattr(library, f"tirelib_{name}")
            except AttributeError as error:
                raise OSError(f"{path}: is of another version ({error})") from None
            function.restype, function.argtypes = result, arguments
            setattr(self, name, function)
        self.source = bytes((c.c_char * 80).in_dll(library, "tirelib_core_source")).decode()
        sizes = (c.c_int64 * len(_STRUCTURES))()
        self.sizes(sizes)
        if [*sizes] != [c.sizeof(structure) for structure in _STRUCTURES]:
            raise OSError(f"{path}: is of another version; its structures have other sizes")

    def __getattr__(self, name: str) -> Any:
        """Tell which functions there are."""
        raise AttributeError(f"the compiled core has no function {name!r}")


def shipped(name: str) -> Path | None:
    """Return a file of ``fmu_src``: beside the package in a checkout, inside it when installed."""
    package = Path(__file__).parents[1]
    for folder in (package.parent / "fmu_src", package / "fmu_src"):
        if (folder / name).is_file():
            return folder / name
    return None


@lru_cache(maxsize=1)
def loaded_core() -> Core | None:
    """Return the core for this machine; None where numpy has to compute.

    Warns where there is a library for this machine, but it cannot be loaded.
    """
    name = _BINARIES.get((platform.system(), platform.machine()))
    path = shipped(f"binaries/{name}") if name and sys.maxsize > 2**32 else None
    if path is None or os.environ.get("TIRELIB_CORE") == "numpy":
        return None
    try:
        return Core(path)
    except OSError as error:
        warnings.warn(
            f"the compiled core cannot be loaded ({error}); numpy computes the same numbers, but "
            "takes ten times as long; TIRELIB_CORE=numpy in the environment chooses numpy without "
            "this warning",
            stacklevel=2,
        )
        return None


def choose_numpy() -> None:
    """Let numpy compute from now on, here and in processes that are started later.

    For programs that change a constant or a function of the reference and look at what follows.
    """
    os.environ["TIRELIB_CORE"] = "numpy"
    loaded_core.cache_clear()


def memory(size: int) -> FloatArray:
    """Return memory of a number of bytes, aligned as the core needs it; not cleared."""
    return np.empty(size // 8 + 2)


def block_of(structure: type[c.Structure], n: int) -> Any:
    """Return n structures as a structured array, not cleared."""
    return np.empty(n, dtype=_layout(structure))


@lru_cache(maxsize=8)
def _layout(structure: type[c.Structure]) -> Any:
    return np.dtype(structure)


def reals_of(block: Any, n: int) -> FloatArray:
    """Return a copy of the first n doubles of each structure of a block."""
    rows: FloatArray = block.view(np.float64).reshape(len(block), block.itemsize // 8)[:, :n]
    return rows.copy()


def columns_of(
    strain: FloatArray, held: Mapping[str, Any], order: tuple[str, ...], trigger: Any
) -> tuple[Any, list[FloatArray]]:
    """Return the columns of a frame, and the arrays that they point into, which must be kept.

    Parameters
    ----------
    strain : array, shape (n_gages, n)
    held : mapping of str to array of shape (n,) or a number
    order : tuple of str
        Names of the held conditions in the core's order.
    trigger : array of shape (n,) or None

    Raises
    ------
    ShapeError
        If an array has another number of samples than the strain.
    """
    rows = _aligned(strain)
    kept, (apart, step), samples = [rows], rows.strides, rows.shape[1:]
    first, placed = address(rows), list[int]()
    for gage in range(len(rows)):
        placed += (first + gage * apart, step // 8)
    known = [held.get(name, np.nan) for name in order]
    for number, value in enumerate((*known, np.nan if trigger is None else trigger)):
        line = _aligned(value)
        if line.ndim and line.shape != samples:
            name = order[number] if number < len(order) else "trigger"
            raise ShapeError(f"{name} has shape {line.shape}; {samples} is needed")
        kept.append(line)
        placed += (address(line), line.strides[0] // 8 if line.ndim else 0)
    return (Column * (len(placed) // 2)).from_buffer(array("q", placed)), kept


def _aligned(values: Any) -> FloatArray:
    """Return an array of doubles that lie at their places in memory; a copy where need be."""
    found: FloatArray = np.asarray(values, np.float64)
    return found if found.flags.aligned else found.copy()


def address(values: FloatArray) -> int:
    """Return where the first number of an array is."""
    try:
        return c.addressof(c.c_char.from_buffer(values.data))  # four times as fast
    except (TypeError, ValueError):  # may not be written to, is empty or not in one piece
        return int(values.__array_interface__["data"][0])
