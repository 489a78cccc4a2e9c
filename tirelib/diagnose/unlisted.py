"""What no catalogue holds but gages often do: a gain that goes with a condition of the run.

Each is ranked beside the effects, so that what it explains is not taken for one of them, and is
never named: a residual that it explains better than any effect lacks none of these.
"""

from collections.abc import Sequence

from tirelib.arrays import FloatArray
from tirelib.effects.effect import Effect, State, effect
from tirelib.identify.discrepancy import REFERENCE_LOAD, REFERENCE_OMEGA, REFERENCE_PRESSURE


def _with_gain(state: State, share: FloatArray) -> State:
    return state.but(waveform=state.waveform * (1.0 + share)[:, None])


@effect(
    "gain_by_load",
    stage="gage",
    unit="1",
    low=-0.1,
    high=0.1,
    varies_with=("load",),
    source="bond or gage that carries less the more it is strained (assumed size)",
)
def gain_by_load(state: State, strength: float) -> State:
    """Gain of the gages that goes with the load."""
    return _with_gain(state, strength * (state.conditions.load / REFERENCE_LOAD - 1.0))


@effect(
    "gain_by_pressure",
    stage="gage",
    unit="1",
    low=-0.2,
    high=0.2,
    varies_with=("pressure",),
    source="gage or amplifier that feels the inflation pressure (assumed size)",
)
def gain_by_pressure(state: State, strength: float) -> State:
    """Gain of the gages that goes with the inflation pressure."""
    return _with_gain(state, strength * (state.conditions.pressure / REFERENCE_PRESSURE - 1.0))


@effect(
    "gain_by_speed",
    stage="gage",
    unit="1",
    low=-0.1,
    high=0.1,
    varies_with=("speed",),
    source="amplifier that loses gain with frequency (assumed size)",
)
def gain_by_speed(state: State, strength: float) -> State:
    """Gain of the gages that goes with the speed."""
    return _with_gain(state, strength * (state.conditions.omega / REFERENCE_OMEGA - 1.0))


UNLISTED: tuple[Effect, ...] = (gain_by_load, gain_by_pressure, gain_by_speed)
"""Every one of them."""


def with_unlisted(effects: Sequence[Effect]) -> list[Effect]:
    """Return effects and, behind them, those in no catalogue whose names are not taken."""
    names = {effect.name for effect in effects}
    return [*effects, *(each for each in UNLISTED if each.name not in names)]
