"""A real Chromium for tests: the system's, Debian's when we are root, else Playwright's own."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from tests.bench.programs import PATIENCE

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
WITHOUT = "Playwright is not installed (`make` does it); only a real browser runs the page's script"
WITHOUT_CHROMIUM = (
    "there is no Chromium, and neither apt-get as root nor Playwright could install one (is there "
    "a network?); only a real browser runs the page's script"
)
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
