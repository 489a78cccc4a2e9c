"""The page in a real browser: what it shows is what was recorded; keys; two viewers."""

import json
import math
import os
import re
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from tests.bench.browser import chromium
from tests.bench.conftest import Spawn, spawning
from tests.bench.in_process import FakeSource
from tests.bench.programs import PATIENCE, port_of, wait_until
from tests.bench.test_live import result
from tests.bench.test_page import turn as made_turn
from tirebench.estimator.estimation import News
from tirebench.estimator.laps import GRID
from tirebench.estimator.standing import Level
from tirebench.page.feed import About
from tirebench.page.history import COLUMNS
from tirebench.page.live import LivePage, PageChoice
from tirebench.page.quantities import UNITS
from tirebench.recording.recording import Recording
from tirebench.recording.topics import EVENTS
from tirebench.wire.conditions import Conditions
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import write_calibration
from tirelib.flags import TurnFlag
from tirelib.fmu.build import build_fmu

WAIT = 1000.0 * PATIENCE
DIGITS = {"Fz": (1.0, 0), "alpha": (1.0, 2), "kappa": (100.0, 2), "Fy": (1.0, 0)}
NOTHING = "\u2013"
ROWS = "wheel => (tirebench.wheels.get(wheel)?.rows ?? []).map(row => Array.from(row))"


@dataclass
class Visit:
    """What was seen on the page of one run, and what the run recorded."""

    pressed: dict[str, Any] = field(default_factory=dict)
    rows: dict[int, list[list[float]]] = field(default_factory=dict)
    rows_again: list[list[float]] = field(default_factory=list)
    other_rows: list[list[float]] = field(default_factory=list)
    numbers: dict[str, dict[str, str]] = field(default_factory=dict)
    counters: dict[str, str] = field(default_factory=dict)
    trace: Any = None
    lengths: list[str] = field(default_factory=list)
    addresses: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    unplugged: str = ""
    replay: dict[str, Any] = field(default_factory=dict)
    markers: list[str] = field(default_factory=list)
    host: str = ""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def spawn_all(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Spawn]:
    with spawning(tmp_path_factory) as start:
        yield start


def opened(browser: Any, url: str, visit: Visit) -> Any:
    context = browser.new_context(color_scheme="light", viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.set_default_timeout(WAIT)
    page.on("request", lambda request: visit.addresses.append(request.url))
    page.on("websocket", lambda stream: visit.addresses.append(stream.url))
    page.on("console", lambda said: visit.complaints.append(said.text))
    page.on("pageerror", lambda error: visit.complaints.append(str(error)))
    page.goto(url)
    return page


@pytest.fixture(scope="module")
def visit(
    browser: Any,
    spawn_all: Spawn,
    campaign: Path,
    calibration: Calibration,
    tmp_path_factory: pytest.TempPathFactory,
) -> Visit:
    folder, seen = tmp_path_factory.mktemp("visit"), Visit()
    write_calibration(calibration, folder / "cal.toml")
    fmu = build_fmu(folder / "cal.toml", folder / "StrainTire.fmu", samples_per_step=16)
    emulator = spawn_all(
        "emulate",
        "--campaign",
        campaign,
        "--all",
        "--loop",
        "--wheel",
        0,
        "--wheel",
        5,
        "--port-file",
        folder / "port",
        "--fault",
        "lost=0.002",
        "--speedup",
        0.4,
        "--conditions",
        folder / "c.json",
    )
    port = port_of(folder / "port", emulator)
    run = spawn_all(
        "run",
        "--port",
        port,
        "--fmu",
        fmu,
        "--trust",
        "--conditions",
        folder / "c.json",
        "--record",
        folder / "a.mcap",
        "--every-turn",
    )
    url = run.says(r"live page: (\S+)\n")[1]
    seen.host = re.split("[/?]", url)[2]
    page = opened(browser, url, seen)
    other = opened(browser, url, seen)
    wait_for(page, "tirebench.wheels.get(5)?.last?.turn > 12 && tirebench.lap?.laps > 3")
    wait_for(page, "document.querySelectorAll('#all .card .value').length === 8")
    wait_for(page, "[...document.querySelectorAll('#all .value')].every(v => v.textContent > '!')")
    press_keys(page, seen)
    look(page, seen)
    for wheel in (0, 5):
        seen.rows[wheel] = page.evaluate(ROWS, wheel)
    seen.other_rows = other.evaluate(ROWS, 0)
    for process in spawned_by(run.pid):
        os.kill(process, signal.SIGKILL)
    wait_for(page, "tirebench.page.starts === 2 && tirebench.away === null")
    wait_for(page, f"({ROWS})(0).length > {len(seen.rows[0]) + 1}")
    seen.rows_again = page.evaluate(ROWS, 0)
    page.keyboard.press("Space")
    emulator.send_signal(signal.SIGKILL)
    status = page.locator("#status")
    status.filter(has_text="unplugged since").wait_for()
    seen.unplugged = status.inner_text()
    page.context.close()
    other.context.close()
    run.send_signal(signal.SIGINT)
    run.finish()
    replay = spawn_all("replay", folder / "a.mcap", "--fmu", fmu, "--json", folder / "r.json")
    assert replay.finish()[0] == 0
    seen.replay = result(folder / "r.json")
    recording = Recording(folder / "a.mcap")
    events = [
        json.loads(data) for channel, _, data in recording.messages() if channel.topic == EVENTS
    ]
    seen.markers = [event["text"] for event in events if event["event"] == "marker"]
    recording.close()
    return seen


def spawned_by(run: int) -> list[int]:
    """Return the processes that a run has spawned: reader, estimators, recorder, page."""
    pages = []
    for entry in Path("/proc").iterdir():
        try:
            mine = entry.name.isdecimal() and f"PPid:\t{run}\n" in (entry / "status").read_text()
            if mine and b"spawn_main" in (entry / "cmdline").read_bytes():
                pages.append(int(entry.name))
        except OSError:
            continue
    return pages


def wait_for(page: Any, script: str) -> None:
    """Wait until a script gives true; Playwright's own way evaluates text, which is forbidden."""
    wait_until(lambda: page.evaluate(script) is True, script)


def press_keys(page: Any, seen: Visit) -> None:
    """Press each key once, or there and back, and note what came of it."""
    keyboard, got = page.keyboard, seen.pressed

    def note(key: str, script: str) -> None:
        before = page.evaluate(script)
        keyboard.press(key)
        wait_for(page, f"({script}) !== {json.dumps(before)}")
        got[key] = (before, page.evaluate(script))

    note("d", "document.documentElement.dataset.theme")
    note("z", "document.querySelector('.trace .chart').plot.scales.x.max")
    note("-", "tirebench.seconds")
    note("+", "tirebench.seconds")
    note("?", "document.getElementById('help-box').open")
    note("Escape", "document.getElementById('help-box').open")
    note("2", "tirebench.all ? 'all' : tirebench.wheel")
    note("1", "tirebench.all ? 'all' : tirebench.wheel")
    note("0", "tirebench.all ? 'all' : tirebench.wheel")
    keyboard.press("1")
    note("a", "document.getElementById('alarm-box').open")
    note("Escape", "document.getElementById('alarm-box').open")
    note("n", "document.getElementById('toast').textContent")
    note("m", "document.getElementById('marker-box').open")
    keyboard.type("kerb, right")
    note("Enter", "document.getElementById('toast').textContent")
    keyboard.press("z")
    wait_for(page, "tirebench.lap?.wheel === 0 && tirebench.band != null")
    note(" ", "tirebench.hold")


def look(page: Any, seen: Visit) -> None:
    """Note what stands on the page, which is held."""
    for name in UNITS:
        box = page.locator(f"#q-{name}")
        seen.numbers[name] = {
            "value": box.locator(".value").inner_text(),
            "limits": box.locator(".pm").inner_text(),
            "why": box.locator(".why").inner_text(),
            "turn": box.get_attribute("data-turn"),
            "raw": box.get_attribute("data-value"),
        }
    seen.lengths = page.locator("#shape text[data-gage]").all_text_contents()
    seen.trace = page.evaluate(
        "[...document.querySelectorAll('.trace .chart')].map(c => c.plot.data.map(d => [...d]))"
    )
    cells = page.locator("#health tbody tr").first.locator("[data-counter]")
    for cell in cells.all():
        seen.counters[cell.get_attribute("data-counter")] = cell.get_attribute("data-count")


def recorded(seen: Visit, wheel: int) -> list[dict[str, Any]]:
    return [turn for turn in seen.replay["turns"] if turn["wheel"] == wheel]


def shown_text(value: float | None, factor: float, digits: int) -> str:
    if value is None:
        return NOTHING
    text = f"{factor * value:.{digits}f}"
    return (text.replace("-", "") if float(text) == 0.0 else text).replace("-", "\u2212")


def test_every_turn_on_the_page_is_that_of_the_recording(visit: Visit) -> None:
    for wheel, rows in visit.rows.items():
        turns = recorded(visit, wheel)
        kept = [row for i, row in enumerate(rows) if i + 1 == len(rows) or row[0] != rows[i + 1][0]]
        assert 12 < len(kept) <= len(turns)
        for row, turn in zip(kept, turns, strict=False):
            shown = dict(zip(COLUMNS, row, strict=True))
            assert shown["time"] == turn["device_time"]
            assert int(shown["valid"]) >> 4 & 1 == turn["valid"]
            for place, name in enumerate(UNITS):
                value = float("nan") if turn[name] is None else turn[name]
                np.testing.assert_equal(float(shown[name]), value)
                assert int(shown["valid"]) >> place & 1 == turn[f"{name}_valid"]


def test_the_large_numbers_are_those_of_the_recording(visit: Visit) -> None:
    for name, seen in visit.numbers.items():
        turn = recorded(visit, 0)[int(seen["turn"]) - 1]
        factor, digits = DIGITS[name]
        assert json.loads(seen["raw"]) == turn[name]
        # JavaScript and Python round a half differently, which no measured value is
        assert seen["value"] == shown_text(turn[name], factor, digits)
        std = turn[f"{name}_std"]
        half = None if std is None else 1.959964 * std
        assert seen["limits"] == f"± {shown_text(half, factor, digits)}"
        assert seen["why"].startswith("invalid: ") == (not turn[f"{name}_valid"])
        assert bool(seen["why"]) == bool(turn["flags"])
    lengths = [turn[f"contact_length_{gage}_mm"] for gage in range(1, 6)]
    known = any(x is not None for x in lengths)
    assert visit.lengths == (["-" if x is None else f"{x:.0f}" for x in lengths] if known else [])


def test_five_traces_lie_over_wheel_angle_with_their_band(visit: Visit) -> None:
    assert len(visit.trace) == 5
    for angle, high, low, strain in visit.trace:
        np.testing.assert_allclose(angle, GRID)
        top, bottom, line = (np.array(x, dtype=float) for x in (high, low, strain))
        assert np.nanmax(line) > 1000.0  # microstrain: the contact is in it
        assert abs(GRID[np.nanargmax(line)]) < 12.0  # and under the axle
        assert (top >= bottom)[np.isfinite(top)].all()
        assert np.isfinite(top).mean() > 0.9


def test_every_key_does_what_the_help_says(visit: Visit) -> None:
    got = visit.pressed
    assert got["d"] == ("light", "dark")
    assert got["z"] == (180, 40)
    assert got["-"] == (30, 60)
    assert got["+"] == (60, 30)
    assert got["?"] == (False, True)
    assert got["Escape"] == (True, False)
    assert got["2"] == ("all", 5)
    assert got["1"] == (5, 0)
    assert got["0"] == (0, "all")
    assert got["a"] == (False, True)
    assert got[" "] == (False, True)
    assert got["n"][1] == "marker set: marker 1"
    assert got["Enter"][1] == "marker set: kerb, right"


def test_markers_of_the_page_stand_in_the_recording(visit: Visit) -> None:
    assert visit.markers == ["marker 1", "kerb, right"]


def test_losses_are_counted_on_the_page(visit: Visit) -> None:
    line = visit.replay["wheels"]["0"]
    assert 0 < int(visit.counters["frames"]) <= line["frames"]
    assert int(visit.counters["crc_bad"]) == line["crc_bad"] == 0
    assert 0 <= int(visit.counters["lost_frames"]) <= line["lost_frames"]


def test_two_viewers_see_the_same(visit: Visit) -> None:
    both = min(len(visit.other_rows), len(visit.rows[0]))
    assert both > 12
    np.testing.assert_array_equal(
        np.array(visit.other_rows[:both], dtype=float), np.array(visit.rows[0][:both], dtype=float)
    )


def test_the_page_needs_no_other_address_and_breaks_no_policy(visit: Visit) -> None:
    places = {re.split("[/?]", address)[2] for address in visit.addresses}
    assert places == {visit.host}
    lost = "WebSocket connection to"  # what a browser says when the server was killed
    assert [said for said in visit.complaints if not said.startswith(lost)] == []


def test_a_page_that_is_killed_comes_back_and_still_knows_every_turn(visit: Visit) -> None:
    """All other processes of the run were killed with it."""
    before, after = np.array(visit.rows[0], float), np.array(visit.rows_again, float)
    assert len(after) > len(before)
    np.testing.assert_array_equal(after[: len(before)], before)
    assert (np.diff(after[:, 0]) >= 0.0).all()  # told anew, not twice


def test_a_pulled_cable_is_told(visit: Visit) -> None:
    assert re.fullmatch(r"unplugged since \d\d:\d\d:\d\d", visit.unplugged)


def test_without_data_the_page_says_what_it_waits_for(browser: Any) -> None:
    seen = Visit()
    with LivePage(PageChoice(), FakeSource(), About("port"), None) as run:
        run.watch(News())
        page = opened(browser, run.url, seen)
        page.locator("#status").filter(has_text="waiting for the first frame").wait_for()
        assert page.locator("#record").is_disabled()
        assert page.locator("#q-Fz .value").inner_text() == NOTHING
        run.end("stopped")
        page.locator("#status").filter(has_text="run ended: stopped").wait_for()
        page.context.close()
    assert seen.complaints == []


class FourWheels(FakeSource):
    """Four wheels, a weak signal, a full disk; and a recording that goes on."""

    recorded: ClassVar = {
        "file": "a.mcap",
        "bytes": 2.5e6,
        "minutes": 3.0,
        "free_bytes": 4e8,
        "minutes_left": 5.0,
        "error": "no space is left",
    }
    bytes, name = 1, "a.mcap"

    def __init__(self, folder: Path) -> None:
        super().__init__(0, 1, 2, 3)
        self.heard = time.time() + 3600.0
        self.wheels.heard[2].rssi = -93
        self.wheels.heard[1].bus_conditions["speed"] = math.nan
        self.wheels.heard[2].bus_conditions["speed"] = 18.0
        self.events: list[Any] = []
        self.about = About("port", conditions=Conditions.constant(pressure=2.3e5), folder=folder)

    @property
    def recorder(self) -> "FourWheels":
        return self

    def event(self, event: Any) -> None:
        self.events.append(event)

    def counts(self) -> dict[str, Any]:
        return {"recording": self.recorded}


def test_all_wheels_alarms_what_is_in_use_and_the_zero_of_the_gages(
    browser: Any, tmp_path: Path
) -> None:
    source, seen = FourWheels(tmp_path), Visit()
    level = Level(2, 1.5, *(1e-6 * np.arange(5.0),) * 3, np.zeros(5))
    with LivePage(PageChoice(), source, source.about, source) as run:
        page = opened(browser, run.url, seen)
        run.watch(News([made_turn(1, wheel=n, Fz=1000.0 * (n + 1)) for n in range(4)]))
        wait_for(page, "document.querySelectorAll('#all .card').length === 4")
        shown = page.locator("#all [data-key=Fz] .value")
        wait_until(lambda: shown.all_text_contents() == ["1000", "2000", "3000", "4000"])
        speeds = page.locator("#use-list dd[data-use=speed]")
        wait_until(
            lambda: (
                speeds.all_inner_texts()
                == ["not known", "not known the bus is silent", "64.8 km/h bus", "not known"]
            )
        )
        alarms = page.locator("#alarms .alarm")
        wait_until(lambda: alarms.count() == 4)
        said = " ".join(alarms.all_text_contents())
        for part in ("recording: no space is left", "wheel 2: signal -93 dBm", "5 min", "0.4 GB"):
            assert part in said
        page.keyboard.press("3")
        wait_for(page, "tirebench.wheel === 2 && !tirebench.all")
        use = {
            cell.get_attribute("data-use"): cell.inner_text()
            for cell in page.locator("#use-list dd[data-use]").all()
        }
        assert use == {
            "speed": "64.8 km/h bus",
            "pressure": "2.30 bar option",
            "camber": "not known",
            "recording": "a.mcap 2.5 MB, 3.0 min",
            "room": "400.0 MB free for 5.0 min",
        }
        page.keyboard.press("g")
        page.locator("#zero-set").click()
        assert list(tmp_path.iterdir()) == []  # asked once more before anything is written
        page.locator("#zero-set").filter(has_text="Write the zero of wheel 2?").wait_for()
        run.watch(News(levels=[level]))
        page.locator("#zero-set").click()

        def written() -> bool:
            run.watch(News(levels=[level]))
            return len(list(tmp_path.glob("wheel-2-zero-*.toml"))) == 1

        wait_until(written)
        page.context.close()
    assert {event["event"] for event in source.events} == {"alarm", "zero"}
    assert seen.complaints == []


def test_what_may_not_be_used_is_struck_out_and_says_why(browser: Any) -> None:
    """A turn that is invalid, one with an invalid quantity, and one that is whole again."""
    source, wrong = FakeSource(0), int(TurnFlag.OUT_OF_RANGE)
    turns = [
        made_turn(1),
        replace(made_turn(2, valid=0.0), flags=wrong),
        replace(
            made_turn(3, **{f"{name}_valid": float(name != "Fy") for name in UNITS}), flags=wrong
        ),
        made_turn(4),
    ]
    bad = [set(), set(UNITS), {"Fy"}, set()]
    with LivePage(PageChoice(), source, About("port"), None) as run:
        page = opened(browser, run.url, Visit())
        for number, (turn, names) in enumerate(zip(turns, bad, strict=True), 1):
            run.watch(News([turn]))
            wait_for(page, f"document.getElementById('q-Fz').dataset.turn === '{number}'")
            for name in UNITS:
                box = page.locator(f"#q-{name}")
                struck = box.locator(".value").evaluate(
                    "box => getComputedStyle(box).textDecorationLine"
                )
                assert (struck == "line-through") == (name in names), (number, name)
                why = box.locator(".why").text_content()
                assert why.startswith("invalid: outside") == (name in names), (number, name)
        # in the charts: a gap of the line, and a dot
        drawn = page.evaluate(
            "() => document.querySelector('#q-Fy .chart').plot.data.map(d => [...d])"
        )
        assert [value is None for value in drawn[3]] == [False, True, True, False]
        assert [value is None for value in drawn[4]] == [True, False, False, True]
        assert {value for value in drawn[4] if value is not None} == {0.03}  # at the bottom
        page.context.close()


BLUE = """(loads) => {
  const { plot } = document.querySelector('#q-Fz .chart');
  const [top, bottom] = loads.map((value) => Math.round(plot.valToPos(value, 'y', true)));
  const { left, width } = plot.bbox;
  const { data } = plot.ctx.getImageData(left, top, width, bottom - top);
  let blue = 0;
  for (let i = 0; i < data.length; i += 4) blue += data[i + 2] - data[i] > 20 ? 1 : 0;
  return blue;
}"""
"""Pixels of line or band between two loads."""


def test_nothing_is_drawn_from_one_load_to_another_over_a_gap(browser: Any) -> None:
    """3000 N, turns that may not be used or a new segment, 6000 N; and back, again and again."""
    source, turns = FakeSource(0), []
    for number in range(1, 61):
        load = 3000.0 if number // 10 % 2 else 6000.0
        turn = made_turn(number, Fz=load, Fz_std=50.0, valid=float(number % 10 > 0))
        turns.append(replace(turn, segment=number // 20))
    with LivePage(PageChoice(), source, About("port"), None) as run:
        page = opened(browser, run.url, Visit())
        run.watch(News(turns))
        wait_for(page, f"({ROWS})(0).length >= 60 && tirebench.drawn.count > 20")
        wait_for(page, "document.querySelector('#q-Fz .chart').plot.data[0].length >= 60")
        wait_until(lambda: page.evaluate(BLUE, [6100, 5900]) > 40)
        assert page.evaluate(BLUE, [3100, 2900]) > 40
        assert page.evaluate(BLUE, [5600, 3400]) == 0
        page.context.close()


def test_single_turns_shortly_after_each_other_all_arrive(browser: Any) -> None:
    """News that come while the page looks away are not slept through."""
    source = FakeSource(0)
    source.heard = time.time() + 30.0
    with LivePage(PageChoice(), source, About("port"), None) as run:
        page = opened(browser, run.url, Visit())
        for number in range(1, 7):
            run.watch(News([made_turn(number)]))
            wait_for(page, f"() => ({ROWS})(0).length === {number}")
            time.sleep(0.03)  # about a tick: into the gap between looking and waiting
        run.end("stopped")
        page.locator("#status").filter(has_text="run ended: stopped").wait_for()
        page.context.close()
