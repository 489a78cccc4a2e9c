"""Limits of the continuum: a textbook ring, its modes, and a membrane arch."""

from dataclasses import replace

import numpy as np
import pytest
from continuum.elements import fields, line_work
from continuum.polar import radial, tangential
from continuum.sidewall import Arch, at, law, solve_arch
from continuum.solve import Model, model
from continuum.tire import SHARE, Tire

from tests.continuum.rolling import hanging

PRESSURE = 2.1e5
BARE = replace(
    Tire(),
    tread_thickness=1e-3,
    tread_upright=1e6,
    tread_shear=3e5,
    tread_along=3e4,
    liner_modulus=2e6,
    crown_curvature=0.0,
    shoulder_share=0.0,
    tread_density=1.0,
)
"""A belt, and next to nothing on it."""


def ring_compliance(
    tire: Tire, k_u: float, k_v: float, tension: float, push: float, n: int
) -> np.ndarray:
    """Displacements (u, v) of a ring under a radial load cos(n phi) of 1 N/m, inflated.

    Timoshenko's ring, u = U cos, v = V sin, psi = Psi sin (n phi): strain (U + n V)/R, shear
    (-n U - V)/R - Psi, bending n Psi / R, tension T on the slope (-n U - V)/R, and a pressure p b
    that follows: - p b/R (U^2 + V^2 + 2 n U V) / 2.
    """
    r, ring = tire.ring_radius, tire.section
    forms = (
        (ring["EA"], np.array([1.0, n, 0.0]) / r),
        (ring["GA"], np.array([-n / r, -1.0 / r, -1.0])),
        (ring["EI"], np.array([0.0, 0.0, n / r])),
        (tension, np.array([-n, -1.0, 0.0]) / r),
    )
    stiff = sum(k * np.outer(f, f) for k, f in forms)
    stiff += np.diag([k_u, 0.0, 0.0])
    inner = np.array([0.0, 1.0, 0.5 * tire.belt_thickness])  # the sidewalls hold the inner face
    stiff += k_v * np.outer(inner, inner)
    stiff -= push / r * np.array([[1.0, n, 0.0], [n, 1.0, 0.0], [0.0, 0.0, 0.0]])
    return np.linalg.solve(stiff, [1.0, 0.0, 0.0])[:2]


def continuum_compliance(tire_model: Model, pressure: float, n: int) -> tuple[np.ndarray, float]:
    """Return the same of the finite elements at the belt's middle, and twice its energy."""
    b = hanging(tire_model, pressure, 0.0)
    radius, width = tire_model.tire.ring_radius, b.mesh.of_strip(SHARE, b.mesh.carcass)
    right = np.zeros(b.mesh.add.size)
    for line in (b.mesh.carcass, b.mesh.back):
        push = 0.5 * np.cos(n * line.phi)[..., None] * radial(line.phi)
        part = -line_work(line, line.weight * radius * width, push)[0]
        unknown = np.stack([2 * line.dofs, 2 * line.dofs + 1], axis=-1).reshape(part.shape)
        right += np.bincount(unknown.ravel(), part.ravel(), len(right))
    moved = b.factor.solve(right)
    found = np.zeros(2)
    for line in (b.mesh.carcass, b.mesh.back):
        own = fields(line, moved.reshape(-1, 2))[0]
        for i, (way, wave) in enumerate(
            ((radial(line.phi), np.cos), (tangential(line.phi), np.sin))
        ):
            part = np.sum(own * way, axis=-1) * wave(n * line.phi) * line.weight * width
            found[i] += 0.5 * float(np.sum(part)) / np.pi
    return found, float(right @ moved)


@pytest.mark.parametrize(
    ("stiffer", "allowed"),
    [({}, 0.015), ({"extension": 4.6e8, "bending": 220.0, "shear": 7e8}, 0.01)],
    ids=["stretches and shears", "inextensible, rigid in shear"],
)
def test_bare_belt_is_the_textbook_ring(stiffer: dict[str, float], allowed: float) -> None:
    tire = replace(BARE, **stiffer)
    m = model(tire)
    # the order of h / R is 0.8 %, and the beam's shear factor 5/6 adds 0.3 % at n = 12
    k_u, k_v = at(m.law.radial, 0.0), at(m.law.tangential, 0.0)
    for n in (2, 3, 5, 8, 12):
        theory = ring_compliance(tire, k_u, k_v, 0.0, 0.0, n)
        assert continuum_compliance(m, 0.0, n)[0] == pytest.approx(theory, rel=allowed)


def test_inflation_stiffens_as_tension_does() -> None:
    m = model(BARE)
    k_u, k_v = at(m.law.radial, PRESSURE), at(m.law.tangential, PRESSURE)
    b = hanging(m, PRESSURE, 0.0)
    line = b.mesh.carcass
    growth = float(np.sum(fields(line, b.u)[0] * radial(line.phi), axis=-1).mean())
    inner = b.mesh.gage.radius[0, 0]
    push = PRESSURE * BARE.belt_width
    tension = push * inner + BARE.ring_radius * (at(m.law.pull, PRESSURE) - k_u * growth)
    for n in (2, 3, 5, 8, 12):
        theory = ring_compliance(BARE, k_u, k_v, tension, push, n)
        assert continuum_compliance(m, PRESSURE, n)[0] == pytest.approx(theory, rel=0.02)


def test_a_mode_has_the_ring_s_frequency() -> None:
    # Rayleigh's quotient of the deflection, whose energy the elements know; textbook, inextensible:
    # omega^2 = (EI (n^2 - 1)^2 / R^4 + k_u + k_v / n^2) / (m (1 + 1 / n^2))
    tire = replace(BARE, extension=4.6e8, bending=220.0, shear=7e8)
    m, n = model(tire), 3
    (u, v), energy = continuum_compliance(m, 0.0, n)
    mass, radius = tire.section["mass"], tire.ring_radius
    squared = energy / (mass * np.pi * radius * (u**2 + v**2))
    k_u, k_v = at(m.law.radial, 0.0), at(m.law.tangential, 0.0)
    bend = tire.section["EI"] * (n**2 - 1) ** 2 / radius**4
    theory = (bend + k_u + k_v / n**2) / (mass * (1.0 + 1.0 / n**2))
    assert np.sqrt(squared) == pytest.approx(np.sqrt(theory), rel=0.01)


def test_ply_of_an_arch_carries_pressure_times_radius() -> None:
    arch = replace(Arch(), ply=5e6, along=2e5, shear=5e4)
    tension = solve_arch(arch)[1]
    pressures = np.array([0.4e5, 1.2e5, 2.0e5, 2.8e5, 3.6e5])
    np.testing.assert_allclose(tension, pressures * arch.radius, rtol=0.02)


def test_sidewall_law_is_stiffer_with_pressure_and_softer_when_pressed() -> None:
    told = law(Arch())
    assert told.radial[1] > 0.0
    assert told.tangential[1] > 0.0
    assert told.misfit < 0.02
    _, slope = told.force(np.array([-0.02, 0.0]), 2e5, 1.0)
    assert -slope[0] < -slope[1]
    linear = told.force(np.array([-0.02, 0.0]), 2e5, 0.0)[1]
    assert linear[0] == linear[1]
