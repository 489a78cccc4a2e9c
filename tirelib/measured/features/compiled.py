"""Features read by the compiled core, see `tirelib.core.compiled`."""

from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.compiled import (
    FEATURE_ROWS,
    GAGES,
    TURN_ROWS,
    TURN_SCALARS,
    Core,
    FeatureStruct,
    HeadStruct,
    TurnStruct,
    block_of,
    memory,
    reals_of,
)
from tirelib.core.held import Held
from tirelib.measured.signal.compiled import BLOCK, Record
from tirelib.measured.signal.lowpass import LowPass
from tirelib.measured.signal.turn import Turns

ROOM = 256
"""Turns for which the core has room to write at a time. It decides about memory alone: for further
turns the room is made anew, and the features are the same."""


def read_by_core(core: Core, turns: Turns) -> tuple[dict[str, FloatArray], IntArray, IntArray]:
    """Return what is read from the curves of the turns, by the names of `Features`, and flags.

    Returns
    -------
    read : dict of arrays, shape (n, n_gages)
    gage_flags : shape (n, n_gages)
    flags : shape (n,)
    """
    n, gages = len(turns), turns.trace.lateral.size
    given, found = block_of(TurnStruct, min(n, BLOCK)), block_of(FeatureStruct, n)
    for first in range(0, n, BLOCK):
        rows = slice(first, min(first + BLOCK, n))
        part = given[: rows.stop - first]
        for name, source in (("strain", turns.trace.strain), ("rate", turns.trace.rate)):
            curves = source[rows].reshape(len(part), -1)
            part[name][:, : curves.shape[1]] = curves
        part["pulse"] = turns.trace.pulse[rows]
        part["flags"] = turns.flags[rows]
        part["gage_flags"][:, :gages] = turns.gage_flags[rows]
        core.features(part.ctypes.data, len(part), gages, found[rows].ctypes.data)
    return feature_columns(found, gages)


class CompiledRecords:
    """Features of the turns of records, one after the other, without keeping the curves.

    Parameters
    ----------
    core : Core
    lateral : array, shape (n_gages,), [m]
    """

    def __init__(self, core: Core, lateral: FloatArray) -> None:
        self._core, self._lateral = core, lateral
        self._turn, self._room = block_of(TurnStruct, 1), memory(0)
        self._parts: list[dict[str, Any]] = []
        self._begin()

    def _begin(self) -> None:
        """Begin with empty blocks of heads and features."""
        self._heads, self._found = block_of(HeadStruct, ROOM), block_of(FeatureStruct, ROOM)
        blocks = (self._turn, self._heads, self._found)
        self._places = [(block.ctypes.data, block.itemsize) for block in blocks]
        self._used = 0

    def fits(self, rate: float) -> bool:
        """Tell whether the core cuts records of these gages at a sample rate [Hz]."""
        size = self._core.cutter_size(self._lateral.size, rate)
        if size > self._room.nbytes:
            self._room = memory(size)
        return bool(size)

    def add(
        self,
        strain: FloatArray,
        rate: float,
        low_pass: LowPass,
        held: Held,
        trigger: BoolArray | None,
        start: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Take a record at a rate that fits; see `tirelib.measured.features.RecordReader.add`."""
        record = Record(
            self._core, self._room, strain, self._lateral, rate, low_pass, held, trigger
        )
        contacts, found = [], BLOCK
        while found == BLOCK:
            if self._used + BLOCK > ROOM:
                self._close()
            (turn, _), *places = self._places
            at = [place + self._used * size for place, size in places]
            found = record.cut(self._core.cut_features, turn, *at)
            heads = self._heads[self._used : self._used + found]
            if start:
                heads["time"] += start
                heads["ready"] += start
            contacts.append((heads["time"].copy(), heads["omega"].copy()))
            self._used += found
        if len(contacts) == 1:
            return contacts[0]
        time, omega = (np.concatenate(parts) for parts in zip(*contacts, strict=True))
        return time, omega

    def _close(self) -> None:
        """Read what is in the blocks, and begin new ones."""
        heads, found = self._heads[: self._used], self._found[: self._used]
        self._parts.append(attributes_of(heads, found, self._lateral.size))
        self._begin()

    def take(self) -> dict[str, Any]:
        """Return the attributes of `Features` of the records since the last time."""
        self._close()
        parts, self._parts = self._parts, []
        if len(parts) == 1:
            return parts[0]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def attributes_of(turns: Any, features: Any, gages: int) -> dict[str, Any]:
    """Return the attributes of `Features`, of blocks of turns (or their heads) and features."""
    read, gage_flags, flags = feature_columns(features, gages)
    scalars, size = len(TURN_SCALARS), len(TURN_SCALARS) + len(TURN_ROWS) * GAGES
    numbers = reals_of(turns, size)
    found = {name: numbers[:, k] for k, name in enumerate(TURN_SCALARS) if name != "pulse"}
    rows = numbers[:, scalars:].reshape(len(numbers), len(TURN_ROWS), GAGES)
    found |= {name: rows[:, k, :gages] for k, name in enumerate(TURN_ROWS)}
    return {**found, **read, "gage_flags": gage_flags, "flags": flags}


def feature_columns(block: Any, gages: int) -> tuple[dict[str, FloatArray], IntArray, IntArray]:
    """Return copies of the columns of a block of features, as `read_by_core` does."""
    rows = reals_of(block, len(FEATURE_ROWS) * GAGES).reshape(len(block), len(FEATURE_ROWS), GAGES)
    read = {name: rows[:, k, :gages] for k, name in enumerate(FEATURE_ROWS)}
    return read, block["gage_flags"][:, :gages].astype(np.int64), block["flags"].astype(np.int64)
