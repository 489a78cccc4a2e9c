"""How many samples a turn takes, from the best source that a run has."""

import math

import numpy as np
import numpy.typing as npt

from tirelib.campaign.model import CampaignHeader, FloatArray, Run

_SLOWEST = 0.1
"""Below this speed, m/s, a wheel counts as standing."""


def trigger_samples(run: Run) -> npt.NDArray[np.intp] | None:
    """Return the samples at which the trigger rises, or None without a trigger."""
    if run.trigger is None:
        return None
    return np.flatnonzero(np.diff(run.trigger.astype(np.int8), prepend=0) > 0)


def expected_period(run: Run, header: CampaignHeader) -> tuple[float, str, float] | None:
    r"""Return the time of a turn from the rig's channels.

    .. math:: T = 2 \pi / \Omega \quad\text{or}\quad T = 2 \pi R / (v (1 + \kappa))

    with the free radius R, which overstates the rolling one by some percent.

    Returns
    -------
    period : float, [s]
    source : str
        ``omega``, ``speed`` or ``the set point of the speed``.
    tolerance : float
        How far off it may be, relative.
    """
    omega = run.mean("omega")
    if omega is not None and abs(omega) * header.tire.free_radius > _SLOWEST:
        return 2.0 * math.pi / abs(omega), "omega", 0.03
    measured = run.mean("speed")
    speed = run.plan.speed if measured is None else measured
    slip = run.mean("slip_ratio")
    slip = run.plan.slip_ratio if slip is None else slip
    rim_speed = speed * (1.0 + (slip if math.isfinite(slip) else 0.0))
    if not math.isfinite(rim_speed) or abs(rim_speed) < _SLOWEST:
        return None
    source = "the set point of the speed" if measured is None else "speed"
    return 2.0 * math.pi * header.tire.free_radius / abs(rim_speed), source, 0.15


def turn_samples(run: Run, header: CampaignHeader) -> float | None:
    """Return the samples in a turn: by the trigger, else by the rig, else None."""
    pulses = trigger_samples(run)
    if pulses is not None and pulses.size >= 2:
        return float(np.median(np.diff(pulses)))
    expected = expected_period(run, header)
    return None if expected is None else expected[0] * run.rate


def turn_stack(strain: FloatArray, samples: float) -> FloatArray | None:
    """Return strain cut into whole turns, shape (n_gages, n_turns, n_samples of a turn).

    The cut begins at the first sample; None when there is no whole turn of 16 samples or more.
    """
    length = round(samples)
    count = strain.shape[1] // length if length >= 16 else 0
    if count == 0:
        return None
    begins = np.round(np.arange(count) * samples).astype(np.intp)
    begins = begins[begins + length <= strain.shape[1]]
    return strain[:, begins[:, None] + np.arange(length)]
