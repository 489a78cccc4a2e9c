"""The brush: laws, limits, closed forms, then certified numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ConvergenceError, ParameterError, ShapeError
from tirelib.physics.brush.forces import brush_distribution, brush_forces
from tirelib.physics.brush.parabola import (
    aligning_moment,
    bristle_stiffness,
    lateral_force,
    sliding_angle,
)
from tirelib.physics.brush.parameters import BrushParameters, Carcass
from tirelib.physics.contact.profiles import convex_concave, parabola, power_law, sampled

MU, LOAD, A, STIFFNESS = 0.9, 4000.0, 0.06, 6e4
CPY = STIFFNESS / (2 * A**2)
PARABOLA = parabola(LOAD, -A, A)
ELLIPSE = power_law(LOAD, -A, A, 2.0)
DIP = convex_concave(LOAD, -0.055, 0.06, 4.0, 6.0, -4.0)
RIM = sampled(np.linspace(-0.06, 0.05, 41), 2e4 + 3e6 * np.linspace(-0.06, 0.05, 41) ** 2)
SLOW_EDGE = power_law(LOAD, -A, A, 0.5)
PLAIN = BrushParameters(lateral_stiffness=CPY, friction=MU)
ANISOTROPIC = BrushParameters(CPY, MU, longitudinal_stiffness=1.6 * CPY)
profiles = st.sampled_from([PARABOLA, ELLIPSE, DIP, RIM, SLOW_EDGE])
angles = st.floats(-0.4, 0.4)
ratios = st.floats(-0.9, 0.9)


@given(load=st.floats(500.0, 9000.0), a=st.floats(0.03, 0.1), mu=st.floats(0.1, 1.5), alpha=angles)
def test_quadrature_equals_the_closed_forms(load, a, mu, alpha) -> None:
    c = float(bristle_stiffness(STIFFNESS, a))
    found = brush_forces(parabola(load, -a, a), BrushParameters(c, mu), alpha)
    scale = mu * load
    expected = lateral_force(alpha, c, mu, load, a)
    assert float(found.Fy) == pytest.approx(float(expected), abs=1e-10 * scale)
    moment = aligning_moment(alpha, c, mu, load, a)
    assert float(found.Mz) == pytest.approx(float(moment), abs=1e-10 * scale * a)


@given(profile=profiles, alpha=angles, kappa=ratios)
def test_force_never_exceeds_friction(profile, alpha: float, kappa: float) -> None:
    found = brush_forces(profile, ANISOTROPIC, alpha, kappa)
    limit = MU * float(profile.load)
    assert float(np.hypot(found.Fx, found.Fy)) <= limit * (1 + 1e-12)
    part = brush_distribution(profile, ANISOTROPIC, alpha, kappa)
    assert np.all(np.hypot(part.fx, part.fy) <= MU * profile.pressure * (1 + 1e-9) + 1e-9)


@given(profile=profiles, alpha=angles, kappa=ratios)
def test_mirrored_slip_angle_mirrors_fy_and_mz(profile, alpha: float, kappa: float) -> None:
    one, two = (brush_forces(profile, ANISOTROPIC, s * alpha, kappa) for s in (1.0, -1.0))
    assert float(one.Fy) == -float(two.Fy)
    assert float(one.Mz) == -float(two.Mz)
    assert float(one.Fx) == float(two.Fx)


@given(profile=profiles, alpha=st.floats(0.001, 0.4), kappa=st.floats(0.001, 0.9))
def test_signs_are_iso(profile, alpha: float, kappa: float) -> None:
    assert brush_forces(profile, PLAIN, alpha).Fy < 0.0
    assert brush_forces(profile, PLAIN, 0.0, kappa).Fx > 0.0
    assert brush_forces(profile, PLAIN, 0.0, -kappa).Fx < 0.0


def test_small_slip_gives_stiffness_and_a_third_of_half_length_as_trail() -> None:
    """Errors are of first order in slip: t = 3e-7 at 3e-8 rad."""
    found = brush_forces(PARABOLA, PLAIN, 3e-8)
    assert float(found.Fy) / 3e-8 == pytest.approx(-STIFFNESS, rel=1e-6)
    assert float(found.trail) == pytest.approx(A / 3, rel=2e-6)
    assert float(found.Mz) > 0.0
    slip = brush_forces(PARABOLA, PLAIN, 0.0, 3e-8)
    assert float(slip.Fx) / 3e-8 == pytest.approx(STIFFNESS, rel=1e-6)


@given(profile=profiles, alpha=angles)
def test_kappa_zero_is_pure_side_slip(profile, alpha: float) -> None:
    found = brush_forces(profile, ANISOTROPIC, alpha, 0.0)
    pure = brush_forces(profile, BrushParameters(CPY, MU), alpha)
    assert float(found.Fx) == 0.0
    assert float(found.Fy) == pytest.approx(float(pure.Fy), rel=1e-13)
    assert float(found.Mz) == pytest.approx(float(pure.Mz), rel=1e-12, abs=1e-12)


@given(alpha=angles, kappa=ratios)
def test_full_sliding_force_is_opposite_to_the_slip(alpha: float, kappa: float) -> None:
    slippery = BrushParameters(CPY, 0.002, longitudinal_stiffness=1.6 * CPY)
    if np.hypot(alpha, kappa) < 0.01:
        return
    found = brush_forces(PARABOLA, slippery, alpha, kappa)
    slip = np.array([kappa, -np.tan(alpha)])
    expected = 0.002 * LOAD * slip / np.hypot(*slip)
    assert float(found.adhesion) == 0.0
    np.testing.assert_allclose([found.Fx, found.Fy], expected, rtol=1e-9, atol=1e-9)
    assert float(found.Mz) == pytest.approx(0.0, abs=1e-10)


@given(profile=profiles, size=st.floats(1e-4, 0.5), way=st.floats(0.0, 2 * np.pi))
def test_isotropic_force_is_opposite_to_the_slip(profile, size: float, way: float) -> None:
    """Theoretical slip of one size gives one force whatever its direction."""
    sx, sy = size * np.cos(way), size * np.sin(way)
    kappa = sx / (1.0 - sx)
    alpha = np.arctan(sy * (1.0 + kappa))
    found = brush_forces(profile, PLAIN, alpha, kappa)
    pure = brush_forces(profile, PLAIN, np.arctan(size))
    np.testing.assert_allclose(
        [found.Fx, found.Fy], -pure.Fy * np.array([np.cos(way), -np.sin(way)]), atol=1e-7 * LOAD
    )


def test_locked_wheel_slides_against_its_travel() -> None:
    found = brush_forces(PARABOLA, PLAIN, np.radians([0.0, 10.0]), -1.0)
    np.testing.assert_allclose(found.Fx, -MU * LOAD * np.cos(np.radians([0.0, 10.0])))
    np.testing.assert_allclose(found.Fy, -MU * LOAD * np.sin(np.radians([0.0, 10.0])), atol=1e-9)
    np.testing.assert_array_equal(found.adhesion, 0.0)
    part = brush_distribution(PARABOLA, PLAIN, 0.0, -1.0)
    np.testing.assert_allclose((part.fx * PARABOLA.weight).sum(), -MU * LOAD)


def test_force_is_continuous_through_full_sliding() -> None:
    limit = float(sliding_angle(CPY, MU, LOAD, A))
    assert np.degrees(limit) == pytest.approx(10.2040, abs=5e-5)
    found = brush_forces(PARABOLA, PLAIN, limit + np.array([-1e-6, 1e-6]))
    assert abs(np.diff(found.Fy)[0]) < 1e-6
    assert found.adhesion[0] > 1e-6
    assert found.adhesion[1] < 1e-11  # at the very edge rounding decides


@pytest.mark.parametrize("profile", [PARABOLA, ELLIPSE, DIP, SLOW_EDGE, RIM])
def test_force_distribution_is_pointwise_minimum_and_adds_up(profile) -> None:
    alpha = 0.05
    part = brush_distribution(profile, PLAIN, alpha)
    demand = CPY * np.tan(alpha) * (profile.leading - part.x)
    np.testing.assert_allclose(-part.fy, np.minimum(demand, MU * profile.pressure), rtol=1e-9)
    total = (profile.weight * part.fy).sum()
    force = float(brush_forces(profile, PLAIN, alpha).Fy)
    assert total == pytest.approx(force, rel=5e-3)  # nodes do not sit on the border of sliding


def test_exponent_below_one_slides_at_both_ends() -> None:
    """Pressure without slope at the edges cannot hold the first bristles."""
    part = brush_distribution(SLOW_EDGE, PLAIN, 0.03)
    changes = np.flatnonzero(np.diff(part.sticks.astype(int)))
    assert not part.sticks[0]
    assert not part.sticks[-1]
    assert changes.size == 2
    x = np.linspace(-A, A, 400001)
    fine = np.minimum(CPY * np.tan(0.03) * (A - x), MU * SLOW_EDGE.pressure_at(x))
    found = brush_forces(SLOW_EDGE, PLAIN, 0.03)
    assert -float(found.Fy) == pytest.approx(np.trapezoid(fine, x), rel=1e-8)
    assert float(found.Mz) == pytest.approx(-np.trapezoid(x * fine, x), rel=1e-7)


@pytest.mark.parametrize("count", [8, 16, 128])
def test_result_does_not_depend_on_the_nodes(count: int) -> None:
    """Borders are located between the nodes, so few nodes give the same force as many."""
    few = power_law(LOAD, -A, A, 2.0, nodes=count)
    found = brush_forces(few, PLAIN, np.linspace(-0.15, 0.15, 11))
    many = brush_forces(ELLIPSE, PLAIN, np.linspace(-0.15, 0.15, 11))
    np.testing.assert_allclose(found.Fy, many.Fy, rtol=1e-11, atol=1e-9)


def test_samples_of_a_parabola_converge_to_the_parabola_with_second_order() -> None:
    alpha = np.radians([1.0, 3.0, 6.0])
    exact = brush_forces(PARABOLA, PLAIN, alpha).Fy
    error = []
    for count in (51, 101, 201):
        x = np.linspace(-A, A, count)
        profile = sampled(x, PARABOLA.pressure_at(x))
        error.append(np.abs(brush_forces(profile, PLAIN, alpha).Fy - exact).max())
    assert error[2] < 0.2
    assert np.log2(error[0] / error[1]) == pytest.approx(2.0, abs=0.3)
    assert np.log2(error[1] / error[2]) == pytest.approx(2.0, abs=0.3)


def test_certified_forces_of_parabola_and_ellipse() -> None:
    """mu .9, 4000 N, a .06 m, C_alpha 6e4 N/rad; independent quadrature of Eq. (23) with (25)."""
    alpha = np.radians([1.0, 3.0, 5.0, 8.0])
    np.testing.assert_allclose(
        brush_forces(PARABOLA, PLAIN, alpha).Fy,
        [-949.0269693522, -2317.7946803, -3111.2690409, -3562.0747311],
        rtol=1e-10,
    )
    np.testing.assert_allclose(
        brush_forces(ELLIPSE, PLAIN, alpha).Fy, [-1012.49, -2447.13, -3090.37, -3420.55], atol=0.006
    )


def test_sliding_friction_below_sticking_friction_lowers_the_force() -> None:
    weak = BrushParameters(CPY, MU, sliding_friction=0.7)
    found = brush_forces(PARABOLA, weak, np.radians([0.0, 3.0, 20.0]))
    full = brush_forces(PARABOLA, PLAIN, np.radians([0.0, 3.0, 20.0]))
    np.testing.assert_array_equal(found.adhesion, full.adhesion)
    assert float(found.Fy[2]) == pytest.approx(-0.7 * LOAD)
    assert abs(found.Fy[1]) < abs(full.Fy[1])


class TestCarcass:
    soft = BrushParameters(
        CPY, MU, longitudinal_stiffness=1.3 * CPY, carcass=Carcass(1.2e5, 4e3, 4e3)
    )

    @given(profile=profiles, alpha=angles, kappa=ratios)
    def test_balance_holds_at_the_belt_shape(self, profile, alpha: float, kappa: float) -> None:
        """The belt's shape from the forces, put in as a slip, returns these forces."""
        carcass = Carcass(yaw=4e3, bend=4e3)
        p = BrushParameters(CPY, MU, carcass=carcass)
        found = brush_forces(profile, p, alpha)
        rigid = brush_forces(
            profile,
            PLAIN,
            np.arctan(np.tan(alpha) - found.Mz / 4e3),
            curvature=-found.Fy / 4e3,
        )
        assert float(rigid.Fy) == pytest.approx(float(found.Fy), abs=1e-6 * LOAD)
        del kappa

    @pytest.mark.parametrize("part", ["yaw", "bend"])
    def test_softer_carcass_lowers_the_cornering_stiffness(self, part: str) -> None:
        force = [
            abs(float(brush_forces(PARABOLA, BrushParameters(CPY, MU, carcass=c), 0.002).Fy))
            for c in (Carcass(), Carcass(**{part: 2e4}), Carcass(**{part: 5e3}))
        ]
        assert force[0] > force[1] > force[2]

    def test_yaw_compliance_is_a_series_spring(self) -> None:
        """Small slip: Mz = C a/3 (alpha - Mz/C_yaw), solved by hand."""
        p = BrushParameters(CPY, MU, carcass=Carcass(yaw=4e3))
        rate = STIFFNESS * A / 3
        effective = 1e-6 / (1.0 + rate / 4e3)
        found = brush_forces(PARABOLA, p, 1e-6)
        assert float(found.Mz) == pytest.approx(rate * effective, rel=1e-4)
        assert float(found.Fy) == pytest.approx(-STIFFNESS * effective, rel=1e-4)

    def test_bending_compliance_by_hand(self) -> None:
        """Small slip: Fy = -C alpha - c (Fy / C_bend) 2 a^3 / 3 about the middle."""
        p = BrushParameters(CPY, MU, carcass=Carcass(bend=5e3))
        expected = -STIFFNESS * 1e-6 / (1.0 + CPY * 2 * A**3 / (3 * 5e3))
        assert float(brush_forces(PARABOLA, p, 1e-6).Fy) == pytest.approx(expected, rel=1e-4)

    def test_lateral_shift_gives_the_longitudinal_force_an_arm(self) -> None:
        p = BrushParameters(CPY, MU, carcass=Carcass(lateral=1e5))
        found = brush_forces(PARABOLA, p, 0.05, -0.05)
        rigid = brush_forces(PARABOLA, PLAIN, 0.05, -0.05)
        arm = float(found.Fy) / 1e5
        assert float(found.Fy) == float(rigid.Fy)
        assert float(found.Mz - rigid.Mz) == pytest.approx(-arm * float(found.Fx), rel=1e-12)

    @given(alpha=angles, kappa=ratios)
    def test_mirror_symmetry(self, alpha: float, kappa: float) -> None:
        one, two = (brush_forces(PARABOLA, self.soft, s * alpha, kappa) for s in (1.0, -1.0))
        assert float(one.Fy) == pytest.approx(-float(two.Fy), abs=1e-5)
        assert float(one.Fx) == pytest.approx(float(two.Fx), abs=1e-5)

    def test_many_points_at_once(self) -> None:
        alpha, kappa = np.meshgrid(np.linspace(-0.3, 0.3, 41), np.linspace(-1.0, 0.5, 31))
        found = brush_forces(PARABOLA, self.soft, alpha, kappa)
        assert found.Fy.shape == (31, 41)
        k = (7, 33)
        one = brush_forces(PARABOLA, self.soft, alpha[k], kappa[k])
        assert float(found.Fy[k]) == pytest.approx(float(one.Fy), abs=1e-6)


def test_path_curvature_is_a_symmetric_thrust() -> None:
    """Half the curvature times c times the integral of a^2 - x^2; no moment."""
    found = brush_forces(PARABOLA, PLAIN, 0.0, curvature=1e-4)
    assert float(found.Fy) == pytest.approx(CPY * 0.5e-4 * 4 * A**3 / 3, rel=1e-12)
    assert float(found.Mz) == pytest.approx(0.0, abs=1e-12)
    much = brush_forces(PARABOLA, PLAIN, 0.0, curvature=-50.0)
    assert float(much.Fy) == pytest.approx(-MU * LOAD)


def test_everything_broadcasts_over_operating_points() -> None:
    load = np.array([2000.0, 4000.0, 6000.0])
    half = np.array([0.045, 0.06, 0.075])
    mu = np.array([[0.9], [0.5]])
    c = bristle_stiffness(15.0 * load, half)
    found = brush_forces(parabola(load, -half, half), BrushParameters(c, mu), 0.06)
    assert found.Fy.shape == (2, 3)
    np.testing.assert_allclose(found.Fy, lateral_force(0.06, c, mu, load, half), rtol=1e-12)


def test_ten_thousand_points_in_one_call() -> None:
    alpha = np.linspace(-0.2, 0.2, 10_000)
    found = brush_forces(parabola(np.full(10_000, LOAD), -A, A), PLAIN, alpha)
    np.testing.assert_allclose(found.Fy, lateral_force(alpha, CPY, MU, LOAD, A), atol=1e-7)


def test_no_slip_no_force_and_no_trail() -> None:
    found = brush_forces(PARABOLA, PLAIN, 0.0)
    assert float(found.Fy) == 0.0
    assert float(found.adhesion) == 1.0
    assert np.isnan(found.trail)


@pytest.mark.parametrize(
    ("alpha", "kappa", "message"),
    [(3.0, 0.0, "in radians"), (np.nan, 0.0, "slip angle"), (0.0, -1.1, "-1 is a locked wheel")],
)
def test_bad_slips_are_refused(alpha: float, kappa: float, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        brush_forces(PARABOLA, PLAIN, alpha, kappa)


def test_bad_parameters_are_refused() -> None:
    with pytest.raises(ParameterError, match="lateral_stiffness = 0"):
        BrushParameters(0.0, MU)
    with pytest.raises(ParameterError, match="friction = -1"):
        BrushParameters(CPY, -1.0)
    with pytest.raises(ParameterError, match="sliding_friction exceeds friction"):
        BrushParameters(CPY, 0.5, sliding_friction=0.6)
    with pytest.raises(ParameterError, match="carcass yaw stiffness = -5"):
        Carcass(yaw=-5.0)
    with pytest.raises(ParameterError, match="curvature is not finite"):
        brush_forces(PARABOLA, PLAIN, 0.0, curvature=np.inf)
    with pytest.raises(ShapeError, match="do not broadcast"):
        brush_forces(PARABOLA, PLAIN, np.zeros(2), np.zeros(3))


def test_a_belt_too_soft_for_any_balance_is_told_with_numbers() -> None:
    """At 3 deg the middle bristle turns over before the forces agree; at 0.5 and 10 deg not.

    What is left of the equations is no rounding: 1 % of mu Fz and more.
    """
    soft = BrushParameters(
        lateral_stiffness=8e6, friction=0.9, carcass=Carcass(lateral=1e5, yaw=8e3, bend=200.0)
    )
    profile = parabola(4000.0, -0.06, 0.06)
    assert np.isfinite(brush_forces(profile, soft, np.radians([0.5, 10.0, 60.0])).Fy).all()
    with pytest.raises(ConvergenceError, match=r"1 of 3 .*\(number 1\).*carcass\.bend") as caught:
        brush_forces(profile, soft, np.radians([0.5, 3.0, 10.0]))
    force, moment = caught.value.iterate
    assert force.shape == moment.shape == (3,)
    assert 0.01 < caught.value.residual < 1.0
