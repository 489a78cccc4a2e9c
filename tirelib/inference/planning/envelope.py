"""The conditions that a rig allows, and a grid of possible runs in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.quantities import QUANTITIES, Quantity
from tirelib.effects.state import Operating
from tirelib.inference.planning.sweep import Sweep

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Axis:
    """A condition that may be set.

    Attributes
    ----------
    quantity : Quantity
        Its name, unit and conversion.
    key : str
        In JSON.
    wider : float
        Share by which the ends of a campaign are moved outward where nothing is declared.
    levels : int
        Levels of the grid; a range of one value has one.
    series : str
        Key in JSON of the values that a sweep passes through; empty where there is no sweep of it.
    """

    quantity: Quantity
    key: str
    wider: float
    levels: int
    series: str = ""

    @property
    def positive(self) -> bool:
        """Whether only positive values make sense."""
        return not self.quantity.signed


AXES: Mapping[str, Axis] = MappingProxyType(
    {
        "load": Axis(QUANTITIES["load"], "load_N", 0.25, 5),
        "pressure": Axis(QUANTITIES["pressure"], "pressure_bar", 0.15, 3),
        "speed": Axis(QUANTITIES["speed"], "speed_kmh", 0.25, 5),
        "slip_angle": Axis(QUANTITIES["slip_angle"], "slip_angle_deg", 0.0, 7, "slip_angles_deg"),
        "slip_ratio": Axis(QUANTITIES["slip_ratio"], "slip_ratio", 0.0, 7, "slip_ratios"),
        "camber": Axis(QUANTITIES["camber"], "camber_deg", 0.0, 2),
        "temperature": Axis(QUANTITIES["temperature"], "temperature_degC", 0.0, 2),
    }
)
"""Every condition that may be planned."""
STRAIN = ("load", "pressure", "speed")
"""Those of a straight run."""


@dataclass(frozen=True, slots=True)
class Envelope:
    """Ranges within which a run may be asked for.

    Attributes
    ----------
    ranges : mapping of axis to (low, high), SI
        Pressure is gauge. In the order of the grid's columns.
    declared : tuple of str
        Which of them somebody gave; the others are the campaign's, widened.
    levels : mapping of axis to int
        Levels of the grid, where they are not the usual ones (`AXES`).
    sweep : Sweep, optional
        Slips that every run passes through (forces); they are then no axis of the grid.
    """

    ranges: Mapping[str, Range]
    declared: tuple[str, ...] = ()
    levels: Mapping[str, int] = field(default_factory=dict)
    sweep: Sweep | None = None

    def __post_init__(self) -> None:
        faults = [
            f"{QUANTITIES[name].title} {QUANTITIES[name].told(low):.4g} to "
            f"{QUANTITIES[name].told(high):.4g} {QUANTITIES[name].unit}"
            for name, (low, high) in self.ranges.items()
            if not (-np.inf < low <= high < np.inf) or (AXES[name].positive and low <= 0.0)
        ]
        if faults:
            raise ParameterError(
                f"envelope: {'; '.join(faults)}; numbers are needed, the lower first, loads, "
                "pressures and speeds positive; correct the range"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the axes, in the order of the grid's columns."""
        return tuple(self.ranges)

    @classmethod
    def of(cls, points: Any, axes: Sequence[str] = STRAIN, **declared: Any) -> "Envelope":
        """Return the declared ranges of the axes that may be set, by axis, SI.

        What is None or not declared is that of measured points (`Operating` or `BrushConditions`),
        widened.

        Raises
        ------
        ParameterError
            If a range is not in order or not positive; the campaign does not state its speeds or
            another condition; or a range is given that is no axis of these runs.
        """
        given = {name: ends for name, ends in declared.items() if ends is not None}
        for name in given:
            if name not in axes:
                raise ParameterError(
                    f"envelope: a range of {name.replace('_', ' ')} is declared, which these runs "
                    f"cannot have; allowed are "
                    f"{', '.join(QUANTITIES[n].title for n in axes)}; leave "
                    "it out"
                )
        ranges = {name: given.get(name) or _campaigns(points, name) for name in axes}
        return cls(ranges, tuple(name for name in axes if name in given))

    def swept(self, sweep: Sweep) -> "Envelope":
        """Return the envelope of runs that are sweeps, over the declared range if there is one.

        Raises
        ------
        ParameterError
            If the range holds none of the slips.
        """
        if sweep.name in self.declared:
            sweep = sweep.over(*self.ranges[sweep.name])
        ranges = {name: ends for name, ends in self.ranges.items() if name != sweep.name}
        return replace(self, ranges=ranges, sweep=sweep)

    @property
    def points(self) -> int:
        """Number of points of a run: 1, or the slips of a sweep."""
        return 1 if self.sweep is None else len(self.sweep)

    def grid(self) -> FloatArray:
        """Return all combinations of the levels, (n, axes)."""
        axes = []
        for name, (low, high) in self.ranges.items():
            levels = self.levels.get(name, AXES[name].levels)
            axes.append(np.linspace(low, high, levels if high > low else 1))
        return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)

    def text(self, point: FloatArray) -> str:
        """Say a run's conditions.

        Examples
        --------
        >>> straight = Envelope({"load": (1e3, 5e3), "pressure": (2e5, 2e5), "speed": (5.0, 30.0)})
        >>> straight.text(np.array([4000.0, 2.1e5, 25.0]))
        '4000 N, 2.1 bar, 90 km/h'
        """
        said = []
        for name, value in zip(self.names, point, strict=True):
            quantity = QUANTITIES[name]
            titled = quantity.dimension in ("angle", "ratio", "temperature")
            label = f"{quantity.title} " if titled else ""
            said.append(f"{label}{_number(name, value)}{_unit(name)}")
        if self.sweep is not None:
            title = QUANTITIES[self.sweep.name].title
            said.append(f"a sweep of {len(self.sweep)} {title}s from {self.slips}")
        return ", ".join(said)

    @property
    def slips(self) -> str:
        """Ends of the sweep's slips in words, empty without a sweep."""
        if self.sweep is None:
            return ""
        name, values = self.sweep.name, self.sweep.values
        ends = " to ".join(_number(name, end) for end in (values.min(), values.max()))
        return f"{ends}{_unit(name)}"


def _number(name: str, value: float) -> str:
    digits = ".3g" if name in ("pressure", "slip_ratio") else ".0f"
    digits = ".1f" if QUANTITIES[name].dimension == "angle" else digits
    return f"{float(QUANTITIES[name].told(value)):{digits}}"


def _unit(name: str) -> str:
    return f" {words}" if (words := QUANTITIES[name].words) else ""


def _campaigns(points: Any, name: str) -> Range:
    """Return the range of measured points, widened."""
    axis, values = AXES[name], np.asarray(getattr(points, name))
    if name == "speed" and not (np.isfinite(values) & (values > 0.0)).all():
        raise ParameterError(
            "envelope: the campaign does not state its speed in every run, so no run at another "
            "speed can be predicted; give speed_kmh in runs.csv"
        )
    if not np.isfinite(values).all() or (axis.positive and not (values > 0.0).all()):
        raise ParameterError(
            f"envelope: the campaign does not state its {axis.quantity.title} in every run; "
            f"declare the range with --{name.replace('_', '-')}-range"
        )
    low, high = float(values.min()), float(values.max())
    return low * (1.0 - axis.wider), high * (1.0 + axis.wider)


def operating_at(wanted: FloatArray, present: Operating) -> Operating:
    """Return straight runs at (n, 3) loads, pressures and speeds, made after the present ones.

    What else a run has (temperature, drag, turn rate over speed) is as in the present runs, on
    average.
    """
    n, (load, pressure, speed) = len(wanted), wanted.T
    rate = float(np.median(present.omega / present.speed))
    set_ = {"load": load, "pressure": pressure, "speed": speed, "omega": rate * speed}
    mean = {k: np.full(n, float(np.mean(getattr(present, k)))) for k in Operating.__slots__}
    return Operating(**(mean | set_ | {"order": np.ones(n)}))
