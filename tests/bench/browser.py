"""A real Chromium for tests: the system's, Debian's when we are root, else Playwright's own."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest

from tests.bench.programs import PATIENCE, wait_until

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
WITHOUT = "Playwright is not installed (`make` does it); only a real browser runs the page's script"
WITHOUT_CHROMIUM = (
    "there is no Chromium, and neither apt-get as root nor Playwright could install one (is there "
    "a network?); only a real browser runs the page's script"
)
NOTHING = "\u2013"
"""What the page shows in place of a number."""
ROWS = "wheel => (tirebench.wheels.get(wheel)?.rows ?? []).map(row => Array.from(row))"
INSTALL = 240.0
"""Time that an installation may take, [s]."""


def _found() -> str | None:
    return next((path for name in NAMES if (path := shutil.which(name))), None)


def _done(*command: str) -> bool:
    try:
        return subprocess.run(command, capture_output=True, timeout=INSTALL).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


@contextmanager
def chromium() -> Iterator[Any]:
    """Give a browser of Playwright's synchronous API; skip, with the reason, if none can be had."""
    api = pytest.importorskip("playwright.sync_api", reason=WITHOUT)
    path = _found()
    if path is None and hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get"):
        _done("apt-get", "update")
        _done("apt-get", "install", "-y", "--no-install-recommends", "chromium")
        path = _found()
    if path is None and not _done(sys.executable, "-m", "playwright", "install", "chromium"):
        pytest.skip(WITHOUT_CHROMIUM)
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=path, args=["--no-sandbox"], timeout=1e3 * PATIENCE
        )
        yield browser
        browser.close()


@dataclass
class Visitor:
    """What a browser asked for and complained about while it showed a page."""

    addresses: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)


def opened(browser: Any, url: str, visit: Visitor) -> Any:
    context = browser.new_context(color_scheme="light", viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    page.on("request", lambda request: visit.addresses.append(request.url))
    page.on("websocket", lambda stream: visit.addresses.append(stream.url))
    page.on("console", lambda said: visit.complaints.append(said.text))
    page.on("pageerror", lambda error: visit.complaints.append(str(error)))
    page.goto(url)
    return page


def wait_for(page: Any, script: str) -> None:
    """Wait until a script gives true; Playwright's own way evaluates text, which is forbidden."""
    wait_until(lambda: page.evaluate(script) is True, script)
