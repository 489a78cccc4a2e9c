"""Contact length, deflection, entry and exit: how far off, and under which conditions, in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from tirelib.core.arrays import BoolArray
from tirelib.inference.compare.regions import LEAST_SHARE, LEVEL, SLIPS, subsets
from tirelib.inference.compare.runs import Factor
from tirelib.inference.compare.sentences import conditions
from tirelib.inference.compare.tracks import Track

WORDS = {
    "contact length": ("long", "short"),
    "deflection": ("large", "small"),
    "contact entry": ("late", "early"),
    "contact exit": ("late", "early"),
}
"""What a positive and a negative difference, model less measured, is called."""


@dataclass(frozen=True, slots=True)
class TrackFit:
    """A track over the counted runs, SI; NaN where nothing is known.

    Attributes
    ----------
    mean, std : float
        Mean of model less measured, and its standard deviation by noise and set points.
    rms : float
        Rms of model less measured.
    rms_beside : float
        The same with the mean, a constant offset, taken out.
    """

    runs: int
    mean: float
    std: float
    rms: float
    rms_beside: float


def track_fit(track: Track, counted: BoolArray) -> TrackFit:
    """Return how far model and measurement are apart."""
    shown = track.known & counted
    d = track.difference[shown]
    if not d.size:
        return TrackFit(0, *(4 * [float("nan")]))
    return TrackFit(
        d.size, float(d.mean()), _std(track, shown), float(np.sqrt(np.mean(d**2))), float(d.std())
    )


def track_sentences(
    found: Sequence[Track], counted: BoolArray, factors: Sequence[Factor]
) -> tuple[str, ...]:
    """Say for every track the runs in which it is off most, if more than by noise and set points.

    The level is divided by all candidates. A constant offset that the rig's zero could explain is
    taken out before, and told.
    """
    plain = [factor for factor in factors if factor.name not in SLIPS]
    groups = subsets(counted, plain)
    out = []
    for track in found:
        shown = track.known & counted
        if not track.freedom or not shown.any():
            continue
        offset = float(track.difference[shown].mean()) if track.constant else 0.0
        rest = track.difference - offset
        total = float(np.sum(rest[shown] ** 2))
        best, most = "", LEAST_SHARE * total
        for group in groups:
            member = group.member & shown
            if not member.any() or (track.constant and group.by == "all"):
                continue
            mean, std = float(rest[member].mean()), _std(track, member)
            t = abs(mean) / std if std > 0.0 else 0.0
            p = 2.0 * special.stdtr(track.freedom, -t) * len(groups) * len(found)
            size = int(member.sum()) * mean**2
            if p < LEVEL and size > most:
                limit = conditions(group.by, group.side, group.value) or "in all runs"
                best, most = _say(track, limit, mean, std, int(member.sum()), offset), size
        if best:
            out.append(best)
    return tuple(out)


def _std(track: Track, member: BoolArray) -> float:
    """Return the standard deviation of a mean over runs, by noise and set points."""
    square = np.nan_to_num(track.noise) ** 2 + np.nan_to_num(track.model_std[member]) ** 2
    return float(np.sqrt(square.sum()) / member.sum()) if track.freedom else float("nan")


def _say(track: Track, limit: str, mean: float, std: float, runs: int, offset: float) -> str:
    word = WORDS[track.name][0 if mean > 0.0 else 1]
    text = f"{track.name.capitalize()}, {limit}: the model's is "
    text += f"{_short(track.scale * abs(mean))} {track.unit} too {word} (95 % "
    text += f"\N{PLUS-MINUS SIGN} {_short(1.96 * track.scale * std)}, {runs} runs)"
    if track.constant:
        text += (
            f", apart from a constant {_short(track.scale * offset)} {track.unit} in all runs, "
            "which may be the zero of the rig's loaded radius"
        )
    return text + "."


def _short(value: float) -> str:
    return f"{value:.2g}"
