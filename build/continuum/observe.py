"""What a solved state shows: strain over the wheel angle, contact edges, forces."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from continuum.elements import fields
from continuum.grid import ZONE
from continuum.polar import Array, tangential
from continuum.solve import State
from continuum.tire import STRIP, STRIPS

POINTS = 3600
"""Points of a trace round the wheel."""
ZIGZAG = 1e-4
"""Alternation of the strain between elements above which a state is refused [1]; 29 of 30
drawn tires stay below 7e-6, one has 6.1e-5. Elements four times as large show more than 3e-5 of
sound waves."""


@dataclass(frozen=True)
class Trace:
    """Hoop strain of the innerliner at the five gages.

    Attributes
    ----------
    phi : shape (n,)
        Wheel angle of the gages, from -pi, 0 under the axle, growing with time [rad].
    strain, by_load : shape (n, 5)
        Stretch along the circumference [1], and its derivative with the load [1/N].
    edges : shape (5, 2)
        Leading and trailing edge of the contact over the gages [rad]; NaN without contact.
    """

    phi: Array
    strain: Array
    by_load: Array
    edges: Array


def hoop_strain(state: State, u: Array) -> Array:
    """Return |F e_t| - 1 at the Gauss points of the innerliner, a row for each strip."""
    line = state.model.mesh.gage
    x_phi = line.radius[..., None] * tangential(line.phi) + fields(line, u)[1]
    stretch = np.linalg.norm(x_phi, axis=-1) / line.radius - 1.0
    return np.asarray(stretch.reshape(len(STRIPS), -1))


def trace(state: State) -> Trace:
    """Return strain at the gages on an even grid of wheel angles.

    Raises
    ------
    ArithmeticError
        If the strain zigzags from element to element: then the mesh decides, not the tire.
    """
    amplitude = zigzag(state)
    if amplitude > ZIGZAG:
        raise ArithmeticError(
            f"{state.balance.tire.name}: the strain zigzags by {1e6 * amplitude:.0f} microstrain "
            f"from element to element at {state.balance.cond}; give a belt that is stiffer in "
            "shear, or a finer mesh"
        )
    phi = -np.pi + 2.0 * np.pi / POINTS * np.arange(POINTS, dtype=np.float64)
    u, nudge = state.balance.u, 10.0
    base = _smooth(state, u, phi)
    more = _smooth(state, u + nudge * state.by_load, phi)
    return Trace(phi, base[:, STRIP], (more - base)[:, STRIP] / nudge, edges(state)[STRIP])


def zigzag(state: State) -> float:
    """Return the largest alternation of the elements' mean strain in the contact [1].

    A sixteenth of the fourth difference: exactly the amplitude of a zigzag, next to nothing of a
    wave that elements resolve.
    """
    line = state.model.mesh.gage
    count = len(line.dofs) // len(STRIPS)
    weight = line.weight[:count]
    fine = np.abs(line.phi[:count].mean(axis=1)) < ZONE
    every = hoop_strain(state, state.balance.u).reshape(len(STRIPS), count, -1)
    mean = np.sum(every * weight, axis=-1)[:, fine] / weight.sum(axis=-1)[fine]
    return float(np.abs(np.diff(mean, 4, axis=1)).max()) / 16.0


def _smooth(state: State, u: Array, phi: Array) -> Array:
    """Return the strips' strain at angles, shape (n, 3), smooth between the elements.

    Its mean over every element is that of the element's Gauss points, where a quadratic element is
    most accurate: a spline joins the integral of the strain at the elements' borders.
    """
    line = state.model.mesh.gage
    count = len(line.dofs) // len(STRIPS)
    weight = line.weight[:count]
    every = hoop_strain(state, u).reshape(len(STRIPS), count, -1)
    border = -np.pi + np.append(0.0, np.cumsum(weight.sum(axis=1)))
    whole = np.cumsum(np.sum(every * weight, axis=-1), axis=-1)
    mean = whole[:, -1:] / (2.0 * np.pi)
    rest = np.concatenate([0.0 * mean, whole], axis=1) - mean * (border + np.pi)
    rest[:, -1] = 0.0
    spline = CubicSpline(border, rest.T, bc_type="periodic")
    return np.asarray(spline(phi, 1) + mean[:, 0])


def edges(state: State) -> Array:
    """Return the contact edges of the strips [rad], shape (3, 2)."""
    line, road = state.model.mesh.surface, state.balance.road
    out = np.full((len(STRIPS), 2), np.nan)
    phi = line.phi.reshape(len(STRIPS), -1)
    for i, depth in enumerate(road.depth.reshape(len(STRIPS), -1)):
        inside = np.flatnonzero(depth > 0.0)
        if inside.size:
            a, b = inside[0], inside[-1]
            out[i, 0] = np.interp(0.0, depth[a - 1 : a + 1], phi[i, a - 1 : a + 1])
            out[i, 1] = np.interp(0.0, -depth[b : b + 2], phi[i, b : b + 2])
    return out
