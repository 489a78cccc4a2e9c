"""The sine fit of one cornering curve: recovers, weighs, and refuses what cannot be told."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError
from tirelib.inference.magic.sine import fit_sine
from tirelib.physics.brush.magic_formula import lateral_curve, sine_curve

TRUE = {"C_alpha": 9e4, "D": 4200.0, "C": 1.4, "E": -0.5, "S_h": 0.002, "S_v": -40.0}


@given(C=st.floats(1.0, 2.0), E=st.floats(-3.0, 0.9), D=st.floats(500.0, 9000.0))
def test_curve_has_stiffness_bcd_and_peak_d(C: float, E: float, D: float) -> None:
    slope = sine_curve(1e-7, 8.0, C, D, E) / 1e-7
    assert float(slope) == pytest.approx(8.0 * C * D, rel=1e-5)
    assert np.abs(sine_curve(np.linspace(0.0, 50.0, 2000), 8.0, C, D, E)).max() <= D * (1 + 1e-12)


def test_noise_free_curve_is_recovered() -> None:
    alpha = np.linspace(-0.25, 0.25, 41)
    fit = fit_sine(alpha, lateral_curve(alpha, TRUE))
    for name, value in TRUE.items():
        assert fit.coefficients[name] == pytest.approx(value, rel=1e-4), name
    assert fit.peak_determined
    assert fit.at_limit == ()


def test_standard_deviations_are_the_scatter_of_repeats() -> None:
    """120 fits tell a deviation within 7 % (one sigma); 20 % is three of them."""
    rng = np.random.default_rng(11)
    alpha = np.linspace(-0.22, 0.22, 45)
    clean = lateral_curve(alpha, TRUE)
    fits = [fit_sine(alpha, clean + rng.normal(0, 20.0, alpha.size)) for _ in range(120)]
    for value, std in (("stiffness", "stiffness_std"), ("peak", "peak_std")):
        scatter = np.std([getattr(f, value) for f in fits])
        given_std = np.median([getattr(f, std) for f in fits])
        assert given_std == pytest.approx(scatter, rel=0.2)
    assert np.median([f.residual_std for f in fits]) == pytest.approx(20.0, rel=0.1)


def test_curve_that_stops_early_does_not_tell_the_peak() -> None:
    """Within 2.3 degrees force is nearly linear: the stiffness is told, the peak is not."""
    rng = np.random.default_rng(5)
    alpha = np.linspace(-0.04, 0.04, 41)
    fit = fit_sine(alpha, lateral_curve(alpha, TRUE) + rng.normal(0, 20.0, alpha.size))
    assert not fit.peak_determined
    assert fit.peak_std > 0.05 * fit.peak or fit.reach < 0.9
    assert fit.stiffness == pytest.approx(9e4, abs=5 * fit.stiffness_std)


def test_bad_data_are_refused() -> None:
    alpha = np.linspace(-0.2, 0.2, 21)
    force = lateral_curve(alpha, TRUE)
    with pytest.raises(ParameterError, match="convert the axes"):
        fit_sine(alpha, -force)
    with pytest.raises(ParameterError, match="different slip angles"):
        fit_sine(alpha[:5], force[:5])
    with pytest.raises(ParameterError, match="not finite"):
        fit_sine(alpha, np.where(alpha > 0.1, np.nan, force))
    with pytest.raises(ParameterError, match="must be one-dimensional"):
        fit_sine(alpha, force[:3])
