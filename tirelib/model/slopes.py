"""Slopes of the solved model: by the numbers of the tire, by load and pressure, and by effects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.effects.state import READ, Operating, State
from tirelib.model.base import Coordinate, smoothed
from tirelib.model.chain import Change, Changes, Course, course, filtered, strained
from tirelib.model.rolled import CONSTANT_STEP, RolledSlopes, rolled_slopes
from tirelib.model.solution import (
    Solution,
    Values,
    at_gage,
    beside,
    kinds_of,
    made_with,
    parts,
    pressed_ring,
    ring_of,
    same,
    shown_at_gage,
    split,
)
from tirelib.physics.rolling.assemble import Unknowns

GAGE_STEP = 1e-4
"""Change of a waveform, over its largest value, by which a gage is differentiated. On a campaign of
66 runs half and double of it change slopes by 5e-5 of themselves at most."""
LINEAR_STEP = 1e-4
"""Relative change of numbers, load and pressure by which the linear ring is differentiated. Half
and double change slopes by 3e-5 at most, but for the smallest of a tread that slides (by .05 and
.02): whether a point of the tread slides is no smooth question."""
DEPTH_STEP = 1e-6
"""Change of the deflection by which constants that follow it are differentiated, [m]. With a
sidewall whose stiffness falls with the deflection, half and double change slopes by 7e-4 and 3e-4
at most."""


@dataclass(frozen=True, slots=True, eq=False)
class SolutionSlopes:
    """Slopes of a solution by some directions.

    Attributes
    ----------
    waveform : shape (n_directions, n_points, n_phi)
    rolled : RolledSlopes or None
        Slopes of the rolling ring by those directions that move it.
    """

    waveform: FloatArray
    rolled: RolledSlopes | None

    @property
    def deflection(self) -> FloatArray:
        """Slopes of the rolling ring's deflection, (n_directions, n_points), [m].

        Raises
        ------
        ParameterError
            If no direction moves the rolling ring.
        """
        return self._moved.deflection

    def start(self, found: Solution, dz: FloatArray) -> Unknowns:
        """Return a first guess of the contact after a move (n_free,) of the first directions."""
        return self._moved.start(found.rolling, dz)

    @property
    def _moved(self) -> RolledSlopes:
        if self.rolled is None:
            raise ParameterError("slopes: none of their directions moves the rolling ring")
        return self.rolled


def by_values(found: Solution, free: Sequence[Coordinate]) -> SolutionSlopes:
    """Return slopes by coordinates, then by relative load and relative pressure.

    What effects add through the linear ring is held as it is (`added_by_values`).
    """
    v, p = found.values, found.points
    own, _ = split(v, p, found.changes)
    there: list[tuple[Values, Operating, Sequence[Change]]] = []
    for coordinate in free:
        moved = coordinate.moved(np.asarray(v[coordinate.name], dtype=float), CONSTANT_STEP)
        there.append(({**v, coordinate.name: moved}, p, own))
    there.append((v, replace(p, load=p.load * (1.0 + CONSTANT_STEP)), own))
    there.append((v, replace(p, pressure=p.pressure * (1.0 + CONSTANT_STEP)), own))
    shown, by = _towards(found, there, CONSTANT_STEP, own)
    return SolutionSlopes(_through_gage(found, shown), by)


def added_by_values(found: Solution, free: Sequence[Coordinate], step: float) -> FloatArray:
    """Return how coordinates move what is added through the linear ring, (n_free, ...)."""
    if found.linear is None:
        return np.zeros((len(free), 1, 1))
    own, linear = split(found.values, found.points, found.changes)
    plain, here = _here(found, own, linear)
    n, rows = len(found.points), np.zeros((len(free), *here.shape))
    known = [k for k, coordinate in enumerate(free) if coordinate.name in READ]
    # all moves at once: every point stands there once for each coordinate
    wide = {name: np.broadcast_to(v, (len(known), n)) for name, v in found.values.items()}
    for row, k in enumerate(known):
        moved = wide[free[k].name].copy()
        moved[row] = free[k].moved(moved[row], step)
        wide[free[k].name] = moved
    values = {name: each.ravel() for name, each in wide.items()}
    points = found.points.take(np.tile(np.arange(n), len(known)))
    assert plain.contact is not None  # noqa: S101 - a pressed state has it
    start = plain.contact.start.tiled(len(known))
    moved_ring = ring_of(values, points, own, found.phi, start)
    there = _added(found, values, points, own, linear, moved_ring)
    rows[known] = (there.reshape(len(known), *here.shape) - here) / step
    return _through_gage(found, rows)


def slopes_of(found: Solution, free: Sequence[Coordinate] = ()) -> SolutionSlopes:
    """Return slopes by coordinates, then by relative load and relative pressure, all included."""
    by = by_values(found, free)
    if found.linear is None:
        return by
    own, linear = split(found.values, found.points, found.changes)
    p, v, step = found.points, found.values, LINEAR_STEP
    heavier = replace(p, load=p.load * (1.0 + step))
    firmer = replace(p, pressure=p.pressure * (1.0 + step))
    here = _here(found, own, linear)[1]
    rows = [(_added(found, v, at, own, linear) - here) / step for at in (heavier, firmer)]
    more = _through_gage(found, np.stack(rows))
    if free:
        more = np.concatenate([added_by_values(found, free, step), more])
    return replace(by, waveform=by.waveform + more)


def by_effects(
    found: Solution, there: Sequence[tuple[int, tuple[str, Change]]], steps: Sequence[float]
) -> SolutionSlopes:
    """Return slopes towards changed effects.

    Parameters
    ----------
    found : Solution
    there : sequence of (place, (stage, change))
        An effect with its strength `step` away, for that at this place of the solution's changes;
        behind the last one for an effect that the solution does not have.
    steps : sequence of float
    """
    v, p, changes = found.values, found.points, found.changes
    kinds, kinds_there = kinds_of(v, p, changes), kinds_of(v, p, [new for _, new in there])
    own, linear = parts(changes, kinds)
    shown = np.zeros((len(there), *found.shown.shape))
    gaged, state = np.zeros_like(shown), at_gage(found)
    rolled: list[int] = []
    moved: list[tuple[Values, Operating, Sequence[Change]]] = []
    ring: tuple[State, FloatArray, State, Course] | None = None
    for k, ((place, new), kind, step) in enumerate(zip(there, kinds_there, steps, strict=True)):
        every = [*changes[:place], new, *changes[place + 1 :]]
        if kind == "gage":
            moved_there = shown_at_gage(found, found.shown, every, state)
            gaged[k] = (moved_there - found.waveform) / step
            continue
        own_there, linear_there = parts(every, [*kinds[:place], kind, *kinds[place + 1 :]])
        if kind == "rolling" and len(linear_there) == len(linear):
            rolled.append(k)
            moved.append((v, p, own_there))
            continue
        if ring is None:
            plain, here = _here(found, own, linear)
            pressed_here = pressed_ring(v, p, own, linear, plain)
            ring = plain, here, pressed_here, course(pressed_here, linear)
        plain, here, pressed_here, usual = ring
        if new[0] == "constants":
            added = _added(found, v, p, own_there, linear_there, plain)
        else:
            last = course(pressed_here, linear_there, usual)[-1][1]
            added = filtered(last, found.low_pass).wave - plain.wave
        shown[k] = (added - here) / step
    by = None
    if rolled:
        shown[rolled], by = _towards(found, moved, [steps[k] for k in rolled], own)
    rows = _through_gage(found, shown) + gaged
    return SolutionSlopes(rows, by)


def _here(found: Solution, own: Sequence[Change], linear: Changes) -> tuple[State, FloatArray]:
    """Return the linear ring without its changes, and what is added through it."""
    if found.linear is not None:
        before, after = found.linear
        return before, after.wave - before.wave
    plain = ring_of(found.values, found.points, own, found.phi)
    plain = strained(plain, (), found.low_pass)
    return plain, _added(found, found.values, found.points, own, linear, plain)


def _added(
    found: Solution,
    values: Values,
    points: Operating,
    own: Sequence[Change],
    linear: Changes,
    plain: State | None = None,
) -> FloatArray:
    """Return what is added through the linear ring, filtered, (n_points, n_phi).

    `own` changes the constants of both rings; `plain` is the linear ring with them alone.
    """
    if plain is None:
        plain = ring_of(values, points, own, found.phi)
    before, after = beside(values, points, own, linear, found.low_pass, plain)
    return after.wave - before.wave


def _through_gage(found: Solution, rows: FloatArray) -> FloatArray:
    """Return small changes (k, n_points, n_phi) of the waveform as the gage shows them."""
    if not any(stage == "gage" for stage, _ in found.changes):
        return rows
    size, state = GAGE_STEP * float(np.abs(found.shown).max()), at_gage(found)
    out = []
    for row in rows:
        step = size / max(float(np.abs(row).max()), 1e-300)
        moved = shown_at_gage(found, found.shown + step * row, found.changes, state)
        out.append((moved - found.waveform) / step)
    return np.stack(out)


def _towards(
    found: Solution,
    there: Sequence[tuple[Values, Operating, Sequence[Change]]],
    steps: float | Sequence[float],
    own: Sequence[Change],
) -> tuple[FloatArray, RolledSlopes]:
    """Return slopes of the filtered waveform before the gage, and of the rolling ring.

    `there` holds the changes of the rolling ring's constants, and `own` those of the solution.
    """
    depth = found.rolling.deflection
    moved = [made_with(v, p, constants, depth) for v, p, constants in there]
    each = [*np.broadcast_to(np.asarray(steps, dtype=float), (len(there),)).tolist()]
    deeper = made_with(found.values, found.points, own, depth + DEPTH_STEP)
    follow = not same(deeper.constants, found.made.constants)
    if follow:
        moved, each = [*moved, deeper], [*each, DEPTH_STEP]
    by = rolled_slopes(found.rolling, found.made, moved, each, found.phi.size)
    if follow:
        by = _following(by)
    return smoothed(by.strain, found.points, found.low_pass), by


def _following(by: RolledSlopes) -> RolledSlopes:
    """Return slopes with constants that follow the deflection; the last direction is theirs."""
    strain, depth, last = by.strain[-1], by.deflection[-1], by.unknowns[-1]
    share = by.deflection[:-1] / (1.0 - depth)
    return RolledSlopes(
        by.strain[:-1] + share[:, :, None] * strain,
        by.deflection[:-1] + share * depth,
        [each.plus(last, much) for each, much in zip(by.unknowns[:-1], share, strict=True)],
    )
