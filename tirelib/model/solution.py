"""The model of a tire with effects, solved at operating points: effects act on the rolling ring.

constants        change what the rolling ring is made of, and may follow its deflection
contact, strain  add what they change in the linear ring with the same constants
gage             change the filtered waveform

Modal damping, which the rolling ring has not, adds what it changes in the linear ring as well.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.contact.free_boundary import Start
from tirelib.errors import ConvergenceError, ParameterError
from tirelib.model.base import Coordinate, smoothed
from tirelib.model.chain import (
    FIRST_DEPTH,
    SETTLE,
    SETTLED,
    Change,
    Changes,
    apply,
    at_depth,
    crossing,
    pressed,
    strained,
)
from tirelib.model.rolled import STEP, Made, RolledSlopes, made_of, rolled_slopes
from tirelib.model.state import READ, Operating, State
from tirelib.rolling.assemble import Unknowns
from tirelib.rolling.constants import STIFFEST, Constants
from tirelib.rolling.gage import Gage
from tirelib.rolling.solve import Rolling, solve
from tirelib.signal import LowPass
from tirelib.waveforms import GRID

Values = Mapping[str, float | FloatArray]
SAME = (
    *("radius", "free_radius", "EI", "mass", "rotary_inertia", "k_u", "k_v"),
    *("softening", "dashpots", "k_t", "hardening", "thickness"),
)
"""Constants of the rolling ring that a state holds under the same name."""
LINEAR_ONLY = ("damping", "inertia_share")
"""Fields of a state that the rolling ring has not: a change of them acts on the linear ring."""
SMALL = 1e-4
"""Change of a waveform, over its largest value, by which a gage is differentiated."""
LINEAR_STEP = 1e-4
"""Relative change of numbers, load and pressure by which the linear ring is differentiated."""
DEPTH_STEP = 1e-6
"""Change of the deflection by which constants that follow it are differentiated, [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The solved model.

    Attributes
    ----------
    values : mapping
        Parameters of the tire.
    points : Operating
    changes : sequence of (stage, change)
        Effects.
    low_pass : LowPass
    rolling : Rolling
    made : Made
        What it is made of, effects on the constants included.
    shown : shape (n_points, n_phi), [-]
        Filtered waveform without the effects at the gage.
    waveform : shape (n_points, n_phi), [-]
    phi : shape (n_phi,), [rad]
    linear : tuple of State or None
        The linear ring without and with what it adds to the rolling one, up to the gage; None where
        it adds nothing.
    """

    values: Values
    points: Operating
    changes: Changes
    low_pass: LowPass
    rolling: Rolling
    made: Made
    shown: FloatArray
    waveform: FloatArray
    phi: FloatArray
    linear: tuple[State, State] | None = None

    @property
    def deflection(self) -> FloatArray:
        """d0, (n_points,), [m]."""
        depth = self.rolling.deflection
        if self.linear is not None:
            depth = depth + self.linear[1].deflection - self.linear[0].deflection
        return depth


@dataclass(frozen=True, slots=True, eq=False)
class SolutionSlopes:
    """Slopes of a solution by some directions.

    Attributes
    ----------
    waveform : shape (n_directions, n_points, n_phi)
    rolled : RolledSlopes or None
        Of the rolling ring, by those directions that move it.
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


def solved(
    values: Values,
    points: Operating,
    changes: Changes = (),
    *,
    low_pass: LowPass,
    start: Rolling | Unknowns | None = None,
    phi: FloatArray = GRID,
) -> Solution:
    """Return the solved model.

    Parameters
    ----------
    values : mapping
        Parameters of a tire.
    points : Operating
    changes : sequence of (stage, change)
        Effects.
    low_pass : LowPass
    start : Rolling or Unknowns, optional
        A solution nearby; it saves time only.
    phi : shape (n_phi,), [rad]
        Even angles from -pi.

    Raises
    ------
    ParameterError, ConvergenceError
        From ring, contact and effects.
    """
    own, linear = _split(values, points, changes)
    rolling, made = _followed(values, points, own, start)
    shown = smoothed(rolling.strain(made.gage, phi.size), points, low_pass)
    found = Solution(values, points, changes, low_pass, rolling, made, shown, shown, phi)
    if linear or _damped(values):
        plain = _plain(values, points, own, phi)
        before, after = _beside(values, points, own, linear, low_pass, plain)
        shown = shown + after.wave - before.wave
        found = replace(found, linear=(before, after))
    return replace(found, shown=shown, waveform=_at_gage(found, shown, changes))


def made_with(
    values: Values, points: Operating, constants: Sequence[Change], depth: FloatArray
) -> Made:
    """Return what the rolling ring is made of with effects, for a deflection (n_points,)."""
    made = made_of(values, points)
    if not constants:
        return made
    before = State.of(values, points, GRID)
    after = at_depth(before, constants, depth)
    k = made.constants.but(
        **{name: getattr(after, name) for name in SAME},
        EA=np.minimum(after.EA, STIFFEST),
        # a state's shear stiffness is the tire's less the tension
        GA=np.minimum(after.GA + before.belt_tension, STIFFEST),
        inflation=after.tension_pressure * after.width,
        tension=made.constants.tension + after.tension,
        half_width=0.5 * after.width,
    )
    spread = made.gage.spread * after.thickness / before.thickness
    return Made(k, Gage(after.offset, made.gage.liner, spread))


def by_values(found: Solution, free: Sequence[Coordinate]) -> SolutionSlopes:
    """Return slopes by coordinates, then by relative load and relative pressure.

    What effects add through the linear ring is held as it is (`added_by_values`).
    """
    v, p = found.values, found.points
    there: list[tuple[Values, Operating, Changes]] = []
    for coordinate in free:
        moved = coordinate.moved(np.asarray(v[coordinate.name], dtype=float), STEP)
        there.append(({**v, coordinate.name: moved}, p, found.changes))
    there.append((v, replace(p, load=p.load * (1.0 + STEP)), found.changes))
    there.append((v, replace(p, pressure=p.pressure * (1.0 + STEP)), found.changes))
    shown, by = _towards(found, there, STEP)
    return SolutionSlopes(_through_gage(found, shown), by)


def added_by_values(found: Solution, free: Sequence[Coordinate], step: float) -> FloatArray:
    """Return how coordinates move what is added through the linear ring, (n_free, ...)."""
    if found.linear is None:
        return np.zeros((len(free), 1, 1))
    own, linear = _split(found.values, found.points, found.changes)
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
    moved_ring = _plain(values, points, own, found.phi, start)
    there = _added(found, values, points, own, linear, moved_ring)
    rows[known] = (there.reshape(len(known), *here.shape) - here) / step
    return _through_gage(found, rows)


def slopes_of(found: Solution, free: Sequence[Coordinate] = ()) -> SolutionSlopes:
    """Return slopes by coordinates, then by relative load and relative pressure, all included."""
    by = by_values(found, free)
    if found.linear is None:
        return by
    own, linear = _split(found.values, found.points, found.changes)
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
    found: Solution, there: Sequence[tuple[str, Changes]], steps: Sequence[float]
) -> SolutionSlopes:
    """Return slopes towards changed effects.

    Parameters
    ----------
    found : Solution
    there : sequence of (stage, changes)
        All effects, one of them, which acts at this stage, with its strength `step` away.
    steps : sequence of float
    """
    own, linear = _split(found.values, found.points, found.changes)
    shown = np.zeros((len(there), *found.shown.shape))
    at_gage, plain, here = np.zeros_like(shown), None, None
    rolled: list[int] = []
    for k, ((stage, changes), step) in enumerate(zip(there, steps, strict=True)):
        if stage == "gage":
            at_gage[k] = (_at_gage(found, found.shown, changes) - found.waveform) / step
            continue
        own_there, linear_there = _split(found.values, found.points, changes)
        if stage == "constants" and len(linear_there) == len(linear):
            rolled.append(k)
            continue
        if plain is None or here is None:
            plain, here = _here(found, own, linear)
        there_too = _added(found, found.values, found.points, own_there, linear_there, plain)
        shown[k] = (there_too - here) / step
    by = None
    if rolled:
        moved = [(found.values, found.points, there[k][1]) for k in rolled]
        shown[rolled], by = _towards(found, moved, [steps[k] for k in rolled])
    rows = _through_gage(found, shown) + at_gage
    return SolutionSlopes(rows, by)


def _damped(values: Values) -> bool:
    return bool(np.any(values["damping"]))


def _plain(
    values: Values,
    points: Operating,
    own: Sequence[Change],
    phi: FloatArray,
    start: Start | None = None,
) -> State:
    """Return the linear ring as the rolling one is: undamped, with the same constants."""
    state = State.of({**values, "damping": 0.0}, points, phi).but(start=start)
    return pressed(state, [("constants", change) for change in own])


def _here(found: Solution, own: Sequence[Change], linear: Changes) -> tuple[State, FloatArray]:
    """Return the linear ring without its changes, and what is added through it."""
    if found.linear is not None:
        before, after = found.linear
        return before, after.wave - before.wave
    plain = _plain(found.values, found.points, own, found.phi)
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
        plain = _plain(values, points, own, found.phi)
    before, after = _beside(values, points, own, linear, found.low_pass, plain)
    return after.wave - before.wave


def _beside(
    values: Values,
    points: Operating,
    own: Sequence[Change],
    linear: Changes,
    low_pass: LowPass,
    plain: State,
) -> tuple[State, State]:
    """Return the filtered linear ring without and with its changes; `plain` is pressed or both."""
    before = strained(plain, (), low_pass) if plain.waveform is None else plain
    with_them = plain
    if _damped(values) or any(stage == "constants" for stage, _ in linear):
        every = [*(("constants", change) for change in own), *linear]
        with_them = pressed(State.of(values, points, plain.phi), every)
    return before, strained(with_them, linear, low_pass)


def _at_gage(found: Solution, shown: FloatArray, changes: Changes) -> FloatArray:
    """Return a waveform (n_points, n_phi) after the effects at the gage."""
    if not any(stage == "gage" for stage, _ in changes):
        return shown
    state = State.of(found.values, found.points, found.phi)
    return apply(state.but(deflection=found.deflection, waveform=shown), changes, "gage").wave


def _through_gage(found: Solution, rows: FloatArray) -> FloatArray:
    """Return small changes (k, n_points, n_phi) of the waveform as the gage shows them."""
    if not any(stage == "gage" for stage, _ in found.changes):
        return rows
    size = SMALL * float(np.abs(found.shown).max())
    out = []
    for row in rows:
        step = size / max(float(np.abs(row).max()), 1e-300)
        moved = _at_gage(found, found.shown + step * row, found.changes)
        out.append((moved - found.waveform) / step)
    return np.stack(out)


def _towards(
    found: Solution,
    there: Sequence[tuple[Values, Operating, Changes]],
    steps: float | Sequence[float],
) -> tuple[FloatArray, RolledSlopes]:
    """Return slopes of the filtered waveform before the gage, and of the rolling ring."""
    depth = found.rolling.deflection
    moved = [made_with(v, p, _split(v, p, changes)[0], depth) for v, p, changes in there]
    each = [*np.broadcast_to(np.asarray(steps, dtype=float), (len(there),)).tolist()]
    own = _split(found.values, found.points, found.changes)[0]
    deeper = made_with(found.values, found.points, own, depth + DEPTH_STEP)
    follow = not _same(deeper.constants, found.made.constants)
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


def _followed(
    values: Values,
    points: Operating,
    constants: Sequence[Change],
    start: Rolling | Unknowns | None,
) -> tuple[Rolling, Made]:
    """Return the rolling ring whose constants follow its deflection."""
    depth = np.full(len(points), FIRST_DEPTH)
    if start is not None:
        depth = start.depth if isinstance(start, Unknowns) else start.deflection
    before: tuple[FloatArray, FloatArray] | None = None
    for _ in range(SETTLE):
        made = made_with(values, points, constants, depth)
        start = solve(made.constants, start=start)
        found = start.deflection
        off = float(np.abs(found - depth).max())
        if off < SETTLED:
            return start, made
        if _same(made_with(values, points, constants, found).constants, made.constants):
            return start, made
        assumed, depth = depth, crossing(depth, found, before)
        before = assumed, found
    raise ConvergenceError(
        f"model: after {SETTLE} passes, constants that follow the deflection still change it by "
        f"{off:.2g} m; an effect follows it too steeply: use a smaller strength",
        found,
        off,
    )


def _split(
    values: Values, points: Operating, changes: Changes
) -> tuple[list[Change], list[tuple[str, Change]]]:
    """Return changes of the rolling ring's constants, and those that act on the linear one."""
    own: list[Change] = []
    linear: list[tuple[str, Change]] = []
    if not changes:
        return own, linear
    state = State.of(values, points, GRID).but(deflection=np.full(len(points), FIRST_DEPTH))
    for stage, change in changes:
        if stage == "constants":
            after = change(state)
            if all(getattr(after, name) is getattr(state, name) for name in LINEAR_ONLY):
                own.append(change)
            else:
                linear.append((stage, change))
        elif stage != "gage":
            linear.append((stage, change))
    return own, linear


def _same(a: Constants, b: Constants) -> bool:
    return all(
        np.array_equal(getattr(a, field.name), getattr(b, field.name)) for field in fields(a)
    )
