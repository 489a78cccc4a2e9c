"""Both edges of the contact and the deflection at once; see `tirelib.physics.contact.radial`."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.physics.contact.checks import LARGEST_ANGLE, range_text
from tirelib.physics.contact.checks import ComplianceAt as ComplianceAt
from tirelib.physics.contact.patch import Nodes, PatchEquation, between
from tirelib.physics.contact.start import EdgeEstimate
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray

N_NODES = 40
COARSE_NODES = 16
COARSE_TOLERANCE = 2e-2
COARSE_ITERATIONS = 10
CHUNK = 32
"""Points that are solved together: their matrices fit into the processor's cache."""

TOLERANCE = 2e-5
"""Largest last shift of an edge, in half patches, and change of d0 and compression, relative.

What it leaves is of second order: a shift s [rad] leaves some 20 s^2 [rad]. Measured against 1e-11
on six tires, 100 to 12000 N: edges within 9e-10 rad, deflection and load within 2e-10, relative.
"""

_COMPRESSION_WEIGHT = 3.0
_DEFLECTION_WEIGHT = 2e4
"""For sidewalls that soften: there a change of d0 counts in first order."""

MAX_ITERATIONS = 40
NEAR_ITERATIONS = 8

_OUTWARD = np.array([-1.0, 1.0])


@dataclass(frozen=True)
class Constant:
    """A ring whose stiffness does not depend on the deflection."""

    compliance: Compliance

    def __call__(self, deflection: FloatArray) -> Compliance:
        """Return the compliance, whatever the deflection."""
        return self.compliance


@dataclass(frozen=True)
class ContactProblem:
    """The contact problem: ring by deflection, tread, load if given, other belt loads."""

    at: ComplianceAt
    tread: Tread
    vertical_load: FloatArray | None
    extra: ComplexArray | None


@dataclass(frozen=True)
class Solution:
    """Edges; the patch (edges before their last shift) with its compression; deflection."""

    edges: FloatArray
    patch: FloatArray
    deflection: FloatArray
    delta: FloatArray
    iterations: int
    change: FloatArray


class _State:
    """Edges, deflection and compression on their way to the solution, all points at once.

    The compression belongs to `patch`, the edges before their last shift. A shift changes load and
    pressure in second order only, so below the tolerance the two need not be made equal.
    """

    def __init__(self, problem: ContactProblem, d0: FloatArray, edges: FloatArray) -> None:
        self.problem = problem
        self.constant = isinstance(problem.at, Constant)
        self.linear = problem.tread.linear
        self.d0, self.edges = d0, edges.copy()
        self.patch = edges.copy()
        self.delta = np.zeros((d0.size, 0))
        self.secant = _Secant(d0)
        self.change = np.full(d0.size, np.inf)

    def settle(self, nodes: Nodes, tolerance: float, limit: int) -> int:
        """Iterate until nothing changes by more than the tolerance; return the iterations."""
        self.delta = _refine(self.delta, nodes)
        self.change[:] = np.inf
        n_points = self.d0.size
        todo = np.arange(n_points)
        iterations = 0
        while todo.size and iterations < limit:
            iterations += 1
            ring = self.problem.at(self.d0)
            for first in range(0, todo.size, CHUNK):
                last = first + CHUNK
                every = todo.size == n_points
                self._advance(nodes, ring, slice(first, last) if every else todo[first:last])
            _refuse_large(self.edges, self.d0, self.problem)
            todo = np.flatnonzero(~(self.change < tolerance))
        return iterations

    def _advance(self, nodes: Nodes, ring: Compliance, part: IntArray | slice) -> None:
        problem = self.problem
        if self.d0.size > 1:
            ring, rubber = ring.take(part), problem.tread.take(part)
        else:
            rubber = problem.tread
        extra = None if problem.extra is None else problem.extra[part]
        edges, before = self.edges[part], self.delta[part]
        step = PatchEquation.of(ring, rubber, nodes, edges, before, extra)
        used = self.d0[part]
        target = problem.vertical_load
        wanted = used if target is None else step.deflection(target[part])
        delta = step.compression(wanted)
        moved = _move_edges(nodes, edges, delta)
        change = np.abs(moved - edges).max(axis=1) / (0.5 * (edges[:, 1] - edges[:, 0]))
        if not self.linear:
            moved_by = np.abs(delta - before).max(axis=1) / np.abs(delta).max(axis=1)
            change += _COMPRESSION_WEIGHT * moved_by
        if target is not None and not self.constant:
            change += _DEFLECTION_WEIGHT * np.abs(wanted / used - 1.0)
        self.patch[part], self.delta[part], self.change[part] = edges, delta, change
        self.edges[part] = moved
        free = target is None or self.constant
        self.d0[part] = wanted if free else self.secant.next(part, used, wanted)


@dataclass(frozen=True)
class Start:
    """Edges, deflection and compression of a solution nearby."""

    edges: FloatArray
    deflection: FloatArray
    delta: FloatArray

    def tiled(self, times: int) -> "Start":
        """Return the points repeated one after the other."""
        return Start(
            np.tile(self.edges, (times, 1)),
            np.tile(self.deflection, times),
            np.tile(self.delta, (times, 1)),
        )


def solve(
    problem: ContactProblem, deflection: FloatArray | None, n_nodes: int, start: Start | None = None
) -> Solution:
    """Return edges, deflection and compression on convergence, or at the iteration limit.

    A start nearby saves time and changes nothing beyond the tolerance; a useless one is left.
    """
    if start is not None and deflection is None and start.deflection.size == len(problem.tread):
        near = _from(problem, start, Nodes.of(n_nodes))
        if near is not None:
            return near
    nodes, coarse = Nodes.of(n_nodes), Nodes.of(min(COARSE_NODES, n_nodes))
    d0, edges = _start(problem, deflection)
    state = _State(problem, d0, edges)
    iterations = state.settle(coarse, COARSE_TOLERANCE, COARSE_ITERATIONS)
    lost = np.flatnonzero(~(state.change < COARSE_TOLERANCE))
    if lost.size:  # from the patch of the undeformed tire, which holds the true one
        state.d0[lost] = 0.02 if deflection is None else deflection[lost]
        state.edges[lost] = _undeformed(problem.tread, state.d0)[lost]
        state.delta[lost] = 0.0
        state.secant = _Secant(state.d0)
        iterations += state.settle(coarse, COARSE_TOLERANCE, MAX_ITERATIONS)
    iterations += state.settle(nodes, TOLERANCE, MAX_ITERATIONS)
    return Solution(state.edges, state.patch, state.d0, state.delta, iterations, state.change)


def _from(problem: ContactProblem, start: Start, nodes: Nodes) -> Solution | None:
    """Return the solution near a start, or None if there is none."""
    state = _State(problem, start.deflection.copy(), start.edges)
    state.delta = start.delta.copy()
    try:
        iterations = state.settle(nodes, TOLERANCE, NEAR_ITERATIONS)
    except ParameterError:
        return None
    if not (state.change < TOLERANCE).all():
        return None
    return Solution(state.edges, state.patch, state.d0, state.delta, iterations, state.change)


def _start(problem: ContactProblem, deflection: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    """Return a deflection and a patch near the solution."""
    tread, vertical_load = problem.tread, problem.vertical_load
    d0 = np.full(len(tread), 0.02) if deflection is None else deflection.copy()
    undeformed = _undeformed(tread, d0)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        estimate = EdgeEstimate.of(problem.at(d0), tread)
        if estimate is None:
            return d0, undeformed
        if vertical_load is None:
            half = estimate.half_angle(d0)
        else:
            guess, half = estimate.for_load(vertical_load)
            d0 = np.where((guess > 0) & (guess < 0.25 * tread.free_radius), guess, d0)
            undeformed = _undeformed(tread, d0)
        good = (half > 0.05 * undeformed[:, 1]) & (half < undeformed[:, 1])
    half = np.where(good, half, undeformed[:, 1])
    middle = np.where(good & (np.abs(estimate.lag) < 0.2 * half), -estimate.lag, 0.0)
    return d0, middle[:, None] + half[:, None] * _OUTWARD


def _undeformed(tread: Tread, d0: FloatArray) -> FloatArray:
    """Return the patch of the undeformed tire."""
    ratio = d0 / np.asarray(tread.free_radius, dtype=float)
    if (ratio > 0.5).any():
        raise ParameterError(
            f"contact: deflection {1e3 * d0[ratio > 0.5][0]:.1f} mm is more than half of the free "
            f"radius, {1e3 * (d0 / ratio)[ratio > 0.5][0]:.1f} mm; a tire bears some 15 % of its "
            "radius; check the deflection and its unit"
        )
    half = np.arccos(1.0 - ratio)
    return np.stack([-half, half], axis=1)


def _refine(delta: FloatArray, nodes: Nodes) -> FloatArray:
    """Return the compression at other nodes of the same patch."""
    if delta.shape[1] == 0:
        return np.zeros((delta.shape[0], nodes.xi.size))
    if delta.shape[1] == nodes.xi.size:
        return delta
    out: FloatArray = delta @ between(delta.shape[1], nodes.xi.size).T
    return out


def _move_edges(nodes: Nodes, edges: FloatArray, delta: FloatArray) -> FloatArray:
    """Return the edges after one Newton step on delta(edge) = 0, of limited length."""
    half = 0.5 * (edges[:, 1:] - edges[:, :1])
    outward = _OUTWARD
    read = delta @ nodes.readers
    value = read[:, :2]
    fall = -read[:, 2:] * outward / half  # how fast delta falls outward
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

    def next(self, index: IntArray | slice, used: FloatArray, wanted: FloatArray) -> FloatArray:
        """Return the deflection to try after `used` came back as `wanted`."""
        rest = wanted - used
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = (used - self.last[index]) / (rest - self.rest[index])
        step = np.where(np.isfinite(gain) & (gain < 0) & (gain > -5.0), -gain * rest, rest)
        self.last[index], self.rest[index] = used, rest
        out: FloatArray = np.where(used + step > 0, used + step, 0.5 * used)
        return out


def _refuse_large(edges: FloatArray, d0: FloatArray, problem: ContactProblem) -> None:
    """Refuse what the linear ring cannot describe."""
    if not np.abs(edges).max() > 1.5 * LARGEST_ANGLE:
        return
    beyond = (np.abs(edges).max(axis=1) > 1.5 * LARGEST_ANGLE) & np.isfinite(d0)
    if beyond.any():
        refuse_point(int(np.flatnonzero(beyond)[0]), d0, problem)


def refuse_point(point: int, d0: FloatArray, problem: ContactProblem) -> None:
    """Raise ParameterError with what this tire carries."""
    load = problem.vertical_load
    given = (
        f"deflection {1e3 * float(d0[point]):.1f} mm"
        if load is None
        else f"load {load[point]:.0f} N"
    )
    raise ParameterError(
        f"contact: point {point}: {given} is more than this tire carries within the ring's "
        f"validity: {range_text(problem.at, problem.tread, point)}; lower it or check stiffness "
        "and pressure",
        point=point,
    )
