"""Who may see the page: one middleware for HTTP and WebSocket.

A request passes only with the server's token (in a cookie, or once in the address), under a name
of this machine that was asked for, and from a page of this origin. That stops other sites in the
same browser (cross-site requests, WebSockets, a rebound name) and other users of the machine.
"""

import ipaddress
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LONGEST_BODY = 4096
"""Bytes of a request's body, where a page does not allow more."""
_REFUSED = {
    "host": (400, "the page answers only at the address that `{command}` printed"),
    "origin": (403, "the request comes from another page"),
    "token": (403, "the token is missing or wrong: open the address that `{command}` printed"),
    "length": (413, "the request holds more bytes than allowed"),
}


class Guard:
    """Refuse what does not belong to this server's page.

    Parameters
    ----------
    app : ASGI application
    token : str
    host : str
        Address that the server is bound to.
    port : int
    command : str
        Command that printed the address, as the user typed it; its first word names the cookie.
    bodies : mapping of path to int
        Bytes that a request to a path may hold, where that is not `LONGEST_BODY`.
    """

    def __init__(
        self,
        app: ASGIApp,
        token: str,
        host: str,
        port: int,
        command: str,
        bodies: Mapping[str, int] | None = None,
    ) -> None:
        self._app = app
        self._token = token.encode()
        self._port = port
        self._command = command
        self._bodies = dict(bodies or {})
        self._cookie = cookie_name(command.split()[0], port)
        self._any_address = ipaddress.ip_address(host).is_unspecified
        self._names = {"127.0.0.1", "localhost", "[::1]", bracketed(host)}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
        first = scope["type"] == "http" and scope["path"] == "/" and self._good(given)
        fault = self._fault(headers, host, first, scope.get("path", ""))
        if fault:
            await self._refuse(scope, receive, send, fault)
        elif first:
            await self._welcome(scope, receive, _secured(send, host))
        elif scope["type"] == "http":
            await self._app(scope, receive, _secured(send, host))
        else:
            await self._app(scope, receive, send)

    def _fault(self, headers: Headers, host: str, first: bool, path: str) -> str:
        if len(headers.getlist("host")) != 1 or not self._known(host):
            return "host"
        origins = headers.getlist("origin")
        if any(origin != f"http://{host}" for origin in origins):
            return "origin"
        if headers.get("sec-fetch-site") == "cross-site" and not first:
            return "origin"
        if not first and not self._good(self._in_cookie(headers)):
            return "token"
        length = headers.get("content-length", "0")
        if not length.isdecimal() or int(length) > self._bodies.get(path, LONGEST_BODY):
            return "length"
        return ""

    def _known(self, host: str) -> bool:
        name, colon, port = host.rpartition(":")
        if not colon or port != str(self._port):
            return False
        if name in self._names:
            return True
        if not self._any_address:
            return False
        try:  # a number cannot be rebound to another machine, a name can
            ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return False
        return True

    def _good(self, given: str) -> bool:
        return secrets.compare_digest(given.encode("utf-8", "replace"), self._token)

    def _in_cookie(self, headers: Headers) -> str:
        try:
            morsel = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        except CookieError:
            return ""
        return "" if morsel is None else morsel.value

    async def _welcome(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Put the token into a cookie and out of the address."""
        response = RedirectResponse("/", 303)
        response.set_cookie(
            self._cookie, self._token.decode(), httponly=True, samesite="strict", path="/"
        )
        await response(scope, receive, send)

    async def _refuse(self, scope: Scope, receive: Receive, send: Send, fault: str) -> None:
        status, text = _REFUSED[fault]
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
            return
        response = PlainTextResponse(f"{text.format(command=self._command)}\n", status)
        await response(scope, receive, _secured(send, ""))


def cookie_name(program: str, port: int) -> str:
    """Return the name of the cookie: cookies know no ports, so it is in the name."""
    return f"{program}-{port}"


def bracketed(host: str) -> str:
    """Return an address as it stands in a URL."""
    return f"[{host}]" if ":" in host else host


def _secured(send: Send, host: str) -> Send:
    """Add the headers that keep a browser from loading or showing anything else."""
    socket = f" ws://{host}" if host else ""
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        f"connect-src 'self'{socket}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers["content-security-policy"] = policy
            headers["x-content-type-options"] = "nosniff"
            headers["x-frame-options"] = "DENY"
            headers["referrer-policy"] = "no-referrer"
            headers["cross-origin-opener-policy"] = "same-origin"
            headers["cross-origin-resource-policy"] = "same-origin"
            headers["cache-control"] = "no-store"
        await send(message)

    return sending
