"""The server of the studio: Starlette and uvicorn on a socket of this machine."""

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from tirelib.core.errors import FormatError, ParameterError, TirelibError
from tirelib.studio import intake, state
from tirelib.studio.desk import Desk
from tirelib.studio.pack import packed
from tirelib.studio.session import QUANTITIES
from tirelib.web.assets import file_routes
from tirelib.web.connections import server_config
from tirelib.web.guard import Guard

TICK = 0.05
"""Time between two looks at the jobs, [s]."""
LONGEST_WISH = 1 << 18
"""Bytes of a wish; a map of a file with many columns is the longest."""
MOST_VIEWERS = 32
SCRIPTS = (
    *("studio", "data", "dom", "plots", "heat", "maps"),
    *("open", "import", "see", "suspect", "next", "effect", "add", "compare", "take", "own"),
)
STATIC = {"/": "index.html", "/my_effect.py": "my_effect.py.txt"} | {
    f"/{name}": name for name in ("studio.css", "icon.svg", *(f"{name}.js" for name in SCRIPTS))
}
"""Every address of a file, and its name."""
JSON_DOCUMENTS = ("comparison", "diagnosis", "next-test")
ARRAYS = ("plots", "traces", "planted")


class Studio:
    """The application.

    Parameters
    ----------
    desk : Desk
    token, host : str
    port : int
    first : str
        Campaign that the page shows first; empty for the list.
    """

    def __init__(self, desk: Desk, token: str, host: str, port: int, first: str = "") -> None:
        self.desk, self.first = desk, first
        self.changed = 0
        self._new = asyncio.Event()
        self._viewers = 0
        self._guarded = {"token": token, "host": host, "port": port, "command": "tirelib studio"}

    def app(self) -> Starlette:
        """Return the application, guarded."""
        get, post = ["GET"], ["POST"]
        routes: list[Route | WebSocketRoute] = [
            *file_routes("tirelib.studio", STATIC),
            Route("/home", self._told(self._home), methods=get),
            Route("/campaign", self._told(self._campaign), methods=get),
            Route("/document", self._told(self._document), methods=get),
            Route("/arrays", self._told(self._arrays), methods=get),
            Route("/taken", self._told(self._taken), methods=get),
            Route("/browse", self._told(self._browse), methods=get),
            Route("/import-form", self._told(self._import_form), methods=get),
            Route("/do", self._told(self._do), methods=post),
            Route("/upload", self._told(self._upload), methods=post),
            WebSocketRoute("/news", self._news),
        ]
        bodies = {"/do": LONGEST_WISH, "/upload": intake.MOST_BYTES}
        guard = Middleware(Guard, **self._guarded, bodies=bodies)  # type: ignore[arg-type]
        return Starlette(routes=routes, middleware=[guard], lifespan=self._lifespan)

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self.desk.jobs.warm()
        task = asyncio.create_task(self._watch())
        yield
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        self.desk.jobs.close()

    async def _watch(self) -> None:
        """Look at the jobs at every tick."""
        while True:
            just_now, begun, news = self.desk.jobs.look()
            ended = [*just_now, *self.desk.released()]
            for job in ended:
                try:
                    self.desk.ended(job)
                except (TirelibError, OSError) as error:
                    job.state, job.message = "failed", f"its results cannot be kept: {error}"
            first = False
            with suppress(TirelibError, OSError):  # else its comparison comes with the whole fit
                first = self.desk.first_fits()
            if changed := bool(ended) or begun or first:
                self.changed += 1
            if news or changed:
                self.wake()
            await asyncio.sleep(TICK)

    def wake(self) -> None:
        """Tell the viewers that there is news."""
        self._new.set()
        self._new = asyncio.Event()

    def _told(
        self, answer: Callable[[Request], Awaitable[Response]]
    ) -> Callable[[Request], Awaitable[Response]]:
        """Return an endpoint that says in words what cannot be done."""

        async def endpoint(request: Request) -> Response:
            try:
                return await answer(request)
            except TirelibError as error:
                return JSONResponse({"error": str(error)}, 400)
            except OSError as error:
                said = f"{error.filename}: {error.strerror}; choose another place"
                return JSONResponse({"error": said}, 400)

        return endpoint

    async def _home(self, _: Request) -> Response:
        return JSONResponse(state.home(self.desk) | {"first": self.first})

    async def _campaign(self, request: Request) -> Response:
        opened = self.desk.session.campaign(request.query_params.get("campaign", ""))
        return JSONResponse(state.campaign(self.desk, opened))

    async def _document(self, request: Request) -> Response:
        """Send a document as the command has written it."""
        asked = request.query_params
        opened = self.desk.session.campaign(asked.get("campaign", ""))
        if asked.get("name") == "show":
            return _file(opened.place / "show.json")
        model = opened.model(asked.get("model", ""))
        if asked.get("name") == "fit":
            return _file(model.place / "fit.json")
        name = _one(asked, "name", JSON_DOCUMENTS)
        return _file(model.document(f"{name}.json", _one(asked, "quantity", QUANTITIES)))

    async def _arrays(self, request: Request) -> Response:
        asked = request.query_params
        opened = self.desk.session.campaign(asked.get("campaign", ""))
        if asked.get("name") == "measured":
            file = opened.place / "measured.npz"
        else:
            name, quantity = _one(asked, "name", ARRAYS), _one(asked, "quantity", QUANTITIES)
            file = opened.model(asked.get("model", "")).document(f"{name}.npz", quantity)
        data = await asyncio.to_thread(packed, file)
        return Response(data, media_type="application/octet-stream")

    async def _taken(self, request: Request) -> Response:
        """Send a file to take away."""
        asked = request.query_params
        opened = self.desk.session.campaign(asked.get("campaign", ""))
        model = opened.model(asked.get("model", ""))
        what = asked.get("what", "")
        if what == "model":
            return _file(model.file, f"{opened.told['title']}-M{model.number}.toml")
        if what == "commands":
            lines = state.commands(self.desk, opened, model.number)
            if asked.get("plain"):
                return PlainTextResponse("\n".join(lines) + "\n")
            return JSONResponse({"commands": lines})
        if what == "report":
            return _file(model.place / "taken" / "report" / "index.html", "report.html")
        if what == "fmu":
            return _file(model.place / "taken" / "StrainTire.fmu", "StrainTire.fmu")
        raise ParameterError(f"{what!r}: allowed are model, commands, report, fmu")

    async def _browse(self, request: Request) -> Response:
        path = request.query_params.get("path", "")
        return JSONResponse(await asyncio.to_thread(intake.browse, path, self.desk.roots))

    async def _import_form(self, request: Request) -> Response:
        return JSONResponse(self.desk.receiving.import_form(request.query_params.get("files", "")))

    async def _do(self, request: Request) -> Response:
        kind = request.headers.get("content-type", "").partition(";")[0]
        if kind != "application/json":
            return JSONResponse({"error": "JSON is needed"}, 415)
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > LONGEST_WISH:
                return JSONResponse({"error": "the request is too long"}, 413)
        try:
            wish = json.loads(body)
        except (ValueError, RecursionError):
            return JSONResponse({"error": "the request is no JSON"}, 400)
        if not isinstance(wish, dict):
            return JSONResponse({"error": "an object is needed"}, 400)
        try:
            if wish.get("do") == "dropped":
                await asyncio.to_thread(self.desk.receiving.unpack, str(wish.get("files", "")))
            done = self.desk.do(wish)
        except TirelibError:
            raise  # it says what to do
        except (TypeError, ValueError, AttributeError) as error:
            return JSONResponse({"error": f"the request is not understood ({error})"}, 400)
        finally:
            self.changed += 1
            self.wake()
        return JSONResponse(done)

    async def _upload(self, request: Request) -> Response:
        """Take one dropped file; its name is made safe, its size is limited while it comes."""
        asked = request.query_params
        name = intake.relative(asked.get("name", ""))
        number = asked.get("files", "")
        place = self.desk.receiving.files(number) if number else self.desk.session.new_files()
        if sum(1 for _ in place.rglob("*")) > intake.MOST_FILES:
            raise FormatError(f"more than {intake.MOST_FILES} files were dropped; drop fewer")
        target = place / name
        target.parent.mkdir(parents=True, exist_ok=True)
        size = sum(p.stat().st_size for p in place.rglob("*") if p.is_file())
        with target.open("wb") as stream:
            async for part in request.stream():
                size += len(part)
                if size > intake.MOST_BYTES:
                    stream.close()
                    target.unlink()
                    return JSONResponse({"error": "the files are too large"}, 413)
                await asyncio.to_thread(stream.write, part)
        return JSONResponse({"files": place.name})

    async def _news(self, viewer: WebSocket) -> None:
        """Tell a viewer what has changed and how far the jobs are, at most once a tick."""
        if self._viewers >= MOST_VIEWERS:
            await viewer.close(1013)
            return
        await viewer.accept()
        self._viewers += 1
        sending = asyncio.create_task(self._send(viewer))
        try:
            while True:
                await viewer.receive_text()
        except (WebSocketDisconnect, RuntimeError, KeyError):
            return
        finally:
            sending.cancel()
            self._viewers -= 1

    async def _send(self, viewer: WebSocket) -> None:
        while True:
            news = self._new
            message = {"changed": self.changed, "running": state.progress(self.desk)}
            try:
                await viewer.send_text(json.dumps(message))
            except (WebSocketDisconnect, RuntimeError):
                return
            await asyncio.sleep(TICK)
            await news.wait()


def server_of(studio: Studio) -> uvicorn.Server:
    """Return the server of an application; it is to be given a bound socket."""
    return uvicorn.Server(
        server_config(studio.app(), longest_message=1024, timeout_graceful_shutdown=2)
    )


def serve(studio: Studio, listener: socket.socket) -> None:
    """Serve until the process is asked to end."""
    asyncio.run(server_of(studio).serve([listener]))


def _one(asked: Mapping[str, str], key: str, allowed: tuple[str, ...]) -> str:
    value = asked.get(key, "")
    if value not in allowed:
        raise ParameterError(f"{key} {value!r}: allowed are {', '.join(allowed)}")
    return value


def _file(path: Path, name: str = "") -> Response:
    """Send a file of the session; with a name, as one to be kept."""
    if not path.is_file():
        raise FormatError(f"{path.name}: it has not been computed yet; wait for the job")
    return FileResponse(path, filename=name or None)
