"""The studio in a real browser: from runs of forces to the added effect, out again; attacks.

The tests of one campaign share what was fitted to it; each can be run alone.
"""

import csv
import json
import os
import re
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.browser import chromium
from tests.bench.programs import PATIENCE
from tests.unit.force_campaigns import steady_runs, write_forces
from tests.unit.studio.conftest import TOKEN, Served, until
from tirelib.campaign import Run, read_campaign


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


def wait_for(page: Any, script: str) -> None:
    """Wait until a script gives true; Playwright's own way evaluates text, which is forbidden."""
    end = time.monotonic() + PATIENCE
    while page.evaluate(script) is not True:
        assert time.monotonic() < end, script
        time.sleep(0.05)


PROGRAM = ("-m", "tirelib", "studio")
HELD = (str(Path(__file__).with_name("held_studio.py")),)
"""The studio, and one whose refits wait while the file `hold` exists."""


@contextmanager
def serve(
    folder: Path, *words: str, program: tuple[str, ...] = PROGRAM
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run the server until the end, which is not a gentle one; give its process and address."""
    command = [sys.executable, *program, *words, "--session", str(folder / "s"), "--no-browser"]
    surroundings = os.environ | {"HOLD": str(folder / "hold")}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=surroundings) as server:
        line = server.stdout.readline() if server.stdout is not None else ""
        try:
            yield server, line.partition(" ")[2].strip()
        finally:
            server.kill()


@dataclass
class Journey:
    """What five clicks have led to, and what the browser asked for and complained of meanwhile."""

    folder: Path
    url: str
    shown: str
    shown_again: str
    same_address: bool
    complaints: list[str]
    addresses: list[str]

    def document(self, number: str, name: str) -> Any:
        """Return what a command wrote of a model."""
        place = next(self.folder.glob("s/campaigns/*/models")) / number / name
        return json.loads(place.read_text())


def page_at(browser: Any, url: str) -> Any:
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    page.goto(url)
    return page


@pytest.fixture(scope="module")
def journey(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Journey:
    folder = tmp_path_factory.mktemp("studio")
    write_forces(folder / "steady", steady_runs(slope=0.25), "steady")
    complaints: list[str] = []
    addresses: list[str] = []
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    page.on("console", lambda said: complaints.append(said.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: addresses.append(request.url))
    with serve(folder, str(folder / "steady")) as (server, url):
        page.goto(url)
        page.get_by_role("button", name="Find what is missing").click()  # click 1
        page.locator("input[data-effect=friction_load]").click()  # click 2
        second = page.context.new_page()
        second.goto(page.url)  # another tab, before anything is added
        page.locator("#add").click()  # click 3
        shown = page.locator("#error-after").inner_text()
        server.kill()  # no goodbye
        wait_for(page, "studio.connected === false")
    with serve(folder) as (_, again):
        wait_for(page, "studio.connected === true")
        wait_for(second, "studio.campaign !== null && studio.campaign.current === '002'")
        page.reload()
        shown_again = page.locator("#error-after").inner_text()
        wait_for(page, "!!studio.campaign.models[1].verdict")
    page.context.close()
    return Journey(folder, url, shown, shown_again, again == url, complaints, addresses)


def digits(value: float) -> str:
    """Return a number as the page shows it."""
    return str(float(f"{value:.4g}"))


def test_five_clicks_add_the_effect_that_forces_lack(journey: Journey) -> None:
    assert journey.same_address
    assert journey.shown_again == journey.shown
    fit = journey.document("002", "fit.json")
    assert journey.shown == digits(fit["error_after"])
    assert fit["effect"] == "friction_load"
    assert fit["error_after"] < fit["error_before"]
    assert "friction_load" in journey.document("001", "Fy/diagnosis.json")["named"]
    # the killed server leaves connections and answers unfinished; the page itself says nothing
    assert all("WebSocket" in said or "net::ERR_" in said for said in journey.complaints), (
        journey.complaints
    )
    host = re.split("[/?]", journey.url)[2]
    assert {re.split("[/?]", one)[2] for one in journey.addresses if "://" in one} == {host}


def test_unticking_fits_without_the_effect_and_both_models_stand_side_by_side(
    browser: Any, journey: Journey
) -> None:
    with serve(journey.folder) as (_, url):
        page = page_at(browser, url)
        page.get_by_role("button", name="steady").click()
        wait_for(page, "!!studio.campaign")
        count = page.evaluate("studio.campaign.models.length")
        page.evaluate("location.hash = '#/add/' + studio.wanted")
        card = page.locator("[data-model='002']")
        if (there := card.get_by_role("button", name="Continue from here")).count():
            there.click()
        page.evaluate("location.hash = '#/suspect/' + studio.wanted")
        page.locator("input[data-owned=friction_load]").click()
        number = f"{count + 1:03d}"
        wait_for(page, f"studio.campaign.current === '{number}'")
        shown = page.locator("#error-after").inner_text()
        documents = f"studio.campaign.models[{count}].documents['Fy/plots.npz']"
        wait_for(page, f"!!{documents}")
        page.get_by_role("button", name="Compare two").click()
        page.locator("dialog canvas").nth(1).wait_for()
        told = page.locator("dialog tr", has_text="error").first.inner_text()
        maps = [one.evaluate("c => c.toDataURL()") for one in page.locator("dialog canvas").all()]
        page.context.close()
    fit = journey.document(number, "fit.json")
    assert (fit["action"], fit["effect"]) == ("remove", "friction_load")
    assert shown == digits(fit["error_after"])
    errors = [journey.document(n, "Fy/comparison.json")["error"] for n in ("001", "002", number)]
    assert errors[2] == pytest.approx(errors[0], rel=1e-3)  # two fits of the same model
    assert [word for word in told.split() if word[0].isdigit()] == [digits(e) for e in errors[1:]]
    assert maps[0] != maps[1]


BUSY = "studio.running.some(job => job.what === 'fitting' && job.done > 0)"


def test_in_the_middle_of_a_refit_nothing_is_lost(browser: Any, journey: Journey) -> None:
    hold = journey.folder / "hold"
    hold.touch()
    with serve(journey.folder, program=HELD) as (server, url):
        page = page_at(browser, url)
        page.get_by_role("button", name="steady").click()
        wait_for(page, "!!studio.campaign")
        count, before = page.evaluate("[studio.campaign.models.length, studio.campaign.current]")
        page.evaluate("location.hash = '#/suspect/' + studio.wanted")
        page.locator("input[data-effect=conicity]").click()
        page.locator("#add").click()
        wait_for(page, BUSY)
        page.reload()
        wait_for(page, BUSY)  # it goes on, and its progress is seen
        second = page.context.new_page()
        second.goto(page.url)
        second.locator("[data-cancel]").click()
        page.get_by_text("add conicity: cancelled").wait_for()
        state = "[studio.running.length, studio.campaign.current]"
        assert page.evaluate(state) == [0, before]
        page.get_by_role("button", name="Run again").click()
        wait_for(second, BUSY)
        server.kill()  # no goodbye
        page.get_by_text("The server does not answer; nothing is lost.").wait_for()
    with serve(journey.folder, program=HELD):
        page.get_by_text("add conicity: interrupted").wait_for()
        hold.unlink()
        page.get_by_role("button", name="Run again").last.click()
        wait_for(second, f"studio.campaign.current === '{count + 1:03d}'")
        wait_for(page, f"studio.campaign.current === '{count + 1:03d}'")
        shown = [tab.locator("#error-after").inner_text() for tab in (page, second)]
        page.context.close()
    fit = journey.document(f"{count + 1:03d}", "fit.json")
    assert shown == [digits(fit["error_after"])] * 2


def tab_to(page: Any, selector: str) -> None:
    """Press Tab until an element has the focus."""
    for _ in range(300):
        page.keyboard.press("Tab")
        if page.evaluate("s => document.activeElement.matches(s)", selector):
            return
    raise AssertionError(f"{selector}: Tab does not lead to it")


def at_the_keyboard(page: Any, selector: str, key: str = "Enter") -> None:
    page.locator(selector).first.wait_for()
    tab_to(page, selector)
    page.keyboard.press(key)


RENAME = """
([campaign, model]) => fetch("/do", {
  method: "POST", headers: {"content-type": "application/json"},
  body: JSON.stringify({do: "mark", campaign, model, label: "mine"}),
})
"""


def test_five_steps_without_a_mouse(browser: Any, journey: Journey) -> None:
    with serve(journey.folder) as (_, url):
        page = page_at(browser, url)
        at_the_keyboard(page, "button.link")  # 1, the campaign
        page.locator("#main button.main:enabled", has_text="See where").wait_for()
        at_the_keyboard(page, "#main button.main:not(#example)")
        page.locator("#error").wait_for()  # 2
        tab_to(page, "canvas")
        page.keyboard.press("ArrowUp")
        for _ in range(2):
            page.keyboard.press("Shift+ArrowRight")
        said = page.locator("#main [role=status]", has_text="% of the squares").inner_text()
        at_the_keyboard(page, "#main button.main")
        at_the_keyboard(page, "input[data-effect]", "Space")  # 3
        name = page.evaluate("document.activeElement.dataset.effect")
        count = page.evaluate("studio.campaign.models.length")
        at_the_keyboard(page, "#add")
        page.locator("#main h2", has_text="The fall of the error").wait_for()  # 4
        added = f"studio.campaign.models[{count}]"
        wait_for(
            page, f"{added}?.effect === '{name}' && {added}.number === studio.campaign.current"
        )
        tab_to(page, "#steps a[href^='#/take']")
        page.evaluate(RENAME, page.evaluate("[studio.wanted, studio.campaign.current]"))
        wait_for(page, "studio.campaign.models.at(-1).label === 'mine'")  # all is drawn anew
        page.keyboard.press("Enter")  # 5
        page.locator("[data-take=model]").wait_for()
        page.context.close()
    assert re.match(r"From .* to .*: rms [\d.]+ N, [\d.]+ % of the squares, \d+ values", said)


def saved(page: Any, of: Any) -> dict[str, list[str]]:
    """Click the link CSV of a plot; return the columns of the file."""
    with page.expect_download() as found:
        of.get_by_role("button", name="CSV").click()
    names, *rows = csv.reader(Path(found.value.path()).read_text().splitlines())
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def close(found: list[str], wanted: Any) -> bool:
    return np.allclose([float(x) for x in found], wanted, rtol=1e-6, atol=1e-6)


def test_every_plot_gives_its_numbers_as_csv(browser: Any, journey: Journey) -> None:
    place = next(journey.folder.glob("s/campaigns/*/models")) / "002"
    data = dict(np.load(place / "Fy" / "plots.npz"))
    runs = list(data["run"])
    with serve(journey.folder) as (_, url):
        page = page_at(browser, url)
        page.get_by_role("button", name="steady").click()
        wait_for(page, "!!studio.campaign")
        page.evaluate("location.hash = '#/add/' + studio.wanted")
        card = page.locator("[data-model='002']")
        if (there := card.get_by_role("button", name="Continue from here")).count():
            there.click()
        wait_for(page, "studio.campaign.current === '002'")
        page.locator("#error-after").wait_for()
        fall = saved(page, page.locator(".card", has=page.locator("svg.waterfall")))
        page.get_by_role("button", name="Compare two").click()
        page.locator("dialog canvas").nth(1).wait_for()
        assert page.locator("dialog").get_by_role("button", name="CSV").count() == 2
        page.keyboard.press("Escape")
        page.evaluate("location.hash = '#/see/' + studio.wanted")
        page.locator("#error").wait_for()
        cards = page.locator(".card")
        curve, rest = (
            saved(page, cards.filter(has=page.locator(".plot")).nth(k)) for k in range(2)
        )
        cells = saved(page, cards.filter(has=page.locator(".heat")))
        page.evaluate("location.hash = '#/suspect/' + studio.wanted")
        page.locator("tr[data-name] input[data-effect]").first.focus()
        wait_for(page, "!!studio.campaign.models[1].documents['Fy/traces.npz']")
        plots = page.locator(".plot, .heat")
        plots.nth(1).wait_for()
        for plot in plots.all():
            assert plot.locator("xpath=ancestor::*[.//button[.='CSV']][1]").count() == 1
        page.context.close()
    fit = journey.document("002", "fit.json")
    errors = next(fall[name] for name in fall if name.startswith("error"))
    assert close(errors, [fit["error_before"], fit["error_after"]])
    for table, names in ((curve, ("measured", "model")), (rest, ("difference",))):
        of = [runs.index(float(run)) for run in table["run"]]
        *_, last = table.values()
        columns = list(table.values())[-len(names) :]
        assert last
        for name, column in zip(names, columns, strict=True):
            assert close(column, data[name][of])
    assert len(rest["run"]) == len(runs)
    # a cell is the mean of its points: at one load each slip angle was measured twice
    found = [float(x) for name in list(cells)[1:] for x in cells[name] if x]
    level = data["level_load"]
    slips = np.round(data["slip_angle"], 1)
    pairs = [
        data["difference"][(level == a) & (slips == b)].mean()
        for a in np.unique(level)
        for b in np.unique(slips)
    ]
    assert np.allclose(np.sort(found), np.sort(pairs), rtol=1e-4, atol=1e-4)


def drop(page: Any, path: Path) -> None:
    """Drop a file or folder as a hand would: the browser itself reads it from the disk."""
    session = page.context.new_cdp_session(page)
    data = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": kind, "x": 600, "y": 500, "data": data})


def write_german(path: Path, runs: Iterable[Run]) -> None:
    """Write runs as a rig may: umlauts, commas, a word for a number, one unit that is wrong."""
    lines = [
        "Prüfstand Süd;;;;;;;",
        "Messung;Zeit [s];Radlast [N];Seitenkraft [kN];Schräglaufwinkel [°];Sturz [°];"
        "Druck vorn [bar];Geschwindigkeit [km/h]",
    ]
    for run in runs:
        for k in range(8):
            rig = {name: values[k] for name, values in run.rig.items()}
            camber, word = 0.01 * (run.plan.run % 3), (run.plan.run, k) == (1, 3)
            row = f"{run.plan.run};{10 * run.plan.run + 0.01 * k:.2f};{rig['Fz'] / 1e3:.3f};"
            row += f"{rig['Fy'] / 1e3:.4f};{np.rad2deg(rig['slip_angle']):.2f};{camber:.2f};"
            row += f"{'Übersteuert' if word else format(rig['pressure'] / 1e5, '.3f')};64.8"
            lines.append(row.replace(".", ","))
    path.write_bytes("\r\n".join(lines).encode("latin-1"))


def test_what_is_dropped_is_checked_or_imported(browser: Any, tmp_path: Path) -> None:
    few = list(steady_runs(loads=(2000.0, 4000.0), angles=(-2.0, 2.0), repeats=1))
    write_forces(tmp_path / "bad", few, "bad")
    (tmp_path / "bad" / "runs" / "002.mf4").rename(tmp_path / "002.mf4")
    write_german(tmp_path / "messung.csv", few)
    with serve(tmp_path) as (_, url):
        page = page_at(browser, url)
        page.evaluate("location.hash = '#/take/'")
        drop(page, tmp_path / "bad")  # anywhere, in any step
        page.locator("td.bad").first.wait_for()
        check = json.loads(next(tmp_path.glob("s/campaigns/*/check.json")).read_text())
        said = page.locator("#main").inner_text()
        for problem in check["problems"]:
            assert problem["where"] in said
            assert problem["remedy"] in said
        assert page.evaluate("studio.campaign.models.length") == 0
        lost = next(tmp_path.glob("s/files/**/runs")) / "002.mf4"
        lost.write_bytes((tmp_path / "002.mf4").read_bytes())
        page.locator("#check-again").click()
        wait_for(page, "studio.campaign.check?.errors === 0")
        drop(page, tmp_path / "messung.csv")
        page.get_by_text("Left out: Druck vorn [bar]: row 12 holds 'Übersteuert'").wait_for()
        page.get_by_label("free radius in mm").fill("316,5")
        page.get_by_label("unit of Radlast [N]").fill("kN")
        page.get_by_label("kind").select_option("corner")
        page.get_by_label("run_column").select_option("Messung")
        page.get_by_label("text in a column of numbers").select_option("missing")
        page.get_by_label("rows with a missing number").select_option("drop")
        page.get_by_role("button", name="Read the files again").click()
        page.get_by_label("quantity of Druck vorn [bar]").select_option("pressure")
        page.get_by_label("unit of Druck vorn [bar]").fill("km/h")
        page.locator("#import").click()
        page.get_by_text("this form, [channels] pressure unit").wait_for()
        assert page.get_by_role("heading", name="Columns [channels]").is_visible()
        page.get_by_label("unit of Druck vorn [bar]").fill("bar")
        page.locator("#import").click()
        wait_for(page, "!!studio.campaign && studio.campaign.title === 'messung'")
        page.context.close()
    made = read_campaign(next(tmp_path.glob("s/jobs/*/out/campaign")))
    runs = list(made.runs())
    assert [run.plan.load for run in runs] == [2000.0, 2000.0, 4000.0, 4000.0]
    assert {run.plan.camber for run in runs} == {0.0}
    assert made.header.tire.free_radius == pytest.approx(0.3165)
    assert len(runs[1].rig["pressure"]) == 7  # the row of the word is left out
    assert runs[1].rig["pressure"] == pytest.approx(2.1e5)
    assert runs[1].rig["Fz"] == pytest.approx(2000.0)


def test_what_was_measured_is_seen_before_any_model_is_fitted(browser: Any, tmp_path: Path) -> None:
    with closing(Served(tmp_path)) as served:
        until(lambda: served.server.started)
        served.hold.touch()  # the fit does not end
        name = served.do(do="open", path=str(served.measured))[1]["campaign"]
        page = page_at(browser, f"http://{served.host}/?token={TOKEN}")
        page.evaluate(f"location.hash = '#/see/{name}'")
        page.get_by_role("heading", name="What was measured [microstrain]").wait_for()
        page.get_by_text("fit the base model: weighted residual").wait_for()
        table = saved(page, page.locator(".heat").locator("xpath=.."))
        page.locator("canvas").first.press("ArrowUp")
        curve = saved(page, page.locator(".plot").first)
        models = served.campaign(name)["models"]
        page.context.close()
    assert [one["ready"] for one in models] == [False]
    cells = [[float(x) for x in column] for column in list(table.values())[1:]]
    assert cells == [[0.0, 10.0], [1.0, 11.0], [2.0, 12.0]]
    assert [float(x) for x in curve["measured [microstrain]"]] == [10.0, 11.0, 12.0]


def test_lengths_of_the_tire_reach_the_map_of_an_import(browser: Any, tmp_path: Path) -> None:
    rows = "".join(f"{0.001 * k:.3f},{100 + k % 7},{2000 + k % 3},36\n" for k in range(50))
    (tmp_path / "lab.csv").write_text(f"time [s],strain_1 [um/m],Fz [N],speed [km/h]\n{rows}")
    lengths = {"ring_radius": 300.5, "tread_thickness": 9, "innerliner_offset": -4.5}
    with serve(tmp_path) as (_, url):
        page = page_at(browser, url)
        drop(page, tmp_path / "lab.csv")
        page.get_by_label("axes", exact=True).select_option("iso")
        page.get_by_label("free radius in mm").fill("316")
        column = page.get_by_label("quantity of strain_1")
        column.select_option("")
        belt = page.get_by_label("belt_width_m in mm")
        assert belt.is_hidden()  # forces alone need no lengths
        column.select_option("strain_1")
        page.get_by_label("positions of the gages in mm").fill("0")
        for name, length in lengths.items():
            page.get_by_label(f"{name}_m in mm").fill(str(length))
        belt.fill("wide")
        page.locator("#import").click()
        page.get_by_text("[tire] belt_width_m: give a number in mm").wait_for()
        belt.fill("")
        page.locator("#import").click()
        page.locator("dialog summary", has_text="The map that was sent").wait_for()
        page.context.close()
    tire = tomllib.loads(next(tmp_path.glob("s/files/*/map.toml")).read_text())["tire"]
    assert tire == pytest.approx(
        {"free_radius_m": 0.316} | {f"{name}_m": x / 1e3 for name, x in lengths.items()}
    )


def test_a_diagnosis_that_fails_says_what_can_be_done_next(browser: Any, tmp_path: Path) -> None:
    with closing(Served(tmp_path)) as served:
        until(lambda: served.server.started)
        name = served.do(do="open", path=str(served.measured))[1]["campaign"]
        until(lambda: "strain/diagnosis.json" in str(served.campaign(name)["models"]))
        served.do(do="look", campaign=name, model="001", quantity="Fy")
        page = page_at(browser, f"http://{served.host}/?token={TOKEN}")
        page.evaluate(f"location.hash = '#/suspect/{name}'")
        said = page.locator("#ways")
        said.wait_for()
        assert "bending: not determined; run at 6 bar" in said.inner_text()
        said.get_by_role("button", name="strain").click()
        wait_for(page, "studio.campaign.quantity === 'strain'")
        page.context.close()


HOSTILE = """async target => {
  const found = {};
  const body = '{"do": "example"}';
  const form = { method: "POST", mode: "no-cors", credentials: "include", body };
  found.blind = await fetch(`http://${target}/do`, form).then((r) => r.type, () => "refused");
  found.read = await fetch(`http://${target}/home`, { credentials: "include" })
    .then((r) => r.text(), () => "refused");
  found.stream = await new Promise((done) => {
    const socket = new WebSocket(`ws://${target}/news`);
    socket.onopen = () => done("open");
    socket.onerror = () => done("refused");
  });
  found.script = await new Promise((done) => {
    const script = document.createElement("script");
    script.src = `http://${target}/studio.js`;
    script.onload = () => done("loaded");
    script.onerror = () => done("refused");
    document.head.append(script);
  });
  return found;
}"""
"""What a page of another origin tries, in a browser that has the studio's cookie."""


def test_a_hostile_page_in_the_same_browser_reads_and_starts_nothing(
    browser: Any, tmp_path: Path
) -> None:
    served = Served(tmp_path)
    until(lambda: served.server.started)
    with ThreadingHTTPServer(("127.0.0.1", 0), SimpleHTTPRequestHandler) as evil:
        threading.Thread(target=evil.serve_forever, daemon=True).start()
        page = browser.new_context().new_page()
        page.set_default_timeout(1000.0 * PATIENCE)
        page.goto(f"http://{served.host}/?token={TOKEN}")
        page.locator("#steps a").first.wait_for()
        page.goto(f"http://127.0.0.1:{evil.server_port}/nothing-here")  # same site, other origin
        found = page.evaluate(HOSTILE, served.host)
        page.context.close()
        evil.shutdown()
    kinds = [job.kind for job in served.desk.jobs.all.values()]
    served.close()
    assert found["read"] == found["stream"] == found["script"] == "refused"
    assert found["blind"] in ("opaque", "refused")  # the browser does not say which
    assert kinds == ["catalogue"]
