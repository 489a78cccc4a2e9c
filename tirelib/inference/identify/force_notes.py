"""What of a campaign's forces cannot be used, in words: nothing is left out silently."""

import numpy as np

from tirelib.campaign import Campaign, Run
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
    lost: dict[str, list[int]] = {}
    stood: dict[str, list[int]] = {}
    for run in campaign.runs():
        if not run.rig:
            lost.setdefault("no rig quantity was recorded", []).append(run.plan.run)
        elif run.plan.kind == "sweep":
            samples += _bad_samples(run)
            for reason in _missing(run):
                lost.setdefault(reason, []).append(run.plan.run)
        else:
            bad = [name for name in ("Fz", "slip_angle", *FORCES) if _holds_nan(run, name)]
            for name in bad:
                lost.setdefault(f"{name} holds samples that are no number", []).append(run.plan.run)
            for name in ("Fz", "slip_angle"):
                if name not in run.rig:
                    stood.setdefault(name, []).append(run.plan.run)
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
    blank: dict[str, list[int]] = {}
    for plan in campaign.plans:
        ratio = plan.kind in FREE_ROLLING or np.isfinite(plan.slip_ratio)
        wanted = {"slip_ratio": not ratio, "camber": not np.isfinite(plan.camber)}
        if any(wanted.values()):
            rig = campaign.load(plan).rig
            for name in (name for name, asked in wanted.items() if asked and name not in rig):
                blank.setdefault(name.replace("_", " "), []).append(plan.run)
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


def _missing(run: Run) -> list[str]:
    """Return why a sweep as a whole says nothing."""
    return [f"{name} is not recorded" for name in ("Fz", "slip_angle") if name not in run.rig]


def _bad_samples(run: Run) -> int:
    """Return how many samples of a sweep are left out."""
    if _missing(run):
        return 0
    load, angle = run.rig["Fz"], run.rig["slip_angle"]
    good = np.isfinite(load) & (load > 0.0) & np.isfinite(angle)
    return int((~good).sum())


def _holds_nan(run: Run, name: str) -> bool:
    samples = run.rig.get(name)
    return samples is not None and samples.size > 0 and not bool(np.isfinite(samples).all())
