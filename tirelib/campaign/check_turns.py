"""Checks of the turns: enough of them, and a trigger that agrees with the rig."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tirelib.campaign.finding import RunFinding, finding
from tirelib.campaign.model import CampaignHeader, FloatArray, Run
from tirelib.campaign.turns import expected_period, trigger_samples, turn_samples


def turn_findings(run: Run, header: CampaignHeader) -> list[RunFinding]:
    """Return the faults of the number of turns and of the trigger of one run."""
    if run.strain is None or not math.isfinite(run.rate):
        return []
    found: list[RunFinding] = []
    samples = turn_samples(run, header)
    file = run.plan.file
    count = run.strain.shape[1]
    if samples is not None and count < 2.0 * samples * (1.0 - 1e-3):
        found.append(
            finding(
                "turns",
                file,
                "",
                f"{count / samples:.2f} turns of {samples / run.rate:.4g} s",
                "two turns or more are needed: the first only sets the offset",
                "record longer",
            )
        )
    pulses = trigger_samples(run)
    expected = expected_period(run, header)
    if pulses is None:
        return found
    if pulses.size < 2:
        if expected is not None and count > 2.5 * expected[0] * run.rate:
            found.append(
                finding(
                    "trigger",
                    file,
                    "trigger",
                    f"{pulses.size} pulse(s) in {count / run.rate / expected[0]:.1f} turns",
                    "one pulse a turn is expected",
                    "check the trigger's sensor or drop the channel",
                )
            )
        return found
    gaps, period = np.diff(pulses), float(np.median(np.diff(pulses)))
    if run.plan.kind == "sweep":  # its turns differ: means, over the same time, are compared
        expected, period = expected_period(_between(run, pulses), header), float(np.mean(gaps))
    return found + _periods(run, gaps, period, pulses[:-1].astype(float), expected)


def _between(run: Run, pulses: npt.NDArray[np.intp]) -> Run:
    """Return a run with what the rig measured between the first pulse and the last."""
    if run.rig_time is None:
        return run
    first, last = run.time()[pulses[[0, -1]]]
    inside = (run.rig_time >= first) & (run.rig_time <= last)
    rig = {name: values[inside] for name, values in run.rig.items()}
    return replace(run, rig=rig, rig_time=run.rig_time[inside])


def _periods(
    run: Run,
    gaps: FloatArray,
    samples: float,
    begins: FloatArray,
    expected: tuple[float, str, float] | None,
) -> list[RunFinding]:
    """Compare the trigger's period, in samples, with the rig, and its gaps with each other."""
    file = run.plan.file
    period = samples / run.rate
    if expected is not None and abs(period / expected[0] - 1.0) > expected[2] + 2.0 / samples:
        return [
            finding(
                "trigger",
                file,
                "trigger",
                f"its period is {1e3 * period:.4g} ms, by {expected[1]} a turn takes "
                f"{1e3 * expected[0]:.4g} ms (ratio {period / expected[0]:.3g})",
                f"they must agree within {100 * expected[2]:.0f} %",
                f"check one pulse a turn, rate_hz, and the unit of {expected[1]}",
            )
        ]
    odd = np.flatnonzero(np.abs(gaps / np.median(gaps) - 1.0) > 0.2)
    if run.plan.kind == "sweep" or not odd.size:
        return []
    first = int(odd[0])
    what = "missing" if gaps[first] > np.median(gaps) else "extra"
    return [
        finding(
            "trigger",
            file,
            "trigger",
            f"{odd.size} uneven period(s), the first of "
            f"{gaps[first] / np.median(gaps):.2f} turns: a pulse is {what}",
            "one pulse a turn is expected",
            "check the trigger's sensor or drop the channel",
            at=f"sample {int(begins[first])} (t = {run.time()[int(begins[first])]:.4f} s)",
        )
    ]
