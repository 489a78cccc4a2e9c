"""Sends estimates to other programs during a run; off by default."""

from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, TypeVar

import click

from tirebench.estimator.chain import Turn
from tirebench.links.opening import PortPlan

Command = TypeVar("Command", bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        "--estimates-out",
        metavar="PORT",
        help="Send the estimates on this CAN bus (can:... or slcan:...), in the messages of "
        "tirelib.dbc.",
    ),
    click.option(
        "--plotjuggler",
        metavar="[HOST:]PORT",
        is_flag=False,
        flag_value="9870",
        help="Send the estimates as JSON over UDP, for PlotJuggler.  [HOST: 127.0.0.1]",
    ),
)


def bridge_options(command: Command) -> Command:
    """Add the options of the bridges to a command."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


class Bridges:
    """The senders of turns to other programs, as a context manager that closes them.

    Parameters
    ----------
    estimates_out : str or None
        A port for CAN frames; see `tirebench.live.bridges.CanSender`.
    plotjuggler : str or None
        ``PORT`` or ``HOST:PORT``; see `tirebench.live.bridges.UdpSender`.
    plan : PortPlan
        Whose bit rates hold for `estimates_out` too.
    """

    def __init__(self, estimates_out: str | None, plotjuggler: str | None, plan: PortPlan) -> None:
        from tirebench.live.bridges import CanSender, Sender, UdpSender, udp_target

        self._senders: list[Sender] = []
        if plotjuggler is not None:
            self._senders.append(UdpSender(*udp_target(plotjuggler)))
        if estimates_out is not None:
            out = PortPlan(estimates_out, plan.baud, plan.bitrate, plan.data_bitrate, plan.options)
            self._senders.append(CanSender(out))

    def send(self, turns: Sequence[Turn]) -> None:
        """Send turns to the other programs."""
        for sender in self._senders:
            sender.send(turns)

    def __enter__(self) -> "Bridges":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for sender in self._senders:
            sender.close()
