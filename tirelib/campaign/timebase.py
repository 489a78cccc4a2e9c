"""Checks of a clock: finite, increasing, uniform, at the declared rate."""

import numpy as np

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.model import FloatArray

STEP_TOLERANCE = 0.3
"""A step between gage samples may be this much longer or shorter than 1 / rate."""

RATE_TOLERANCE = 1e-3
"""Relative. A logger's quartz is a hundred times better; a wrong rate_hz far worse."""


def gage_time_problems(file: str, times: FloatArray, rate: float) -> list[CampaignFault]:
    """Return the faults of the gages' clock.

    Parameters
    ----------
    file : str
        The run file, for the message.
    times : array, shape (n_samples,), [s]
    rate : float, [Hz]
        The declared rate.
    """
    where = f"{file}, time of the gages"
    if times.size < 2:
        return [
            CampaignFault(
                where, f"{times.size} samples", "two turns of the wheel are needed", "record longer"
            )
        ]
    problems = _growth_problems(where, times)
    if problems:
        return problems
    steps = np.diff(times)
    usual = float(np.median(steps))
    if abs(usual * rate - 1.0) > STEP_TOLERANCE:
        return [_rate_problem(where, 1.0 / usual, rate)]
    gaps = np.flatnonzero(steps > (1.0 + STEP_TOLERANCE) * usual)
    short = np.flatnonzero(steps < (1.0 - STEP_TOLERANCE) * usual)
    if gaps.size:
        first = int(gaps[0])
        lost = round(float(np.sum(steps[gaps] / usual - 1.0)))
        return [
            CampaignFault(
                where,
                f"{gaps.size} gap(s), the first of {1e3 * steps[first]:.3g} ms after sample "
                f"{first} (t = {times[first]:.4f} s), about {lost} samples are lost",
                "no sample may be missing",
                "record it again or cut the run at the gap",
            )
        ]
    if short.size:
        first = int(short[0])
        return [
            CampaignFault(
                where,
                f"not uniform: a step of {1e3 * steps[first]:.3g} ms after sample {first} "
                f"(t = {times[first]:.4f} s), the usual step is {1e3 * usual:.3g} ms",
                "uniform steps are needed",
                "export it with the logger's own clock",
            )
        ]
    measured = (times.size - 1) / float(times[-1] - times[0])
    if abs(measured / rate - 1.0) > RATE_TOLERANCE:
        return [_rate_problem(where, measured, rate)]
    return []


def rig_time_problems(file: str, times: FloatArray) -> list[CampaignFault]:
    """Return the faults of the rig's clock: it must increase, but may pause."""
    return _growth_problems(f"{file}, time of the rig quantities", times)


def _growth_problems(where: str, times: FloatArray) -> list[CampaignFault]:
    broken = np.flatnonzero(~np.isfinite(times))
    if broken.size:
        return [
            CampaignFault(
                where,
                f"no finite time at sample {int(broken[0])}",
                "each sample needs its time",
                "export it again",
            )
        ]
    back = np.flatnonzero(np.diff(times) <= 0.0)
    if not back.size:
        return []
    first = int(back[0])
    return [
        CampaignFault(
            where,
            f"the time does not increase after sample {first} ({times[first]:.6g} s, then "
            f"{times[first + 1]:.6g} s), {back.size} time(s) in all",
            "time must increase from sample to sample",
            "sort out the clock at its source",
        )
    ]


def _rate_problem(where: str, measured: float, rate: float) -> CampaignFault:
    return CampaignFault(
        where,
        f"the samples come at {measured:.6g} Hz",
        f"campaign.toml declares {rate:.6g} Hz",
        "correct rate_hz or the recording",
    )
