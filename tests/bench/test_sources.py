"""Several sources in one run: told apart, contradictions refused, replayed to the bit."""

import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from tests.bench.in_process import FakeSource
from tests.bench.programs import PATIENCE
from tests.bench.servers import Server
from tests.bench.sources import VEHICLE, serial, told, vehicle, wire
from tests.bench.test_page import turn as made_turn
from tests.bench.test_processes import Turns
from tirebench.cli import program
from tirebench.cli.run_inputs import given_replayed
from tirebench.deadline import Deadline
from tirebench.emulator.sources import recording_pieces
from tirebench.errors import DeviceError
from tirebench.estimator.chain import Turn
from tirebench.estimator.estimation import Estimation, News
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.estimator.session import Session
from tirebench.estimator.wheels import BusCondition, Line, Wheels
from tirebench.links import Read
from tirebench.links.opening import PortPlan
from tirebench.live.chain import LiveChain
from tirebench.live.live_plan import LivePlan
from tirebench.live.reader import ReaderPlan
from tirebench.protocols import SLCAN
from tirebench.protocols.decoder import SerialDecoder
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.user_map import parse_map
from tirebench.recording.document import turn_document
from tirebench.recording.link import ReplayLink
from tirebench.recording.recording import Recorder, Recording, RecordingHeader
from tirebench.recording.replay import ReplayChain
from tirebench.setup.source_plan import SourcePlan, wheels_of
from tirebench.wire.conditions import Conditions
from tirebench.wire.frames import encode, strain_frames
from tirebench.wire.rate_check import JUDGED


@pytest.fixture
def file(toy_fmus: dict[int, Path]) -> Iterator[FmuFile]:
    with FmuFile(read_fmu(toy_fmus[16])) as opened:
        yield opened


def gathered(chain: LiveChain, news: News, enough: Callable[[], bool]) -> None:
    end = Deadline.after(PATIENCE)
    while not enough():
        news.add(chain.poll(Deadline.after(0.05)))
        assert not end.expired, chain.counts()


def by_wheel(news: News) -> dict[int, list[dict[str, Any]]]:
    turns: dict[int, list[dict[str, Any]]] = {}
    for turn in news.turns:
        turns.setdefault(turn.wheel, []).append(turn_document(turn))
    return turns


def replayed(path: Path, file: FmuFile) -> tuple[News, Wheels]:
    models: list[FmuModel] = []

    def model(_: int) -> FmuModel:
        models.append(FmuModel(file))
        return models[-1]

    with ReplayLink(path) as link:
        given = given_replayed(link, None, {}, (), Console(quiet=True))
        wheels = wheels_of(given.sources, given.wheels)
        estimation = Estimation(model, given.conditions, link.recording.jumps())
        chain, news = ReplayChain(link, wheels, estimation), News()
        while not chain.ended:
            news.add(chain.poll(Deadline.never()))
        news.add(chain.finish("end"))
    for one in models:
        one.close()
    return news, wheels


def speed_of(chain: LiveChain) -> float:
    known = chain.wheels._bus_conditions.get(("speed", None))
    return 0.0 if known is None else 3.6 * known.value


def test_two_wheels_and_the_vehicle_on_one_clock_are_replayed_to_the_bit(
    file: FmuFile, tmp_path: Path
) -> None:
    frames = wire()
    half = len(frames) // 2
    first, second, faster = Event(), Event(), Event()

    def wheel_may(number: int) -> None:
        (first if number < half else second).wait()

    left, right = (Server(frames, wheel_may) for _ in range(2))
    bus = Server([told(65.0), told(72.0)], lambda number: faster.wait() if number else None)
    sources = (
        SourcePlan(PortPlan(left.url)),
        SourcePlan(PortPlan(right.url), wheel=3),
        vehicle(bus.url),
    )
    head, *more = (source.as_header() for source in sources)
    header = RecordingHeader({}, protocol=head, more=tuple(more))
    plan = LivePlan(
        ReaderPlan(sources, 60.0, every_turn=True),
        file,
        Conditions.constant(),
        header,
        tmp_path / "a.mcap",
    )
    news = News()
    with LiveChain(plan) as chain:
        gathered(chain, news, lambda: speed_of(chain) == pytest.approx(65.0))
        first.set()
        gathered(chain, news, lambda: all(len(by_wheel(news).get(w, ())) > 1 for w in (0, 3)))
        os.kill(chain.process_ids["reader"] or 0, signal.SIGKILL)  # what the ports bring waits
        gathered(chain, news, lambda: chain.counts()["restarts"]["reader"] == 1)
        faster.set()
        gathered(chain, news, lambda: speed_of(chain) == pytest.approx(72.0))
        second.set()
        size = sum(map(len, frames))
        gathered(
            chain, news, lambda: all(chain.wheels.line_counts(w).bytes == size for w in (0, 3))
        )
        news.add(chain.finish("stopped"))
        assert {f"port {n}" for n in range(3)} <= chain.process_ids.keys()
        counts = chain.wheels.counts
    for server in (left, right, bus):
        server.close()
    live = by_wheel(news)
    assert set(live) == {0, 3}
    for turns in live.values():
        assert len(turns) >= 15
        speeds = [round(3.6 * turn["kappa"], 6) for turn in turns]  # the toy gives its speed back
        assert set(speeds) == {65.0, 72.0}
        assert speeds == sorted(speeds)
    assert (counts[1].lost_samples, counts[0].bad) == (0, 0)
    again, wheels = replayed(tmp_path / "a.mcap", file)
    assert by_wheel(again) == live
    assert wheels.counts == counts


def wrong_clock(count: int = 3 * JUDGED, wheel: int = 0) -> list[bytes]:
    """Frames of a turned gage that say 10 kHz, of a wheel whose clock shows 3 % more time."""
    frames = strain_frames(np.zeros((16 * count, 5), np.int16), period=1000, wheel=wheel)
    return encode(replace(frames, t_us=np.rint(np.arange(count) * 1648.0).astype(np.int64)))


def test_a_wheel_with_a_wrong_rate_is_recorded_to_the_end_and_exported(tmp_path: Path) -> None:
    frames = wrong_clock()
    server = Server(frames)
    plan = ReaderPlan((SourcePlan(PortPlan(server.url)),), 60.0, estimated=False)
    news, size = News(), sum(map(len, frames))
    with LiveChain(
        LivePlan(
            plan, None, Conditions.constant(), RecordingHeader({}), tmp_path / "a.mcap", laps=False
        )
    ) as chain:
        gathered(chain, news, lambda: chain.wheels.line_counts(0).bytes == size)
        news.add(chain.poll(Deadline.after(0.2)))
        chain.finish("stopped")
        news.add(chain.poll(Deadline.after(0.0)))
    server.close()
    assert [
        said for said in news.alarms if "9709 samples a second, but 10000 were configured" in said
    ]
    with closing(Recording(tmp_path / "a.mcap")) as recording:
        assert b"".join(read.data for read in recording.reads()) == b"".join(frames)
    arguments = ["export", str(tmp_path / "a.mcap"), "--out", str(tmp_path / "a.csv")]
    outcome = CliRunner().invoke(program, arguments)
    assert outcome.exit_code == 0, outcome.output
    assert "note: wheel 0: its clock shows 9709 samples a second" in outcome.output


def test_a_wheel_with_a_wrong_rate_gets_no_estimates_and_the_others_do() -> None:
    good = encode(strain_frames(np.zeros((48 * JUDGED, 5), np.int16), period=1000, wheel=1))
    both = Wheels([Line(SerialDecoder(), {}), Line(SerialDecoder(), {})])
    seen = []
    for one, two in zip(wrong_clock(), good, strict=True):
        seen.append(
            {
                block.wheel
                for number, data in enumerate((one, two))
                for block in both.agreeing(both.push(data, 1, number))
            }
        )
    assert seen[-1] == {1}
    assert list(both.contradicted) == [0]
    alone = Wheels([Line(SerialDecoder(), {})])
    blocks = alone.push(b"".join(wrong_clock()), 1)
    with pytest.raises(DeviceError, match="9709 samples a second"):
        alone.agreeing(blocks)


class Reads:
    """Two sources that bring a frame each in turn, then nothing any more."""

    name, live = "reads", False

    def __init__(self, *sources: list[bytes]) -> None:
        both = (
            Read(n, one[n], "", s) for n in range(len(sources[0])) for s, one in enumerate(sources)
        )
        self._reads = iter(both)

    def receive(self, deadline: Deadline) -> Read | None:
        return next(self._reads, None)


@pytest.mark.parametrize("frames", [JUDGED - 1, 3 * JUDGED])
def test_no_turn_of_a_wheel_is_told_before_its_rate_is_judged_and_none_is_lost(frames: int) -> None:
    good = encode(strain_frames(np.zeros((16 * frames, 5), np.int16), period=1000, wheel=1))
    wheels = Wheels([Line(SerialDecoder(), {}), Line(SerialDecoder(), {})])
    link: Any = Reads(wrong_clock(frames), good)
    chain = ReplayChain(link, wheels, Estimation(lambda _: Turns(), Conditions.constant()))
    told: list[Turn] = []
    alarms: list[str] = []
    while not chain.ended:
        news = chain.poll(Deadline.never())
        told += news.turns
        alarms += news.alarms
        assert not told or wheels.judged == {0, 1}
    told += chain.finish("end").turns
    judged = frames >= JUDGED
    assert ["9709 samples a second" in text for text in alarms] == [True] * judged  # told once
    assert [turn.wheel for turn in told].count(1) == 16 * frames // 1000
    assert [turn.wheel for turn in told].count(0) == (0 if judged else 16 * frames // 1000)


def test_a_port_of_several_that_is_killed_is_read_again(tmp_path: Path) -> None:
    frames = wire()
    more = Event()
    held = Server(frames, lambda number: more.wait() if number > 9 else None)
    other = Server([told(50.0)])
    sources = (SourcePlan(PortPlan(held.url)), vehicle(other.url))
    plan = LivePlan(
        ReaderPlan(sources, 60.0),
        None,
        Conditions.constant(),
        RecordingHeader({}, more=({},)),
        tmp_path / "a.mcap",
        laps=False,
    )
    news = News()
    with LiveChain(plan) as chain:
        gathered(chain, news, lambda: chain.wheels.line_counts(0).ok >= 9)
        gathered(chain, news, lambda: speed_of(chain) > 0.0)
        os.kill(chain.process_ids["port 1"] or 0, signal.SIGKILL)
        gathered(chain, news, lambda: chain.counts()["restarts"]["port 1"] >= 1)
        before = chain.wheels.line_counts(0).ok
        more.set()
        gathered(chain, news, lambda: chain.wheels.line_counts(0).ok > before)
        chain.finish("stopped")
    held.close()
    other.close()
    recording = Recording(tmp_path / "a.mcap")
    reads = list(recording.reads())
    recording.close()
    assert {read.source for read in reads if read.data} == {0, 1}


def test_a_source_that_is_given_up_is_an_alarm_and_the_other_goes_on(tmp_path: Path) -> None:
    more = Event()
    held = Server(wire()[:20], lambda number: more.wait() if number > 9 else None)
    away = socket.create_server(("127.0.0.1", 0))
    url = f"tcp://127.0.0.1:{away.getsockname()[1]}"
    away.close()  # nobody is there
    sources = (SourcePlan(PortPlan(held.url)), SourcePlan(PortPlan(url), wheel=3))
    plan = LivePlan(
        ReaderPlan(sources, 60.0, wait=0.1),
        None,
        Conditions.constant(),
        RecordingHeader({}, more=({},)),
        tmp_path / "a.mcap",
        laps=False,
    )
    news = News()
    with LiveChain(plan) as chain:
        gathered(chain, news, lambda: any(url in said for said in news.alarms))
        assert not chain.ended
        assert chain.counts()["given_up"][1] in news.alarms  # for the page
        before = chain.wheels.line_counts(0).ok
        more.set()
        gathered(chain, news, lambda: chain.wheels.line_counts(0).ok > before)
        chain.finish("stopped")
    held.close()
    with closing(Recording(tmp_path / "a.mcap")) as recording:
        assert [read for read in recording.reads() if read.data]
        assert recording.complete


def test_an_error_after_the_first_turn_is_raised_when_all_is_written() -> None:
    source: Any = FakeSource(0)
    turn = made_turn(1)
    coming = iter([News([turn])])

    def poll(_: Deadline) -> News:
        for news in coming:
            return news
        raise DeviceError("wheel 3 comes twice")

    source.poll = poll
    outcome = Session(source).run()
    assert (outcome.reason, outcome.turns, str(outcome.error)) == (
        "error",
        [turn],
        "wheel 3 comes twice",
    )
    with pytest.raises(DeviceError):
        Session(source).run()


def test_a_speed_about_which_the_bus_is_silent_is_unknown_until_it_comes_again() -> None:
    """It was held for ever, so that the slip ratio was wrong and valid."""
    second, frames = 10**9, wire()
    user = parse_map(VEHICLE.replace("hold_s = 3600.0\n", ""), "", "v.toml")
    bus = SourcePlan(PortPlan("slcan:p"), ProtocolPlan(SLCAN, 1e3, user))
    wheels = wheels_of((SourcePlan(PortPlan("w"), wheel=3), bus))
    seen: list[tuple[str, float]] = []

    def push(source: int, data: bytes, at: float) -> None:
        blocks = wheels.push(data, round(at * second), source)
        told = [b.content.measured for b in blocks if isinstance(b.content, BusCondition)]
        seen.extend((one.name, one.value) for one in told)

    for number, (source, data, at) in enumerate(
        (
            (0, frames[0], 0.0),
            (1, told(65.0), 0.1),
            (0, frames[1], 1.05),
            (0, frames[2], 1.15),
            (0, frames[3], 1.2),
            (1, told(72.0), 5.0),
        )
    ):
        push(source, data, at)
        silent = {
            name: bool(said) for (name, _), said in wheels.silences(round(at * second)).items()
        }
        assert silent.get("speed", False) == (number in (3, 4))
    names, values = zip(*seen, strict=True)
    assert names == ("speed", "pressure", "speed", "speed", "pressure")  # a pressure stays
    np.testing.assert_allclose(3.6 * np.array(values)[[0, 2, 3]], [65.0, np.nan, 72.0])


def test_an_emulator_plays_one_source_of_several(tmp_path: Path) -> None:
    head, other = (source.as_header() for source in (serial("left"), serial("right", 3)))
    header = RecordingHeader({}, protocol=head, more=(other,))
    with Recorder(tmp_path / "a.mcap", header, Conditions.constant()) as recorder:
        for number, data in enumerate((b"one", b"two", b"three")):
            recorder.read(Read(10**6 * number, data, "", number % 2))
    with closing(Recording(tmp_path / "a.mcap")) as recording:
        (piece,) = recording_pieces(recording, 0)
    assert piece.frames == (b"one", b"three")
    for wrong in (None, 2):
        with closing(Recording(tmp_path / "a.mcap")) as recording:
            pieces = recording_pieces(recording, wrong)
            with pytest.raises(DeviceError, match=r"has the sources 0 left, 1 right, .* --source"):
                next(pieces)
    outcome = CliRunner().invoke(program, ["emulate", "--recording", str(tmp_path / "a.mcap")])
    assert "choose with --source" in str(outcome.exception) + outcome.output  # before it waits


def test_a_wheel_that_comes_from_two_sources_is_refused() -> None:
    wheels = Wheels([Line(SerialDecoder(), {}, name=name) for name in ("left", "right")])
    data = b"".join(encode(strain_frames(np.zeros((32, 5), np.int16), period=1000, wheel=2)))
    wheels.push(data, 1, 0)
    with pytest.raises(DeviceError, match="wheel 2 comes from left and from right; each wheel may"):
        wheels.push(data, 2, 1)


def test_a_source_of_one_wheel_refuses_a_second() -> None:
    wheels = Wheels([Line(SerialDecoder(), {}, 5, "left")])
    frames = [
        encode(strain_frames(np.zeros((16, 5), np.int16), period=1000, wheel=w))[0] for w in (1, 2)
    ]
    wheels.push(frames[0], 1)
    assert list(wheels.heard) == [5]
    with pytest.raises(DeviceError, match="left: frames came from wheels 1, 2; a source with"):
        wheels.push(frames[0] + frames[1], 2)
