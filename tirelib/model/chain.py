"""Tire to waveform, in stages; effects change the state between them.

sidewall, belt, inertia, tread  constants of ring and tread
contact                         belt displacement, after the radial contact is solved
strain                          harmonics of the innerliner strain
gage                            the waveform that the gage and its filter give
"""

from collections.abc import Callable, Sequence
from itertools import takewhile

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError
from tirelib.effects.state import CONSTANTS, State
from tirelib.measured.signal import LowPass
from tirelib.physics.contact import radial
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.strain.innerliner import strain_harmonics

STAGES = ("constants", "contact", "strain", "gage")
Change = Callable[[State], State]
Changes = Sequence[tuple[str, Change]]
"""Stage and change, in the order in which they act."""
Course = Sequence[tuple[Change, State]]
"""Changes in the order in which they act, each with the state after it."""

N_MODES = 60
N_NODES = 24
SETTLE = 30
"""Most passes that let constants follow the deflection that they cause."""
FIRST_DEPTH = 0.02
"""Deflection for which constants are computed at first, [m]."""
SETTLED = 1e-9
"""Change of the deflection at which they have followed, [m]."""
STEEPEST = 0.9
"""Largest slope of the deflection found by that assumed that a guess of where they meet trusts."""


def waveform(state: State, changes: Changes = (), *, low_pass: LowPass | None = None) -> State:
    """Return the state with contact, strain and waveform computed.

    Parameters
    ----------
    state : State
        Constants at every operating point. `deflection` may hold that of the solution without
        changes: a start for changes that need it.
    changes : sequence of (stage, change)
    low_pass : LowPass
        The filter of the measured waveform; the default is that of the signal chain.

    Raises
    ------
    ParameterError, ConvergenceError
        From ring and contact.
    """
    solved = strained(pressed(state, changes), changes, low_pass or LowPass())
    return apply(solved, changes, "gage")


def pressed(state: State, changes: Changes) -> State:
    """Return the state with its contact, whose deflection the changed constants follow."""
    constants = [change for stage, change in changes if stage == "constants"]
    depth = np.where(np.isnan(state.deflection), FIRST_DEPTH, state.deflection)
    changed = at_depth(state, constants, depth)
    before: tuple[FloatArray, FloatArray] | None = None
    for _ in range(SETTLE):
        contact = _press(changed)
        found = contact.deflection
        off = float(np.abs(found - depth).max())
        if off < SETTLED or _alike(changed, at_depth(state, constants, found)):
            break
        assumed, depth = depth, crossing(depth, found, before)
        before = assumed, found
        changed = at_depth(state, constants, depth).but(start=contact.start)
    else:
        raise ConvergenceError(
            f"model: after {SETTLE} passes, constants that follow the deflection still change it "
            f"by {off:.2g} m; an effect follows it too steeply: use a smaller strength",
            found,
            off,
        )
    return changed.but(contact=contact, belt=contact.displacement, deflection=found)


def strained(state: State, changes: Changes, low_pass: LowPass) -> State:
    """Return a pressed state with the filtered waveform that effects at the gage act on."""
    return filtered(course(state, changes)[-1][1], low_pass)


def course(state: State, changes: Changes, known: Course = ()) -> list[tuple[Change, State]]:
    """Return every change from the pressed state to the strain, with the state after it.

    `known` is the course of other changes from the same state: states up to the first change that
    differs are taken from there.
    """
    contact, strain = ([c for at, c in changes if at == stage] for stage in ("contact", "strain"))
    every = [*contact, _with_strain, *strain]
    same = list(takewhile(lambda pair: pair[0] is pair[1][0], zip(every, known, strict=False)))
    out = [each for _, each in same]
    for change in every[len(out) :]:
        state = change(out[-1][1] if out else state)
        out.append((change, state))
    return out


def _with_strain(state: State) -> State:
    return state.but(strain=strain_harmonics(state.belt, state.radius, state.offset))


def crossing(
    assumed: FloatArray, found: FloatArray, before: tuple[FloatArray, FloatArray] | None
) -> FloatArray:
    """Return where each point's found deflection will be the assumed one, by the last two."""
    if before is None:
        return found
    step = assumed - before[0]
    moves = np.abs(step) > SETTLED
    slope = np.divide(found - before[1], step, out=np.zeros_like(step), where=moves)
    out: FloatArray = assumed + (found - assumed) / (1.0 - np.minimum(slope, STEEPEST))
    return out


def at_depth(state: State, constants: Sequence[Change], depth: FloatArray) -> State:
    """Return the state with changed constants, for a deflection (n_points,) that they follow."""
    state = state.but(deflection=depth)
    for change in constants:
        state = change(state)
    return state


def _alike(a: State, b: State) -> bool:
    """Return whether two states have the same constants, whatever their deflections."""
    pairs = [(getattr(a, name), getattr(b, name)) for name in CONSTANTS]
    pairs.append((a.ring.radial_stiffness, b.ring.radial_stiffness))
    return all(x is y or np.array_equal(x, y, equal_nan=True) for x, y in pairs)


def _press(state: State) -> radial.RadialContact:
    return radial.load(
        compliance(state.ring, state.conditions.omega, N_MODES),
        state.tread,
        state.conditions.load,
        n_nodes=N_NODES,
        start=state.start,
    )


def apply(state: State, changes: Changes, stage: str) -> State:
    """Return the state after the changes of one stage."""
    for at, change in changes:
        if at == stage:
            state = change(state)
    return state


def filtered(state: State, low_pass: LowPass) -> State:
    """Return a state with strain with the waveform that the low-pass filter leaves of it."""
    return state.but(waveform=_waveform(state, low_pass))


def _waveform(state: State, low_pass: LowPass) -> FloatArray:
    """Return the strain as the signal chain gives it: Gaussian low-pass, mean over the turn off."""
    n = np.arange(1, state.strain.shape[1])
    sigma = np.broadcast_to(low_pass.sigma(1.0), (state.strain.shape[0],))
    if low_pass.cut_off is not None:
        turn_rate = state.conditions.omega / (2.0 * np.pi)
        sigma = np.array([low_pass.sigma(rate) for rate in turn_rate])
    gain = np.exp(-0.5 * (sigma[:, None] * n) ** 2)
    terms = state.strain[:, 1:] * gain
    angle = n[:, None] * state.phi
    out: FloatArray = terms.real @ np.cos(angle) - terms.imag @ np.sin(angle)
    return out
