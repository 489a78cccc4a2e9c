"""A self-test as JSON, and in words."""

from typing import Any

from scipy.stats import binomtest

from tirelib.inference.diagnose.diagnose import twins_told
from tirelib.inference.planning.selftest import Planting, SelfTest

FORMAT = "tirelib-selftest/1"
NOTE = (
    "The tires are plain ones of the library's three simulators, each judged by the two others "
    "with the statistic of the diagnosis, to first order and without exact fits. Effects follow "
    "the laws of the catalogue, which real tires do only roughly: these chances are optimistic."
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
        "false_alarm": found.false_alarm,
        "seed": found.seed,
        "noise_ustrain": 1e6 * found.noise,
        "misfit_size": found.size,
        "false_alarms": {"share": found.alarms / found.repeats, "n": found.repeats},
        "summary": [_summary(found, ratio) for ratio in ratios],
        "effects": [
            {
                "effect": name,
                "title": each[0].effect.title,
                "unit": each[0].effect.unit,
                "largest_ratio": found.largest[name],
                "twins": twins_told(found.twins[name]),
                "results": [_result(planting) for planting in each],
            }
            for name, each in by_name.items()
        ],
        "dead": dict(found.dead),
    }


def _summary(found: SelfTest, ratio: float) -> dict[str, Any]:
    """Return the shares over all effects that can be planted at a ratio."""
    done = [p for p in found.plantings if p.ratio == ratio and p.reachable]
    n = sum(len(p.named) for p in done)
    counts = {
        "found": sum(p.right for p in done),
        "in_set": sum(p.held for p in done),
        "wrong": sum(p.wrong for p in done),
        "seen": sum(p.seen for p in done),
    }
    shares = {key: count / n if n else None for key, count in counts.items()}
    return {"ratio": ratio, "effects": len(done), "n": n, **shares}


def _result(planting: Planting) -> dict[str, Any]:
    n = len(planting.named)
    low, high = chance_range(planting.right, n)
    return {
        "ratio": planting.ratio,
        "strength": planting.strength,
        "reachable": planting.reachable,
        "n": n,
        "found": planting.right / n if n else None,
        "found_low": low,
        "found_high": high,
        "in_set": planting.held / n if n else None,
        "wrong": planting.wrong / n if n else None,
        "seen": planting.seen / n if n else None,
        "named": sorted({name for names in planting.named for name in names}),
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
