"""The command line, ``tirelib``: the only part of the library that prints."""

import sys
from importlib import import_module
from keyword import iskeyword

import click
from click.shell_completion import CompletionItem

from tirelib import __version__
from tirelib.errors import TirelibError
from tirelib.threads import bound_process

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
    "add": "Add EFFECT to a model, fit it to CAMPAIGN and show how the error changes.",
    "selftest": "Plant each effect at the plan and noise of CAMPAIGN and tell the chance of "
    "finding it.",
    "studio": "Open the journey in the browser: see, suspect, add, take away.",
    "simulate": "Simulate the rolling ring on the road: shape, pressure, shear, strain and strain "
    "rate.",
    "fmu": "Export the estimator or the virtual tire as an FMU, check it, and run it.",
    "fleet": "Run TASK over every campaign and recording below PATHS, on Dask.",
    "rig": "Measure a virtual tire on the numerical rig and write a campaign.",
}
"""Verbs in the order of the journey, each with the first sentence of its help, so that the list of
verbs needs no verb's module. A verb is the command of that name in the module of that name
(`import_` for import, `_` in place of `-`)."""

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
  tirelib rig --plan set1 --out build/out/set1
  tirelib campaign check build/out/set1
  tirelib calibrate build/out/set1 --out build/out/cal.toml
  tirelib estimate build/out/set1 --calibration build/out/cal.toml
  tirelib identify build/out/straight --out build/out/M.toml
  tirelib simulate --model build/out/M.toml --load 4000 --speed 80 --out build/out/simulated

\b
Exit code: 0 done, 1 the command ran and its answer is negative, 2 bad input.
"""


class Verbs(click.Group):
    """A group that imports a verb only when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order of the journey."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one verb."""
        if cmd_name not in VERBS:
            return None
        name = f"{cmd_name}_" if iskeyword(cmd_name) else cmd_name.replace("-", "_")
        command = getattr(import_module(f"tirelib.cli.{name}"), name)
        return command if isinstance(command, click.Command) else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of verbs."""
        with formatter.section("Commands"):
            formatter.write_dl(list(VERBS.items()))

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the verbs that begin so, and the options of the program."""
        verbs = [(verb, said) for verb, said in VERBS.items() if verb.startswith(incomplete)]
        options = click.Command.shell_complete(self, ctx, incomplete)
        return [*(CompletionItem(verb, help=said) for verb, said in verbs), *options]


@click.group(cls=Verbs, epilog=_EXAMPLE)
@click.version_option(__version__, prog_name="tirelib")
def program() -> None:
    """Innerliner strain to load, slip and force, and the physics of the tire behind it."""


def main() -> None:
    """Run the command line; an error that the library raises on purpose ends with exit code 2."""
    bound_process()
    try:
        program(prog_name="tirelib")
    except TirelibError as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(2)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in OPTIONAL:
            raise
        click.echo(
            f"Error: this command needs the package {package!r}, which is not installed; install "
            f"it with pip install 'tirelib[{OPTIONAL[package]}]'",
            err=True,
        )
        sys.exit(2)
    except OSError as error:
        click.echo(f"Error: {error.filename}: {error.strerror}; choose another place", err=True)
        sys.exit(2)
