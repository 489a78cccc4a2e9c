"""Hold the estimates of a co-simulation against the truth, turn by turn.

An estimate is of one contact, and is held against the truth at the middle of that contact; the slip
ratio too, as the wheel's turn rate is told as it is there. A turn is **steady** when, from the
contact before to the moment of output, the truth of every quantity has changed by less than
`STEADY`: the change that the figures to reach allow as an error. All other turns are transient.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from cosim.recording import STATES, TIME_STEP, Recording
from cosim.wheels import OWN_FRICTION, WHEELS
from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.fmu.virtual.coordinates import FRICTION, half_angle
from tirelib.fmu.virtual.drive import ALPHA, CAMBER, DRIVING, KAPPA, LOAD, SPEED
from tirelib.fmu.virtual.spec import friction_surface
from tirelib.fmu.virtual.surface import Surface, read_surface
from tirelib.measured.signal.lowpass import DEFAULT_ORDER, HALF_POWER, SUPPORT

LIMITS: Mapping[str, float] = MappingProxyType({"Fz": 3.0, "alpha": 0.25, "kappa": 0.01, "Fy": 5.0})
"""Error (rms) to reach: Fz [% of static load], alpha [deg], kappa [1], Fy [% of peak]."""
STEADY: Mapping[str, float] = MappingProxyType(
    {"Fz": 0.03, "alpha": np.radians(0.25), "kappa": 0.01}
)
"""Change of the truth within a turn up to which the turn is steady; Fz as a share of static."""
WITHIN: Mapping[str, float] = MappingProxyType({"alpha": np.radians(6.0), "kappa": 0.1})
"""Truth up to which the figures bind."""
LEAST_PEAK = 0.1
"""A peak of Fy below this share of the static load is no cornering; this share stands for it."""
COVERED = 0.9
"""Share of turns that the 95 % interval must hold on a road of another friction."""
INTERVAL = 1.96
"""Half-width of the 95 % interval in standard deviations."""
AFTER = np.radians(20.0)
FILTER = SUPPORT * HALF_POWER / DEFAULT_ORDER
"""Half-width of the low-pass [rad]."""
RANGE: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "Fz": LOAD,
        "alpha": (-ALPHA, ALPHA),
        "kappa": (-KAPPA, DRIVING),
        "camber": (-CAMBER, CAMBER),
        "speed": SPEED,
    }
)
"""What the calibration has seen."""
SLACK = 0.1
"""Share of the range beyond it in which neither answer of `valid` is wrong."""


@dataclass(frozen=True, slots=True)
class Turns:
    """The estimates of one wheel, one row a turn; the first turn, which has no estimate, is out.

    Attributes
    ----------
    row : int array, shape (n,)
        Row of the recording at whose end the estimate came.
    contact : array, shape (n,), [s]
        Middle of the contact.
    told, std, truth : dict of arrays, shape (n,)
        Estimate, its standard deviation, and truth of Fz [N], alpha [rad], kappa [1], Fy [N].
    valid : dict of bool arrays, shape (n,)
        Whether each quantity may be used.
    steady : bool array, shape (n,)
    lag : array, shape (n,), [rad]
        Wheel angle from the trailing edge of the last gage to the output.
    allowed : array, shape (n,), [rad]
        Filter's half-width, 20 degrees, and one frame.
    """

    row: IntArray
    contact: FloatArray
    told: dict[str, FloatArray]
    std: dict[str, FloatArray]
    truth: dict[str, FloatArray]
    valid: dict[str, BoolArray]
    steady: BoolArray
    lag: FloatArray
    allowed: FloatArray


@cache
def _surface() -> Surface:
    return read_surface(friction_surface())


def turns_of(recording: Recording, wheel: int) -> Turns:
    """Return the turns of one wheel."""
    told = {name: values[:, wheel] for name, values in recording.told.items()}
    truth = {name: values[:, wheel] for name, values in recording.truth.items()}
    rows = np.flatnonzero(np.diff(told["turn"], prepend=0.0) > 0.0)
    contact = told["contact_time"][rows]
    known = np.flatnonzero(told["turn"][rows] > 1)
    rows, contact = rows[known], contact[known]
    at = np.clip((contact / TIME_STEP).astype(np.int64), 0, recording.time.size - 1)
    period = 2.0 * np.pi / told["tire_omega"][at]
    first = np.maximum(((contact - period) / TIME_STEP).astype(np.int64), 0)
    steady = np.ones(rows.size, dtype=np.bool_)
    for name, limit in STEADY.items():
        size = limit * (recording.static[wheel] if name == "Fz" else 1.0)
        spread = [
            np.ptp(truth[name][a : b + 1])
            for a, b in zip(first.tolist(), rows.tolist(), strict=True)
        ]
        steady &= np.array(spread) < size
    return Turns(
        row=rows,
        contact=contact,
        told={name: told[name][rows] for name in LIMITS},
        std={name: told[f"{name}_std"][rows] for name in LIMITS},
        truth={
            "Fz": truth["Fz"][at],
            "alpha": truth["alpha"][at],
            "kappa": truth["kappa"][at],
            "Fy": told["tire_fy"][at],
        },
        valid={name: told[f"{name}_valid"][rows] > 0.0 for name in LIMITS},
        steady=steady,
        lag=_lag(recording, wheel, at, rows),
        allowed=AFTER + FILTER + told["tire_omega"][rows] * TIME_STEP,
    )


def _lag(recording: Recording, wheel: int, at: IntArray, rows: IntArray) -> FloatArray:
    """Return the wheel angle from the trailing edge of the virtual tire to the output."""
    surface = _surface()
    felt = np.stack([recording.truth[name][at, wheel] for name in STATES], axis=1)
    felt[:, STATES.index("alpha")] = recording.told["tire_alpha"][at, wheel]
    felt[:, STATES.index("kappa")] = recording.told["tire_kappa"][at, wheel]
    lag = np.full(rows.size, np.nan)
    known = [i for i, state in enumerate(felt) if not surface.outside(state)]
    if known:
        count, gages = len(surface.basis), surface.lateral.size
        edges = surface.answers(felt[known])[:, count : count + 2 * gages]
        trailing = (edges[:, gages:] + half_angle(edges[:, :gages])).max(axis=1)
        lag[known] = recording.told["tire_angle"][rows[known], wheel] - trailing
    return lag


def errors(recording: Recording, wheel: int, turns: Turns, peak: float) -> dict[str, FloatArray]:
    """Return errors in the units of `LIMITS`; NaN where not valid, or no figure binds."""
    off = {
        name: np.where(turns.valid[name], turns.told[name] - turns.truth[name], np.nan)
        for name in LIMITS
    }
    for name, limit in WITHIN.items():
        off[name] = np.where(np.abs(turns.truth[name]) <= limit, off[name], np.nan)
    return {
        "Fz": 100.0 * off["Fz"] / recording.static[wheel],
        "alpha": np.degrees(off["alpha"]),
        "kappa": off["kappa"],
        "Fy": 100.0 * off["Fy"] / peak,
    }


def peak_force(recording: Recording) -> float:
    """Return the largest |Fy| of any wheel, but at least a tenth of the static load, [N]."""
    force = np.abs(recording.told["tire_fy"])
    return float(max(np.nanmax(force), LEAST_PEAK * recording.static.max()))


def _rms(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def score(recording: Recording) -> dict[str, Any]:
    """Return the figures of a recording: of every wheel and of all, steady and transient apart."""
    peak = peak_force(recording)
    turns = [turns_of(recording, wheel) for wheel in range(len(WHEELS))]
    off = [errors(recording, wheel, t, peak) for wheel, t in enumerate(turns)]
    wheels = {
        name: _figures([turns[at]], [off[at]]) | _validity(recording, [at])
        for at, name in enumerate(WHEELS)
    }
    whole = _figures(turns, off) | _validity(recording, list(range(len(WHEELS))))
    held = _held(recording, peak)
    return {
        "name": recording.name,
        "peak_Fy_N": peak,
        "least_friction": least_friction(recording),
        "all": whole | held,
        "wheels": wheels,
    }


def least_friction(recording: Recording) -> float:
    """Return the least friction under any wheel, as a factor of the calibrated road's."""
    return float(recording.truth[FRICTION].min() / OWN_FRICTION)


def covered(turns: list[Turns]) -> dict[str, dict[str, float]]:
    """Return for each quantity the share of valid turns, and of those that the interval holds."""
    found = {}
    for name in LIMITS:
        valid = np.concatenate([t.valid[name] for t in turns])
        off = np.concatenate([np.abs(t.told[name] - t.truth[name]) / t.std[name] for t in turns])
        found[name] = {
            "valid": float(valid.mean()) if valid.size else np.nan,
            "covered": float((off[valid] <= INTERVAL).mean()) if valid.any() else np.nan,
            "worst": float(off[valid].max()) if valid.any() else np.nan,
        }
    return found


def _figures(turns: list[Turns], off: list[dict[str, FloatArray]]) -> dict[str, Any]:
    steady = np.concatenate([t.steady for t in turns])
    every = {name: np.concatenate([o[name] for o in off]) for name in LIMITS}
    lag = np.concatenate([t.lag for t in turns])
    over = lag - np.concatenate([t.allowed for t in turns])
    age = np.concatenate([TIME_STEP * (t.row + 1) - t.contact for t in turns])
    found: dict[str, Any] = {"turns": int(steady.size)}
    for part, rows in (("steady", steady), ("transient", ~steady)):
        found[part] = {"turns": int(rows.sum())} | {
            name: _rms(values[rows]) for name, values in every.items()
        }
        found[part]["bias"] = {
            name: float(np.nanmean(values[rows])) if np.isfinite(values[rows]).any() else np.nan
            for name, values in every.items()
        }
    return found | {
        "interval": covered(turns),
        "age_ms": 1e3 * float(np.median(age)) if age.size else np.nan,
        "lag_deg": float(np.degrees(np.nanmax(lag))) if np.isfinite(lag).any() else np.nan,
        "over_deg": float(np.degrees(np.nanmax(over))) if np.isfinite(over).any() else np.nan,
    }


def _validity(recording: Recording, wheels: list[int]) -> dict[str, Any]:
    """Return shares of time: not valid though all is in range, `valid` though it is not.

    A false alarm is any quantity that is not valid. That `valid` is false while every quantity may
    be used (one gage is out) is counted apart.
    """
    alarm = missed = inside = outside = reduced = 0
    for wheel in wheels:
        good, bad = in_range(recording, wheel)
        valid = recording.told["valid"][:, wheel] > 0.0
        each = np.all([recording.told[f"{name}_valid"][:, wheel] > 0.0 for name in LIMITS], axis=0)
        started = recording.told["turn"][:, wheel] > 1
        reduced += int((good & started & each & ~valid).sum())
        inside += int((good & started).sum())
        alarm += int((good & started & ~each).sum())
        outside += int(bad.sum())
        missed += int((bad & valid).sum())
    return {
        "false_alarms": alarm / inside if inside else 0.0,
        "gage_out": reduced / inside if inside else 0.0,
        "out_of_range_s": TIME_STEP * outside,
        "missed_s": TIME_STEP * missed,
    }


def in_range(recording: Recording, wheel: int) -> tuple[BoolArray, BoolArray]:
    """Tell where the truth was in the calibrated range, and where outside, for two turns.

    A road of another friction is neither: what it does to an estimate depends on the slip.
    """
    n = recording.time.size
    inside, outside = np.ones(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    inside &= np.isclose(recording.truth[FRICTION][:, wheel], OWN_FRICTION)
    for name, (low, high) in RANGE.items():
        x, slack = recording.truth[name][:, wheel], SLACK * (high - low)
        inside &= (x >= low) & (x <= high)
        outside |= (x < low - slack) | (x > high + slack)
    omega = recording.told["tire_omega"][:, wheel]
    back = np.ceil(4.0 * np.pi / np.maximum(omega, 1.0) / TIME_STEP).astype(np.int64)
    return _lasting(inside, back), _lasting(outside, back)


def _lasting(flag: BoolArray, rows: IntArray) -> BoolArray:
    """Tell where a flag has been true for so many rows up to now."""
    number = np.arange(flag.size)
    last_false = np.maximum.accumulate(np.where(flag, -1, number))
    return np.asarray(number - last_false >= rows, dtype=np.bool_)


DELAYS = np.arange(0.0, 0.2, TIME_STEP)
STANDS_OUT = 0.8
"""A delay counts that brings the error below this share of that without delay."""


def _held(recording: Recording, peak: float) -> dict[str, Any]:
    """Return what a controller meets: error of the value held, and the delay that fits best."""
    scale = {
        "Fz": 100.0 / recording.static,
        "alpha": np.degrees(1.0),
        "kappa": 1.0,
        "Fy": 100.0 / peak,
    }
    truth = recording.truth | {"Fy": recording.told["tire_fy"]}
    found: dict[str, Any] = {"held": {}, "delay_ms": {}}
    for name, factor in scale.items():
        valid = recording.told[f"{name}_valid"] > 0.0
        off = np.where(valid, recording.told[name] - truth[name], np.nan) * factor
        found["held"][name] = _rms(off.ravel())
        change = np.ptp(truth[name] * factor, axis=0).max()
        if change < 4.0 * LIMITS[name]:
            found["delay_ms"][name] = np.nan
            continue
        shifted = []
        for rows in np.round(DELAYS / TIME_STEP).astype(int):
            late = recording.told[name][rows:] - truth[name][: truth[name].shape[0] - rows]
            shifted.append(_rms((np.where(valid[rows:], late, np.nan) * factor).ravel()))
        best = int(np.nanargmin(shifted))
        stands_out = shifted[best] < STANDS_OUT * shifted[0]
        found["delay_ms"][name] = 1e3 * float(DELAYS[best]) if stands_out else np.nan
    return found
