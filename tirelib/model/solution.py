"""The model of a tire with effects, solved at operating points: effects act on the rolling ring.

constants        change what the rolling ring is made of, and may follow its deflection
contact, strain  add what they change in the linear ring with the same constants
gage             change the filtered waveform

Modal damping, which the rolling ring has not, adds what it changes in the linear ring as well.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError
from tirelib.effects.state import Operating, State
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import smoothed
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
from tirelib.model.rolled import Made, made_of
from tirelib.physics.contact.free_boundary import Start
from tirelib.physics.rolling.assemble import Unknowns, differ
from tirelib.physics.rolling.constants import STIFFEST, Constants
from tirelib.physics.rolling.gage import Gage
from tirelib.physics.rolling.solve import Rolling, solve

Values = Mapping[str, float | FloatArray]
RING_CONSTANTS = (
    *("radius", "free_radius", "EI", "mass", "rotary_inertia", "k_u", "k_v"),
    *("softening", "dashpots", "k_t", "hardening", "thickness"),
)
"""Constants of the rolling ring that a state holds under the same name."""
LINEAR_ONLY = ("damping", "inertia_share")
"""Fields of a state that the rolling ring has not: a change of them acts on the linear ring."""


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
    own, linear = split(values, points, changes)
    rolling, made = _followed(values, points, own, start)
    shown = smoothed(rolling.strain(made.gage, phi.size), points, low_pass)
    found = Solution(values, points, changes, low_pass, rolling, made, shown, shown, phi)
    if linear or _damped(values):
        plain = ring_of(values, points, own, phi)
        before, after = beside(values, points, own, linear, low_pass, plain)
        shown = shown + after.wave - before.wave
        found = replace(found, linear=(before, after))
    return replace(found, shown=shown, waveform=shown_at_gage(found, shown, changes))


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
        **{name: getattr(after, name) for name in RING_CONSTANTS},
        EA=np.minimum(after.EA, STIFFEST),
        # a state's shear stiffness is the tire's less the tension
        GA=np.minimum(after.GA + before.belt_tension, STIFFEST),
        inflation=after.tension_pressure * after.width,
        tension=made.constants.tension + after.tension,
        half_width=0.5 * after.width,
    )
    spread = made.gage.spread * after.thickness / before.thickness
    return Made(k, Gage(after.offset, made.gage.liner, spread))


def _damped(values: Values) -> bool:
    return bool(np.any(values["damping"]))


def ring_of(
    values: Values,
    points: Operating,
    own: Sequence[Change],
    phi: FloatArray,
    start: Start | None = None,
) -> State:
    """Return the linear ring as the rolling one is: undamped, with the same constants."""
    state = State.of({**values, "damping": 0.0}, points, phi).but(start=start)
    return pressed(state, [("constants", change) for change in own])


def beside(
    values: Values,
    points: Operating,
    own: Sequence[Change],
    linear: Changes,
    low_pass: LowPass,
    plain: State,
) -> tuple[State, State]:
    """Return the filtered linear ring without and with its changes; `plain` is pressed or both."""
    before = strained(plain, (), low_pass) if plain.waveform is None else plain
    return before, strained(pressed_ring(values, points, own, linear, plain), linear, low_pass)


def pressed_ring(
    values: Values, points: Operating, own: Sequence[Change], linear: Changes, plain: State
) -> State:
    """Return the pressed linear ring with changes of its constants and its damping."""
    if not _damped(values) and all(stage != "constants" for stage, _ in linear):
        return plain
    every = [*(("constants", change) for change in own), *linear]
    return pressed(State.of(values, points, plain.phi), every)


def shown_at_gage(
    found: Solution, shown: FloatArray, changes: Changes, state: State | None = None
) -> FloatArray:
    """Return a waveform (n_points, n_phi) after the effects at the gage.

    `state` is that of `at_gage`, where many waveforms are shown.
    """
    if not any(stage == "gage" for stage, _ in changes):
        return shown
    state = at_gage(found) if state is None else state
    return apply(state.but(waveform=shown), changes, "gage").wave


def at_gage(found: Solution) -> State:
    """Return the state that effects at the gage find, without a waveform."""
    state = State.of(found.values, found.points, found.phi)
    return state.but(deflection=found.deflection)


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
        if same(made_with(values, points, constants, found).constants, made.constants):
            return start, made
        assumed, depth = depth, crossing(depth, found, before)
        before = assumed, found
    raise ConvergenceError(
        f"model: after {SETTLE} passes, constants that follow the deflection still change it by "
        f"{off:.2g} m; an effect follows it too steeply: use a smaller strength",
        found,
        off,
    )


def split(
    values: Values, points: Operating, changes: Changes
) -> tuple[list[Change], list[tuple[str, Change]]]:
    """Return changes of the rolling ring's constants, and those that act on the linear one."""
    return parts(changes, kinds_of(values, points, changes))


def kinds_of(values: Values, points: Operating, changes: Changes) -> list[str]:
    """Return what each change acts on: the rolling ring, the linear ring or the gage."""
    if not changes:
        return []
    state = State.of(values, points, GRID).but(deflection=np.full(len(points), FIRST_DEPTH))
    kinds = []
    for stage, change in changes:
        kind = "gage" if stage == "gage" else "linear"
        if stage == "constants":
            after = change(state)
            kept = all(getattr(after, name) is getattr(state, name) for name in LINEAR_ONLY)
            kind = "rolling" if kept else "linear"
        kinds.append(kind)
    return kinds


def parts(changes: Changes, kinds: Sequence[str]) -> tuple[list[Change], list[tuple[str, Change]]]:
    """Return changes of the rolling ring's constants, and those that act on the linear one."""
    pairs = list(zip(changes, kinds, strict=True))
    rolling = [change for (_, change), kind in pairs if kind == "rolling"]
    return rolling, [change for change, kind in pairs if kind == "linear"]


def same(a: Constants, b: Constants) -> bool:
    """Return whether two rolling rings are made of the same constants."""
    return not differ(a, b, Constants.__slots__)
