"""How fast the studio answers, in a real Chromium: every figure of its page of documentation.

    python build/studio_speed.py view DIR       the first view of a campaign without a known fit
    python build/studio_speed.py touch DIR      hover, tick, cancel, and 200 runs made of DIR's runs
    python build/studio_speed.py memory DIR     memory over 100 refits

Each time is printed with the machine's load, because other programs slow the jobs down. For the
first view the processor time of the jobs is printed as well. Give `memory` a campaign of forces,
whose refits are the shortest.
"""

import argparse
import json
import os
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from playwright.sync_api import sync_playwright
from rich.console import Console
from studio import TIRELIB, chromium_path, studio, wait

from tirelib.campaign import read_campaign, write_campaign

TICK = os.sysconf("SC_CLK_TCK")
RUNS = 200
"""Runs of the campaign that has to be smooth."""
REFITS = 100
TRIES = 10
say = Console(highlight=False).print

FRAMES = """async ([act, count]) => {
  const frame = () => new Promise(requestAnimationFrame), took = [];
  const canvas = document.querySelector("canvas"), box = canvas.getBoundingClientRect();
  const rows = [...document.querySelectorAll("tr[data-name]")];
  const at = (kind, share) => canvas.dispatchEvent(new PointerEvent(kind, {
    pointerId: 1, bubbles: true, clientX: box.left + (0.2 + 0.5 * share) * box.width,
    clientY: box.top + 0.5 * box.height }));
  canvas.setPointerCapture = () => {};
  for (let k = 0; k < count; k += 1) {
    await frame();
    const begun = performance.now();
    if (act === "hover") rows[k % rows.length].dispatchEvent(new MouseEvent("mouseenter"));
    if (act === "choose") canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowUp" }));
    if (act === "brush") { if (!k) at("pointerdown", 0); at("pointermove", (k % 40) / 40); }
    await frame();
    await frame();
    took.push(performance.now() - begun);
  }
  if (act === "brush") at("pointerup", 0.9);
  return took;
}"""
"""Do something again and again; each time is from the event to the second frame after it, by which
what the event drew has been shown. Without any work that is two frames."""


def told(name: str, times: Sequence[float], unit: str) -> None:
    """Print the median and the largest of some times."""
    load = os.getloadavg()[0]
    say(
        f"{name}: median {statistics.median(times):.3g} {unit}, largest {max(times):.3g} {unit}, "
        f"{len(times)} times, load {load:.1f}"
    )


def processor(pid: int) -> float:
    """Return the processor time of a process and all that it has started and waited for [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(int(x) for x in fields[11:15]) / TICK


def started_by(pid: int) -> list[int]:
    """Return the processes that a process has started and that still run."""
    return [int(x) for x in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def memory(pid: int) -> float:
    """Return the memory that a process holds [MB]."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


@contextmanager
def opened(*words: str) -> Iterator[tuple[Any, int]]:
    """Run the studio in a folder of its own; give a page of it and its process."""
    with TemporaryDirectory() as session, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium_path(),
            args=["--no-sandbox", "--js-flags=--expose-gc", "--enable-precise-memory-info"],
            timeout=3e5,
        )
        page = browser.new_context(viewport={"width": 1280, "height": 860}).new_page()
        page.set_default_timeout(3.6e6)
        with studio(Path(session), *words) as (url, pid):
            page.goto(url)
            page.wait_for_selector("#steps a")
            wait(page, "!!studio.home")
            yield page, pid
            page.context.close()
        browser.close()


def view(folder: str) -> None:
    """Time the first view of a campaign that has not been fitted."""
    with opened("--root", folder) as (page, pid):
        wait(page, "studio.home.effects.length > 0")
        runner = started_by(pid)[0]
        before = processor(runner)
        wish = f"{{do: 'open', path: {json.dumps(str(Path(folder).resolve()))}}}"
        page.evaluate(f"""fetch("/do", {{ method: "POST", body: JSON.stringify({wish}),
            headers: {{ "content-type": "application/json" }} }}).then((r) => r.json())
            .then((done) => {{ location.hash = "#/see/" + done.campaign; }})""")
        begun = time.monotonic()
        wait(page, "!!document.querySelector('#main canvas')?.clientWidth")
        told("what was measured is seen after", [time.monotonic() - begun], "s")
        wait(page, "!!document.getElementById('error')")
        took = time.monotonic() - begun
        jobs = page.evaluate(
            "studio.campaign.jobs.filter(j => j.ended).map(j => [j.kind, j.ended - j.begun])"
        )
        told("the fitted view is seen after", [took], "s")
        wait(page, "studio.campaign.models[0].ready")  # the fit goes on after its ring is seen
        say(f"processor time of the jobs, whole fit: {processor(runner) - before:.3g} s")
        for kind, seconds in jobs:
            say(f"  {kind}: {seconds:.3g} s by the clock")


def many_runs(folder: str, target: Path) -> Path:
    """Write `RUNS` runs, those of a campaign again and again."""
    campaign = read_campaign(folder)
    runs = zip(range(RUNS), cycle(list(campaign.runs())))
    numbered = (replace(run, plan=replace(run.plan, run=n, start=12.0 * n)) for n, run in runs)
    write_campaign(target, campaign.header, numbered)
    return target


def touch(folder: str) -> None:
    """Time what follows a hand at once."""
    with TemporaryDirectory() as temporary:
        model = Path(temporary) / "M.toml"
        os.spawnl(os.P_WAIT, TIRELIB, "tirelib", "identify", folder, "--out", str(model), "-q")
        with opened(folder, "--model", str(model)) as (page, _):
            wait(page, "!!document.getElementById('error')")
            page.evaluate("location.hash = '#/suspect/' + studio.wanted")
            wait(page, "!!document.querySelector('tr[data-name]')")
            traces = "studio.campaign.quantity + '/traces.npz'"
            wait(page, f"!!studio.campaign.models[0].documents[{traces}]")
            page.wait_for_timeout(1000)
            told("hover", page.evaluate(FRAMES, ["hover", 60]), "ms")
            tick_and_cancel(page)
        many = str(many_runs(folder, Path(temporary) / "many"))
        with opened(many, "--model", str(model)) as (page, _):
            wait(page, "!!document.getElementById('error')")
            page.wait_for_timeout(1000)
            page.locator("label", has_text="each gage").locator("input").check()
            say(f"{RUNS} runs, each gage drawn:")
            for act, name in (("choose", "another run"), ("brush", "a range that is dragged")):
                told(f"  {name}", page.evaluate(FRAMES, [act, 120]), "ms")


def tick_and_cancel(page: Any) -> None:
    """Time from the click on Add to the first progress, and from Cancel to the job's end."""
    progress, end = [], []
    box = page.locator("input[data-effect]").first.get_attribute("data-effect")
    for _ in range(TRIES):
        page.evaluate("location.hash = '#/suspect/' + studio.wanted")
        page.locator(f"input[data-effect={box}]").check()
        page.locator("#add").click()
        progress.append(wait(page, "studio.running.some(job => job.what === 'fitting')"))
        page.locator("[data-cancel]").click()
        end.append(wait(page, "studio.campaign.jobs.every(job => job.kind !== 'add' || job.ended)"))
    told("from Add to the first progress", progress, "s")
    told("from Cancel to the end of the job", end, "s")


def flat(folder: str) -> None:
    """Print the memory of server, starter of jobs and page over `REFITS` refits."""
    with opened(folder) as (page, pid):
        wait(page, "!!studio.campaign?.models.some(model => model.verdict)")
        effect, other = page.evaluate(
            "fetch('/document?' + new URLSearchParams({ campaign: studio.wanted, model: '001',"
            " quantity: studio.campaign.quantity, name: 'diagnosis' })).then((r) => r.json())"
            ".then((told) => told.candidates.map((e) => e.effect).slice(0, 2))"
        )
        for count in range(REFITS + 1):
            if count in (0, 10, 25, 50, 75, 100):
                page.evaluate("gc()")
                heap = page.evaluate("performance.memory.usedJSHeapSize") / 2**20
                runner = started_by(pid)[0]
                say(
                    f"after {count} refits: server {memory(pid):.0f}, starter "
                    f"{memory(runner):.0f}, page {heap:.1f} MB"
                )
            add = f"""{{ do: "add", campaign: studio.wanted, model: "001",
                quantity: studio.campaign.quantity, effects: ["{(effect, other)[count % 2]}"] }}"""
            made = page.evaluate(f"""fetch("/do", {{ method: "POST", body: JSON.stringify({add}),
                headers: {{ "content-type": "application/json" }} }}).then((r) => r.json())""")
            number = made["models"][0]
            wait(page, f"!!studio.campaign.models.find(m => m.number === '{number}')?.ready")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=["view", "touch", "memory"])
    parser.add_argument("campaign", metavar="DIR")
    given = parser.parse_args()
    {"view": view, "touch": touch, "memory": flat}[given.what](given.campaign)


if __name__ == "__main__":
    sys.exit(main())
