"""A wheel of the native core, called through ctypes."""

import ctypes as c
from typing import Any

import numpy as np

from tirelib.core.compiled import OutputStruct
from tirelib.core.flags import flag_names
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.compiled import NOTES, ROLLING
from tirelib.estimators.core_table import flat_table

AXES = ("iso", "sae", "adapted_sae")
REASONS = {-1: "whole number", -2: "longest turn", -3: "samples = ", -4: "fault"}


class NativeWheel:
    """`tirelib.fmu.wheel.Wheel` of the core; takes and gives what that does."""

    def __init__(
        self,
        core: c.CDLL,
        calibration: Calibration,
        rate: float,
        samples: int,
        axes: str = "iso",
    ) -> None:
        self.core, self.gages = core, len(calibration.lateral)
        self._table = flat_table(calibration)
        self._known = c.create_string_buffer(core.calibration_size())
        assert core.calibration_read(self._known, self._table.ctypes.data, self._table.size) == 0
        size = core.wheel_size(self._known, rate)
        assert size
        self._memory = c.create_string_buffer(size)
        self._wheel = core.wheel_start(self._memory, self._known, rate, samples, AXES.index(axes))

    def step(
        self,
        frame: np.ndarray,
        step: float,
        valid: bool,
        conditions: np.ndarray,
        count: int | None = None,
    ) -> int:
        """Return what the core does."""
        return int(
            self.core.wheel_step(
                self._wheel,
                frame.ctypes.data,
                step,
                int(valid),
                conditions.ctypes.data,
                -1 if count is None else count,
            )
        )

    def outputs(self) -> tuple[tuple[float, ...], tuple[Any, ...]]:
        """Return the values of the Real outputs and of the others, in the table's order."""
        out = OutputStruct()
        self.core.wheel_outputs(self._wheel, c.byref(out))
        notes = [name for bit, name in enumerate(NOTES) if out.notes & 1 << bit]
        reals = (
            *(*out.value, *out.std),
            *out.contact_length[: self.gages],
            *out.contact_length_std[: self.gages],
            *(out.rolling_radius, out.turn_rate, out.contact_time, out.age),
        )
        others = (
            *(out.turn, out.flags, bool(out.valid), *map(bool, out.valid_of)),
            ROLLING[out.rolling],
            ";".join((*flag_names(out.flags), *notes)),
        )
        return reals, others

    def state(self) -> bytes:
        """Return the exact state."""
        bytes_ = c.create_string_buffer(self.core.state_size(self._wheel))
        self.core.state_save(self._wheel, bytes_)
        return bytes_.raw

    def restore(self, state: bytes) -> bool:
        """Take up a state; tell whether it is one."""
        return bool(self.core.state_restore(self._wheel, state, len(state)))
