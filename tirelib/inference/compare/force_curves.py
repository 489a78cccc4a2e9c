"""The points of a force in curves: one curve over the slip for every set point."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray, rms
from tirelib.inference.compare.force_model import slip_of
from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.sentences import set_point, told
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_points import CELL_ANGLE, CELL_RATIO

LEAST_POINTS = 3
"""Points that a curve has at least."""


@dataclass(frozen=True, slots=True)
class Curve:
    """Points at equal load, pressure and camber.

    Attributes
    ----------
    load, pressure, camber : float, SI
        Means; NaN where unknown.
    member : shape (n,)
        Numbers of the points, by rising slip.
    rms : float
        Rms of model less measured, in the unit of the force.
    """

    load: float
    pressure: float
    camber: float
    member: IntArray
    rms: float
    words: str

    @property
    def points(self) -> int:
        """How many points it has."""
        return int(self.member.size)


def set_point_levels(data: ForceData) -> dict[str, IntArray]:
    """Return numbers of the set points of points, each of shape (n,), by condition.

    Points of one number are at one set point: they differ by no more than the rig's scatter.
    """

    def cells(values: FloatArray, size: float) -> IntArray:
        return np.round(np.nan_to_num(values) / size).astype(np.int64)

    return {
        "load": levels(data.load),
        "pressure": levels(data.pressure),
        "speed": levels(np.abs(data.speed)),
        "slip_angle": cells(data.slip_angle, CELL_ANGLE),
        "camber": cells(data.camber, CELL_ANGLE),
        "slip_ratio": cells(data.slip_ratio, CELL_RATIO),
    }


def curves_of(found: ForceComparison) -> tuple[Curve, ...]:
    """Return the curves with enough points, the best first."""
    data = found.data
    slip = getattr(data, slip_of(found.quantity))
    level = set_point_levels(data)
    keys = np.stack([level[name] for name in ("load", "pressure", "camber")], axis=1)
    several = [np.unique(column).size > 1 for column in keys.T]
    out = []
    for key in np.unique(keys, axis=0):
        member = np.flatnonzero((keys == key).all(axis=1))
        if member.size < LEAST_POINTS:
            continue
        member = member[np.argsort(slip[member], kind="stable")]
        load, pressure = (
            float(getattr(data, name)[member].mean()) for name in ("load", "pressure")
        )
        angle = float(key[2] * CELL_ANGLE)
        words = set_point("load", load) if np.isfinite(load) else "load unknown"
        if several[1] and np.isfinite(pressure):
            words += f", {set_point('pressure', pressure)}"
        if several[2]:
            words += f", camber {told('camber', angle)}"
        left = rms(found.difference[member])
        out.append(Curve(load, pressure, angle, member, left, words))
    return tuple(sorted(out, key=lambda curve: curve.rms))


def ranked(curves: tuple[Curve, ...]) -> dict[str, Curve]:
    """Return the best, the median and the worst curve; each once."""
    if not curves:
        return {}
    places = {"best": 0, "median": (len(curves) - 1) // 2, "worst": len(curves) - 1}
    out: dict[str, Curve] = {}
    for name, place in places.items():
        if all(curve is not curves[place] for curve in out.values()):
            out[name] = curves[place]
    return out
