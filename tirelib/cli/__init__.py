"""The command line, ``tirelib``: the only part of the library that prints."""

import sys
from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from keyword import iskeyword
from typing import Any

import click
from click.shell_completion import CompletionItem

from tirelib.core.errors import TirelibError
from tirelib.core.threads import bound_process
from tirelib.core.version import __version__

VERBS = {
    "campaign": "Validate a folder of measurements, or show its content.",
    "import": "Make a campaign from measured files: MATLAB, CSV, Parquet, TYDEX, loose MDF 4.",
    "features": "Extract contact edges, peaks and integrals for every turn and gage of DIR.",
    "calibrate": "Fit the estimators of Fz, alpha, kappa and Fy on the campaigns in DIR...",
    "estimate": "Estimate every turn of DIR, and compare with the forces that the rig measured.",
    "identify": "Fit the base model, ring and brush, to DIR.",
    "compare": "Compare a model with CAMPAIGN and show where it fails.",
    "diagnose": "Tell which physical effect the model lacks in CAMPAIGN.",
    "explain": "Find what a model of CAMPAIGN lacks, add it, and show before and after.",
    "effects": "List the effects of the catalogue, or register effects of your own.",
    "next-test": "Tell which further run would separate the suspects of CAMPAIGN best.",
    "add": "Add effects to a model, fit it to CAMPAIGN and show how the error changes.",
    "selftest": "Plant each effect at the plan and noise of CAMPAIGN and count how often it is "
    "found.",
    "studio": "See in the browser where a model fails, add the effect that is missing, take it "
    "away.",
    "simulate": "Simulate the rolling ring on the road: shape, pressure, shear, strain and strain "
    "rate.",
    "export": "Fit a Magic Formula 6.1 to a model's brush or to a force campaign, and write it as "
    ".tir.",
    "fmu": "Export the estimator or the virtual tire as an FMU, check it, and run it.",
    "fleet": "Run TASK over every campaign and recording below PATHS, on Dask.",
    "rig": "Measure a virtual tire on the numerical rig and write a campaign.",
}
"""Verbs in the order of the journey, each with the first sentence of its help, so that the list of
verbs needs no verb's module."""

OPTIONAL = {
    "pythonfmu": "fmu",
    "fmpy": "fmu",
    "starlette": "studio",
    "uvicorn": "studio",
    "websockets": "studio",
    "dask": "fleet",
    "distributed": "fleet",
    "fsspec": "fleet",
    "s3fs": "fleet",
    "deltalake": "delta",
}
"""Packages that a plain install lacks, and the extra that brings each."""

_EXAMPLE = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib rig --plan set1 --seed 2 --out day2
  tirelib campaign check day1
  tirelib calibrate day1 --out cal.toml
  tirelib estimate day2 --calibration cal.toml --json estimates.json
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib explain straight --out explained

\b
Exit code: 0 done, 1 the command ran and its answer is negative, 2 bad input.
"""


class Verbs(click.Group):
    """A group of commands, each in a module of its own that is imported when it is asked for.

    Parameters
    ----------
    package : str
        The package of the modules; a command has the name of its module (`import_` for import,
        `_` in place of `-`).
    sentences : mapping of str to str
        The commands in the order of the list, each with the first sentence of its help, so that
        the list needs no command's module.
    """

    def __init__(
        self, *arguments: Any, package: str, sentences: Mapping[str, str], **options: Any
    ) -> None:
        super().__init__(*arguments, **options)
        self.package, self.sentences = package, sentences

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands in the order of the list."""
        return list(self.sentences)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one command."""
        if cmd_name not in self.sentences:
            return None
        name = f"{cmd_name}_" if iskeyword(cmd_name) else cmd_name.replace("-", "_")
        command = getattr(import_module(f"{self.package}.{name}"), name)
        return command if isinstance(command, click.Command) else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command of the arguments; list the known ones where it is unknown."""
        if args and args[0] not in self.sentences and not args[0].startswith("-"):
            near = get_close_matches(args[0], self.sentences, 1, 0.5)
            meant = f"; did you mean '{near[0]}'?" if near else ""
            names = ", ".join(self.sentences)
            ctx.fail(f"no such command '{args[0]}'; the commands are {names}{meant}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self.sentences.items()))

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the commands that begin so, and the options of the program."""
        names = [name for name in self.sentences if name.startswith(incomplete)]
        options = click.Command.shell_complete(self, ctx, incomplete)
        return [*(CompletionItem(name, help=self.sentences[name]) for name in names), *options]


def run_program(
    program: click.Command,
    name: str,
    optional: Mapping[str, str],
    errors: tuple[type[Exception], ...] = (TirelibError,),
) -> None:
    """Run a command line; what is raised on purpose is one line on stderr and exit code 2.

    Parameters
    ----------
    program : click.Command
    name : str
    optional : mapping of str to str
        Packages that a plain install lacks, and the extra that brings each.
    errors : tuple of type, optional
        What the library raises on purpose.
    """
    bound_process()
    try:
        program(prog_name=name)
    except errors as error:
        said = str(error)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in optional:
            raise
        said = (
            f"this command needs the package {package!r}, which is not installed; install it with "
            f"pip install 'tirelib[{optional[package]}]'"
        )
    except OSError as error:
        said = f"{error.filename}: {error.strerror}; choose another place"
    click.echo(f"Error: {said}", err=True)
    sys.exit(2)


@click.group(cls=Verbs, package="tirelib.cli", sentences=VERBS, epilog=_EXAMPLE)
@click.version_option(__version__, prog_name="tirelib")
def program() -> None:
    """Innerliner strain to load, slip and force, and the physics of the tire behind it."""


def main() -> None:
    """Run the command line."""
    run_program(program, "tirelib", OPTIONAL)
