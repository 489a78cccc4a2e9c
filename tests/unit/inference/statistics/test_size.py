"""How much one tire shows over what its family shows."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import PLAIN, Toy, drawn, family
from tirelib.inference.statistics.null import Null
from tirelib.inference.statistics.posterior import posterior
from tirelib.inference.statistics.size import LARGEST, SIZE_STD, Size


@pytest.mark.parametrize("ratio", [0.25, 0.5, 1.0, 2.0])
def test_a_size_is_as_likely_as_its_inverse_and_both_parts_count_alike(ratio: float) -> None:
    whole, free = 1.7, 1.7 * ratio
    prior = Size(whole, free).log_prior
    assert prior == pytest.approx(Size(1.0 / whole, 1.0 / free).log_prior)
    assert prior == pytest.approx(Size(free, whole).log_prior)
    one = float(np.exp(SIZE_STD))
    assert Size(one, one).log_prior == pytest.approx(-0.5)
    assert Size(1.0, 1.0).log_prior == 0.0


def test_a_size_of_shapes_in_the_contact_beside_it_and_of_effects() -> None:
    found = Size(4.0, 0.5)
    assert found.of("load, contact") == 4.0
    assert found.of("load, free belt") == 0.5
    assert found.of("tread_load") == LARGEST


@pytest.mark.parametrize("whole", [0.25, 1.0, 2.0])
def test_a_tire_near_its_model_has_gages_and_a_belt_far_from_the_contact_like_any_other(
    whole: float,
) -> None:
    found = Size(whole, whole)
    assert found.of("load, far belt") == max(whole, 1.0)
    assert found.of("gain", {"gain", "other"}) == max(whole, 1.0)
    assert found.of("tread_load", {"gain"}) == whole


def test_a_tire_that_leaves_little_is_excused_for_its_gages_as_any_other_tire() -> None:
    """It swells as others of its family do, and is near its model otherwise."""
    toy = Toy(drawn(np.random.default_rng(2), size=0.0, swell=5.0 * PLAIN["swell"]))
    # four times as much of "swell" as the toy's usual family, which is more than the noise hides
    plain = replace(family(40), squares=family(40).squares * np.array([16.0, 1.0, 1.0, 1.0, 1.0]))
    fit = posterior(toy, (), plain.shown(), toy.whitener(0.001))
    view, base = fit.views(toy, [0.001])[0], {"base": np.full(3, 100.0)}
    as_tire, as_gage = (
        Null(view, plain, plain.shown(), base, {}, gage, Size(0.25, 0.25))
        for gage in ((), ("swell",))
    )
    place = as_tire.names.index("swell")
    assert as_gage.scores[place] < as_tire.scores[place] - 0.5
