"""``tirebench export``: a recording as a campaign, CSV, Parquet, or a CAN log."""

import tempfile
from contextlib import closing
from pathlib import Path

import click
import tomli_w

from tirebench.cli.options import devices_of
from tirebench.cli.run_inputs import recorded_sources
from tirebench.errors import RecordingError
from tirebench.recording.export import (
    CAN_LOGS,
    left_out,
    write_campaign_of,
    write_can_log,
    write_table,
)
from tirebench.recording.export_results import write_mdf, write_results
from tirebench.recording.new_file import keep_recordings, whole
from tirebench.recording.recording import Recording
from tirebench.recording.segments import Segment, segments
from tirelib.campaign import CampaignHeader
from tirelib.campaign.header import parse_header
from tirelib.cli.common import FILE, NEW_FILE, NewPath, Whole, write_json

TABLES, MDF = (".csv", ".parquet"), ".mf4"

_EXAMPLE = """\b
Examples:
  tirebench export live.mcap --out live             # campaign folder with MDF4
  tirebench export live.mcap --out live --like day1
  tirebench export live.mcap --out live.parquet
  tirebench export live.mcap --out live.mf4                   # all of it in one MDF4 file
  tirebench export bus.mcap --out bus.blf                     # or .asc, .log

\b
Conditions that a bus sent are in all of them. Estimates of the run, events and
markers are in .mf4, else in tables beside it (live.estimates.csv, live.events.csv).
A campaign holds one wheel. Tire and gages come from the recording where a campaign was played, else
from the campaign that --like names. Its runs are sweeps where no set points are known.
Exit code: 0 done, 1 the recording is incomplete (its sound part is written) or holds nothing to
export, 2 bad input.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("recording", metavar="RECORDING", type=FILE)
@click.option(
    "--out",
    metavar="DIR|FILE",
    required=True,
    type=NewPath(path_type=Path),
    help="New folder for a campaign, or new file whose ending chooses the format.",
)
@click.option(
    "--like",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Campaign whose tire and gages apply to this recording.",
)
@click.option(
    "--wheel",
    type=Whole(0, 255),
    help="Number of the wheel to export.  [default: the first that sent frames]",
)
@click.option(
    "--device",
    "device_texts",
    metavar="[WHEEL=]D.toml",
    multiple=True,
    help="Device file to use instead of the one in the recording.",
)
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    type=NEW_FILE,
    help="Write a list of the files that were written.",
)
@click.pass_context
def export(
    context: click.Context,
    recording: Path,
    out: Path,
    like: Path | None,
    wheel: int | None,
    device_texts: tuple[str, ...],
    json_file: Path | None,
) -> None:
    """Write a recording as a campaign, MDF4, CSV, Parquet, or a CAN log (BLF, ASC, log)."""
    suffix = out.suffix.lower()
    if suffix and suffix not in (*TABLES, MDF, *CAN_LOGS):
        raise click.UsageError(
            f"--out {out}: {', '.join((*TABLES, MDF, *CAN_LOGS))} are the known file endings; a "
            "name without ending makes a campaign folder"
        )
    if out.exists():
        raise RecordingError(
            f"{out}: already exists; export never overwrites; give another name to --out"
        )
    keep_recordings(json_file, recording)
    beside: list[Path] = []
    with closing(Recording(recording)) as opened:
        header = opened.header
        sources = recorded_sources(header, str(recording), devices_of(device_texts)[0])
        if wheel is not None and suffix not in CAN_LOGS:
            heard = sorted({one.wheel for one in segments(opened, sources, None, _quiet)})
            if wheel not in heard:
                raise RecordingError(
                    f"{recording}: wheel {wheel} is not in it; its wheels are "
                    f"{', '.join(map(str, heard)) or 'none'}; choose one of them with --wheel"
                )
        with whole(out) as new:
            if suffix in CAN_LOGS:
                count, what = write_can_log(opened, new), "frames"
            elif suffix in TABLES:
                found = segments(opened, sources, wheel, _note)
                count, what = write_table(found, opened.conditions, new), "samples"
            elif suffix == MDF:
                every = list(segments(opened, sources, wheel, _note))
                count, what = write_mdf(recording, every, opened.conditions, new), "samples"
            else:
                mine = _of_one_wheel(list(segments(opened, sources, wheel, _note)))
                count = write_campaign_of(opened, mine, new, _header(opened, like))
                what = "runs"
        if suffix in TABLES:
            beside = write_results(recording, out, suffix, wheel)
        elif not suffix:
            chosen = mine[0].wheel if mine else wheel
            beside = write_results(recording, out, ".csv", chosen)
            left = sum(left_out(segment, opened.conditions) for segment in mine)
            if left:
                click.echo(
                    f"note: the first {left} samples are left out: the bus had not yet sent "
                    "the conditions"
                )
        damage = getattr(opened, "damage", "") if opened.complete is False else ""
    click.echo(f"{count} {what} in {out}")
    for file in beside:
        click.echo(f"also written: {file}")
    if damage:
        click.echo(f"note: the recording is incomplete ({damage})")
    if json_file is not None:
        write_json(
            json_file,
            {"format": "tirebench-export/1", "out": str(out), what: count, "complete": not damage},
        )
    context.exit(0 if count and not damage else 1)


def _quiet(_: str) -> None:
    """Say nothing: what is decoded to find its wheels is decoded again."""


def _note(said: str) -> None:
    click.echo(
        f"note: {said}; the samples are as they were sent, and their times follow the rate "
        "in the header"
    )


def _of_one_wheel(found: list[Segment]) -> list[Segment]:
    """Return the segments of the wheel that was heard first."""
    return [segment for segment in found if segment.wheel == found[0].wheel]


def _header(recording: Recording, like: Path | None) -> CampaignHeader:
    """Return tire and gages, from the campaign that is named or from the recording."""
    campaign = recording.conditions.campaign
    if like is None and campaign is None:
        raise RecordingError(
            f"{recording.path}: it holds no tire and gage data; these are needed for a campaign; "
            "name a campaign that has them with --like DIR"
        )
    if like is not None:
        header, problems = parse_header(like)
    else:
        with tempfile.TemporaryDirectory() as name:
            try:
                text = tomli_w.dumps(campaign or {})
                (Path(name) / "campaign.toml").write_text(text, encoding="utf-8")
            except (TypeError, ValueError, RecursionError) as error:
                raise RecordingError(
                    f"{recording.path}: its tire and gage data are damaged ({error}); sound ones "
                    "are needed for a campaign; name a campaign that has them with --like DIR"
                ) from None
            header, problems = parse_header(Path(name))
    if header is None:
        raise RecordingError("\n".join(str(problem) for problem in problems))
    return header
