"""Faults on request: what goes wrong between a gage and the receiver.

``NAME[=VALUE]``; a rate is per frame (``nan``: per sample).

============  ==================================================  =======
name          does                                                default
============  ==================================================  =======
``flips``     flips one bit of a frame on the wire                0.01
``cuts``      removes 1 to 8 bytes of a frame                     0.01
``inserts``   puts 1 to 39 random bytes into a frame              0.01
``lost``      leaves a frame out                                  0.01
``dup``       sends a frame twice                                 0.01
``nan``       marks lone samples of all gages as unusable         0.001
``saturate``  the gage of this number clips in the contact        1
``dead``      the gage of this number stands still                1
============  ==================================================  =======
"""

from collections import Counter
from collections.abc import Iterable, Mapping

import numpy as np

from bench.errors import DeviceError
from bench.frames import GAGES, HIGHEST, LOWEST, Int16Array

RATES = {"flips": 0.01, "cuts": 0.01, "inserts": 0.01, "lost": 0.01, "dup": 0.01, "nan": 0.001}
"""Faults that strike at random, and how often by default."""
GAGE_FAULTS = ("saturate", "dead")
"""Faults of one gage, given by its number."""
CLIP = 0.6
"""A clipped gage shows this share of the swing between its lowest and highest strain."""


def parse_faults(texts: Iterable[str]) -> dict[str, float]:
    """Return faults by name from ``NAME`` or ``NAME=VALUE``.

    Raises
    ------
    DeviceError
        With every fault in the texts.

    Examples
    --------
    >>> parse_faults(["flips=0.04", "lost", "saturate=2"])
    {'flips': 0.04, 'lost': 0.01, 'saturate': 2.0}
    """
    faults: dict[str, float] = {}
    problems = []
    for text in texts:
        name, _, given = text.partition("=")
        if name not in RATES and name not in GAGE_FAULTS:
            problems.append(f"--fault {text}: {name!r} is not known; allowed are "
                            f"{', '.join((*RATES, *GAGE_FAULTS))}; name one of them")  # fmt: skip
            continue
        low, high = (0.0, 1.0) if name in RATES else (1, GAGES)
        try:
            value = float(given) if given else RATES.get(name, 1.0)
        except ValueError:
            value = float("nan")
        if not low <= value <= high or (name in GAGE_FAULTS and value != int(value)):
            what = "a rate per frame" if name in RATES else "the number of a gage"
            problems.append(f"--fault {text}: {given!r} is not {what}; {low} .. {high} is allowed; "
                            "correct it")  # fmt: skip
            continue
        faults[name] = value
    if problems:
        raise DeviceError(problems)
    return faults


class Faults:
    """Strike counts and frames; what was done is counted.

    Parameters
    ----------
    rates : mapping of name to value, from `parse_faults`
    seed : int
    """

    def __init__(self, rates: Mapping[str, float], seed: int = 0) -> None:
        self.done: Counter[str] = Counter()
        self._rates = dict(rates)
        self._rng = np.random.default_rng(seed)

    def gages(self, counts: Int16Array) -> tuple[Int16Array, Int16Array]:
        """Return counts of shape (n, 5) after gage faults, and the flag bits of each sample."""
        counts = counts.copy()
        bits = np.zeros(len(counts), np.int16)
        if "dead" in self._rates:
            gage = int(self._rates["dead"]) - 1
            counts[:, gage] = counts[0, gage]
            self.done["dead"] += len(counts)
        if "saturate" in self._rates:
            gage = int(self._rates["saturate"]) - 1
            low, high = (int(x) for x in (counts[:, gage].min(), counts[:, gage].max()))
            clipped = counts[:, gage] > low + CLIP * (high - low)
            counts[clipped, gage] = HIGHEST
            bits[clipped] |= 1 << gage
            self.done["saturate"] += int(clipped.sum())
        if "nan" in self._rates:
            hit = self._rng.random(counts.shape) < self._rates["nan"]
            counts[hit] = LOWEST
            bits |= (hit << np.arange(GAGES)).sum(axis=1).astype(np.int16)
            self.done["nan"] += int(hit.sum())
        return counts, bits

    def wire(self, frames: Iterable[bytes]) -> list[bytes]:
        """Return frames after faults on the wire; a lost one is empty, so that time goes on."""
        return [self._strike(frame) for frame in frames]

    def _strike(self, frame: bytes) -> bytes:
        for name in ("lost", "dup", "flips", "cuts", "inserts"):
            rate = self._rates.get(name)
            if rate is None or self._rng.random() >= rate:
                continue
            self.done[name] += 1
            return self._damaged(name, frame)
        return frame

    def _damaged(self, name: str, frame: bytes) -> bytes:
        if name == "lost":
            return b""
        if name == "dup":
            return frame + frame
        data = bytearray(frame)
        place = int(self._rng.integers(len(data)))
        if name == "flips":
            data[place] ^= 1 << int(self._rng.integers(8))
        elif name == "cuts":
            del data[place : place + int(self._rng.integers(1, 9))]
        else:
            data[place:place] = self._rng.bytes(int(self._rng.integers(1, 40)))
        return bytes(data)
