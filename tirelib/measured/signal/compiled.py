"""Turns cut by the compiled core, see `tirelib.core.compiled`."""

import ctypes as c
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.compiled import (
    TURN_ROWS,
    TURN_SCALARS,
    Core,
    LowPassStruct,
    TurnStruct,
    address,
    block_of,
    columns_of,
)
from tirelib.core.errors import ParameterError
from tirelib.core.held import HELD, Held
from tirelib.measured.signal.lowpass import LowPass
from tirelib.measured.signal.turn import PHI, Turns, turns_of

BLOCK = 32
"""Turns that the core gives at a time."""


class Record:
    """A whole record in the core; parameters as in `tirelib.measured.signal.cut_turns`.

    `room` is memory of ``core.cutter_size`` bytes, which is the record's as long as it is cut.
    """

    def __init__(
        self,
        core: Core,
        room: FloatArray,
        strain: FloatArray,
        lateral: FloatArray,
        rate: float,
        low_pass: LowPass,
        held: Held,
        trigger: BoolArray | None,
    ) -> None:
        self._columns, self._kept = columns_of(strain, held, HELD, trigger)
        positions = np.ascontiguousarray(lateral, dtype=np.float64)
        self._memory = room
        self._cutter = core.cutter_start(
            address(room),
            lateral.size,
            address(positions),
            rate,
            c.byref(low_pass_struct(low_pass)),
        )
        self._size, self._taken = strain.shape[1], c.c_int64(0)

    def cut(self, function: Any, *arguments: int) -> int:
        """Return how many turns a cutting function of the core gives: fewer than BLOCK at the end.

        Raises
        ------
        ParameterError
            If the filter would reach beyond the samples.
        """
        taken = c.byref(self._taken)
        found = int(function(self._cutter, self._columns, self._size, taken, *arguments, BLOCK))
        if found < 0:
            raise beyond_samples(self._taken.value)
        return found


def cut_by_core(core: Core, record: Record, lateral: FloatArray, rate: float) -> Turns:
    """Return the turns of a record."""
    block = block_of(TurnStruct, BLOCK)
    parts, found = [], BLOCK
    while found == BLOCK:
        found = record.cut(core.cut, block.ctypes.data)
        parts.append(turn_columns(block[:found], lateral.size))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return turns_of(columns, lateral, rate)


def low_pass_struct(low_pass: LowPass) -> LowPassStruct:
    """Return a filter as the core has it."""
    return LowPassStruct(low_pass.order, np.nan if low_pass.cut_off is None else low_pass.cut_off)


def beyond_samples(sample: int) -> ParameterError:
    """Return the error of a filter that reaches beyond the samples of a turn."""
    return ParameterError(
        f"turn that ends before sample {sample}: its filter needs samples that are not kept; the "
        "turn lasts too long or changes its rate too much; leave this part of the record out"
    )


def turn_columns(block: Any, gages: int) -> dict[str, Any]:
    """Return copies of the columns of a block of turns, by the names of `Turn`."""
    found = {name: block[name].copy() for name in TURN_SCALARS}
    found |= {name: block[name][:, :gages].copy() for name in (*TURN_ROWS, "gage_flags")}
    for name in ("strain", "rate"):
        curves = block[name][:, : gages * PHI.size].copy()
        found[name] = curves.reshape(len(block), gages, PHI.size)
    found["flags"] = block["flags"].copy()
    return found
