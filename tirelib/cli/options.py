"""Options that several verbs share: one decorator each, with one spelling and one default."""

from collections.abc import Callable
from typing import Any

import click

from tirelib.cli.common import FILE, NEW_FILE, NEW_FOLDER, Real, Whole

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def json_option(what: str = "the numbers") -> Decorator:
    """Return ``--json FILE``; `what` says what the file holds."""
    return click.option(
        "--json", "json_file", metavar="FILE", type=NEW_FILE, help=f"Write {what} as JSON."
    )


def report_option(name: str) -> Decorator:
    """Return ``--out DIR`` for the pages and the document of one name."""
    return click.option(
        "--out",
        "out",
        metavar="DIR",
        type=NEW_FOLDER,
        help=f"Folder for {name}.html, {name}.md and {name}.json.",
    )


model_option = click.option(
    "--model",
    "model_name",
    metavar="M.toml|NAME",
    required=True,
    help="Model file, tire file, or the name of a tire that tirelib ships.",
)
"""The model that a verb starts from."""

quantity_option = click.option(
    "--quantity",
    metavar="strain|Fy|Fx|Mz",
    help="Measured quantity. Default: strain where the campaign has it, else the force with the "
    "largest error.",
)
"""The quantity that is compared or diagnosed."""

effects_option = click.option(
    "--effects",
    "effect_files",
    metavar="FILE.py",
    type=FILE,
    multiple=True,
    help="Python file with effects of your own; may be given several times.",
)
"""Effects that are in no catalogue."""

false_alarm_option = click.option(
    "--false-alarm",
    "false_alarm",
    metavar="P",
    type=Real(min=0, max=0.5, min_open=True),
    default=0.05,
    show_default=True,
    help="Probability with which a tire that lacks nothing is said to lack something.",
)


seed_option = click.option(
    "--seed",
    metavar="N",
    type=Whole(min=0),
    default=0,
    show_default=True,
    help="Seed of the variants.",
)
"""Seed of the ensemble."""


def low_pass_options(function: Callable[..., None]) -> Callable[..., None]:
    """Add the options that choose the low-pass."""
    function = click.option(
        "--cut-off",
        type=Real(),
        metavar="HZ",
        default=None,
        help="Fixed cut-off frequency instead; turns whose speed it does not suit are flagged.",
    )(function)
    return click.option(
        "--order",
        type=Real(),
        metavar="N",
        default=None,
        help="Cut-off of the low-pass filter in cycles per turn (default 24: 225 Hz at 65 km/h).",
    )(function)
