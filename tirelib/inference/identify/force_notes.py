"""What of a campaign's forces cannot be used, in words: nothing is left out silently."""

from collections import defaultdict

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.identify.force_data import FORCES, FREE_ROLLING
from tirelib.inference.identify.strain_notes import named

NOISY = 0.03
"""Share of a force's rms above which its noise is more than that of a rig (1.7 % for the aligning
torque of the tests' noisiest sweep, 6 % where a column of camber was left out): half would speak of
sound torques, double would pass over that camber."""


def force_notes(campaign: Campaign) -> tuple[str, ...]:
    """Return one sentence for each kind of sample or run that the forces cannot be fitted to.

    `tirelib.inference.identify.force_data.force_data` leaves out what has no load or slip angle,
    and takes an unknown slip ratio or camber as zero.
    """
    samples = 0
    lost, stood = defaultdict[str, list[int]](list), defaultdict[str, list[int]](list)
    for run in campaign.runs():
        missing = [name for name in ("Fz", "slip_angle") if name not in run.rig]
        if not run.rig:
            lost["no rig quantity was recorded"].append(run.plan.run)
        elif run.plan.kind == "sweep":
            for name in missing:
                lost[f"{name} is not recorded"].append(run.plan.run)
            if not missing:
                load, angle = run.rig["Fz"], run.rig["slip_angle"]
                good = np.isfinite(load) & (load > 0.0) & np.isfinite(angle)
                samples += int((~good).sum())
        else:
            for name in ("Fz", "slip_angle", *FORCES):
                if not np.isfinite(run.rig.get(name, np.zeros(1))).all():
                    lost[f"{name} holds samples that are no number"].append(run.plan.run)
            for name in missing:
                stood[name].append(run.plan.run)
    out = [f"{named(runs)}: {reason}; left out of the brush" for reason, runs in lost.items()]
    if samples:
        out.append(
            f"{samples} samples of sweeps have no positive load or no slip angle, or are no "
            "number; left out of the brush"
        )
    out += [
        f"{named(runs)}: {name} was not measured; its set point is used"
        for name, runs in stood.items()
    ]
    return (*out, *taken_as_zero(campaign))


def taken_as_zero(campaign: Campaign) -> tuple[str, ...]:
    """Return a sentence for each slip that is neither measured nor a set point."""
    blank = defaultdict[str, list[int]](list)
    for plan in campaign.plans:
        ratio = plan.kind in FREE_ROLLING or np.isfinite(plan.slip_ratio)
        wanted = {"slip_ratio": not ratio, "camber": not np.isfinite(plan.camber)}
        if any(wanted.values()):
            rig = campaign.load(plan).rig
            for name in (name for name, asked in wanted.items() if asked and name not in rig):
                blank[name.replace("_", " ")].append(plan.run)
    return tuple(
        f"{named(runs)}: {name} is unknown and taken as zero" for name, runs in blank.items()
    )


def noise_note(name: str, noise: float, size: float) -> tuple[str, ...]:
    """Return a sentence if the noise of a force is too large to be that of repeats.

    Parameters
    ----------
    noise, size : float, [N] or [N m]
        Standard deviation of a point from repeats (NaN without), and the rms of the force.
    """
    if not noise > NOISY * size:
        return ()
    return (
        f"the noise from repeats, {noise:.3g} {QUANTITIES[name].unit}, is {100 * noise / size:.0f} "
        f"% of the rms of {name}; a rig repeats to {100 * NOISY:.0f} % or better: these repeats "
        "differ in something that is not recorded or not mapped (camber, temperature, wear, "
        "another tire), so no effect can be named reliably",
    )
