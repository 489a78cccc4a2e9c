"""A self-test as JSON, and in words."""

from typing import Any

import numpy as np
from scipy.stats import binomtest

from tirelib.planning.selftest import Planting, SelfTest

FORMAT = "tirelib-selftest/1"
NOTE = (
    "The tires are variants of the model itself, which the numerical ring describes better than a "
    "real tire: these chances are optimistic. The judge is the first round of the diagnosis, "
    "without exact refits."
)


def selftest_document(found: SelfTest) -> dict[str, Any]:
    """Return a self-test as ``tirelib-selftest/1``; strains in microstrain, angles in deg."""
    by_name: dict[str, list[Planting]] = {}
    for planting in found.plantings:
        by_name.setdefault(planting.effect.name, []).append(planting)
    ratios = list(dict.fromkeys(planting.ratio for planting in found.plantings))
    return {
        "format": FORMAT,
        "campaign": found.campaign,
        "axes": "iso",
        "quantity": "strain",
        "note": NOTE,
        "optimistic": True,
        "ratios": ratios,
        "repeats": found.repeats,
        "members": found.members,
        "seed": found.seed,
        "noise_ustrain": 1e6 * found.noise,
        "misfit_size": found.size,
        "floor_whitened": found.floor,
        "false_alarms": {
            "share": sum(map(bool, found.nothing)) / max(len(found.nothing), 1),
            "n": len(found.nothing),
            "named": sorted({name for name in found.nothing if name}),
        },
        "summary": [_summary(found, ratio) for ratio in ratios],
        "effects": [
            {
                "effect": name,
                "title": each[0].effect.title,
                "unit": each[0].effect.unit,
                "largest_ratio": found.largest[name],
                "twins": [
                    {"effect": twin, "angle_deg": float(np.rad2deg(angle))}
                    for twin, angle in found.twins[name]
                ],
                "results": [_result(planting, found) for planting in each],
            }
            for name, each in by_name.items()
        ],
        "dead": dict(found.dead),
    }


def _summary(found: SelfTest, ratio: float) -> dict[str, Any]:
    """Return the shares over all effects that can be planted at a ratio."""
    done = [p for p in found.plantings if p.ratio == ratio and p.named]
    n = sum(len(p.named) for p in done)
    right, wrong = sum(p.right for p in done), sum(p.wrong for p in done)
    return {
        "ratio": ratio,
        "effects": len(done),
        "n": n,
        "found": right / n if n else None,
        "wrong": wrong / n if n else None,
    }


def _result(planting: Planting, found: SelfTest) -> dict[str, Any]:
    n = len(planting.named)
    twins = {name for name, _ in found.twins[planting.effect.name]}
    low, high = chance_range(planting.right, n)
    return {
        "ratio": planting.ratio,
        "strength": planting.strength,
        "reachable": planting.reachable,
        "fault": planting.fault or None,
        "ratio_reached": planting.reached,
        "n": n,
        "found": planting.right / n if n else None,
        "found_low": low,
        "found_high": high,
        "wrong": planting.wrong / n if n else None,
        "wrong_twin": sum(name in twins for name in planting.named) / n if n else None,
        "named": sorted({name for name in planting.named if name}),
    }


def chance_range(right: int, n: int) -> tuple[float, float]:
    """Return the 95 % interval of a chance by Wilson's score; NaN without trials.

    Examples
    --------
    >>> [round(x, 3) for x in chance_range(9, 10)]
    [0.596, 0.982]
    """
    if n == 0:
        return float("nan"), float("nan")
    interval = binomtest(right, n).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)
