"""Noise of forces as it counts."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.force_points import VALUES
from tests.unit.planning.drifting import NOISE, case
from tirelib.diagnose.forces.fit import fit_force
from tirelib.effects import CATALOGUE
from tirelib.planning.criterion import Noise
from tirelib.planning.force_noise import BlockWhitening, counted_noise, set_points
from tirelib.planning.force_rivals import force_forecasts, structure_rows, try_force_suspects

BLOCK = np.array([3, 1, 1, 3, 2, 3])
TANGENTS = np.random.default_rng(2).standard_normal((6, 3))


def test_whitened_forces_are_independent_within_and_across_blocks() -> None:
    whiten = BlockWhitening(0.7, TANGENTS, BLOCK)
    together = (BLOCK[:, None] == BLOCK).astype(float)
    covariance = 0.49 * np.eye(6) + together * (TANGENTS @ TANGENTS.T)
    root = np.linalg.cholesky(covariance)
    white = whiten(root.T)
    assert white.T @ white == pytest.approx(np.eye(6))
    assert whiten.volume == pytest.approx(np.linalg.slogdet(covariance)[1])


def test_set_points_count_as_far_as_the_present_points_show_them() -> None:
    made = case("pressure", 0.0)
    base = fit_force(made.problem, VALUES)
    none = np.zeros((0, len(made.problem)))
    _, exact = counted_noise(made, base, none)
    assert exact.share < 0.3
    off = set_points(made.problem, base) @ np.array([1.0, 1.0, 1.0, 0.0])
    signs = np.random.default_rng(4).choice([-1.0, 1.0], off.size)
    rough = replace(
        made, problem=replace(made.problem, measured=made.problem.measured + signs * off)
    )
    noise, counted = counted_noise(rough, fit_force(rough.problem, VALUES), none)
    assert counted.share > 2.0 * exact.share
    # set points explain it: the noise of a point stays that of repeats
    assert noise.random == pytest.approx(NOISE, rel=0.2)


def test_what_goes_together_in_a_block_beyond_its_set_points_is_more_noise() -> None:
    made = case("pressure", 0.0)
    block = np.repeat(np.arange(len(made.problem) // 6), 6)
    shift = 3.0 * NOISE * np.random.default_rng(5).standard_normal(block.max() + 1)[block]
    rough = replace(made.problem, measured=made.problem.measured + shift, block=block)
    base = fit_force(rough, VALUES)
    none = np.zeros((0, len(rough)))
    _, counted = counted_noise(replace(made, problem=rough), base, none)
    _, alone = counted_noise(
        replace(made, problem=replace(rough, block=np.arange(block.size))), base, none
    )
    assert counted.excess > 1.2 * alone.excess


def test_a_forecast_holds_what_the_present_points_tell_of_structure_and_set_points() -> None:
    made = case("pressure", 0.1)
    base, problem = fit_force(made.problem, VALUES), made.problem
    structure = structure_rows(problem, len(problem), base)
    suspects = [(CATALOGUE["friction_pressure"], np.zeros(1))]
    trial = try_force_suspects(made, base, suspects, structure)
    (rival,) = trial.rivals
    (told,) = force_forecasts(trial, problem, structure)
    left, plain = (
        trial.counted(problem.measured - wave) for wave in (told.wave[:, 0], rival.fit.predicted)
    )
    # the cost holds the priors as well; the fit alone knows nothing of structure
    assert np.sum(left**2) < rival.cost < np.sum(plain**2)
    exact = replace(trial, counted=replace(trial.counted, share=0.0))
    rough = replace(trial, counted=replace(trial.counted, share=2.0))
    forecasts = [force_forecasts(each, problem, structure)[0] for each in (exact, rough)]
    sizes = [
        each.missed(replace(each, wave=told.wave + 10.0 * NOISE), Noise(NOISE, 0.0), 1.0)[0]
        for each in forecasts
    ]
    assert (sizes[0] > 1.05 * sizes[1]).mean() > 0.5
    assert (sizes[0] >= sizes[1]).all()
