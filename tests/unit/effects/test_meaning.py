"""What each effect means: limits, signs, and independent ways to the same number."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from tests.physics.test_effects import BASE, FREE_ROLLING, PLAN, TIRE, VALUES, run, tangents, wave
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.effects.belt_bending import BENDING, FOUNDATION
from tirelib.effects.patch import held_shear
from tirelib.effects.state import State
from tirelib.measured.waveforms import GRID
from tirelib.physics.ring.compliance import compliance


def at(name: str, strength: float | tuple[float, ...], **given: Any) -> State:
    return run(CATALOGUE[name].at(strength), **given)


def changed(state: State, **given: Any) -> np.ndarray:
    assert state.waveform is not None
    return state.waveform - (wave(**given) if given else BASE)


def test_sidewall_load_takes_the_secant_of_its_tangent_in_the_linear_ring() -> None:
    state = at("sidewall_load", 0.5)
    fall = 0.5 * state.deflection / 0.020
    secant = (1.0 - np.exp(-fall)) / fall
    np.testing.assert_allclose(state.ring.radial_stiffness, state.k_u * secant)
    assert (state.deflection > run().deflection).all()


def test_sidewall_pressure_departs_to_the_same_side_above_and_below_two_bar() -> None:
    points = PLAN.points.take(np.zeros(3, dtype=int))
    points = replace(points, pressure=np.array([1.6e5, 2.0e5, 2.4e5]))
    ratio = at("sidewall_pressure", 0.5, points=points, lateral=0.0).k_u / TIRE.radial_stiffness
    np.testing.assert_allclose(ratio, np.exp([0.02, 0.0, 0.02]))


def test_damping_shifts_the_contact_forward_with_speed() -> None:
    contact = at("sidewall_damping", 0.1).contact
    assert contact is not None
    middle = contact.edges.mean(axis=1)[FREE_ROLLING].reshape(5, 3, 4)
    assert (middle < 0).all()
    assert (np.diff(middle, axis=2) < 0).all()


def test_a_warm_tire_is_soft_by_the_thermometer_where_there_is_one() -> None:
    by_order = at("temperature", 0.2)
    np.testing.assert_allclose(
        by_order.k_u, VALUES["radial_stiffness"] * np.exp(-0.2 * PLAN.points.order)
    )
    warm = replace(PLAN.points, temperature=np.full(72, 293.15 + 50.0))
    measured = at("temperature", 0.2, points=warm)
    np.testing.assert_allclose(measured.k_u, VALUES["radial_stiffness"] * np.exp(-0.2))
    assert (measured.deflection > by_order.deflection)[PLAN.points.order < 0.99].all()


def test_without_inertia_the_centrifugal_tension_stiffens_the_belt() -> None:
    bare = at("centrifugal", -1.0)
    own = TIRE.mass * (TIRE.ring_radius * PLAN.points.omega) ** 2
    np.testing.assert_allclose(bare.tension, own)
    # k_n grows by rho A Omega^2 (1 - n^2)^2
    n = np.arange(61.0)
    k = np.real(1.0 / compliance(bare.ring, PLAN.points.omega).matrix[:, 1:, 1, 1])
    k0 = np.real(1.0 / compliance(run().ring, PLAN.points.omega).matrix[:, 1:, 1, 1])
    grown = TIRE.mass * PLAN.points.omega[:, None] ** 2 * (1.0 - n[1:] ** 2) ** 2
    np.testing.assert_allclose(k - k0, grown, rtol=1e-6, atol=1e-3)


@pytest.mark.parametrize("option", [{"GA": 1e12}, {"EA": 1e12}])
def test_belt_tension_is_the_same_in_ring_models_that_stretch_or_shear(
    option: dict[str, float],
) -> None:
    state = at("centrifugal", -0.5)
    stiff = state.but(**{name: np.full(72, value) for name, value in option.items()})
    plain = compliance(state.ring, PLAN.points.omega, 20).radial
    other = compliance(stiff.ring, PLAN.points.omega, 20).radial
    assert np.abs(plain - other).max() < 1e-5 * np.abs(plain).max()


def test_rotary_inertia_is_bending_stiffness_lost_with_speed() -> None:
    own = at("rotary_inertia", 1e-4)
    lost = TIRE.bending_stiffness - 1e-4 * (TIRE.ring_radius * PLAN.points.omega) ** 2
    less = run(("constants", lambda s: s.but(EI=lost)))
    assert own.waveform is not None
    assert less.waveform is not None
    np.testing.assert_allclose(own.waveform, less.waveform, atol=1e-10)


def test_a_belt_that_stretches_is_the_tire_with_that_compliance() -> None:
    top = CATALOGUE["belt_extension"].high
    own = at("belt_extension", top).wave
    given = {**VALUES, "extension_stiffness": 1e6 / top}
    np.testing.assert_allclose(own, wave(values=given), atol=1e-12)


def test_a_belt_that_shears_is_the_tire_whose_sections_do() -> None:
    top = CATALOGUE["belt_shear"].high
    given = {**VALUES, "shear_stiffness": 1e3 / top}
    np.testing.assert_allclose(at("belt_shear", top).wave, wave(values=given), atol=1e-12)


def test_a_belt_whose_tension_takes_all_its_shear_stiffness_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"belt_shear: 0.2 1/kN leaves no shear stiffness"):
        at("belt_shear", 0.2)


def test_dynamic_stiffening_follows_the_belts_speed() -> None:
    state = at("dynamic_stiffening", 0.5)
    np.testing.assert_allclose(
        state.k_u / VALUES["radial_stiffness"], np.sqrt(1.0 + PLAN.points.speed / 20.0)
    )
    assert (state.deflection < run().deflection).all()


def test_traction_on_the_tread_pulls_the_belt_and_turns_it_and_leaves_no_resultant() -> None:
    for name, strength in (("tread_friction", (0.1, 0.0)), ("trailing_sliding", 0.1)):
        state, base = at(name, strength), run()
        assert state.contact is not None
        assert base.contact is not None
        assert state.contact.extra is not None
        pulled, turned = state.contact.extra[..., 1], state.contact.extra[..., 2]
        np.testing.assert_allclose(
            turned, (state.free_radius - state.radius)[:, None] * pulled, atol=1e-12
        )
        most = np.abs(pulled).max(axis=1)
        assert (most > 10.0).all()
        assert (np.abs(pulled[:, 0]) < 1e-9 * most).all()
        np.testing.assert_allclose(state.contact.load, base.contact.load, rtol=1e-8)


def test_outward_shear_lowers_the_tension_in_the_contact() -> None:
    assert (changed(at("tread_friction", (0.05, 0.0)))[FREE_ROLLING, GRID.size // 2] < 0).all()


def test_a_flat_piece_under_outward_shear_is_compressed_at_the_liner_by_its_bending() -> None:
    """The shear acts outside the neutral line and the liner lies inside: M y / EI < 0."""
    assert (changed(at("tread_friction", (0.0, 0.05)))[FREE_ROLLING, GRID.size // 2] < 0).all()


def test_a_tread_that_sticks_is_sheared_as_rubber_that_keeps_its_volume() -> None:
    """A flattened belt holds R phi where the surface would reach R0 phi; E = 2 (1 + nu) G."""
    state = run()
    c = state.contact
    away = c.phi - c.edges.mean(axis=1)[:, None]
    modulus = state.k_t / (2.0 * (1.0 + 0.5))
    held = modulus[:, None] * (state.free_radius - state.radius)[:, None] * away
    sticks = np.abs(held) < 0.99 * c.pressure
    assert sticks.sum(axis=1).min() > 5
    np.testing.assert_allclose(held_shear(state)[sticks], held[sticks], rtol=1e-12)


def test_a_worn_tread_is_thin_and_stiff_and_keeps_its_modulus() -> None:
    state = at("tread_wear", 0.4)
    assert np.allclose(state.k_t * state.thickness, TIRE.tread_stiffness * TIRE.tread_thickness)
    np.testing.assert_allclose(
        state.free_radius, TIRE.free_radius - 0.4 * PLAN.points.order * TIRE.tread_thickness
    )


def test_tread_load_turns_about_four_kilonewtons() -> None:
    stiff = at("tread_load", 0.5).k_t / TIRE.tread_stiffness
    np.testing.assert_allclose(stiff, np.sqrt(PLAN.points.load / 4000.0))


def test_sliding_in_the_rear_brings_tension_near_the_trailing_edge() -> None:
    state = at("trailing_sliding", 0.05)
    assert state.contact is not None
    edge = state.contact.edges[FREE_ROLLING]
    added = changed(state)[FREE_ROLLING]
    inside = (edge[:, :1] < GRID) & (edge[:, 1:] > GRID)
    mean = [float(added[i][inside[i] & (edge[i].mean() < GRID)].mean()) for i in range(len(added))]
    assert min(mean) > 0.0
    peak = GRID[np.argmax(added, axis=1)]
    assert (peak > edge.mean(axis=1)).all()


def test_water_takes_load_off_the_tread_with_speed_squared_and_presses_ahead_of_it() -> None:
    state, base = at("hydroplaning", 0.2), run()
    assert state.contact is not None
    assert base.contact is not None
    # the water is a millimetre deep; a parabola has two thirds of the area of its box
    length = np.sqrt(2.0 * TIRE.free_radius * 1e-3)
    force = 2.0 / 3.0 * length * TIRE.belt_width * 0.2 * 0.5 * 1000.0 * PLAN.points.speed**2
    np.testing.assert_allclose(
        state.contact.load, PLAN.points.load * np.exp(-force / PLAN.points.load), rtol=1e-8
    )
    shift = (state.contact.edges - base.contact.edges)[FREE_ROLLING]
    assert (shift[:, 0] > 0).all()
    assert (shift[:, 0] > -shift[:, 1]).all()
    # the water's centre lies three eighths of its length ahead of the edge, and it is as wide as
    # half a parabola is: the phase and the size of the first harmonic
    assert state.contact.extra is not None
    whole, first = state.contact.extra[:, 0, 0].real, state.contact.extra[:, 1, 0]
    wide = length / TIRE.ring_radius
    centre = base.contact.edges[:, 0] - 0.375 * wide
    np.testing.assert_allclose(np.angle(-first), -centre, atol=1e-3 * wide)
    variance = 2.0 * (1.0 - 0.5 * np.abs(first) / np.abs(whole))
    np.testing.assert_allclose(variance, wide**2 * (1.0 / 5.0 - 9.0 / 64.0), rtol=0.02)
    # springs below the axle carry what the road and the water bring
    water = -np.pi * TIRE.ring_radius * state.contact.extra[:, 1, 0].real
    np.testing.assert_allclose(water + state.contact.load, PLAN.points.load, rtol=1e-6)


def test_texture_adds_the_mean_pressure_of_random_heights_in_the_limit_of_small_ones() -> None:
    base = run().contact
    assert base is not None
    phi = np.linspace(-0.6, 0.6, 24001)
    delta = base.compression(phi)
    error = []
    for sigma in (0.1e-3, 0.05e-3):
        contact = at("roughness", (1e3 * sigma) ** 2).contact
        assert contact is not None
        assert contact.extra is not None
        z = delta / sigma
        mean = sigma * (z * norm.cdf(z) + norm.pdf(z))
        whole = np.trapezoid(TIRE.tread_stiffness * (mean - np.maximum(delta, 0.0)), phi, axis=1)
        # harmonic 0 of the inward loads, times the turn
        error.append(np.abs(-2.0 * np.pi * contact.extra[:, 0, 0].real / whole - 1.0).max())
    # the slope of delta changes within sigma: second order, beside the quadrature's error
    assert error[0] < 0.03
    assert error[1] < 0.4 * error[0]


def test_texture_carries_load_that_the_springs_of_the_tread_do_not() -> None:
    state = at("roughness", 0.3)
    assert state.contact.extra is not None
    texture = -np.pi * TIRE.ring_radius * state.contact.extra[:, 1, 0].real
    assert (texture > 1e-3 * PLAN.points.load).all()
    np.testing.assert_allclose(texture + state.contact.load, PLAN.points.load, rtol=1e-6)


def test_camber_presses_the_side_toward_which_the_wheel_leans() -> None:
    points = replace(PLAN.points, camber=np.full(72, np.deg2rad(2.0)))
    small = 0.01
    d = {}
    for side, y in (("left", 0.06), ("right", -0.06)):
        contact = at("camber", small, points=points, lateral=y).contact
        assert contact is not None
        d[side] = contact.deflection
    axle = run(points=points).deflection
    # the geometry of the strips, d0 - y tan(gamma), at small strength
    np.testing.assert_allclose(d["left"] - axle, -small * 0.06 * np.tan(np.deg2rad(2.0)), rtol=1e-3)
    np.testing.assert_allclose(d["right"] - axle, small * 0.06 * np.tan(np.deg2rad(2.0)), rtol=1e-3)
    np.testing.assert_array_equal(at("camber", 1.0, points=points, lateral=0.06).deflection, axle)


def test_side_force_to_the_left_loads_the_right_and_stretches_the_left() -> None:
    points = replace(PLAN.points, side_force=np.full(72, 2000.0))
    right = at("load_transfer", 1.0, points=points, lateral=-0.06).contact
    left = at("load_transfer", 1.0, points=points, lateral=0.06).contact
    assert right is not None
    assert left is not None
    assert (np.ptp(right.edges, axis=1) > np.ptp(left.edges, axis=1)).all()
    roll = np.deg2rad(2.0) * 0.06
    depth = run().deflection
    np.testing.assert_allclose(right.deflection, depth * (1.0 + np.tanh(roll / depth)))
    stretched = changed(
        at("belt_bending", 0.1, points=points, lateral=0.06), points=points, lateral=0.06
    )
    assert (stretched[:, GRID.size // 2] > 0).all()


def test_braking_raises_the_second_compressive_peak_and_driving_the_first() -> None:
    peaks = {}
    for name, force in (("brake", -1500.0), ("drive", 1500.0)):
        points = replace(PLAN.points, drive_force=np.full(72, force))
        waves = at("traction", 1.0, points=points).waveform
        assert waves is not None
        peaks[name] = -waves[:, GRID < 0].min(axis=1), -waves[:, GRID > 0].min(axis=1)
    assert (peaks["brake"][1] > peaks["brake"][0]).all()
    assert (peaks["drive"][1] < peaks["drive"][0]).all()


def test_a_drive_force_turns_the_belt_with_the_lever_of_the_treads_radius() -> None:
    points = replace(PLAN.points, drive_force=np.full(72, 1500.0))
    state = at("traction", 1.0, points=points)
    assert state.contact.extra is not None
    pulled, turned = state.contact.extra[:, 0, 1:].real.T * 2.0 * np.pi * TIRE.ring_radius
    np.testing.assert_allclose(pulled, -1500.0)
    np.testing.assert_allclose(TIRE.ring_radius * pulled + turned, -1500.0 * TIRE.free_radius)


def test_the_belt_bends_sideways_as_a_beam_under_the_tension_of_the_hoop() -> None:
    """EI w'''' - p b R w'' + k w = f, harmonic by harmonic; a fibre at y takes -y w''."""
    points = replace(PLAN.points, side_force=np.full(72, 2000.0))
    given = {"points": points, "lateral": 0.06}
    state = run(**given)
    more = (at("belt_bending", 1.0, **given).strain - state.strain)[:, 1:]
    wave_number = np.arange(1, more.shape[1] + 1) / TIRE.ring_radius
    tension = points.pressure * TIRE.belt_width * TIRE.ring_radius
    stiffness = BENDING * wave_number**4 + tension[:, None] * wave_number**2 + FOUNDATION
    load = more * stiffness / (0.06 * wave_number**2)
    # an even load, as the pressure is, has its total in the mean and less in every harmonic
    lowest = np.abs(load[:, 0]) * np.pi * TIRE.ring_radius
    np.testing.assert_allclose(lowest, 2000.0, rtol=0.01)
    assert (np.abs(load) * np.pi * TIRE.ring_radius <= 2000.0 * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("name", ["belt_extension", "belt_shear"])
@pytest.mark.parametrize("share", [1e-300, 1e-12, 1e-7, 1.1e-6, 1e-5])
def test_a_nearly_rigid_belt_is_next_to_the_rigid_one(name: str, share: float) -> None:
    effect = CATALOGUE[name]
    change = wave(effect.at(share * effect.high)) - BASE
    # in proportion, and a ten-thousandth of a microstrain of round-off
    assert np.abs(change).max() < 2.0 * share * np.abs(tangents(effect)[0]).max() + 1e-10
