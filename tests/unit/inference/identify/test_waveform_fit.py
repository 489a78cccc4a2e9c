"""The fit finds what the model itself made, and its intervals are those of its cost."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import (
    LOADS,
    TIRE,
    exact_waveform,
    made_waves,
    operating,
)
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError
from tirelib.inference.identify.campaign_data import Data, straight_runs
from tirelib.inference.identify.delay import STD, UNIT, earlier
from tirelib.inference.identify.discrepancy import Discrepancy
from tirelib.inference.identify.identify import prior_std, start_file
from tirelib.inference.identify.waveform_fit import WaveformFit, fit_waveforms, ridges
from tirelib.inference.identify.waveform_problem import MISFIT, WaveformProblem, WaveformSolved
from tirelib.inference.identify.whiten_runs import RunWhitening
from tirelib.inference.statistics import posterior
from tirelib.inference.statistics.normal import Normal
from tirelib.inference.statistics.problem import Point
from tirelib.measured.waveforms import GRID
from tirelib.model.base import BARE, FREE, PLAIN, Coordinate, predict, values_of

NOISE = 4e-5
"""Noise of one gage; with five of them near what structure leaves white in a campaign."""
START = TIRE.changed(
    bending_stiffness=1.8,
    radial_stiffness=5.5e5,
    radial_pressure_slope=1.4,
    tangential_stiffness=1.5e5,
    tangential_pressure_slope=0.2,
    tread_stiffness=7.5e7,
    innerliner_offset=-0.0030,
    extension_stiffness=3.5e6,
)
WIDE = np.array([1.0, 1.0, 3.0, 1.0, 3.0, 1.0, 1.0, 1.0])
"""So wide that it tells next to nothing."""


@cache
def data(seed: int = 0, **options: object) -> Data:
    waves = made_waves(noise=NOISE, seed=seed, **options)
    # noise of the mean over five gages; no structure in what the model made
    return replace(straight_runs(waves).data(), noise=NOISE / np.sqrt(5.0))


def plain(measured: Data, prior: FloatArray = WIDE) -> WaveformFit:
    return fit_waveforms(measured, values_of(START), prior, free=BARE)


@pytest.fixture(scope="module")
def fitted() -> WaveformFit:
    return plain(data())


def errors(fit: WaveformFit) -> FloatArray:
    """Errors of the coordinates, in z."""
    out = []
    for coordinate in fit.free:
        value, true = float(fit.values[coordinate.name]), float(getattr(TIRE, coordinate.name))
        out.append((value - true) / coordinate.unit if coordinate.unit else np.log(value / true))
    return np.array(out)


def test_the_model_is_found_again_within_its_intervals(fitted: WaveformFit) -> None:
    error = errors(fitted)
    deviation = np.sqrt(np.diag(fitted.covariance))
    assert (deviation[[0, 1, 3, 5, 6]] < 0.1).all(), "the data have to tell the parameters"
    assert (np.abs(error) < 3.5 * deviation).all()


def test_errors_are_as_large_as_the_covariance_says() -> None:
    """Chi-square of the errors over four seeds, set points and all: 32 degrees of freedom.

    It scatters by 25 %. Set points that act along the linear ring's slopes, or errors of load that
    strain and deflection do not share, make it 1.9 to 2.0 over eight seeds. With errors of set
    points two fifths smaller than they are, these four give 1.74.
    """
    total, inside = 0.0, []
    for seed in range(10, 14):
        fit = plain(data(seed, loads=LOADS[::2], repeats=1))
        error = errors(fit)
        total += float(error @ np.linalg.solve(fit.covariance, error))
        inside.append(np.abs(error) < 1.96 * np.sqrt(np.diag(fit.covariance)))
    assert 0.6 < total / 32.0 < 1.45
    assert np.mean(inside) > 0.85


def test_the_whitened_residual_is_noise(fitted: WaveformFit) -> None:
    # 17 x 360 numbers scatter by 1 %; eight parameters take a thousandth
    assert fitted.error == pytest.approx(1.0, abs=0.05)


def test_without_noise_the_parameters_are_exact() -> None:
    waves = made_waves(noise=0.0, repeats=0, random=False, loads=LOADS[::2])
    exact = replace(straight_runs(waves).data(), noise=1e-6)
    # what the prior pulls and a forward difference leaves
    assert np.abs(errors(plain(exact))).max() < 0.01


def test_the_fit_does_not_depend_on_its_start(fitted: WaveformFit) -> None:
    near = fit_waveforms(
        data(), values_of(TIRE), 100.0 * WIDE, free=BARE
    )  # the priors stand about the starts, so they have to tell nothing
    far = plain(data(), 100.0 * WIDE)
    deviation = np.sqrt(np.diag(fitted.covariance))
    # the last step's tolerance and the correction's three passes
    assert np.abs(errors(near) - errors(far)).max() < 0.3 * deviation.max()


def test_a_narrow_prior_holds_its_parameter() -> None:
    std = WIDE.copy()
    std[0] = 1e-3
    fit = plain(data(loads=LOADS[::2]), std)
    assert float(fit.values["bending_stiffness"]) == pytest.approx(1.8, rel=3e-2)
    assert np.sqrt(fit.covariance[0, 0]) < 1.01e-3


def test_a_misfit_widens_the_intervals_and_takes_up_structure() -> None:
    measured = data(loads=LOADS[::2])
    wrong = measured.strain * (1.0 + 0.03 * np.cos(GRID / 0.2) * np.exp(-((GRID / 0.6) ** 2)))
    measured = replace(measured, strain=wrong, noise=2e-5)
    alone = plain(measured)
    both = fit_waveforms(measured, values_of(START), WIDE, free=BARE, discrepancy=Discrepancy())
    assert (np.diag(both.covariance)[:7] > np.diag(alone.covariance)[:7]).all()
    assert len(alone.found.rows[MISFIT]) == 0
    # the likeliest misfit, given the fitted model
    rows = both.found.rows[MISFIT]
    normal = Normal.of({MISFIT: rows}, both.found.solved.rest, both.whiten)
    likeliest = np.linalg.solve(normal.gram + np.eye(len(rows)), normal.right) @ rows
    left = both.found.solved.rest
    assert np.std(left - likeliest) < 0.95 * np.std(left)


def test_a_measured_deflection_informs(fitted: WaveformFit) -> None:
    without = replace(data(), deflection=np.full(17, np.nan))
    assert not without.with_deflection
    blind = plain(without)
    assert (np.diag(fitted.covariance) <= np.diag(blind.covariance) * 1.05).all()
    # little: the deflection's zero is free, its shape known to 3 %
    assert np.trace(fitted.covariance) < np.trace(blind.covariance)


def test_more_runs_make_narrower_intervals(fitted: WaveformFit) -> None:
    few = plain(data(loads=LOADS[::2], repeats=0))
    assert (np.diag(few.covariance) > 1.2 * np.diag(fitted.covariance)).all()


def test_a_fit_that_does_not_settle_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posterior, "MOST_STEPS", 1)
    with pytest.raises(ConvergenceError, match="fit of the base model: after 1 steps") as caught:
        plain(data(loads=LOADS[::2]))
    assert np.isfinite(caught.value.iterate.base).all()


def test_progress_is_told() -> None:
    said: list[str] = []
    fit = fit_waveforms(
        data(loads=LOADS[::2]),
        values_of(TIRE),
        WIDE[:7],
        free=FREE,
        progress=said.append,
    )
    assert len(said) == fit.steps
    assert all(word.startswith("fitting the base model, step ") for word in said)


def test_what_large_displacements_add_vanishes_for_small_loads() -> None:
    """Relative to the strain, large displacements cost in proportion to them."""
    loads = np.array([800.0, 1600.0, 3200.0, 4800.0])
    points = operating(loads, np.full(4, 2.1e5))
    points = replace(points, omega=0.01 * points.omega)  # a tire that spins grows at any load
    wave, depth = exact_waveform(TIRE, points)
    # the fibre at the gage has the length R + y, which the linear strain takes for R
    fibre = TIRE.ring_radius / (TIRE.ring_radius + TIRE.innerliner_offset)
    linear = predict(values_of(TIRE), points)
    more = wave / fibre - linear.wave
    strain = np.std(more, axis=1) / np.std(wave, axis=1)
    # half the load, about half the share
    assert strain[0] < 0.6 * strain[1] < 0.6 * 0.6 * strain[2]
    assert strain[0] < 0.02 < 0.06 < strain[3]
    deeper = (depth - linear.deflection) / depth
    assert deeper == pytest.approx(deeper[3] * loads / 4800.0, rel=0.25)


def profile(fit: WaveformFit, k: int, offset: float) -> float:
    """Rise of the cost with coordinate k held and all others at their best; without a misfit."""
    problem, here = fit.problem, fit.found.point.base
    others = np.array([j for j in range(len(here)) if j != k])

    def normal(z: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        solved = problem.solve(Point(z), fit.found.solved)
        rows, rest = fit.whiten(problem.slopes(Point(z), solved)), fit.whiten(solved.rest)
        cost = float(rest @ rest + np.sum((z / problem.widths) ** 2))
        weight = problem.widths**-2
        return rows @ rows.T + np.diag(weight), rows @ rest - weight * z, cost

    dz = offset * fit.found.covariance[:, k] / fit.found.covariance[k, k]
    for _ in range(3):
        gram, gradient, height = normal(here + dz)
        dz[others] += np.linalg.solve(gram[np.ix_(others, others)], gradient[others])
    return height - normal(here)[2]


def test_intervals_along_the_ridge_are_those_of_the_profile(fitted: WaveformFit) -> None:
    """A true profile likelihood of one parameter rises by 1.96 squared at the interval's ends."""
    interval, quadratic = ridges(fitted)
    for k in (3, 5):  # the widest, k_v, and the tread
        for end in interval[k]:
            rise = profile(fitted, k, float(end))
            assert rise == pytest.approx(1.96**2, rel=0.1)
    assert quadratic.all()


def test_the_solution_is_where_the_gradient_vanishes(fitted: WaveformFit) -> None:
    found, widths = fitted.found, fitted.problem.widths
    rows, rest = fitted.whiten(found.rows["base"]), fitted.whiten(found.solved.rest)
    gradient = rows @ rest - found.point.base / widths**2
    # a cost that falls by a thousandth at most is 0.03 deviations from the bottom
    step = found.covariance @ gradient
    assert (np.abs(step) < 0.05 * np.sqrt(np.diag(found.covariance)) + 1e-6).all()


def test_the_whitening_is_about_the_solution(fitted: WaveformFit) -> None:
    """Kept once the steps are below a deviation, it is that of the solution within a thousandth."""
    anew = fitted.problem.whitening(fitted.found.solved)
    rest = fitted.found.solved.rest
    assert fitted.whiten(rest) == pytest.approx(anew(rest), abs=0.05)


def test_a_late_trigger_is_a_delay_and_moves_no_parameter(fitted: WaveformFit) -> None:
    """A tenth of a millisecond: seven standard deviations of a run's angle zero."""
    measured = data()
    omega = np.asarray(measured.points.omega)
    late = replace(measured, strain=earlier(measured.strain, omega, -1e-4))
    fit = plain(late)
    pull = UNIT**2 * fit.found.covariance[-1, -1] / STD**2  # of its prior, about no delay
    assert fit.delay - fitted.delay == pytest.approx(1e-4 * (1.0 - pull), abs=1e-7)
    moved = errors(fit) - errors(fitted)
    assert np.abs(moved / np.sqrt(np.diag(fit.covariance))).max() < 0.05
    assert fit.error == pytest.approx(fitted.error, abs=0.005)


def test_a_tire_with_damping_is_fitted_as_one() -> None:
    """With damping the linear ring joins in; the fit finds the same parameters."""
    damped = TIRE.changed(damping=0.06)
    waves = made_waves(damped, noise=NOISE, repeats=0, loads=LOADS[::2], random=False)
    measured = replace(straight_runs(waves).data(), noise=NOISE / np.sqrt(5.0))
    fit = fit_waveforms(measured, values_of(START.changed(damping=0.06)), WIDE, free=BARE)
    assert (np.abs(errors(fit)) < 3.5 * np.sqrt(np.diag(fit.covariance))).all()
    assert fit.error == pytest.approx(1.0, abs=0.05)
    still = fit_waveforms(measured, values_of(START), WIDE, free=BARE)
    assert still.error > 1.5


def test_a_whitening_that_follows_the_solution_is_kept_in_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Or it could go in circles for ever: the last steps are downhill on one surface."""
    asked: list[int] = []
    whole = WaveformProblem.whitening

    def whitening(self: WaveformProblem, here: WaveformSolved) -> RunWhitening:
        asked.append(len(asked))
        return whole(self, here)

    monkeypatch.setattr(WaveformProblem, "whitening", whitening)
    monkeypatch.setattr(posterior, "WHITENING_MOVE", 0.0)  # as if every step were a long one
    monkeypatch.setattr(posterior, "WHITENING_STEPS", 3)
    fit = plain(data(loads=LOADS[::2]))
    assert fit.steps > 3
    assert len(asked) == 1 + 3


def test_a_fit_stays_in_the_ranges_of_a_tire(monkeypatch: pytest.MonkeyPatch) -> None:
    """The liner that the strain asks for lies further off than it may."""
    offset, wanted = BARE[6], float(TIRE.innerliner_offset)
    assert offset.name == "innerliner_offset"
    low, high = offset.ends(START.innerliner_offset)
    assert low < offset.distance(START.innerliner_offset, wanted) < high
    end = 0.5 * float(offset.distance(START.innerliner_offset, wanted))
    side = (-np.inf, end) if end > 0.0 else (end, np.inf)
    monkeypatch.setattr(
        Coordinate, "ends", lambda self, _: side if self == offset else (-np.inf, np.inf)
    )
    fit = plain(data())
    assert offset.distance(START.innerliner_offset, fit.values[offset.name]) == pytest.approx(end)


@pytest.mark.parametrize("crown", [1.0, 0.05])
def test_a_round_and_stiff_tread_is_not_taken_for_a_flat_and_soft_one(crown: float) -> None:
    """A fit from the prior alone finds a round tread half as stiff, four deviations away."""
    tire = TIRE.changed(
        shear_stiffness=7e4,
        rotary_inertia=3e-5,
        tread_shear_stiffness=6e6,
        tread_hardening=0.8,
        section_pull=0.03,
        liner_share=0.2,
        offset_pressure_slope=-0.02,
        tread_poisson=0.1,
        contact_crown=crown,
        creep=0.003,
        tread_spread=0.2,
    )
    waves = made_waves(tire, noise=1e-5)
    start = start_file(waves.header, straight_runs(waves), None)
    prior = np.array([prior_std(start, c) for c in PLAIN])
    fit = fit_waveforms(
        straight_runs(waves).data(),
        values_of(start.tire),
        prior,
        free=PLAIN,
        discrepancy=Discrepancy(),
    )
    deviation = np.sqrt(np.diag(fit.covariance))
    for name in ("tread_stiffness", "contact_crown", "shear_stiffness"):
        k = [c.name for c in PLAIN].index(name)
        error = np.log(float(fit.values[name]) / getattr(tire, name))
        assert abs(error) < 2.0 * deviation[k], name
    k = [c.name for c in PLAIN].index("offset_pressure_slope")
    found = float(fit.values["offset_pressure_slope"])
    assert abs(found - -0.02) < 2.0 * PLAIN[k].unit * deviation[k]
    assert deviation[k] < 0.5 * prior[k], "pressures of the campaign tell it"
