"""The studio's five clicks in a real Chromium, on an example or a campaign; and the docs' pictures.

    python build/studio.py                         the example, five pictures into docs/howto/studio
    python build/studio.py --campaign DIR          another campaign, no pictures
    python build/studio.py --repeat                and the page's own commands, run again by hand

The numbers on the page are held against the documents of the commands; with --repeat the commands
that the page offers are run in an empty folder and have to give the same. Exit code 1 if not.
"""

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from playwright.sync_api import sync_playwright
from rich.console import Console

ROOT = Path(__file__).resolve().parent.parent
TIRELIB = Path(sys.executable).with_name("tirelib")
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
HOUR = 3600.0


def chromium_path() -> str | None:
    """Return the browser of this machine."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


@contextmanager
def studio(session: Path, *words: str) -> Iterator[tuple[str, int]]:
    """Run the server; give its address and its process."""
    command = [str(TIRELIB), "studio", *words, "--session", str(session), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        line = server.stdout.readline() if server.stdout is not None else ""
        yield line.partition(" ")[2].strip(), server.pid
        server.terminate()


def wait(page: Any, done: str) -> float:
    """Wait until a script gives true; return how long it took [s]."""
    start = time.monotonic()
    while page.evaluate(done) is not True:
        if time.monotonic() - start > HOUR:
            raise SystemExit(f"{done}: it did not happen within an hour")
        page.wait_for_timeout(20)
    return time.monotonic() - start


def walk(page: Any, campaign: str | None, picture: Any) -> dict[str, float]:
    """Go from opening to the effect that is added, in five clicks at most; return times [s]."""
    took = {}
    clicks = 0
    page.wait_for_selector("#steps a")
    if campaign is None:
        page.click("#example")  # click 1
        clicks += 1
    took["first view"] = wait(page, "!!document.getElementById('error')")
    page.wait_for_timeout(1500)
    picture("see")
    page.get_by_role("button", name="Find what is missing").click()  # click 2
    took["verdict"] = wait(page, "!!document.querySelector('tr[data-name]')")
    wait(page, "!!studio.campaign.models[0].documents[studio.campaign.quantity + '/traces.npz']")
    named = page.evaluate("studio.campaign.models[0].named")
    if not named:
        raise SystemExit("the verdict names no effect")
    page.wait_for_timeout(1000)
    page.locator(f"tr[data-name={named[0]}]").hover()
    page.wait_for_timeout(1000)
    picture("suspect")
    page.locator(f"input[data-effect={named[0]}]").click()  # click 3
    page.click("#add")  # click 4
    clicks += 3
    took["first progress"] = wait(page, "studio.running.some(job => job.what === 'fitting')")
    took["added"] = wait(page, "studio.campaign.current === '002'")
    page.wait_for_selector("#error-after")
    wait(page, "!!studio.campaign.models[1].verdict")
    wait(page, "studio.campaign.jobs.every(job => !!job.ended)")
    page.wait_for_timeout(500)
    picture("add")
    took["clicks"] = clicks
    return took


def judge(page: Any, session: Path) -> list[str]:
    """Return where the page differs from the documents of the commands."""
    place = next(session.glob("campaigns/*/models/002"))
    fit = json.loads((place / "fit.json").read_text())
    shown = page.locator("#error-after").inner_text()
    faults = [] if shown == f"{fit['error_after']:.4g}" else [f"{shown} for {fit['error_after']}"]
    quantity = page.evaluate("studio.campaign.quantity")
    compared = json.loads((place / quantity / "comparison.json").read_text())
    if not abs(compared["error"] / fit["error_after"] - 1.0) < 1e-6:
        faults.append(f"compare tells {compared['error']}, add {fit['error_after']}")
    return faults


def repeat(page: Any, session: Path) -> list[str]:
    """Run the commands that the page offers in an empty folder; return what differs."""
    place = next(session.glob("campaigns/*/models/002"))
    lines = page.locator("#commands").inner_text().splitlines()
    with TemporaryDirectory() as folder:
        for line in lines:
            subprocess.run(
                [str(TIRELIB), *shlex.split(line)[1:]], cwd=folder, stdout=subprocess.DEVNULL
            )
        again = json.loads((Path(folder) / "M2.json").read_text())
    fit = json.loads((place / "fit.json").read_text())
    keys = ("error_before", "error_after", "heldout_error_after", "floor")
    return [
        f"{k}: {again[k]} by hand, {fit[k]}" for k in keys if abs(again[k] - fit[k]) > 1e-9 * fit[k]
    ]


def main() -> None:
    """Walk, judge, and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--campaign", metavar="DIR")
    parser.add_argument("--repeat", action="store_true")
    parser.add_argument(
        "--out", type=Path, help="folder for pictures [docs/howto/studio for the example]"
    )
    parser.add_argument("--session", type=Path, help="keep the session there")
    given = parser.parse_args()
    out = given.out or (None if given.campaign else ROOT / "docs" / "howto" / "studio")
    with TemporaryDirectory() as temporary, sync_playwright() as playwright:
        session = given.session or Path(temporary)
        browser = playwright.chromium.launch(
            executable_path=chromium_path(), args=["--no-sandbox"], timeout=3e5
        )
        page = browser.new_context(viewport={"width": 1280, "height": 860}).new_page()
        page.set_default_timeout(1e3 * HOUR)
        faults: list[str] = []
        page.on("console", lambda said: faults.append(said.text))
        page.on("pageerror", lambda error: faults.append(str(error)))

        def picture(name: str) -> None:
            if out is not None:
                out.mkdir(parents=True, exist_ok=True)
                page.screenshot(path=out / f"{name}.png", full_page=True)

        with studio(session, *([given.campaign] if given.campaign else [])) as (url, _):
            page.goto(url)
            took = walk(page, given.campaign, picture)
            faults += judge(page, session)
            page.evaluate("location.hash = '#/open/' + studio.wanted")
            page.get_by_role("heading", name="Findings").wait_for()
            page.wait_for_timeout(1500)
            picture("open")
            page.evaluate("location.hash = '#/take/' + studio.wanted")
            page.locator("#commands").wait_for()
            page.wait_for_timeout(500)
            picture("take")
            faults += repeat(page, session) if given.repeat else []
            page.context.close()
        browser.close()
    say = Console(highlight=False).print
    for name, value in took.items():
        say(f"{name}: {value:.3g}")
    for fault in faults:
        say(f"differs: {fault}")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
