"""The two edges of the contact and the deflection, found at once; see `tirelib.contact.radial`."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray, IntArray
from tirelib.contact.patch import Nodes, PatchEquation
from tirelib.contact.tread import Tread
from tirelib.errors import ParameterError
from tirelib.ring.compliance import Compliance
from tirelib.ring.ring import ComplexArray

LARGEST_ANGLE = 0.75
"""Half contact angle beyond which the linear ring has no meaning, [rad]."""

N_NODES = 40
COARSE_NODES = 12
CHUNK = 64
"""Points that are solved together: their matrices fit into the processor's cache."""

TOLERANCE = 1e-7
"""Largest last shift of an edge, [rad]; Newton's next would be its square."""

MAX_ITERATIONS = 40

ComplianceAt = Callable[[FloatArray], Compliance]


@dataclass(frozen=True)
class Constant:
    """A ring whose stiffness does not depend on the deflection."""

    compliance: Compliance

    def __call__(self, deflection: FloatArray) -> Compliance:
        """Return the compliance, whatever the deflection."""
        return self.compliance


@dataclass(frozen=True)
class Problem:
    """What is pressed together: ring by deflection, tread, load if given, other belt loads."""

    at: ComplianceAt
    tread: Tread
    vertical_load: FloatArray | None
    extra: ComplexArray | None


class _State:
    """Edges, deflection and compression on their way to the solution, all points at once."""

    def __init__(self, problem: Problem, d0: FloatArray, edges: FloatArray) -> None:
        self.problem = problem
        self.d0, self.edges = d0, edges
        self.delta = np.zeros((d0.size, 0))
        self.secant = _Secant(d0)
        self.change = np.full(d0.size, np.inf)

    def settle(self, nodes: Nodes, tolerance: float) -> int:
        """Iterate until no edge moves by more than the tolerance; return the iterations."""
        self.delta = np.zeros((self.d0.size, nodes.xi.size))
        self.change[:] = np.inf
        todo = np.arange(self.d0.size)
        iterations = 0
        while todo.size and iterations < MAX_ITERATIONS:
            iterations += 1
            for first in range(0, todo.size, CHUNK):
                self._advance(nodes, todo[first : first + CHUNK])
            _refuse_large(self.edges, self.d0, self.problem.vertical_load)
            todo = np.flatnonzero(~(self.change < tolerance))
        return iterations

    def _advance(self, nodes: Nodes, part: IntArray) -> None:
        problem = self.problem
        ring, rubber = problem.at(self.d0).take(part), problem.tread.take(part)
        extra = None if problem.extra is None else problem.extra[part]
        step = PatchEquation.of(ring, rubber, nodes, self.edges[part], self.delta[part], extra)
        used = self.d0[part]
        target = problem.vertical_load
        wanted = used if target is None else step.deflection(target[part])
        self.delta[part] = step.compression(wanted)
        moved = _move_edges(nodes, self.edges[part], self.delta[part])
        self.change[part] = np.abs(moved - self.edges[part]).max(axis=1) + np.abs(wanted - used)
        self.edges[part] = moved
        constant = isinstance(problem.at, Constant)
        self.d0[part] = wanted if constant else self.secant.next(part, used, wanted)


def solve(
    problem: Problem, deflection: FloatArray | None, n_nodes: int
) -> tuple[FloatArray, FloatArray, FloatArray, int, FloatArray]:
    """Return edges, deflection, compression at the nodes, iterations, and the last change."""
    d0, edges = _start(problem.tread, deflection, problem.vertical_load)
    state = _State(problem, d0, edges)
    iterations = state.settle(Nodes.of(min(COARSE_NODES, n_nodes)), 1e-2)
    iterations += state.settle(Nodes.of(n_nodes), TOLERANCE)
    return state.edges, state.d0, state.delta, iterations, state.change


def _start(
    tread: Tread, deflection: FloatArray | None, vertical_load: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Return the deflection and the patch of the undeformed tire, which holds the true one."""
    if deflection is None:
        assert vertical_load is not None  # noqa: S101 - one of the two is always given
        d0 = np.full(vertical_load.size, 0.02)
    else:
        d0 = deflection.copy()
    ratio = d0 / np.asarray(tread.free_radius, dtype=float)
    if (ratio > 0.5).any():
        raise ParameterError(
            f"contact: deflection {1e3 * d0[ratio > 0.5][0]:.1f} mm is more than half of the free "
            "radius; give it in metres, at most some 15 % of the radius"
        )
    half = np.arccos(1.0 - ratio)
    return d0, np.stack([-half, half], axis=1)


def _move_edges(nodes: Nodes, edges: FloatArray, delta: FloatArray) -> FloatArray:
    """Return the edges after one Newton step on delta(edge) = 0, of limited length."""
    half = 0.5 * (edges[:, 1:] - edges[:, :1])
    outward = np.array([-1.0, 1.0])
    value = delta @ nodes.ends.T
    fall = -(delta @ nodes.end_slopes.T) * outward / half  # how fast delta falls outward
    reach = half * 2.0 / 3.0
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = np.where(fall > 0, value / fall, np.sign(value) * np.inf)
    out: FloatArray = edges + outward * np.clip(shift, -reach / 2, reach)
    return out


class _Secant:
    """Secant steps for deflections that return as G(d0), one equation a point."""

    def __init__(self, start: FloatArray) -> None:
        self.last = start.copy()
        self.rest = np.full(start.shape, np.nan)

    def next(self, index: IntArray, used: FloatArray, wanted: FloatArray) -> FloatArray:
        rest = wanted - used
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = (used - self.last[index]) / (rest - self.rest[index])
        step = np.where(np.isfinite(gain) & (gain < 0) & (gain > -5.0), -gain * rest, rest)
        self.last[index], self.rest[index] = used, rest
        out: FloatArray = np.where(used + step > 0, used + step, 0.5 * used)
        return out


def _refuse_large(edges: FloatArray, d0: FloatArray, vertical_load: FloatArray | None) -> None:
    """Refuse what the linear ring cannot describe."""
    beyond = (np.abs(edges).max(axis=1) > 1.5 * LARGEST_ANGLE) & np.isfinite(d0)
    if beyond.any():
        point = int(np.flatnonzero(beyond)[0])
        _raise_large(point, float(d0[point]), vertical_load)


def _raise_large(point: int, d0: float, vertical_load: FloatArray | None) -> None:
    given = (
        f"deflection {1e3 * d0:.1f} mm"
        if vertical_load is None
        else f"load {vertical_load[point]:.0f} N"
    )
    raise ParameterError(
        f"contact: point {point}: {given} is more than this tire carries within the ring's "
        f"validity (half contact angle up to {LARGEST_ANGLE} rad); lower it or check stiffness and "
        "pressure"
    )
