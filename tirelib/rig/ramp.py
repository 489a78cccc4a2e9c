"""Runs along which a condition changes: points in time, on straight lines between them.

The rig is steady at every solved point (quasi-steady): relaxation and belt dynamics are not in it.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from tirelib.core.errors import ParameterError
from tirelib.rig.tire import Condition

STEPS = {
    "load": 400.0,
    "slip_angle": 0.01,
    "slip_ratio": 0.01,
    "speed": 3.0,
    "pressure": 2e4,
    "camber": 0.02,
}
"""Farthest that two solutions lie apart, SI."""


@dataclass(frozen=True, slots=True)
class Point:
    """Conditions at a time of the run, [s]."""

    time: float
    condition: Condition


@dataclass(frozen=True)
class Ramp:
    """A run whose conditions change; `about` describes the change in a few words.

    Raises
    ------
    ParameterError
        If the times do not grow from zero, the road changes, or only some points have a slip ratio.
    """

    about: str
    points: tuple[Point, ...]

    def __post_init__(self) -> None:
        times = [point.time for point in self.points]
        if len(times) < 2 or times[0] != 0.0 or any(b <= a for a, b in pairwise(times)):
            raise ParameterError(
                f"rig ramp {self.about!r}, times {times}; allowed are two or more that grow from "
                "0 s; correct them"
            )
        same = {
            (c.slip_ratio is None, c.friction, c.tread_depth)
            for c in (point.condition for point in self.points)
        }
        if len(same) > 1:
            raise ParameterError(
                f"rig ramp {self.about!r}: friction, tread depth or free rolling changes along it; "
                "allowed is one road and a slip ratio at all points or at none; correct the points"
            )


Nominal = Condition | Ramp
"""Set points of a run: steady ones, or a ramp."""


def points_of(run: Nominal) -> tuple[Point, ...]:
    """Return the points of a run; a steady one has a single point, at 0 s."""
    return run.points if isinstance(run, Ramp) else (Point(0.0, run),)


def changed(run: Nominal, change: Callable[[Condition], Condition]) -> Nominal:
    """Return a run with each of its conditions changed."""
    if isinstance(run, Condition):
        return change(run)
    return replace(run, points=tuple(replace(p, condition=change(p.condition)) for p in run.points))


def set_point(run: Nominal, name: str) -> float:
    """Return a set point, SI: NaN where it varies, 0 for the slip ratio of free rolling."""
    values = {getattr(point.condition, name) or 0.0 for point in points_of(run)}
    return float(values.pop()) if len(values) == 1 else math.nan


def dense(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the points and as many between them as `STEPS` asks for."""
    out: list[Point] = [points[0]]
    for a, b in pairwise(points):
        moves = [
            abs((getattr(b.condition, n) or 0.0) - (getattr(a.condition, n) or 0.0)) / step
            for n, step in STEPS.items()
        ]
        parts = max(1, math.ceil(max(moves) - 1e-9))
        out += [_between(a, b, part / parts) for part in range(1, parts + 1)]
    return tuple(out)


def _between(a: Point, b: Point, share: float) -> Point:
    names = [n for n in STEPS if getattr(a.condition, n) is not None]
    mixed = {
        n: (1.0 - share) * getattr(a.condition, n) + share * getattr(b.condition, n) for n in names
    }
    time = (1.0 - share) * a.time + share * b.time
    return Point(time, replace(a.condition, **mixed))
