"""The last samples of a wheel, each by its number since the start, in bounded memory."""

from dataclasses import replace
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.held import HELD, Held
from tirelib.measured.signal.contacts import NEAR_EDGE, Contact

LARGEST_MISSING = 0.1
"""Share of missing samples with which an offset or a mean is still formed."""


class LastSamples:
    """Strain, held conditions and trigger of the last samples.

    Parameters
    ----------
    gages : int
    centre : int
        Row of the gage that finds the contacts.
    room : int
        Number of samples that are held at most.

    Attributes
    ----------
    base, end : int
        Number of the first sample that is held, and that after the last one.
    """

    def __init__(self, gages: int, centre: int, room: int) -> None:
        self._gages, self._centre = gages, centre
        # rows: gages, then the held conditions, then the trigger
        # zeros take memory when they are written; what lies behind `end` is never read
        self._values: FloatArray = np.zeros((gages + len(HELD) + 1, room))
        self.base = self.end = 0

    def take(
        self, strain: FloatArray, held: Held, trigger: BoolArray | None, part: slice, oldest: int
    ) -> None:
        """Add the samples of `part`; where there is no room, drop what is before `oldest`."""
        n, filled = part.stop - part.start, self.end - self.base
        if filled + n > self._values.shape[1]:
            drop = max(oldest - self.base, filled + n - self._values.shape[1])
            self._values[:, : filled - drop] = self._values[:, drop:filled]
            self.base += drop
            filled -= drop
        columns = slice(filled, filled + n)
        self._values[: self._gages, columns] = strain[:, part]
        for row, name in enumerate(HELD, start=self._gages):
            value: Any = held.get(name, np.nan)
            self._values[row, columns] = value[part] if isinstance(value, np.ndarray) else value
        self._values[-1, columns] = np.nan if trigger is None else trigger[part]
        self.end += n

    def since(self, oldest: int) -> FloatArray:
        """Return all rows from a sample on."""
        return self._values[:, oldest - self.base : self.end - self.base].copy()

    def refill(self, values: FloatArray, end: int) -> None:
        """Hold just what `since` returned when the last sample was that before `end`."""
        self.base, self.end = end - values.shape[1], end
        self._values[:, : values.shape[1]] = values

    def strain(self, first: int, stop: int) -> FloatArray:
        """Return the strain of all gages from one sample to another, oldest first."""
        return self._values[: self._gages, first - self.base : stop - self.base]

    def held(self, name: str, first: int, stop: int) -> FloatArray:
        """Return a held condition."""
        row = self._gages + HELD.index(name)
        return self._values[row, max(first - self.base, 0) : stop - self.base]

    def inspected(self, contact: Contact) -> Contact:
        """Return a contact as damaged where samples of the centre gage are missing at its ends."""
        for edge in (contact.rise, contact.fall):
            near = int(edge) - self.base
            part = self._values[self._centre, max(near - NEAR_EDGE, 0) : near + 2]
            if not np.isfinite(part).all():
                return replace(contact, damaged=True)
        return contact

    def gap_between(self, before: Contact, contact: Contact) -> bool:
        """Tell whether samples of the centre gage are missing between two contacts."""
        a, b = int(before.fall) - self.base, int(contact.rise) - self.base
        return not np.isfinite(self._values[self._centre, max(a, 0) : b]).all()

    def mean_strain(
        self, start: float, stop: float, *, robust: bool = False
    ) -> tuple[FloatArray, BoolArray]:
        """Return each gage's mean, or median, and for which of them too much is missing."""
        return self._mean(slice(0, self._gages), start, stop, robust=robust)

    def conditions(self, start: float, stop: float) -> dict[str, float]:
        """Return the means of what was held."""
        means, _ = self._mean(slice(self._gages, self._gages + len(HELD)), start, stop)
        return dict(zip(HELD, means.tolist(), strict=True))

    def in_contact(self, name: str, contact: Contact) -> float:
        """Return the mean of a held condition while the gages are in contact, where it acts."""
        row = self._gages + HELD.index(name)
        mean, _ = self._mean(slice(row, row + 1), contact.rise, contact.fall + 1.0)
        return float(mean[0])

    def triggers(self, start: float, stop: float) -> FloatArray | None:
        """Return when the trigger came, between two samples each; None where it is unknown."""
        first = max(round(start), self.base)
        seen = self._values[-1, first - self.base : round(stop) - self.base]
        if seen.size == 0 or np.isnan(seen).any():
            return None
        on = np.flatnonzero((seen[1:] > 0.5) & (seen[:-1] <= 0.5))
        return np.asarray(on + (first + 0.5), dtype=np.float64)

    def _mean(
        self, rows: slice, start: float, stop: float, *, robust: bool = False
    ) -> tuple[FloatArray, BoolArray]:
        """Mean (or median) of rows between two sample numbers; where too much is missing."""
        a = max(round(start) - self.base, 0)
        b = min(round(stop), self.end) - self.base
        part = self._values[rows, a:b]
        good = np.isfinite(part)
        if good.size and good.all():
            middle = np.median(part, axis=1) if robust else part.mean(axis=1)
            return middle, np.zeros(part.shape[0], dtype=np.bool_)
        count = good.sum(axis=1)
        gap = count < max((1.0 - LARGEST_MISSING) * part.shape[1], 1.0)
        middle = np.full(part.shape[0], np.nan)
        average = np.median if robust else np.mean
        for row in np.flatnonzero(~gap):
            middle[row] = average(part[row, good[row]])
        return middle, gap
