"""``tirelib fleet``: a verb over many campaigns and recordings."""

import math
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from tirelib.cli.common import NEW_PLACE, Whole, output, say_written, write_document
from tirelib.cli.options import json_option
from tirelib.cli.progress import EVERY
from tirelib.core.errors import TirelibError

if TYPE_CHECKING:
    from tirelib.fleet.engine import Counts

FORMAT = "tirelib-fleet-run/1"
TASKS = ("check", "features", "calibrate", "estimate", "identify", "compare", "diagnose")
SHOWN = 5
OWN = frozenset({"--json", "--out", "--report", "--calibration", "--model", "--help"})
"""Options of a verb that the fleet gives itself, or has as its own."""

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --seed 1 --out campaigns/a
  tirelib rig --plan short --seed 2 --out campaigns/b
  tirelib fleet check campaigns --out results
  tirelib fleet identify campaigns --out results
  tirelib fleet diagnose campaigns --model results --out results --with "--quantity strain"
  tirelib fleet calibrate campaigns --out results
  tirelib fleet estimate "campaigns/*" --calibration results --out results
  tirelib fleet identify s3://bucket/campaigns --out s3://bucket/results \\
      --scheduler tcp://scheduler:8786

\b
PATHS are folders, patterns or URLs; every campaign (campaign.toml) and recording (recording.toml)
below them is one task. DATASET gets Parquet tables, a page for each campaign, and index.html for
all of them. Finished ones are skipped, so the same command goes on where it stopped. A calibration
or model may be a file, or the DATASET of an earlier `calibrate` or `identify`.
Exit code: 0 all done, 1 some failed or have a negative answer (a check that found errors), or it
was interrupted, 2 bad input.
"""


def run_verb(command: Sequence[str]) -> tuple[int, str]:
    """Run a command of this program in this process.

    Returns
    -------
    code : int
        The exit code.
    said : str
        What it printed.

    Raises
    ------
    TirelibError
        If the verb refuses its input.
    """
    from tirelib.cli import program
    from tirelib.core.errors import ParameterError

    said = StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        try:
            code = program.main([*command, "--quiet"], prog_name="tirelib", standalone_mode=False)
        except click.ClickException as error:
            raise ParameterError(error.format_message()) from None
    return int(code or 0), said.getvalue()


@click.command(epilog=_EXAMPLE)
@click.argument("task", metavar="TASK", type=click.Choice(TASKS))
@click.argument("paths", metavar="PATHS...", nargs=-1, required=True)
@click.option(
    "--out",
    "out",
    metavar="DATASET",
    type=NEW_PLACE,
    required=True,
    help="Folder or URL of the results.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Dask scheduler, for instance tcp://host:8786. Default: a cluster on this machine.",
)
@click.option(
    "--workers",
    metavar="N",
    type=Whole(min=1),
    help="Processes of the cluster on this machine. Default: one a processor.",
)
@click.option(
    "--calibration",
    metavar="CAL.toml|DATASET",
    help="For estimate: a file, or a data set with the calibration of each tire.",
)
@click.option(
    "--model",
    metavar="M.toml|NAME|DATASET",
    help="For compare and diagnose: a file, a tire's name, or a data set with each tire's model.",
)
@click.option("--with", "more", metavar="OPTIONS", default="", help="Further options of the verb.")
@click.option("--reports", is_flag=True, help="Write the whole report of each campaign, too.")
@click.option("--delta", is_flag=True, help="Keep a Delta log beside the Parquet files.")
@json_option("counts and failures")
@click.pass_context
def fleet(
    context: click.Context,
    task: str,
    paths: tuple[str, ...],
    out: Path | str,
    scheduler: str | None,
    workers: int | None,
    calibration: str | None,
    model: str | None,
    more: str,
    reports: bool,
    delta: bool,
    json_file: Any,
) -> None:
    """Run TASK over every campaign and recording below PATHS, on Dask."""
    from tirelib.fleet import engine
    from tirelib.fleet.cluster import cluster
    from tirelib.fleet.dataset import DataSet
    from tirelib.fleet.page import write_fleet_page
    from tirelib.fleet.recipes import recipe_of
    from tirelib.fleet.sources import find_sources

    options = _options(task, more)
    sources = find_sources(
        paths, lambda error: click.echo(f"Warning: {error}; the folder is left out", err=True)
    )
    data = DataSet(str(out))
    data.open()
    files = {"calibration": calibration, "model": model}
    recipe = recipe_of(
        task,
        data,
        files={name: given for name, given in files.items() if given is not None},
        options=options,
        reports=reports,
    )
    console = output()
    counts = engine.Counts(total=len(sources))
    stopped = ""
    if scheduler is not None:
        click.echo(f"Connecting to {scheduler}", err=True)
    try:
        with cluster(scheduler, workers) as client:
            click.echo(f"Dask dashboard: {client.dashboard_link}", err=True)
            if not client.nthreads():
                click.echo(
                    "Warning: no worker has joined; the work begins with the first", err=True
                )
            with _progress(task) as show:
                engine.run(
                    sources, data, recipe, client, run_verb, counts=counts, delta=delta, report=show
                )
    except KeyboardInterrupt:
        stopped = "interrupted; what is finished is kept; the same command goes on from here"
    except engine.SchedulerLostError as lost:
        stopped = str(lost)
    _print(console, task, counts, engine.causes(counts))
    try:
        say_written(write_fleet_page(data))
    except TirelibError as error:
        click.echo(f"Warning: no page: {error}", err=True)
    write_document(_document(task, str(out), counts), json_file)
    if stopped:
        click.echo(f"Error: {stopped}", err=True)
    context.exit(1 if counts.failed or counts.negative or stopped else 0)


def _options(task: str, more: str) -> list[str]:
    """Return further options of the verb; refuse what it does not know, once for all campaigns."""
    from tirelib.cli import program
    from tirelib.fleet.work import TASKS as VERBS

    try:
        options = shlex.split(more)
        verb: Any = program
        for word in VERBS[task]:
            verb = verb.get_command(click.Context(verb), word)
        context = click.Context(verb)
        given, *_ = verb.make_parser(context).parse_args(list(options))
        for option in verb.params:
            if isinstance(option, click.Option) and option.name in given:
                if own := sorted(OWN.intersection(option.opts)):
                    raise ValueError(
                        f"{own[0]} is set by the fleet; leave it out (`tirelib fleet --help` "
                        "lists the fleet's own options)"
                    )
                option.type_cast_value(context, given[option.name])
    except (ValueError, click.UsageError) as error:
        said = error.format_message() if isinstance(error, click.UsageError) else str(error)
        raise click.UsageError(f"--with {more!r}: {said}") from None
    return options


@contextmanager
def _progress(task: str) -> Iterator[Callable[["Counts"], None]]:
    """Yield a function that shows how far the fleet is: a bar, or a line now and then."""
    console = Console(stderr=True)
    last = -math.inf  # the first line comes at once: a campaign may take minutes
    if not console.is_terminal:

        def line(counts: "Counts") -> None:
            nonlocal last
            if time.monotonic() - last > EVERY or not counts.left:
                last = time.monotonic()
                print(f"{task}: {_state(counts)}", file=sys.stderr, flush=True)

        yield line
        return
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[state]}", style="dim", markup=False),
        console=console,
        transient=True,
    ) as bar:
        shown = bar.add_task(task, total=None, state="")

        def update(counts: "Counts") -> None:
            bar.update(
                shown,
                total=counts.total,
                completed=counts.total - counts.left,
                state=_state(counts),
            )

        yield update


def _state(counts: "Counts") -> str:
    """Return how far it is, with rate and time left."""
    rate = counts.rate
    done = counts.total - counts.left
    left = f", {_duration(counts.left / rate)} left" if counts.left and rate > 0.0 else ""
    return f"{done} of {counts.total}, {counts.failed} failed, {_rate(rate)}{left}"


def _rate(rate: float) -> str:
    return f"{rate:.3g} a second" if rate >= 1.0 else f"{60.0 * rate:.3g} a minute"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


def _print(console: Console, task: str, counts: "Counts", causes: list[tuple[str, int]]) -> None:
    console.print(
        f"{task}: {counts.total} campaigns and recordings: {counts.done} done, "
        f"{counts.skipped + counts.known} finished before, {counts.failed} failed, "
        f"{counts.left} left"
    )
    if counts.copies:
        console.print(
            f"  {counts.copies} finished before have the content of another one; the list of the "
            "page says of which"
        )
    if counts.negative:
        console.print(f"  the answer is negative for {counts.negative} of them; see the page")
    for message, number in causes[:SHOWN]:
        console.print(f"  failed ({number}): {message}")
    if len(causes) > SHOWN:
        console.print(f"  and {len(causes) - SHOWN} other causes; see the page, or --json")


def _document(task: str, out: str, counts: "Counts") -> dict[str, Any]:
    return {
        "format": FORMAT,
        "task": task,
        "data_set": out,
        "total": counts.total,
        "done": counts.done,
        "finished_before": counts.skipped + counts.known,
        "failed": counts.failed,
        "negative": counts.negative,
        "left": counts.left,
        "failures": [
            {"path": path, "message": message} for path, message in counts.messages.items()
        ],
    }
