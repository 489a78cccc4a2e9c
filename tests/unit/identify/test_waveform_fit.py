"""The fit finds what the model itself made, and its intervals are those of its cost."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.identify.model_waves import LOADS, TIRE, exact_waveform, made_waves, operating
from tirelib.arrays import FloatArray
from tirelib.errors import ConvergenceError
from tirelib.identify import waveform_fit
from tirelib.identify.campaign_data import straight_runs
from tirelib.identify.delay import earlier
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.waveform_fit import (
    Data,
    Prior,
    Solver,
    WaveformFit,
    fit_waveforms,
)
from tirelib.model.base import BARE, FREE, Coordinate, predict, values_of
from tirelib.model.slopes import slopes_of
from tirelib.waveforms import GRID

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
WIDE = Prior(np.array([1.0, 1.0, 3.0, 1.0, 3.0, 1.0, 1.0, 1.0]))
"""So wide that it tells next to nothing."""


def data(seed: int = 0, **options: object) -> Data:
    waves = made_waves(noise=NOISE, seed=seed, **options)
    # noise of the mean over five gages; no structure in what the model made
    return replace(straight_runs(waves).data(), noise=NOISE / np.sqrt(5.0))


def plain(measured: Data, prior: Prior = WIDE) -> WaveformFit:
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
    """Chi-square of the errors over eight seeds, set points and all: 64 degrees of freedom.

    It scatters by 18 %. Set points that act along the linear ring's slopes, or errors of load that
    strain and deflection do not share, make it 1.9 to 2.0.
    """
    total, inside = 0.0, []
    for seed in range(10, 18):
        fit = plain(data(seed, loads=LOADS[::2], repeats=1))
        error = errors(fit)
        total += float(error @ np.linalg.solve(fit.covariance, error))
        inside.append(np.abs(error) < 1.96 * np.sqrt(np.diag(fit.covariance)))
    assert 0.6 < total / 64.0 < 1.45
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
        data(), values_of(TIRE), Prior(100.0 * WIDE.std), free=BARE
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
    both = fit_waveforms(measured, values_of(START), WIDE, free=BARE, discrepancy=Discrepancy())
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
        data(loads=LOADS[::2]),
        values_of(TIRE),
        Prior(WIDE.std[:7]),
        free=FREE,
        progress=said.append,
    )
    assert len(said) == fit.steps
    assert all(word.startswith("error ") for word in said)


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


def solver_at(measured: Data, fit: WaveformFit) -> Solver:
    """Return a solver that stands at the solution."""
    solver = Solver(measured, values_of(START), WIDE, BARE, (), None)
    solver.z = np.array(
        [
            (float(fit.values[c.name]) - float(getattr(START, c.name))) / c.unit
            if c.unit
            else np.log(float(fit.values[c.name]) / float(getattr(START, c.name)))
            for c in BARE
        ]
    )
    solver.model = solver.at(solver.z)
    solver.refresh()
    return solver


def profile(measured: Data, fit: WaveformFit, k: int, offset: float) -> float:
    """Rise of the cost with coordinate k held and all others at their best."""
    solver = solver_at(measured, fit)
    base, cost = solver.height, solver.cost
    others = np.array([j for j in range(len(BARE)) if j != k])
    dz = offset * fit.covariance[:, k] / fit.covariance[k, k]
    for _ in range(3):
        z = solver.z + dz
        model = solver.at(z)
        slopes = slopes_of(model, BARE)
        normal, gradient, height = cost.normal(model, slopes, z)
        dz[others] += np.linalg.solve(normal[np.ix_(others, others)], gradient[others])
    return height - base


def test_intervals_along_the_ridge_are_those_of_the_profile(fitted: WaveformFit) -> None:
    """A true profile likelihood of one parameter rises by 1.96 squared at the interval's ends."""
    measured = data()
    for k in (3, 5):  # the widest, k_v, and the tread
        for end in fitted.interval[k]:
            rise = profile(measured, fitted, k, float(end))
            assert rise == pytest.approx(1.96**2, rel=0.1)
    assert fitted.quadratic.all()


def test_the_solution_is_where_the_gradient_vanishes(fitted: WaveformFit) -> None:
    solver = solver_at(data(), fitted)
    step = np.linalg.solve(solver.normal, solver.gradient)
    # a cost that falls by a thousandth at most is 0.03 deviations from the bottom
    assert (np.abs(step) < 0.05 * np.sqrt(np.diag(fitted.covariance)) + 1e-6).all()
    assert solver.cost.value(solver.model, solver.z) == pytest.approx(solver.height)


def test_the_misfit_that_is_eliminated_is_the_best_one() -> None:
    """The cost with the misfit's best coefficients put in is the one with it eliminated."""
    measured = data(loads=LOADS[::2])
    fit = fit_waveforms(measured, values_of(START), WIDE, free=BARE, discrepancy=Discrepancy())
    cost = fit.cost
    rest = cost.rows(
        (cost.data.strain - fit.linear.waveform)[None],
        (measured.deflection - fit.linear.deflection)[None],
    )[0]
    weights = np.linalg.solve(
        cost.white_shapes @ cost.white_shapes.T + np.eye(len(cost.shapes)), cost.white_shapes @ rest
    )
    left = rest - weights @ cost.white_shapes
    explicit = float(left @ left + weights @ weights)
    model = solver_at(measured, fit).model
    assert cost.value(model, np.zeros(len(BARE))) == pytest.approx(explicit)
    misfit = np.tensordot(weights[1:], cost.shapes[1:], axes=1)
    assert fit.misfit == pytest.approx(misfit, abs=1e-9)


def test_a_late_trigger_is_a_delay_and_moves_no_parameter(fitted: WaveformFit) -> None:
    """A tenth of a millisecond: seven standard deviations of a run's angle zero."""
    measured = data()
    omega = np.asarray(measured.points.omega)
    late = replace(measured, strain=earlier(measured.strain, omega, -1e-4))
    fit = plain(late)
    assert fit.delay - fitted.delay == pytest.approx(1e-4, abs=1e-7)
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


def test_a_cost_that_follows_the_solution_is_kept_in_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Or it could go in circles for ever: the last steps are downhill on one surface."""
    renewed: list[bool] = []
    whole = waveform_fit.Solver.refresh

    def refresh(self: waveform_fit.Solver, *, renew: bool = True) -> None:
        if not renewed:
            whole(self)
        renewed.append(renew)

    monkeypatch.setattr(waveform_fit.Solver, "refresh", refresh)
    monkeypatch.setattr(waveform_fit.Solver, "step", lambda self: 5.0)
    with pytest.raises(ConvergenceError):
        plain(data(loads=LOADS[::2]))
    kept = waveform_fit.FOLLOWED
    assert renewed == [True] * kept + [False] * (waveform_fit.MAX_STEPS - kept)


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
