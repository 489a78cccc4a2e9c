"""What an FMU logs, once of each kind, where a turn is out of range: value, range and remedy.

`TEXTS` is the one place where the texts stand: the Python FMU fills them in here, the compiled one
reads them from its resources and fills them in by ``fmu_src/core/remarks.c``.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.flags import TurnFlag
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.chain import Chain
from tirelib.estimators.estimate import QUANTITIES
from tirelib.estimators.polynomial import Range
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.unknowns import PLAUSIBLE
from tirelib.measured.signal.quality import UNUSABLE
from tirelib.measured.signal.turns import LARGEST_OMEGA_RATIO
from tirelib.stream.estimate import TurnEstimate

_RANGE = "= {value}; calibrated are {low} .. {high}; not valid beyond: calibrate there, or check"
_HOLDS = "= {value}; the calibration holds for {low} .. {high}; not valid beyond: give it in"
_CAN_BE = "= {value}; allowed are {low} .. {high}; nothing is valid beyond: give it in"
TEXTS: Mapping[str, str] = {
    "friction_implausible": f"friction [1] {_CAN_BE} shares of the load, or leave it NaN",
    "tread_depth_implausible": f"tread_depth [m] {_CAN_BE} metres, or leave it NaN",
    "tread_temperature_implausible": f"tread_temperature [K] {_CAN_BE} kelvin, or leave it NaN",
    "pressure_out_of_range": f"gauge pressure [Pa] {_HOLDS} pascal, or calibrate there",
    "speed_out_of_range": f"speed [m/s] {_HOLDS} metres per second, or calibrate there",
    "camber_out_of_range": f"camber [rad] {_HOLDS} radians, or calibrate there",
    "omega_mismatch": "omega [rad/s] = {value}; by the contacts it is {low} .. {high}; nothing is "
    "valid: give rad/s, positive forward, or NaN; or check sample_rate",
    "Fz_out_of_range": f"Fz [N] {_RANGE} the unit of the strain",
    "alpha_out_of_range": f"alpha [rad] {_RANGE} the order of the gages",
    "kappa_out_of_range": f"kappa [1] {_RANGE} the unit of the speed",
    "Fy_out_of_range": f"Fy [N] {_RANGE} the order of the gages",
    "strain_out_of_range": f"{{name}} {_RANGE} unit and order of the gages",
    "combination_out_of_range": "no calibrated turn was near this combination of load, slip and "
    "side force; not valid there: calibrate there",
    "other_tire": "the gages do not show what they show of the calibrated tire; nothing is valid: "
    "check tire, order and wiring of the gages",
    "strain_implausible": "strain [1] = {value}; allowed are {low} .. {high}; nothing is valid "
    "beyond: give it as a ratio, 1e-6 for a microstrain",
    "step_too_long": "samples of a step [1] = {value}; a frame holds {low} .. {high}; the others "
    "are missing: build with --samples-per-step {value}, or step by fewer",
}
"""By kind, in the order of ``remarks.h``. SI, as the inputs and outputs are; short enough for a
line of the bench's page."""


MOST_STRAIN = 1.0
"""Largest strain of a frame, [1], which the model description states as the limit of the inputs."""


@dataclass(frozen=True, slots=True)
class Remark:
    """A value, the range that it is not in, and the name of what it is where that may be many."""

    value: float
    low: float
    high: float
    name: str = ""

    def text(self, kind: str) -> str:
        """Return what is logged."""
        given = {name: f"{getattr(self, name):g}" for name in ("value", "low", "high")}
        return f"{kind}: {TEXTS[kind].format(name=self.name, **given)}"


def lines() -> list[str]:
    """Return the texts for the compiled FMU, in the order of `TEXTS`."""
    return [f"{kind}: {text}" for kind, text in TEXTS.items()]


def strain_remark(sample: Sequence[float]) -> dict[str, Remark]:
    """Return what cannot be strain in a sample of all gages."""
    for value in sample:
        if MOST_STRAIN < abs(value) < math.inf:
            return {"strain_implausible": Remark(value, -MOST_STRAIN, MOST_STRAIN)}
    return {}


def step_remark(count: int, samples: int) -> dict[str, Remark]:
    """Return whether a step brings more samples than a frame holds."""
    return {"step_too_long": Remark(count, 1, samples)} if count > samples else {}


def remarks(
    known: Calibration, turn: TurnEstimate, sides: Sequence[float], omega: float
) -> dict[str, Remark]:
    """Return by kind what of a turn is out of range; of what is estimated, where no input is.

    Parameters
    ----------
    sides : sequence of float
        Sign of each of `QUANTITIES` in the axes of the FMU.
    omega : float, [rad/s]
        Turn rate that is given now.
    """
    notes, chain = set(turn.estimates.notes[0]), _chain_of(known, turn)
    found = dict(_given(known, turn, notes))
    if turn.flags & TurnFlag.OMEGA_MISMATCH:
        rate = math.copysign(2.0 * np.pi / turn.features.period[0], turn.features.speed[0])
        low, high = sorted((rate / LARGEST_OMEGA_RATIO, rate * LARGEST_OMEGA_RATIO))
        found["omega_mismatch"] = Remark(omega, low, high)
    if turn.flags & TurnFlag.OTHER_TIRE:
        found["other_tire"] = Remark(math.nan, math.nan, math.nan)
    out = [quantity for quantity in QUANTITIES if f"{quantity}_out_of_range" in notes]
    if found or not out or chain is None:
        return found
    for quantity, side in zip(QUANTITIES, sides, strict=True):
        for guard in chain.guards[quantity] if quantity in out else ():
            value, (low, high) = turn.value(quantity), _ends(guard)
            if guard.name == quantity and (value < low or value > high):
                low, high = sorted((side * low, side * high))
                found[f"{quantity}_out_of_range"] = Remark(side * value, low, high)
    return found or dict([_of_strain(chain, turn, out)])


def _chain_of(known: Calibration, turn: TurnEstimate) -> Chain | None:
    """Return the chain of the gages that work."""
    out = np.flatnonzero(turn.features.gage_flags[0] & int(UNUSABLE))
    return None if out.size > 1 else known.chains.get(int(out[0]) if out.size else -1)


def _ends(guard: Range) -> tuple[float, float]:
    return guard.low - guard.slack, guard.high + guard.slack


def condition_ends(known: Calibration) -> dict[str, tuple[float, float]]:
    """Return by kind the ends of each condition beyond which nothing is valid, SI."""
    full = known.chains[-1]
    laws = (full.laws, full.force_laws) if full.has("Fy") else (full.laws,)
    ends = {f"{name}_implausible": full.road.ends[name] for name in PLAUSIBLE}
    for name in ("pressure", "speed"):
        low, high = np.array([getattr(law, f"{name}_range") for law in laws]).T
        ends[f"{name}_out_of_range"] = np.fmax.reduce(low), np.fmin.reduce(high)
    for guard in full.guards["Fy"]:
        if guard.name == "camber":
            ends["camber_out_of_range"] = _ends(guard)
    return ends


def _given(known: Calibration, turn: TurnEstimate, notes: set[str]) -> Iterator[tuple[str, Remark]]:
    """Yield the conditions that cannot be, or that the calibration does not hold for."""
    features = turn.features
    for kind, (low, high) in condition_ends(known).items():
        if kind in notes:
            name = kind.removesuffix("_implausible").removesuffix("_out_of_range")
            yield kind, Remark(float(getattr(features, name)[0]), low, high)


def _of_strain(chain: Chain, turn: TurnEstimate, out: Sequence[str]) -> tuple[str, Remark]:
    """Return the first number read from the strain that is out of its range, if one is."""
    values = {k: float(x[0]) for k, x in compute_regressors(turn.features, chain.gages).items()}
    load = turn.value("Fz")
    values["utilisation"] = turn.value("Fy") / load if load else math.nan
    for guard in (guard for quantity in out for guard in chain.guards[quantity]):
        value, (low, high) = values.get(guard.name, math.nan), _ends(guard)
        if value < low or value > high:
            return "strain_out_of_range", Remark(value, low, high, guard.name)
    return "combination_out_of_range", Remark(math.nan, math.nan, math.nan)
