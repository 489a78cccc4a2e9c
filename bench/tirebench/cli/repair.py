"""``tirebench repair``: completes a recording or JSON that was cut off."""

import json
from pathlib import Path

import click

from tirebench.errors import RecordingError
from tirebench.recording.journal import HEAD, completed, whole_document
from tirebench.recording.new_file import whole
from tirebench.recording.repair import repair as repaired
from tirelib.cli.common import FILE, NEW_FILE, plain

_EXAMPLE = """\b
Examples:
  tirebench repair live.mcap --out whole.mcap     # after the run was killed or the power failed
  tirebench repair live.json --out whole.json

\b
The new file has an index, so that readers which need one (Foxglove) can open it; the old file is
not changed. From JSON the turns are recovered; replay the recording to get the summary too.
A damaged chunk of a recording is left out and its frames are lost; what follows it is kept.
Each part of a recording is repaired by itself.
Exit code: 0 done, also where the file was complete; 2 nothing can be read.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("file", metavar="FILE", type=FILE)
@click.option("--out", metavar="FILE", type=NEW_FILE, required=True, help="New file to write.")
def repair(file: Path, out: Path) -> None:
    """Complete a recording, or the JSON of a run, that was cut off."""
    if out.exists():
        raise RecordingError(f"{out}: already exists; repair never overwrites; name another file")
    if _is_json(file):
        document = completed(text := file.read_text(encoding="utf-8", errors="replace"))
        document = document or whole_document(text)
        if document is None:
            raise RecordingError(
                f"{file}: it holds no turns; a file that `tirebench run --json` "
                "wrote is needed; check the path"
            )
        with whole(out) as new:
            new.write_text(json.dumps(plain(document), indent=1, allow_nan=False) + "\n")
        click.echo(f"{len(document['turns'])} turns in {out}")
        return
    found = repaired(file, out)
    click.echo(f"{found.messages} messages of {len(found.topics)} topics in {out}")
    if found.damage:
        click.echo(f"note: {file} is incomplete ({found.damage})")


def _is_json(file: Path) -> bool:
    try:
        with file.open("rb") as opened:
            return opened.read(len(HEAD)).lstrip()[:1] == b"{"
    except OSError as error:
        raise RecordingError(
            f"{file}: it cannot be read ({error.strerror}); a recording or JSON of `tirebench run` "
            "is needed; check the path"
        ) from None
