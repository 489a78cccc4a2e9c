"""The studio in a real browser: from runs of forces to the added effect, and out again.

The tests of one campaign share what was fitted to it; each can be run alone.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.browser import chromium
from tests.bench.programs import PATIENCE
from tests.chain.studio_pages import HELD, page_at, saved, serve, wait_for
from tests.unit.inference.force_campaigns import steady_runs, write_forces


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


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
        wait_for(page, "studio.running.length === 0")
        assert page.evaluate("studio.campaign.current") == before
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


def test_two_quantities_have_their_own_numbers_and_one_brush(browser: Any, tmp_path: Path) -> None:
    """What is added for the side force is told of the aligning moment as well."""
    runs = steady_runs(angles=(-5.0, -2.0, 2.0, 5.0), slope=0.25, moment=True)
    write_forces(tmp_path / "both", runs, "both")
    shown = {}
    with serve(tmp_path, str(tmp_path / "both")) as (_, url):
        page = page_at(browser, url)
        for quantity in ("Fy", "Mz", "Fy"):
            wait_for(page, "!document.getElementById('quantity-box').hidden")
            page.locator("#quantity").select_option(quantity)
            page.get_by_role("heading", name=f"What is left of {quantity}").wait_for()
            shown[quantity] = page.locator("#error").inner_text()
        page.get_by_role("button", name="Find what is missing").click()
        page.locator("input[data-effect=friction_load]").click()
        page.locator("#add").click()
        wait_for(page, "studio.campaign.current === '002'")
        added = page.locator("#error-after").inner_text()
        other = page.get_by_text("Error of Mz").inner_text()
        page.context.close()
    models = next(tmp_path.glob("s/campaigns/*/models"))
    for quantity, error in shown.items():
        told = json.loads((models / "001" / quantity / "comparison.json").read_text())
        assert (told["quantity"], error) == (quantity, digits(told["error"]))
    fit = json.loads((models / "002" / "fit.json").read_text())
    moment = fit["others"]["Mz"]
    assert added == digits(fit["error_after"])
    assert f"{digits(moment['error_before'])} before, {digits(moment['error_after'])}" in other


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
