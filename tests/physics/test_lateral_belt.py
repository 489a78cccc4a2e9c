"""Laws of the belt's lateral bending."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError
from tirelib.core.parameters import read_tire
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.ring.lateral import BeamConstants, LateralBelt, LateralDeflection, bend_belt
from tirelib.physics.ring.lateral import infinite_beam as infinite
from tirelib.physics.ring.ring import Ring

R = 0.3
BELT: dict[str, Any] = {
    "radius": R,
    "bending_stiffness": 4000.0,
    "tension": 1.15e4,
    "foundation": 3.6e5,
}
AWAY = np.array([[0.05, 0.1, 0.2, 0.4, 0.9]])


def point_load(n_modes: int, force: float = 1.0) -> np.ndarray:
    """Harmonics of a point load at phi = 0, [N/m]."""
    out = np.full((1, n_modes + 1), force / (np.pi * R), dtype=complex)
    out[:, 0] *= 0.5
    return out


def patch_load(force: float, half: float, n_modes: int = 200) -> np.ndarray:
    """Harmonics of an even load over the patch."""
    n = np.arange(n_modes + 1)
    return point_load(n_modes, force) * np.sinc(n * half / np.pi)


stiffness = st.floats(20.0, 2e4)
pulls = st.floats(0.0, 3e4)
springs = st.floats(5e4, 5e6)
shears = st.one_of(st.just(np.inf), st.floats(3e3, 1e6))


@pytest.mark.parametrize("pressure", [0.0, 1.6e5, 2.5e5])
def test_the_beam_is_as_tense_as_the_hoop(pressure: float) -> None:
    """A hoop of radius R under the line load p b carries N = p b R, across as along."""
    tire = read_tire("table-6-1").tire
    hoop = Ring.of(tire, pressure)
    assert LateralBelt.of(tire, pressure).tension == pytest.approx(hoop.inflation * hoop.radius)


@given(stiffness, pulls, springs, shears)
def test_the_ring_is_the_endless_beam_wound_up(
    ei: float, tension: float, k: float, shear: float
) -> None:
    belt = LateralBelt(R, ei, tension, k, shear)
    ring = bend_belt(belt, point_load(4000))
    turns = np.arange(-30, 31) * 2.0 * np.pi
    w, bend = (
        part.reshape(turns.size, -1).sum(axis=0)
        for part in infinite(belt, R * (AWAY + turns[:, None]).reshape(1, -1))
    )
    top = infinite(belt, np.zeros((1, 1)))
    # the tail of a series with a kink (w with shear, the bend always): 1 / n_modes of the peak at
    # the load, an order less beside it
    np.testing.assert_allclose(evaluate(ring.displacement, AWAY)[0], w, atol=3e-5 * top[0].item())
    np.testing.assert_allclose(evaluate(ring.bend, AWAY)[0], bend, atol=1e-4 * abs(top[1].item()))


def test_a_long_ring_is_the_endless_beam() -> None:
    belt = LateralBelt(R, 25.0, 2e4, 4e6)
    assert BeamConstants.of(belt).decay_length[0] < 0.1 * np.pi * R
    w, _ = infinite(belt, R * AWAY)
    np.testing.assert_allclose(
        evaluate(bend_belt(belt, point_load(4000)).displacement, AWAY), w, rtol=1e-8
    )


@given(stiffness, pulls, springs, shears)
def test_springs_carry_the_load(ei: float, tension: float, k: float, shear: float) -> None:
    belt = LateralBelt(R, ei, tension, k, shear)
    far = 40.0 * BeamConstants.of(belt).decay_length[0]
    x = far * np.linspace(0.0, 1.0, 20001)[None, :] ** 2  # fine near the load
    w, bend = infinite(belt, x)
    assert 2.0 * k * np.trapezoid(w[0], x[0]) == pytest.approx(1.0, rel=1e-4)
    assert abs(np.trapezoid(bend[0], x[0]) * 2.0) < 1e-4 / max(tension, 1e3) + 1.0 / min(shear, 1e9)


def test_a_beam_without_bending_stiffness_is_a_string() -> None:
    k, tension = 3.6e5, 1.15e4
    belt = LateralBelt(R, 1e-3, tension, k)
    x = np.linspace(0.02, 0.6, 20)[None, :]
    string = np.exp(-x * np.sqrt(k / tension)) / (2.0 * np.sqrt(k * tension))
    np.testing.assert_allclose(infinite(belt, x)[0], string, rtol=1e-5)


def test_a_beam_without_tension_is_the_textbooks() -> None:
    ei, k = 4000.0, 3.6e5
    x = np.linspace(0.0, 1.0, 20)[None, :]
    rate = (k / (4.0 * ei)) ** 0.25
    book = rate / (2.0 * k) * np.exp(-rate * x) * (np.cos(rate * x) + np.sin(rate * x))
    np.testing.assert_allclose(infinite(LateralBelt(R, ei, 0.0, k), x)[0], book, rtol=1e-12)


def test_equal_roots_are_no_special_case() -> None:
    ei, k = 4000.0, 3.6e5
    critical = 2.0 * np.sqrt(ei * k)
    x = np.linspace(0.0, 1.0, 20)[None, :]
    below, at, above = (
        np.stack(infinite(LateralBelt(R, ei, f * critical, k), x))
        for f in (1 - 1e-6, 1.0, 1 + 1e-6)
    )
    np.testing.assert_allclose(at, 0.5 * (below + above), rtol=1e-9)


def test_a_force_to_the_left_stretches_the_left_gages() -> None:
    bent = bend_belt(LateralBelt(**BELT), patch_load(3000.0, 0.2))
    here = np.zeros(1)
    assert evaluate(bent.displacement, here)[0, 0] > 0.0
    assert evaluate(bent.bend, here)[0, 0] < 0.0
    strain = evaluate(bent.strain(np.array([-0.06, 0.0, 0.06])), here)[0, :, 0]
    assert strain[2] > 0.0
    assert strain[1] == 0.0
    assert strain[0] == -strain[2]


def test_the_whole_force_goes_into_the_sidewalls() -> None:
    bent = bend_belt(LateralBelt(**BELT, mass=3.6, damping=0.03), patch_load(3000.0, 0.2), 60.0)
    assert 2.0 * np.pi * R * bent.reaction[0, 0].real == pytest.approx(3000.0, rel=1e-12)


def test_what_the_belt_does_not_carry_the_sidewalls_do() -> None:
    load = patch_load(3000.0, 0.2)
    bent = bend_belt(LateralBelt(**BELT, mass=3.6, damping=0.1), load, 60.0)
    wave = np.arange(load.shape[1]) / R
    belt = BELT["tension"] * wave**2 + BELT["bending_stiffness"] * wave**4
    np.testing.assert_allclose(
        bent.reaction, load - belt * bent.displacement, atol=1e-9 * np.abs(load).max()
    )


def test_shear_softens_and_takes_bending_away() -> None:
    load = patch_load(3000.0, 0.2)
    shears = (np.inf, 1e6, 1e5, 1.2e4)
    bent = [bend_belt(LateralBelt(**BELT, shear_stiffness=s), load) for s in shears]
    w = [evaluate(b.displacement, np.zeros(1)).item() for b in bent]
    bend = [abs(evaluate(b.bend, np.zeros(1)).item()) for b in bent]
    assert np.all(np.diff(w) > 0.0)
    assert np.all(np.diff(bend) < 0.0)


def test_damping_lags_and_speed_alone_does_nothing() -> None:
    load = patch_load(3000.0, 0.2)

    def skew(damping: float, omega: float) -> float:
        belt = LateralBelt(**BELT, mass=3.6, damping=damping)
        w = evaluate(bend_belt(belt, load, omega).displacement, np.array([-0.3, 0.3]))[0]
        return float(w[1] - w[0])

    assert abs(skew(0.0, 100.0)) < 1e-15
    assert abs(skew(0.1, 0.0)) < 1e-15
    assert skew(0.1, 30.0) > 0.0  # the belt keeps its shift behind the patch
    assert skew(0.1, 60.0) == pytest.approx(2.0 * skew(0.1, 30.0), rel=0.02)


def test_strips_that_yield_take_the_shear() -> None:
    # strips that give way like 1 / S in series are a belt of half the shear stiffness
    load, s = patch_load(3000.0, 0.2), 2.4e4
    soft = bend_belt(
        LateralBelt(**BELT, shear_stiffness=s), load, yaw_compliance=np.full((1, 201), 1.0 / s + 0j)
    )
    half = bend_belt(LateralBelt(**BELT, shear_stiffness=s / 2.0), load)
    for name in ("displacement", "bend", "moment"):
        np.testing.assert_allclose(getattr(soft, name), getattr(half, name), rtol=1e-12)


def test_a_belt_whose_fibres_shift_freely_is_a_string() -> None:
    load = patch_load(3000.0, 0.2)
    string = bend_belt(LateralBelt(**{**BELT, "bending_stiffness": 1e-9}), load)
    w = string.displacement
    n = np.arange(w.shape[1])
    shifted = bend_belt(LateralBelt(**BELT), load, free_yaw=-1j * n / R * w)
    np.testing.assert_allclose(shifted.displacement, w, rtol=1e-6, atol=1e-15)
    assert np.abs(shifted.moment).max() < 1e-3


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"bending_stiffness": 0.0}, "bending_stiffness"),
        ({"foundation": np.nan}, "foundation"),
        ({"tension": -1.0}, "tension = -1"),
        ({"damping": np.inf}, "damping"),
    ],
)
def test_constants_that_cannot_be_are_refused(change: dict[str, float], match: str) -> None:
    with pytest.raises(ParameterError, match=match):
        LateralBelt(**{**BELT, **change})


def test_shapes_are_checked() -> None:
    belt = LateralBelt(**BELT)
    with pytest.raises(ParameterError, match="force has shape"):
        bend_belt(belt, np.zeros(5, dtype=complex))
    with pytest.raises(ParameterError, match="distance has shape"):
        infinite(belt, np.zeros(5))
    with pytest.raises(ParameterError, match="turn rate"):
        bend_belt(belt, point_load(5), np.nan)
    assert isinstance(bend_belt(belt, point_load(5)), LateralDeflection)
