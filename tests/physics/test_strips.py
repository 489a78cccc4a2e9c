"""Laws of the strips across the width, and the numerical rig as independent truth."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from tirelib.core.errors import ParameterError
from tirelib.core.parameters import Tire
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.contact.load_transfer import roll_load, strip_deflection
from tirelib.physics.contact.radial import load
from tirelib.physics.contact.strips import SHARED, Layout, RoadForces, StripContact, press_strips
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.ring import Ring
from tirelib.rig.observe import edges, forces
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import Condition, RigTire

# the rig's own constants where it has them, none fitted
TIRE = Tire(
    ring_radius=0.3035,
    free_radius=0.3165,
    belt_width=0.168,
    tread_thickness=0.0115,
    innerliner_offset=-0.003,
    bending_stiffness=2.6,
    mass=3.6,
    pressure=2.3e5,
    radial_stiffness=4.83e5,
    tangential_stiffness=1.9e5,
    tread_stiffness=5.38e7,
    damping=0.03,
    tread_hardening=1.0,
    crown_curvature=0.7,
    lateral_bending=8000.0,
    lateral_stiffness=3.64e5,
    roll_lever=0.005,
)
SHEAR = 1.2e4
"""The rig's belt between its strips: 4 x 1e5 N/m x 0.03 m."""
RIG = RigTire()
BASE = Condition(4800.0, 2.3e5, 65.0 / 3.6)
ANGLES = (0.0, 0.035, 0.14)


@cache
def rig(**change: float) -> RigState:
    cond = replace(BASE, **change)
    return solve(RIG, cond, None if cond == BASE else rig())


def on_road(
    fy: list[float] | float = 0.0,
    fx: list[float] | float = 0.0,
    *,
    fz: list[float] | float = 4800.0,
    tire: Tire = TIRE,
    **options: float,
) -> StripContact:
    side, along, up = np.broadcast_arrays(np.atleast_1d(fy), fx, fz)
    return press_strips(
        tire,
        up.astype(float),
        omega=59.0,
        forces=RoadForces(along.astype(float), side.astype(float)),
        lateral_shear=SHEAR,
        **options,
    )


def test_even_strips_on_a_flat_crown_are_the_whole_tire() -> None:
    flat = TIRE.changed(crown_curvature=0.0)
    fz = np.array([1200.0, 4800.0, 8000.0])
    strips = press_strips(flat, fz, omega=59.0)
    whole = load(compliance(Ring.of(flat, flat.pressure), 59.0), Tread.of(flat), fz, n_nodes=24)
    np.testing.assert_allclose(strips.deflection, whole.deflection, rtol=1e-6)
    for strip in range(5):
        np.testing.assert_allclose(strips.edges[:, strip], whole.edges, rtol=1e-5)
        np.testing.assert_allclose(strips.load[:, strip], fz / 5.0, rtol=2e-6)
        np.testing.assert_allclose(
            strips.displacement[:, strip], whole.displacement, rtol=1e-4, atol=1e-8
        )


def test_every_constant_of_the_ring_is_shared_or_known_not_to_be() -> None:
    same = {"radius", "damping", "dashpots", "inertia_share"}  # ratios belong to every strip
    assert set(SHARED) | same == {field.name for field in fields(Ring)}
    assert not set(SHARED) & same


def test_uneven_shares_add_up_to_the_same_tire() -> None:
    flat = TIRE.changed(crown_curvature=0.0)
    share = np.array([0.1, 0.2, 0.3, 0.25, 0.15])
    uneven = press_strips(flat, 4800.0, layout=Layout(Layout.even().lateral, share, share))
    even = press_strips(flat, 4800.0)
    np.testing.assert_allclose(uneven.deflection, even.deflection, rtol=1e-6)
    np.testing.assert_allclose(uneven.load[0], 4800.0 * share, rtol=1e-5)


def test_every_point_carries_its_load() -> None:
    rng = np.random.default_rng(5)
    fz = rng.uniform(1500.0, 8000.0, 12)
    c = press_strips(
        TIRE,
        fz,
        omega=rng.uniform(5.0, 100.0, 12),
        camber=rng.uniform(-0.05, 0.05, 12),
        pressure=rng.uniform(1.8e5, 2.8e5, 12),
        lateral_shear=SHEAR,
        forces=RoadForces(rng.uniform(-0.4, 0.4, 12) * fz, rng.uniform(-0.5, 0.5, 12) * fz),
    )
    np.testing.assert_allclose(c.load.sum(axis=1), fz, rtol=1e-6)


def test_points_do_not_know_of_each_other() -> None:
    fy = [0.0, -800.0, -3000.0, 2000.0]
    together = on_road(fy)
    for i, force in enumerate(fy):
        alone = on_road(force)
        # both are solved to 1e-6
        np.testing.assert_allclose(together.load[i], alone.load[0], atol=0.02)
        np.testing.assert_allclose(together.edges[i], alone.edges[0], atol=1e-5)


def test_sidewalls_carry_each_strips_load() -> None:
    # inflation, tension and steady rotation have no resultant; a free strip has no other load
    side = np.array([0.26, 0.16, 0.16, 0.16, 0.26])
    layout = replace(Layout.even(), sidewall_share=side)
    c = press_strips(TIRE, 4800.0, camber=0.03, lateral_shear=0.01, layout=layout)
    u, v = (c.displacement[0, :, 1, i].real for i in (0, 1))
    v_sine = -c.displacement[0, :, 1, 1].imag
    k_u, k_v = TIRE.radial_stiffness * side, TIRE.tangential_stiffness * side
    carried = np.pi * TIRE.ring_radius * (-k_u * u + k_v * v_sine)
    assert np.abs(v).max() < 1e-9
    np.testing.assert_allclose(carried, c.load[0], rtol=1e-4)


def test_mirrored_forces_and_camber_mirror_the_strips() -> None:
    one, two = on_road([-2000.0], camber=0.02), on_road([2000.0], camber=-0.02)
    np.testing.assert_allclose(one.load, two.load[:, ::-1], atol=0.05)
    np.testing.assert_allclose(one.length, two.length[:, ::-1], atol=1e-6)
    np.testing.assert_allclose(one.tilt, -two.tilt, rtol=1e-4)


def test_the_crown_shortens_the_shoulders() -> None:
    c = on_road()
    assert np.all(np.diff(c.length[0, :3]) > 0.0)
    np.testing.assert_allclose(c.length[0], c.length[0, ::-1], rtol=1e-6)


def test_positive_camber_loads_the_right() -> None:
    # the top leans to the right (ISO 8855), the right strips (y < 0) go deeper
    c = on_road(camber=0.05)
    assert np.all(np.diff(c.strip_deflection) < 0.0)
    assert np.all(np.diff(c.load) < 0.0)
    assert c.overturning[0] < 0.0


def test_force_to_the_right_loads_the_left() -> None:
    c = on_road([-500.0, -1500.0, -3000.0], tire=TIRE.changed(crown_curvature=0.0))
    assert np.all(np.diff(c.load, axis=1) > 0.0)
    assert np.all(np.diff(c.overturning) > 0.0)
    assert np.all(np.diff(c.tilt) < 0.0)  # the right side is lifted, negative roll


def test_the_roll_lever_alone_moves_load_to_the_side_it_must() -> None:
    still = press_strips(
        TIRE.changed(roll_lever=0.0),
        4800.0,
        lateral_shear=1e-3,
        forces=RoadForces(np.zeros(1), np.array([-2500.0])),
    )
    assert abs(still.overturning[0]) < 0.05
    lever = [
        press_strips(
            TIRE.changed(roll_lever=h),
            4800.0,
            lateral_shear=1e-3,
            forces=RoadForces(np.zeros(1), np.array([-2500.0])),
        ).overturning[0]
        for h in (0.005, 0.01)
    ]
    assert 0.0 < lever[0] < 0.005 * 2500.0  # the sidewalls keep a part
    assert lever[1] == pytest.approx(2.0 * lever[0], rel=0.02)


def test_roll_loads_are_a_pure_moment() -> None:
    y = np.array([-0.06, -0.03, 0.0, 0.03, 0.06])
    rng = np.random.default_rng(1)
    reaction = rng.standard_normal((3, 7)) + 1j * rng.standard_normal((3, 7))
    q = roll_load(reaction, y, 0.004)
    np.testing.assert_allclose(q.sum(axis=1), 0.0, atol=1e-15)
    # outward at y is upward negative: the moment about x is -sum y q
    np.testing.assert_allclose(-np.einsum("i,pin->pn", y, q), 0.004 * reaction, rtol=1e-12)


def test_a_belt_stiff_in_its_plane_rolls_where_it_curves() -> None:
    # strips shift by v = -y w' and roll by u = y R w''; low harmonics, where nothing else yields
    c = press_strips(
        TIRE.changed(lateral_bending=1e6),
        4800.0,
        lateral_shear=1e9,
        forces=RoadForces(np.zeros(1), np.array([-2000.0])),
    )
    n = np.arange(1, 8)
    arm = c.layout.lateral / np.sum(c.layout.lateral**2)
    slope = 1j * n / c.radius[0] * c.bending.displacement[0, n]
    shift = np.einsum("i,in->n", arm, c.displacement[0][:, n, 1])
    np.testing.assert_allclose(shift, -slope, rtol=0.02)
    roll = np.einsum("i,in->n", arm, c.displacement[0][:, n, 0])
    np.testing.assert_allclose(roll, c.radius[0] * 1j * n / c.radius[0] * slope, rtol=0.02)


def test_drive_winds_the_belt_and_shifts_it_forward() -> None:
    fx = 2000.0
    c = on_road(0.0, [0.0, fx])
    change = c.displacement[1].sum(axis=0)[:, :2] - c.displacement[0].sum(axis=0)[:, :2]
    # the tread's surface is the lever of the torque
    lever = (c.load[1] @ c.free_radius) / c.load[1].sum()
    wind = -fx * lever * 5.0 / (2.0 * np.pi * TIRE.ring_radius**2 * TIRE.tangential_stiffness)
    assert change[0, 1].real == pytest.approx(wind, rel=1e-3)


def test_distributions_can_be_given() -> None:
    force = np.array([-2000.0])
    even = RoadForces(np.zeros(1), force, lateral_shape=np.ones(5))
    late = RoadForces(np.zeros(1), force, lateral_shape=np.linspace(0.0, 1.0, 9)[None, :])
    a, b = (press_strips(TIRE, 4800.0, forces=f, lateral_shear=SHEAR) for f in (even, late))
    for c in (a, b):
        total = 2.0 * np.pi * TIRE.ring_radius * c.bending.reaction[0, 0].real
        assert total == pytest.approx(force[0], rel=1e-6)
    places = np.array([-0.1, 0.1])
    w = evaluate(np.concatenate([a.bending.displacement, b.bending.displacement]), places)
    assert w[0, 0] == pytest.approx(w[0, 1], rel=1e-3)
    assert w[1, 1] < w[1, 0] < 0.0  # the force acts late, to the right


def test_a_strip_off_the_road_carries_nothing() -> None:
    c = on_road(fz=1200.0, camber=0.12)
    assert np.isnan(c.edges[0, -1]).all()
    assert c.load[0, -1] == 0.0
    assert c.length[0, -1] == 0.0
    assert c.load.sum() == pytest.approx(1200.0, rel=1e-6)


def test_softening_sidewalls_let_the_axle_sink() -> None:
    soft = TIRE.changed(radial_deflection_rate=-3.0)
    assert press_strips(soft, 4800.0).deflection[0] > press_strips(TIRE, 4800.0).deflection[0]


def test_bad_input_is_refused() -> None:
    y = np.array([-0.03, 0.03])
    with pytest.raises(ParameterError, match="add up"):
        Layout(y, np.array([0.5, 0.6]), np.array([0.5, 0.5]))
    with pytest.raises(ParameterError, match="grow to the left"):
        Layout(y[::-1], np.array([0.5, 0.5]), np.array([0.5, 0.5]))
    with pytest.raises(ParameterError, match="camber"):
        strip_deflection(np.array([0.02]), y, np.array([5.0]), 0.7)
    with pytest.raises(ParameterError, match="not a finite number"):
        RoadForces(np.array([np.nan]), np.zeros(1))
    with pytest.raises(ParameterError, match="lateral_shape"):
        RoadForces(np.zeros(1), np.zeros(1), lateral_shape=np.array([-1.0, 1.0]))


def test_contact_lengths_follow_the_rig_under_slip_angle() -> None:
    truth = np.array([edges(rig(slip_angle=a))[1] for a in ANGLES])
    fy = [forces(rig(slip_angle=a)).fy for a in ANGLES]
    model = on_road(fy).length
    # the centre hardly notices, the shoulders make the trapezoid
    assert np.ptp(model[:, 2]) < 0.01 * model[0, 2]
    assert np.ptp(truth[:, 2]) < 0.01 * truth[0, 2]
    spread, wanted = (x[1:, 4] - x[1:, 0] for x in (model, truth))
    assert np.all(spread > 0.0)
    # nothing is fitted; bending across, uneven sidewall shares and the belt's stretch are missing
    np.testing.assert_allclose(spread, wanted, rtol=0.25)
    np.testing.assert_allclose(model, truth, atol=0.015)


def test_contact_lengths_follow_the_rig_under_camber() -> None:
    truth = edges(rig(camber=0.07))[1]
    model = on_road(forces(rig(camber=0.07)).fy, camber=0.07).length[0]
    assert np.all(np.diff(truth) < 0.0)
    assert np.all(np.diff(model) < 0.0)
    np.testing.assert_allclose(model, truth, atol=0.01)
