"""Which constants of the brush are fitted with a force, and where a move of them leads."""

from collections.abc import Mapping, Sequence

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.brush_fit import LOAD_RATIO
from tirelib.inference.identify.brush_law import SPECS
from tirelib.inference.identify.force_bench import ForceBench

COORDINATES: Mapping[str, tuple[str, ...]] = {
    "Fy": ("lateral_stiffness", "friction", "load_power", "slip_angle_offset", "Fy_offset"),
    "Fx": ("longitudinal_stiffness", "friction", "load_power", "slip_ratio_offset", "Fx_offset"),
    "Mz": (
        "lateral_stiffness",
        "friction",
        "half_length",
        "load_power",
        "slip_angle_offset",
        "Mz_offset",
    ),
}
"""Constants that are fitted with each force; the others stay as the model has them."""
OF_CONTACT = ("half_length", "load_power")
"""Constants that have no part where a ring gives the contact's length."""


def fitted_constants(bench: ForceBench, quantity: str) -> tuple[str, ...]:
    """Return the constants of the brush that points of a force can fit."""
    load = bench.conditions.load
    out = OF_CONTACT if bench.half is not None else ()
    if load.max() < LOAD_RATIO * load.min():
        out = (*out, "load_power")
    return tuple(name for name in COORDINATES[quantity] if name not in out)


def moved_constants(
    values: Mapping[str, float], names: Sequence[str], moves: FloatArray
) -> dict[str, float]:
    """Return constants with the named ones moved: by factors exp(move), or by sizes."""
    out = dict(values)
    for name, move in zip(names, moves, strict=True):
        spec, old = SPECS[name], out.get(name, 0.0)
        out[name] = old * float(np.exp(move)) if spec.log else old + spec.size * float(move)
    return out
