"""What the wheel angle's doubt says after a disturbance: ``python build/after_event.py``.

A wheel turns evenly, but for a bump of its rate (half a sine, or a step up and down) of some size,
length and phase; contacts are exact. For each turn after the bump has ended: how often the doubt is
above the 2 % of `accelerating`, and by how many standard deviations the rate at the contact is off,
with the last three slopes of the rate, as they are used, and with two.
"""

import sys
from itertools import pairwise, product
from unittest import mock

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.measured.signal import angle
from tirelib.measured.signal.turns import LARGEST_ANGLE_STD

TURN, TURNS, BEGINS = 1000, 16, 6.0
"""Samples of an even turn; turns; where the earliest bump begins."""


def rate(size: float, length: float, phase: float, *, even: bool) -> FloatArray:
    """Return the rate of every sample over that of the even wheel."""
    x = (np.arange(TURN * TURNS) / TURN - BEGINS - phase) / length
    bump = np.where(even, 1.0, np.sin(np.pi * np.clip(x, 0.0, 1.0)))
    return 1.0 + size * np.where((x >= 0.0) & (x < 1.0), bump, 0.0)


def turns_of(course: FloatArray) -> list[tuple[float, float, float]]:
    """Return time, doubt and relative error of the rate at each contact."""
    turned = np.concatenate(([0.0], np.cumsum(course) / TURN))
    middles = np.interp(np.arange(1.0, turned[-1]), turned, np.arange(turned.size))
    past: angle.Past = ()
    found = []
    for before, middle in pairwise(middles):
        law = angle.angle_law(middle, middle - before, 0.2 * (middle - before), {}, past)
        past = law.past
        true = 2.0 * np.pi / TURN * course[min(int(middle), course.size - 1)]
        found.append((middle / TURN, law.std, abs(law.step / true - 1.0)))
    return found


def main() -> None:
    """Print a table."""
    sizes, lengths, phases = (0.03, 0.06, 0.12), (0.3, 1.0, 2.0), np.arange(0.0, 1.0, 0.125)
    for remembered in (angle.REMEMBERED, angle.REMEMBERED - 1):
        rows: dict[int, list[tuple[float, float, float]]] = {}
        with mock.patch.object(angle, "REMEMBERED", remembered):
            for size, length, phase in product(sizes, lengths, phases):
                for sign, even in product((-1.0, 1.0), (False, True)):
                    found = turns_of(rate(sign * size, length, phase, even=even))
                    over = [row for row in found if row[0] > BEGINS + phase + length]
                    for place, row in enumerate(over[:5], start=1):
                        rows.setdefault(place, []).append(row)
        for place, values in rows.items():
            _, doubt, error = np.array(values).T
            known = error <= 2.0 * doubt + 1e-12
            flagged = doubt > LARGEST_ANGLE_STD
            sys.stdout.write(
                f"| {remembered - 1} | {place} | {np.mean(flagged):.0%} | {np.mean(known):.0%} | "
                f"{error.max():.2%} | {error[~flagged].max():.2%} |\n"
            )


if __name__ == "__main__":
    with one_thread():
        main()
