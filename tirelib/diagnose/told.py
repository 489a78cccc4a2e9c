"""What the documents of a diagnosis tell alike of strain and of forces."""

from typing import Any

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.diagnose import Finding
from tirelib.infer.select import Verdict


def verdict_told(found: Verdict) -> dict[str, Any]:
    """Return the statistic of a verdict, its limit, and the p-values behind it."""
    return {
        "false_alarm": found.alpha,
        "misfit": found.best.statistic,
        "misfit_floor": found.best.limit(found.alpha),
        "misfit_of": found.best.against,
        "p": found.best.p,
        "p_std": found.best.p_std,
        "p_without": found.base.p,
    }


def candidate_told(
    finding: Finding, rank: int, error_after: float, held_out: float
) -> dict[str, Any]:
    """Return a candidate effect.

    Parameters
    ----------
    finding : Finding
    rank : int
        From one.
    error_after, held_out : float
        Errors with it alone, the second on held-out data; NaN if unknown.
    """
    return {
        "effect": finding.effect.name,
        "title": finding.effect.title,
        "rank": rank,
        "score": finding.score,
        "threshold": finding.threshold,
        "level": finding.level,
        "p": finding.p,
        "p_std": finding.p_std,
        "strength": strength_told(finding.strength),
        "std": strength_told(finding.std),
        "unit": finding.effect.unit,
        "range": [finding.effect.low, finding.effect.high],
        "in_range": finding.in_range,
        "error_after": error_after,
        "heldout_error_after": held_out,
        "share": finding.share,
        "twins": [
            {"effect": twin, "angle_deg": float(np.rad2deg(angle))} for twin, angle in finding.twins
        ],
        "power": finding.power,
    }


def strength_told(strength: FloatArray) -> float | list[float]:
    """Return a strength as a number, or as a list if it has several components."""
    numbers = [float(x) for x in strength]
    return numbers[0] if len(numbers) == 1 else numbers
