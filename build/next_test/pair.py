"""Cases of two look-alikes: which pairs, which tires, and who is right."""

import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.inference.planning.next_test import NextTest
from tirelib.inference.statistics.hypotheses import Hypotheses

CACHE = Path(__file__).parents[1] / "out" / "next_test"
A_PLAN = 3
"""Pairs that each plan contributes at most."""
CONFUSABLE = np.deg2rad(45.0)
"""Angle below which two signatures have more than half of their squares in common."""
REFERENCE = 1000
"""Seed of the tire at which pairs are chosen."""
REACHED = (0.5, 2.0)
"""Visibility that is accepted, in units of the wanted one. Beyond these bounds the effect cannot be
planted, and the case is left out."""
Pair = tuple[str, str, str]
"""Plan and two look-alikes."""


@dataclass(frozen=True)
class PairCase:
    """Who is planted, and who looks like it.

    Attributes
    ----------
    seed : int
        Number of the tire.
    plan, truth, rival : str
    visible : float
        Chi-square by which the campaign alone shows the effect, against none.
    """

    seed: int
    plan: str
    truth: str
    rival: str
    visible: float

    def told(self, among: Hypotheses) -> dict[str, Any]:
        """Return which of the two is in the confidence set, and by how much the rival is worse."""
        fits = {name: among.at([name]) for name in (self.truth, self.rival)}
        inside = {name: fit is not None and fit.p > among.false_alarm for name, fit in fits.items()}
        truth, rival = fits.values()
        gap = None if truth is None or rival is None else truth.likelihood - rival.likelihood
        return {"inside": inside, "gap": None if gap is None else 2.0 * gap}

    def any_of(self, count: int) -> int:
        """Return one of so many runs at random: another draw for every case."""
        drawn = zlib.crc32(f"{self.plan} {self.truth} {self.rival}".encode())
        return int(np.random.default_rng([self.seed, 5, drawn]).integers(count))

    def check(self, reached: float) -> None:
        """Refuse an effect that is not nearly as visible as wanted."""
        low, high = (share * self.visible for share in REACHED)
        if not low <= reached <= high:
            raise CalibrationError(
                f"{self.truth} in {self.plan}, seed {self.seed}: planted with a chi-square of "
                f"{reached:.3g}, {low:g} to {high:g} are wanted; the case is left out"
            )


def open_still(told: Mapping[str, Any]) -> bool:
    """Return whether both are in the confidence set, or none."""
    return len(set(told["inside"].values())) == 1


def foretold(test: NextTest, rank: int) -> dict[str, Any]:
    """Return a run of a rank, and what is foretold of it."""
    return {
        "at": test.envelope.text(test.points[rank]),
        "predicted": float(test.score[rank]),
        "chance": float(test.probability[rank]),
    }


def look_alikes(
    plans: Iterable[str], signatures: Callable[[str], tuple[Sequence[str], FloatArray]]
) -> list[Pair]:
    """Return of each plan the closest of the pairs that are hard to tell apart there.

    A pair counts in the first plan that has it.

    Parameters
    ----------
    plans : iterable of str
    signatures : callable
        Return the names of the effects that a plan shows, and the angles between them, (n, n).
    """
    chosen: list[Pair] = []
    for plan in plans:
        names, angles = signatures(plan)
        order = sorted(
            (float(angles[i, j]), *sorted((names[i], names[j])))
            for i in range(len(names))
            for j in range(i)
            if angles[i, j] < CONFUSABLE
        )
        known = {(a, b) for _, a, b in chosen}
        chosen += [(plan, a, b) for _, a, b in order if (a, b) not in known][:A_PLAN]
    return chosen


def cases_of(pairs: Sequence[Pair], seed: int, visible: float) -> list[PairCase]:
    """Return a tire's cases: every pair, with the one and the other as the truth in turn."""
    out = []
    for k, (plan, *names) in enumerate(pairs):
        truth, rival = names if (seed + k) % 2 else names[::-1]
        out.append(PairCase(seed, plan, truth, rival, visible))
    return out
