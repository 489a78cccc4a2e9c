"""The live page as the run sees it: one context manager, called with the news."""

import ipaddress
import socket
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

from tirebench.errors import DeviceError, LinkError
from tirebench.estimator.estimation import News
from tirebench.estimator.session import Source
from tirebench.live.board import Board
from tirebench.live.supervised import CONTEXT, Supervised
from tirebench.page.alarms import RULES, Rule
from tirebench.page.commands import CommandDesk, Switch
from tirebench.page.feed import About, Feed
from tirebench.page.gages import GageSetup
from tirelib.web.address import listener, new_token
from tirelib.web.guard import bracketed

LOOPBACK = "127.0.0.1"
HANGS = 60.0
"""A page without a sign of life for so long is ended and started again, [s]: a page that has been
given no time on a busy machine is silent too."""
STARTS = 300.0
"""One that starts may be silent for so long more, [s]."""
LOOK = 0.05
"""Time between two looks after the page's process, [s]."""


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
                "192.0.2.7; correct it"
            ) from None
        if not (address.is_loopback or self.network):
            raise DeviceError(
                f"--host {self.host}: other machines could open the page over an unencrypted "
                f"connection; {LOOPBACK} needs no permission; add --network to allow other machines"
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
    source : Source
    about : About
    switch : Switch or None
        What a record button turns on and off; None if there is nothing to record.
    rules : mapping of name to Rule
        Limits of the alarms.

    Attributes
    ----------
    url : str
        With the token; empty without a page in the browser.
    """

    def __init__(
        self,
        choice: PageChoice,
        source: Source,
        about: About,
        switch: Switch | None,
        rules: Mapping[str, Rule] = RULES,
    ) -> None:
        self.url = ""
        self._gages = GageSetup(source, about.folder)
        self.desk = CommandDesk(switch, self._gages if source.live else None)
        self._choice = choice
        self._stack = ExitStack()
        self._kept: list[Supervised] = []
        self._next_look = 0.0
        self._writing: Connection | None = None
        self._source = source
        self._board = self._stack.enter_context(Board())
        self.feed = Feed(self._board, source, about, self._state, rules, self.desk.note)

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

    def watch(self, news: News, unwritten: str = "") -> None:
        """Show what is new, take commands and look after the page; called again and again.

        `unwritten` says why turns cannot be written at the moment; empty if they can.
        """
        self._gages.watch(news.levels)
        self.feed.watch(news, unwritten)
        self.desk.poll()
        now = time.monotonic()
        if now >= self._next_look:
            self._next_look = now + LOOK
            for kept in self._kept:
                kept.look()

    def end(self, reason: str) -> None:
        """Say that the run has ended, and leave viewers the time to hear it."""
        self.feed.end(reason)
        time.sleep(0.3)

    @property
    def cpu_time(self) -> float:
        """Time that the process that shows the board has used, [s]."""
        return self._board.cpu_time

    @property
    def starts(self) -> int:
        """How often the page's process has been started."""
        return sum(kept.starts for kept in self._kept)

    @property
    def process_id(self) -> int | None:
        """Process id of the first process that shows the board."""
        return self._kept[0].process_id if self._kept else None

    def _state(self) -> dict[str, Any]:
        return {**self.desk.state(), "gages": self._gages.state(), "chain": self._source.counts()}

    def _open_page(self) -> None:
        from tirebench.page.server import PagePlan, serve

        choice, token = self._choice, new_token()
        opened = self._stack.enter_context(_bound(choice))
        port = opened.getsockname()[1]
        shown = socket.gethostname() if _unspecified(choice.host) else bracketed(choice.host)
        self.url = (
            f"http://{LOOPBACK if _unspecified(choice.host) else shown}:{port}/?token={token}"
        )

        def arguments(starts: int) -> tuple[Any, ...]:
            reading, writing = CONTEXT.Pipe(duplex=False)
            self._listen(reading, writing)
            self._board.beat(STARTS)
            plan = PagePlan(self._board.name, token, choice.host, port, starts)
            return plan, opened, writing

        self._keep(serve, arguments)
        self._stack.callback(self._hang_up)

    def _open_terminal(self) -> None:
        from tirebench.page.terminal import show

        def arguments(starts: int) -> tuple[Any, ...]:
            self._board.beat(STARTS)
            return self._board.name, starts

        self._keep(show, arguments)

    def _listen(self, reading: Connection, writing: Connection) -> None:
        """Take commands from a new pipe; the end of the one before is closed here too."""
        if self._writing is not None:
            self._writing.close()
        self._writing = writing
        self.desk.listen(reading)

    def _hang_up(self) -> None:
        if self._writing is not None:
            self._writing.close()

    def _keep(
        self, target: Callable[..., None], arguments: Callable[[int], tuple[Any, ...]]
    ) -> None:
        kept = Supervised(target, arguments, lambda: self._board.silence > HANGS)
        self._kept.append(kept)
        self._stack.callback(kept.wait, 0.0)


def _bound(choice: PageChoice) -> socket.socket:
    try:
        return listener(choice.host, choice.port)
    except OSError as error:
        raise LinkError(
            f"--host {choice.host} --page-port {choice.port}: the page cannot be bound "
            f"({error.strerror}); an address and a free port of this machine are needed; choose "
            "others (port 0 for any free one), or --no-page"
        ) from None


def _unspecified(host: str) -> bool:
    return ipaddress.ip_address(host).is_unspecified
