"""What is known of the conditions of a piece of a recording, from its first sample on."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from tests.bench.sources import serial, told, vehicle, wire
from tirebench.links import Read
from tirebench.recording.segments import Segment, segments
from tirebench.wire.conditions import QUANTITIES, Conditions, condition
from tirebench.wire.timeline import Samples

NAMES = list(QUANTITIES)


def piece(bus: list[tuple[int, str, float]]) -> Segment:
    """Return a tenth of a second from 2 s on."""
    n = 1000
    none = np.zeros((n, 5), np.bool_)
    block = Samples(0, "start", 0, 2_000_000, 1e-4, np.zeros((n, 5)), none[:, 0], none)
    return Segment(0, 0, 2_000_000, 2_000_000, 1e-4, [block], bus)


def test_what_a_bus_says_holds_from_its_moment_on_and_over_what_was_given() -> None:
    base = Conditions((0, 2_040_000), (condition(speed=10.0), condition(speed=20.0, pressure=2e5)))
    bus = [(2_000_000, "speed", 15.0), (2_060_000, "pressure", 2.5e5)]
    found = piece(bus).known(base)
    assert found.t_us == (2_000_000, 2_040_000, 2_060_000)
    speed, pressure = (
        [row[NAMES.index(name)] for row in found.values] for name in ("speed", "pressure")
    )
    assert speed == [15.0, 15.0, 15.0]
    np.testing.assert_array_equal(pressure, [np.nan, 2e5, 2.5e5])


def test_what_a_bus_says_after_a_piece_is_not_of_it() -> None:
    found = piece([(2_100_000, "speed", 15.0)]).known(Conditions.constant(speed=10.0))
    assert found.t_us == (2_000_000,)
    assert found.values[0][NAMES.index("speed")] == 10.0


def test_what_a_bus_said_holds_in_every_later_segment_until_it_says_something_else() -> None:
    frames = wire()
    late = 5 * len(frames) // 6  # in the last of three runs
    says = {0: told(36.0), late: told(72.0)}
    reads = []
    for place, frame in enumerate(frames):
        if place in says:
            reads.append(Read(place, says[place], "", 1))
        reads.append(Read(place, frame))
    recording: Any = SimpleNamespace(reads=lambda: iter(reads))
    found = list(segments(recording, [serial("a", wheel=3), vehicle("b")]))
    known = [segment.known(Conditions.constant(speed=1.0)).values for segment in found]
    speeds, pressures = (
        [[row[NAMES.index(name)] for row in values] for values in known]
        for name in ("speed", "pressure")
    )
    assert speeds == [[10.0], [10.0], [10.0, 20.0]]
    np.testing.assert_allclose([row[0] for row in pressures], 2.5e5)
