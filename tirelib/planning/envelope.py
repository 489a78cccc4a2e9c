"""The conditions that a rig allows, and a grid of possible runs in them."""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.errors import ParameterError
from tirelib.model.state import Operating

Range = tuple[float, float]

WIDER: dict[str, float] = {"load": 0.25, "pressure": 0.15, "speed": 0.25}
"""Share by which the ends of a campaign are moved outward where nothing is declared."""
LEVELS: dict[str, int] = {"load": 5, "pressure": 3, "speed": 5}
"""Levels of the grid; a range of one value has one."""


@dataclass(frozen=True, slots=True)
class Envelope:
    """Ranges within which a run may be asked for.

    Attributes
    ----------
    load : (low, high), [N]
    pressure : (low, high), [Pa]
        Gauge.
    speed : (low, high), [m/s]
    declared : tuple of str
        Which of them somebody gave; the others are the campaign's, widened by `WIDER`.
    """

    load: Range
    pressure: Range
    speed: Range
    declared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        faults = [
            f"{name} {low:.6g} to {high:.6g}"
            for name in WIDER
            for low, high in [getattr(self, name)]
            if not 0.0 < low <= high < np.inf
        ]
        if faults:
            raise ParameterError(
                f"envelope, SI: {'; '.join(faults)}; positive numbers are needed, the lower first; "
                "correct the range"
            )

    @classmethod
    def of(
        cls,
        points: Operating,
        *,
        load: Range | None = None,
        pressure: Range | None = None,
        speed: Range | None = None,
    ) -> "Envelope":
        """Return the declared ranges; else those of measured points, widened.

        Raises
        ------
        ParameterError
            If a range is not in order or not positive; or the campaign does not tell its speeds.
        """
        if not (np.isfinite(points.speed) & (points.speed > 0.0)).all():
            raise ParameterError(
                "envelope: the campaign does not tell its speed in every run, so no run at another "
                "can be foretold; give speed_kmh in runs.csv"
            )
        given = {"load": load, "pressure": pressure, "speed": speed}
        ranges: dict[str, Range] = {}
        for name, wider in WIDER.items():
            declared, values = given[name], getattr(points, name)
            if declared is not None:
                ranges[name] = declared
            elif np.isfinite(values).all() and (values > 0.0).all():
                low, high = float(values.min()), float(values.max())
                ranges[name] = (low * (1.0 - wider), high * (1.0 + wider))
            else:
                raise ParameterError(
                    f"envelope: the campaign does not tell its {name} in every run; declare the "
                    f"range with --{name}-range"
                )
        return cls(**ranges, declared=tuple(name for name, x in given.items() if x is not None))

    def grid(self) -> FloatArray:
        """Return all combinations of the levels, (n, 3): load, pressure, speed."""
        axes = []
        for name, count in LEVELS.items():
            low, high = getattr(self, name)
            axes.append(np.linspace(low, high, count if high > low else 1))
        return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


def operating_at(wanted: FloatArray, present: Operating) -> Operating:
    """Return straight runs at (n, 3) loads, pressures and speeds, made after the present ones.

    What else a run has (temperature, drag, turn rate over speed) is as in the present runs, on
    average.
    """
    n = len(wanted)
    mean = {
        name: np.full(n, _mean(getattr(present, name)))
        for name in ("camber", "slip_angle", "slip_ratio", "side_force", "drive_force",
                     "temperature")
    }  # fmt: skip
    load, pressure, speed = wanted.T
    rate = float(np.median(present.omega / present.speed))
    return Operating(
        load=load, pressure=pressure, speed=speed, omega=rate * speed, order=np.ones(n), **mean
    )


def _mean(values: FloatArray) -> float:
    """Return the mean; NaN unless every value is known."""
    return float(np.mean(values))
