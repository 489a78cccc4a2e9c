"""Options of the live page, and its messages on the screen."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import click
from rich.console import Console

from tirebench.estimator.estimation import News
from tirebench.estimator.session import Source
from tirebench.page.alarms import RULES, Rule
from tirebench.page.commands import Switch
from tirebench.page.feed import About
from tirebench.page.live import LOOPBACK, LivePage, PageChoice
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device
from tirelib.cli.common import FILE, Whole
from tirelib.estimators.calibration import Calibration

Command = TypeVar("Command", bound=Callable[..., Any])

NEEDED = ("starlette", "uvicorn", "websockets")

_OPTIONS = (
    click.option(
        "--page/--no-page",
        default=None,
        help="Show a live page in the browser. [default: yes, except in a replay without --pace]",
    ),
    click.option(
        "--host",
        default=LOOPBACK,
        show_default=True,
        metavar="ADDRESS",
        help="Address on which the page is served.",
    ),
    click.option(
        "--network",
        is_flag=True,
        help="Allow a --host that other machines can reach; the connection is not encrypted.",
    ),
    click.option(
        "--page-port",
        default=0,
        type=Whole(0, 65535),
        metavar="N",
        help="TCP port of the page. [default: any free port]",
    ),
    click.option("--tui", is_flag=True, help="Show the same values in this terminal."),
    click.option(
        "--alarms",
        "alarms",
        metavar="A.toml",
        type=FILE,
        help="File (TOML) with the limits of the alarms.",
    ),
)


def page_options(command: Command) -> Command:
    """Add the options of the page to a command."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def page_choice(
    page: bool | None, host: str, network: bool, page_port: int, tui: bool, *, paced: bool
) -> PageChoice:
    """Return the page and terminal view that the options choose.

    Raises
    ------
    DeviceError
        If the host is not allowed.
    """
    wanted = (paced and not tui) if page is None else page
    return PageChoice(wanted, tui, host, page_port, network).checked()


class Shown:
    """The page of a run, or nothing when none is wanted; a context manager.

    Parameters
    ----------
    choice : PageChoice
    console : Console
        Gets the address, and a warning when others can reach it.
    rules : mapping of name to Rule
        Limits of the alarms.
    """

    def __init__(
        self, choice: PageChoice, console: Console, rules: Mapping[str, Rule] = RULES
    ) -> None:
        self._choice = choice
        self._rules = rules
        self._console = console
        self._stack = ExitStack()
        self._page: LivePage | None = None
        self.quiet = choice.terminal and console.is_terminal
        self.anything = choice.page or choice.terminal

    def open(
        self,
        source: Source,
        switch: Switch | None,
        fmu: Path,
        calibration: Calibration | None,
        devices: Sequence[Device],
        conditions: Conditions,
        origin: str,
        folder: Path,
    ) -> None:
        """Start the page and the terminal view, and print the address.

        `conditions` are what is known beside a bus, `origin` says where they come from; device
        files that the page asks for are written into `folder`.
        """
        choice, console = self._choice, self._console
        missing = [name for name in NEEDED if find_spec(name) is None]
        if choice.page and missing:
            console.print(
                f"no live page: the package {', '.join(missing)} is not installed; run: "
                "pip install 'tirelib[bench]'"
            )
            choice = PageChoice(False, choice.terminal)
        if not (choice.page or choice.terminal):
            return
        lateral = next((d.lateral for d in devices if d.lateral), None)
        about = About(source.name, fmu.name, conditions=conditions, origin=origin, folder=folder)
        if calibration is not None:
            about = replace(about, tire=calibration.tire, lateral=calibration.lateral)
        elif lateral is not None:
            about = replace(about, lateral=lateral)
        page = LivePage(choice, source, about, switch, self._rules)
        self._page = self._stack.enter_context(page)
        if choice.open_to_others:
            console.print(
                f"warning: the page is open to the network at {choice.host}, not encrypted; "
                "whoever knows its address can start recordings and set markers",
                style="bold red",
                soft_wrap=True,
            )
        if page.url:
            console.print(f"live page: {page.url}", soft_wrap=True, markup=False, highlight=False)

    def watch(self, news: News, unwritten: str = "") -> None:
        """Show what is new, and why turns cannot be written; called again and again."""
        if self._page is not None:
            self._page.watch(news, unwritten)

    def cpu_time(self) -> float:
        """Return what the page's process has used, [s]."""
        return 0.0 if self._page is None else self._page.cpu_time

    def end(self, reason: str) -> None:
        """Say that the run has ended."""
        if self._page is not None:
            self._page.end(reason)

    def __enter__(self) -> "Shown":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()
