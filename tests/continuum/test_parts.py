"""Parts of the rolling continuum by themselves: rubber, crown, carried mass."""

from dataclasses import replace

import numpy as np
import pytest
from continuum.balance import carried_part, tie_part
from continuum.material import rubber, stress
from continuum.polar import radial, tangential
from continuum.sidewall import at
from continuum.tire import SHARE
from hypothesis import given
from hypothesis import strategies as st

from tests.continuum.rolling import COND, TIRE, plain

EYE = np.eye(2)


def moduli(c_rr: float = 4e6, shear: float = 1e6, along: float = 1e6) -> np.ndarray:
    r = rubber(c_rr, shear, along, 0.0)
    return np.array([r.shear, r.lame, r.cords])


@given(turn=st.floats(-3.0, 3.0), seed=st.integers(0, 1000))
def test_a_turn_turns_the_stress_and_makes_none(turn: float, seed: int) -> None:
    q = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    grad = 0.1 * np.random.default_rng(seed).standard_normal((2, 2))
    p = stress(moduli(), EYE, grad)[0]
    turned = stress(moduli(), EYE, q @ (EYE + grad) - EYE)[0]
    np.testing.assert_allclose(turned, q @ p, atol=1e-3)
    assert np.abs(stress(moduli(), EYE, q - EYE)[0]).max() < 1e-3


def test_small_strains_show_the_wanted_moduli() -> None:
    c_rr, shear, along, e = 4.2e6, 1.1e6, 1.2e6, 1e-6
    a = stress(moduli(c_rr, shear, along), EYE, np.zeros((2, 2)))[1]
    assert a[1, 1, 1, 1] == pytest.approx(c_rr)
    assert a[0, 1, 0, 1] == pytest.approx(shear)
    # free across: the strain across that makes no stress across
    across = -a[1, 1, 0, 0] / a[1, 1, 1, 1] * e
    p = stress(moduli(c_rr, shear, along), EYE, np.diag([e, across]))[0]
    assert p[1, 1] == pytest.approx(0.0, abs=1e-5)
    assert p[0, 0] / e == pytest.approx(along, rel=1e-4)


def test_pressed_rubber_hardens() -> None:
    depths = np.array([0.0, -0.1, -0.2])
    stiff = [stress(moduli(), EYE, np.diag([0.0, d]))[1][1, 1, 1, 1] for d in depths]
    assert stiff[0] < stiff[1] < stiff[2]


def strip_motion(heights: np.ndarray, way: str) -> np.ndarray:
    nodes = plain().mesh.nodes
    direction = radial(nodes[:, 0]) if way == "out" else tangential(nodes[:, 0])
    return heights[nodes[:, 2].astype(int), None] * direction


def test_the_crown_resists_as_a_strip_of_plate_under_tension() -> None:
    mesh, law = plain().mesh, plain().law
    height = np.array([0.3e-3, -0.2e-3, 0.9e-3])
    whole, step = height[[2, 1, 0, 1, 2]], 0.03
    tension = at(law.tension, COND.pressure)
    around = 2.0 * np.pi * TIRE.ring_radius

    def energy(way: str) -> float:
        u = strip_motion(height, way)
        force, _ = tie_part(TIRE, law, COND, mesh, u)
        return 0.5 * float(np.sum(force * u[mesh.tied].reshape(len(force), -1)))

    slopes, bends = np.diff(whole) / step, np.diff(whole, 2) / step**2
    plate = tension * np.sum(slopes**2) + TIRE.crown_bending * np.sum(bends**2)
    assert energy("out") == pytest.approx(0.5 * around * step * plate, rel=1e-4)
    sheared = TIRE.crown_shear * np.sum(slopes**2)
    assert energy("along") == pytest.approx(0.5 * around * step * sheared, rel=1e-4)


def test_carried_mass_pulls_outward_and_turns_with_the_section() -> None:
    mesh, omega = plain().mesh, 70.0
    carried = [TIRE.carried(i) for i in range(3)]
    dofs = np.concatenate([mesh.back.dofs, mesh.carcass.dofs], axis=1)

    def work(tire_u: np.ndarray, test: np.ndarray) -> float:
        force, _ = carried_part(TIRE, mesh, tire_u, omega)
        return float(np.sum(force * test[dofs].reshape(len(force), -1)))

    nothing = np.zeros((mesh.n, 2))
    out = radial(mesh.nodes[:, 0])
    pull = sum(
        share * mass * (TIRE.ring_radius + height)
        for share, (mass, height) in zip(SHARE, carried, strict=True)
    )
    around = 2.0 * np.pi * TIRE.ring_radius * omega**2
    assert work(nothing, out) == pytest.approx(-around * pull, rel=1e-4)
    # sections that turn by cos(3 phi): points at the height h swing by it, and carry m h^2
    swing = np.cos(3.0 * mesh.nodes[:, 0]) * (mesh.nodes[:, 1] - TIRE.ring_radius)
    u = 1e-3 * swing[:, None] * tangential(mesh.nodes[:, 0])
    inertia = sum(
        share * mass * height**2 for share, (mass, height) in zip(SHARE, carried, strict=True)
    )
    # x_phi of a tangential wave s e_t is s' e_t - s e_r
    mean = 0.5 * (3.0**2 + 1.0)
    moved = work(u, u) - work(nothing, u)
    assert moved == pytest.approx(-around * inertia * mean * 1e-6, rel=2e-3)


def test_carried_mass_does_not_feel_the_stretch_of_the_layer() -> None:
    # if it did, its lever would make short waves of the belt's thickness unstable at 125 km/h
    mesh, u = plain().mesh, np.zeros((plain().mesh.n, 2))
    for line, way in ((mesh.back, 1.0), (mesh.carcass, -1.0)):
        phi = mesh.nodes[line.dofs, 0]
        u[line.dofs] = 1e-5 * way * np.cos(40.0 * phi)[..., None] * radial(phi)
    dofs = np.concatenate([mesh.back.dofs, mesh.carcass.dofs], axis=1)
    still = carried_part(TIRE, mesh, np.zeros_like(u), 120.0)[0]
    moved = carried_part(TIRE, mesh, u, 120.0)[0] - still
    work = float(np.sum(moved * u[dofs].reshape(len(moved), -1)))
    # of the mass itself, moved by as much
    whole = sum(share * TIRE.carried(i)[0] for i, share in enumerate(SHARE))
    scale = whole * TIRE.ring_radius * np.pi * (120.0 * 40.0 * 1e-5) ** 2
    # what is left is the turn of e_r within the large elements at the top; with a lever, 23 scale
    assert abs(work) < 0.1 * scale


def test_an_innerliner_inside_the_belt_is_refused() -> None:
    with pytest.raises(ValueError, match=r"innerliner_offset = -1 mm; the belt of 2.4 mm"):
        replace(TIRE, innerliner_offset=-1e-3)
