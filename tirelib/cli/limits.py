"""Notes after a calibration or an estimate: cost of missing conditions, missing checks."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tirelib.estimators.calibration import Calibration
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.estimators.estimate import QUANTITIES

REPORTED_STD_RATIO = 1.2
"""Ratio of standard deviations from which an unknown condition is reported."""
WEAKLY_CHECKED = 0.5
"""Share of turns at uncalibrated pressures or speeds from which the check of the tire is reported
as weak; half and double change only for which mixed campaigns the sentence is printed."""
REPORTED_LOSS = 0.05
"""Share of turns made invalid by it from which that is reported."""


def not_given(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a sentence on the missing condition that costs most accuracy; empty if there is none.

    Parameters
    ----------
    rows : sequence of mappings
        ``not_given`` of an estimate or calibration document, the dearest first.
    """
    dear = [
        r for r in rows if r["std"] is None or r["std"] > REPORTED_STD_RATIO * r["std_if_given"]
    ]
    if not dear:
        return ""
    first = dear[0]["condition"]
    parts = [_cost(row) for row in dear if row["condition"] == first]
    others = list(dict.fromkeys(r["condition"] for r in dear if r["condition"] != first))
    verb = "cost" if len(others) > 1 else "costs"
    rest = " and ".join(map(_words, others))
    also = f"; {rest} {verb} less accuracy, see --json" if others else ""
    return (
        f"The {_words(first)} was not given: the standard deviation of {', of '.join(parts)} "
        f"(column {dear[0]['column']} of runs.csv{also})"
    )


def _cost(row: Mapping[str, Any]) -> str:
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    now = "unknown" if row["std"] is None else f"{row['std']:.3g}{unit}"
    lost = ""
    if row["valid"] < row["valid_if_given"] - REPORTED_LOSS:
        lost = f" and valid in {row['valid']:.0%} instead of {row['valid_if_given']:.0%} of turns"
    return f"{row['quantity']} is {now} instead of {row['std_if_given']:.3g}{unit}{lost}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def outside(turns: Sequence[Mapping[str, Any]], calibration: Calibration) -> str:
    """Return a sentence on the turns beyond what was calibrated; empty if there are none.

    Parameters
    ----------
    turns : sequence of mappings
        ``turns`` of an estimate document.
    calibration : Calibration
    """
    beyond = [turn for turn in turns if "out_of_range" in turn["flags"]]
    if not beyond:
        return ""
    counts = {q: sum(f"{q}_out_of_range" in turn["flags"] for turn in beyond) for q in QUANTITIES}
    affected = ", ".join(f"{q} of {count}" for q, count in counts.items() if count)
    return (
        f"{len(beyond)} of {len(turns)} turns lie beyond what was calibrated ({affected}): their "
        "values are extrapolated and not valid. Calibrated are "
        f"{', '.join(_calibrated(calibration, counts))}, and the combinations of these that were "
        "measured; calibrate with runs like these, or leave these turns out"
    )


def _calibrated(calibration: Calibration, counts: Mapping[str, int]) -> list[str]:
    """Return the calibrated ranges of the quantities that are out of range, in words."""
    found = []
    for quantity, (unit, factor) in EDGE_UNIT.items():
        own = [r for r in calibration.chains[-1].guards[quantity] if r.name == quantity]
        if counts[quantity] and own:
            low, high = (f"{factor * end:,.4g}" for end in (own[0].low, own[0].high))
            found.append(f"{quantity} from {low} to {high}{'' if unit == '1' else f' {unit}'}")
    return found or ["the conditions of its runs"]


def extrapolated(turns: Sequence[Mapping[str, Any]], calibration: Calibration) -> str:
    """Return a sentence on turns at an uncalibrated speed or pressure; empty if there are none.

    Parameters
    ----------
    turns : sequence of mappings
        ``turns`` of an estimate document.
    calibration : Calibration
    """
    away = sum("condition_extrapolated" in turn["flags"] for turn in turns)
    if not away:
        return ""
    laws = calibration.chains[-1].laws
    ends = (("speeds", laws.speed, 3.6, "km/h"), ("pressures", laws.pressure, 1e-5, "bar"))
    known = " and ".join(
        f"{name} from {factor * low:.3g} to {factor * high:.3g} {unit}"
        for name, (low, high), factor, unit in ends
        if math.isfinite(low) and math.isfinite(high)
    )
    return (
        f"{away} of {len(turns)} turns have a speed or pressure that was not calibrated "
        f"(calibrated are {known or 'none that were measured'}), or an unknown pressure: their "
        "estimates follow an assumed law, whose doubt is in the standard deviations; calibrate at "
        "these speeds and pressures to be rid of it"
    )


def not_checked(calibration: Calibration) -> list[str]:
    """Return sentences on what a calibration cannot detect."""
    found = []
    if calibration.version < 2:
        found.append(
            "The calibration was made by an earlier version: it covers neither friction nor the "
            "limits of its own range, and its slip angle follows a brush curve; calibrate again"
        )
    if not calibration.knows_tire:
        found.append(
            "Another tire would not be detected: the calibration "
            + (
                "was made by an earlier version"
                if calibration.version < 2
                else "has too few conditions (17 are needed); calibrate with more"
            )
        )
    return found


def weakly_checked(other_tire: Mapping[str, Any] | None) -> str:
    """Return a sentence where another tire would hardly be detected; empty if it would be.

    Parameters
    ----------
    other_tire : mapping or None
        ``other_tire`` of an estimate document.
    """
    if not other_tire or other_tire["suspected"]:
        return ""
    judged, away = other_tire["judged"], other_tire["extrapolated"]
    if away <= WEAKLY_CHECKED * judged:
        return ""
    return (
        f"Another tire may go undetected: {away} of {judged} turns in range have a pressure or "
        "speed that was not calibrated, and there the strain cannot be held closely against that "
        "of the calibrated tire; calibrate at these pressures and speeds, and check the tire by "
        "its name and dimensions"
    )
