"""Single turns to draw: strain over wheel angle with its features."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from tirelib.campaign import Campaign, RunPlan, conditions_of
from tirelib.core.errors import CalibrationError
from tirelib.core.traces import StrainTrace, TraceConditions
from tirelib.measured.features import Features, concatenate_features, extract_features
from tirelib.measured.signal import LowPass, Turns, cut_turns


@dataclass(frozen=True, slots=True)
class TypicalTurns:
    """One turn each of several runs: row i of `trace` and of `features` is called ``labels[i]``."""

    trace: StrainTrace
    features: Features
    labels: tuple[str, ...]


def typical_turns(
    campaign: Campaign,
    plans: Sequence[RunPlan],
    labels: Sequence[str],
    *,
    low_pass: LowPass | None = None,
) -> TypicalTurns:
    """Cut the runs of `plans` into turns and take the middle usable one of each.

    Raises
    ------
    CalibrationError
        If a run has no usable turn.
    """
    traces: list[StrainTrace] = []
    parts: list[Features] = []
    for plan in plans:
        turns = run_turns(campaign, plan, low_pass)
        features = extract_features(turns)
        good = np.flatnonzero(np.isfinite(features.lead).all(axis=1))
        if good.size == 0:
            raise CalibrationError(
                f"{campaign.header.name}, run {plan.run}: no turn has data of every gage, which a "
                "figure of one turn needs; view the strain with `tirelib campaign show`"
            )
        row = slice(int(good[good.size // 2]), int(good[good.size // 2]) + 1)
        traces.append(_one(turns.trace, row))
        one = {
            f.name: getattr(features, f.name)[row] for f in fields(Features) if f.name != "lateral"
        }
        parts.append(replace(features, **one))
    return TypicalTurns(_join(traces), concatenate_features(parts), tuple(labels))


def run_turns(campaign: Campaign, plan: RunPlan, low_pass: LowPass | None = None) -> Turns:
    """Read one run and cut it into turns."""
    run = campaign.load(plan)
    if run.strain is None:
        raise CalibrationError(
            f"{campaign.header.name}, run {plan.run}: the file holds no strain; "
            "strain_1 .. strain_N are needed"
        )
    held: Any = conditions_of(run, run.time())
    return cut_turns(
        run.strain,
        run.rate,
        campaign.header.gage_lateral,
        trigger=run.trigger,
        low_pass=low_pass,
        **held,
    )


def _one(trace: StrainTrace, row: slice) -> StrainTrace:
    held = trace.conditions
    return replace(
        trace,
        strain=trace.strain[row],
        rate=trace.rate[row],
        pulse=trace.pulse[row],
        axis_shift=trace.axis_shift[row],
        conditions=TraceConditions(
            held.omega[row], held.speed[row], held.pressure[row], held.camber[row]
        ),
    )


def _join(traces: Sequence[StrainTrace]) -> StrainTrace:
    def joined(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return np.concatenate([getattr(trace, name) for trace in traces])

    def held(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return np.concatenate([getattr(trace.conditions, name) for trace in traces])

    return replace(
        traces[0],
        strain=joined("strain"),
        rate=joined("rate"),
        pulse=joined("pulse"),
        axis_shift=joined("axis_shift"),
        conditions=TraceConditions(held("omega"), held("speed"), held("pressure"), held("camber")),
    )
