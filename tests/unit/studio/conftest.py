"""A studio that is served, with processes that stand for the commands."""

import asyncio
import http.client
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette", reason="the extra `studio` is not installed")
pytest.importorskip("uvicorn", reason="the extra `studio` is not installed")

from tirelib.studio.desk import Desk
from tirelib.studio.jobs import Jobs
from tirelib.studio.server import Studio, server_of
from tirelib.studio.session import Session
from tirelib.web.address import listener

RUNNER = (sys.executable, str(Path(__file__).with_name("fake_runner.py")))
PATIENCE = 300.0
TOKEN = "secret-token"


class Served:
    """A studio in a thread, and what an attacker knows of it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.hold = folder, folder / "hold"
        os.environ["HOLD"], os.environ["SAID"] = str(self.hold), str(folder / "said")
        self.measured = folder / "measured" / "tire"
        self.measured.mkdir(parents=True)
        (self.measured / "campaign.toml").write_text("x = 1\n")
        self.desk = Desk(
            Session(folder / "session"),
            Jobs(folder / "session" / "jobs", RUNNER),
            [folder / "measured"],
        )
        self.socket = listener("127.0.0.1", 0)
        self.port = self.socket.getsockname()[1]
        self.host = f"127.0.0.1:{self.port}"
        self.studio = Studio(self.desk, TOKEN, "127.0.0.1", self.port)
        self.server = server_of(self.studio)
        self.good = {"Host": self.host, "Cookie": f"tirelib-{self.port}={TOKEN}"}
        run = self.server.serve([self.socket])
        self.thread = threading.Thread(target=lambda: asyncio.run(run))
        self.thread.start()

    def close(self) -> None:
        self.server.should_exit = True
        self.thread.join(PATIENCE)

    def ask(
        self,
        path: str,
        *,
        method: str = "GET",
        body: bytes | None = None,
        length: int | None = None,
        **headers: str,
    ) -> tuple[int, dict[str, str], bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        if body is not None:
            connection.putheader("Content-Length", str(len(body) if length is None else length))
        connection.endheaders(body)
        answer = connection.getresponse()
        got = answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
        connection.close()
        return got

    def get(self, path: str) -> Any:
        status, _, body = self.ask(path, **self.good)
        assert status == 200, body
        return json.loads(body)

    def do(self, **wish: Any) -> tuple[int, Any]:
        body = json.dumps(wish).encode()
        kind = {"Content_Type": "application/json"}
        status, _, said = self.ask("/do", method="POST", body=body, **kind, **self.good)
        return status, json.loads(said)

    def upload(self, name: str, data: bytes, files: str = "") -> tuple[int, Any]:
        path = f"/upload?name={name}&files={files}"
        status, _, said = self.ask(path, method="POST", body=data, **self.good)
        return status, json.loads(said)

    def campaign(self, name: str) -> Any:
        return self.get(f"/campaign?campaign={name}")

    def said(self) -> list[dict[str, Any]]:
        file = self.folder / "said"
        return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def until(true: Callable[[], Any]) -> Any:
    end = time.monotonic() + PATIENCE
    while not (found := true()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return found


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    one = Served(tmp_path)
    until(lambda: one.server.started)
    yield one
    one.close()


@pytest.fixture
def opened(served: Served) -> str:
    """Return the address of a campaign whose base model has been diagnosed."""
    status, told = served.do(do="open", path=str(served.measured))
    assert status == 200, told
    name = str(told["campaign"])

    def known() -> bool:
        models = served.campaign(name)["models"]
        return bool(models and "strain/traces.npz" in models[0]["documents"])

    until(known)
    return name
