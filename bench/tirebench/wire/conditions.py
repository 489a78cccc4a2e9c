"""What the wheel does not send: travel speed, pressure, camber, turn rate, over device time.

They come from options (one value each) or from a sidecar (``tirebench-conditions/3``, JSON) that
the emulator writes, and are held from one value to the next. A sidecar also tells where in device
time each run of the campaign was played and what the rig measured, so that estimates can be
compared.

Files hold what engineers say (km/h, bar, deg, N); inside everything is SI and ISO 8855.
"""

import json
import math
from bisect import bisect_right
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tirebench.errors import DeviceError, cause
from tirelib.core.held import HELD
from tirelib.core.units import from_si, to_si

FORMAT = "tirebench-conditions/3"
EARLIER_FORMATS = ("tirebench-conditions/1", "tirebench-conditions/2")
"""Which knew fewer conditions: speed, pressure and camber, later the turn rate."""
UNITS = {
    "speed": ("km/h", "speed"),
    "pressure": ("bar", "pressure"),
    "camber": ("deg", "angle"),
    "omega": ("rad/s", "angular_speed"),
    "friction": ("1", "ratio"),
    "tread_depth": ("mm", "length"),
    "tread_temperature": ("degC", "temperature"),
}
QUANTITIES = {name: UNITS[name] for name in HELD}
"""Unit in files and dimension of each condition, in the order of `tirelib.core.held.HELD`."""
TELLABLE = {
    **{name: (name, dimension) for name, (_, dimension) in QUANTITIES.items()},
    "temperature": ("tread_temperature", "temperature"),
}
"""What a bus may tell, by its name in a map: the condition, and its dimension. What is no condition
of the estimator is left alone."""
TRUTH = {
    "Fz": ("N", "force"),
    "alpha": ("deg", "angle"),
    "kappa": ("1", "ratio"),
    "Fy": ("N", "force"),
}
HOLD = {"speed": 1.0, "omega": 1.0, "camber": 1.0}
"""How long a bus may be silent about a condition before it is unknown, [s], unless its map gives
`hold_s`; one that is not listed is held for ever. A vehicle's bus sends its speed every 10 to
100 ms (SAE J1939-71: wheel-based speed every 100 ms), so at least ten messages are missing by
then. With half of it, the speed of a bus that sends twice a second would come and go; with double,
a wheel that brakes with 8 m/s^2 is 16 m/s slower than the held speed, instead of 8 m/s."""
ROUNDING = 0.6
"""Device time is a whole number of microseconds; a condition this close has begun, [us]."""
LONGEST_MEMORY = 256
"""Number of past changes that are kept; the chain is only a few samples behind."""
UNKNOWN = (math.nan,) * len(HELD)

Condition = tuple[float, ...]
"""In the order of `tirelib.core.held.HELD`, SI; NaN where unknown."""


def condition(*values: float, **known: float) -> Condition:
    """Return a condition from what is known of it, SI, by order or name."""
    if unknown := known.keys() - set(HELD):
        raise TypeError(f"unknown condition: {', '.join(sorted(unknown))}")
    given = {**dict(zip(HELD, values, strict=False)), **known}
    return tuple(given.get(name, math.nan) for name in HELD)


@dataclass(frozen=True, slots=True)
class RunMark:
    """Where a run of a campaign begins in device time.

    Attributes
    ----------
    run : int
    t_us : int, [us]
        Device time of the run's first sample.
    start_time : float, [s]
        The run's own clock at that sample.
    truth : dict of float, SI
        What the rig measured in the run, mean: Fz, alpha, kappa, Fy; NaN where absent.
    plan : dict of float or str, SI
        The run's kind and set points, where a campaign was played.
    """

    run: int
    t_us: int
    start_time: float
    truth: dict[str, float] = field(default_factory=dict)
    plan: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Conditions:
    """Conditions over device time, held from each entry to the next; unknown before the first.

    Attributes
    ----------
    t_us : tuple of int, [us]
        Increasing.
    values : tuple of Condition
    runs : tuple of RunMark
        In order of device time; empty if nothing is known of runs.
    loop_us : int
        After this time everything repeats; 0 for never.
    campaign : dict or None
        ``campaign.toml`` of the campaign that is played, in ISO axes; for an export.
    """

    t_us: tuple[int, ...]
    values: tuple[Condition, ...]
    runs: tuple[RunMark, ...] = ()
    loop_us: int = 0
    campaign: dict[str, Any] | None = None

    @classmethod
    def constant(cls, *values: float, **known: float) -> "Conditions":
        """Return conditions that do not change, SI, by order or name."""
        return cls((0,), (condition(*values, **known),))

    def over(self, base: "Conditions") -> "Conditions":
        """Return `base` with what these constant conditions know in the place of its own."""
        given = self.values[0]
        times, values = base.t_us, base.values
        if times[0] > 0:
            times, values = (0, *times), (UNKNOWN, *values)
        replaced = tuple(
            tuple(own if math.isnan(new) else new for new, own in zip(given, row, strict=True))
            for row in values
        )
        return replace(base, t_us=times, values=replaced)

    @property
    def known(self) -> tuple[str, ...]:
        """Names of what is known at any time."""
        return tuple(
            name
            for index, name in enumerate(QUANTITIES)
            if any(not math.isnan(value[index]) for value in self.values)
        )

    def at(self, t_us: float) -> Condition:
        """Return what holds at a device time."""
        if len(self.t_us) == 1 and self.t_us[0] == 0:
            return self.values[0]
        index = bisect_right(self.t_us, self._within(t_us) + ROUNDING) - 1
        return self.values[index] if index >= 0 else UNKNOWN

    def next_change(self, t_us: float) -> float:
        """Return the device time of the next entry after `t_us`; infinite if there is none."""
        if len(self.t_us) == 1 and not self.loop_us:
            return math.inf
        within = self._within(t_us)
        index = bisect_right(self.t_us, within + ROUNDING)
        ahead = self.t_us[index] if index < len(self.t_us) else self.loop_us + self.t_us[0]
        return t_us + (ahead - within) if index < len(self.t_us) or self.loop_us else math.inf

    def run_at(self, t_us: float) -> tuple[RunMark, int] | None:
        """Return the run that is played at a device time, and the device time it began."""
        within = self._within(t_us)
        index = bisect_right([mark.t_us for mark in self.runs], within + ROUNDING) - 1
        if index < 0:
            return None
        mark = self.runs[index]
        return mark, mark.t_us + round(t_us - within)

    def _within(self, t_us: float) -> float:
        return t_us % self.loop_us if self.loop_us else t_us


@dataclass(frozen=True, slots=True)
class Measured:
    """A condition that a bus sent between two frames of strain.

    Attributes
    ----------
    name : str
        One of `tirelib.core.held.HELD`.
    value : float, SI
    wheel : int or None
        For which it holds; None: for all.
    hold : float, [s]
        It holds for so long unless the bus sends it again; then it is unknown.
    """

    name: str
    value: float
    wheel: int | None = None
    hold: float = math.inf


class Held:
    """Conditions, with those from a bus on top; each is held until the bus sends a new value.

    Same questions as `Conditions`; what is no longer asked for is forgotten.
    """

    def __init__(self, base: Conditions) -> None:
        self.runs = base.runs
        self._base = base
        self._from_bus: list[tuple[int, int, float]] = []  # t_us, index of the condition, value

    def set_from_bus(self, t_us: int, measured: Measured) -> None:
        """Note what holds from a device time on."""
        if measured.name not in QUANTITIES:
            return
        index = list(QUANTITIES).index(measured.name)
        last = next((value for _, i, value in reversed(self._from_bus) if i == index), None)
        if last != measured.value:
            self._from_bus.append((t_us, index, measured.value))
        if len(self._from_bus) > LONGEST_MEMORY:
            held = {i: (t, i, value) for t, i, value in self._from_bus[: -LONGEST_MEMORY // 2]}
            self._from_bus = [*held.values(), *self._from_bus[-LONGEST_MEMORY // 2 :]]

    def at(self, t_us: float) -> Condition:
        """Return what holds at a device time."""
        values = list(self._base.at(t_us))
        for moment, index, value in self._from_bus:
            if moment > t_us + ROUNDING:
                break
            values[index] = value
        return tuple(values)

    def next_change(self, t_us: float) -> float:
        """Return the device time of the next change after `t_us`; infinite if none is known."""
        ahead = (moment for moment, _, _ in self._from_bus if moment > t_us + ROUNDING)
        return min(next(ahead, math.inf), self._base.next_change(t_us))

    def run_at(self, t_us: float) -> tuple[RunMark, int] | None:
        """Return the run that is played at a device time, and the device time it began."""
        return self._base.run_at(t_us)


def conditions_document(conditions: Conditions) -> dict[str, Any]:
    """Return conditions as a sidecar holds them."""
    columns: dict[str, Any] = {}
    for index, (name, (unit, dimension)) in enumerate(QUANTITIES.items()):
        column = [value[index] for value in conditions.values]
        columns[name] = {
            "unit": unit,
            "values": [None if math.isnan(x) else from_si(x, unit, dimension) for x in column],
        }
    return {
        "format": FORMAT,
        "axes": "iso",
        "loop_us": conditions.loop_us,
        "campaign": conditions.campaign,
        "t_us": list(conditions.t_us),
        **columns,
        "runs": [
            {
                "run": mark.run,
                "t_us": mark.t_us,
                "start_s": mark.start_time,
                "truth": {
                    name: from_si(x, *TRUTH[name]) for name, x in mark.truth.items() if x == x
                },
                "plan_si": {name: x for name, x in mark.plan.items() if x == x},
            }
            for mark in conditions.runs
        ],
    }


def parse_conditions(document: Any, where: str) -> Conditions:
    """Return the conditions that a sidecar holds.

    Raises
    ------
    DeviceError
        If it is not what this program writes.
    """
    given = document.get("format") if isinstance(document, dict) else type(document).__name__
    if given not in (*EARLIER_FORMATS, FORMAT):
        known = ", ".join((*EARLIER_FORMATS, FORMAT))
        raise DeviceError(
            f"{where}: format = {given!r}; this program reads {known}; use a file that `tirebench "
            "emulate --conditions` wrote"
        )
    try:
        times = tuple(int(t) for t in document["t_us"])
        columns = [
            [math.nan] * len(times)
            if given != FORMAT and name not in document
            else _column(document[name], *row)
            for name, row in QUANTITIES.items()
        ]
        values = tuple(zip(*columns, strict=True))
        runs = tuple(_mark(entry) for entry in document["runs"])
        loop = int(document["loop_us"])
        campaign = None if document.get("campaign") is None else dict(document["campaign"])
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError) as error:
        raise DeviceError(
            f"{where}: {type(error).__name__} {error}; t_us, {', '.join(QUANTITIES)}, runs and "
            "loop_us are needed, as lists of the same length; write the file again with "
            "`tirebench emulate`"
        ) from None
    if len(values) != len(times) or not times or list(times) != sorted(times):
        raise DeviceError(
            f"{where}: {len(times)} times for {len(values)} conditions; one time per condition is "
            "needed, at least one, in increasing order; write the file again with `tirebench "
            "emulate`"
        )
    return Conditions(times, values, runs, loop, campaign)


def read_conditions(path: Path) -> Conditions:
    """Read a sidecar; errors as `parse_conditions`."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DeviceError(
            f"{path}: cannot be read ({cause(error)}); a JSON file of `tirebench emulate "
            "--conditions` is needed; check the path"
        ) from None
    return parse_conditions(document, str(path))


def _column(entry: dict[str, Any], unit: str, dimension: str) -> list[float]:
    if entry["unit"] != unit:
        raise ValueError(f"unit {entry['unit']!r} instead of {unit!r}")
    return [
        math.nan if x is None else float(to_si(float(x), unit, dimension)) for x in entry["values"]
    ]


def _mark(entry: dict[str, Any]) -> RunMark:
    truth = {
        name: float(to_si(float(x), *TRUTH[name])) for name, x in entry.get("truth", {}).items()
    }
    plan = {
        str(name): str(x) if name == "kind" else float(x)
        for name, x in entry.get("plan_si", {}).items()
    }
    return RunMark(int(entry["run"]), int(entry["t_us"]), float(entry["start_s"]), truth, plan)
