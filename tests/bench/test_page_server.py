"""The page's process: who is let in, and that a run outlives whatever happens to it."""

import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.bench.in_process import FakeSource
from tests.bench.programs import PATIENCE, wait_until
from tirebench.estimator.estimation import News
from tirebench.page.feed import About
from tirebench.page.live import LivePage, PageChoice
from tirebench.page.server import MOST_VIEWERS, STATIC
from tirelib.web.assets import CHARTS
from tirelib.web.connections import MOST_IDLE, Connection, least_needed

Answer = tuple[int, dict[str, str], bytes]


class Markers:
    """Stands for a recorder that is switched on."""

    bytes = 0

    def __init__(self) -> None:
        self.texts: list[str] = []

    @property
    def recorder(self) -> "Markers":
        return self

    name = "a.mcap"

    def event(self, event: Mapping[str, Any]) -> None:
        if event["event"] == "marker":
            self.texts.append(event["text"])

    def start(self) -> str:
        return "a.mcap"

    def stop(self) -> None: ...


class Served:
    """A page that runs, and what an attacker knows of it."""

    def __init__(self, page: LivePage, markers: Markers) -> None:
        self.page, self.markers = page, markers
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=(.+)", page.url)
        assert found is not None
        self.port, self.token = int(found[1]), found[2]
        self.host = f"127.0.0.1:{self.port}"
        self.cookie = f"tirebench-{self.port}={self.token}"
        self.good = {"Host": self.host, "Cookie": self.cookie}

    def ask(
        self, path: str, *, method: str = "GET", body: bytes | None = None, **headers: str
    ) -> Answer:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        if body is not None:
            connection.putheader("Content-Length", str(len(body)))
        connection.endheaders(body)
        answer = connection.getresponse()
        got = answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
        connection.close()
        return got

    def post(self, body: bytes, kind: str = "application/json", **headers: str) -> Answer:
        return self.ask("/command", method="POST", body=body, Content_Type=kind, **headers)

    def post_in_pieces(self, body: bytes) -> int:
        """Post without saying how long the body is."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        headers = self.good | {"Content-Type": "application/json"}
        pieces = iter([body[:100], body[100:]])
        connection.request("POST", "/command", pieces, headers, encode_chunked=True)
        status = connection.getresponse().status
        connection.close()
        return status

    def settle(self) -> None:
        """Let the run take commands that are on their way."""
        for _ in range(6):
            self.page.watch(News())
            time.sleep(0.06)

    @contextmanager
    def stream(self, **headers: str) -> Iterator[Any]:
        """Open a stream; host, origin and cookie are as given."""
        host = headers.pop("Host", self.host)
        origin: Any = headers.pop("Origin", None)
        connection = socket.create_connection(("127.0.0.1", self.port))
        with (
            connection,
            connect(
                f"ws://{host}/stream",
                additional_headers=headers,
                origin=origin,
                proxy=None,
                sock=connection,
                open_timeout=PATIENCE,
            ) as stream,
        ):
            yield stream


def wait_until_it_answers(served: Served) -> None:
    end = time.monotonic() + PATIENCE
    while True:
        try:
            status, _, _ = served.ask("/page.css", **served.good)
            assert status == 200
            return
        except OSError:
            assert time.monotonic() < end
            time.sleep(0.1)


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    markers = Markers()
    with LivePage(PageChoice().checked(), FakeSource(0), About("port"), markers) as page:
        served = Served(page, markers)
        wait_until_it_answers(served)
        yield served


def test_the_printed_address_gives_a_cookie_and_leaves_no_token_in_the_address(
    served: Served,
) -> None:
    status, headers, _ = served.ask(f"/?token={served.token}", Host=served.host)
    assert (status, headers["location"]) == (303, "/")
    cookie = headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    status, headers, body = served.ask("/", **served.good)
    assert status == 200
    assert served.token.encode() not in body
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert not re.search(rb"<script(?![^>]*src=)|<style|\son\w+=|\sstyle=|https?://", body)


def test_every_file_is_served_and_loads_nothing_from_elsewhere(served: Served) -> None:
    for path, name in (STATIC | CHARTS).items():
        status, _, body = served.ask(path, **served.good)
        assert status == 200, path
        if not name.startswith("uplot") and name.endswith((".js", ".css", ".html")):
            assert not re.search(rb"https://|//cdn|@import|eval\(|innerHTML", body), name


ATTACKS: dict[str, tuple[int, dict[str, Any]]] = {
    "no token": (403, {"Cookie": ""}),
    "a guessed token": (403, {"Cookie": "tirebench-{port}=abcdef"}),
    "the token of another port": (403, {"Cookie": "tirebench-1={token}"}),
    "a name that was rebound": (400, {"Host": "evil.example:{port}"}),
    "another port in the name": (400, {"Host": "127.0.0.1:1"}),
    "no port in the name": (400, {"Host": "127.0.0.1"}),
    "a page of another site": (403, {"Origin": "http://evil.example"}),
    "a page of another port": (403, {"Origin": "http://127.0.0.1:1"}),
    "a page without origin": (403, {"Origin": "null"}),
    "the same name over https": (403, {"Origin": "https://{host}"}),
    "a frame of another site": (403, {"Sec_Fetch_Site": "cross-site"}),
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_an_attack_is_refused_on_every_way_in(served: Served, attack: str) -> None:
    expected, changed = ATTACKS[attack]
    known = {"port": served.port, "token": served.token, "host": served.host}
    headers = served.good | {k: v.format(**known) for k, v in changed.items()}
    before = len(served.markers.texts)
    for path in ("/", "/page.js", "/stream", "/nowhere"):
        assert served.ask(path, **headers)[0] == expected, path
    assert served.post(b'{"command": "marker", "text": "evil"}', **headers)[0] == expected
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    with pytest.raises(InvalidStatus) as refused, served.stream(**named):
        pass
    assert refused.value.response.status_code == 403
    served.settle()
    assert len(served.markers.texts) == before


def test_a_token_in_the_address_opens_nothing_but_the_first_page(served: Served) -> None:
    for path in (f"/page.js?token={served.token}", f"/stream?token={served.token}"):
        assert served.ask(path, Host=served.host)[0] == 403
    query = f"/command?token={served.token}"
    assert served.ask(query, method="POST", body=b"{}", Host=served.host)[0] == 403
    rebound = served.ask(f"/?token={served.token}", Host=f"evil.example:{served.port}")
    assert rebound[0] == 400
    assert "set-cookie" not in rebound[1]


@pytest.mark.parametrize(
    "path",
    [
        "/../page.py",
        "/static/../server.py",
        "/..%2f..%2fpyproject.toml",
        "/%2e%2e/server.py",
        "//etc/passwd",
        "/page.js/../../server.py",
        "/page.js%00.py",
        "/..\\server.py",
        "/server.py",
    ],
)
def test_no_path_leads_to_a_file_that_is_not_of_the_page(served: Served, path: str) -> None:
    status, _, body = served.ask(path, **served.good)
    assert status == 404
    assert b"import" not in body
    assert b"root:" not in body


def test_only_a_post_of_json_changes_anything(served: Served) -> None:
    good = b'{"command": "marker", "text": "now"}'
    before = len(served.markers.texts)
    for method in ("GET", "HEAD", "PUT", "DELETE", "OPTIONS"):
        assert served.ask("/command", method=method, **served.good)[0] == 405, method
    assert served.post(good, kind="text/plain", **served.good)[0] == 415
    assert served.post(b"no json", **served.good)[0] == 400
    assert served.post(b'{"command": "stop"}', **served.good)[0] == 400
    assert served.post(b"[" * 4000, **served.good)[0] == 400
    assert served.post(b" " * 5000 + good, **served.good)[0] == 413
    assert served.post_in_pieces(b" " * 5000 + good) == 413
    served.settle()
    assert len(served.markers.texts) == before
    origin = f"http://{served.host}"
    assert served.post(good, Origin=origin, **served.good)[0] == 202
    served.settle()
    assert served.markers.texts[before:] == ["now"]


def test_a_viewer_that_talks_nonsense_is_served_on_and_one_too_many_is_sent_away(
    served: Served,
) -> None:
    with ExitStack() as stack:
        first, *_ = [
            stack.enter_context(served.stream(Cookie=served.cookie)) for _ in range(MOST_VIEWERS)
        ]
        for text in ("nonsense", "[]", '{"wheel": "x"}', '{"wheel": 1e9}', "[" * 200):
            first.send(text)
        served.settle()
        assert b'"link": "port"' in first.recv(PATIENCE)
        with pytest.raises(InvalidStatus), served.stream(Cookie=served.cookie):
            pass


def closed(one: socket.socket) -> bool:
    """Tell whether the other end has closed a connection."""
    try:
        return not one.recv(1)
    except (BlockingIOError, TimeoutError):
        return False
    except ConnectionError:
        return True


def test_connections_that_say_nothing_keep_nobody_from_the_page(served: Served) -> None:
    """Some say nothing at all, some never end their request, some have been refused."""
    begun = f"GET /page.js HTTP/1.1\r\nHost: {served.host}\r\n".encode()
    said = [b"", begun, begun + b"\r\n"]
    with ExitStack() as stack:
        stream = stack.enter_context(served.stream(Cookie=served.cookie))
        held = []
        for number in range(150):
            one = stack.enter_context(socket.create_connection(("127.0.0.1", served.port)))
            one.sendall(said[number % 3])
            held.append(one)
        for path in STATIC:
            assert served.ask(path, **served.good)[0] == 200, path
        served.settle()
        assert b'"link": "port"' in stream.recv(PATIENCE)
        for one in held:
            one.setblocking(False)
        wait_until(lambda: sum(closed(one) for one in held[::3]) >= 50 - MOST_IDLE)


@pytest.mark.parametrize("asked", [False, True])
def test_a_connection_without_a_request_ends(asked: bool) -> None:
    ended: list[str] = []
    transport = SimpleNamespace(abort=lambda: ended.append("ended"))
    one = SimpleNamespace(cycle=object() if asked else None, transport=transport)
    one.connections = [one]
    Connection._has_asked(one)
    assert ended == ([] if asked else ["ended"])


def test_of_idle_connections_the_oldest_of_who_has_most_gives_way() -> None:
    idle = [
        SimpleNamespace(client=(peer, n), opened=age)
        for n, (peer, age) in enumerate(
            [("10.0.0.1", 0.0), ("10.0.0.2", 3.0), ("10.0.0.2", 1.0), ("10.0.0.2", 2.0)]
        )
    ]
    assert least_needed(idle) is idle[2]


def test_a_page_that_is_killed_comes_back_at_the_same_address_and_is_counted(
    served: Served,
) -> None:
    starts, process = served.page.starts, served.page.process_id
    assert process is not None
    os.kill(process, signal.SIGKILL)
    end = time.monotonic() + PATIENCE
    while served.page.starts == starts and time.monotonic() < end:  # the run goes on meanwhile
        served.page.watch(News())
        time.sleep(0.01)
    wait_until_it_answers(served)
    assert served.page.starts == starts + 1
    with served.stream(Cookie=served.cookie) as stream:
        served.settle()
        message = stream.recv(PATIENCE)
    header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
    assert header["page"]["starts"] == starts + 1
    assert served.post(b'{"command": "marker", "text": "again"}', **served.good)[0] == 202
    served.settle()
    assert served.markers.texts[-1] == "again"


def test_a_run_that_is_killed_leaves_no_page_behind() -> None:
    run = subprocess.Popen([sys.executable, "-c", A_RUN], stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    page = int(run.stdout.readline())
    run.kill()
    run.wait()
    run.stdout.close()
    end = time.monotonic() + PATIENCE
    while _state_of(page) not in ("", "Z") and time.monotonic() < end:
        time.sleep(0.1)
    assert _state_of(page) in ("", "Z")


A_RUN = """
import time
from tirebench.page.feed import About
from tirebench.page.live import LivePage, PageChoice
from tests.bench.in_process import FakeSource
with LivePage(PageChoice(), FakeSource(), About("port"), None) as page:
    print(page.process_id, flush=True)
    time.sleep(60)
"""


def _state_of(process: int) -> str:
    """Return the letter of a process's state; empty if it is gone."""
    try:
        return (Path("/proc") / str(process) / "stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return ""
