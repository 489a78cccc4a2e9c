"""The live page as the run sees it: one context manager, called after each read."""

import ipaddress
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

from bench.chain import Turn
from bench.errors import DeviceError
from bench.page.board import Board
from bench.page.commands import CommandDesk, Switch
from bench.page.feed import About, Feed, WatchedLink
from bench.page.guard import bracketed
from bench.page.process import Keeper, listener, new_token
from bench.wheels import Wheels

LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class PageChoice:
    """What the user wants to see.

    Attributes
    ----------
    page, terminal : bool
        In the browser; in the terminal.
    host : str
        Address that the page is bound to.
    port : int
        0 for any.
    network : bool
        Whether other machines may be let in.
    """

    page: bool = True
    terminal: bool = False
    host: str = LOOPBACK
    port: int = 0
    network: bool = False

    def checked(self) -> "PageChoice":
        """Return the choice with an address for a host.

        Raises
        ------
        DeviceError
            If the host is no address, or lets others in without being asked to.
        """
        host = LOOPBACK if self.host == "localhost" else self.host.strip("[]")
        try:
            address = ipaddress.ip_address(host)
        except ValueError:
            raise DeviceError(
                f"--host {self.host}: an address of this machine is needed, such as {LOOPBACK} or "
                "192.0.2.7; write one"
            ) from None
        if not (address.is_loopback or self.network):
            raise DeviceError(
                f"--host {self.host}: other machines could open the page, over a line that is not "
                f"encrypted; {LOOPBACK} is allowed by itself; add --network to let them in"
            )
        return PageChoice(self.page, self.terminal, host, self.port, self.network)

    @property
    def open_to_others(self) -> bool:
        """Whether machines other than this one can reach the page."""
        return self.page and not ipaddress.ip_address(self.host).is_loopback


class LivePage:
    """A board, what writes to it, and the processes that show it.

    Parameters
    ----------
    choice : PageChoice
        Checked.
    wheels : Wheels
    link : WatchedLink
    about : About
    switch : Switch or None
        What a record button turns on and off; None if there is nothing to record.

    Attributes
    ----------
    url : str
        With the token; empty without a page in the browser.
    """

    def __init__(
        self,
        choice: PageChoice,
        wheels: Wheels,
        link: WatchedLink,
        about: About,
        switch: Switch | None,
    ) -> None:
        self.url = ""
        self.desk = CommandDesk(switch)
        self._choice = choice
        self._stack = ExitStack()
        self._keepers: list[Keeper] = []
        self._board = self._stack.enter_context(Board())
        self.feed = Feed(self._board, wheels, link, about, self._state)

    def __enter__(self) -> "LivePage":
        try:
            if self._choice.page:
                self._open_page()
            if self._choice.terminal:
                self._open_terminal()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.close()

    def watch(self, turns: Sequence[Turn], messages: Sequence[str] = ()) -> None:
        """Show what a read has brought and take commands; called after each read."""
        self.feed.watch(turns, messages)
        self.desk.poll()

    def end(self, reason: str) -> None:
        """Say that the run has ended, and leave viewers the time to hear it."""
        self.feed.end(reason)
        time.sleep(0.3)

    @property
    def starts(self) -> int:
        """How often the page's process has been started."""
        return sum(keeper.starts for keeper in self._keepers)

    @property
    def process_id(self) -> int | None:
        """Of the first process that shows the board."""
        return self._keepers[0].process_id if self._keepers else None

    def _state(self) -> dict[str, Any]:
        return self.desk.state()

    def _open_page(self) -> None:
        from bench.page.server import PagePlan, serve

        choice, token = self._choice, new_token()
        opened = self._stack.enter_context(listener(choice.host, choice.port))
        port = opened.getsockname()[1]
        shown = socket.gethostname() if _unspecified(choice.host) else bracketed(choice.host)
        self.url = (
            f"http://{LOOPBACK if _unspecified(choice.host) else shown}:{port}/?token={token}"
        )

        def arguments(starts: int, pipe: Connection) -> tuple[Any, ...]:
            return PagePlan(self._board.name, token, choice.host, port, starts), opened, pipe

        self._keep(serve, arguments, self.desk.listen)

    def _open_terminal(self) -> None:
        from bench.page.terminal import show

        def arguments(starts: int, pipe: Connection) -> tuple[Any, ...]:
            return self._board.name, starts

        self._keep(show, arguments, Connection.close)

    def _keep(
        self,
        target: Callable[..., None],
        arguments: Callable[[int, Connection], tuple[Any, ...]],
        listen: Callable[[Connection], None],
    ) -> None:
        keeper = Keeper(self._board, target, arguments, listen)
        self._keepers.append(self._stack.enter_context(keeper))


def _unspecified(host: str) -> bool:
    return ipaddress.ip_address(host).is_unspecified
