"""A recording as stretches of samples without a break in time, with what was known beside them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from tirebench.links import BACK, RESUMED
from tirebench.recording.recording import Recording
from tirebench.setup.source_plan import SourcePlan, wheels_of
from tirebench.wire.conditions import QUANTITIES, Conditions
from tirebench.wire.timeline import Samples
from tirelib.core.arrays import BoolArray, FloatArray

EVERY_WHEEL = tuple(range(256))


@dataclass(slots=True)
class Segment:
    """Samples of one wheel without a break in time.

    Attributes
    ----------
    wheel, number : int
    first_us, t_us : int, [us]
        Device time of the wheel's very first sample, and of this segment's.
    period : float, [s]
    blocks : list of Samples
    bus_conditions : list of (int, str, float)
        Conditions from a bus: device time from which it holds [us], condition, value (SI). Those at
        the beginning were sent before.
    """

    wheel: int
    number: int
    first_us: int
    t_us: int
    period: float
    blocks: list[Samples] = field(default_factory=list)
    bus_conditions: list[tuple[int, str, float]] = field(default_factory=list)

    @property
    def end_us(self) -> int:
        """Device time of the sample that would follow, [us]."""
        return self.blocks[-1].end_us if self.blocks else self.t_us

    @property
    def strain(self) -> FloatArray:
        """All samples, shape (n, 5), NaN where lost or saturated."""
        return np.concatenate([block.strain for block in self.blocks])

    @property
    def lost(self) -> BoolArray:
        """Where no frame brought the sample, shape (n,)."""
        return np.concatenate([block.lost for block in self.blocks])

    def known(self, base: Conditions) -> Conditions:
        """Return the conditions of this segment: those that were given, and those from a bus."""
        moments = {self.t_us}
        moment = base.next_change(self.t_us)
        while moment < self.end_us:
            moments.add(round(moment))
            moment = base.next_change(moment)
        moments |= {t_us for t_us, _, _ in self.bus_conditions if t_us < self.end_us}
        times, names = sorted(moments), list(QUANTITIES)
        values = []
        bus_conditions = dict.fromkeys(names, np.nan)
        waiting = [entry for entry in self.bus_conditions if entry[1] in bus_conditions]
        for time in times:
            while waiting and waiting[0][0] <= time:
                _, name, value = waiting.pop(0)
                bus_conditions[name] = value
            given = dict(zip(names, base.at(time), strict=True))
            values.append(
                tuple(
                    bus_conditions[n] if bus_conditions[n] == bus_conditions[n] else given[n]
                    for n in names
                )
            )
        return Conditions(tuple(times), tuple(values), base.runs)


def segments(
    recording: Recording,
    sources: Sequence[SourcePlan],
    wheel: int | None = None,
    note: Callable[[str], object] = str,
) -> Iterator[Segment]:
    """Yield the segments of all wheels, or of one, each when it is complete.

    `note` is called for each wheel whose clock contradicts its sample rate: its samples are as it
    sent them, their times are not to be trusted.
    """
    wheels = wheels_of(sources, EVERY_WHEEL if wheel is None else (wheel,))
    current: dict[int, Segment] = {}
    bus_conditions: dict[int, dict[str, float]] = {}
    for read in recording.reads():
        if read.event in (BACK, RESUMED):
            wheels.interrupt(read.source)
        if not read.data:
            continue
        for block in wheels.push(read.data, read.arrival, read.source):
            number, content = block.wheel, block.content
            if not isinstance(content, Samples):
                name, value = content.measured.name, content.measured.value
                bus_conditions.setdefault(number, {})[name] = value
                if number in current:
                    current[number].bus_conditions.append((content.t_us, name, value))
                continue
            if content.reset or number not in current:
                if number in current:
                    yield current[number]
                before = [
                    (content.t_us, *entry) for entry in bus_conditions.get(number, {}).items()
                ]
                current[number] = Segment(
                    number,
                    content.segment,
                    block.first_us,
                    content.t_us,
                    content.period,
                    bus_conditions=before,
                )
            current[number].blocks.append(content)
    yield from current.values()
    for said in wheels.contradicted.values():
        note(said)
