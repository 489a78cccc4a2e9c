"""Laws of the rolling ring: balance, symmetry, limits, energy and convergence."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact.exact import load_exact
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.ring import Ring
from tirelib.physics.rolling import belt, road
from tirelib.physics.rolling.assemble import Unknowns, changed, matrix, residual
from tirelib.physics.rolling.constants import Constants
from tirelib.physics.rolling.gage import Gage
from tirelib.physics.rolling.mesh import mesh
from tirelib.physics.rolling.solve import Rolling, _column, solve

LOADS = np.array([1500.0, 4000.0, 7000.0])
GAGE = Gage(np.full(3, -0.003), np.zeros(3), np.zeros(3))
LINED = Gage(np.full(3, -0.003), np.full(3, 0.6), np.full(3, 0.004))
N = 360
BARE: dict[str, Any] = {
    "radius": 0.303,
    "free_radius": 0.316,
    "EA": 4.6e6,
    "GA": np.inf,
    "EI": 2.6,
    "mass": 3.6,
    "rotary_inertia": 0.0,
    "inflation": 2.3e5 * 0.168,
    "tension": 0.0,
    "k_u": 4.8e5,
    "k_v": 1.9e5,
    "softening": 0.0,
    "dashpots": 0.0,
    "k_t": 5.4e7,
    "hardening": 0.0,
    "thickness": 0.0125,
    "crown": 0.0,
    "half_width": 0.084,
    "k_s": 0.0,
    "poisson": 0.0,
    "friction": 0.0,
    "creep": 0.0,
    "omega": 1.0,
    "load": LOADS,
    "torque": 0.0,
}
WHOLE = {
    **BARE,
    "GA": 5e4,
    "rotary_inertia": 6e-5,
    "k_s": 1.8e7,
    "friction": 0.9,
    "creep": 0.008,
    "hardening": 1.0,
    "softening": 15.0,
    "dashpots": 0.05,
    "omega": 70.0,
    "crown": 0.5,
    "poisson": 0.6,
    "tension": -500.0,
}


def ring(base: dict[str, Any] = BARE, **values: Any) -> Constants:
    return Constants.of(**{**base, **values})


def strain(found: Rolling, n: int = N) -> FloatArray:
    return smooth(found.strain(GAGE, n))


def smooth(values: FloatArray) -> FloatArray:
    """Return curves up to the 40th harmonic, mean off."""
    terms = np.fft.rfft(values)
    terms[:, 0] = terms[:, 41:] = 0.0
    return np.asarray(np.fft.irfft(terms, n=values.shape[1]))


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("creep", [0.0, 0.008])
def test_the_matrix_is_the_derivative_of_the_residual(creep: float) -> None:
    k, grid = ring(WHOLE, creep=creep), mesh()
    found, random = solve(k), np.random.default_rng(1)
    x = found.x
    step = Unknowns(
        1e-4 * random.standard_normal(x.node.shape), 1e-4 * np.ones(3), 1e-4 * np.ones(3)
    )
    h = 1e-3
    ends = [_column(residual(x.plus(step, np.full(3, s * h)), k, grid)[0]) for s in (1.0, -1.0)]
    differences = (ends[0] - ends[1])[..., 0] / (2.0 * h)
    m = matrix(x, found.z, found.contact, k, grid)
    inner = m.band.shape[1]
    flat = _column(step)[..., 0]
    product = np.einsum("nbi,ni->nb", m.lower, flat[:, :inner])
    product += np.einsum("nbc,nc->nb", m.corner, flat[:, inner:])
    np.testing.assert_allclose(
        product, differences[:, inner:], atol=1e-5 * np.abs(differences[:, inner:]).max()
    )
    rows = np.arange(inner)
    above = np.einsum("nic,nc->ni", m.right, flat[:, inner:])
    for offset in range(-15, 16):
        column = rows + offset
        ok = (column >= 0) & (column < inner)
        above[:, rows[ok]] += m.band[:, column[ok], 30 - offset] * flat[:, column[ok]]
    np.testing.assert_allclose(
        above, differences[:, :inner], atol=1e-5 * np.abs(differences[:, :inner]).max()
    )


@pytest.mark.parametrize("name", Constants.__slots__)
def test_a_changed_constant_changes_the_residual_by_the_difference(name: str) -> None:
    k, grid = ring(WHOLE), mesh()
    found = solve(k)
    other = k.but(**{name: 1.001 * getattr(k, name) + 1e-6})
    there, here = residual(found.x, other, grid)[0], residual(found.x, k, grid)[0]
    by = changed(found.x, found.z, found.contact, k, other, grid)
    np.testing.assert_allclose(by.node, there.node - here.node, atol=1e-7)
    np.testing.assert_allclose(by.depth, there.depth - here.depth, atol=1e-7)
    np.testing.assert_allclose(by.rolling, there.rolling - here.rolling, atol=1e-7)
    assert np.abs(by.node).max() + np.abs(by.depth).max() + np.abs(by.rolling).max() > 1e-9


def test_without_shear_and_friction_it_is_the_exact_ring_of_harmonics() -> None:
    one = np.ones(3)
    exact = load_exact(
        Ring(
            0.303 * one,
            2.6 * one,
            3.6 * one,
            2.3e5 * 0.168 * one,
            4.8e5 * one,
            1.9e5 * one,
            extension_stiffness=4.6e6 * one,
        ),
        Tread(0.316 * one, 5.4e7 * one, 0.0125 * one, 0.0 * one),
        LOADS,
    )
    found = solve(ring())
    np.testing.assert_allclose(found.deflection, exact.deflection, rtol=5e-4)
    phi = found.on_turn(N).phi
    # its fibres have the length R + y, those of the other ring R
    other = smooth(exact.strain(-0.003, phi) * 0.303 / 0.300)
    assert rms(strain(found) - other) < 3e-3 * rms(other)


@pytest.mark.parametrize("turn", [0.0, 0.02])
def test_sidewalls_that_pull_leave_the_belt_round_and_keep_their_direction(
    turn: float,
) -> None:
    """A belt that turns carries the ends of the pull S = -T / R with it: S R^2 sin turns it on."""
    pull, radius = 1200.0, BARE["radius"]
    z = np.zeros((6, 3, 1))
    z[belt.U], z[belt.V] = radius * (np.cos(turn) - 1.0), radius * np.sin(turn)
    z[belt.PSI] = -turn
    pulled = belt.forces(z, ring(tension=-pull * radius)) - belt.forces(z, ring())
    outward = pulled[belt.U] * np.cos(turn) + pulled[belt.V] * np.sin(turn)
    np.testing.assert_allclose(outward, pull * radius * (np.cos(turn) - 1.0), atol=1e-9)
    virtual = -pulled[belt.U] * np.sin(turn) + pulled[belt.V] * np.cos(turn)
    moment = virtual * radius - pulled[belt.PSI]
    np.testing.assert_allclose(moment, -pull * radius**2 * np.sin(turn), atol=1e-9)


def test_a_softening_sidewall_pushes_with_the_integral_of_its_tangent() -> None:
    soft, hard = ring(load=4000.0, softening=40.0), ring(load=4000.0)
    z = np.zeros((6, 1, 5))
    z[0, 0] = np.linspace(-0.03, 0.0, 5)
    tangent = belt.stiffness(z, soft)[0, 0] - belt.stiffness(z, hard)[0, 0]
    expected = hard.radius * hard.k_u * (np.exp(40.0 * z[0, 0]) - 1.0)
    np.testing.assert_allclose(tangent[0], expected, atol=1e-6)
    lost = belt.forces(z, soft)[0, 0] - belt.forces(z, hard)[0, 0]
    fine = np.linspace(-0.03, 0.0, 2001)
    work = np.trapezoid(np.exp(40.0 * fine) - 1.0, fine)
    np.testing.assert_allclose(lost[0] - lost[-1], -hard.radius * hard.k_u * work, rtol=1e-6)


def test_a_sidewall_that_softens_little_is_one_that_does_not() -> None:
    one, none = solve(ring(softening=1e-4)), solve(ring())
    np.testing.assert_allclose(one.deflection, none.deflection, rtol=1e-5)
    deeper = solve(ring(softening=15.0)).deflection / none.deflection
    assert (np.diff(deeper) > 0.0).all()
    assert (deeper > 1.0).all()


def test_a_gage_on_a_thick_liner_turns_with_the_belts_line() -> None:
    """Its fibre follows the curve (u, v), whatever the sections of the belt do."""
    found = solve(ring(WHOLE), fine=40, coarse=14)
    wholly = Gage(LINED.offset, np.ones(3), np.zeros(3))
    turn = found.on_turn(1440)
    slope = 1j * np.arange(721)

    def by_angle(values: FloatArray) -> FloatArray:
        return np.asarray(np.fft.irfft(np.fft.rfft(values) * slope, n=1440))

    along = BARE["radius"] + turn.u + by_angle(turn.v)
    across = by_angle(turn.u) - turn.v
    stretch = along * np.cos(turn.psi) + across * np.sin(turn.psi) - BARE["radius"]
    curved = by_angle(np.arctan2(across, along))
    expected = smooth((stretch + 0.003 * curved) / (BARE["radius"] - 0.003))
    shown = smooth(found.strain(wholly, 1440))
    assert rms(shown - expected) < 1e-3 * rms(expected)
    assert rms(strain(found, 1440) - expected) > 0.05 * rms(expected), "the belt shears"


def test_a_tread_that_spreads_pressure_smooths_the_strain_as_a_normal_density() -> None:
    """The strain is the sharp one, averaged over the turn with the density of sigma / R."""
    found = solve(ring(WHOLE), fine=40, coarse=14)
    sharp = found.strain(GAGE, 1440)
    sigma = 0.006
    told = found.strain(Gage(GAGE.offset, GAGE.liner, np.full(3, sigma)), 1440)
    step = 2.0 * np.pi / 1440
    places = np.arange(-60, 61)
    density = np.exp(-0.5 * (places * step * BARE["radius"] / sigma) ** 2)
    weights = density / density.sum()
    expected = sum(w * np.roll(sharp, k, axis=1) for w, k in zip(weights, places, strict=True))
    np.testing.assert_allclose(told, expected, atol=1e-6 * float(np.abs(sharp).max()))
    assert rms(told - sharp) > 0.01 * rms(sharp)


def test_a_belt_that_does_not_shear_shows_the_same_on_every_liner() -> None:
    found = solve(ring(WHOLE, GA=np.inf))
    lined = smooth(found.strain(Gage(LINED.offset, LINED.liner, np.zeros(3)), N))
    assert rms(lined - strain(found)) < 1e-3 * rms(lined)


def test_a_tread_that_keeps_its_volume_lifts_the_axle_by_what_it_grows_thicker() -> None:
    """On a flat road the bend is 1: a tread too stiff for the road to press it stands T higher."""
    stiff = {"k_t": 3e9, "mass": 0.1}
    flat, thick = (solve(ring(**stiff, poisson=nu, load=LOADS[2:])) for nu in (0.0, 0.3))
    lever = 0.316 - 0.303 - 0.5 * 0.0125
    grown = 0.3 * 0.0125 * lever / (0.303 + lever)
    np.testing.assert_allclose(flat.deflection - thick.deflection, grown, rtol=0.1)


def test_the_road_carries_the_load_and_no_torque() -> None:
    found = solve(ring(WHOLE))
    turn = found.on_turn(20_000)
    step = 2.0 * np.pi / 20_000 * 0.303
    np.testing.assert_allclose(turn.pressure.sum(axis=1) * step, LOADS, rtol=1e-4)
    assert (found.drag > 0.0).all(), "the road drags a tire that loses power"
    driven = solve(ring(WHOLE, torque=150.0))
    loaded = 0.316 - driven.deflection
    # a torque that drives pushes the tire against the road's motion; the pressure's centre, which
    # it moves, bears the rest
    np.testing.assert_allclose((found.drag - driven.drag) * loaded, 150.0, rtol=0.1)


def test_what_the_road_puts_in_is_what_dashpots_and_sliding_take() -> None:
    for grip in (
        {},
        {"friction": 0.3},
        {"dashpots": 0.0},
        {"dashpots": 0.0, "creep": 0.05},
        {"creep": 0.0},
    ):
        found = solve(ring({**WHOLE, **grip}))
        speed = found.rolling_radius * found.constants.omega
        np.testing.assert_allclose(found.drag * speed, found.dissipated, rtol=0.02, atol=1e-6)


def test_a_tread_that_creeps_less_and_less_sticks_and_one_that_creeps_much_slides_freely() -> None:
    still = {"dashpots": 0.0}
    sticks = strain(solve(ring(WHOLE, **still, creep=0.0)))
    off = [rms(strain(solve(ring(WHOLE, **still, creep=c))) - sticks) for c in (0.004, 4e-4, 4e-5)]
    assert off[0] > 8.0 * off[1] > 60.0 * off[2]
    smooth = strain(solve(ring(WHOLE, **still, k_s=0.0)))
    loose = strain(solve(ring(WHOLE, **still, creep=1e3)))
    # a sliding bristle takes a hundredth of a further shear
    assert rms(loose - smooth) < road.SLIDING_STIFFNESS * rms(sticks - smooth)


def test_creep_takes_power_and_sticking_none() -> None:
    """With these constants a tread that sticks does not reach its friction anywhere."""
    lost = []
    for creep in (0.0, 1e-3, 2e-3):
        found = solve(ring(WHOLE, dashpots=0.0, friction=5.0, creep=creep))
        lost.append(found.drag * found.rolling_radius)
    assert (np.abs(lost[0]) < 0.02 * lost[1]).all()
    np.testing.assert_allclose(lost[2] / lost[1], 2.0, rtol=0.05)  # g = c rho k_s q / (mu P)


LENGTHS = st.floats(1e-6, 1e-2)


@settings(max_examples=100, deadline=None)
@given(st.floats(-1e-2, 1e-2), LENGTHS, st.one_of(st.just(0.0), LENGTHS))
def test_bristles_follow_the_law_of_friction_and_never_give_power(
    wanted: float, limit: float, creep: float
) -> None:
    def shear(*at: float) -> tuple[FloatArray, ...]:
        return road.bristles(*[np.array([value]) for value in at])

    found, *slopes = (float(each[0]) for each in shear(wanted, limit, creep))
    # what a sliding bristle takes of a further shear is numerics, not friction
    held = (found - road.SLIDING_STIFFNESS * wanted) / (1.0 - road.SLIDING_STIFFNESS)
    slip = wanted - held
    assert held * slip >= -1e-15 * held**2
    assert abs(held) <= limit * (1.0 + 1e-9)
    if creep > 0.0:
        law = limit * slip / np.hypot(slip, creep)
        assert held == pytest.approx(law, abs=1e-9 * limit)
    else:
        assert held == pytest.approx(np.clip(wanted, -limit, limit))
    assert 0.0 <= slopes[0] <= 1.0
    if creep > 0.0:
        step = 1e-5 * min(limit, creep)
        for slope, way in zip(slopes, step * np.eye(3), strict=True):
            at = np.array([wanted, limit, creep])
            difference = float(shear(*(at + way))[0][0] - shear(*(at - way))[0][0])
            assert slope == pytest.approx(difference / (2.0 * step), abs=1e-5)


def test_without_losses_the_shape_is_symmetric_and_with_them_it_follows_the_motion() -> None:
    still = strain(solve(ring(GA=5e4)))
    mirrored = np.roll(still[:, ::-1], 1, axis=1)
    assert rms(still - mirrored) < 1e-9
    forward = strain(solve(ring(WHOLE, k_s=0.0)))
    backward = strain(solve(ring(WHOLE, k_s=0.0, omega=-70.0)))
    assert rms(forward - np.roll(backward[:, ::-1], 1, axis=1)) < 1e-9
    assert rms(forward - backward) > 1e-5


def test_an_inextensible_belt_without_section_inertia_keeps_its_shape_at_every_speed() -> None:
    slow, fast = (strain(solve(ring(EA=np.inf, omega=w))) for w in (1.0, 110.0))
    assert rms(slow - fast) < 2e-3 * rms(slow)
    heavy = strain(solve(ring(EA=np.inf, omega=110.0, rotary_inertia=1e-4)))
    assert rms(heavy - fast) > 0.003 * rms(slow), "section inertia softens the bending"


def test_a_belt_grows_with_speed_squared() -> None:
    u = [solve(ring(omega=w)).on_turn(N).u[:, 0] for w in (1.0, 50.0, 100.0)]
    np.testing.assert_allclose((u[2] - u[0]) / (u[1] - u[0]), 4.0, rtol=0.03)


def test_every_softness_gives_way() -> None:
    whole = solve(ring(WHOLE)).deflection
    for softer in ({"GA": 4e4}, {"EI": 2.0}, {"k_u": 4e5}, {"k_t": 4e7}, {"inflation": 3.2e4}):
        assert (solve(ring({**WHOLE, **softer})).deflection > whole).all(), softer


def test_a_finer_mesh_converges() -> None:
    fine = solve(ring(WHOLE), fine=120, coarse=24)
    off = []
    for n, rest in ((15, 6), (30, 10), (60, 14)):
        found = solve(ring(WHOLE), fine=n, coarse=rest)
        off.append(rms(strain(found) - strain(fine)))
    assert off[0] > 2.0 * off[1] > 4.0 * off[2]
    assert rms(strain(solve(ring(WHOLE))) - strain(fine)) < 1.5e-3 * rms(strain(fine))


@settings(max_examples=15, deadline=None)
@given(
    st.floats(1000.0, 7000.0),
    st.floats(2.5e4, 5e5),
    st.floats(1e6, 6e7),
    st.floats(0.05, 1.5),
    st.floats(0.0, 0.1),
    st.floats(1.0, 110.0),
)
def test_it_is_solved_for_every_tire(
    load: float, shear: float, grip: float, friction: float, damping: float, omega: float
) -> None:
    k = ring(
        WHOLE,
        GA=shear,
        k_s=grip,
        friction=friction,
        dashpots=damping,
        omega=omega,
        load=np.array([load]),
    )
    found = solve(k)
    turn = found.on_turn(2000)
    assert 0.002 < found.deflection[0] < 0.06
    assert (np.abs(turn.shear) <= 1.3 * friction * turn.pressure.max()).all()
    assert 0.26 < found.rolling_radius[0] < 0.33


def test_one_point_does_not_depend_on_those_solved_beside_it() -> None:
    together = solve(ring(WHOLE)).strain(LINED, N)
    for k, load in enumerate(LOADS):
        gage = Gage(LINED.offset[:1], LINED.liner[:1], LINED.spread[:1])
        alone = solve(ring(WHOLE, load=np.array([load]))).strain(gage, N)
        np.testing.assert_allclose(alone[0], together[k], atol=1e-9)


def test_a_start_nearby_gives_the_same() -> None:
    near = solve(ring(WHOLE, EI=2.4))
    np.testing.assert_allclose(
        solve(ring(WHOLE), start=near).deflection, solve(ring(WHOLE)).deflection, rtol=1e-9
    )


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"k_t": -1.0}, "k_t = -1 at point 0; a finite number > 0"),
        ({"friction": np.nan}, "friction = nan at point 0; a finite number >= 0"),
        ({"free_radius": 0.30}, "the tread must stand outside the belt"),
        ({"thickness": 1e-3}, "tread pressed by"),
        ({"load": np.array([3.0])}, "touches the road over a half angle"),
    ],
)
def test_what_is_no_tire_is_refused(values: dict[str, Any], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        solve(ring(**values))


def test_a_load_that_it_does_not_carry_is_refused() -> None:
    with pytest.raises(ConvergenceError, match="use a smaller load"):
        solve(ring(load=np.array([60_000.0]), thickness=0.1))
