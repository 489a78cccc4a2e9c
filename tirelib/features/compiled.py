"""Features read by the compiled core, see `tirelib.core`."""

from typing import Any

import numpy as np

from tirelib.arrays import FloatArray, IntArray
from tirelib.core import (
    FEATURE_ROWS,
    GAGES,
    TURN_ROWS,
    TURN_SCALARS,
    Core,
    FeatureStruct,
    HeadStruct,
    TurnStruct,
    block_of,
    reals_of,
)
from tirelib.signal.compiled import BLOCK, Record
from tirelib.signal.turn import Turns


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


def record_by_core(core: Core, record: Record, gages: int) -> dict[str, Any]:
    """Return the attributes of `Features` of a record's turns, without keeping their curves."""
    turn, heads = block_of(TurnStruct, 1), block_of(HeadStruct, BLOCK)
    found = block_of(FeatureStruct, BLOCK)
    parts: list[dict[str, Any]] = []
    places = turn.ctypes.data, heads.ctypes.data, found.ctypes.data
    for n in record.blocks(core.cut_features, *places):
        parts.append(attributes_of(heads[:n], found[:n], gages))
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
