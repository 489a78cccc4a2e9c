"""Estimates of the native core, called through ctypes."""

import ctypes as c

import numpy as np

from tests.native.core import BY_GAGE, SCALARS, NativeFeatures, NativeTurn, close
from tirelib.core.compiled import EstimateStruct
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.compiled import NOTES, ROLLING
from tirelib.estimators.core_table import flat_table
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.measured.features.extract import Features

SIZE = {"Fz": 1e2, "alpha": 1e-2, "kappa": 1e-2, "Fy": 1e2}
"""Usual size of a quantity, SI, of which 1e-9 is as good as none."""


NativeEstimates = EstimateStruct


class NativeCalibration:
    """A calibration in the core."""

    def __init__(self, core: c.CDLL, calibration: Calibration) -> None:
        self.core, self.gages = core, len(calibration.lateral)
        self._table = flat_table(calibration)
        self._memory = c.create_string_buffer(core.calibration_size())
        place = core.calibration_read(self._memory, self._table.ctypes.data, self._table.size)
        assert place == 0, f"the table is damaged at {place} of {self._table.size}"
        self._scratch = np.empty(core.estimate_scratch(self._memory))

    def estimate(self, turn: NativeTurn, features: NativeFeatures) -> NativeEstimates:
        found = NativeEstimates()
        self.core.estimate(
            self._memory,
            c.byref(turn),
            c.byref(features),
            self._scratch.ctypes.data,
            c.byref(found),
        )
        return found

    def row(self, features: Features, row: int) -> NativeEstimates:
        """Estimate one row of features."""
        turn, given = NativeTurn(), NativeFeatures()
        for name in set(SCALARS) - {"pulse"}:
            setattr(turn, name, getattr(features, name)[row])
        turn.offset_std[: self.gages] = features.offset_std[row].tolist()
        for name in BY_GAGE:
            getattr(given, name)[: self.gages] = getattr(features, name)[row].tolist()
        given.gage_flags[: self.gages] = features.gage_flags[row].tolist()
        given.flags = int(features.flags[row])
        return self.estimate(turn, given)


def assert_same_estimates(got: NativeEstimates, wanted: Estimates, row: int) -> None:
    """Hold the estimates of a turn against the reference: numbers to 1e-9, flags exactly."""
    gages = wanted.contact_length.shape[1]
    notes = tuple(name for bit, name in enumerate(NOTES) if got.notes & 1 << bit)
    assert got.flags == wanted.flags[row]
    assert notes == wanted.notes[row]
    assert ROLLING[got.rolling] == wanted.rolling[row]
    assert bool(got.turn_valid) == wanted.turn_valid[row]
    for index, name in enumerate(QUANTITIES):
        assert bool(got.valid[index]) == wanted.valid[name][row], name
        for kind in ("value", "std"):
            close(name, getattr(got, kind)[index], getattr(wanted, kind)[name][row], SIZE[name])
    close("radius", got.radius, wanted.radius[row], 0.1)
    for name in ("contact_length", "contact_length_std"):
        close(name, getattr(got, name)[:gages], getattr(wanted, name)[row], 0.1)
