"""The studio in a real browser: clicks from runs of forces to the added effect; attacks."""

import json
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from tests.bench.browser import chromium
from tests.bench.programs import PATIENCE
from tests.unit.force_campaigns import steady_runs, write_forces
from tests.unit.studio.conftest import TOKEN, Served, until


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
    write_forces(tmp_path / "steady", steady_runs(slope=0.25), "steady")
    complaints: list[str] = []
    addresses: list[str] = []
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    page.on("console", lambda said: complaints.append(said.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: addresses.append(request.url))
    with serve(tmp_path, str(tmp_path / "steady")) as (server, url):
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
    # the killed server leaves connections and answers unfinished; the page itself says nothing
    assert all("WebSocket" in said or "net::ERR_" in said for said in complaints), complaints
    host = re.split("[/?]", url)[2]
    assert {re.split("[/?]", one)[2] for one in addresses if "://" in one} == {host}


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
