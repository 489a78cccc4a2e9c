"""Tires and contacts that the tests of the radial contact share."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from scipy.optimize import nnls

from tirelib.core.parameters import Tire, read_tire
from tirelib.physics.contact.radial import RadialContact, press
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import Ring, plain_stiffness

TIRE = read_tire("table-6-1").tire
TREAD = Tread.of(TIRE)


def ring(lam: float = 0.04, omega: float = 59.0, n_modes: int = 60) -> Compliance:
    return compliance(replace(Ring.of(TIRE, TIRE.pressure), damping=lam), omega, n_modes)


@st.composite
def tires(draw: st.DrawFn) -> Tire:
    """Tires around all those of the dissertation's tables."""
    tread = draw(st.floats(0.006, 0.02))
    radius = draw(st.floats(0.25, 0.4))
    return TIRE.changed(
        ring_radius=radius,
        free_radius=radius + tread,
        tread_thickness=tread,
        bending_stiffness=draw(st.floats(0.7, 6.0)),
        radial_stiffness=draw(st.floats(2e5, 1.5e6)),
        tangential_stiffness=draw(st.floats(0.0, 5e5)),
        tread_stiffness=draw(st.floats(3e7, 1.5e8)),
        tread_hardening=draw(st.sampled_from([0.0, 2.0])),
        damping=draw(st.floats(0.0, 0.12)),
    )


@st.composite
def contacts(draw: st.DrawFn) -> RadialContact:
    tire = draw(tires())
    pressure = draw(st.floats(1.0e5, 3.0e5))
    omega = draw(st.floats(0.0, 120.0))
    share = draw(st.floats(0.015, 0.13))
    return press(
        compliance(Ring.of(tire, pressure), omega, 60), Tread.of(tire), share * tire.free_radius
    )


def on_a_grid(lam: float, d0: float, size: int) -> tuple[float, np.ndarray]:
    phi = np.linspace(-0.5, 0.5, size)
    h = phi[1] - phi[0]
    amplitude, lag, n = printed_response(lam, 60)
    apart = phi[:, None] - phi[None, :]
    give = sum(a * np.cos(k * apart - g) for a, g, k in zip(amplitude, lag, n, strict=True)) * h
    matrix = give + np.eye(size) / TIRE.tread_stiffness
    known = d0 - TIRE.free_radius * (1 - np.cos(phi))
    if lam == 0.0:  # least squares with q >= 0 has the same conditions
        factor = np.linalg.cholesky(matrix).T
        q = nnls(factor, np.linalg.solve(factor.T, known))[0]
    else:  # active sets, until none changes
        active, before = known > 0, None
        while before is None or (active != before).any():
            before = active
            q = np.zeros(size)
            q[active] = np.linalg.solve(matrix[np.ix_(active, active)], known[active])
            active = np.where(active, q > 0, known - matrix @ q > 0)
    pressed = phi[q > 0]
    fz = TIRE.ring_radius * h * (q * np.cos(phi)).sum()
    return fz, np.array([pressed[0] - h / 2, pressed[-1] + h / 2])


def printed_response(lam: float, n_modes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """n^2 A_n, n gamma_n and n of Eq. (89) at 59 rad/s, for an inward load (negative A'_n)."""
    n = np.arange(1.0, n_modes + 1)
    k = plain_stiffness(Ring.of(TIRE, TIRE.pressure), n_modes)[0, 1:]
    c = 59.0 * n * 2 * lam * np.sqrt(TIRE.mass * (1 + n**2) * k)
    return n**2 / (np.pi * np.hypot(k, c)), np.arctan2(c, k), n
