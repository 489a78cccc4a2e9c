"""The studio served to a real browser, and what a hand does there."""

import csv
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.bench.programs import PATIENCE


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


def page_at(browser: Any, url: str) -> Any:
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    page.goto(url)
    return page


def saved(page: Any, of: Any) -> dict[str, list[str]]:
    """Click the link CSV of a plot; return the columns of the file."""
    with page.expect_download() as found:
        of.get_by_role("button", name="CSV").click()
    names, *rows = csv.reader(Path(found.value.path()).read_text().splitlines())
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def drop(page: Any, path: Path) -> None:
    """Drop a file or folder as a hand would: the browser itself reads it from the disk."""
    session = page.context.new_cdp_session(page)
    data = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": kind, "x": 600, "y": 500, "data": data})
