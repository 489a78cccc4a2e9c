"""The studio in a real browser: five clicks from a sweep of forces to the named effect added."""

import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.bench.browser import chromium
from tests.bench.programs import PATIENCE
from tests.unit.force_campaigns import write_sweep

pytest.importorskip("starlette", reason="the extra `studio` is not installed")


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


@contextmanager
def serve(folder: Path, *words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run the server until the end, which is not a gentle one; give its process and address."""
    command = [sys.executable, "-m", "tirelib", "studio", *words, "--session", str(folder / "s")]
    with subprocess.Popen([*command, "--no-browser"], stdout=subprocess.PIPE, text=True) as server:
        line = server.stdout.readline() if server.stdout is not None else ""
        try:
            yield server, line.partition(" ")[2].strip()
        finally:
            server.kill()


def test_five_clicks_add_the_effect_that_forces_lack(browser: Any, tmp_path: Path) -> None:
    write_sweep(tmp_path / "sweep", 81, {"friction_load": 0.12})
    complaints: list[str] = []
    addresses: list[str] = []
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    page.on("console", lambda said: complaints.append(said.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: addresses.append(request.url))
    with serve(tmp_path, str(tmp_path / "sweep")) as (server, url):
        page.goto(url)
        page.get_by_role("button", name="Find what is missing").click()  # click 1
        page.locator("input[data-effect=friction_load]").click()  # click 2
        second = page.context.new_page()
        second.goto(page.url)  # another tab, before anything is added
        page.locator("#add").click()  # click 3
        shown = page.locator("#error-after").inner_text()
        server.kill()  # no goodbye
        wait_for(page, "studio.connected === false")
    with serve(tmp_path) as (_, again):
        assert again == url
        wait_for(page, "studio.connected === true")
        wait_for(second, "studio.campaign !== null && studio.campaign.current === '002'")
        page.reload()
        assert page.locator("#error-after").inner_text() == shown
    page.context.close()
    place = next((tmp_path / "s").glob("campaigns/*/models/002"))
    fit = json.loads((place / "fit.json").read_text())
    assert shown == str(float(f"{fit['error_after']:.4g}"))
    assert fit["effect"] == "friction_load"
    assert fit["error_after"] < fit["error_before"]
    diagnosis = json.loads((place.parent / "001" / "Fy" / "diagnosis.json").read_text())
    assert "friction_load" in diagnosis["named"]
    assert complaints == [] or all("WebSocket" in said for said in complaints), complaints
    host = re.split("[/?]", url)[2]
    assert {re.split("[/?]", one)[2] for one in addresses if "://" in one} == {host}
