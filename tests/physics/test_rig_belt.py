"""Laws of the rig's belt that need no contact: rigid motion, inflation, rotation, convergence."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.rig.belt import (
    FIELDS,
    LATERAL,
    PSI,
    SIZE,
    U,
    V,
    innerliner_strain,
    internal,
    linear_part,
)
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import forces, trace
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import Condition, RigTire

TIRE = RigTire()
REST = Condition(4000.0, 1e-9, 1.0)


def fields(u: np.ndarray, v: np.ndarray, psi: float, du: np.ndarray, dv: np.ndarray) -> np.ndarray:
    z = np.zeros((len(u), SIZE))
    z[:, U], z[:, V], z[:, PSI] = u[:, None], v[:, None], psi
    z[:, FIELDS + U], z[:, FIELDS + V] = du[:, None], dv[:, None]
    return z


def belt_work(z: np.ndarray) -> np.ndarray:
    """Generalised forces of the belt alone: sidewalls taken off, no pressure, no speed."""
    return internal(TIRE, REST, 0.0, z)[0] - z @ linear_part(TIRE, REST, 0.0).T


@given(
    turn=st.floats(-1.5, 1.5),
    x=st.floats(-0.05, 0.05),
    zeta=st.floats(-0.05, 0.05),
    sideways=st.floats(-0.05, 0.05),
)
def test_rigid_motion_strains_nothing(turn: float, x: float, zeta: float, sideways: float) -> None:
    radius, phi = TIRE.ring_radius, np.linspace(-np.pi, np.pi, 37)
    along, out = -x * np.cos(phi) + zeta * np.sin(phi), -x * np.sin(phi) - zeta * np.cos(phi)
    z = fields(
        radius * (np.cos(turn) - 1.0) + out,
        radius * np.sin(turn) + along,
        turn,
        along,
        -out,
    )
    z[:, LATERAL] = sideways
    assert np.abs(innerliner_strain(TIRE, z)).max() < 1e-12
    # against EA = 4.6e6 N
    assert np.abs(belt_work(z)).max() < 1e-5


@given(turn=st.floats(-1.5, 1.5), seed=st.integers(0, 1000))
def test_a_turn_of_the_deformed_belt_changes_no_couple(turn: float, seed: int) -> None:
    radius = TIRE.ring_radius
    z = 0.005 * np.random.default_rng(seed).standard_normal((4, SIZE))
    turned, cos, sin = z.copy(), np.cos(turn), np.sin(turn)
    out, along = radius + z[:, U], z[:, V]
    turned[:, U], turned[:, V] = out * cos - along * sin - radius, out * sin + along * cos
    a, b = z[:, FIELDS + U] - along, out + z[:, FIELDS + V]
    turned[:, FIELDS + U] = a * cos - b * sin + turned[:, V]
    turned[:, FIELDS + V] = a * sin + b * cos - radius - turned[:, U]
    turned[:, PSI] += turn
    couples = np.concatenate([PSI, FIELDS + PSI, [FIELDS + LATERAL]])
    before = belt_work(z)[:, couples]
    np.testing.assert_allclose(
        belt_work(turned)[:, couples], before, atol=1e-9 * np.abs(before).max()
    )


@pytest.mark.parametrize("pressure", [1e5, 2.3e5, 3e5])
@pytest.mark.parametrize("omega", [0.0, 60.0, 140.0])
def test_inflated_spinning_belt_is_the_analytical_ring(pressure: float, omega: float) -> None:
    # per length: EA u/R^2 + k_u u = p b (1 + u/R) + rhoA Omega^2 (R + u)
    radius = TIRE.ring_radius
    load = pressure * TIRE.belt_width + TIRE.mass * omega**2 * radius
    soft = pressure * TIRE.belt_width / radius + TIRE.mass * omega**2
    hard = TIRE.extension / radius**2 + TIRE.radial_stiffness(pressure)
    u = load / (hard - soft)
    z = fields(np.full(3, u), np.zeros(3), 0.0, np.zeros(3), np.zeros(3))
    z[:, FIELDS:] = 0.0
    # strips share the sidewalls unevenly, so only their sum is in this balance
    residual = internal(TIRE, Condition(4000.0, pressure, 20.0), omega, z)[0]
    assert np.abs(residual[:, U].sum(axis=1)).max() < 1e-6 * load * radius
    hoop = innerliner_strain(TIRE, z)
    np.testing.assert_allclose(hoop, u / (radius + TIRE.innerliner_offset), rtol=1e-12)


@cache
def rolling(speed: float, fine: float = 0.009) -> RigState:
    start = None if fine != 0.009 or speed == 18.0 else rolling(18.0)
    # everything scales with `fine`, so that one number describes the mesh
    return solve(TIRE, Condition(4000.0, 2.3e5, speed), start, mesh(fine, 10.0 * fine, 0.42))


def test_hoop_strain_at_the_top_grows_with_speed_squared() -> None:
    speeds = np.array([10.0, 18.0, 30.0, 42.0])
    top = np.array([trace(rolling(float(v)), 8).strain[0, 2] for v in speeds])
    omega2 = np.array([rolling(float(v)).omega for v in speeds]) ** 2
    slope = np.polyfit(omega2, top, 1)[0]
    radius = TIRE.ring_radius
    theory = TIRE.mass * radius / (TIRE.extension / radius**2 + TIRE.radial_stiffness(2.3e5))
    # the contact and the soft sidewalls change the balance at the top a little
    assert slope == pytest.approx(theory / radius, rel=0.05)


def test_strain_and_deflection_converge_with_the_mesh() -> None:
    sizes = (0.036, 0.018, 0.009)
    best = rolling(18.0, 0.006)
    phi = trace(best).strain
    strain_error = [np.abs(trace(rolling(18.0, h)).strain - phi).max() for h in sizes]
    height_error = [abs(rolling(18.0, h).height - best.height) for h in sizes]
    orders = np.log2(np.array(strain_error[:-1]) / np.array(strain_error[1:]))
    assert np.all(orders > 1.5)
    assert strain_error[-1] < 3e-5  # 0.3 % of the contact's 10,000 microstrain
    assert height_error[-1] < 5e-6
    assert height_error[0] > height_error[-1]
    assert forces(best).fz == pytest.approx(4000.0, rel=1e-9)
