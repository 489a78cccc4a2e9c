"""Test plans as data: lists of nominal conditions, with the dissertation's tables as presets.

Loads in percent refer to `REFERENCE_LOAD`. Table 3-1 is `set1`, Table 3-2 `set2` and
`brake_drive`, Table 3-3 `set3` and `set3_cornering`.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from tirelib.core.errors import ParameterError
from tirelib.rig.ramp import Nominal, Point, Ramp, changed
from tirelib.rig.tire import Condition

REFERENCE_LOAD = 4800.0
KMH = 1.0 / 3.6
BAR = 1e5
DEG = float(np.pi / 180.0)

SWEEP = (-2, 0, 2, 4, 5, 3, 1, -1, -3, -5, -4)
"""Slip angles of Table 3-1 in the order in which the sweep passes them [deg]."""
WIDE_SWEEP = (-2, 0, 2, 4, 6, 9, 12, 15, 10, 8, 5, 3, 1, -1, -3, -5, -8, -10, -15, -12, -6, -4)
SLIPS = (0.005, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.45, 0.6)
BEFORE, AFTER = 0.6, 0.3
"""Time that a ramp's ends are held, [s]: a turn takes 0.24 s at 30 km/h."""


@dataclass(frozen=True)
class Plan:
    """Runs in order of measurement, what they are for, and the usual number of repeats."""

    name: str
    about: str
    conditions: tuple[Nominal, ...]
    repeats: int = 0


def kind(cond: Nominal) -> str:
    """Name the kind of a run as `runs.csv` does."""
    if isinstance(cond, Ramp):
        return "sweep"
    slip = cond.slip_ratio or 0.0
    if slip and (cond.slip_angle or cond.camber):
        return "combined"
    if slip:
        return "drive" if slip > 0.0 else "brake"
    if cond.camber:
        return "camber"
    return "corner" if cond.slip_angle else "free"


def with_repeats(plan: Plan, repeats: int) -> tuple[Nominal, ...]:
    """Append repeats: conditions spread evenly over the plan, whatever the seed."""
    n = len(plan.conditions)
    if not 0 <= repeats <= n:
        raise ParameterError(
            f"plan {plan.name}, repeats = {repeats}; allowed are 0 to {n}, the runs of the plan; "
            "give another number"
        )
    again = [plan.conditions[int((i + 0.5) * n / repeats)] for i in range(repeats)]
    return plan.conditions + tuple(again)


def on_one_road(plan: Plan, friction: float | None, tread_depth: float | None) -> Plan:
    """Return the plan on a road of this friction [1] with this tread left [m]; None: as it was."""
    given = {"friction": friction, "tread_depth": tread_depth}
    said = {name: value for name, value in given.items() if value is not None}
    runs = tuple(changed(run, lambda c: replace(c, **said)) for run in plan.conditions)
    return replace(plan, conditions=runs)


def _at(
    load: float = REFERENCE_LOAD,
    bar: float = 2.3,
    kmh: float = 65.0,
    slip_angle: float = 0.0,
    camber: float = 0.0,
    slip_ratio: float | None = None,
) -> Condition:
    return Condition(load, bar * BAR, kmh * KMH, slip_angle * DEG, camber * DEG, slip_ratio)


def _loads(percent: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(REFERENCE_LOAD * p / 100.0 for p in percent)


def _set1() -> Plan:
    loads = _loads((25.0, 62.5, 100.0, 137.5, 175.0))
    runs = tuple(_at(load, slip_angle=a) for load in loads for a in SWEEP)
    return Plan("set1", "Table 3-1: 5 loads x 11 slip angles, 65 km/h, 2.3 bar", runs)


def _set2() -> Plan:
    runs = tuple(_at(slip_angle=a, camber=c) for c in (-4, 0, 4) for a in WIDE_SWEEP)
    return Plan("set2", "Table 3-2: camber -4, 0, 4 deg x slip angle to 15 deg", runs)


def _brake_drive() -> Plan:
    slips = (None, *SLIPS, None, *(-s for s in SLIPS))
    runs = tuple(_at(slip_ratio=s) for s in slips)
    return Plan("brake_drive", "Table 3-2: slip ratio -0.6 to 0.6 at 100 % load", runs)


def _set3() -> Plan:
    speeds = tuple(_at(bar=2.1, kmh=v) for v in (10, 30, 50, 70, 80, 100, 150))
    grid = tuple(
        _at(load, bar) for bar in (2.5, 2.1, 1.7, 1.3) for load in _loads((60.0, 100.0, 140.0))
    )
    return Plan("set3", "Table 3-3, straight: 7 speeds; 3 loads x 4 pressures", speeds + grid)


def _set3_cornering() -> Plan:
    runs = tuple(
        _at(load, bar, slip_angle=a)
        for bar in (2.5, 2.1, 1.7, 1.3)
        for load in _loads((60.0, 100.0, 140.0))
        for a in SWEEP
    )
    return Plan("set3_cornering", "Table 3-3, slip angle: 3 loads x 4 pressures x 11", runs)


def _combined() -> Plan:
    slips = (-0.1, -0.03, None, 0.03, 0.1)
    runs = tuple(_at(slip_angle=a, slip_ratio=s) for a in (-4, -2, 0, 2, 4) for s in slips)
    return Plan("combined", "slip angle with slip ratio at 100 % load", runs)


def _straight() -> Plan:
    runs = tuple(
        _at(load, bar, kmh)
        for bar in (1.7, 2.1, 2.5)
        for kmh in (30, 65, 100, 130)
        for load in _loads((50.0, 75.0, 100.0, 125.0, 150.0))
    )
    return Plan("straight", "5 loads x 3 pressures x 4 speeds and 6 repeats", runs, repeats=6)


def _short() -> Plan:
    runs = tuple(
        _at(load, bar, kmh)
        for bar in (1.9, 2.5)
        for kmh in (40, 110)
        for load in _loads((60.0, 100.0, 140.0))
    )
    return Plan("short", "3 loads x 2 pressures x 2 speeds and 3 repeats", runs, repeats=3)


def _along(about: str, start: Condition, name: str, *corners: tuple[float, float]) -> Ramp:
    """Return a ramp of one condition, held before and after; corners are times [s], values."""
    first, last = corners[0], corners[-1]
    held = (
        (0.0, first[1]),
        *((BEFORE + time, value) for time, value in corners),
        (BEFORE + last[0] + AFTER, last[1]),
    )
    return Ramp(about, tuple(Point(t, replace(start, **{name: value})) for t, value in held))


def _ramps_at(load: float) -> Iterator[Ramp]:
    slow, fast = 30.0 * KMH, 90.0 * KMH
    for rate in (2.0, -2.0, 4.0, -4.0, -8.0):
        first, last = (slow, fast) if rate > 0.0 else (fast, slow)
        ends = (0.0, first), ((last - first) / rate, last)
        yield _along(f"speed {rate:+g} m/s2", _at(load), "speed", *ends)
    for about, corners in (
        ("brake", ((0.0, 0.0), (0.5, -0.06), (1.0, 0.0))),
        ("throttle", ((0.0, 0.0), (0.5, 0.02))),
    ):
        yield _along(about, _at(load, slip_ratio=0.0), "slip_ratio", *corners)
    for rate in (2.0, 8.0):
        turned = ((0.0, 0.0), (4.0 / rate, 4.0 * DEG), (8.0 / rate, 0.0))
        yield _along(f"steering {rate:g} deg/s", _at(load), "slip_angle", *turned)


def _ramps() -> Plan:
    runs = tuple(ramp for load in _loads((62.5, 100.0)) for ramp in _ramps_at(load))
    return Plan("ramps", "2 loads x 5 speed, brake, throttle and 2 steering ramps", runs)


PLANS: Mapping[str, Callable[[], Plan]] = MappingProxyType(
    {
        "set1": _set1,
        "set2": _set2,
        "brake_drive": _brake_drive,
        "set3": _set3,
        "set3_cornering": _set3_cornering,
        "combined": _combined,
        "straight": _straight,
        "short": _short,
        "ramps": _ramps,
    }
)
"""The presets by name."""


def plan(name: str) -> Plan:
    """Return a preset.

    Raises
    ------
    ParameterError
        If there is none of this name.
    """
    try:
        return PLANS[name]()
    except KeyError:
        raise ParameterError(
            f"rig plan {name!r} is unknown; allowed are {', '.join(PLANS)}; choose one of them"
        ) from None
