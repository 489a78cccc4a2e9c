"""Idle connections are closed, so that a client with many of them cannot block the page."""

import asyncio
from collections import Counter
from collections.abc import Iterable
from operator import attrgetter
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

MOST_IDLE = 32
"""Connections without a request that are kept open; a browser holds up to six."""
SILENCE = 10.0
"""A new connection gets so long for its first request, [s]."""


class Connection(H11Protocol):
    """HTTP as of uvicorn, with an end for connections that are too slow with their first request.

    When too many are idle, the oldest of the peer that has most of them is closed.
    """

    cycle: Any  # the request that is answered; None before the first

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a new connection, and close another one for it where there are too many."""
        super().connection_made(transport)
        self.opened = self.loop.time()
        self.loop.call_later(SILENCE, self._has_asked)
        idle = [one for one in self.connections if isinstance(one, Connection) and one.idle]
        if len(idle) > MOST_IDLE:
            self.connections.discard(spare := least_needed(idle))
            spare.transport.abort()

    @property
    def idle(self) -> bool:
        """Whether no request is being answered."""
        return self.cycle is None or self.cycle.response_complete

    def _has_asked(self) -> None:
        """Close the connection if nothing was asked yet; a stream is another protocol's by now."""
        if self.cycle is None and self in self.connections:
            self.transport.abort()


def server_config(app: Any, *, longest_message: int, **more: Any) -> uvicorn.Config:
    """Return how a page of this machine is served: quietly, with bounds on what clients may cost.

    Parameters
    ----------
    app : ASGI application
    longest_message : int
        Bytes of a message from a viewer's stream; a longer one ends the stream.
    more
        Further settings of `uvicorn.Config`.
    """
    return uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        server_header=False,
        http=Connection,
        ws="websockets-sansio",
        ws_max_size=longest_message,
        ws_per_message_deflate=False,
        proxy_headers=False,
        lifespan="on",
        limit_concurrency=128,
        timeout_keep_alive=5,
        **more,
    )


def least_needed(idle: Iterable[Any]) -> Any:
    """Return the oldest connection of the peer that holds most of them."""
    idle = list(idle)
    count = Counter(_peer(one) for one in idle)
    most = max(count.values())
    return min((one for one in idle if count[_peer(one)] == most), key=attrgetter("opened"))


def _peer(one: Any) -> str:
    return one.client[0] if one.client else ""
