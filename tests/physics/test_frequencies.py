"""Laws of the standing ring's natural frequencies and of the stiffness found from them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import circulant, eigh
from scipy.stats import binom

from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.ring.frequencies import (
    belt_mass,
    natural_frequency,
    rim_stiffness,
    sidewall_stiffness,
    three_mode_bending_stiffness,
    three_mode_sensitivity,
    tread_stiffness,
)
from tirelib.physics.ring.frequency_fit import fit_stiffness

R, WIDTH, MASS, PRESSURE = 0.3, 0.165, 3.16, 1.32e5
RING = {
    "ring_radius": R,
    "bending_stiffness": 1.144,
    "radial_stiffness": 6.24e5,
    "tangential_stiffness": 2.18e5,
    "inflation": PRESSURE * WIDTH,
    "mass": MASS,
}
KNOWN = {"ring_radius": R, "inflation": PRESSURE * WIDTH, "mass": MASS}
FIT = {"ring_radius": R, "belt_width": WIDTH, "mass": MASS}
PRESSURES = np.array([1.3e5, 1.7e5, 2.1e5, 2.5e5])
ORDER, AT = (x.ravel() for x in np.meshgrid(np.arange(9), PRESSURES))
TRUE = np.array([2.13, 1.2e5, 1.3, 4e4, 0.5])  # EI; k_u, k_v: offset and slope in pressure
rings = st.fixed_dictionaries(
    {
        "ring_radius": st.floats(0.2, 0.5),
        "bending_stiffness": st.floats(0.5, 20.0),
        "radial_stiffness": st.floats(1e5, 2e6),
        "tangential_stiffness": st.floats(5e4, 1e6),
        "inflation": st.floats(0.0, 1e5),
        "mass": st.floats(1.0, 10.0),
    }
)


def frequencies(order: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    return natural_frequency(
        order,
        ring_radius=R,
        bending_stiffness=TRUE[0],
        radial_stiffness=TRUE[1] + TRUE[2] * pressure,
        tangential_stiffness=TRUE[3] + TRUE[4] * pressure,
        inflation=pressure * WIDTH,
        mass=MASS,
    )


def energy_eigenvalues(ring: dict[str, float], points: int = 720) -> np.ndarray:
    """Squared frequencies from the energies of a belt on points, u = -v' by differences.

    Bending of the curvature change -(u + u'')/R^2; tension p b R on the squared rotation; minus
    pressure times the enclosed area, (u^2 + u v' - v u' + v^2) / 2 to second order; springs.
    Derivatives are central differences of fourth order, errors (n dphi)^4 / 30.
    """
    radius, pb = ring["ring_radius"], ring["inflation"]
    h = 2.0 * np.pi / points
    row = np.zeros(points)
    row[[1, 2, -1, -2]] = np.array([8.0, -1.0, -8.0, 1.0]) / (12.0 * h)
    slope = circulant(row).T
    row = np.zeros(points)
    row[[0, 1, 2, -1, -2]] = np.array([-30.0, 16.0, -1.0, 16.0, -1.0]) / (12.0 * h**2)
    v = np.eye(points)
    u, v_prime = -slope, slope
    u_prime, u_second = slope @ u, circulant(row).T @ u
    curvature = (u + u_second) / radius**2
    rotation = (u_prime - v) / radius
    area = u.T @ u + u.T @ v_prime - v.T @ u_prime + v.T @ v
    energy = ring["bending_stiffness"] * radius * curvature.T @ curvature
    energy += pb * radius**2 * rotation.T @ rotation
    energy -= pb * 0.5 * (area + area.T)
    energy += radius * ring["radial_stiffness"] * u.T @ u
    energy += radius * ring["tangential_stiffness"] * v.T @ v
    inertia = ring["mass"] * radius * (u.T @ u + v.T @ v)
    return eigh(energy, inertia, eigvals_only=True, subset_by_index=(0, 17))


def test_frequencies_are_those_of_the_energies() -> None:
    found = np.sqrt(energy_eigenvalues(RING))
    expected = natural_frequency(np.arange(9), **RING)
    # each order comes twice, as sine and cosine; the torsional one too, because the saw-tooth
    # has no slope in central differences either
    np.testing.assert_allclose(found, np.repeat(expected, 2), rtol=2e-6)


def test_frequencies_of_reference_tire() -> None:
    hertz = natural_frequency(np.arange(9), **RING) / (2.0 * np.pi)
    # an independent solver, to the digits given
    known = [41.80, 58.09, 75.87, 94.51, 115.18, 137.60, 161.50, 186.73, 213.25]
    np.testing.assert_allclose(hertz, known, atol=0.0051)


@given(ring=rings)
def test_torsional_and_rigid_modes_ride_on_the_sidewall_alone(ring: dict[str, float]) -> None:
    zero, one = natural_frequency([0, 1], **ring)
    assert zero**2 == pytest.approx(ring["tangential_stiffness"] / ring["mass"])
    shift, turn = rim_stiffness(
        ring["ring_radius"], ring["radial_stiffness"], ring["tangential_stiffness"]
    )
    whole = 2.0 * np.pi * ring["ring_radius"] * ring["mass"]
    assert one**2 * whole == pytest.approx(float(shift))
    assert zero**2 * whole * ring["ring_radius"] ** 2 == pytest.approx(float(turn))


@given(ring=rings, order=st.integers(2, 12))
def test_inflation_stiffens_all_but_torsion_and_shift(ring: dict[str, float], order: int) -> None:
    more = ring | {"inflation": ring["inflation"] + 1e4}
    orders = np.array([0, 1, order])
    growth = natural_frequency(orders, **more) - natural_frequency(orders, **ring)
    assert growth[0] == growth[1] == 0.0
    assert growth[2] > 0.0


@given(ring=rings)
def test_three_modes_give_the_bending_stiffness_back(ring: dict[str, float]) -> None:
    omega = natural_frequency([1, 2, 3], **ring)
    known = {name: ring[name] for name in KNOWN}
    found = three_mode_bending_stiffness(omega, **known)
    worst = np.abs(three_mode_sensitivity(omega, **known)).max()
    assert float(found) == pytest.approx(
        ring["bending_stiffness"], rel=1e-15 * (100.0 + 10 * worst)
    )


@pytest.mark.parametrize(
    ("ring", "one_percent"),
    [
        (RING, [1.144 * 1.416, 1.144 * (1 - 2.839), 1.144 * 4.304]),
        (
            RING
            | {
                "ring_radius": 0.3072,
                "bending_stiffness": 2.13,
                "radial_stiffness": 2.84e5,
                "tangential_stiffness": 1.0e5,
                "inflation": 1.3e5 * 0.14,
                "mass": 3.1529,
            },
            [2.369, 0.185, 4.763],
        ),
    ],
)
def test_one_percent_of_frequency_ruins_three_mode_bending_stiffness(
    ring: dict[str, float], one_percent: list[float]
) -> None:
    omega = natural_frequency([1, 2, 3], **ring)
    known = {name: ring[name] for name in KNOWN}
    off = three_mode_bending_stiffness(omega * (1.0 + 0.01 * np.eye(3)), **known)
    np.testing.assert_allclose(off, one_percent, atol=2e-3)
    assert np.abs(three_mode_sensitivity(omega, **known)).max() > 100.0


@given(ring=rings)
def test_sensitivity_is_the_derivative(ring: dict[str, float]) -> None:
    omega = natural_frequency([1, 2, 3], **ring)
    known = {name: ring[name] for name in KNOWN}
    claimed = three_mode_sensitivity(omega, **known)
    step = 1e-6
    for mode in range(3):
        factor = np.ones(3)
        factor[mode] += step
        up = three_mode_bending_stiffness(omega * factor, **known)
        factor[mode] -= 2 * step
        down = three_mode_bending_stiffness(omega * factor, **known)
        rate = (up - down) / (2 * step * ring["bending_stiffness"])
        assert claimed[mode] == pytest.approx(float(rate), rel=1e-4)
    more = known | {"inflation": ring["inflation"] + 1.0}
    rate = three_mode_bending_stiffness(omega, **more) - ring["bending_stiffness"]
    expected = claimed[3] * ring["bending_stiffness"]
    assert float(rate) * ring["inflation"] == pytest.approx(expected, rel=1e-4, abs=1e-3)


def test_sensitivity_of_reference_tire() -> None:
    omega = natural_frequency([1, 2, 3], **RING)
    found = three_mode_sensitivity(np.stack((omega, omega)), **KNOWN)
    assert found.shape == (2, 4)
    # the known figures are for a whole percent, whose square adds half a percent
    np.testing.assert_allclose(found[0], [42.0, -284.0, 330.0, -43.0], rtol=0.02)


@pytest.mark.parametrize("std", [None, 3.0])
@pytest.mark.parametrize("law", ["linear", "each"])
def test_fit_of_exact_frequencies_is_exact(law: str, std: float | None) -> None:
    omega = frequencies(ORDER, AT)
    fit = fit_stiffness(ORDER, omega, AT, **FIT, law=law, frequency_std=std)
    if law == "linear":
        expected = TRUE
    else:
        sides = [TRUE[i] + TRUE[i + 1] * PRESSURES for i in (1, 3)]
        expected = np.concatenate(([TRUE[0]], *sides))
        assert fit.names[1] == "radial_stiffness@130000"
    np.testing.assert_allclose(fit.value, expected, rtol=1e-9)
    np.testing.assert_allclose(fit.fitted, omega, rtol=1e-10)
    assert fit.freedom == ORDER.size - expected.size


def test_constant_law_fits_one_pressure() -> None:
    order = np.arange(9)
    omega = natural_frequency(order, **RING)
    fit = fit_stiffness(order, omega, np.full(9, PRESSURE), **FIT, law="constant")
    assert fit.names == ("bending_stiffness", "radial_stiffness", "tangential_stiffness")
    np.testing.assert_allclose(fit.value, [1.144, 6.24e5, 2.18e5], rtol=1e-9)


@pytest.mark.parametrize("known_noise", [False, True])
def test_intervals_hold_the_truth_as_often_as_they_say(known_noise: bool) -> None:
    rng = np.random.default_rng(20)
    draws, level = 200, 0.9
    omega = frequencies(ORDER, AT)
    hits = np.zeros(TRUE.size)
    scores = np.zeros((draws, TRUE.size))
    for draw in range(draws):
        measured = omega * (1.0 + 0.01 * rng.standard_normal(omega.size))
        std = 0.01 * omega if known_noise else None
        fit = fit_stiffness(ORDER, measured, AT, **FIT, frequency_std=std, confidence=level)
        hits += (fit.low <= TRUE) & (fit.high >= TRUE)
        scores[draw] = (fit.value - TRUE) / np.sqrt(np.diag(fit.covariance))
    # each count is binomial; bounds for five counts at 0.1 % in all
    low, high = binom.ppf([1e-4, 1.0 - 1e-4], draws, level)
    assert (hits >= low).all()
    assert (hits <= high).all()
    # no bias beyond four standard errors of the mean score
    assert (np.abs(scores.mean(axis=0)) < 4.0 / np.sqrt(draws)).all()


def test_estimated_noise_is_that_of_the_frequencies() -> None:
    rng = np.random.default_rng(5)
    order, at = np.tile(ORDER, 30), np.tile(AT, 30)
    measured = frequencies(order, at) * (1.0 + 0.01 * rng.standard_normal(order.size))
    fit = fit_stiffness(order, measured, at, **FIT)
    # 1075 degrees of freedom: a relative error of 2.2 % at one standard deviation
    assert fit.noise == pytest.approx(0.01, rel=0.09)
    given_half = fit_stiffness(order, measured, at, **FIT, frequency_std=0.005 * measured)
    assert given_half.misfit == pytest.approx(4.0, rel=0.18)


def test_three_modes_with_one_percent_noise_do_not_hold_the_bending_stiffness() -> None:
    omega = natural_frequency([1, 2, 3], **RING)
    at = np.full(3, PRESSURE)
    fit = fit_stiffness([1, 2, 3], omega, at, **FIT, law="constant", frequency_std=0.01 * omega)
    np.testing.assert_allclose(fit.value, [1.144, 6.24e5, 2.18e5], rtol=1e-9)
    assert fit.identifiable.tolist() == [False, True, True]
    assert fit.low[0] < 0.0 < fit.high[0]
    assert fit.freedom == 0
    # error of EI by Eq. (110): root sum square of the sensitivities
    expected = 0.01 * np.linalg.norm(three_mode_sensitivity(omega, **KNOWN)[:3])
    assert np.sqrt(fit.covariance[0, 0]) / 1.144 == pytest.approx(expected, rel=1e-6)


def test_many_modes_hold_the_bending_stiffness() -> None:
    omega = frequencies(ORDER, AT)
    fit = fit_stiffness(ORDER, omega, AT, **FIT, frequency_std=0.01 * omega)
    assert fit.identifiable.all()
    assert fit.high[0] - fit.low[0] < 0.25 * TRUE[0]
    assert fit.condition < 100.0


def test_what_the_modes_do_not_hold_is_not_given() -> None:
    omega = natural_frequency([0, 1, 0, 1], **RING)
    fit = fit_stiffness(
        [0, 1, 0, 1], omega, np.full(4, PRESSURE), **FIT, law="constant", frequency_std=1.0
    )
    assert np.isnan(fit.value[0])
    assert np.isinf([fit.low[0], fit.high[0], fit.covariance[0, 0]]).all()
    np.testing.assert_allclose(fit.value[1:], [6.24e5, 2.18e5], rtol=1e-9)
    assert fit.identifiable.tolist() == [False, True, True]
    assert np.isinf(fit.condition)
    one_pressure = fit_stiffness(
        np.arange(9), natural_frequency(np.arange(9), **RING), np.full(9, PRESSURE), **FIT
    )
    assert np.isfinite(one_pressure.value[0])
    assert np.isnan(one_pressure.value[1:]).all()  # offset and slope cannot be told apart


@given(ring=rings, shift=st.floats(1e-4, 1e-2))
def test_shift_of_the_rim_meets_both_springs(ring: dict[str, float], shift: float) -> None:
    phi = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    k_u, k_v, radius = (
        ring[n] for n in ("radial_stiffness", "tangential_stiffness", "ring_radius")
    )
    u, v = shift * np.cos(phi), -shift * np.sin(phi)
    energy = 0.5 * np.mean(k_u * u**2 + k_v * v**2) * 2.0 * np.pi * radius
    twist = 0.5 * k_v * (radius * shift) ** 2 * 2.0 * np.pi * radius
    stiffness, turn = rim_stiffness(radius, k_u, k_v)
    assert float(stiffness) == pytest.approx(2.0 * energy / shift**2)
    assert float(turn) == pytest.approx(2.0 * twist / shift**2)
    np.testing.assert_allclose(sidewall_stiffness(radius, stiffness, turn), [k_u, k_v], rtol=1e-9)


def test_tread_and_mass_of_the_book() -> None:
    # 6.58 MPa and 9.9e7 N/m2 (Table 6-3) belong to a width of 0.145 m and 9.6 mm of tread
    assert tread_stiffness(6.58e6, 0.145, 0.00964) == pytest.approx(9.9e7, rel=2e-3)
    assert belt_mass(2.0 * np.pi * R * MASS, R) == pytest.approx(MASS)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": 0.0}, "mass = 0; must be finite and > 0"),
        ({"inflation": -1.0}, "inflation = -1 N/m; must be finite and >= 0"),
        ({"bending_stiffness": np.nan}, "bending_stiffness = nan"),
    ],
)
def test_bad_ring_is_refused(changes: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        natural_frequency(1, **(RING | changes))


def test_bad_observations_are_refused() -> None:
    good = ([1, 2, 3, 4], [300.0, 400.0, 500.0, 600.0], [1e5] * 4)
    with pytest.raises(ParameterError, match="leave nothing to estimate the noise from"):
        fit_stiffness([1, 2, 3], [300.0, 400.0, 500.0], [1e5] * 3, **FIT, law="constant")
    with pytest.raises(ShapeError, match=r"order has shape \(4,\), frequency \(4,\)"):
        fit_stiffness(good[0], good[1], 1e5, **FIT)
    with pytest.raises(ParameterError, match="order = -1; must be 0, 1, 2"):
        fit_stiffness([1, 2, 3, -1], good[1], good[2], **FIT)
    with pytest.raises(ParameterError, match="frequency = nan"):
        fit_stiffness(good[0], [300.0, np.nan, 500.0, 600.0], good[2], **FIT)
    with pytest.raises(ParameterError, match="law = 'cubic'; must be one of"):
        fit_stiffness(*good, **FIT, law="cubic")
    with pytest.raises(ParameterError, match=r"confidence = 95"):
        fit_stiffness(*good, **FIT, law="constant", confidence=95.0)
    with pytest.raises(ParameterError, match="frequency_std = 0"):
        fit_stiffness(*good, **FIT, law="constant", frequency_std=0.0)
    with pytest.raises(ShapeError, match="must hold orders 1, 2, 3"):
        three_mode_bending_stiffness([300.0, 400.0], **KNOWN)
    with pytest.raises(ParameterError, match="the shift must exceed turn"):
        sidewall_stiffness(0.3, 1e5, 1e5)
