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

from tirelib.core.compiled import FEATURE_ROWS, TURN_SCALARS, FeatureStruct, TurnStruct, columns_of
from tirelib.core.held import HELD
from tirelib.measured.features.extract import Features
from tirelib.measured.signal import LowPass, Turn
from tirelib.measured.signal.compiled import low_pass_struct
from tirelib.measured.signal.turns import PHI

SOURCE = Path(__file__).parents[2] / "fmu_src" / "core"
FLAGS = (*native_fmu.C99, *native_fmu.STRICT, "-Wconversion", "-Wno-sign-conversion")
REAL = c.c_double
SCALARS, BY_GAGE = TURN_SCALARS, FEATURE_ROWS
NativeTurn, NativeFeatures = TurnStruct, FeatureStruct


def compiled(folder: Path) -> None:
    """Compile the core; skip without a C compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    sources = sorted(map(str, SOURCE.glob("*.c")))
    command = [
        compiler,
        *FLAGS,
        "-O2",
        "-shared",
        "-fPIC",
        *sources,
        "-lm",
        "-o",
        str(folder / "core.so"),
    ]
    subprocess.run(command, check=True)


def loaded(folder: Path) -> c.CDLL:
    """Return the core that was compiled into a folder."""
    core = c.CDLL(str(folder / "core.so"))
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
        self._memory = c.create_string_buffer(core.cutter_size(self.gages, rate))
        self._cutter = core.cutter_start(
            self._memory,
            self.gages,
            (REAL * self.gages)(*lateral),
            rate,
            c.byref(low_pass_struct(low_pass or LowPass())),
        )

    def push(
        self, strain: np.ndarray, *, trigger: Any = None, **held: Any
    ) -> Iterator[tuple[NativeTurn, NativeFeatures]]:
        """Yield the turns that a frame completes, each with its features."""
        n = strain.shape[1]
        columns, kept = columns_of(strain, held, HELD, trigger)
        taken = c.c_int64(0)
        while True:
            turn, features = NativeTurn(), NativeFeatures()
            found = self.core.cutter_run(self._cutter, columns, n, c.byref(taken), c.byref(turn))
            if found < 0:
                raise CoreError
            if not found:
                del kept  # until here the core read them
                return
            self.core.extract_features(c.byref(turn), self.gages, c.byref(features))
            yield turn, features


def close(name: str, got: Any, wanted: Any, scale: float) -> None:
    """Hold a number of the core against the reference: 1e-9 of it, or of its usual size."""
    if isinstance(got, float):
        number = float(wanted)
        if abs(got - number) <= 1e-9 * (scale + abs(number)) < np.inf:
            return  # numpy takes thirty times as long to say so of one number
    np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-9 * scale, err_msg=name)


def assert_same_turn(got: NativeTurn, wanted: Turn) -> None:
    """Hold a turn against the reference: numbers to 1e-9, flags exactly."""
    gages = wanted.offset.size
    assert got.flags == wanted.flags
    assert list(got.gage_flags[:gages]) == wanted.gage_flags.tolist()
    for name in SCALARS:
        close(name, getattr(got, name), getattr(wanted, name), 1e-3)
    for name in ("offset", "offset_std", "mean"):
        close(name, getattr(got, name)[:gages], getattr(wanted, name), 1e-2)
    for name, scale in (("strain", 1e-2), ("rate", 1e-1)):
        rows = np.array(getattr(got, name)[: gages * PHI.size]).reshape(gages, PHI.size)
        close(name, rows, getattr(wanted, name), scale)


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
        close(name, said, told, SCALES.get(name, 1.0))
