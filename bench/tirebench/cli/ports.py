"""``tirebench ports``: the serial ports of this machine."""

from pathlib import Path

import click

from tirelib.cli.common import NEW_FILE, write_json

_EXAMPLE = """\b
Example:
  tirebench ports

\b
Exit code: 0 at least one port was found, 1 none.
"""


@click.command(epilog=_EXAMPLE)
@click.option(
    "--json", "json_file", metavar="FILE", type=NEW_FILE, help="Write the list of ports (JSON)."
)
@click.pass_context
def ports(context: click.Context, json_file: Path | None) -> None:
    """List serial ports: device, description, identity."""
    from serial.tools import list_ports

    found = sorted(list_ports.comports())
    for port in found:
        click.echo(f"{port.device}  {port.description}  {port.hwid}")
    if not found:
        click.echo("no serial port was found; plug the receiver in, or start `tirebench emulate`")
    if json_file is not None:
        rows = [{"device": p.device, "description": p.description, "hwid": p.hwid} for p in found]
        write_json(json_file, {"format": "tirebench-ports/1", "ports": rows})
    context.exit(0 if found else 1)
