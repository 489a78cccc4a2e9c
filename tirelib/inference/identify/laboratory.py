"""Laboratory tests that would tell a ring's numbers, as linear observations about a fitted tire.

Each test measures logarithms (or the offset's) with a stated accuracy; its rows are their slopes
by the fit's coordinates. A press test sees what the fitted ring does on the road; the others
measure a number by its definition, and so also what the ring's structure has put into it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import Tire
from tirelib.model.base import Coordinate
from tirelib.physics.ring.frequencies import natural_frequency, rim_stiffness

SIDEWALL, MODAL, MASS, TREAD, GROWTH, SECTION = 0.03, 0.01, 0.03, 0.05, 0.05, 0.01
"""Relative accuracy (one standard deviation) of the tests; MASS is what a modal test takes."""
ORDERS = np.arange(1, 9)
COORDINATE_STEP = 1e-5
"""Move of a coordinate by which slopes are taken, unless an end of its range is nearer."""
LEAST_STIFFNESS = 0.05
"""Share of the stiffness at the tire's pressure, below which no test is proposed at another one."""

Measure = Callable[[Tire], Sequence[float] | FloatArray]
"""What a test measures of a tire."""


@dataclass(frozen=True, slots=True)
class Test:
    """One test.

    Attributes
    ----------
    words : str
        What to do, with the accuracy that is assumed.
    rows : shape (n_measured, n_free)
        Slopes of the measured logarithms by the free coordinates.
    covariance : shape (n_measured, n_measured)
        Covariance of the errors of measurement.
    by_definition : bool
        Whether it measures the numbers themselves rather than what the fitted ring does.
    """

    words: str
    rows: FloatArray
    covariance: FloatArray
    by_definition: bool


def laboratory_tests(
    values: Mapping[str, float | FloatArray],
    free: tuple[Coordinate, ...],
    pressures: tuple[float, float],
) -> tuple[Test, ...]:
    """Return the tests at the tire's pressure, those of the sidewall also at two others.

    Parameters
    ----------
    values : mapping
        Numbers of the fitted tire.
    pressures : (float, float), [Pa]
        The lowest and the highest that can be set. Tests there are left out where the fitted
        slopes leave no stiffness: the tire cannot be as fitted so far away.
    """
    at = float(np.max(values["pressure"]))
    bars = " and ".join(f"{1e-5 * p:.1f}" for p in pressures)

    def turn(*at: float) -> Measure:
        return lambda tire: np.log(np.array([_rim(tire, p)[1] for p in at]))

    def rim(*at: float) -> Measure:
        return lambda tire: np.log(np.array([_rim(tire, p) for p in at])).ravel()

    def modes(tire: Tire) -> FloatArray:
        found = natural_frequency(
            ORDERS,
            ring_radius=tire.ring_radius,
            bending_stiffness=tire.bending_stiffness,
            radial_stiffness=tire.radial_stiffness,
            tangential_stiffness=tire.tangential_stiffness,
            inflation=at * tire.belt_width,
            mass=tire.mass,
        )
        return np.asarray(np.log(found))

    def test(words: str, accuracy: float, measure: Measure, together: float = 0.0) -> Test:
        rows = _slopes(measure, values, free)
        covariance = accuracy**2 * np.eye(len(rows)) + together**2
        return Test(words, rows, np.asarray(covariance), True)

    one, both = f"(S_theta to {SIDEWALL:.0%})", f"(S_v, S_theta to {SIDEWALL:.0%})"
    sidewall = [
        test(f"a torsional sidewall test {one}", SIDEWALL, turn(at)),
        test(f"sidewall tests {both}", SIDEWALL, rim(at)),
    ]
    if _stands(_tire(values), pressures):
        sidewall += [
            test(f"torsional sidewall tests {one} at {bars} bar", SIDEWALL, turn(*pressures)),
            test(f"sidewall tests {both} at {bars} bar", SIDEWALL, rim(*pressures)),
        ]
    modal = f"a modal test (orders 1 to 8 to {MODAL:.0%}, mass to {MASS:.0%})"
    return (
        *sidewall,
        test(modal, MODAL, modes, 0.5 * MASS),
        test(
            f"a press test of the tread alone (k_t to {TREAD:.0%})",
            TREAD,
            lambda tire: [np.log(tire.tread_stiffness)],
        ),
        test(
            f"the growth of the belt with pressure (EA to {GROWTH:.0%})",
            GROWTH,
            lambda tire: [np.log(tire.extension_stiffness)],
        ),
        test(
            f"a cut section (gage offset to {SECTION:.0%})",
            SECTION,
            lambda tire: [np.log(-tire.innerliner_offset)],
        ),
    )


def _stiffness(tire: Tire, pressure: float) -> tuple[float, float]:
    """Return the sidewall's radial and tangential stiffness at a pressure, [N/m2]."""
    above = pressure - tire.pressure
    return (
        tire.radial_stiffness + tire.radial_pressure_slope * above,
        tire.tangential_stiffness + tire.tangential_pressure_slope * above,
    )


def _stands(tire: Tire, pressures: tuple[float, float]) -> bool:
    """Return whether the sidewall has stiffness at both pressures, and still has a little off."""
    here = np.array(_stiffness(tire, tire.pressure))
    return all((np.array(_stiffness(tire, p)) > LEAST_STIFFNESS * here).all() for p in pressures)


def _tire(values: Mapping[str, float | FloatArray]) -> Tire:
    return Tire(**{name: float(np.max(value)) for name, value in values.items()})


def _rim(tire: Tire, pressure: float) -> tuple[float, float]:
    """Return S_v, S_theta of Eq. (112) at a pressure."""
    shift, turn = rim_stiffness(tire.ring_radius, *_stiffness(tire, pressure))
    return float(shift), float(turn)


def _slopes(
    measure: Measure,
    values: Mapping[str, float | FloatArray],
    free: tuple[Coordinate, ...],
) -> FloatArray:
    """Return differences of a measure within a tire's ranges, (n_measured, n_free)."""
    tire = _tire(values)
    columns = []
    for coordinate in free:
        value = float(np.max(values[coordinate.name]))
        low, high = coordinate.ends(value)
        steps = max(-COORDINATE_STEP, low), min(COORDINATE_STEP, high)
        moved = (float(coordinate.moved(value, z)) for z in steps)
        first, last = (np.asarray(measure(tire.changed(**{coordinate.name: v}))) for v in moved)
        columns.append((last - first) / (steps[1] - steps[0]))
    return np.stack(columns, axis=1)
