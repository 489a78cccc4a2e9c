"""Half and double of the numbers that tell a burst: ``python build/burst_constants.py``.

The centre gage of the virtual tire rolls 40 turns at 20 m/s, steadily, with a burst in it: a short
one (2 to 20 samples of one height, or of noise), or a long one (45 to 500 samples of noise of
15,000 to 80,000 microstrain rms). Printed for each number: how many of the contacts are lost, on
average and at most (not found, found a sample off, or found as after a standstill), how many are
found after the burst that are none, and how many contacts of undisturbed strain at 5 to 40 m/s, at
2 and 6 kN, are said to hold a burst.
"""

import sys
from collections.abc import Iterator

import numpy as np
from ramp_error import RATE, play
from road_constants import times

from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.measured.signal import contacts
from tirelib.measured.signal.contacts import Contact, ContactFinder
from tirelib.measured.signal.turns import LONGEST_TURN

CENTRE, TRIALS, NEAR = 2, 60, 20
NUMBERS = (
    *("SLEW", "LEAST_SLEW", "LONGEST_BURST", "JUMP"),
    *("MOST_TURNS_WITHOUT_CONTACT", "SHORTER", "MOST_PULSES_WITHOUT_CONTACT"),
)


def found(strain: FloatArray) -> list[Contact]:
    """Return the contacts of a gage."""
    return list(ContactFinder(int(LONGEST_TURN * RATE)).push(strain))


def disturbed(strain: FloatArray, *, long: bool) -> Iterator[tuple[FloatArray, int]]:
    """Yield the strain with one burst each, after the tenth turn, and where the burst ends."""
    for seed in range(TRIALS):
        rng = np.random.default_rng([seed, long])
        length = int(rng.integers(45, 500) if long else rng.integers(2, 21))
        first = int(rng.integers(strain.size // 4, strain.size // 2))
        size = rng.uniform(0.015, 0.08) if long else rng.choice([0.05, -0.03, 0.014, -0.005])
        burst = rng.standard_normal(length) if long or rng.random() < 0.5 else np.ones(length)
        other = strain.copy()
        other[first : first + length] += size * burst
        yield other, first + length


def lost(strain: FloatArray, *, long: bool) -> tuple[float, int, int]:
    """Return the mean and the largest number of contacts lost, and those that are none."""
    middles = np.array([contact.middle for contact in found(strain)])
    counts, wrong = [], 0
    for other, end in disturbed(strain, long=long):
        seen = [one for one in found(other) if not (one.fresh or one.damaged)]
        here = np.array([one.middle for one in seen])
        apart = np.abs(middles[1:, None] - here).min(axis=1, initial=np.inf)
        counts.append(int((apart > 1.0).sum()))
        late = here[here > end + NEAR]
        wrong += int((np.abs(late[:, None] - middles).min(axis=1) > NEAR).sum())
    return float(np.mean(counts)), max(counts), wrong


def main() -> None:
    """Print a table."""
    still = [
        play(30.0 / speed, lambda _, v=speed, fz=load: {"speed": v, "Fz": fz})["strain"][CENTRE]
        for speed in (5.0, 20.0, 40.0)
        for load in (2000.0, 6000.0)
    ]
    strain = play(4.0, lambda _: {"speed": 20.0})["strain"][CENTRE]
    for name in NUMBERS:
        for factor in (0.5, 1.0, 2.0):
            with times(contacts, name, factor):
                cells = [lost(strain, long=long) for long in (False, True)]
                called = sum(contact.burst for part in still for contact in found(part))
                value = getattr(contacts, name)
            shown = "; ".join(f"{mean:.2f}, {most}, {wrong}" for mean, most, wrong in cells)
            sys.stdout.write(f"| `{name}` {value:g} | {shown} | {called} |\n")
            sys.stdout.flush()


if __name__ == "__main__":
    with one_thread():
        main()
