"""Options that several verbs share: the port, the protocol, the wheels."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from tirebench.errors import DeviceError
from tirebench.links.opening import BITRATE
from tirebench.protocols.plan import RATE
from tirebench.wire.device import Device, read_device
from tirelib.cli.common import FILE, Real, Whole

Command = TypeVar("Command", bound=Callable[..., Any])

WHEEL_MARK = "# wheel "
PORTS = """\b
Ports: /dev/ttyUSB0 or COM3, tcp:// or socket://HOST:PORT, udp://[HOST]:PORT, rfc2217://HOST:PORT
(SERIAL v1, or the layout that --map describes), slcan:/dev/ttyACM0 (CAN adapter with slcan, read
in bulk), can:INTERFACE:CHANNEL (python-can: can:socketcan:can0, can:pcan:PCAN_USBBUS1, and between
two programs without hardware can:udp_multicast:239.74.163.2).
"""

_PORT_OPTIONS = (
    click.option(
        "--baud",
        default=2_000_000,
        show_default=True,
        type=Whole(min=1200),
        help="Baud rate of a serial port.",
    ),
    click.option(
        "--bitrate",
        default=BITRATE,
        show_default=True,
        type=Whole(min=1000),
        help="Bit rate of a CAN bus [bit/s].",
    ),
    click.option(
        "--data-bitrate",
        type=Whole(min=1000),
        help="Bit rate of the data phase of CAN FD [bit/s].  [default: classic CAN]",
    ),
    click.option(
        "--bus-option",
        "bus_options",
        metavar="KEY=VALUE",
        multiple=True,
        help="Further option of the python-can interface; may be given several times.",
    ),
    click.option(
        "--rate",
        default=RATE,
        show_default=True,
        metavar="HZ",
        type=Real(153.0, 200_000.0),
        help="Sample rate of the gages on CAN; a SERIAL v1 frame states its own rate.",
    ),
    click.option(
        "--map",
        "map_file",
        metavar="M.toml",
        type=FILE,
        help="Map file (TOML) that describes another make's transmitter, on CAN or a serial line.",
    ),
    click.option(
        "--reconnect",
        default=60.0,
        show_default=True,
        metavar="S",
        type=Real(min=0.0),
        help="How long a port may be disconnected before the run ends.",
    ),
)


setup_option = click.option(
    "--setup",
    metavar="S.toml",
    type=FILE,
    help="Setup file (TOML) of several sources, each with its protocol, wheel and device file.",
)
"""Several sources at once."""

sidecar_option = click.option(
    "--conditions",
    "sidecar",
    metavar="F.json",
    type=FILE,
    help="File with the conditions over time, as `tirebench emulate --conditions` writes it.",
)
"""Conditions over time."""

duration_option = click.option(
    "--duration", metavar="S", type=Real(min=0.0), help="End after this time."
)
"""An end by time."""

silence_option = click.option(
    "--silence",
    metavar="S",
    type=Real(min=0.0),
    help="End when nothing came for this time, counted from the first byte; before it, only "
    "--duration and Ctrl-C end.",
)
"""An end by silence."""

trust_option = click.option(
    "--trust",
    is_flag=True,
    help="Run this FMU although it is unknown, and add it to the list of trusted FMUs.",
)
"""Leave to run native code."""

pace_option = click.option(
    "--pace",
    metavar="X",
    type=Real(0.001, 1000.0),
    help="Replay speed as a multiple of real time. [default: as fast as possible]",
)
"""How fast a recording is read."""


def port_options(command: Command) -> Command:
    """Add the options of a port to a command."""
    for option in reversed(_PORT_OPTIONS):
        command = option(command)
    return command


def wheel_of(option: str, text: str) -> tuple[int | None, str]:
    """Return the wheel and the rest of ``[WHEEL=]REST``; None where no wheel is said.

    Raises
    ------
    DeviceError
        If there can be no such wheel.
    """
    number, _, rest = text.partition("=")
    if not (rest and number.isdecimal()):
        return None, text
    if int(number) > 255:
        raise DeviceError(
            f"{option} {text}: wheel {number}; 0 .. 255 is allowed; correct the number"
        )
    return int(number), rest


def devices_of(texts: Sequence[str]) -> tuple[dict[int | None, Device], str]:
    """Return the device of each wheel from ``D.toml`` or ``WHEEL=D.toml``, and all texts as one.

    The text has a line ``# wheel N`` before each file but that for all wheels.

    Raises
    ------
    DeviceError
        With the faults of a file.
    """
    devices: dict[int | None, Device] = {}
    parts = []
    for given in texts:
        wheel, rest = wheel_of("--device", given)
        path = Path(rest)
        if wheel in devices:
            raise DeviceError(
                f"--device {given}: a device file for "
                f"{'all wheels' if wheel is None else f'wheel {wheel}'} was already given; one per "
                "wheel is allowed; leave one out"
            )
        devices[wheel] = read_device(path)
        text = path.read_text(encoding="utf-8")
        parts.append(text if wheel is None else f"{WHEEL_MARK}{wheel}\n{text}")
    return devices, "\0".join(parts)


def devices_of_text(text: str, where: str) -> dict[int | None, Device]:
    """Return the devices of a recording's header; the inverse of `devices_of`.

    Raises
    ------
    DeviceError
        With the faults of a file, or if a wheel has no number.
    """
    from tirebench.wire.device import parse_device

    devices: dict[int | None, Device] = {}
    for part in text.split("\0") if text else []:
        first, _, rest = part.partition("\n")
        own = first.startswith(WHEEL_MARK)
        number = first.removeprefix(WHEEL_MARK)
        if own and not (number.isdecimal() and len(number) <= 3 and int(number) <= 255):
            raise DeviceError(
                f"{where}: device file of wheel {number[:40]!r}; 0 .. 255 is allowed; the header "
                "is damaged; take another recording, or name files with --device"
            )
        wheel = int(number) if own else None
        devices[wheel] = parse_device(rest if own else part, f"{where}: device file")
    return devices
