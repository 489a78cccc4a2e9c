"""Files of a page, served from memory: no path that a viewer sends reaches the disk."""

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

KINDS = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
    "txt": "text/plain; charset=utf-8",
}
"""Media type of a file by the end of its name."""
CHARTS = {"/uplot.min.js": "uplot.min.js", "/uplot.min.css": "uplot.min.css"}
"""Addresses of the chart library, which all pages share (uPlot, MIT licence)."""


def file_routes(package: str, names: Mapping[str, str]) -> list[Route]:
    """Return the routes of a package's static files and of the chart library.

    Parameters
    ----------
    package : str
        Its folder `static` holds the files.
    names : mapping of address to file name
    """
    routes = []
    for source, table in ((package, names), ("tirelib.web", CHARTS)):
        folder = files(source) / "static"
        for path, name in table.items():
            send = _file((folder / name).read_bytes(), KINDS[name.rpartition(".")[2]])
            routes.append(Route(path, send, methods=["GET"]))
    return routes


def _file(data: bytes, kind: str) -> Any:
    async def send(_: Request) -> Response:
        return Response(data, media_type=kind)

    return send
