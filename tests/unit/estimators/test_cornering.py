"""Cornering stiffness and peak force over contact length: what is put in comes out."""

from dataclasses import replace

import numpy as np
import pytest

from tirelib.estimators.cornering import CorneringTrend, cornering_trend, magic_formula
from tirelib.estimators.dissertation import Means

LOADS = np.array([2000.0, 3500.0, 5000.0, 6500.0])
ANGLES = np.arange(-12.0, 13.0, 1.5)
STIFFNESS, PEAK = 0.28 * LOADS, 0.95 * LOADS
"""[N/deg] and [N]."""
LENGTH = 40.0 + 0.02 * LOADS
"""Of the centre gage, [mm]."""
NOISE = 20.0


def means(noise: float = 0.0, seed: int = 0) -> Means:
    angle, size = np.tile(ANGLES, LOADS.size), ANGLES.size
    curves = [magic_formula(ANGLES, c, d, -0.5) for c, d in zip(STIFFNESS, PEAK, strict=True)]
    force = -np.concatenate(curves) + noise * np.random.default_rng(seed).standard_normal(
        angle.size
    )
    length = np.repeat(LENGTH, size)[:, None] * np.array([0.8, 1.0, 0.8])
    none = np.zeros(angle.size)
    return Means(
        lateral=np.array([0.04, 0.0, -0.04]),
        contact_length=length,
        cp1=0.0 * length,
        rate_lead=0.0 * length,
        rate_slope=none,
        slip_ratio=none,
        load=np.repeat(LOADS, size),
        lateral_force=force,
        slip_angle=angle,
        camber=none,
        groups=np.arange(angle.size),
    )


def trend(given: Means) -> CorneringTrend:
    found = cornering_trend(given)
    assert found is not None
    return found


def test_stiffness_and_peak_are_those_of_the_curves_and_follow_the_contact_length() -> None:
    found = trend(means())
    np.testing.assert_allclose(found.load, LOADS)
    np.testing.assert_allclose(found.contact_length, LENGTH)
    np.testing.assert_allclose(found.stiffness, STIFFNESS, rtol=1e-4)
    np.testing.assert_allclose(found.peak, PEAK, rtol=1e-4)
    for fit, values in ((found.stiffness_fit, STIFFNESS), (found.peak_fit, PEAK)):
        along = np.polynomial.polynomial.polyval(LENGTH, fit)
        np.testing.assert_allclose(along, values, rtol=1e-3)


def test_runs_with_camber_take_no_part() -> None:
    """They have a lateral force of their own."""
    upright, leaning = means(), means()
    leaning = replace(leaning, camber=leaning.camber - 2.0, lateral_force=0.5 * leaning.load)
    both = Means(
        upright.lateral,
        *(
            np.concatenate([getattr(upright, name), getattr(leaning, name)])
            for name in Means.__slots__
            if name != "lateral"
        ),
    )
    np.testing.assert_allclose(trend(both).stiffness, trend(upright).stiffness)
    np.testing.assert_allclose(trend(both).peak, trend(upright).peak)
    assert cornering_trend(leaning) is None


@pytest.mark.parametrize("name", ["stiffness", "peak"])
def test_a_deviation_is_the_scatter_of_repeats(name: str) -> None:
    made = [trend(means(NOISE, seed)) for seed in range(24)]
    scatter = np.std([getattr(each, name) for each in made], axis=0, ddof=1)
    told = np.mean([getattr(each, f"{name}_std") for each in made], axis=0)
    # two dozen draws of four loads tell a deviation within 8 %
    assert np.sqrt(np.mean((scatter / told) ** 2)) == pytest.approx(1.0, abs=0.25)
