"""The command line of the bench, ``tirebench``: the only part of it that prints."""

import sys
from difflib import get_close_matches
from importlib import import_module

import click

from tirebench.errors import BenchError
from tirelib import __version__
from tirelib.errors import TirelibError
from tirelib.threads import bound_process

VERBS = ("ports", "load", "emulate", "run", "record", "zero", "shunt", "replay", "export", "repair")
"""Verbs; each is the command of that name in the module of that name."""

_EXAMPLE = """\b
Examples:
  tirebench emulate --campaign build/out/set1 --run 3 --port-file build/out/port
  tirebench run --port /dev/ttyUSB0 --fmu build/out/StrainTire.fmu --speed 65 --record live.mcap
  tirebench run --replay live.mcap --fmu build/out/StrainTire.fmu --json live.json

\b
Exit code: 0 done, 1 the command ran and its answer is negative, 2 bad input.
"""


class Verbs(click.Group):
    """A group that imports a verb only when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order of use."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one verb."""
        if cmd_name not in VERBS:
            return None
        try:
            command = getattr(import_module(f"tirebench.cli.{cmd_name}"), cmd_name)
        except ModuleNotFoundError as error:
            return _lacking(cmd_name, error)
        return command if isinstance(command, click.Command) else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the verb of the arguments; name the known verbs where it is unknown."""
        if args and args[0] not in VERBS and not args[0].startswith("-"):
            near = get_close_matches(args[0], VERBS, 1, 0.5)
            meant = f"; did you mean '{near[0]}'?" if near else ""
            ctx.fail(f"no such command '{args[0]}'; the commands are {', '.join(VERBS)}{meant}")
        return super().resolve_command(ctx, args)


def _lacking(verb: str, error: ModuleNotFoundError) -> click.Command:
    """Return a verb that only names the missing package; a plain install holds the library only."""
    package = (error.name or "").partition(".")[0]
    if package in ("tirebench", "tirelib"):
        raise error
    needs = f"needs the package {package!r}, which is not installed: pip install 'tirelib[bench]'"

    def refuse() -> None:
        raise BenchError(f"tirebench {verb}: it {needs}")

    return click.Command(
        verb,
        callback=refuse,
        help=f"It {needs}.",
        context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
    )


@click.group(cls=Verbs, epilog=_EXAMPLE)
@click.version_option(__version__, prog_name="tirebench")
def program() -> None:
    """Read a wheel transmitter, estimate live with an FMU, record, replay."""


def main() -> None:
    """Run the command line; an error that is raised on purpose ends with exit code 2."""
    bound_process()
    try:
        program(prog_name="tirebench")
    except (BenchError, TirelibError) as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(2)
