"""Tire to waveform, in stages; effects change the state between them.

sidewall, belt, inertia, tread  constants of ring and tread
contact                         belt displacement, after the radial contact is solved
strain                          harmonics of the innerliner strain
gage                            the waveform that the gage and its filter give
"""

from collections.abc import Callable, Sequence

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.contact import radial
from tirelib.model.state import State
from tirelib.ring.compliance import compliance
from tirelib.signal import LowPass
from tirelib.strain.innerliner import strain_harmonics

STAGES = ("constants", "contact", "strain", "gage")
Change = Callable[[State], State]
Changes = Sequence[tuple[str, Change]]
"""Stage and change, in the order in which they act."""

N_MODES = 60
N_NODES = 24
SETTLE = 30
"""Most passes that let constants follow the deflection that they cause."""
SETTLED = 1e-9
"""Change of the deflection at which they have followed, [m]."""


def waveform(state: State, changes: Changes = (), *, low_pass: LowPass | None = None) -> State:
    """Return the state with contact, strain and waveform computed.

    Parameters
    ----------
    state : State
        Constants at every operating point. `deflection` may hold that of the solution without
        changes; else it is computed when a change needs it.
    changes : sequence of (stage, change)
    low_pass : LowPass
        The filter of the measured waveform; the default is that of the signal chain.

    Raises
    ------
    ParameterError, ConvergenceError
        From ring and contact.
    """
    constants = [change for stage, change in changes if stage == "constants"]
    if constants and np.isnan(state.deflection).any():
        state = state.but(deflection=_press(state).deflection)
    solved = state
    for _ in range(SETTLE if constants else 1):
        before = solved.deflection
        changed = state.but(deflection=before)
        for change in constants:
            changed = change(changed)
        contact = _press(changed)
        solved = changed.but(
            contact=contact, belt=contact.displacement, deflection=contact.deflection
        )
        if np.abs(contact.deflection - before).max() < SETTLED:
            break
    solved = _apply(solved, changes, "contact")
    assert solved.belt is not None  # noqa: S101 - set above
    solved = solved.but(strain=strain_harmonics(solved.belt, solved.radius, solved.offset))
    solved = _apply(solved, changes, "strain")
    solved = solved.but(waveform=_filtered(solved, low_pass or LowPass()))
    return _apply(solved, changes, "gage")


def _press(state: State) -> radial.RadialContact:
    return radial.load(
        compliance(state.ring, state.conditions.omega, N_MODES),
        state.tread,
        state.conditions.load,
        n_nodes=N_NODES,
    )


def _apply(state: State, changes: Changes, stage: str) -> State:
    for at, change in changes:
        if at == stage:
            state = change(state)
    return state


def _filtered(state: State, low_pass: LowPass) -> FloatArray:
    """Return the strain as the signal chain gives it: Gaussian low-pass, mean over the turn off."""
    assert state.strain is not None  # noqa: S101 - set by the caller
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
