"""Chapter 5: stiffness and pressure from strain, beside the conventional route."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from routes.static_route import load_series, static_route
from routes.static_route_fit import Parameter, Quantity, fit_few, profile
from routes.static_route_problem import StrainProblem

from tests.routes.route_campaign import SERIES, runs, tire, tire_file
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import operating_points, smoothed
from tirelib.physics.contact.static import StaticTire, press_to_load
from tirelib.physics.ring.green import modal_response, pressed_shape
from tirelib.physics.strain.full_turn import full_ring_deformation

EI, K_U, RATE, K_T = 12.0, 1.1e6, -4.0, 7.5e7
TRUE = tire()
ONE_PRESSURE = [c for c in SERIES if c[1] == 2.1]


def static_runs() -> tuple[StraightRuns, FloatArray]:
    """Return a load series made by the static ring itself, and its true half angles."""
    data = runs(TRUE, ONE_PRESSURE, exact=False)
    loads = data.waves.conditions["Fz"]
    ring = StaticTire(
        ring_radius=TRUE.ring_radius,
        free_radius=TRUE.free_radius,
        bending_stiffness=EI,
        radial_stiffness=K_U,
        softening=RATE,
        tread_stiffness=K_T,
    )
    pressed = press_to_load(ring, loads, nodes=201)
    k_u = K_U * np.exp(RATE * pressed.deflection)
    at = {"ring_radius": TRUE.ring_radius, "bending_stiffness": EI, "radial_stiffness": k_u}
    u, bend = (
        pressed_shape(
            np.broadcast_to(GRID, (loads.size, GRID.size)),
            pressed.angle,
            pressed.pressure,
            derivative=d,
            **at,
        )
        for d in (0, 2)
    )
    strain = -TRUE.innerliner_offset / TRUE.ring_radius**2 * (u + bend)
    strain = smoothed(strain, operating_points(data.waves), LowPass())
    known = replace(data, strain=strain, deflection=pressed.deflection)
    return known, pressed.half_angle


@pytest.fixture(scope="module")
def problem() -> StrainProblem:
    data, half = static_runs()
    return StrainProblem(data, tire_file(TRUE), half, np.zeros(half.size))


def test_the_shape_alone_leaves_the_sidewall_open(problem: StrainProblem) -> None:
    # the dissertation's remark: k_u hardly matters; the level of the deformation is what tells it
    def shape_only(x: FloatArray) -> FloatArray:
        rest = problem.residual(x).reshape(problem.measured.shape)
        out: FloatArray = (rest - rest.mean(axis=1, keepdims=True)).ravel()
        return out

    def width(residual: Callable[[FloatArray], FloatArray]) -> float:
        fit = fit_few(residual, problem.parameters, where="test")
        found = profile(fit, residual, "radial_stiffness")
        return float(np.log(found.high / found.low))

    assert width(shape_only) > 5.0 * width(problem.residual)


def test_stiffness_of_the_static_ring_comes_back(problem: StrainProblem) -> None:
    _, quantities = problem.solve(np.full(problem.half.size, 5e-4))
    by_name = {q.name: q for q in quantities}
    ring = by_name["bending_stiffness"]
    assert ring.low < EI < ring.high
    # k_u where the loads are; A and B alone trade with each other
    middle = float(problem.deflection.mean())
    a, b = by_name["radial_stiffness"].value, by_name["radial_deflection_rate"].value
    assert a * np.exp(b * middle) == pytest.approx(K_U * np.exp(RATE * middle), rel=0.08)


def test_the_ring_under_a_profile_is_that_of_the_green_s_function(problem: StrainProblem) -> None:
    # the fit's harmonics against Eq. (47) in closed form, without the filter's part
    x = np.array([p.start for p in problem.parameters])
    place, _, pressure = problem.pressure(x)
    k_u = x[1] * np.exp(x[2] * problem.deflection)
    closed = pressed_shape(
        np.zeros((problem.load.size, 1)),
        place / problem.radius,
        pressure,
        ring_radius=problem.radius,
        bending_stiffness=x[0],
        radial_stiffness=k_u,
    )[:, 0]
    # the filter's part is what differs; it is a small share of the deformation
    np.testing.assert_allclose(problem.deformation(x)[:, 0], closed, rtol=0.08)


def test_the_profiles_carry_the_load(problem: StrainProblem) -> None:
    x = np.array([p.start for p in problem.parameters])
    place, weight, pressure = problem.pressure(x)
    carried = np.sum(weight * pressure * np.cos(place / problem.radius), axis=1)
    np.testing.assert_allclose(carried, problem.load, rtol=1e-12)


def test_measured_deformation_meets_the_road_at_the_edges(problem: StrainProblem) -> None:
    # Eq. (38): u = -d0 + R0 (1 - cos), positive outward
    road = -problem.deflection + TRUE.free_radius * (1.0 - np.cos(problem.half))
    np.testing.assert_allclose(problem.measured[:, -1], road, atol=1e-9)


def test_the_filter_acts_on_the_ring_as_on_the_strain(problem: StrainProblem) -> None:
    # the true ring through the filter's operator gives the deformation found from filtered strain
    data, half = static_runs()
    loads = problem.load
    ring = StaticTire(
        ring_radius=TRUE.ring_radius,
        free_radius=TRUE.free_radius,
        bending_stiffness=EI,
        radial_stiffness=K_U,
        softening=RATE,
        tread_stiffness=K_T,
    )
    pressed = press_to_load(ring, loads, nodes=201)
    n = np.arange(1.0, 61.0)
    step = np.gradient(pressed.angle, axis=1)
    wave = np.cos(pressed.angle[..., None] * n)
    harmonics = np.einsum("li,lin->ln", step * pressed.pressure, wave) / np.pi
    k_u = K_U * np.exp(RATE * pressed.deflection)
    answer = modal_response(
        n, ring_radius=TRUE.ring_radius, bending_stiffness=EI, radial_stiffness=k_u[:, None]
    )
    through = np.einsum("lpn,ln->lp", problem.shape, answer * harmonics)
    error = np.abs(through - problem.measured).max()
    unfiltered = StrainProblem(
        replace(data, waves=replace(data.waves, low_pass=LowPass(order=120.0))),
        problem.start,
        half,
        problem.middle,
    )
    without = np.einsum("lpn,ln->lp", unfiltered.shape, answer * harmonics)
    assert error < 0.35 * np.abs(without - problem.measured).max()


def test_the_route_gives_its_tables_for_a_rolling_tire() -> None:
    found = static_route(runs(TRUE, SERIES), tire_file(TRUE))
    assert found.run.size == 5
    assert found.pressure == pytest.approx(2.1e5)
    lengths = found.lengths
    # as in Fig. 5-18: read < corrected, and the pressed ring's length grows fastest with load
    assert (lengths.read < lengths.corrected).all()
    growth = lengths.conventional[-1] / lengths.conventional[0]
    assert growth > lengths.corrected[-1] / lengths.corrected[0]
    assert (lengths.corrected_std > 0).all()
    assert np.abs(found.load_error).max() < 0.02
    assert {q.name for q in found.conventional} == {
        "bending_stiffness",
        "radial_stiffness",
        "radial_deflection_rate",
        "tread_stiffness",
    }
    for shape in found.pressures:
        carried = np.trapezoid(shape.strain_based * np.cos(shape.x / TRUE.ring_radius), shape.x)
        assert carried == pytest.approx(shape.load, rel=0.02)  # 121 points, steep edges
        assert shape.centre_pressure.std > 0
    assert found.correlation.shape == (13, 13)
    np.testing.assert_allclose(np.diag(found.correlation), 1.0)
    # without a tension the ring takes what the inflation carries as stiffness of its own
    assert found.strain_based[0].value > 2.0 * TRUE.bending_stiffness


def test_without_loaded_radii_there_is_no_series() -> None:
    data = runs(TRUE, SERIES)
    blind = replace(data, deflection=np.full(len(SERIES), np.nan))
    with pytest.raises(CalibrationError, match=r"0 of 11 runs have one"):
        load_series(blind)


def test_the_longest_series_is_taken_in_order_of_load() -> None:
    data = runs(TRUE, SERIES[::-1])
    loads = data.waves.conditions["Fz"][load_series(data)]
    np.testing.assert_array_equal(loads, [1700, 2600, 4300, 6000, 6800])


def _line(scale: float) -> tuple[tuple[Parameter, ...], np.ndarray, np.ndarray]:
    t = np.linspace(0.0, 1.0, 20)
    return (
        (Parameter("a", "-", 1.0, 0.01, 100.0), Parameter("b", "-", 0.0, -10, 10, scaled=False)),
        t,
        scale * (3.0 + 0.5 * t),
    )


def test_a_fit_of_a_line_has_the_covariance_of_least_squares() -> None:
    parameters, t, y = _line(1.0)
    sigma = 0.02
    fit = fit_few(lambda v: (y - v[0] - v[1] * t) / sigma, parameters, where="line")
    design = np.stack([np.ones(20), t], axis=1)
    expected = sigma * np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
    a, b = fit.quantities()
    assert (a.value, b.value) == pytest.approx((3.0, 0.5), rel=1e-5)
    assert (a.std, b.std) == pytest.approx(tuple(expected), rel=1e-3)


def test_the_profile_of_a_line_is_its_normal_interval() -> None:
    parameters, t, y = _line(1.0)

    def rest(v: FloatArray) -> FloatArray:
        out: FloatArray = (y - v[0] - v[1] * t) / 0.02
        return out

    fit = fit_few(rest, parameters, where="line")
    along, normal = profile(fit, rest, "a"), fit.quantities()[0]
    # interpolation of the cost's root between whole deviations; exact for a parabola
    assert (along.low, along.high) == pytest.approx((normal.low, normal.high), rel=2e-3)
    assert "not_quadratic" not in along.flags
    assert "not_identifiable" not in along.flags


def test_a_parameter_that_the_cost_does_not_know_is_open_to_its_bounds() -> None:
    parameters, t, y = _line(1.0)

    def rest(v: FloatArray) -> FloatArray:
        out: FloatArray = (y - v[0] - 0.5 * t + 1e-9 * v[1]) / 0.02
        return out

    fit = fit_few(rest, parameters, where="line")
    found = profile(fit, rest, "b")
    assert "not_identifiable" in found.flags
    assert (found.low, found.high) == (-10.0, 10.0)


def test_a_bent_cost_is_not_quadratic() -> None:
    parameter = (Parameter("b", "-", 0.3, -10, 10, scaled=False),)

    def rest(v: FloatArray) -> FloatArray:
        out: FloatArray = np.array([np.expm1(3.0 * v[0]), 0.0])
        return out

    fit = fit_few(rest, parameter, where="bent")
    found: Quantity = profile(fit, rest, "b")
    assert "not_quadratic" in found.flags


def test_shared_inputs_widen_the_interval() -> None:
    parameters, t, y = _line(1.0)

    def rest(v: FloatArray) -> FloatArray:
        out: FloatArray = (y - v[0] - v[1] * t) / 0.02
        return out

    fit = fit_few(rest, parameters, where="line")
    wide = fit.widened(np.full((1, 20), 5.0))
    # a common error of five deviations moves the offset by 0.1
    assert wide.quantities()[0].std == pytest.approx(
        np.hypot(fit.quantities()[0].std, 0.1), rel=1e-3
    )


def test_a_bound_is_told() -> None:
    parameters, t, y = _line(1.0)
    tight = (replace(parameters[0], highest=2.0), parameters[1])
    fit = fit_few(lambda v: (y - v[0] - v[1] * t) / 0.02, tight, where="line")
    assert "at_boundary" in fit.quantities()[0].flags


def test_the_even_series_of_a_waveform_bends_the_ring_as_its_spectrum() -> None:
    # the route's symmetric strain against the full-ring inversion of Eq. (35)
    data, _ = static_runs()
    found = full_ring_deformation(
        data.strain, ring_radius=TRUE.ring_radius, liner_offset=TRUE.innerliner_offset
    )
    assert np.abs(found.sine[:, 2:20]).max() < 1e-3 * np.abs(found.cosine[:, 2:20]).max()
