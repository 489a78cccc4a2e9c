"""What the page says around the estimates: last seconds, conditions in use, alarms."""

import json
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.in_process import FakeSource
from tests.bench.test_protocols import RAW16, some_raw
from tests.bench.test_timeline import line_of
from tirebench.cli.live import counters
from tirebench.errors import DeviceError
from tirebench.estimator.estimation import News
from tirebench.estimator.wheels import Wheels
from tirebench.links.opening import PortPlan
from tirebench.live.board import RINGS, Board
from tirebench.live.ports import PortState
from tirebench.live.reader import LineState
from tirebench.live.recording_state import RecorderState
from tirebench.live.run_alarms import DECODED_AGAIN, RECORDED_AGAIN, TOO_BUSY, RunAlarms
from tirebench.page.alarms import RULES, Alarms, Rule, event_of, read_alarms
from tirebench.page.condition_lines import in_use
from tirebench.page.feed import About, Feed, vitals
from tirebench.page.recent import WINDOW_SECONDS, Recent
from tirebench.page.terminal import alarms as alarm_lines
from tirebench.page.terminal import in_use_line
from tirebench.protocols import layouts
from tirebench.protocols.frame_decoder import PackedDecoder
from tirebench.protocols.layouts import Health
from tirebench.protocols.wheel_can import WheelCan
from tirebench.setup.source_plan import SourcePlan, wheels_of
from tirebench.wire.can_batch import pack, same_kind
from tirebench.wire.conditions import Conditions, Measured
from tirebench.wire.device import Device
from tirebench.wire.frames import FrameFlag
from tirebench.wire.line_counts import NO_FRAME, NOTHING, LineCounts

LOSS = Rule("samples lost", "%", high=1.0, hysteresis=0.5)


def states(rule: Rule, values: list[float]) -> list[bool]:
    alarms = Alarms({"loss": rule})
    found = []
    for number, value in enumerate(values):
        alarms.look({"loss": value}, 0, float(number))
        found.append(bool(alarms.document()["active"]))
    return found


def test_an_alarm_begins_beyond_its_limit_and_ends_by_the_hysteresis_before_it() -> None:
    assert states(LOSS, [0.9, 1.1, 0.9, 0.6, 0.4, 0.9]) == [False, True, True, True, False, False]
    low = Rule("signal", "dBm", low=-85.0, hysteresis=3.0)
    assert states(low, [-84.0, -86.0, -84.0, -81.0]) == [False, True, True, False]


@given(values=st.lists(st.floats(0.7, 1.3), max_size=50))
def test_a_value_that_swings_by_less_than_the_hysteresis_rings_once(values: list[float]) -> None:
    rule = Rule("samples lost", "%", high=1.0, hysteresis=0.6)
    found = states(rule, values)
    assert sum(b and not a for a, b in zip([False, *found], found, strict=False)) <= 1


def test_a_value_that_is_not_known_changes_nothing_and_each_wheel_has_its_own_alarm() -> None:
    alarms = Alarms({"loss": LOSS})
    (begun,) = alarms.look({"loss": 3.0}, 1, 10.0)
    assert alarms.look({"loss": None}, 1, 11.0) == []
    assert alarms.look({"loss": 0.0}, 2, 12.0) == []
    assert alarms.document()["active"][0]["text"] == "wheel 1: samples lost 3 %, limit 1 %"
    assert event_of(begun)["state"] == "on"
    (ended,) = alarms.look({"loss": 0.0}, 1, 13.0)
    assert event_of(ended) | {"event": "alarm", "state": "off", "wheel": 1} == event_of(ended)
    document = alarms.document()
    assert document["active"] == []
    assert (document["past"][0]["since"], document["past"][0]["until"]) == (10.0, 13.0)
    assert document["limits"][0] | {"name": "loss", "high": 1.0} == document["limits"][0]


def test_limits_come_from_a_file_and_its_faults_are_told_together(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(
        'format = "tirebench-alarms/1"\n[loss]\nhigh = 2.0\nhysteresis = 1.0\n'
        "[silence]\noff = true\n[tire_pressure]\nlow = 2.1\n"
    )
    rules = read_alarms(file)
    assert (rules["loss"].high, rules["loss"].hysteresis) == (2.0, 1.0)
    assert rules["silence"].high is None
    assert rules["tire_pressure"].low == 2.1
    assert rules["signal"] == RULES["signal"]
    file.write_text(
        'format = "tirebench-alarms/1"\n[los]\nhigh = 2\n[rate]\nlow = "x"\n'
        "[Fz]\nlow = 10\nhigh = 20\n[signal]\nmuch = 1\n"
    )
    with pytest.raises(DeviceError) as refused:
        read_alarms(file)
    said = str(refused.value)
    for part in (
        "[los] is an unknown alarm",
        "[rate] low = 'x'",
        "[Fz] low = 10, high = 20",
        "[signal]",
    ):
        assert part in said
    file.write_text("[loss]\n")
    with pytest.raises(DeviceError, match="tirebench-alarms/1"):
        read_alarms(file)


def test_rate_and_loss_are_those_of_the_last_seconds() -> None:
    """Ten seconds of 10 kHz: nothing is lost at first, then a tenth."""
    source = FakeSource(0)
    wheel, recent = source.wheels.heard[0], Recent()
    wheel.timeline._period = 1000
    seen = []
    for tick in range(41):
        bad = tick > 20
        wheel.timeline.received += 2250 if bad else 2500
        wheel.timeline.counts.lost_samples += 250 if bad else 0
        seen.append(recent.look(wheel, 3 * tick, max(0, tick - 20), 0.25 * tick))
    assert seen[3]["rate_hz"] is None
    assert seen[20]["rate_hz"] == pytest.approx(1e4)
    assert seen[20]["loss_percent"] == 0.0
    assert seen[40]["rate_percent"] == pytest.approx(90.0)
    assert seen[40]["loss_percent"] == pytest.approx(10.0)
    assert seen[40]["invalid_percent"] == pytest.approx(100.0 / 3.0)
    assert len(recent._seen) == round(WINDOW_SECONDS / 0.25) + 1


def test_a_pause_that_the_wheel_declares_is_no_missing_sample() -> None:
    """Runs of a second with a tenth between them, as an emulator plays a campaign."""
    wheel, recent = FakeSource(0).wheels.heard[0], Recent()
    shares = []
    for run in range(12):
        for part in range(5):
            begin = 1.1 * run + 0.2 * part
            frames = line_of(125, seq=625 * run + 125 * part, t_us=round(1e6 * begin))
            flags = np.zeros(125, dtype=np.int64)
            flags[0] = FrameFlag.TIME_RESET if part == 0 else 0
            wheel.timeline.push(replace(frames, flags=flags))
            shares.append(recent.look(wheel, 0, 0, begin + 0.2)["rate_percent"])
    assert wheel.timeline.paused == pytest.approx(1.1, abs=0.01)
    assert shares[0] is None
    # an end of the window may cut a pause in two
    assert shares[10:] == pytest.approx([100.0] * 50, abs=3.0)
    told = Alarms(RULES)
    assert not any(told.look({"rate": share}, 0, 0.0) for share in shares)


def test_what_a_wheel_says_of_itself_reaches_the_page() -> None:
    """HEALTH: signal, temperature, battery and tire pressure; nothing is made up before it."""
    counts = LineCounts()
    wheels = Wheels.of_one(PackedDecoder(WheelCan(1e4, counts), counts), {None: Device()})
    raw = some_raw(RAW16, 4, 1)
    strain = same_kind(0x121, layouts.encode_raw16(raw), fd=True)
    wheels.push(pack(strain), 1)
    assert vitals(wheels, 1) == dict.fromkeys(
        ("rssi_dbm", "temperature_c", "battery_v", "tire_pressure_bar")
    )
    said = Health(rssi=-71, temperature=44, battery=3.42, pressure=2.3e5)
    wheels.push(pack(same_kind(0x139, layouts.encode_health(said), fd=False)), 2)
    wheels.push(pack(strain), 3)
    found = vitals(wheels, 1)
    assert (found["rssi_dbm"], found["temperature_c"]) == (-71, 44)
    assert found["battery_v"] == pytest.approx(3.42)
    assert found["tire_pressure_bar"] == pytest.approx(2.3)


def test_the_page_says_which_conditions_are_in_use_and_where_they_come_from() -> None:
    wheel = FakeSource(0).wheels.heard[0]
    known = Conditions.constant(speed=65.0 / 3.6, pressure=2.3e5)
    found = in_use(wheel, known, "option")
    assert found["speed"] == {"value": pytest.approx(65.0), "unit": "km/h", "source": "option"}
    assert found["camber"] == {"value": None, "unit": "deg", "source": ""}
    assert "omega" not in found
    for name in ("friction", "tread_depth", "tread_temperature"):
        assert found[name]["value"] is None
    wheel.take([Measured("speed", 10.0)], 1)
    found = in_use(wheel, known, "option")
    assert found["speed"] == {"value": pytest.approx(36.0), "unit": "km/h", "source": "bus"}
    assert found["pressure"]["source"] == "option"
    assert "camber unknown" in in_use_line(found)
    assert "speed 36.00 km/h (bus)" in in_use_line(found)


def test_alarms_are_on_the_page_and_in_the_recording_and_a_full_disk_is_one() -> None:
    class Full(FakeSource):
        def counts(self) -> dict[str, Any]:
            return {"recording": {"free_bytes": 2e8, "minutes_left": 3.0, "error": "full"}}

    source, noted = Full(0), []
    source.wheels.heard[0].rssi = -95
    with Board() as board:
        feed = Feed(
            board, source, About("p"), lambda: {"chain": source.counts()}, note=noted.append
        )
        feed.watch(News())
        state = feed.state()
        assert len(json.dumps(state)) < RINGS["state"].room
    names = {alarm["name"] for alarm in state["alarms"]["active"]}
    assert names == {"signal", "minutes_left", "disk"}
    assert {event["name"] for event in noted} == names  # once, though it was looked at twice
    assert all(math.isfinite(event["value"]) for event in noted)
    lines = alarm_lines(state)
    assert lines[0] == "recording: full"
    assert any("signal -95 dBm" in line for line in lines)
    assert np.all([event["event"] == "alarm" for event in noted])


def test_what_is_wrong_with_the_run_is_an_alarm_and_the_transmitter_is_not_blamed() -> None:
    """A machine too busy, a file that is not written, a port that is given up, a wrong rate."""
    source, raw, given_up, noted = FakeSource(0), {"alarm": ""}, {1: ""}, []
    source.heard = time.time() - 60.0
    with Board() as board:
        feed = Feed(
            board,
            source,
            About("p"),
            lambda: {"chain": {"raw": raw, "given_up": given_up}},
            note=noted.append,
        )
        active = [alarm["name"] for alarm in feed.state()["alarms"]["active"]]
        assert active == ["silence"]
        raw["alarm"] = "too busy"
        feed.watch(News(), "a.json: the disk is full")
        state = feed.state()
        assert alarm_lines(state) == ["too busy", "a.json: the disk is full"]
        assert [event["state"] for event in noted] == ["on", "off"]  # of the silence
        raw["alarm"], given_up[1] = (
            "",
            "/dev/b: away for 5 s; reconnecting is tried until the port is back",
        )
        assert given_up[1] in alarm_lines(feed.state())
        given_up[1] = ""
        assert "/dev/b" not in str(alarm_lines(feed.state()))
        source.wheels.heard[0].timeline._rate.contradiction = "wheel 0: another rate"
        assert "wheel 0: another rate" in alarm_lines(feed.state())
        source.wheels.heard[0].timeline._rate.contradiction = ""
        feed._alarms.end(["sample rate of wheel 0"], None, time.time())
        feed.watch(News())
        active = [alarm["name"] for alarm in feed.state()["alarms"]["active"]]
        assert active == ["silence"]


def test_what_is_wrong_with_a_run_is_told_once_and_recorded_when_it_begins_and_ends() -> None:
    line, recorded, written = LineState(FakeSource(0).wheels), RecorderState(), []
    alarms = RunAlarms(["/dev/a", "/dev/b"], estimated=True, write=written.append)

    def told(*ports: PortState | None) -> list[str]:
        first = alarms.look(line, recorded, ports)
        assert alarms.look(line, recorded, ports) == []
        return first

    assert told(None, PortState("/dev/b")) == []
    line.passing, away = True, PortState("/dev/b", gone="/dev/b: away for 5 s")
    assert told(None, away) == [
        TOO_BUSY,
        f"{away.gone}; reconnecting is tried until the port is back",
    ]
    assert alarms.given_up == {1: f"{away.gone}; reconnecting is tried until the port is back"}
    line.passing, recorded.error = False, "the disk is full"
    assert told(None, PortState("/dev/b")) == [
        DECODED_AGAIN,
        "/dev/b: the port is back",
        "the disk is full",
    ]
    line.wheels.heard[0].timeline._rate.contradiction = "wheel 0: another rate"
    recorded.error = ""
    assert told() == ["wheel 0: another rate; its turns are not reported", RECORDED_AGAIN]
    assert [(event["name"], event["state"]) for event in written] == [
        ("busy", "on"),
        ("source 1", "on"),
        ("busy", "off"),
        ("source 1", "off"),
        ("sample rate", "on"),
    ]


def test_a_source_without_a_frame_and_a_wheel_that_never_sends_are_told() -> None:
    """Three sources: one good, one at a wrong rate, one silent."""
    source, noted = FakeSource(), []
    source.wheels = wheels_of(
        [
            SourcePlan(PortPlan(name), wheel=number)
            for number, name in enumerate(("good", "garbage", "silent"))
        ]
    )
    source.hear(0)
    source.wheels.push(b"temperature 23.1\r\n" * 9, source=1)
    line = counters(source.wheels)
    assert "good" not in line
    assert f"; garbage: {NO_FRAME}; silent: {NOTHING}" in line
    assert line.endswith("; wheel 1: no frame came; wheel 2: no frame came")
    with Board() as board:
        feed = Feed(board, source, About("p"), note=noted.append)
        feed._started = time.time()
        assert feed.state()["alarms"]["active"] == []
        feed._started -= 60.0
        texts = [alarm["text"] for alarm in feed.state()["alarms"]["active"]]
        assert texts[:2] == [f"garbage: {NO_FRAME}", f"silent: {NOTHING}"]
        assert [text.partition(" 6")[0] for text in texts[2:]] == [
            "wheel 1: no sample for",
            "wheel 2: no sample for",
        ]
        assert [event["wheel"] for event in noted] == [None, None, 1, 2]
        source.heard = time.time()
        for number in (1, 2):
            source.hear(number)
            source.wheels.lines[number].decoder.counts.ok = 1
        assert feed.state()["alarms"]["active"] == []
