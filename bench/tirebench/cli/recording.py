"""Options of a recording, and its messages on free disk space at the start."""

from collections.abc import Callable
from functools import wraps
from math import inf
from pathlib import Path
from typing import Any, TypeVar, cast

import click

from tirebench.live.reader import ReaderPlan
from tirebench.live.recording_state import RecordingRule
from tirebench.live.space import free_at
from tirelib.cli.common import Real

Command = TypeVar("Command", bound=Callable[..., Any])

HOURLY, HOURLY_RAW = 0.75e9, 0.26e9
"""What a wheel at 10 kHz takes in an hour, [bytes]: with its strain and without; measured in
docs/reference/bench_proof.md."""
KEPT_BYTES_PER_SECOND = 1e6
"""Memory that a second of a wheel at 10 kHz takes before a trigger, [bytes]; measured by
build/bench_trigger.py, rounded up. With `--no-strain` it is less."""
LITTLE_ROOM = 1e9
"""Room below which there is a warning, [bytes]: about an hour of one wheel."""

OTHER_FORMATS = (".mf4", ".mdf", ".csv", ".parquet", ".blf", ".asc", ".log", ".json")
"""Endings of files that are no recordings."""

_OPTIONS = (
    click.option(
        "--split-minutes",
        metavar="MIN",
        type=Real(min=0.01),
        help="Start a new part of the recording after this time.",
    ),
    click.option(
        "--split-mb",
        metavar="MB",
        type=Real(min=0.1),
        help="Start a new part of the recording when a part reaches this size.",
    ),
    click.option(
        "--strain/--no-strain",
        default=True,
        help="Record the decoded strain as well as the raw bytes, for other programs.",
    ),
    click.option(
        "--trigger",
        metavar="BEFORE,AFTER",
        callback=lambda _c, _p, text: _around(text),
        help="Record only around events, this many seconds before and after each, one file per "
        "event. Events are a lost port and, with the page or --tui of `run`, markers and the "
        "start of an alarm.",
    ),
)


def recording_options(command: Command) -> Command:
    """Add the options of a recording to a command, which gets them as `rule`."""

    @wraps(command)
    def with_rule(
        *given: Any,
        split_minutes: float | None,
        split_mb: float | None,
        strain: bool,
        trigger: tuple[float, float] | None,
        **named: Any,
    ) -> Any:
        minutes = inf if split_minutes is None else split_minutes
        size = inf if split_mb is None else split_mb
        rule = RecordingRule(strain, 60.0 * minutes, 1e6 * size, trigger)
        return command(*given, rule=rule, **named)

    decorated: Any = with_rule  # the options take what the command does not
    for option in reversed(_OPTIONS):
        decorated = option(decorated)
    return cast(Command, decorated)


def check_ending(option: str, path: Path) -> None:
    """Refuse a name that promises another format than that of a recording.

    Raises
    ------
    click.UsageError
        Which says how to get that format.
    """
    if path.suffix.lower() in OTHER_FORMATS:
        raise click.UsageError(
            f"{option} {path}: a recording is MCAP; name it {path.with_suffix('.mcap')}, and write "
            f"{path.suffix} from it with `tirebench export`"
        )


def at_start(path: Path, reader: ReaderPlan, rule: RecordingRule, *, watched: bool) -> str:
    """Return the messages on a recording at the start.

    Parameters
    ----------
    path : Path
    reader : ReaderPlan
    rule : RecordingRule
    watched : bool
        Whether there is a page or a terminal view, which know limits and markers.
    """
    wheels = max(reader.expected, sum(source.sends_strain for source in reader.sources))
    said = room(path, wheels, strain=rule.strain)
    if rule.around is not None:
        said += (
            f"\n--trigger: keeping the {rule.around[0]:g} s before an event takes up to "
            f"{1e-6 * KEPT_BYTES_PER_SECOND * wheels * rule.around[0]:.0f} MB of memory"
        )
    if rule.around is not None and not watched:
        said += (
            "\n--trigger: only a lost port and alarms of the program itself trigger here; markers "
            "and alarm limits need `tirebench run` with its page or with --tui"
        )
    return said


def room(path: Path, wheels: int, *, strain: bool = True) -> str:
    """Return the message on the free disk space for a recording of this number of wheels."""
    free = free_at(path)
    if free != free:
        return "room for the recording: unknown, the system does not report free disk space"
    hours = free / ((HOURLY if strain else HOURLY_RAW) * wheels)
    said = f"room for the recording: {free / 1e9:.1f} GB, about {hours:.0f} h"
    if hours < 1.0:
        said = f"room for the recording: {free / 1e6:.0f} MB, about {60.0 * hours:.0f} min"
    said += f" of {wheels} wheels at 10 kHz" if wheels > 1 else " of a wheel at 10 kHz"
    return (
        f"warning: {said}; free some space, or choose another disk" if free < LITTLE_ROOM else said
    )


def _around(text: str | None) -> tuple[float, float] | None:
    """Return the times before and after a trigger, [s]."""
    if text is None:
        return None
    try:
        before, after = (float(part) for part in text.split(","))
    except ValueError:
        before = after = -1.0
    if not (0.0 <= before <= 600.0 and 0.0 <= after <= 86_400.0):
        raise click.BadParameter(
            f"{text!r}; two times in seconds are needed, up to 600 before and 86400 after, such as "
            "10,20; correct it"
        )
    return before, after
