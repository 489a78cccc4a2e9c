"""Faults on request between a gage and the receiver.

``NAME[=VALUE]``; a rate is per frame (``nan``: per sample, ``fades``: per second).

============  ==========================================================  =======
name          does                                                        default
============  ==========================================================  =======
``flips``     flips one bit of a frame on the wire                        0.01
``cuts``      removes 1 to 8 bytes of a frame                             0.01
``inserts``   puts 1 to 39 random bytes into a frame                      0.01
``lost``      leaves a frame out                                          0.01
``dup``       sends a frame twice                                         0.01
``nan``       marks lone samples of all gages as unusable                 0.001
``fades``     the radio is gone for 0.05 to 0.5 s                         0.2
``saturate``  the gage of this number clips in the contact                1
``dead``      the gage of this number stands still                        1
``hum``       60 Hz on all gages, amplitude in microstrain                20
``drift``     the device's clock is fast by so many ppm                   50
``reset``     the device restarts after so many seconds, again and again  5
============  ==========================================================  =======
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from tirebench.errors import DeviceError
from tirebench.wire.frames import GAGES, HIGHEST, LOWEST, Int16Array
from tirelib.core.arrays import FloatArray

RATES = {"flips": 0.01, "cuts": 0.01, "inserts": 0.01, "lost": 0.01, "dup": 0.01, "nan": 0.001}
"""Random faults, with their default rates."""
GAGE_FAULTS = ("saturate", "dead")
"""Faults of one gage, given by its number."""
SIZES = {
    "fades": (0.2, 0.0, 10.0, "a number of fades a second"),
    "hum": (20.0, 0.0, 5000.0, "an amplitude in microstrain"),
    "drift": (50.0, -5000.0, 5000.0, "ppm"),
    "reset": (5.0, 0.1, 1e6, "a time in seconds"),
}
"""Faults with a size: default, lowest, highest, what it is."""
TEXT_FAULTS = ("flips", "cuts", "inserts")
"""Faults of bytes; a bus with a checksum of its own shows none of them."""
CLIP = 0.6
"""A clipped gage shows this share of the swing between its lowest and highest strain."""
SHORTEST_FADE, LONGEST_FADE = 0.05, 0.5
HUM = 60.0
"""Frequency, [Hz]."""


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
        if name not in RATES and name not in GAGE_FAULTS and name not in SIZES:
            problems.append(
                f"--fault {text}: unknown fault {name!r}; allowed are "
                f"{', '.join((*RATES, *GAGE_FAULTS, *SIZES))}; name one of them"
            )
            continue
        usual, low, high, what = _range(name)
        try:
            value = float(given) if given else usual
        except ValueError:
            value = float("nan")
        if not low <= value <= high or (name in GAGE_FAULTS and value != int(value)):
            problems.append(
                f"--fault {text}: {given!r} is not {what}; {low:g} .. {high:g} is "
                "allowed; correct it"
            )
            continue
        faults[name] = value
    if problems:
        raise DeviceError(problems)
    return faults


def _range(name: str) -> tuple[float, float, float, str]:
    if name in RATES:
        return RATES[name], 0.0, 1.0, "a rate per frame"
    if name in GAGE_FAULTS:
        return 1.0, 1.0, float(GAGES), "the number of a gage"
    return SIZES[name]


class Faults:
    """Applies faults to counts and frames, and counts them.

    Parameters
    ----------
    rates : mapping of name to value, from `parse_faults`
    seed : int
    """

    def __init__(self, rates: Mapping[str, float], seed: int = 0) -> None:
        self.done: Counter[str] = Counter()
        self._rates = dict(rates)
        self._rng = np.random.default_rng(seed)
        self._fade = (0.0, 0.0)  # begin and end of the next one, [s]
        if "fades" in self._rates:
            self._next_fade(0.0)

    @property
    def drift(self) -> float:
        """How much the device's clock is fast, relative."""
        return 1e-6 * self._rates.get("drift", 0.0)

    @property
    def reset(self) -> float:
        """Time between two restarts of the device, [s]; infinite without."""
        return self._rates.get("reset", float("inf"))

    def gages(
        self, counts: Int16Array, period: float = 1e-4, per_count: float = 0.02 / 32768
    ) -> tuple[Int16Array, Int16Array]:
        """Return counts of shape (n, 5) after gage faults, and the flag bits of each sample.

        Parameters
        ----------
        period : float, [s]
        per_count : float
            Strain of a count.
        """
        counts = counts.copy()
        bits = np.zeros(len(counts), np.int16)
        if "hum" in self._rates:
            time = period * np.arange(len(counts))
            hum = 1e-6 * self._rates["hum"] / per_count * np.sin(2.0 * np.pi * HUM * time)
            sound = (counts != HIGHEST) & (counts != LOWEST)
            moved = np.clip(np.rint(counts + hum[:, None]), LOWEST, HIGHEST).astype(np.int16)
            counts = np.where(sound, moved, counts)
            self.done["hum"] += len(counts)
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

    def wire(self, frames: Iterable[bytes], due: "FloatArray | None" = None) -> list[bytes]:
        """Return frames after faults on the wire; a lost one is empty, so that time goes on."""
        struck = [self._strike(frame) for frame in frames]
        return struck if due is None else self._faded(struck, due, b"")

    def bus(self, frames: Sequence[Any], due: FloatArray) -> list[list[Any]]:
        """Return for each frame of a bus what is sent in its place: it, nothing, or it twice."""
        sent: list[list[Any]] = [[frame] for frame in frames]
        for name, times in (("lost", 0), ("dup", 2)):
            rate = self._rates.get(name)
            if rate is not None:
                for row in np.flatnonzero(self._rng.random(len(sent)) < rate).tolist():
                    if sent[row]:
                        sent[row] = sent[row][:1] * times
                        self.done[name] += 1
        return self._faded(sent, due, [])

    def _faded(self, frames: list[Any], due: FloatArray, nothing: Any) -> list[Any]:
        if "fades" not in self._rates:
            return frames
        kept = list(frames)
        for row, moment in enumerate(due.tolist()):
            while moment > self._fade[1]:
                self._next_fade(self._fade[1])
            if moment >= self._fade[0]:
                kept[row] = nothing
                self.done["fades"] += 1
        return kept

    def _next_fade(self, after: float) -> None:
        rate = max(self._rates["fades"], 1e-9)
        begin = after + float(self._rng.exponential(1.0 / rate))
        self._fade = (begin, begin + float(self._rng.uniform(SHORTEST_FADE, LONGEST_FADE)))

    def _strike(self, frame: bytes) -> bytes:
        for name in ("lost", "dup", *TEXT_FAULTS):
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
