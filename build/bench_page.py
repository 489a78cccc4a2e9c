"""Somebody who looks at the live page of a run: a headless Chromium, or else one request."""

import os
import re
import shutil
import sys
import time
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from http.cookiejar import CookieJar
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import subprocess

CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
PATIENCE = 600.0
"""For a page to appear, and for the next turn to come to it, [s]: only what hangs takes longer."""
LAST_TURN = "Math.max(0, ...[...tirebench.wheels.values()].map(w => w.last ? w.last.turn : 0))"
SIZE = {"width": 1600, "height": 1000}


@dataclass(frozen=True, slots=True)
class Seen:
    """What came of looking: a picture's file name (empty without a browser), and words."""

    picture: str = ""
    words: str = "nobody looked at the live page"


def chromium() -> str | None:
    """Return the path of a Chromium of this machine."""
    return next((path for name in CHROMIUM if (path := shutil.which(name))), None)


def launched(playwright: Any) -> Any:
    """Start a headless browser of Playwright's: this machine's, else Playwright's own."""
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    return playwright.chromium.launch(
        executable_path=chromium(), args=["--no-sandbox"] if root else [], timeout=1e3 * PATIENCE
    )


def address_of(log: Path, run: "subprocess.Popen[bytes]") -> str:
    """Return the address of the live page that a run announces; stop where it does not."""
    end = time.monotonic() + PATIENCE
    while not (found := re.search(r"live page: (\S+)\n", log.read_text(errors="replace"))):
        if run.poll() is not None or time.monotonic() > end:
            sys.exit(
                f"Error: tirebench run: no live page after {PATIENCE:.0f} s at most; it should "
                f"print its address; it said:\n{log.read_text(errors='replace')}"
            )
        time.sleep(0.05)
    return found[1]


class Look:
    """Look at the page of a run until so many turns have come, and keep a picture.

    Parameters
    ----------
    picture : Path
    browser : bool
        False to fetch the page only.
    """

    def __init__(self, picture: Path, *, browser: bool = True) -> None:
        self._picture = picture
        self._browser = browser

    def __call__(
        self, url: str, turns: float, say: Callable[[str], None], begin: Callable[[], object]
    ) -> Seen:
        """Look; what hinders the browser is said and no reason to stop.

        `begin` is called when the page is open, at the latest when it is known that none will be.
        """
        why = "without a browser, as asked for"
        if self._browser:
            try:
                return self._look(url, turns, say, begin)
            except Exception as error:  # no Playwright, no Chromium, or one that does not start
                why = f"without a browser ({type(error).__name__}: {str(error).splitlines()[0]})"
        begin()
        return Seen("", f"{fetch(url)}; {why}")

    def _look(
        self, url: str, turns: float, say: Callable[[str], None], begin: Callable[[], object]
    ) -> Seen:
        from playwright.sync_api import sync_playwright

        with sync_playwright() as playwright:
            browser = launched(playwright)
            page = browser.new_page(viewport=SIZE)
            page.set_default_timeout(1e3 * PATIENCE)
            page.goto(url)
            begin()
            last = wait_for_turns(page, turns, say)
            page.screenshot(path=str(self._picture))
            browser.close()
        return Seen(
            self._picture.name, f"live page in Chromium {browser.version} at turn {last:.0f}"
        )


def wait_for_turns(page: Any, turns: float, say: Callable[[str], None]) -> float:
    """Return the last turn on the page when there are so many, or when no more come."""
    end, last = time.monotonic() + PATIENCE, 0.0
    while last < turns and time.monotonic() < end:
        page.wait_for_timeout(100)  # evaluates nothing in the page: its policy forbids that
        before, last = last, float(page.evaluate(LAST_TURN))
        if last > before:
            end = time.monotonic() + PATIENCE
        say(f"live page: turn {last:.0f}")
    return last


def fetch(url: str) -> str:
    """Fetch the page with its token, as a first visit does; say what came.

    Raises
    ------
    OSError
        If it is refused.
    """
    opener = urllib.request.build_opener(
        urllib.request.ProxyHandler({}),
        urllib.request.HTTPCookieProcessor(CookieJar()),
    )
    with opener.open(url, timeout=PATIENCE) as answer:
        text = answer.read().decode()
    title = re.search(r"<title>(.*?)</title>", text)
    return (
        f"live page fetched: {answer.status}, {len(text)} characters, "
        f"titled {title[1] if title else 'nothing'}"
    )
