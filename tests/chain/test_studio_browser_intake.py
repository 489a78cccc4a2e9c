"""The studio in a real browser: what is dropped or imported, what fails, what attacks."""

import json
import threading
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import closing
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.browser import chromium
from tests.bench.programs import PATIENCE
from tests.chain.studio_pages import drop, page_at, saved, serve, wait_for
from tests.unit.inference.force_campaigns import steady_runs, write_forces
from tests.unit.studio.conftest import TOKEN, Served, until
from tirelib.campaign import Run, read_campaign


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


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
        assert page.evaluate("studio.campaign.models.some((model) => model.ready)") is False
        lost = next(tmp_path.glob("s/files/**/runs")) / "002.mf4"
        lost.write_bytes((tmp_path / "002.mf4").read_bytes())
        page.locator("#check-again").click()
        wait_for(page, "studio.campaign.check?.errors === 0")
        drop(page, tmp_path / "messung.csv")
        page.get_by_text("Left out: Druck vorn [bar]: line 14 holds 'Übersteuert'").wait_for()
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


def test_an_effect_of_ones_own_is_written_from_the_page_alone(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "naive.py").write_text("def naive(strain, strength):\n    return strain\n")
    with serve(tmp_path) as (_, url):
        page = page_at(browser, url)
        drop(page, tmp_path / "naive.py")
        page.get_by_role("button", name="I have read it").click()
        dialog = page.locator("#dialog")
        dialog.get_by_text("naive.py: holds no effect").wait_for()  # it stays, with what to do
        with page.expect_download() as found:
            dialog.get_by_role("link", name="my_effect.py").click()
        found.value.save_as(tmp_path / "mine.py")
        dialog.get_by_role("button", name="Close").click()
        page.evaluate("location.hash = '#/take/'")
        page.locator("#own").get_by_text("naive.py: holds no effect").wait_for()
        drop(page, tmp_path / "mine.py")
        page.get_by_role("button", name="I have read it").click()
        wait_for(page, "studio.home.effects.some((one) => one.effect === 'wet_road')")
        wait_for(page, "!document.getElementById('dialog').open")
        page.evaluate("location.hash = '#/take/'")
        page.locator("#own").get_by_text("In use: mine.py").wait_for()
        page.context.close()


def test_a_folder_is_sent_by_the_browsers_own_choice(browser: Any, tmp_path: Path) -> None:
    few = list(steady_runs(loads=(2000.0, 4000.0), angles=(-2.0, 2.0), repeats=1))
    write_forces(tmp_path / "sent", few, "sent")
    with serve(tmp_path) as (_, url):
        page = page_at(browser, url)
        with page.expect_file_chooser() as found:
            page.get_by_role("button", name="Send a whole folder").click()
        found.value.set_files(tmp_path / "sent")
        wait_for(page, "studio.campaign?.check?.errors === 0")
        assert page.evaluate("studio.campaign.title") == "sent"
        page.context.close()


def test_a_wrong_folder_and_a_mistyped_address_are_told_as_such(
    browser: Any, tmp_path: Path
) -> None:
    few = list(steady_runs(loads=(2000.0, 4000.0), angles=(-2.0, 2.0), repeats=1))
    write_forces(tmp_path / "typed", few, "typed")
    (tmp_path / "letters").mkdir()
    for name in ("one.txt", "two.txt"):
        (tmp_path / "letters" / name).write_text("Dear all,\nwe meet at nine.\n")
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / "runs.csv").write_bytes((tmp_path / "typed" / "runs.csv").read_bytes())
    with serve(tmp_path, "--root", str(tmp_path)) as (_, url):
        page = page_at(browser, url)
        dialog = page.locator("#dialog")
        drop(page, tmp_path / "letters")
        dialog.get_by_text("None of the 2 files").wait_for()
        assert "separator" not in dialog.inner_text()  # no advice on tables before it is asked for
        dialog.get_by_role("button", name="Close").click()
        drop(page, tmp_path / "half")
        page.locator("#toast", has_text="half/runs.csv: a campaign without its campaign").wait_for()
        page.evaluate("location.hash = '#/see/tipped'")
        page.locator("#where", has_text="No campaign here is called tipped").wait_for()
        page.evaluate("location.hash = '#/open/'")
        page.locator("#browse").click()
        path = dialog.get_by_label("path of a folder")
        path.fill("/nowhere")
        path.press("Enter")
        page.locator("#toast", has_text="it lies outside").wait_for()
        above = "document.getElementById('toast').matches(':popover-open')"
        assert page.evaluate(above)  # the dialog does not hide it
        path.fill(str(tmp_path / "typed"))
        path.press("Enter")
        dialog.get_by_role("button", name="Open this campaign").click()
        wait_for(page, "studio.campaign?.title === 'typed'")
        page.context.close()


def test_files_that_are_no_runs_and_wrong_units_are_told_before_the_import(
    browser: Any, tmp_path: Path
) -> None:
    rows = "".join(f"{0.1 * k:.1f},{4 + k % 3},{60 + k},198.{k}\n" for k in range(5))
    table = f"time [s],Fz [kN],speed [km/h],loaded_radius [mm]\n{rows}"
    texts = {
        "1.csv": table,
        "2.csv": table.replace("60", "61"),
        "3.csv": table[: table.find("0.1,")],
    }
    texts |= {"typo.csv": table.replace("62", "6,2"), "notes.txt": "A tire.\n"}
    (tmp_path / "lab").mkdir()
    for name, text in texts.items():
        (tmp_path / "lab" / name).write_text(text)
    with serve(tmp_path) as (_, url):
        page = page_at(browser, url)
        drop(page, tmp_path / "lab")
        bad = page.locator("#unreadable")
        bad.wait_for()
        assert "2 of 5 files" in bad.inner_text()
        assert "lab/typo.csv: line 4 has 5" in bad.inner_text()
        assert "lab/notes.txt: " in bad.inner_text()
        assert "/" not in bad.inner_text().replace("lab/", "")  # no path of the session
        page.get_by_label("axes", exact=True).select_option("iso")
        page.get_by_label("free radius in mm").fill("400")
        page.get_by_label("unit of Fz [kN]").fill("N")
        page.get_by_label("unit of speed [km/h]").fill("m/s")
        form = page.locator("#dialog")
        form.get_by_text("its middle is 5 N; plausible is 10 N to 200000 N").wait_for()
        form.get_by_text("its middle is 198 mm; plausible is 240 mm to 440 mm").wait_for()
        page.locator("#import").click()
        alert = form.get_by_role("alert")
        said = alert.inner_text().splitlines()
        assert [line[:14] for line in said] == ["[channels] Fz ", "[tire] free_ra"]
        page.set_viewport_size({"width": 1280, "height": 500})
        form.evaluate("form => { form.scrollTop = 0; }")
        box = alert.bounding_box()  # it is seen wherever the form has been scrolled
        assert box["y"] + box["height"] <= 500
        page.set_viewport_size({"width": 1280, "height": 800})
        page.get_by_label("free radius in mm").fill("198")
        page.get_by_label("quantity of Fz [kN]").select_option("")
        page.get_by_label("unit of speed [km/h]").fill("")
        form.get_by_text("a unit is needed: m/s, km/h").wait_for()
        page.get_by_label("unit of speed [km/h]").fill("km/h")
        page.locator("#import").click()
        assert "loaded radius of up to 198." in alert.inner_text()
        assert "Fz: the vertical force is needed" in alert.inner_text()
        page.get_by_label("quantity of Fz [kN]").select_option("Fz")
        page.get_by_label("free radius in mm").fill("203")
        page.get_by_label("unit of Fz [kN]").fill("kN")
        page.locator("#import").click()
        form.get_by_text("3.csv: 1 row(s) of data; at least two are needed").wait_for()
        page.locator("#files summary").click()
        page.get_by_label("import 3.csv").uncheck()
        page.locator("#import").click()
        wait_for(page, "studio.home.campaigns.length === 1")
        page.context.close()
    made = read_campaign(next(tmp_path.glob("s/jobs/*/out/campaign")))
    assert len(list(made.runs())) == 2


def test_what_was_measured_is_seen_before_any_model_is_fitted(browser: Any, tmp_path: Path) -> None:
    with closing(Served(tmp_path)) as served:
        until(lambda: served.server.started)
        served.hold.touch()  # the fit does not end
        name = served.do(do="open", path=str(served.measured))[1]["campaign"]
        page = page_at(browser, f"http://{served.host}/?token={TOKEN}")
        page.evaluate(f"location.hash = '#/see/{name}'")
        page.get_by_role(
            "heading", name="What was measured, mean of the gages [microstrain]"
        ).wait_for()
        page.get_by_text("fit the base model: step").wait_for()
        table = saved(page, page.locator(".heat").locator("xpath=.."))
        page.locator("canvas").first.press("ArrowUp")
        curve = saved(page, page.locator(".plot").first)
        models = served.campaign(name)["models"]
        page.context.close()
    assert [one["ready"] for one in models] == [False]
    cells = [[float(x) for x in column] for column in list(table.values())[1:]]
    assert cells == [[0.0, 10.0], [1.0, 11.0], [2.0, 12.0]]
    assert [float(x) for x in curve["measured [microstrain]"]] == [10.0, 11.0, 12.0]


def test_a_failed_import_leaves_the_list_after_a_good_one(browser: Any, tmp_path: Path) -> None:
    with closing(Served(tmp_path)) as served:
        until(lambda: served.server.started)
        page = page_at(browser, f"http://{served.host}/?token={TOKEN}")
        said = page.locator("#main").get_by_text("make a campaign from the files: failed.")
        counts = []
        for name in ("bad", "good", "bad"):
            files = served.upload("few.csv", b"a\n1\n")[1]["files"]
            served.do(do="dropped", files=files)
            job = served.do(do="import", files=files, map={"name": name})[1]["job"]
            over = f"studio.home?.jobs.some(one => one.job === {job} && one.ended)"
            wait_for(page, f"!!({over}) && document.getElementById('main').innerText.length > 0")
            counts.append(said.count())
        page.context.close()
    assert counts == [1, 0, 1]


def test_lengths_of_the_tire_reach_the_map_of_an_import(browser: Any, tmp_path: Path) -> None:
    rows = "".join(f"{0.001 * k:.3f},{100 * (k % 7)},{2000 + k % 3},36\n" for k in range(50))
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
        # strain is taken for steady runs, whose pressure the file does not tell
        page.get_by_text("[set_points] pressure_bar: give a number").wait_for()
        page.get_by_label("pressure_bar value").fill("2.2")
        page.locator("#import").click()
        page.locator("dialog summary", has_text="The map that was sent").wait_for()
        page.context.close()
    tire = tomllib.loads(next(tmp_path.glob("s/files/*/map.toml")).read_text())["tire"]
    assert tire == pytest.approx(
        {"free_radius_m": 0.316} | {f"{name}_m": x / 1e3 for name, x in lengths.items()}
    )


def test_an_import_that_needs_a_decision_shows_where_it_is_made(
    browser: Any, tmp_path: Path
) -> None:
    rows = "0;4000;-10;1\n1;4010;;2\n2;3990;-30;3\n"
    (tmp_path / "lab.csv").write_text(f"Zeit;Radlast;Seitenkraft;Schräglauf\ns;N;N;deg\n{rows}")
    with serve(tmp_path) as (_, url):
        page = page_at(browser, url)
        drop(page, tmp_path / "lab.csv")
        page.get_by_label("axes", exact=True).select_option("iso")
        page.get_by_label("free radius in mm").fill("316")
        decision = page.get_by_label("rows with a missing number")
        assert not decision.is_visible()
        page.locator("#import").click()
        decision.select_option("drop")
        page.locator("#import").click()
        wait_for(page, "studio.home.campaigns.length === 1")
        page.context.close()
    (run,) = read_campaign(next(tmp_path.glob("s/jobs/*/out/campaign"))).runs()
    assert np.rad2deg(run.rig["slip_angle"]) == pytest.approx([1.0, 3.0])


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


RUNS = "!!studio.campaign?.jobs.some(job => job.kind === 'diagnose' && job.state === 'running')"


def test_after_ones_own_cancel_nothing_is_advised_against_a_failure(
    browser: Any, tmp_path: Path
) -> None:
    with closing(Served(tmp_path)) as served:
        until(lambda: served.server.started)
        served.hold.write_text("diagnose")
        name = served.do(do="open", path=str(served.measured))[1]["campaign"]
        page = page_at(browser, f"http://{served.host}/?token={TOKEN}")
        page.evaluate(f"location.hash = '#/suspect/{name}'")
        wait_for(page, RUNS)
        cancel = page.get_by_role("button", name="Cancel")
        until(lambda: cancel.count() == 1)  # what ran beside the held diagnosis has ended
        cancel.click()
        page.get_by_role("heading", name="It was cancelled").wait_for()
        said = page.locator("#ways").inner_text()
        page.context.close()
    assert "Go on without a verdict: tick an effect that you suspect" in said
    assert "poor" not in said
    assert "not determined" not in said


NEXT = """async () => {
  const { nextRun } = await import("/next.js"), { plain } = await import("/data.js");
  const data = { load: [3000, 5000], pressure: [2, 2.4], speed: [40, 80], slip_angle: [-0.1, 0.1] };
  const found = { candidates: [{ load_N: 4000, pressure_bar: 1.6, speed_kmh: 110 }] };
  const model = { file: "/session/001/M.toml", saved_as: "M2.toml", next_as: "M3.toml" };
  const said = plain("tirelib add x --model /session/001/M.toml --out M2.toml", model);
  document.getElementById("main").replaceChildren(nextRun(found, said, data).element);
}"""
"""The next run of a plan whose slip angle only scatters."""


def test_the_next_run_is_drawn_over_the_conditions_that_it_states(
    browser: Any, tmp_path: Path
) -> None:
    with closing(Served(tmp_path)) as served:
        until(lambda: served.server.started)
        page = page_at(browser, f"http://{served.host}/?token={TOKEN}")
        page.locator("#steps a").first.wait_for()
        page.evaluate(NEXT)
        words = page.locator("#next-run").inner_text()
        plots = page.locator("#next-run .plot")
        pressure, speed = (saved(page, plots.nth(k)) for k in range(2))
        page.context.close()
    assert "--model M2.toml --out M3.toml" in words
    assert "4000 N, 1.6 bar, 110 km/h" in words
    assert pressure["best next runs [bar]"] == ["", "1.6", ""]
    assert pressure["measured runs [bar]"] == ["2", "", "2.4"]
    assert speed["best next runs [km/h]"] == ["", "110", ""]


WORDS = """async () => {
  const { rounded } = await import("/maps.js"), { verdictOf } = await import("/data.js");
  const loads = [220, 660, 1100], angles = [-4.01, 0.0001, 3.99];
  return [...loads.map((x) => rounded(x, loads)), ...angles.map((x) => rounded(x, angles)),
    verdictOf("named", "noise", ["a"]), verdictOf("named", "noise", ["a", "b"])];
}"""


def test_levels_and_verdicts_are_told_as_they_are(browser: Any, tmp_path: Path) -> None:
    with closing(Served(tmp_path)) as served:
        until(lambda: served.server.started)
        page = page_at(browser, f"http://{served.host}/?token={TOKEN}")
        page.locator("#steps a").first.wait_for()
        said = page.evaluate(WORDS)
        page.context.close()
    assert said[:6] == ["220", "660", "1100", "\u22124", "0", "4"]
    assert said[6:] == ["one effect is missing", "two effects are missing"]


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
