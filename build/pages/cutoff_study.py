"""Effect of the low-pass cut-off on the features, at several speeds.

For each speed the same record is cut into turns with a row of cut-offs. **Scatter** is the
standard deviation of a feature over the turns of the run, pooled over the gages: noise. **Shift**
is the change of its mean from the value at the default order: smearing. The change with order alone
is a property of the contact, the same at every speed; a cut-off in Hz means another order at every
speed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.campaign import Campaign, Run, RunPlan
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.core.flags import TurnFlag
from tirelib.measured.features.extract import Features, extract_features
from tirelib.measured.signal import LowPass, cut_turns
from tirelib.measured.signal.lowpass import SUITABLE_ORDERS

ORDERS = np.geomspace(1.05 * SUITABLE_ORDERS[0], SUITABLE_ORDERS[1] / 1.05, 15)
"""Cut-offs that are tried, cycles per turn: all that are allowed; others give no features."""
SPEEDS = (10.0 / 3.6, 65.0 / 3.6, 150.0 / 3.6)
FIXED = 300.0
SPOILT = int(TurnFlag.FIRST_TURN | TurnFlag.PERIOD_JUMP | TurnFlag.TOO_FEW_GAGES)


@dataclass(frozen=True, slots=True)
class CutOffStudy:
    """Features over the cut-off; arrays have shape (n_speeds, n_orders) unless stated otherwise.

    Attributes
    ----------
    speed : shape (n_speeds,), [m/s]
    turn_rate : shape (n_speeds,), [1/s]
    order : shape (n_orders,), [cycles per turn]
    angle_shift, angle_scatter : [rad]
    cp1_shift, cp1_scatter : [-]
        NaN where the cut-off is refused: it does not suit the turn rate or the sample rate.
    fixed_angle_shift, fixed_cp1_shift : shape (n_speeds,)
        Shift at 300 Hz; NaN where that is refused.
    """

    speed: FloatArray
    turn_rate: FloatArray
    order: FloatArray
    angle_shift: FloatArray
    angle_scatter: FloatArray
    cp1_shift: FloatArray
    cp1_scatter: FloatArray
    fixed_angle_shift: FloatArray
    fixed_cp1_shift: FloatArray


def nearest_runs(campaign: Campaign, speeds: Sequence[float] = SPEEDS) -> list[RunPlan]:
    """Return for each speed, [m/s], the straight free-rolling run nearest to it, each run once.

    All are at one load and pressure: those at which the speed was varied most.
    """
    groups: dict[tuple[float, float], list[RunPlan]] = {}
    for plan in campaign.plans:
        if plan.kind == "free":
            groups.setdefault((plan.load, plan.pressure), []).append(plan)
    if not groups:
        return []
    free = max(groups.values(), key=lambda plans: np.ptp([plan.speed for plan in plans]))
    found = [min(free, key=lambda plan: abs(plan.speed - speed)) for speed in speeds]
    return list({plan.run: plan for plan in found}.values())


def study_cut_off(campaign: Campaign, plans: Sequence[RunPlan]) -> CutOffStudy:
    """Cut each run again and again with other cut-offs.

    Raises
    ------
    CalibrationError
        If a run holds fewer than two usable turns.
    """
    results = [_one_run(campaign, plan) for plan in plans]
    tables = [np.stack([row[name] for row in results]) for name in range(4)]
    fixed = np.stack([row[4] for row in results])
    return CutOffStudy(
        speed=np.array([plan.speed for plan in plans]),
        turn_rate=np.array([row[5] for row in results]),
        order=ORDERS,
        angle_shift=tables[0],
        angle_scatter=tables[1],
        cp1_shift=tables[2],
        cp1_scatter=tables[3],
        fixed_angle_shift=fixed[:, 0],
        fixed_cp1_shift=fixed[:, 1],
    )


def _one_run(
    campaign: Campaign, plan: RunPlan
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, float]:
    run = campaign.load(plan)
    reference = _features(run, campaign, LowPass())
    turns = np.flatnonzero(
        ((reference.flags & SPOILT) == 0) & np.isfinite(reference.lead).all(axis=1)
    )
    if turns.size < 2:
        raise CalibrationError(
            f"{campaign.header.name}, run {plan.run}: {turns.size} usable turns; the cut-off study "
            "needs two; measure longer"
        )
    rate = float(1.0 / np.mean(reference.period[turns]))
    base = _statistics(reference, turns)
    rows = np.full((ORDERS.size, 4), np.nan)
    for i, order in enumerate(ORDERS):
        if order * rate < run.rate / 2.0:
            found = _statistics(_features(run, campaign, LowPass(cut_off=order * rate)), turns)
            rows[i] = found[0] - base[0], found[1], found[2] - base[2], found[3]
    at_fixed = _statistics(_features(run, campaign, LowPass(cut_off=FIXED)), turns)
    shift = np.array([at_fixed[0] - base[0], at_fixed[2] - base[2]])
    return rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3], shift, rate


def _features(run: Run, campaign: Campaign, low_pass: LowPass) -> Features:
    if run.strain is None:
        raise CalibrationError(
            f"{campaign.header.name}, run {run.plan.run}: the file holds no strain; "
            "strain_1 .. strain_N are needed"
        )
    return extract_features(
        cut_turns(run.strain, run.rate, campaign.header.gage_lateral, low_pass=low_pass)
    )


def _statistics(
    features: Features, turns: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> tuple[float, float, float, float]:
    """Mean and scatter of contact angle and CP1 over turns, pooled over gages.

    NaN where fewer than two turns have them: a cut-off far from the turn rate gives no features.
    """
    turns = turns[turns < len(features)]
    angle, cp1 = features.contact_angle[turns], features.cp1[turns]

    if (np.isfinite(angle) & np.isfinite(cp1)).all(axis=1).sum() < 2:  # a cut-off that is refused
        return np.nan, np.nan, np.nan, np.nan

    def scatter(x: FloatArray) -> float:
        return float(np.sqrt(np.nanmean(np.nanvar(x, axis=0, ddof=1))))

    return float(np.nanmean(angle)), scatter(angle), float(np.nanmean(cp1)), scatter(cp1)
