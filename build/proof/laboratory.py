"""What a laboratory would measure on a rig tire, from the rig's own equations.

Press, modal test, sidewall test, tread block and belt growth are done on the equations that the rig
solves (`tirelib.rig.belt`, `tirelib.rig.tread`, `tirelib.rig.solve`); the tire's constants are only
read to compare with.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize

from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.frequencies import sidewall_stiffness
from tirelib.physics.ring.frequency_fit import fit_stiffness
from tirelib.physics.ring.ring import Ring
from tirelib.rig.belt import FIELDS, LATERAL, PSI, U, V, internal
from tirelib.rig.solve import inflated, solve
from tirelib.rig.tire import N_STRIPS, Array, Condition, RigTire
from tirelib.rig.tread import pressure as tread_pressure

ORDERS = tuple(range(1, 9))
PRESSURES = (1.7e5, 2.1e5, 2.5e5)
CREEP = 0.5
"""Speed of the press: slow rolling, [m/s]."""
SHIFT, TURN = 1e-4, 3e-4
PRESSURE_STEP = 5e3
"""Change of pressure for slopes, [Pa]."""


@dataclass(frozen=True)
class Laboratory:
    """Values of the laboratory, by name of `tirelib.core.parameters.Tire`, and their sources.

    Attributes
    ----------
    values : dict
        SI, at the pressure asked for.
    modal : dict
        The same from the modal test alone.
    """

    values: dict[str, float]
    modal: dict[str, float]


def laboratory(tire: RigTire, pressure: float) -> Laboratory:
    """Do all tests but the press at a pressure [Pa]."""
    k_u, k_v = sidewall_test(tire, pressure)
    above = sidewall_test(tire, pressure + PRESSURE_STEP)
    below = sidewall_test(tire, pressure - PRESSURE_STEP)
    modal = modal_test(tire, pressure)
    values = {
        "bending_stiffness": modal["bending_stiffness"],
        "radial_stiffness": k_u,
        "radial_pressure_slope": (above[0] - below[0]) / (2.0 * PRESSURE_STEP),
        "tangential_stiffness": k_v,
        "tangential_pressure_slope": (above[1] - below[1]) / (2.0 * PRESSURE_STEP),
        "tread_stiffness": tread_test(tire, pressure),
        "innerliner_offset": tire.innerliner_offset,  # a cut section
        "extension_stiffness": growth_test(tire, pressure),
    }
    return Laboratory(values, modal)


def press(tire: RigTire, pressure: float, load: float) -> float:
    """Return the slope of load over deflection of the slowly rolling tire, [N/m]."""
    return solve(tire, Condition(load, pressure, CREEP)).stiffness


def sidewall_test(tire: RigTire, pressure: float) -> tuple[float, float]:
    """Return k_u, k_v from shift and turn of the rim against the held belt, Eq. (112).

    The belt moves rigidly against the rim instead, by as much the other way; the belt itself does
    not strain, so that the force is the sidewall's.
    """
    phi, weight = _round()
    radius = tire.ring_radius
    grown = inflated(tire, pressure, 0.0)

    def force(motion: Array) -> Array:
        return _residual(tire, pressure, grown, motion) - _residual(
            tire, pressure, grown, 0.0 * motion
        )

    shift = np.zeros((phi.size, 2 * FIELDS))
    cos, sin = np.cos(phi)[:, None], np.sin(phi)[:, None]
    shift[:, U], shift[:, V] = SHIFT * cos, -SHIFT * sin
    shift[:, FIELDS + U], shift[:, FIELDS + V] = -SHIFT * sin, -SHIFT * cos
    work = np.sum(force(shift) * shift, axis=1) @ weight
    turn = np.zeros((phi.size, 2 * FIELDS))
    arm = radius + grown
    turn[:, U], turn[:, V] = arm * (np.cos(TURN) - 1.0), arm * np.sin(TURN)
    turn[:, PSI] = TURN
    virtual = np.zeros_like(turn)
    virtual[:, U], virtual[:, V], virtual[:, PSI] = -arm * np.sin(TURN), arm * np.cos(TURN), 1.0
    moment = np.sum(force(turn) * virtual, axis=1) @ weight
    # the sidewall's constants refer to the radius of the ring that is not inflated
    s_v, s_theta = work / SHIFT**2, moment / TURN * (radius / arm) ** 2
    k_u, k_v = sidewall_stiffness(radius, s_v, s_theta)
    return float(k_u), float(k_v)


def modal_test(tire: RigTire, pressure: float) -> dict[str, float]:
    """Return EI, k_u, k_v from the in-plane frequencies of the free tire at three pressures.

    Least squares with an extensible ring, EA and growth u from the growth test. The sidewalls of
    the grown belt take k_u u off the inflation, 1 % of the belt's tension: Eq. (109), which leaves
    that out, comes out with some 10 % less EI (`bending_plain`). Shear of the belt stays in.
    """
    omega = np.concatenate([frequencies(tire, p) for p in PRESSURES])
    fit = fit_stiffness(
        np.tile(ORDERS, len(PRESSURES)),
        omega,
        np.repeat(PRESSURES, len(ORDERS)),
        ring_radius=tire.ring_radius,
        belt_width=tire.belt_width,
        mass=tire.mass,
    )
    plain = fit.value
    extension = growth_test(tire, pressure)

    def error(z: Array) -> Array:
        return np.asarray(ring_frequencies(tire, plain * np.exp(z), extension) / omega - 1.0)

    found = plain * np.exp(optimize.least_squares(error, np.zeros(5)).x)
    return {
        "bending_stiffness": float(found[0]),
        "radial_stiffness": float(found[1] + found[2] * pressure),
        "tangential_stiffness": float(found[3] + found[4] * pressure),
        "bending_plain": float(plain[0]),
    }


def ring_frequencies(tire: RigTire, stiffness: Array, extension: float) -> Array:
    """Return the frequencies of `ORDERS` at `PRESSURES` of an extensible ring, [rad/s].

    `stiffness` holds EI, offset and slope of k_u, and of k_v.
    """
    p = np.array(PRESSURES)
    one = np.ones(p.size)
    growth = np.array([inflated(tire, pressure, 0.0) for pressure in PRESSURES])
    k_u = stiffness[1] + stiffness[2] * p
    ring = Ring(
        radius=tire.ring_radius * one,
        bending_stiffness=stiffness[0] * one,
        mass=tire.mass * one,
        inflation=p * tire.belt_width,
        tension=growth * (p * tire.belt_width - k_u * tire.ring_radius),
        radial_stiffness=k_u,
        tangential_stiffness=stiffness[3] + stiffness[4] * p,
        damping=0.0 * one,
        extension_stiffness=extension * one,
        shear_stiffness=np.inf * one,
    )
    flexible = compliance(ring, 0.0, ORDERS[-1]).matrix[:, ORDERS[0] :, :2, :2]
    softest = np.linalg.eigvalsh(0.5 * (flexible + flexible.conj().swapaxes(2, 3)))[..., -1]
    return np.asarray(np.sqrt(1.0 / (softest * tire.mass))).ravel()


def frequencies(tire: RigTire, pressure: float) -> Array:
    """Return natural frequencies of `ORDERS`, [rad/s], lowest in-plane mode that all strips share.

    The inflated belt is the same all round, so a harmonic of order n sees one matrix of 16 fields.
    """
    z = np.zeros((1, 2 * FIELDS))
    z[:, U] = inflated(tire, pressure, 0.0)
    tangent = internal(tire, Condition(1000.0, pressure, 1.0), 0.0, z)[1][0]
    k00, k01 = tangent[:FIELDS, :FIELDS], tangent[:FIELDS, FIELDS:]
    k10, k11 = tangent[FIELDS:, :FIELDS], tangent[FIELDS:, FIELDS:]
    mass = np.full(FIELDS, tire.mass / N_STRIPS * tire.ring_radius)
    mass[LATERAL] = tire.mass * tire.ring_radius
    heavy = np.setdiff1d(np.arange(FIELDS), PSI)
    out = []
    for n in ORDERS:
        stiff = k00 + 1j * n * k01 - 1j * n * k10 + n**2 * k11
        # sections have no inertia of their own: they follow
        follow = np.linalg.solve(stiff[np.ix_(PSI, PSI)], stiff[np.ix_(PSI, heavy)])
        whole = stiff[np.ix_(heavy, heavy)] - stiff[np.ix_(heavy, PSI)] @ follow
        square, shape = linalg.eigh(0.5 * (whole + whole.conj().T), np.diag(mass[heavy]))
        motion = np.zeros((FIELDS, heavy.size), dtype=complex)
        motion[heavy] = shape
        shared = abs(motion[U].mean(axis=0)) ** 2 + abs(motion[V].mean(axis=0)) ** 2
        total = (abs(motion) ** 2).sum(axis=0)
        together = N_STRIPS * shared > 0.5 * total
        out.append(float(np.sqrt(square[together].min())))
    return np.array(out)


def tread_test(tire: RigTire, pressure: float) -> float:
    """Return k_t of a flat block as wide as the belt, pressed to the inflation pressure, Eq. (111).

    Secant stiffness: a hardening tread has no other single number.
    """
    depth = np.linspace(0.0, 0.3 * tire.tread_thickness, 4001)
    pressed = tread_pressure(tire, depth)[0]
    at = float(np.interp(pressure, pressed, depth))
    return pressure / at * tire.belt_width


def growth_test(tire: RigTire, pressure: float) -> float:
    """Return EA from the growth of the free belt with pressure: p b R / EA of its radius."""
    low, high = (
        inflated(tire, pressure - PRESSURE_STEP, 0.0),
        inflated(tire, pressure + PRESSURE_STEP, 0.0),
    )
    pull = 2.0 * PRESSURE_STEP * tire.belt_width
    return tire.ring_radius**2 * pull / (high - low)


def _round() -> tuple[Array, Array]:
    phi = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    return phi, np.full(phi.size, 2.0 * np.pi / phi.size)


def _residual(tire: RigTire, pressure: float, grown: float, motion: Array) -> Array:
    z = motion.copy()
    z[:, U] += grown
    return internal(tire, Condition(1000.0, pressure, 1.0), 0.0, z)[0]
