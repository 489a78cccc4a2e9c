"""What effects in the contact share: its own coordinate, traction, and a second solution."""

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.contact.fourier import load_harmonics
from tirelib.contact.radial import RadialContact, load
from tirelib.effects.effect import State
from tirelib.ring.ring import ComplexArray


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

    The straight beam of `tirelib.strain.tread_traction` without restraint: N_n = -R tau_n / (i n),

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
        old.compliance, old.tread, old.load - lift, extra=extra, n_nodes=old.phi.shape[1]
    )
    return state.but(contact=contact, belt=contact.displacement, deflection=contact.deflection)


def inward(state: State, phi: FloatArray, force: FloatArray) -> ComplexArray:
    """Return harmonics of inward point loads [N/m rad] at phi, both (n_points, n_nodes)."""
    loads: ComplexArray = np.zeros_like(state.belt)
    loads[..., 0] = -load_harmonics(phi, force, state.belt.shape[1] - 1)
    return loads
