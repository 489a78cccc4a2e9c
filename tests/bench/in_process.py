"""Bytes to turns without processes, as a replay does it; and a source of news for a page."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tirebench.deadline import Deadline
from tirebench.estimator.chain import Estimator, Turn
from tirebench.estimator.estimation import Estimation, News
from tirebench.estimator.wheels import Wheels
from tirebench.protocols import Decoder
from tirebench.protocols.decoder import SerialDecoder
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device
from tirebench.wire.timeline import Timeline


class InProcess:
    """A line and what is made of it."""

    def __init__(
        self,
        estimator: Callable[[int], Estimator],
        conditions: Conditions,
        devices: Mapping[int | None, Device] | None = None,
        decoder: Decoder | None = None,
        chosen: Sequence[int] = (),
    ) -> None:
        known = {None: Device()} if devices is None else devices
        self.wheels = Wheels.of_one(decoder or SerialDecoder(), known, chosen)
        self.estimation = Estimation(estimator, conditions)

    @property
    def timeline(self) -> Timeline:
        """Timeline of the first wheel that was heard."""
        return next(iter(self.wheels.heard.values())).timeline

    def push(self, data: bytes, arrival: int = 0) -> list[Turn]:
        return self.estimation.take(self.wheels.push(data, arrival)).turns

    def finish(self) -> list[Turn]:
        return self.estimation.finish().turns


class FakeSource:
    """A line that was told what to say; see `tirebench.estimator.session.Source`."""

    name, live, ended, message = "port", True, "", ""
    last_byte: float | None = None

    def __init__(self, *numbers: int) -> None:
        self.heard: float | None = None
        self.lost: float | None = None
        self.wheels = Wheels.of_one(SerialDecoder(), {None: Device()})
        self.skipped = 0
        for number in numbers:
            self.hear(number)

    def hear(self, number: int) -> None:
        counts = self.wheels._wheel(number).timeline.counts
        self.wheels.line.counts.ok, self.wheels.line.counts.crc = 7, 3
        counts.lost_frames = 2

    def counts(self) -> dict[str, Any]:
        return {}

    def cpu_time(self) -> float:
        return 0.0

    def wheel_counts(self, wheel: int) -> dict[str, int]:
        return {"skipped_turns": self.skipped, "estimator_restarts": 0, "queue_overruns": 0}

    def poll(self, deadline: Deadline) -> News:
        return News()

    def finish(self, reason: str) -> News:
        return News()
