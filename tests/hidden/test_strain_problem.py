"""The problem of strain: its slopes are those of its model, its whitening that of its noise."""

from copy import copy
from pathlib import Path

import numpy as np
import pytest
from hidden.cases import load_case

from tirelib.core.arrays import FloatArray
from tirelib.effects import CATALOGUE
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import fitted
from tirelib.inference.identify.literature import literature
from tirelib.inference.identify.random_effects import scales, tangents
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.problems.whiten_strain import Whitener
from tirelib.inference.statistics.posterior import posterior
from tirelib.inference.statistics.problem import Point
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import move

CASE = Path(__file__).parent / "data" / "1001-none.npz"
OWN = 0.001


@pytest.fixture(scope="module")
def problem() -> StrainProblem:
    case = load_case(CASE)
    runs = straight_runs(case.waves.take(~case.held_out))
    return StrainProblem(runs, fitted(runs)[1].values, list(CATALOGUE.values()))


def test_a_narrow_prior_stands_where_it_comes_from(problem: StrainProblem) -> None:
    """A fit that has moved such a number pays for it, and the model is the one that was given."""
    values = {**problem.values, "centrifugal_tension": 1.05}
    moved = StrainProblem(problem.runs, values, ())
    k = [c.name for c in moved.free].index("centrifugal_tension")
    assert moved.start.base[k] == pytest.approx(np.log(1.05))
    assert np.delete(moved.start.base, k) == pytest.approx(0.0)
    held = problem.model_at(Point(np.zeros(len(problem.free) + 1)), problem.data.points)
    there = moved.solve(moved.start).model
    assert there.made.constants.tension == pytest.approx(
        held.made.constants.tension + 0.05 * spun(problem)
    )


def test_one_start_is_a_tire_as_the_literature_has_it(problem: StrainProblem) -> None:
    own, other = problem.starts
    assert own is problem.start
    there = move(problem.values, other.base[:-1], problem.free)
    known = literature(float(np.max(problem.values["pressure"])))
    for coordinate in problem.free:
        value = there[coordinate.name]
        if coordinate.name == "contact_crown":  # rounder than the model's, which is flat
            assert problem.values[coordinate.name] < 0.2 < value
        elif coordinate.name in known:
            assert value == pytest.approx(known[coordinate.name].value)
        else:  # the gages' place is measured
            assert value == problem.values[coordinate.name]
    assert "shear_stiffness" in known
    assert other.base[-1] == 0.0
    rounder = copy(problem)
    rounder.values = {**problem.values, "contact_crown": 0.6}
    _, flat = rounder.starts
    there = move(rounder.values, flat.base[:-1], rounder.free)
    assert there["contact_crown"] == pytest.approx(known["contact_crown"].value)


def test_fits_of_many_runs_begin_with_a_quarter_that_spans_their_conditions(
    problem: StrainProblem,
) -> None:
    assert problem.thinned() is problem  # 15 runs are few
    many = problem._of(np.tile(np.arange(len(problem.data.points)), 6))
    part = many.thinned()
    few, whole = part.data.points, many.data.points
    assert len(few) == len(whole) // 4 == len(part.noise) == part.present
    assert part.living == problem.living
    assert part.start is problem.start
    for name in ("load", "omega", "pressure"):
        assert np.ptp(getattr(few, name)) > 0.7 * np.ptp(getattr(whole, name))
    assert part.solve(part.start).rest.shape == (len(few), GRID.size)


def spun(problem: StrainProblem) -> FloatArray:
    """Return rho A R^2 Omega^2, (n_runs,), [N]."""
    values, omega = problem.values, problem.data.points.omega
    return np.asarray(values["mass"] * (values["ring_radius"] * omega) ** 2)


def test_slopes_are_those_of_the_model(problem: StrainProblem) -> None:
    effect = CATALOGUE["temperature"]
    here = Point(np.zeros(len(problem.free) + 1), (effect,), (np.array([0.1]),))
    solved = problem.solve(here)
    slopes = problem.slopes(here, solved)
    step = 1e-3
    for k in range(len(slopes)):
        base, strength = here.base.copy(), here.strengths[0].copy()
        if k < base.size:
            base[k] += step
        else:
            strength += step * effect.scale
        moved = problem.solve(Point(base, (effect,), (strength,)), solved)
        difference = (solved.rest - moved.rest) / step
        error = np.linalg.norm(difference - slopes[k]) / np.linalg.norm(slopes[k])
        assert error < 0.03, k


def test_a_planted_strength_comes_back(problem: StrainProblem) -> None:
    effect = CATALOGUE["temperature"]
    zero = np.zeros(len(problem.free) + 1)
    with_it = problem.solve(Point(zero, (effect,), (np.array([0.15]),)))
    made = StrainProblem.__new__(StrainProblem)
    made.__dict__.update(problem.__dict__)
    made.data = problem.data.__class__(
        **{
            name: getattr(problem.data, name) for name in problem.data.__slots__ if name != "strain"
        },
        strain=with_it.waveform,
    )
    fit = posterior(made, (effect,), {}, made.whitener(OWN))
    assert fit.point.strengths[0] == pytest.approx([0.15], rel=0.03)
    # the priors of a strength and of the base leave it short by no more than its deviation
    assert abs(fit.point.strengths[0][0] - 0.15) < fit.std(0)[0]


def test_effects_that_this_plan_cannot_show_say_why(problem: StrainProblem) -> None:
    assert "slip angle" in problem.dead["traction"] or "slip" in problem.dead["traction"]
    names = {effect.name for effect in problem.living}
    assert "temperature" in names
    assert not names & {"belt_shear", "belt_extension", "rotary_inertia"}


def test_whitening_is_the_inverse_of_noise_and_set_points(problem: StrainProblem) -> None:
    random = np.random.default_rng(0)
    wave = problem.reference.waveform[:2]
    points = problem.data.points.take(np.arange(2))
    slope = np.stack([wave, 0.3 * wave], axis=2)
    tangent = tangents(wave, slope[..., 0], slope[..., 1])
    scale = scales(problem.data.tolerance, problem.data.angle_std[:2])
    noise, low_pass = 2e-6, LowPass()
    whiten = Whitener.of(
        wave, tangent, scale, problem.half_angle[:2], points, low_pass, noise=noise, own=0.0
    )
    # the volume is that of the runs, each by itself
    spread = whiten.lower @ whiten.lower.swapaxes(1, 2)
    assert whiten.log_volume == pytest.approx(-0.5 * np.linalg.slogdet(spread)[1].sum())
    parts = [whiten.take(slice(run, run + 1)).log_volume for run in range(2)]
    assert whiten.log_volume == pytest.approx(sum(parts))
    count = 3000
    # white before the filter, as the noise of a transmitter is
    order = np.fft.rfftfreq(GRID.size, 1.0 / GRID.size)
    sigma = low_pass.sigma(float(points.omega[0]) / (2.0 * np.pi))
    gain = np.exp(-0.5 * (sigma * order) ** 2) * (order > 0)
    white = np.fft.irfft(np.fft.rfft(random.standard_normal((count, 2, GRID.size))) * gain)
    white *= noise / np.sqrt(np.mean(white**2))
    off = scale * random.standard_normal((count, 2, 4))
    rows = whiten(white + np.einsum("rnk,crk->crn", tangent, off))
    covariance = np.cov(rows.T)
    kept = np.abs(covariance - np.eye(len(covariance)))
    assert np.abs(np.diag(covariance) - 1.0).max() < 0.25
    assert kept.mean() < 0.03


def test_misfit_shapes_are_in_one_group_each_and_reach_round_the_turn(
    problem: StrainProblem,
) -> None:
    groups = problem.remainder(problem.start, problem.solve(problem.start))
    assert len(groups) == 12
    degrees = np.rad2deg(np.abs(GRID))
    half = np.rad2deg(problem.half_angle.max())
    far = np.concatenate([rows for name, rows in groups.items() if name.endswith(", far belt")])
    near = np.concatenate([rows for name, rows in groups.items() if name.endswith("contact")])
    # a shape that is centred more than five half contact angles away is even in the contact
    assert np.ptp(far[..., degrees < half], axis=-1).max() < 0.01 * np.abs(near).max()
    # the top of the tire is covered
    largest = np.abs(far).max(axis=(0, 1))
    assert largest[degrees > 170.0].min() > 0.5 * largest.max()
