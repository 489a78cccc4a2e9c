"""What is said of a recording at the start: how long the room lasts, and what triggers."""

from pathlib import Path

import pytest

from tirebench.cli.recording import at_start
from tirebench.links.opening import PortPlan
from tirebench.live.reader import ReaderPlan
from tirebench.live.recording_state import RecordingRule
from tirebench.protocols.plan import ProtocolPlan
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.device import Device


def four(wheels: tuple[int | None, ...] = (0, 1, 2, 3)) -> ReaderPlan:
    """Return a reader of four ports, whose wheels may not be known."""
    protocol = ProtocolPlan(rate=1e4)
    ports = [PortPlan(f"tcp://h:{1 + port}") for port in range(4)]
    sources = tuple(
        SourcePlan(port, protocol, {None: Device()}, wheel)
        for port, wheel in zip(ports, wheels, strict=True)
    )
    return ReaderPlan(sources, 0.0)


@pytest.mark.parametrize("wheels", [(0, 1, 2, 3), (None, None, None, None)])
@pytest.mark.parametrize(("strain", "hours"), [(True, "10 h of 4"), (False, "29 h of 4")])
def test_the_room_is_for_all_wheels_that_are_read(
    monkeypatch: pytest.MonkeyPatch, wheels: tuple[int | None, ...], strain: bool, hours: str
) -> None:
    monkeypatch.setattr("tirebench.cli.recording.free_at", lambda _: 30e9)
    said = at_start(Path("a.mcap"), four(wheels), RecordingRule(strain), watched=True)
    assert said == f"room for the recording: 30.0 GB, about {hours} wheels at 10 kHz"


@pytest.mark.parametrize("watched", [True, False])
@pytest.mark.parametrize("around", [None, (10.0, 20.0)])
def test_what_cannot_trigger_is_said(watched: bool, around: tuple[float, float] | None) -> None:
    said = at_start(Path("a.mcap"), four(), RecordingRule(around=around), watched=watched)
    assert ("only a lost port and alarms" in said) == (around is not None and not watched)
    assert ("keeping the 10 s before an event takes up to 40 MB of memory" in said) == (
        around is not None
    )
