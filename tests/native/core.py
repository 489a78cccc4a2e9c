"""The native core, compiled for the tests and called through ctypes."""

import ctypes as c
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import native_fmu
import numpy as np
import pytest

from tirelib.features.extract import Features
from tirelib.held import HELD
from tirelib.signal import LowPass, Turn
from tirelib.signal.turns import PHI

SOURCE = Path(__file__).parents[2] / "fmu_src" / "core"
FLAGS = (*native_fmu.C99, *native_fmu.STRICT, "-Wconversion", "-Wno-sign-conversion")
GAGES = 16
REAL = c.c_double
ROW = REAL * GAGES
TRACE = REAL * (GAGES * PHI.size)
CONDITIONS = ("speed", "pressure", "camber", "friction", "tread_depth", "tread_temperature")
SCALARS = (
    *("time", "ready", "period", "omega", "angle_std", "slip_std", "pulse", "axis_shift"),
    *CONDITIONS,
)
BY_GAGE = (
    *("lead", "trail", "rate_lead", "rate_trail", "cp1", "cp2", "tp"),
    *("cp1_angle", "cp2_angle", "tp_angle", "e_vertical", "e_friction", "skew"),
)


class NativeTurn(c.Structure):
    """Turn of turns.h."""

    _fields_ = [
        *((name, REAL) for name in SCALARS),
        *((name, ROW) for name in ("offset", "offset_std", "mean")),
        ("strain", TRACE),
        ("rate", TRACE),
        ("gage_flags", c.c_int * GAGES),
        ("flags", c.c_int),
    ]


class NativeFeatures(c.Structure):
    """Features of features.h."""

    _fields_ = [
        *((name, ROW) for name in BY_GAGE),
        ("gage_flags", c.c_int * GAGES),
        ("flags", c.c_int),
    ]


class NativeLowPass(c.Structure):
    """LowPass of lowpass.h."""

    _fields_ = [("order", REAL), ("cut_off", REAL)]


def compiled(folder: Path, *flags: str) -> c.CDLL:
    """Compile the core; skip without a C compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    library = folder / "core.so"
    sources = sorted(map(str, SOURCE.glob("*.c")))
    command = [
        compiler,
        *FLAGS,
        "-O2",
        "-shared",
        "-fPIC",
        *flags,
        *sources,
        "-lm",
        "-o",
        str(library),
    ]
    subprocess.run(command, check=True)
    core = c.CDLL(str(library))
    core.cutter_size.restype = c.c_size_t
    core.cutter_size.argtypes = [c.c_int, REAL]
    core.cutter_start.restype = c.c_void_p
    core.cutter_start.argtypes = [c.c_void_p, c.c_int, c.c_void_p, REAL, c.c_void_p]
    core.cutter_run.argtypes = [c.c_void_p, c.c_void_p, c.c_int64, c.c_void_p, c.c_void_p]
    core.extract_features.restype = None
    core.extract_features.argtypes = [c.c_void_p, c.c_int, c.c_void_p]
    core.calibration_size.restype = core.calibration_read.restype = c.c_size_t
    core.calibration_read.argtypes = [c.c_void_p, c.c_void_p, c.c_size_t]
    core.estimate_scratch.restype = c.c_size_t
    core.estimate_scratch.argtypes = [c.c_void_p]
    core.estimate.restype = None
    core.estimate.argtypes = [c.c_void_p] * 5
    core.wheel_size.restype = core.state_size.restype = c.c_size_t
    core.wheel_size.argtypes = [c.c_void_p, REAL]
    core.wheel_start.restype = c.c_void_p
    core.wheel_start.argtypes = [c.c_void_p, c.c_void_p, REAL, c.c_int, c.c_int]
    core.wheel_step.argtypes = [c.c_void_p, c.c_void_p, REAL, c.c_int, c.c_void_p, c.c_int]
    core.wheel_outputs.restype = core.state_save.restype = None
    core.wheel_outputs.argtypes = core.state_save.argtypes = [c.c_void_p, c.c_void_p]
    core.state_size.argtypes = [c.c_void_p]
    core.state_restore.argtypes = [c.c_void_p, c.c_char_p, c.c_size_t]
    core.median.restype = REAL
    core.median.argtypes = [c.c_void_p, c.c_size_t]
    return core


class CoreError(Exception):
    """The core met what the reference raises an error for."""


class NativeCutter:
    """`TurnCutter` of the core; takes what that takes."""

    def __init__(
        self, core: c.CDLL, lateral: Sequence[float], rate: float, low_pass: LowPass | None = None
    ) -> None:
        self.core, self.gages = core, len(lateral)
        chosen = low_pass or LowPass()
        cut_off = np.nan if chosen.cut_off is None else chosen.cut_off
        self._memory = c.create_string_buffer(core.cutter_size(self.gages, rate))
        self._cutter = core.cutter_start(
            self._memory,
            self.gages,
            (REAL * self.gages)(*lateral),
            rate,
            c.byref(NativeLowPass(chosen.order, cut_off)),
        )

    def push(
        self, strain: np.ndarray, *, trigger: Any = None, **held: Any
    ) -> Iterator[tuple[NativeTurn, NativeFeatures]]:
        """Yield the turns that a frame completes, each with its features."""
        n = strain.shape[1]
        samples = np.full((n, self.gages + len(HELD) + 1), np.nan)
        samples[:, : self.gages] = strain.T
        for column, name in enumerate(HELD, start=self.gages):
            samples[:, column] = held.get(name, np.nan)
        samples[:, -1] = np.nan if trigger is None else trigger
        taken = c.c_int64(0)
        while True:
            turn, features = NativeTurn(), NativeFeatures()
            found = self.core.cutter_run(
                self._cutter, samples.ctypes.data, n, c.byref(taken), c.byref(turn)
            )
            if found < 0:
                raise CoreError
            if not found:
                return
            self.core.extract_features(c.byref(turn), self.gages, c.byref(features))
            yield turn, features


def _close(name: str, got: Any, wanted: Any, scale: float) -> None:
    """Hold a number of the core against the reference: 1e-9 of it, or of its usual size."""
    np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-9 * scale, err_msg=name)


def assert_same_turn(got: NativeTurn, wanted: Turn) -> None:
    """Hold a turn against the reference: numbers to 1e-9, flags exactly."""
    gages = wanted.offset.size
    assert got.flags == wanted.flags
    assert list(got.gage_flags[:gages]) == wanted.gage_flags.tolist()
    for name in SCALARS:
        _close(name, getattr(got, name), getattr(wanted, name), 1e-3)
    for name in ("offset", "offset_std", "mean"):
        _close(name, getattr(got, name)[:gages], getattr(wanted, name), 1e-2)
    for name, scale in (("strain", 1e-2), ("rate", 1e-1)):
        rows = np.array(getattr(got, name)[: gages * PHI.size]).reshape(gages, PHI.size)
        _close(name, rows, getattr(wanted, name), scale)


SCALES = dict.fromkeys(("cp1", "cp2", "tp", "e_vertical", "e_friction"), 0.01)
"""Usual size of strains and their integrals; that of angles and rates is one."""


def _as_high(strain: np.ndarray, at: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Tell whether each gage's strain is the same at two wheel angles: a curve that stands still
    has its peak anywhere."""
    known = np.isfinite(at) & np.isfinite(wanted)
    here, there = (
        np.array([np.interp(x, PHI, y) for x, y in zip(phi, strain, strict=True)])
        for phi in (at, wanted)
    )
    return known & (np.abs(here - there) < 1e-14)


def assert_same_features(
    got: NativeFeatures, wanted: Features, row: int, strain: np.ndarray
) -> None:
    """Hold a turn's features against the reference: numbers to 1e-9, flags exactly."""
    gages = wanted.lateral.size
    assert got.flags == wanted.flags[row]
    assert list(got.gage_flags[:gages]) == wanted.gage_flags[row].tolist()
    for name in BY_GAGE:
        said, told = np.array(getattr(got, name)[:gages]), getattr(wanted, name)[row]
        if name.endswith("_angle"):
            said = np.where(_as_high(strain, said, told), told, said)
        _close(name, said, told, SCALES.get(name, 1.0))
