"""One line, several wheels: a decoder, and a chain with its own estimator for each wheel."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from bench.chain import Chain, Estimator, Turn
from bench.conditions import Conditions, Measured
from bench.device import Device
from bench.frames import Frames, select
from bench.line_counts import LineCounts
from bench.protocols import Decoder
from bench.timeline import TimelineCounts

MOST = 4
"""Wheels that are looked at unless others are named; each costs an estimator."""


class Wheels:
    """Bytes of one line to the turns of all its wheels; the same bytes give the same turns.

    Parameters
    ----------
    decoder : Decoder
    estimator : callable
        Gives the estimator of a wheel by its number.
    devices : mapping of wheel to Device
        ``None`` is the key of the device for all others.
    conditions : Conditions
    chosen : sequence of int, optional
        Wheels to look at; by default the first `MOST` that are heard.

    Attributes
    ----------
    chains : dict of wheel to Chain
        In the order in which the wheels were heard.
    ignored : int
        Frames of other wheels.
    """

    def __init__(
        self,
        decoder: Decoder,
        estimator: Callable[[int], Estimator],
        devices: Mapping[int | None, Device],
        conditions: Conditions,
        chosen: Sequence[int] = (),
    ) -> None:
        self.line = decoder
        self.chains: dict[int, Chain] = {}
        self.ignored = 0
        self._estimator = estimator
        self._devices = dict(devices)
        self._conditions = conditions
        self._chosen = tuple(chosen)
        self._told: dict[str, Measured] = {}  # what the bus told last

    def push(self, data: bytes, arrival: int = 0) -> list[Turn]:
        """Take bytes that came at a moment [ns, monotonic] and return the turns that they end."""
        sorted_items: dict[int, list[Frames | Measured]] = {wheel: [] for wheel in self.chains}
        for item in self.line.push(data, arrival):
            if isinstance(item, Measured):
                self._told[item.name] = item
                for items in sorted_items.values():
                    items.append(item)
                continue
            for wheel in np.unique(item.wheel).tolist():
                rows = item.wheel == wheel
                if self._wanted(wheel, len(sorted_items)):
                    items = sorted_items.setdefault(wheel, list(self._told.values()))
                    items.append(item if rows.all() else select(item, rows))
                else:
                    self.ignored += int(rows.sum())
        turns: list[Turn] = []
        for wheel, items in sorted_items.items():
            if items:
                turns += self._chain(wheel).take(items, arrival)
        return turns

    @property
    def counts(self) -> tuple[LineCounts, TimelineCounts]:
        """What was seen and lost so far, all wheels together."""
        total = sum((chain.timeline.counts for chain in self.chains.values()), TimelineCounts())
        total.other_wheel += self.ignored
        return self.line.counts, total

    def interrupt(self) -> None:
        """Note that the line was broken here: a half frame is forgotten."""
        self.line.interrupt()
        self.line.counts.reconnects += 1

    def finish(self) -> list[Turn]:
        """Step what is left of every wheel."""
        return [turn for chain in self.chains.values() for turn in chain.finish()]

    def _wanted(self, wheel: int, heard: int) -> bool:
        if self._chosen:
            return wheel in self._chosen
        return wheel in self.chains or heard < MOST  # heard counts the chains too

    def _chain(self, wheel: int) -> Chain:
        if wheel not in self.chains:
            device = self._devices.get(wheel, self._devices.get(None, Device()))
            self.chains[wheel] = Chain(
                self._estimator(wheel), device, self._conditions, wheel, self.line
            )
        return self.chains[wheel]
