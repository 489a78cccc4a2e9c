"""The fit finds what the model itself made, and its intervals are those of its cost."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.unit.identify.model_waves import LOADS, TIRE, exact_waveform, made_waves, operating
from tirelib.arrays import FloatArray
from tirelib.errors import ConvergenceError
from tirelib.identify import waveform_fit
from tirelib.identify.campaign_data import straight_runs
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.identify import FITTED
from tirelib.identify.waveform_fit import Data, Prior, WaveformFit, fit_waveforms
from tirelib.model.base import FREE, large_displacements, values_of
from tirelib.waveforms import GRID

NOISE = 4e-5
"""Of one gage; with five of them near what structure leaves white in a campaign."""
START = TIRE.changed(
    bending_stiffness=1.8, radial_stiffness=5.5e5, radial_pressure_slope=1.4,
    tangential_stiffness=1.5e5, tangential_pressure_slope=0.2, tread_stiffness=7.5e7,
    innerliner_offset=-0.0030, extension_stiffness=3.5e6,
)  # fmt: skip
WIDE = Prior(np.array([1.0, 1.0, 3.0, 1.0, 3.0, 1.0, 1.0, 1.0]))
"""So wide that it tells next to nothing."""


def data(seed: int = 0, **options: object) -> Data:
    waves = made_waves(noise=NOISE, seed=seed, **options)
    # noise of the mean over five gages; no structure in what the model made
    return replace(straight_runs(waves).data(), noise=NOISE / np.sqrt(5.0))


def plain(measured: Data, prior: Prior = WIDE, exact: bool = True) -> WaveformFit:
    return fit_waveforms(measured, values_of(START), prior, free=FITTED, exact=exact)


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
    """Chi-square of the errors over five seeds: 40 degrees of freedom, 2.2 sigma either side.

    With noise alone: in the whitening set points act along the linear ring's slopes, in the data
    along those of large displacements.
    """
    total = 0.0
    for seed in range(10, 15):
        fit = plain(data(seed, loads=LOADS[::2], repeats=1, random=False))
        error = errors(fit)
        total += float(error @ np.linalg.solve(fit.covariance, error))
    assert 0.5 < total / 40.0 < 1.5


def test_the_whitened_residual_is_noise(fitted: WaveformFit) -> None:
    # 17 x 360 numbers scatter by 1 %; eight parameters take a thousandth
    assert fitted.error == pytest.approx(1.0, abs=0.05)


def test_without_noise_the_parameters_are_exact() -> None:
    waves = made_waves(noise=0.0, repeats=0, random=False, loads=LOADS[::2])
    exact = replace(straight_runs(waves).data(), noise=1e-6)
    # what the prior pulls and a forward difference leaves
    assert np.abs(errors(plain(exact))).max() < 0.01


def test_the_linear_ring_alone_misses_large_displacements() -> None:
    measured = data(loads=LOADS[::2])
    assert plain(measured, exact=False).rms > 5.0 * plain(measured).rms


def test_the_fit_does_not_depend_on_its_start(fitted: WaveformFit) -> None:
    near = fit_waveforms(
        data(), values_of(TIRE), Prior(100.0 * WIDE.std), free=FITTED
    )  # the priors stand about the starts, so they have to tell nothing
    far = plain(data(), Prior(100.0 * WIDE.std))
    deviation = np.sqrt(np.diag(fitted.covariance))
    # the last step's tolerance and the correction's three passes
    assert np.abs(errors(near) - errors(far)).max() < 0.3 * deviation.max()


def test_a_narrow_prior_holds_its_parameter() -> None:
    std = WIDE.std.copy()
    std[0] = 1e-3
    fit = plain(data(loads=LOADS[::2]), Prior(std))
    assert float(fit.values["bending_stiffness"]) == pytest.approx(1.8, rel=3e-2)
    assert np.sqrt(fit.covariance[0, 0]) < 1.01e-3


def test_a_misfit_widens_the_intervals_and_takes_up_structure() -> None:
    measured = data(loads=LOADS[::2])
    wrong = measured.strain * (1.0 + 0.03 * np.cos(GRID / 0.2) * np.exp(-((GRID / 0.6) ** 2)))
    measured = replace(measured, strain=wrong, noise=2e-5)
    alone = plain(measured)
    both = fit_waveforms(measured, values_of(START), WIDE, free=FITTED, discrepancy=Discrepancy())
    assert (np.diag(both.covariance)[:7] > np.diag(alone.covariance)[:7]).all()
    assert (alone.misfit == 0).all()
    left = measured.strain - both.linear.waveform
    left = left - left.mean(axis=1, keepdims=True)
    assert np.std(left - both.misfit) < 0.95 * np.std(left)


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
    monkeypatch.setattr(waveform_fit, "MAX_STEPS", 1)
    with pytest.raises(ConvergenceError, match="still move by") as caught:
        plain(data(loads=LOADS[::2]))
    assert caught.value.iterate["bending_stiffness"] > 0.0


def test_progress_is_told() -> None:
    said: list[str] = []
    fit = fit_waveforms(
        data(loads=LOADS[::2]), values_of(TIRE), Prior(WIDE.std[:7]), free=FREE,
        progress=said.append,
    )  # fmt: skip
    assert len(said) == fit.steps
    assert all(word.startswith("error ") for word in said)


def test_the_correction_vanishes_for_small_loads() -> None:
    """Relative to the strain, large displacements cost in proportion to them."""
    loads = np.array([800.0, 1600.0, 3200.0, 4800.0])
    points = operating(loads, np.full(4, 2.1e5))
    fix = large_displacements(values_of(TIRE), points)
    wave, depth = exact_waveform(TIRE, points)
    strain = np.std(fix.waveform, axis=1) / np.std(wave, axis=1)
    # half the load, about half the share
    assert strain[0] < 0.6 * strain[1] < 0.6 * 0.6 * strain[2]
    assert strain[0] < 0.02 < 0.06 < strain[3]
    assert fix.deflection / depth == pytest.approx(
        fix.deflection[3] / depth[3] * loads / 4800.0, rel=0.25
    )


def solver_at(measured: Data, fit: WaveformFit) -> tuple[waveform_fit._Solver, FloatArray]:
    """Return a solver that stands at the solution, and the solution."""
    solver = waveform_fit._Solver(measured, values_of(START), WIDE, FITTED, (), None, True)
    solver.z = np.array([
        (float(fit.values[c.name]) - float(getattr(START, c.name))) / c.unit
        if c.unit else np.log(float(fit.values[c.name]) / float(getattr(START, c.name)))
        for c in FITTED
    ])  # fmt: skip
    solver.values = dict(fit.values)
    solver.refresh()
    return solver, solver.z


def profile(measured: Data, fit: WaveformFit, k: int, offset: float) -> float:
    """Rise of the cost with coordinate k held and all others at their best, by BFGS."""
    solver, solution = solver_at(measured, fit)
    others = np.array([j for j in range(len(FITTED)) if j != k])
    # coordinates in which the cost is round, were it a parabola
    inverse = np.linalg.inv(fit.covariance)[np.ix_(others, others)]
    turn = np.linalg.inv(np.linalg.cholesky(inverse)).T
    ridge = offset * fit.covariance[others, k] / fit.covariance[k, k]
    probe = 0.02 * np.vstack([np.zeros(others.size), np.eye(others.size), -np.eye(others.size)])

    def cost(free: FloatArray) -> tuple[float, FloatArray]:
        z = np.tile(solution, (len(probe), 1))
        z[:, k] += offset
        z[:, others] += ridge + (free + probe) @ turn.T
        found = solver._costs(z)
        plus, minus = np.split(found[1:], 2)
        return float(found[0]), (plus - minus) / 0.04

    base = float(solver._costs(solution[None])[0])
    found = minimize(cost, np.zeros(others.size), jac=True, method="BFGS", options={"maxiter": 12})
    return float(found.fun) - base


def test_intervals_along_the_ridge_are_those_of_the_profile(fitted: WaveformFit) -> None:
    """A true profile likelihood of one parameter rises by 1.96 squared at the interval's ends."""
    measured = data()
    for k in (3, 5):  # the widest, k_v, and the tread
        for end in fitted.interval[k]:
            rise = profile(measured, fitted, k, float(end))
            assert rise == pytest.approx(1.96**2, rel=0.1)
    assert fitted.quadratic.all()


def test_the_slopes_of_the_whole_model_are_its_differences(fitted: WaveformFit) -> None:
    """With a finer step, and of large displacements too: k_v's slope doubles with them."""
    solver, _ = solver_at(data(), fitted)
    for k, coordinate in enumerate(FITTED):
        ends = []
        for step in (-2e-4, 2e-4):
            value = float(coordinate.moved(float(fitted.values[coordinate.name]), step))
            tire = TIRE.changed(**{
                c.name: float(fitted.values[c.name]) for c in FITTED
            }).changed(**{coordinate.name: value})  # fmt: skip
            ends.append(exact_waveform(tire, solver.data.points))
        slope = (ends[1][0] - ends[0][0]) / 4e-4
        depth = (ends[1][1] - ends[0][1]) / 4e-4
        # forward differences of 1e-3 and, for edges between nodes, the exact ring's quadrature
        assert np.std(solver.linear.waveform_slopes[k] - slope) < 0.03 * np.std(slope)
        assert solver.linear.deflection_slopes[k] == pytest.approx(
            depth, rel=0.02, abs=0.02 * np.abs(depth).max() + 1e-9
        )
