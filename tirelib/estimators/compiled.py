"""Estimates of the compiled core, see `tirelib.core.compiled`."""

from collections import OrderedDict
from functools import lru_cache
from typing import Any

import numpy as np

from tirelib.core.compiled import (
    CONDITIONS,
    FEATURE_ROWS,
    Core,
    EstimateStruct,
    FeatureStruct,
    TurnStruct,
    block_of,
    loaded_core,
    memory,
)
from tirelib.core.errors import FormatError
from tirelib.estimators.core_table import flat_table
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.estimators.gage_chains import GageChains
from tirelib.measured.features.extract import Features

NOTES = (
    *(f"{quantity}_out_of_range" for quantity in QUANTITIES),
    *("alpha_saturated", "condition_extrapolated", "camber_unknown"),
    *("friction_implausible", "tread_depth_implausible", "tread_temperature_implausible"),
    *("pressure_out_of_range", "speed_out_of_range", "camber_out_of_range"),
)
"""Notes by the number of their bit in ``estimates.h``."""
ROLLING = ("unknown", "free", "braking", "driving")
"""In the order of ``estimates.h``."""
BLOCK = 128
"""Turns that the core takes at a time."""
KEPT = 4
"""Calibrations that are kept as the core has them."""


class CoreCalibration:
    """A calibration as the core has it.

    Parameters
    ----------
    core : Core
    calibration : GageChains

    Raises
    ------
    FormatError
        If the core does not know a regressor of the calibration.
    """

    def __init__(self, core: Core, calibration: GageChains) -> None:
        self.core, self.gages = core, len(calibration.lateral)
        self._table = flat_table(calibration)
        self._memory = memory(core.calibration_size())
        self.address = self._memory.ctypes.data
        place = core.calibration_read(self.address, self._table.ctypes.data, self._table.size)
        if place:
            raise FormatError(
                f"compiled core: number {place} of {self._table.size} of the calibration is not "
                "one that it allows; calibrate anew"
            )

    def estimate(self, features: Features) -> Estimates:
        """Estimate every turn; as `GageChains.reference_estimate`."""
        n = len(features)
        size = min(n, BLOCK)
        turns, given = block_of(TurnStruct, size), block_of(FeatureStruct, size)
        found = block_of(EstimateStruct, n)
        scratch = memory(8 * self.core.estimate_scratch(self.address))
        for first in range(0, n, BLOCK):
            rows = slice(first, min(first + BLOCK, n))
            many = rows.stop - first
            for name in ("omega", "angle_std", "slip_std", *CONDITIONS):
                turns[name][:many] = getattr(features, name)[rows]
            turns["offset_std"][:many, : self.gages] = features.offset_std[rows]
            for name in (*FEATURE_ROWS, "gage_flags"):
                given[name][:many, : self.gages] = getattr(features, name)[rows]
            given["flags"][:many] = features.flags[rows]
            self.core.estimates(
                self.address,
                turns.ctypes.data,
                given.ctypes.data,
                many,
                scratch.ctypes.data,
                found[rows].ctypes.data,
            )
        return estimates_of(found, self.gages)


def estimates_of(block: Any, gages: int) -> Estimates:
    """Return the estimates of a block of structures."""
    columns = list(enumerate(QUANTITIES))
    return Estimates(
        value={name: block["value"][:, q].copy() for q, name in columns},
        std={name: block["std"][:, q].copy() for q, name in columns},
        valid={name: block["valid"][:, q] != 0 for q, name in columns},
        turn_valid=block["turn_valid"] != 0,
        flags=block["flags"].astype(np.int64),
        notes=tuple(map(_notes, block["notes"].tolist())),
        rolling=tuple(ROLLING[kind] for kind in block["rolling"].tolist()),
        radius=block["radius"].copy(),
        contact_length=block["contact_length"][:, :gages].copy(),
        contact_length_std=block["contact_length_std"][:, :gages].copy(),
    )


@lru_cache(maxsize=1024)
def _notes(bits: int) -> tuple[str, ...]:
    return tuple(name for number, name in enumerate(NOTES) if bits & 1 << number)


_known: OrderedDict[int, tuple[GageChains, CoreCalibration | None]] = OrderedDict()


def core_calibration(calibration: GageChains) -> CoreCalibration | None:
    """Return a calibration as the core has it; None where numpy has to compute.

    That is where there is no core for this machine, or the calibration has a regressor, or more of
    them, than the core was made for. The last few are kept.
    """
    core = loaded_core()
    if core is None:
        return None
    kept = _known.pop(id(calibration), None)
    if kept is None or kept[0] is not calibration:
        try:
            kept = calibration, CoreCalibration(core, calibration)
        except FormatError:
            kept = calibration, None
    _known[id(calibration)] = kept
    while len(_known) > KEPT:
        _known.popitem(last=False)
    return kept[1]
