"""The page's process: Starlette and uvicorn on a socket that the run has bound.

Every route is fixed and every file is in memory; no path that a viewer sends reaches the disk.
"""

import asyncio
import json
import os
import signal
import socket
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from multiprocessing import parent_process
from multiprocessing.connection import Connection
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from tirebench.errors import DeviceError
from tirebench.live.board import Board
from tirebench.live.priority import below
from tirebench.page.commands import parse_command
from tirebench.page.history import History, Viewer
from tirelib.web.assets import file_routes
from tirelib.web.connections import server_config
from tirelib.web.guard import LONGEST_BODY, Guard

TICK = 0.05
"""Time between two messages to a viewer at least, [s]."""
MOST_VIEWERS = 16
STATIC = {
    "/": "index.html",
    "/page.css": "page.css",
    "/page.js": "page.js",
    "/all.js": "all.js",
    "/format.js": "format.js",
    "/gages.js": "gages.js",
    "/panels.js": "panels.js",
    "/charts.js": "charts.js",
    "/shape.js": "shape.js",
    "/icon.svg": "icon.svg",
}
"""Every address of a file of this page, and its name."""


@dataclass(frozen=True, slots=True)
class PagePlan:
    """What the page's process needs to know.

    Attributes
    ----------
    board : str
        Name of the shared memory.
    token, host : str
    port : int
    starts : int
        How often the process has been started, this time included.
    """

    board: str
    token: str
    host: str
    port: int
    starts: int = 1


class Page:
    """The application: what is read from the board, and who looks at it."""

    def __init__(self, plan: PagePlan, board: Board, pipe: Connection) -> None:
        self._plan = plan
        self._board = board
        self._pipe = pipe
        self._history = History(board)
        self._viewers: set[Viewer] = set()
        self._skipped = 0  # by viewers that have left
        self._new = asyncio.Event()

    def app(self) -> Starlette:
        """Return the application, guarded."""
        routes: list[Route | WebSocketRoute] = [*file_routes("tirebench.page", STATIC)]
        routes.append(Route("/command", self._command, methods=["POST"]))
        routes.append(WebSocketRoute("/stream", self._stream))
        plan = self._plan
        guard = Middleware(
            Guard, token=plan.token, host=plan.host, port=plan.port, command="tirebench run"
        )
        return Starlette(routes=routes, middleware=[guard], lifespan=self._lifespan)

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        task = asyncio.create_task(self._read_board())
        yield
        task.cancel()

    async def _read_board(self) -> None:
        """Read the board at every tick; end the process when the run is gone."""
        parent = parent_process()
        ticks = 0
        while True:
            self._board.beat()
            if self._history.update():
                self._new.set()
                self._new = asyncio.Event()
            ticks += 1
            if ticks % 20 == 0 and parent is not None and not parent.is_alive():
                signal.raise_signal(signal.SIGTERM)
            await asyncio.sleep(TICK)

    async def _command(self, request: Request) -> Response:
        """Hand a viewer's wish to the run."""
        kind = request.headers.get("content-type", "").partition(";")[0]
        if kind != "application/json":
            return JSONResponse({"error": "JSON is needed"}, 415)
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > LONGEST_BODY:
                return JSONResponse({"error": "too long"}, 413)
        try:
            command = parse_command(json.loads(body))
        except (DeviceError, ValueError, RecursionError) as error:
            return JSONResponse({"error": str(error)}, 400)
        try:
            self._pipe.send_bytes(command.pack())
        except OSError:
            return JSONResponse({"error": "the run no longer accepts commands"}, 503)
        return JSONResponse({"accepted": command.kind}, 202)

    async def _stream(self, socket: WebSocket) -> None:
        if len(self._viewers) >= MOST_VIEWERS:
            await socket.close(1013)
            return
        await socket.accept()
        viewer = Viewer()
        self._viewers.add(viewer)
        sending = asyncio.create_task(self._send(socket, viewer))
        try:
            while True:
                _choose(viewer, await socket.receive_text())
                self._new.set()
        except (WebSocketDisconnect, RuntimeError, KeyError):
            return
        finally:
            sending.cancel()
            self._viewers.discard(viewer)
            self._skipped += viewer.skipped

    async def _send(self, socket: WebSocket, viewer: Viewer) -> None:
        """Send what is new, at most once a tick; a slow viewer skips what it has no time for."""
        clock = asyncio.get_running_loop().time
        while True:
            start = clock()
            news = self._new  # before looking, so that what comes meanwhile is not slept through
            message = viewer.message(self._history, self._about())
            if message is not None:
                try:
                    await socket.send_bytes(message)
                except (WebSocketDisconnect, RuntimeError):
                    return
            took = clock() - start
            viewer.skipped += int(took / TICK)
            await asyncio.sleep(max(TICK - took, 0.001))
            if message is None:
                await news.wait()

    def _about(self) -> dict[str, Any]:
        skipped = self._skipped + sum(viewer.skipped for viewer in self._viewers)
        return {
            "starts": self._plan.starts,
            "viewers": len(self._viewers),
            "missed": self._history.missed,
            "skipped_all": skipped,
        }


class _Server(uvicorn.Server):
    """A server that leaves signals alone: the run decides when it ends."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Capture none."""
        yield


def serve(plan: PagePlan, listener: socket.socket, pipe: Connection) -> None:
    """Run the page until the run ends; the target of the page's process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    below()
    board = Board(plan.board)
    if os.name == "posix":
        os.set_blocking(pipe.fileno(), False)  # a run that does not ask may not stop the page
    config = server_config(Page(plan, board, pipe).app(), longest_message=256)
    asyncio.run(_Server(config).serve([listener]))


def _choose(viewer: Viewer, text: str) -> None:
    """Note which wheel a viewer looks at; anything else is not listened to."""
    try:
        wheel = json.loads(text)["wheel"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return
    if isinstance(wheel, int) and 0 <= wheel <= 255:
        viewer.wheel = wheel
