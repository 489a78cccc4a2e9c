r"""Checks over the runs: gages in the right order, Fy with the right sign, repeats.

How far the strain of a gage differs from the mean of all gages changes smoothly with the forces.
One linear model for the whole campaign says how,

.. math:: d_{i} = a_{i} + b_{i} F_y + c_{i} F_z + \ldots

with d the highest, middle and lowest strain of a turn of gage i. A run whose gages fit far better
in another order had its cables swapped. The slopes b belong to the lateral force alone and must
grow or fall steadily across the tire, since the force loads one shoulder and relieves the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.finding import RunFinding, finding
from tirelib.campaign.model import BoolArray, CampaignHeader, FloatArray, Run
from tirelib.campaign.turns import turn_samples, turn_stack

_FEATURES = 3  # highest, middle, lowest strain of a turn
_OUTLIER = 5.0  # rms of a run's residuals, in robust sigmas
_BETTER = 0.25  # the other order must cut the squared residual to this
_GOOD = 4.0  # and bring it to this rms
_STEADY = 6.0  # standard errors by which a slope must be out of order
_CLEAR = 0.10  # and the share of the range of all slopes


@dataclass(frozen=True, slots=True, eq=False)
class RunSummary:
    """Values of one run that the checks over all runs need.

    Attributes
    ----------
    file, kind : str
    features : array, shape (3, n_gages), or None
        Highest, middle and lowest strain of a turn, median over the turns.
    conditions : array, shape (n_conditions,)
        Fy, Fz, camber, slip ratio, pressure, speed squared; each scaled to about 1.
    """

    file: str
    kind: str
    features: FloatArray | None
    conditions: FloatArray


def summary_of(run: Run, header: CampaignHeader, *, sound: bool) -> RunSummary:
    """Return the summary of a run; without features unless its gages are `sound`."""
    features = None
    samples = turn_samples(run, header) if sound and run.strain is not None else None
    if run.strain is not None and samples is not None and run.plan.kind != "sweep":
        stack = turn_stack(run.strain, samples)
        if stack is not None and np.isfinite(stack).all():
            by_turn = [np.max(stack, axis=2), np.median(stack, axis=2), np.min(stack, axis=2)]
            features = np.median(np.stack(by_turn), axis=2)
    return RunSummary(run.plan.file, run.plan.kind, features, _conditions(run))


def _conditions(run: Run) -> FloatArray:
    plan = run.plan
    load = run.mean("Fz")
    load = plan.load if load is None else load
    angle = run.mean("slip_angle")
    lateral = run.mean("Fy")
    if lateral is None:  # the angle drives the force: same sign law, same shape for small angles
        lateral = -(plan.slip_angle if angle is None else angle) * 6e4
    pressure = run.mean("pressure")
    speed = run.mean("speed")
    return np.array(
        [
            lateral / 3e3,
            load / 5e3,
            plan.camber * 10.0,
            plan.slip_ratio,
            (plan.pressure if pressure is None else pressure) / 2e5,
            ((plan.speed if speed is None else speed) / 20.0) ** 2,
        ]
    )


def order_findings(
    summaries: Sequence[RunSummary], header: CampaignHeader
) -> tuple[list[RunFinding], list[CampaignFault]]:
    """Return runs with swapped gages, and a lateral order that the whole campaign contradicts."""
    usable = [s for s in summaries if s.features is not None and np.isfinite(s.conditions).all()]
    if not usable or len(header.gage_lateral) < 2:
        return [], []
    if len(usable) < 4:  # where faults of the runs are the reason, those come first
        few = [_unchecked(f"{len(usable)} run(s) with strain")]
        return [], few if len(usable) == len(summaries) else []
    features = np.stack([s.features for s in usable if s.features is not None])
    deviation = features - features.mean(axis=2, keepdims=True)
    regressors = _regressors(np.stack([s.conditions for s in usable]))
    coefficients, sigma, kept = _robust_fit(regressors, deviation)
    predicted = np.tensordot(regressors, coefficients, axes=1)
    found = [
        swap
        for summary, measured, model in zip(usable, deviation, predicted, strict=True)
        if (swap := _swapped(summary.file, measured, model, sigma)) is not None
    ]
    return found, _lateral_order(regressors[kept], coefficients, sigma, header)


def _regressors(conditions: FloatArray) -> FloatArray:
    """Return a constant, Fy, and as many other conditions as vary and the runs can carry.

    Squares and products are taken about the mean; what the columns before already say is left
    out, so that the slope of Fy stays its own.
    """
    lateral, load = conditions[:, 0], conditions[:, 1] - np.mean(conditions[:, 1])
    candidates = [*conditions.T, load**2, lateral * load]
    columns = [np.ones(len(conditions))]
    room = max(1, len(conditions) // 4)
    for candidate in candidates:
        basis = np.stack(columns, axis=1)
        rest = candidate - basis @ np.linalg.lstsq(basis, candidate, rcond=None)[0]
        news = float(np.std(rest))
        if news > 0.02 and news > 0.2 * float(np.std(candidate)) and len(columns) <= room:
            columns.append(candidate)
    return np.stack(columns, axis=1)


def _robust_fit(
    regressors: FloatArray, deviation: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    r"""Fit by least squares and leave out, one by one, the runs that do not belong.

    Leaving out run i lowers the sum of squares by :math:`|e_i|^2 / (1 - h_i)`, h its leverage, so
    a run with an extreme condition cannot hide by bending the fit towards itself. The one with
    the largest fall goes, as long as the others then leave it far outside.

    Returns
    -------
    coefficients : array, shape (n_regressors, 3, n_gages)
    sigma : array, shape (3, 1)
        Robust standard deviation of each feature.
    kept : bool array, shape (n_runs,)
    """
    kept = np.ones(len(deviation), dtype=bool)
    coefficients, residual, sigma = _fit(regressors, deviation, kept)
    while kept.sum() > max(4, regressors.shape[1] + 1, 0.7 * len(kept)):
        inside = np.flatnonzero(kept)
        columns = regressors[inside]
        leverage = np.sum(columns * np.linalg.pinv(columns).T, axis=1)
        squares = np.sum((residual[inside] / sigma) ** 2, axis=(1, 2))
        worst = inside[np.argmax(squares / np.maximum(1.0 - leverage, 1e-6))]
        without = kept.copy()
        without[worst] = False
        again = _fit(regressors, deviation, without)
        badness = _badness(again[1], again[2])
        if badness[worst] < max(_OUTLIER, 3.0 * float(np.median(badness[without]))):
            break
        kept = without
        coefficients, residual, sigma = again
    return coefficients, sigma, kept


def _fit(
    regressors: FloatArray, deviation: FloatArray, kept: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return coefficients, residuals of all runs, and the robust sigma of those kept."""
    flat = deviation.reshape(len(deviation), -1)
    solution = np.asarray(np.linalg.lstsq(regressors[kept], flat[kept], rcond=None)[0], np.float64)
    residual = deviation - (regressors @ solution).reshape(deviation.shape)
    # The median of the kept runs' sizes, widened for the freedom that the fit has used up.
    middle = np.median(np.abs(residual[kept]), axis=(0, 2))[:, None]
    freedom = np.sqrt(max(1.0 - regressors.shape[1] / float(kept.sum()), 0.1))
    sigma = np.maximum(1.4826 * middle / freedom, 1e-6 + 2e-3 * np.abs(deviation).max())
    return solution.reshape(-1, *deviation.shape[1:]), residual, np.asarray(sigma, np.float64)


def _badness(residual: FloatArray, sigma: FloatArray) -> FloatArray:
    """Return the rms of each run's residuals in sigmas."""
    mean_square: FloatArray = np.mean((residual / sigma) ** 2, axis=(1, 2))
    return np.sqrt(mean_square)


def _swapped(
    file: str, measured: FloatArray, model: FloatArray, sigma: FloatArray
) -> RunFinding | None:
    """Find the order of the gages in which a run fits best, if that is not the order it has."""
    cost = np.sum(((measured[:, None, :] - model[:, :, None]) / sigma[:, :, None]) ** 2, axis=0)
    here = float(np.trace(cost))
    count = measured.size
    if here < _OUTLIER**2 * count:
        return None
    channels = _best_order(cost)
    best = float(cost[np.arange(len(cost)), channels].sum())
    if best > min(_BETTER * here, _GOOD**2 * count):
        return None
    moved = [(int(p) + 1, int(c) + 1) for p, c in enumerate(channels) if p != c]
    names = ", ".join(f"strain_{channel}" for _, channel in sorted(moved, key=lambda pair: pair[1]))
    swaps = ", ".join(
        f"strain_{channel} fits the place of strain_{place}" for place, channel in moved
    )
    return finding(
        "swapped",
        file,
        names,
        f"swapped gages: against the other runs, {swaps} "
        f"(residual {np.sqrt(here / count):.0f} sigma, {np.sqrt(best / count):.1f} after the swap)",
        "a gage keeps its channel through a campaign",
        "exchange the channels in this run, or take it out of runs.csv",
    )


def _best_order(cost: FloatArray) -> list[int]:
    """Return the channel that fits each place; one exchange of two when that does nearly as well.

    Parameters
    ----------
    cost : array, shape (n_gages, n_gages)
        Squared residual of a channel (column) at a place (row).
    """
    from scipy.optimize import linear_sum_assignment  # slow to import, and rarely needed

    places, channels = linear_sum_assignment(cost)
    best = float(cost[places, channels].sum())
    here = np.diag(cost)
    pairs = cost + cost.T - here[:, None] - here[None, :]  # what an exchange adds
    first, second = np.unravel_index(int(np.argmin(pairs)), pairs.shape)
    order = list(range(len(cost)))
    if here.sum() + pairs[first, second] > 1.5 * best:
        return [int(channel) for channel in channels]
    order[first], order[second] = order[second], order[first]
    return order


def _lateral_order(
    regressors: FloatArray, coefficients: FloatArray, sigma: FloatArray, header: CampaignHeader
) -> list[CampaignFault]:
    """Find gages whose slope over the lateral force is out of the order of their positions."""
    force = regressors[:, 1] if regressors.shape[1] > 1 else np.zeros(len(regressors))
    if np.ptp(force) < 0.2 or force.min() > -0.05 or force.max() < 0.05:
        return [_unchecked("no runs with lateral force to both sides")]
    error = np.sqrt(np.linalg.pinv(regressors.T @ regressors)[1, 1])
    lateral = np.array(header.gage_lateral)
    order = np.argsort(lateral)
    votes = [
        _out_of_order(coefficients[1, feature][order], float(sigma[feature, 0] * error))
        for feature in (0, 2)
    ]
    agreed = sorted(set(votes[0]) & set(votes[1]))
    if not agreed:
        return []
    wrong = [int(order[place]) for place in agreed]
    names = ", ".join(f"strain_{gage + 1}" for gage in sorted(wrong))
    slopes = ", ".join(
        f"strain_{gage + 1} {1e6 * coefficients[1, 2, gage] / 3.0:.0f}" for gage in order
    )
    return [
        CampaignFault(
            f"campaign.toml, [gages] lateral_m, channels {names}",
            "swapped gages: the lowest strain changes with the lateral force by, across the tire, "
            f"{slopes} microstrain a kN",
            "it must increase or decrease monotonically from one side of the tire to the other",
            "correct lateral_m, or exchange these channels; seen from the other side of the tire, "
            "it may be the other ones",
        )
    ]


def _unchecked(held: str) -> CampaignFault:
    """Return the warning that swapped gages would not have been noticed."""
    return CampaignFault(
        "campaign.toml, [gages] lateral_m",
        f"the order of the gages was not checked: the campaign holds {held}",
        "lateral forces of both signs in at least four runs are needed to distinguish the sides",
        "add runs with slip angles to both sides, or make sure of the wiring",
        "warning",
    )


def _out_of_order(slopes: FloatArray, error: float) -> list[int]:
    """Return the neighboring places whose slopes would have to change for a monotonic row."""
    clear = max(_STEADY * error, _CLEAR * float(np.ptp(slopes)))
    rows = []
    for direction in (1.0, -1.0):
        row = direction * slopes
        steps = row[None, :] - row[:, None]  # from place i to place j > i it must not fall
        falls = np.triu(steps < -clear, k=1)
        target = np.argsort(np.argsort(row, kind="stable"), kind="stable")
        moved = [place for place in range(len(row)) if target[place] != place]
        rows.append((int(falls.sum()), moved))
    falls_count, moved = min(rows, key=lambda item: item[0])
    return moved if falls_count else []


def force_sign_findings(
    summaries: Sequence["ForceSign"], header: CampaignHeader
) -> tuple[list[RunFinding], list[CampaignFault]]:
    """Compare the signs of a force and of what it follows with the axis system."""
    clear = [item for item in summaries if item.share is not None]
    wrong = [item for item in clear if item.share is not None and item.share > 0.5]
    if not wrong:
        return [], []
    name, by = wrong[0].name, FOLLOWS[wrong[0].name]
    same = signs_of(name, header.axes)
    if 2 * len(wrong) > len(clear):
        return [], [
            CampaignFault(
                "campaign.toml, axes",
                f"wrong sign: {name} against {by} contradicts axes = {header.axes!r} in "
                f"{len(wrong)} of {len(clear)} runs with a slip angle ({wrong[0].file} first)",
                f"{name} and {by} have {same} in these axes",
                f"name the axis system of the data, or correct the sign of {name}"
                + (" or slip_angle" if name == "Fy" else ""),
            )
        ]
    return [
        finding(
            "sign",
            item.file,
            name,
            f"wrong sign: {name} against {by} is not as in the other runs",
            f"they have {same} in axes = {header.axes!r}",
            f"correct the sign of {name}" + (" or slip_angle" if name == "Fy" else "") + " in "
            "this run",
        )
        for item in wrong
    ], []


FOLLOWS = {"Fy": "slip angle", "Mz": "Fy at small slip angles"}
"""What the sign of a force is held against. The aligning moment is that of the lateral force behind
the middle of the contact, Mz = -t Fy with the trail t > 0, in every axis system."""
LARGEST_TRAIL_ANGLE = 0.05
"""Slip angle up to which the trail of a tire is clear, [rad]: it vanishes where the contact slides,
from 5 deg on. Half (1.4 deg) leaves few samples, double (5.7 deg) is where the moment turns."""
LEAST_TRAIL = 0.005
"""Moment over force below which the sign of a sample says nothing, [m]: trails are 20 to 40 mm."""


def signs_of(name: str, axes: str) -> str:
    """Return in words how the signs of a force and of what it follows go together."""
    return "the same sign" if name == "Fy" and axes == "adapted_sae" else "opposite signs"


@dataclass(frozen=True, slots=True)
class ForceSign:
    """Share of a run's telling samples in which a force has the wrong sign (ISO)."""

    file: str
    share: float | None
    name: str = "Fy"


def force_sign_of(run: Run) -> ForceSign:
    """Return how often Fy has the wrong sign; None where angle or force are too small."""
    if not {"Fy", "slip_angle"} <= set(run.rig):
        return ForceSign(run.plan.file, None)
    force, angle = run.rig["Fy"], run.rig["slip_angle"]
    telling = _telling(run, 0.2)
    return ForceSign(run.plan.file, _share(force * angle > 0.0, telling))


def moment_sign_of(run: Run) -> ForceSign:
    """Return how often Mz has the wrong sign; None where few angles are small, or Mz is."""
    if not {"Fy", "Mz", "slip_angle"} <= set(run.rig):
        return ForceSign(run.plan.file, None, "Mz")
    force, moment = run.rig["Fy"], run.rig["Mz"]
    telling = _telling(run, 0.5) & (np.abs(run.rig["slip_angle"]) < LARGEST_TRAIL_ANGLE)
    telling &= np.abs(moment) > LEAST_TRAIL * np.abs(force)
    if "slip_ratio" in run.rig:  # a longitudinal force has a moment of its own
        telling &= np.abs(run.rig["slip_ratio"]) < 0.02
    return ForceSign(run.plan.file, _share(moment * force > 0.0, telling), "Mz")


def _telling(run: Run, tilted: float) -> BoolArray:
    """Return the samples whose slip angle and lateral force are clear."""
    force, angle = run.rig["Fy"], run.rig["slip_angle"]
    load = np.abs(run.rig["Fz"]) if "Fz" in run.rig else np.full_like(force, 1e3)
    tilt = np.abs(run.rig["camber"]) if "camber" in run.rig else np.zeros_like(force)
    # camber may win at small angles: a slip angle counts from 1 deg and a share of camber
    clear = (np.abs(angle) > 0.017) & (np.abs(angle) > tilted * tilt)
    return np.asarray(clear & (np.abs(force) > 0.1 * load))


def _share(wrong: BoolArray, telling: BoolArray) -> float | None:
    return float(np.mean(wrong[telling])) if np.count_nonzero(telling) >= 5 else None
