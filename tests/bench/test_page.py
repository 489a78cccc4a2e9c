"""What the page is made of: the board, laps and bands, messages, commands, the terminal."""

import io
import json
import math
import struct
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from tests.bench.in_process import FakeSource
from tirebench.errors import DeviceError
from tirebench.estimator.chain import Turn
from tirebench.estimator.estimation import News, WheelEstimation
from tirebench.estimator.laps import GRID, Lap, Laps, band
from tirebench.estimator.wheels import Block
from tirebench.live.board import RINGS, Board, RingReader
from tirebench.live.recorder import RecorderState
from tirebench.page.commands import Command, CommandDesk, parse_command
from tirebench.page.feed import About, Feed
from tirebench.page.history import COLUMNS, History, Viewer
from tirebench.page.live import PageChoice
from tirebench.page.quantities import UNITS
from tirebench.page.recording_switch import RecordingSwitch
from tirebench.page.terminal import numbers, picture
from tirebench.wire.conditions import Conditions
from tirebench.wire.timeline import Samples
from tirelib.estimators.edge import EDGE_UNIT

PERIOD = 1e-4
OMEGA = 2.0 * math.pi * 12.5  # 800 samples a turn


@pytest.fixture(scope="module")
def memory() -> Iterator[Board]:
    with Board() as board:
        yield board


def outputs(number: int, contact: float, **more: float) -> dict[str, float]:
    values = {
        "Fz": 3000.0 + number,
        "alpha": 0.02,
        "kappa": -0.01,
        "Fy": -900.0,
        "valid": 1.0,
        "contact_time": contact,
        "turn_rate": OMEGA,
        "age": 0.0,
    }
    values |= {f"{name}_std": 0.1 * abs(values[name]) for name in UNITS}
    return {**values, **{f"contact_length_{g}": 0.1 + 0.01 * g for g in range(1, 6)}, **more}


def turn(number: int, contact: float = 0.0, wheel: int = 0, **more: float) -> Turn:
    return Turn(
        0,
        0,
        contact,
        contact,
        0.08 * number,
        outputs(number, contact, **more),
        {},
        0,
        (0,) * 5,
        wheel,
    )


def block(start: int, strain: Any, segment: int = 0) -> Samples:
    n = len(strain)
    return Samples(
        segment,
        "",
        start,
        100 * start,
        PERIOD,
        np.asarray(strain, float),
        np.zeros(n, np.bool_),
        np.zeros((n, 5), np.bool_),
    )


def test_units_are_those_of_a_document() -> None:
    assert {name: unit for name, (unit, _) in EDGE_UNIT.items()} == UNITS


@given(lengths=st.lists(st.integers(0, 300), max_size=30), takes=st.integers(1, 12))
def test_a_reader_gets_every_message_in_order_or_is_told_how_many_it_missed(
    lengths: list[int], takes: int
) -> None:
    with Board() as board:
        ring, sent = board.state, [bytes([i]) * (1 + n) for i, n in enumerate(lengths)]
        reader, got = RingReader(ring), []
        for place, message in enumerate(sent, 1):
            ring.put(message)
            if place % takes == 0:
                got += reader.take()
        got += reader.take()
        assert len(got) + reader.missed == len(sent)
        numbers = [message[0] for message in got]
        assert numbers == sorted(set(numbers))
        assert got == [sent[number] for number in numbers]
        assert numbers[-1:] == [len(sent) - 1][: len(sent)]  # the newest is never missed
        if takes <= RINGS["state"].slots:
            assert got == sent


def test_a_torn_message_counts_as_missed_and_one_that_is_too_long_is_refused(
    memory: Board,
) -> None:
    ring = memory.state
    reader = RingReader(ring, newest=0)
    ring.put(b"whole")
    ring.put(b"to be torn")
    other = Board(memory.name)  # a second view, as the page's process has it
    place = ring._slot(ring.written - 1) + 16
    other._memory.buf[place] ^= 0xFF
    assert reader.take() == [b"whole"]
    assert reader.missed == 1
    assert not ring.put(bytes(RINGS["state"].room + 1))
    assert ring.refused == 1
    other.close()


def test_a_lap_puts_the_contact_at_zero_and_the_leading_side_first() -> None:
    laps, contact = Laps(0), 0.1
    time = PERIOD * np.arange(2000)
    angle = np.rad2deg(OMEGA * (time - contact))
    strain = np.tile(angle[:, None], (1, 5)) + np.arange(5)
    for first in range(0, 2000, 16):
        laps.samples(block(first, strain[first : first + 16]))
        if first == 1008:
            laps.turn(turn(1, contact), 1)
        cut = laps.take()
        assert not cut or first + 16 > 1000 + 400  # half a turn after the contact, not before
        if cut:
            break
    (lap,) = cut
    grid = Lap.unpack(lap.pack()).on_grid()
    assert grid.shape == (5, len(GRID))
    for gage in range(5):
        np.testing.assert_allclose(grid[gage], GRID + gage, atol=1e-3)  # float32 of 180 deg


def test_a_lap_of_samples_that_come_one_by_one_ends_with_a_sample_that_has_come() -> None:
    laps, cut = Laps(0), []
    laps.samples(block(0, np.full((2000, 5), 7.0)))  # what a new segment leaves in memory
    strain = np.ones((2000, 5))
    laps.samples(block(0, strain[:1], 1))
    for first in range(1, 2000):
        laps.samples(block(first, strain[first : first + 1], 1))
        if first == 1000:
            laps.turn(replace(turn(1, 0.10003), segment=1), 1)
        cut += laps.take()
    (lap,) = cut
    np.testing.assert_array_equal(lap.strain, 1.0)


def test_what_is_lost_is_a_hole_and_a_slow_lap_is_thinned_not_cut() -> None:
    laps = Laps(0)
    strain = np.zeros((12_000, 5))
    strain[5000:5100, 2] = np.nan
    for first in range(0, 12_000, 1000):
        laps.samples(block(first, strain[first : first + 1000]))
    laps.turn(turn(1, 0.5, turn_rate=2.0 * math.pi), 1)
    (lap,) = laps.take()
    assert len(lap.pack()) <= RINGS["laps"].room
    grid = lap.on_grid()
    holes = ~np.isfinite(grid)
    assert holes[2].any()
    assert set(GRID[holes[2]]) <= set(np.arange(-1.0, 5.0, 0.5))
    assert not holes[[0, 1, 3, 4]].any()


def test_samples_that_are_forgotten_or_of_another_segment_give_no_lap() -> None:
    laps = Laps(0)
    laps.samples(block(0, np.zeros((2000, 5))))
    laps.turn(turn(1, 0.1), 1)
    laps.samples(block(0, np.ones((2000, 5)), segment=1))
    assert laps.take() == []
    laps.turn(turn(2, 0.1), 2)  # still of segment 0
    assert laps.take() == []


def test_a_band_is_numpys_percentile_of_what_is_known() -> None:
    rng = np.random.default_rng(1)
    traces = [rng.normal(size=(5, 40)).astype(np.float32) for _ in range(50)]
    np.testing.assert_allclose(
        band(traces), np.percentile(np.array(traces), (5.0, 95.0), axis=0), atol=1e-6
    )
    for trace in traces[:30]:
        trace[3, 7] = np.nan
    traces[0][:, 9] = np.nan
    made = band(traces)
    known = [float(trace[3, 7]) for trace in traces[30:]]
    np.testing.assert_allclose(made[:, 3, 7], np.percentile(known, (5.0, 95.0)), atol=1e-6)
    assert np.isfinite(made).all()
    assert np.isnan(band([np.full((5, 4), np.nan, np.float32)] * 3)).all()


def decode(message: bytes) -> tuple[dict[str, Any], list[Any]]:
    (length,) = struct.unpack_from("<I", message)
    header = json.loads(message[4 : 4 + length])
    place, arrays = 4 + length, []
    for kind, *shape in header["arrays"]:
        array = np.frombuffer(message, kind, math.prod(shape), place).reshape(shape)
        arrays.append(array)
        place += -(-array.nbytes // 8) * 8
    assert place == len(message)
    return header, arrays


def test_a_viewer_gets_each_turn_once_the_state_and_its_wheels_strain() -> None:
    with Board() as board:
        source = FakeSource(1, 3)
        source.heard = time.time()
        feed = Feed(board, source, About("port"))
        feed.watch(News())
        history, viewer, late = History(board), Viewer(), Viewer(wheel=3)
        assert history.update()
        header, _ = decode(viewer.message(history, {}) or b"")
        assert set(header["state"]["wheels"]) == {"1", "3"}
        assert header["state"]["wheels"]["1"]["crc_bad"] == 3
        assert viewer.message(history, {}) is None
        laps = Laps(3)
        for number in range(1, 4):
            laps.samples(block(800 * (number - 1), np.full((800, 5), 1e-6 * number)))
            laps.turn(turn(number, 0.08 * number - 0.05, wheel=3), number)
            done = [lap.pack() for lap in laps.take()]
            feed.watch(News([turn(number, 0.08 * number - 0.05, wheel=3)], done))
        feed.watch(News([turn(1, wheel=1, valid=0.0, Fz=math.nan)]))
        history.update()
        header, arrays = decode(viewer.message(history, {}) or b"")
        rows = arrays[header["turns"]["3"]["rows"]]
        assert rows.shape == (3, len(COLUMNS))
        np.testing.assert_allclose(rows[:, COLUMNS.index("Fz")], [3001.0, 3002.0, 3003.0])
        np.testing.assert_allclose(rows[:, 2], 1.959964 * 0.1 * rows[:, 1])
        np.testing.assert_allclose(rows[:, COLUMNS.index("alpha")], np.rad2deg(0.02))
        assert set(rows[:, -1]) == {31.0}
        (row,) = arrays[header["turns"]["1"]["rows"]]
        assert np.isnan(row[1])
        assert row[-1] == 0.0
        assert header["turns"]["3"]["last"]["turn"] == 3
        assert "lap" not in header  # of wheel 1, which has none
        header, arrays = decode(late.message(history, {}) or b"")
        assert header["lap"]["wheel"] == 3
        trace = arrays[header["lap"]["trace"]]
        assert float(np.nanmax(trace)) == pytest.approx(3.0, rel=1e-6)  # microstrain
        assert "band" in header["lap"]
        assert viewer.message(history, {}) is None
        said = Console(width=150, file=io.StringIO(), record=True)
        said.print(picture(history))
        text = said.export_text()
        for name, value in numbers(history.wheels[3].last):
            assert name in text
            assert value in text
        assert "INVALID" in text
        assert "crc_bad 3" in text


def test_the_state_tells_what_the_source_tells(memory: Board) -> None:
    source = FakeSource(0)
    feed = Feed(memory, source, About("port"), lambda: {"more": 1})
    assert feed.state()["heard"] is None
    source.heard, source.lost, source.skipped = 5.0, 7.0, 4
    feed.watch(News(messages=["said"], left_out=3, latency=[0.01] * 99 + [0.3]))
    state = feed.state()
    assert (state["heard"], state["lost"], state["left_out"], state["more"]) == (5.0, 7.0, 3, 1)
    assert state["wheels"]["0"]["skipped_turns"] == 4
    assert state["messages"] == ["said"]
    assert 10.0 < state["latency_p99_ms"] < 300.0


def test_a_late_estimator_leaves_laps_out_first_and_counts_them() -> None:
    made = {}
    for age in (-60.0, 2.0):
        estimation = WheelEstimation(Peaks(), Conditions.constant())
        news = News()
        arrival = time.monotonic_ns() - round(1e9 * age)
        for first in range(0, 4000, 800):
            content = replace(block(first, np.zeros((800, 5))), reset="" if first else "start")
            news.add(estimation.take(Block(0, arrival, 0, content), live=True))
        made[age] = news
    assert len(made[-60.0].turns) == len(made[2.0].turns) == 5
    assert len(made[-60.0].laps) == made[2.0].left_out >= 3
    assert not made[2.0].laps
    assert not made[-60.0].left_out


class Peaks:
    """An estimator that ends a turn with every 800 samples."""

    samples = 800

    def start(self, period: float) -> None:
        self.count = 0

    def step(self, strain: Any, conditions: Any, valid: bool) -> Any:
        self.count += 1
        return outputs(self.count, PERIOD * (800 * self.count - 400), flags=0.0), {}


@pytest.mark.parametrize(
    "document",
    [
        [],
        3,
        {},
        {"command": "stop"},
        {"command": "marker", "text": "x" * 201},
        {"command": "marker", "text": "two\nlines"},
        {"command": "marker", "text": 3},
        {"command": "record", "on": "yes"},
    ],
)
def test_a_command_that_is_none_is_refused(document: Any) -> None:
    with pytest.raises(DeviceError):
        parse_command(document)


@given(text=st.text(max_size=200))
def test_a_command_crosses_the_pipe_as_it_is_and_in_one_write(text: str) -> None:
    try:
        command = parse_command({"command": "marker", "text": text})
    except DeviceError:
        assert not text.isprintable()
        return
    assert Command.unpack(command.pack()) == command
    assert len(command.pack()) + 4 <= 4096  # what a pipe takes whole


class Told:
    """As much of a live chain as a record button needs."""

    def __init__(self) -> None:
        self.orders: list[tuple[str, Any]] = []
        self.recorded = RecorderState()

    def order(self, kind: str, what: Any) -> None:
        self.orders.append((kind, what))
        if kind == "start":
            Path(what).touch()

    def obeyed(self, deadline: Any) -> bool:
        return True


def test_recordings_are_turned_on_and_off_and_markers_land_in_them(tmp_path: Path) -> None:
    import multiprocessing

    def say(**document: Any) -> dict[str, Any]:
        writing.send_bytes(parse_command(document).pack())
        desk._next = 0.0
        desk.poll()
        return dict(desk.state()["answers"][-1])

    reading, writing = multiprocessing.Pipe(duplex=False)
    chain: Any = Told()
    desk = CommandDesk(RecordingSwitch(chain, tmp_path / "a.mcap", started=False))
    desk.listen(reading)
    assert not say(command="marker", text="too soon")["good"]
    assert say(command="record", on=True)["text"] == "recording a.mcap"
    assert say(command="marker", text="over the kerb")["good"]
    assert desk.state()["recording"]["on"]
    assert say(command="record", on=False)["good"]
    assert not desk.state()["recording"]["on"]
    assert say(command="record", on=True)["text"] == "recording a-2.mcap"
    assert say(command="record", on=False)["good"]
    chain.recorded.answer = "a-3.mcap: cannot be written"
    assert say(command="record", on=True) == {
        "number": 7,
        "good": False,
        "text": "a-3.mcap: cannot be written",
    }
    assert not desk.state()["recording"]["on"]
    writing.close()  # the page's process has died
    desk._next = 0.0
    desk.poll()
    desk.poll()
    event = {"event": "marker", "text": "over the kerb"}
    assert [order for order in chain.orders if order[0] == "event"] == [("event", event)]
    kinds = [kind for kind, _ in chain.orders]
    assert kinds == ["start", "event", "stop", "start", "stop", "start"]
    assert CommandDesk(None).state()["recording"]["possible"] is False


def test_only_this_machine_is_let_in_unless_asked_for() -> None:
    assert PageChoice(host="localhost").checked().host == "127.0.0.1"
    assert not PageChoice(host="::1").checked().open_to_others
    for host in ("0.0.0.0", "192.0.2.7", "::"):
        with pytest.raises(DeviceError, match="add --network"):
            PageChoice(host=host).checked()
        assert PageChoice(host=host, network=True).checked().open_to_others
    with pytest.raises(DeviceError, match="an address of this machine is needed"):
        PageChoice(host="example.org").checked()
