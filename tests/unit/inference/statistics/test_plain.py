"""What the tires of a family have in common is learned apart from how they differ."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import PLAIN, Toy, drawn, family
from tirelib.inference.statistics import size
from tirelib.inference.statistics.hypothesis import judged
from tirelib.inference.statistics.null import Null
from tirelib.inference.statistics.plain import learn, load, pooled, save
from tirelib.inference.statistics.posterior import posterior
from tirelib.inference.statistics.views import View

COMMON = 0.4
"""What every tire of the family shows of `swell`, in ranges."""
WIDTHS = np.full(3, 10.0)


def view(**planted: float) -> View:
    """Return the normal equations of a toy tire."""
    return seen(drawn(np.random.default_rng(2), **planted))


def seen(measured: np.ndarray) -> View:
    toy = Toy(measured)
    fit = posterior(toy, (), family(40).shown(), toy.whitener(0.001))
    return fit.views(toy, [0.0005])[0]


def test_a_familys_mean_is_learned_apart_from_its_spread(tmp_path) -> None:
    tires = [[seen(drawn(np.random.default_rng(k), swell=COMMON))] for k in range(40)]
    found = learn("common", tires, WIDTHS)
    # forty tires that differ by .05, each known to about as much
    assert found.means["swell"] == pytest.approx(COMMON, abs=0.04)
    assert np.sqrt(found.shown()["swell"]) == pytest.approx(PLAIN["swell"], rel=0.6)
    assert found.means["bend"] == pytest.approx(0.0, abs=0.03)
    assert found.draws[:, 0].mean() == pytest.approx(COMMON, abs=0.04)
    save(tmp_path / "table.npz", [found], {})
    assert load(tmp_path / "table.npz")[0][0].means == pytest.approx(found.means)


def test_a_mean_counts_as_what_it_takes_off_the_residual(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tire with the family's mean is to its test as one without is to a test without a mean."""
    monkeypatch.setattr(size, "SIZES", np.array([1.0]))
    plain = replace(family(40), largest=1.0)
    common = replace(plain, means={"swell": COMMON})
    measured = drawn(np.random.default_rng(2))
    swollen = measured + COMMON * Toy(measured).by["swell"][0]
    with_mean, without = (
        Null(seen(each), by, plain.shown(), {"base": WIDTHS**2}, {"twist": 1.0})
        for each, by in ((swollen, common), (measured, plain))
    )
    assert with_mean.scores == pytest.approx(without.scores, abs=1e-6)
    assert with_mean.likelihood == pytest.approx(without.likelihood, abs=1e-6)
    place = with_mean.view.normal.blocks["swell"]
    moved = with_mean.explained()[place] - without.explained()[place]
    assert moved == pytest.approx(COMMON, abs=1e-6)


def test_the_side_that_a_family_never_shows_stands_out() -> None:
    """Tires that all show some of an effect excuse it, and not its opposite."""
    common = [replace(family(40, seed), means={"swell": COMMON}) for seed in (1, 2)]

    def score(strength: float) -> float:
        toy = Toy(drawn(np.random.default_rng(2), swell=strength))
        fit = posterior(toy, (), family(40).shown(), toy.whitener(0.001))
        return judged(toy, fit, common, 0.05, own_effects=0).scores["swell"]

    assert score(COMMON) < 2.0
    assert score(-COMMON) > score(COMMON) + 5.0


def test_a_tire_that_does_not_know_a_block_takes_no_part_in_what_is_shown() -> None:
    whole = family(40)
    squares = whole.squares.copy()
    squares[10:, 1] = np.nan
    found = replace(whole, squares=squares).shown()
    assert found["bend"] == pytest.approx(whole.squares[:10, 1].mean())
    assert found["twist"] == pytest.approx(whole.shown()["twist"])


def test_families_together_spread_by_what_they_show_to_either_side() -> None:
    """Their second moment about nothing: the variance of a family and the square of its mean."""
    sizes = dict.fromkeys(PLAIN, 1.0)

    def together(*means: float) -> float:
        shown = [replace(family(40), means={"swell": mean}) for mean in means]
        return pooled(shown, sizes)["swell"]

    variance = family(40).spread(sizes)["swell"]
    assert together(0.0) == pytest.approx(variance)
    assert together(COMMON) == together(-COMMON) == pytest.approx(variance + COMMON**2)
    assert together(COMMON, -COMMON, 0.0) == pytest.approx(variance + 2.0 / 3.0 * COMMON**2)


def test_a_block_far_from_the_contact_shows_no_more_than_its_family_does() -> None:
    """What all blocks show on the average says nothing of what is far from the contact."""
    blocks = {"bend": 1, "load, contact": 1, "load, far belt": 1}
    squares = np.array([[1.0, 1e-8, 1e-8]])
    shown = replace(family(40), blocks=blocks, squares=squares)
    found = shown.spread(dict.fromkeys(blocks, 1.0))
    assert found["load, contact"] == pytest.approx(0.25**2 / 3.0)
    assert found["load, far belt"] == pytest.approx(1e-8)
