"""Laws of the features: edges where the waveform is steepest, symmetry, scaling, vectorisation."""

from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.synthetic import LATERAL, RATE, record
from tirelib.core.flags import TurnFlag
from tirelib.measured.features import Features, concatenate_features, extract_features
from tirelib.measured.features.extract import reference_features
from tirelib.measured.features.peaks import peak
from tirelib.measured.features.table import feature_frame, rate_slope, units
from tirelib.measured.signal import Turns, cut_turns


def features_of(*, speed: float = 18.0, **options: float) -> Features:
    strain, trigger, _ = record(speed=speed, **options)
    return extract_features(cut_turns(strain, RATE, LATERAL, speed=speed, trigger=trigger))


@given(half=st.floats(0.13, 0.4), speed=st.floats(3.0, 42.0))
@settings(max_examples=20)
def test_edges_are_where_the_waveform_is_steepest(half: float, speed: float) -> None:
    """The dips add to the slope of the flanks and move their steepest point outwards."""
    found = features_of(half=half, dip=0.0, speed=speed, turns=3)
    np.testing.assert_allclose(found.lead[1:], -half, atol=5e-4)
    np.testing.assert_allclose(found.trail[1:], half, atol=5e-4)
    np.testing.assert_allclose(found.contact_angle[1:], 2 * half, atol=1e-3)


def test_edges_do_not_depend_on_the_speed() -> None:
    slow, fast = features_of(speed=3.0, turns=3), features_of(speed=42.0, turns=3)
    for name in ("lead", "trail"):
        np.testing.assert_allclose(getattr(slow, name)[1], getattr(fast, name)[1], atol=2e-4)
    for name in ("rate_lead", "rate_trail", "cp1", "cp2", "tp", "e_vertical"):
        np.testing.assert_allclose(getattr(slow, name)[1], getattr(fast, name)[1], rtol=3e-3)


@given(gain=st.floats(0.6, 1.6))
@settings(max_examples=10)
def test_strains_scale_with_the_gain_and_angles_do_not(gain: float) -> None:
    strain, _, _ = record(turns=3)
    a = extract_features(cut_turns(strain, RATE, LATERAL))
    b = extract_features(cut_turns(gain * strain, RATE, LATERAL))
    for name in ("lead", "trail", "cp1_angle", "cp2_angle", "skew"):
        np.testing.assert_allclose(getattr(a, name)[1:], getattr(b, name)[1:], atol=1e-9)
    for name in ("cp1", "cp2", "tp", "rate_lead", "rate_trail", "e_vertical", "mean"):
        np.testing.assert_allclose(gain * getattr(a, name)[1:], getattr(b, name)[1:], rtol=1e-7)


def test_a_symmetric_waveform_has_symmetric_features() -> None:
    found = features_of()
    np.testing.assert_allclose(found.lead[1:], -found.trail[1:], atol=1e-4)
    np.testing.assert_allclose(found.cp1[1:], found.cp2[1:], rtol=2e-4)
    np.testing.assert_allclose(found.rate_lead[1:], -found.rate_trail[1:], rtol=1e-3)
    np.testing.assert_allclose(found.skew[1:], 0.0, atol=1e-4)
    assert (found.e_friction[1:] < 1e-3 * found.e_vertical[1:] * found.contact_angle[1:]).all()


def test_a_mirrored_waveform_has_mirrored_features() -> None:
    ahead, behind = features_of(imbalance=1e-3), features_of(imbalance=-1e-3)
    np.testing.assert_allclose(ahead.cp1[1:], behind.cp2[1:], rtol=1e-3)
    np.testing.assert_allclose(ahead.cp2[1:], behind.cp1[1:], rtol=1e-3)
    np.testing.assert_allclose(ahead.cp1_angle[1:], -behind.cp2_angle[1:], atol=2e-3)
    assert (ahead.cp2 < ahead.cp1)[1:].all()  # braking: the second peak is deeper


def test_a_deeper_dip_is_a_deeper_compressive_peak() -> None:
    shallow, deep = features_of(dip=1e-3), features_of(dip=4e-3)
    assert (deep.cp1 < shallow.cp1 - 2e-3)[1:].all()


def test_a_trapezoid_grows_over_the_lateral_position() -> None:
    found = features_of(tilt=0.2)
    order = np.argsort(found.lateral)
    assert (np.diff(found.contact_angle[1:, order], axis=1) > 0.0).all()
    assert (np.diff(found.cp1[1:, order], axis=1) < 0.0).all()


def test_tension_is_that_of_the_plateau() -> None:
    found = features_of(half=0.35, dip=0.0, tension=7e-3)
    np.testing.assert_allclose(found.tp[1:], 7e-3, rtol=1e-3)


def test_integral_over_the_contact_converges_to_the_exact_one() -> None:
    """Plateau of tanh edges read at the edges: the integral is known in closed form (Eq. 11)."""
    half, edge, tension = 0.3, 0.05, 8e-3
    found = features_of(half=half, dip=0.0, tension=tension)
    exact = tension * edge * np.log(np.cosh(2 * half / edge))
    # the filter rounds the edges: a loss of tension sigma^2 / (2 edge) at each of them
    sigma = np.sqrt(np.log(2)) / 24
    loss = tension * sigma**2 / edge
    np.testing.assert_allclose(found.e_vertical[1:], exact, atol=2 * loss)
    assert (found.e_vertical[1:] < exact).all()


@pytest.mark.parametrize("extract", [extract_features, reference_features])
def test_integrals_of_polynomials_are_exact(extract: Callable[[Turns], Features]) -> None:
    """A constant and a straight line, between edges that lie off the grid."""
    strain, _, _ = record(turns=3)
    turns = cut_turns(strain, RATE, LATERAL)
    phi = turns.trace.phi
    flat = extract(turns)
    turns.trace.strain[:] = 2.0 + 3.0 * phi
    found = extract(turns)
    length, middle = flat.contact_angle[1:], 0.5 * (flat.lead + flat.trail)[1:]
    level = 2.0 + 3.0 * middle
    np.testing.assert_allclose(found.e_vertical[1:], level * length, rtol=1e-9)
    # odd part 3 xi: its integral over half the contact is 3 l^2 / 8; Eq. (12) times l
    np.testing.assert_allclose(found.e_friction[1:], length * 3.0 * length**2 / 8.0, rtol=1e-3)
    np.testing.assert_allclose(found.skew[1:], 3.0 * length**2 / 12.0 / level, rtol=1e-3)


def test_many_turns_at_once_equal_each_turn_alone() -> None:
    strain, trigger, _ = record(turns=6, noise=4e-6)
    whole = extract_features(cut_turns(strain, RATE, LATERAL, trigger=trigger))
    again = concatenate_features([whole])
    part = extract_features(cut_turns(strain[:, :4000], RATE, LATERAL, trigger=trigger[:4000]))
    for field in fields(Features):
        np.testing.assert_array_equal(getattr(whole, field.name), getattr(again, field.name))
        if field.name != "lateral":
            np.testing.assert_allclose(
                getattr(whole, field.name)[: len(part)], getattr(part, field.name), rtol=1e-12
            )


def test_noise_of_an_edge_is_far_below_a_millimetre() -> None:
    found = features_of(turns=60, noise=4e-6)
    assert 305.0 * found.contact_angle[1:].std(axis=0).max() < 0.2  # mm


def test_a_gage_without_a_contact_says_nothing() -> None:
    strain, _, _ = record()
    strain[0] = 2.7e-3
    found = extract_features(cut_turns(strain, RATE, LATERAL))
    assert np.isnan(found.contact_angle[1:, 0]).all()
    assert np.isfinite(found.contact_angle[1:, 1:]).all()


def test_features_say_of_turns_what_the_turns_say() -> None:
    turns = cut_turns(record()[0], RATE, LATERAL)
    turns.trace.axis_shift[:] = np.linspace(-0.01, 0.02, len(turns))
    found = extract_features(turns)
    for name in (
        "time",
        "ready",
        "period",
        "angle_std",
        "slip_std",
        "offset",
        "offset_std",
        "mean",
    ):
        np.testing.assert_array_equal(getattr(found, name), getattr(turns, name))
    np.testing.assert_array_equal(found.axis_shift, turns.trace.axis_shift)
    np.testing.assert_array_equal(found.omega, turns.trace.conditions.omega)


def test_a_weak_edge_is_flagged() -> None:
    phi = np.linspace(0, 1, 50)
    _, _, border = peak(phi, np.ones(50, bool), 0.0, 0.02)
    assert bool(border)
    strain, _, _ = record()
    slope = cut_turns(strain, RATE, LATERAL)
    slope.trace.rate[2, 1] = 1e3 * np.linspace(0, 1, slope.trace.phi.size)
    found = extract_features(slope)
    assert found.gage_flags[2, 1] & TurnFlag.WEAK_EDGE
    assert found.flags[2] & TurnFlag.WEAK_EDGE
    assert not found.flags[1] & TurnFlag.WEAK_EDGE


@given(shift=st.floats(-0.9, 0.9), curvature=st.floats(0.1, 50.0), height=st.floats(-5.0, 5.0))
def test_a_parabola_is_found_exactly(shift: float, curvature: float, height: float) -> None:
    x = np.arange(-10.0, 11.0)
    position, value, border = peak(height - curvature * (x - shift) ** 2, x == x, -10.0, 1.0)
    assert float(position) == pytest.approx(shift, abs=1e-6)
    assert float(value) == pytest.approx(height, abs=1e-6)
    assert not bool(border)


def test_a_smooth_peak_is_found_to_third_order_in_the_spacing() -> None:
    errors = []
    for n in (21, 41, 81):
        x = np.linspace(-1.0, 1.0, n)
        curve = np.exp(-((x - 0.037) ** 2)) + 0.1 * x**3
        position, _, _ = peak(curve, x == x, -1.0, x[1] - x[0])
        fine = np.linspace(-0.2, 0.3, 2_000_001)
        true = fine[np.argmax(np.exp(-((fine - 0.037) ** 2)) + 0.1 * fine**3)]
        errors.append(abs(float(position) - true))
    assert errors[2] < errors[0] / 4  # at least second order, whatever the phase on the grid


def test_the_table_has_a_row_per_turn_and_gage_and_a_unit_per_column() -> None:
    table = feature_frame(features_of(), run=7)
    assert len(table) == 5 * 5
    assert set(units()) <= set(table.columns)
    assert (table["run"] == 7).all()
    assert table["gage"].tolist()[:5] == [1, 2, 3, 4, 5]
    assert table.loc[0, "flags"] == "first_turn"
    assert table.loc[5, "flags"] == "no_speed" or table.loc[5, "flags"] == ""


def test_slope_of_the_peak_rates_has_the_sign_of_the_tilt() -> None:
    up, down = rate_slope(features_of(tilt=0.2)), rate_slope(features_of(tilt=-0.2))
    assert (up[1:] > 0).all()
    np.testing.assert_allclose(up[1:], -down[1:], rtol=0.05)
