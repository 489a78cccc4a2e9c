"""Laws of the fit of a rival: bounds, and structure that all runs share."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.planning.made import NOISE, case
from tirelib.diagnose.ensemble import smooth_part
from tirelib.diagnose.structure import FORM
from tirelib.effects import CATALOGUE
from tirelib.errors import ConvergenceError
from tirelib.planning.candidate_runs import forecasts
from tirelib.planning.criterion import NOTHING
from tirelib.planning.fit import Metric, bounded
from tirelib.planning.on_trial import LOST, fitted_rivals
from tirelib.planning.rivals import Rival, Trial, _whitening, try_suspects
from tirelib.planning.structure import Shapes, structure_shapes

ONE_SIDED = "roughness"


@cache
def tried() -> Trial:
    made = case()
    shapes = structure_shapes(made.data, made.base, members=6)
    suspects = [(CATALOGUE[name], np.zeros(1)) for name in (ONE_SIDED, "gage_length")]
    return try_suspects(
        made.data, made.base, suspects, noise=NOISE, shapes=shapes, with_nothing=True
    )


@given(seed=st.integers(0, 10_000), reach=st.floats(0.01, 3.0))
def test_a_bounded_step_stays_inside_and_what_is_free_is_at_its_minimum(
    seed: int, reach: float
) -> None:
    random = np.random.default_rng(seed)
    root = random.standard_normal((5, 8))
    normal, gradient = root @ root.T + 0.1 * np.eye(5), 5.0 * random.standard_normal(5)
    low, high = -reach * random.random(5), reach * random.random(5)
    step = bounded(normal, gradient, low, high)
    assert (step >= low).all()
    assert (step <= high).all()
    free = (step > low) & (step < high)
    left = (gradient - normal @ step)[free]
    # round-off of a solution of five equations
    assert left == pytest.approx(np.zeros(left.size), abs=1e-9 * np.abs(gradient).max())


def test_without_bounds_a_step_solves_the_normal_equations() -> None:
    random = np.random.default_rng(0)
    root, wide = random.standard_normal((4, 9)), np.full(4, np.inf)
    normal, gradient = root @ root.T, random.standard_normal(4)
    step = bounded(normal, gradient, -wide, wide)
    assert normal @ step == pytest.approx(gradient)


def test_a_strength_never_leaves_its_range_and_an_end_that_holds_it_is_told() -> None:
    trial = tried()
    nothing, *others = trial.rivals
    assert nothing.name == NOTHING
    assert [rival.name for rival in others] == [ONE_SIDED, "gage_length"]
    for rival in others:
        effect, strength = CATALOGUE[rival.name], float(rival.strength[0])
        # neither can be negative, and a law is as unsure as the end of its range
        top, faint = effect.high + FORM * effect.scale, 1e-6 * effect.scale
        assert 0.0 <= strength <= top
        assert rival.in_range == (faint < strength < top - faint)
        assert rival.cost <= nothing.cost + LOST


def test_what_even_all_suspects_leave_counts_as_more_noise_and_structure() -> None:
    made, plain = case(), tried()
    rough = 3.0 * plain.noise * np.random.default_rng(7).standard_normal(made.data.strain.shape)
    data = replace(made.data, strain=made.data.strain + rough)
    shapes = structure_shapes(made.data, made.base, members=6)
    trial = try_suspects(data, made.base, [], noise=NOISE, shapes=shapes, with_nothing=True)
    assert trial.size > 2.5 * max(plain.size, 1.0)
    # as noise, and as every way in which structure may show
    assert trial.noise / trial.size == pytest.approx(plain.noise / max(plain.size, 1.0))
    np.testing.assert_allclose(trial.shapes.present, trial.size * shapes.present)
    # then it is no more than usual: about one a sample
    assert 0.3 < trial.rivals[0].cost / data.strain.size < 1.5


def test_a_forecast_of_the_present_runs_leaves_no_more_than_the_fit_and_knows_no_less() -> None:
    made, trial = case(), tried()
    here = replace(trial, shapes=Shapes(trial.shapes.present, trial.shapes.present))
    rival = trial.rivals[1]
    (told,) = forecasts(replace(here, rivals=(rival,)), made.data, made.data.points)
    metric = Metric(made.data, _whitening(made.data, made.base, trial.noise), trial.shapes.present)
    left, plain = (
        metric.rest(wave)
        for wave in (told.wave, rival.fitted.guess.solved(made.data, made.data.points).waveform)
    )
    # the cost holds the priors as well; the fit alone knows nothing of structure
    assert left @ left < rival.cost < plain @ plain
    # no way of structure is less known than before any run
    structure = rival.fitted.covariance[rival.fitted.guess.z.size :, rival.fitted.guess.z.size :]
    assert np.linalg.eigvalsh(structure).max() <= 1.0 + 1e-9
    # load, pressure, gain and angle as far as the rig's tolerance goes
    gain = told.tangents[..., 2] / rival.fitted.guess.solved(made.data, made.data.points).waveform
    assert gain == pytest.approx(np.full(gain.shape, made.data.tolerance.gain))
    assert told.tangents.shape[2] == 4


def test_runs_of_one_condition_share_their_structure() -> None:
    made = case()
    found = structure_shapes(made.data, made.base, made.data.points, members=2)
    # the same points once more: equal but for the order of sums
    np.testing.assert_allclose(found.ahead, found.present, rtol=1e-6, atol=1e-12)


def test_every_part_that_adds_in_proportion_is_there_and_none_is_drawn() -> None:
    made = case()
    few, more = (structure_shapes(made.data, made.base, members=n).present for n in (1, 2))
    smooth = smooth_part(made.data, made.base)
    assert len(more) - len(few) == 1
    np.testing.assert_allclose(few[1:], more[2:])
    assert len(few) == 1 + len(smooth)
    # the fit's correction for large displacements is of the step before
    assert np.linalg.norm(few[1:] - smooth) < 0.02 * np.linalg.norm(smooth)


def test_the_law_of_an_effect_that_the_model_has_may_be_off_in_each_run_by_itself() -> None:
    made = case()
    effect, n = CATALOGUE["gage_length"], len(made.data.points)
    model = replace(made.base, effects=(effect,), strengths=(np.array([0.02]),))
    shapes = structure_shapes(made.data, model, made.data.points, members=1)
    plain = structure_shapes(made.data, made.base, made.data.points, members=1)
    own, ways = slice(len(plain.present), None), 3
    assert len(shapes.present) - len(plain.present) == ways * (n + 1)
    acts = [np.any(part[own], axis=2) for part in (shapes.present, shapes.ahead)]
    assert (acts[0].sum(axis=1) == [1] * (ways * n) + [0] * ways).all()
    assert (acts[1].sum(axis=1) == [0] * (ways * n) + [n] * ways).all()
    # a law that is off in a run is off alike wherever that run stands
    one = shapes.present[own].reshape(-1, n, 360)[np.arange(0, ways * n, ways), np.arange(n)]
    np.testing.assert_allclose(one, shapes.ahead[-ways], rtol=1e-6, atol=1e-12)


def test_a_fit_that_fails_or_is_worse_than_none_is_left_out_with_the_reason() -> None:
    nothing = tried().rivals[0]

    def worse(by: float) -> Rival:
        return replace(nothing, fitted=replace(nothing.fitted, cost=nothing.cost + by))

    def lost() -> Rival:
        raise ConvergenceError("no end", {}, 1.0)

    rivals, left_out = fitted_rivals(
        {"good": lambda: worse(-5.0), "bad": lambda: worse(2.0 * LOST), "lost": lost}, nothing
    )
    assert [rival.cost for rival in rivals] == [nothing.cost - 5.0]
    assert "did not reach the minimum" in left_out["bad"]
    assert left_out["lost"] == "its fit did not converge: no end"
