"""Common parts of effects in the contact: its own coordinate, traction, and a second solution."""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects.state import State
from tirelib.physics.contact.fourier import load_harmonics
from tirelib.physics.contact.radial import RadialContact, load
from tirelib.physics.ring.ring import ComplexArray


def along(contact: RadialContact) -> FloatArray:
    """Return where the nodes lie in the patch, -1 leading edge to 1 trailing edge."""
    middle, half = contact.edges.mean(axis=1), 0.5 * np.diff(contact.edges, axis=1)
    out: FloatArray = (contact.phi - middle[:, None]) / half
    return out


def balanced(contact: RadialContact, traction: FloatArray) -> FloatArray:
    """Return a traction [N/m] at the nodes with its resultant taken off as the pressure is."""
    rest = np.sum(contact.weights * traction, axis=1)
    whole = np.sum(contact.weights * contact.pressure, axis=1)
    out: FloatArray = traction - (rest / whole)[:, None] * contact.pressure
    return out


def beam_strain(state: State, traction: FloatArray) -> ComplexArray:
    r"""Return harmonics of the innerliner's strain that traction on the flat piece adds.

    The straight beam of `tirelib.physics.strain.tread_traction` without restraint: N_n = -R tau_n /
    (i n),

    .. math:: \varepsilon_n = N_n\left(\frac1{EA} + \frac{y\,(R_0 - R)}{EI}\right).

    Parameters
    ----------
    state : State
    traction : shape (n_points, n_nodes), [N/m]
        Along +phi on the tire, without resultant.
    """
    contact = state.contact
    n = np.arange(state.strain.shape[1])
    tau = load_harmonics(contact.phi, contact.weights * traction, n[-1])
    axial = 1j * state.radius[:, None] * tau / np.maximum(n, 1) * (n > 0)
    lever = state.free_radius - state.radius
    out: ComplexArray = axial * (1.0 / state.EA + state.offset * lever / state.EI)[:, None]
    return out


def pressed_again(state: State, loads: ComplexArray, lift: float | FloatArray = 0.0) -> State:
    """Return the state with the contact solved under further line loads.

    Parameters
    ----------
    state : State
    loads : shape (n_points, n_modes + 1, 3), [N/m]
        Harmonics of (q_u outward, q_v, q_beta).
    lift : shape (n_points,), [N]
        Part of the vertical load that they carry and the tread's springs do not.
    """
    if not np.any(loads):
        return state
    old = state.contact
    extra = loads if old.extra is None else old.extra + loads
    contact = load(
        old.compliance,
        old.tread,
        old.load - lift,
        extra=extra,
        n_nodes=old.phi.shape[1],
        start=old.start,
    )
    return state.but(contact=contact, belt=contact.displacement, deflection=contact.deflection)


def held_shear(state: State) -> FloatArray:
    """Return the outward shear [N/m] of a tread that sticks up to full friction, at the nodes.

    sgn(x) min(k_Gt g |x|, q) with g = (R0 - R) / R and k_Gt = k_t / 3, for rubber keeps its volume.
    """
    c = state.contact
    x = state.radius[:, None] * (c.phi - c.edges.mean(axis=1)[:, None])
    grip = state.k_t / 3.0 * (state.free_radius / state.radius - 1.0)
    shear: FloatArray = np.sign(x) * np.minimum(grip[:, None] * np.abs(x), c.pressure)
    return shear


def sheared(state: State, traction: FloatArray) -> State:
    """Return the state with traction [N/m] on the tread along +phi, at the contact's nodes.

    Line loads q_v and q_beta = (R0 - R) q_v: the belt is pulled and its sections are turned.
    """
    c = state.contact
    loads = np.zeros_like(state.belt)
    loads[..., 1] = load_harmonics(c.phi, c.weights * traction, state.belt.shape[1] - 1)
    loads[..., 2] = (state.free_radius - state.radius)[:, None] * loads[..., 1]
    return pressed_again(state, loads)


def inward(state: State, phi: FloatArray, force: FloatArray) -> ComplexArray:
    """Return harmonics of inward point loads [N/m rad] at phi, both (n_points, n_nodes)."""
    loads: ComplexArray = np.zeros_like(state.belt)
    loads[..., 0] = -load_harmonics(phi, force, state.belt.shape[1] - 1)
    return loads
