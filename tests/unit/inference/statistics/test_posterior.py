"""A fit finds strengths, and what a tire shows of other effects within their ranges."""

from typing import Any

import numpy as np
import pytest
from scipy import optimize

from tests.unit.inference.statistics.linear_problem import (
    EFFECTS,
    LEAST_OWN,
    Louder,
    N,
    Solved,
    Toy,
    drawn,
    family,
)
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.effects import effect
from tirelib.inference.statistics.bounded import bounded_step
from tirelib.inference.statistics.plain import BASE
from tirelib.inference.statistics.posterior import SETTLED, posterior
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.quadratic import LONGEST, Quadratic

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))
SPREAD = FAMILIES[0].shown()


def test_a_strength_and_what_else_the_tire_shows_are_found() -> None:
    toy = Toy(np.zeros(N))
    measured = 0.7 * toy.by["bend"][0] + 0.2 * toy.by["swell"][0]
    wide = {**SPREAD, "swell": 0.3**2}
    fit = posterior(Toy(measured), [EFFECTS["bend"]], wide, Louder(0.001))
    assert fit.names == ("bend",)
    assert fit.strengths[0] / 2.0 == pytest.approx([0.7], abs=0.02)
    swell = fit.strength("swell")
    assert swell is not None
    assert swell / 2.0 == pytest.approx([0.2], abs=0.02)


def test_what_a_tire_shows_stays_within_its_range() -> None:
    toy = Toy(np.zeros(N))
    wide = {**SPREAD, "twist": 0.3**2}
    fit = posterior(Toy(-0.4 * toy.by["twist"][0]), [], wide, Louder(0.001))
    assert fit.strength("twist") == pytest.approx([0.0], abs=1e-9)
    fit = posterior(Toy(0.4 * toy.by["twist"][0]), [], wide, Louder(0.001))
    assert fit.strength("twist") == pytest.approx([0.8], abs=0.05)


@pytest.mark.parametrize("width", [10.0, 0.02])
def test_a_deviation_is_what_least_squares_leaves_beside_everything_else(width: float) -> None:
    """Each number by itself, of an effect with two and of the one behind it, in its own unit."""

    @effect("pair", stage="gage", unit="1", low=-0.5, high=0.5, components=2, source="toy")
    def pair(state: Any, strength: Any) -> Any:
        """Return the state as it is."""
        return state

    toy = Toy(drawn(np.random.default_rng(1)))
    random = np.random.default_rng(4)
    # the second of the two is shown half as much, and much like a direction of the base
    toy.by["pair"] = np.stack([random.standard_normal(N), 0.1 * random.standard_normal(N)])
    toy.by["pair"][1] += 0.4 * toy.base[0]
    toy.widths = np.full(3, width)
    fit = posterior(toy, [pair, EFFECTS["bend"]], {}, Louder(LEAST_OWN))
    rows = np.concatenate([toy.base, toy.by["pair"], toy.by["bend"]])
    know = np.concatenate([toy.widths, np.ones(3)])
    deviation = np.sqrt(np.diag(np.linalg.inv(rows @ rows.T + np.diag(know**-2.0))))
    # other effects are held to a variance of 1e-11, and not to none
    assert fit.std(0) == pytest.approx(0.5 * deviation[3:5], rel=1e-5)
    assert fit.std(1) == pytest.approx(2.0 * deviation[5:], rel=1e-5)
    assert (np.sqrt(np.diag(fit.covariance)[:3]) <= width).all()


class Ending(Toy):
    """The toy whose twist has no solution below its range."""

    def solve(self, point: Point, near: Any = None) -> Solved:
        for each, strength in zip(point.effects, point.strengths, strict=True):
            if each.name == "twist" and strength[0] < 0.0:
                raise ParameterError("twist: it ends at zero")
        return super().solve(point, near)


def test_where_a_law_ends_the_other_numbers_are_fitted_all_the_same() -> None:
    toy = Ending(np.zeros(N))
    measured = np.array([0.5, -1.0, 2.0]) @ toy.base - 0.7 * toy.by["twist"][0]
    fit = posterior(Ending(measured), [EFFECTS["twist"]], {}, Louder(0.001))
    alone = posterior(Ending(measured), [], {}, Louder(0.001))
    assert fit.strengths[0] == pytest.approx([0.0], abs=1e-9)
    assert fit.cost == pytest.approx(alone.cost, abs=SETTLED)


class Kinked(Toy):
    """A base whose first number costs as |z| does, and whose second one has far to go."""

    DEPTH, FAR = 10.0, 50.0

    def __init__(self) -> None:
        super().__init__(np.zeros(N))
        self.living = ()
        self.base = np.linalg.qr(self.base.T)[0].T
        self.shapes = 1e-6 * self.shapes
        self.start = Point(np.array([0.3, 0.0, 0.0]))

    def solve(self, point: Point, near: Any = None) -> Solved:
        z = point.base
        away = np.array([self.DEPTH * (1.0 + abs(z[0])), z[1] - self.FAR, z[2]])
        return Solved(-away @ self.base)

    def slopes(self, point: Point, solved: Any, *, near: bool = False) -> FloatArray:
        side = 1.0 if point.base[0] >= 0.0 else -1.0
        return np.array([[side * self.DEPTH], [1.0], [1.0]]) * self.base


def test_a_number_whose_cost_has_a_kink_does_not_hold_the_others_back() -> None:
    toy = Kinked()
    fit = posterior(toy, (), {"smooth, all": 1e-6, "smooth, there": 1e-6}, toy.whitener(LEAST_OWN))
    there = Kinked.FAR / (1.0 + toy.widths[1] ** -2)
    assert fit.point.base == pytest.approx([0.0, there, 0.0], abs=0.6)


def test_a_number_that_would_go_far_does_not_shorten_the_way_of_the_others() -> None:
    rows = np.eye(2, 6)
    rest = np.array([40.0, 0.5, 0.0, 0.0, 0.0, 0.0])
    open_ = np.full(2, -np.inf), np.full(2, np.inf)
    here = Quadratic.about({BASE: rows}, rest, np.zeros(2), np.full(2, 1e3), {}, open_)
    assert here.step() == pytest.approx([LONGEST, 0.5], rel=1e-5)


def test_a_step_between_ends_is_the_bottom_there() -> None:
    random = np.random.default_rng(0)
    half = random.standard_normal((6, 9))
    gram, gradient = half @ half.T, random.standard_normal(6)
    low, high = np.full(6, -0.1), np.array([0.05, 0.1, 0.2, np.inf, np.inf, 0.0])
    found = bounded_step(gram, gradient, low, high)
    assert ((found >= low - 1e-9) & (found <= high + 1e-9)).all()

    def cost(dz: np.ndarray) -> float:
        return float(0.5 * dz @ gram @ dz - gradient @ dz)

    wanted = optimize.minimize(
        cost, np.zeros(6), method="L-BFGS-B", bounds=list(zip(low, high, strict=True))
    )
    assert cost(found) == pytest.approx(wanted.fun, abs=1e-6)


def test_the_rest_is_counted_from_where_the_base_starts() -> None:
    measured = drawn(np.random.default_rng(1), bend=0.5)
    toy = Toy(measured)
    fit = posterior(toy, [EFFECTS["bend"]], SPREAD, toy.whitener(0.001))
    # the toy is linear: nothing but the measured numbers is left without base and effects
    assert fit.rest == pytest.approx(measured, abs=1e-9)


def test_a_fit_from_one_nearby_ends_where_one_from_the_start_does() -> None:
    random = np.random.default_rng(3)
    toy = Toy(drawn(random, bend=0.5))
    base = posterior(toy, [], SPREAD, toy.whitener(0.001))
    far, near = (
        posterior(toy, [EFFECTS["bend"]], SPREAD, toy.whitener(0.001), near=start)
        for start in (None, base)
    )
    assert near.strengths[0] == pytest.approx(far.strengths[0], abs=0.1 * far.std(0)[0])
    assert near.cost == pytest.approx(far.cost, abs=0.1)
    point = near.point
    np.testing.assert_allclose(base.slopes_at(point), toy.slopes(point, near.solved))


def test_what_a_tire_shows_at_least_is_the_same_beside_every_hypothesis() -> None:
    """The average over all blocks is, with an effect in the model, that without it."""
    toy = Toy(0.7 * Toy(np.zeros(N)).by["swell"][0])
    alone = posterior(toy, [], SPREAD, toy.whitener(0.001)).sizes
    inside = posterior(toy, [EFFECTS["swell"]], SPREAD, toy.whitener(0.001)).sizes
    assert inside == pytest.approx(alone)
    shown = FAMILIES[0].spread(inside)
    assert shown["bend"] == pytest.approx(FAMILIES[0].spread(alone)["bend"])
    del inside["swell"]
    assert FAMILIES[0].spread(inside)["bend"] < 0.9 * shown["bend"]
