"""Contact angles from strain-rate peaks and the bias of that reading."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from routes.correction import large_displacements
from routes.edges import (
    bias_curve,
    corrected,
    edge_bias,
    model_edges,
    read_edges,
)

from tests.routes.route_campaign import SERIES, tire, turned, waves
from tirelib.core.errors import CalibrationError, ShapeError
from tirelib.model.base import operating_points, values_of

LOADS = np.array([1700.0, 3400.0, 5100.0, 6800.0])


def test_the_rate_peaks_lie_inside_the_true_edges() -> None:
    # Fig. 6-12: the peak-to-peak distance is smaller than the contact angle
    values = values_of(tire())
    point = operating_points(waves(tire(), SERIES[:1]))
    half, bias = bias_curve(values, point, LOADS)
    assert (bias < 0).all()
    # nearly the same angle at every load, so a short contact is read shorter in proportion
    assert np.ptp(bias) < 0.35 * np.abs(bias).mean()
    assert abs(bias[0] / half[0]) > 1.7 * abs(bias[-1] / half[-1])


def test_the_exact_ring_has_a_like_bias() -> None:
    values = values_of(tire())
    point = operating_points(waves(tire(), SERIES[:1]))
    linear = bias_curve(values, point, LOADS[:2])[1]
    exact = bias_curve(values, point, LOADS[:2], exact=True)[1]
    # small displacements at the least load: the two rings agree within a tenth of the bias
    assert exact[0] == pytest.approx(linear[0], rel=0.1)


def test_the_bias_taken_off_leaves_the_edges_of_another_tire() -> None:
    # the truth is 15 % off the tire that the bias is taken from: inside the stated deviation
    truth = tire()
    assumed = tire(
        bending_stiffness=1.15 * truth.bending_stiffness,
        tread_stiffness=0.85 * truth.tread_stiffness,
    )
    data = waves(truth, SERIES)
    points = operating_points(data)
    low_pass = data.low_pass
    correction = large_displacements(values_of(assumed), points, low_pass)
    bias = edge_bias(values_of(assumed), points, low_pass=low_pass, correction=correction)
    found = corrected(data.run.astype(float), read_edges(data.strain[:, 1]), bias, data.angle_std)
    edges = model_edges(values_of(truth), points).edges
    half = 0.5 * (edges[:, 1] - edges[:, 0])
    raw = found.reading.half - half
    assert np.abs(found.half - half).max() < 0.35 * np.abs(raw).max()
    assert (np.abs(found.half - half) < 2.0 * found.half_std).all()


@settings(max_examples=15, deadline=None)
@given(shift=st.floats(-0.05, 0.05))
def test_the_zero_of_the_angle_moves_the_middle_and_not_the_length(shift: float) -> None:
    strain = waves(tire(), SERIES[:3]).strain[:, 1]
    before, after = read_edges(strain), read_edges(turned(strain, np.full(3, shift)))
    # a parabola through samples of pi / 720 finds a peak to some 1e-5 rad
    np.testing.assert_allclose(after.half, before.half, atol=8e-5)
    np.testing.assert_allclose(after.middle - before.middle, shift, atol=8e-5)
    np.testing.assert_allclose(after.lag, before.lag, atol=1e-4)


def test_the_angle_s_deviation_goes_into_the_middle_alone() -> None:
    data = waves(tire(), SERIES[:3])
    points = operating_points(data)
    bias = edge_bias(values_of(tire()), points)
    reading = read_edges(data.strain[:, 1])
    sharp = corrected(data.run.astype(float), reading, bias, np.full(3, 1e-6))
    blunt = corrected(data.run.astype(float), reading, bias, np.full(3, np.inf))
    np.testing.assert_array_equal(blunt.half_std, sharp.half_std)
    assert np.isinf(blunt.middle_std).all()


def test_the_stated_noise_is_the_scatter_of_the_reading() -> None:
    level, count = 5e-6, 200
    clean = waves(tire(), SERIES[:1], noise=0.0).strain[0, 1]
    random = np.random.default_rng(5)
    # noise that has gone through the signal chain's filter, of the stated size afterwards
    white = random.standard_normal((count, 360))
    order = np.fft.rfftfreq(360, 1.0 / 360)
    sigma = waves(tire(), SERIES[:1]).low_pass.sigma(1.0)
    noise = np.fft.irfft(
        np.fft.rfft(white, axis=1) * np.exp(-0.5 * (sigma * order) ** 2), n=360, axis=1
    )
    noise *= level / noise.std()
    found = read_edges(clean + noise, noise=np.full(count, level))
    # 200 readings know their deviation to 5 %; the curve is not quite a parabola
    assert found.lead.std() == pytest.approx(found.noise.mean(), rel=0.25)


def test_a_gage_that_fell_off_is_named() -> None:
    data = waves(tire(), SERIES[:3])
    strain = data.strain[:, 1].copy()
    strain[1] = 1e-6
    with pytest.raises(CalibrationError, match=r"run 22: .*microstrain.*gage is off"):
        read_edges(strain, labels=[21, 22, 23])


def test_a_waveform_without_a_contact_is_named() -> None:
    strain = waves(tire(), SERIES[:2]).strain[:, 1].copy()
    strain[1] = turned(strain[1:], np.array([2.5]))[0]
    with pytest.raises(CalibrationError, match="run 8: no distinct"):
        read_edges(strain, labels=[7, 8])


def test_waveforms_of_another_grid_are_refused() -> None:
    with pytest.raises(ShapeError, match="whole turn"):
        read_edges(np.zeros((2, 100)))


def test_the_spread_grows_with_what_is_not_known() -> None:
    points = operating_points(waves(tire(), SERIES[:2]))
    little = edge_bias(values_of(tire()), points, plausible={"bending_stiffness": 0.05})
    much = edge_bias(values_of(tire()), points, plausible={"bending_stiffness": 0.5})
    assert (np.abs(much.spread) > 5.0 * np.abs(little.spread)).all()
    assert (much.half_std > little.half_std).all()
    none = replace(little, spread=0.0 * little.spread, structure=0.0 * little.structure)
    assert (none.half_std == 0.0).all()
