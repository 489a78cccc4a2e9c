"""The page in a real browser: what it shows is what was recorded; keys; two viewers."""

import json
import os
import re
import signal
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.browser import NOTHING, ROWS, Visitor, opened, wait_for
from tests.bench.conftest import Spawn, spawning
from tests.bench.programs import port_of
from tests.bench.test_live import result
from tirebench.estimator.laps import GRID
from tirebench.page.history import COLUMNS
from tirebench.page.quantities import UNITS
from tirebench.recording.recording import Recording
from tirebench.recording.topics import EVENTS
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import write_calibration
from tirelib.fmu.build import build_fmu

DIGITS = {"Fz": (1.0, 0), "alpha": (1.0, 2), "kappa": (100.0, 2), "Fy": (1.0, 0)}


@dataclass
class Visit(Visitor):
    """What was seen on the page of one run, and what the run recorded."""

    pressed: dict[str, Any] = field(default_factory=dict)
    rows: dict[int, list[list[float]]] = field(default_factory=dict)
    rows_again: list[list[float]] = field(default_factory=list)
    other_rows: list[list[float]] = field(default_factory=list)
    numbers: dict[str, dict[str, str]] = field(default_factory=dict)
    counters: dict[str, str] = field(default_factory=dict)
    trace: Any = None
    scales: Any = None
    lengths: list[str] = field(default_factory=list)
    unplugged: str = ""
    replay: dict[str, Any] = field(default_factory=dict)
    markers: list[str] = field(default_factory=list)
    host: str = ""


@pytest.fixture(scope="module")
def spawn_all(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Spawn]:
    with spawning(tmp_path_factory) as start:
        yield start


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
    # an emulator that is killed leaves its link, behind which another test's port may come to stand
    Path(port).unlink()
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
    seen.scales = page.evaluate(
        "[...document.querySelectorAll('.trace .chart')].map(({ plot: { scales } }) => "
        "[scales.y.min, scales.y.max])"
    )
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
    assert visit.scales == visit.scales[:1] * 5  # a dead gage is seen to be flat
    assert visit.scales[0][1] > 100.0
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
