"""The page in a real browser, with turns that are made up: what is drawn, struck out and said."""

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from tests.bench.browser import NOTHING, ROWS, Visitor, opened, wait_for
from tests.bench.in_process import FakeSource
from tests.bench.programs import wait_until
from tests.bench.test_page import turn as made_turn
from tirebench.estimator.estimation import News
from tirebench.estimator.standing import Level
from tirebench.page.feed import About
from tirebench.page.live import LivePage, PageChoice
from tirebench.page.quantities import UNITS
from tirebench.wire.conditions import Conditions
from tirelib.core.flags import TurnFlag


def test_without_data_the_page_says_what_it_waits_for(browser: Any) -> None:
    seen = Visitor()
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
    source, seen = FourWheels(tmp_path), Visitor()
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
        cells = page.locator("#use-list dd[data-use]")  # read at once: the page writes them anew
        use = dict(
            cells.evaluate_all("each => each.map((cell) => [cell.dataset.use, cell.innerText])")
        )
        assert use == {
            "speed": "64.8 km/h bus",
            "pressure": "2.30 bar option",
            **dict.fromkeys(
                ("camber", "friction", "tread_depth", "tread_temperature"), "not known"
            ),
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
        page = opened(browser, run.url, Visitor())
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
        page = opened(browser, run.url, Visitor())
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
        page = opened(browser, run.url, Visitor())
        for number in range(1, 7):
            run.watch(News([made_turn(number)]))
            wait_for(page, f"() => ({ROWS})(0).length === {number}")
            time.sleep(0.03)  # about a tick: into the gap between looking and waiting
        run.end("stopped")
        page.locator("#status").filter(has_text="run ended: stopped").wait_for()
        page.context.close()
