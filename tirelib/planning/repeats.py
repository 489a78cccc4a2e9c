"""What repeating the whole plan would do for a weak effect of a force."""

from tirelib.planning.criterion import ENDLESS, NOTHING, Noise, Trial

PLAN_REPEATS = (1, 2, 3, 4, 6, 8, 12)
"""Times that the plan is measured."""


def force_gains(trial: Trial, noise: Noise) -> dict[str, dict[float, float]]:
    """Return by how much nothing is at most worse than each rival, by times of measuring.

    The present chi-square between them grows as the variance of what counts as noise falls: random
    parts average out, the misfit of the brush does not. A smooth misfit may keep it lower.
    Empty unless that nothing is missing is a rival.

    Parameters
    ----------
    trial : Trial
    noise : Noise

    Returns
    -------
    mapping of rival to mapping of times (`ENDLESS` last) to chi-square
    """
    plain = [rival for rival in trial.rivals if rival.name == NOTHING]
    if not plain:
        return {}
    now = noise.staying**2 + noise.random**2
    grows = {n: now / (noise.staying**2 + noise.random**2 / n) for n in (*PLAN_REPEATS, ENDLESS)}
    return {
        rival.name: {n: (plain[0].cost - rival.cost) * factor for n, factor in grows.items()}
        for rival in trial.rivals
        if rival.name != NOTHING
    }
