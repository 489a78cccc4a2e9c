"""What comes in from the page: folders that are looked at, files and archives that are dropped."""

import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from tirelib.core.errors import FormatError
from tirelib.studio.disk import safe_name

MOST_BYTES = 2 << 30
"""Bytes of one file that is dropped, of an archive's content, and of a folder in all."""
MOST_FILES = 2000
MOST_RATIO = 200
"""Times that an archive may grow: measurements shrink to a third, a bomb to a thousandth."""
MOST_DEPTH = 6
FOREIGN = (
    *(".mat", ".csv", ".tsv", ".txt", ".dat", ".parquet", ".tdx", ".tyd", ".tydex", ".mf4"),
    ".mdf",
)
"""Ends of the names of files that `tirelib import` reads."""


def browse(path: str, roots: Sequence[Path]) -> dict[str, Any]:
    """Return the folders of a folder, and which of them are campaigns.

    Parameters
    ----------
    path : str
        Empty for the list of roots.
    roots : sequence of Path
        Folders that may be looked into, with all that they hold.

    Raises
    ------
    FormatError
        If the folder is outside the roots, or cannot be read.
    """
    if not path:
        listed = [_entry(root, str(root)) for root in roots]
        return {"path": "", "parent": None, "folders": listed, "files": []}
    folder = inside(path, roots)
    try:
        every = sorted(folder.iterdir(), key=lambda one: one.name.lower())
        folders = [_entry(p, p.name) for p in every if p.is_dir() and not p.name.startswith(".")]
        files = [
            {"name": p.name, "path": str(p)}
            for p in every
            if p.is_file() and p.suffix.lower() in FOREIGN
        ]
    except OSError as error:
        raise FormatError(f"{folder}: cannot be read ({error.strerror}); choose another") from None
    parent = "" if any(folder == root for root in roots) else str(folder.parent)
    return {
        "path": str(folder),
        "parent": parent,
        "campaign": (folder / "campaign.toml").is_file(),
        "folders": folders[:500],
        "files": files[:500],
    }


def inside(path: str, roots: Sequence[Path]) -> Path:
    """Return a path as it is on disk, if it is inside one of the roots.

    Raises
    ------
    FormatError
        If it is not, links followed.
    """
    try:
        found = Path(path).expanduser().resolve()
    except (OSError, ValueError, RuntimeError):
        raise FormatError(f"{path!r}: it is no path; choose a folder of the list") from None
    if any(found == root or root in found.parents for root in roots):
        return found
    raise FormatError(
        f"{found}: it lies outside {', '.join(map(str, roots))}; choose a folder inside, or start "
        "`tirelib studio` with --root FOLDER"
    )


def _entry(folder: Path, name: str) -> dict[str, Any]:
    try:
        campaign = (folder / "campaign.toml").is_file()
    except OSError:
        campaign = False
    return {"name": name, "path": str(folder), "campaign": campaign}


def relative(name: str) -> Path:
    """Return the place of a dropped file inside its folder, each part made safe.

    Raises
    ------
    FormatError
        If the name is empty or goes up or is deeper than `MOST_DEPTH`.
    """
    parts = PurePosixPath(name.replace("\\", "/")).parts
    if not parts or len(parts) > MOST_DEPTH or any(p in ("..", "/") or ":" in p for p in parts):
        raise FormatError(
            f"{name!r}: a name inside the dropped folder is needed, at most {MOST_DEPTH} deep; "
            "drop the folder itself"
        )
    return Path(*(safe_name(part) for part in parts))


def unpack(archive: Path, target: Path) -> None:
    """Unpack a zip archive of a campaign or of measured files.

    Raises
    ------
    FormatError
        If it is no zip archive, holds too much, grows too much, or has links or names that lead
        outside.
    """
    try:
        with zipfile.ZipFile(archive) as opened:
            members = [info for info in opened.infolist() if not info.is_dir()]
            _refuse_bombs(archive, members)
            left = MOST_BYTES
            for info in members:
                place = target / relative(info.filename)
                place.parent.mkdir(parents=True, exist_ok=True)
                with opened.open(info) as source, place.open("wb") as sink:
                    while block := source.read(1 << 20):
                        left -= len(block)
                        if left < 0:
                            raise FormatError(
                                f"{archive.name}: it unpacks to more bytes than its index states"
                            )
                        sink.write(block)
    except (zipfile.BadZipFile, zlib.error, RuntimeError, EOFError) as error:
        raise FormatError(
            f"{archive.name}: it cannot be unpacked ({error}); pack it again without a password"
        ) from None


def _refuse_bombs(archive: Path, members: Sequence[zipfile.ZipInfo]) -> None:
    size = sum(info.file_size for info in members)
    packed = max(1, archive.stat().st_size)
    faults = []
    if len(members) > MOST_FILES:
        faults.append(f"{len(members)} files, {MOST_FILES} are allowed")
    if size > MOST_BYTES:
        faults.append(f"{size / 1e9:.3g} GB unpacked, {MOST_BYTES / 1e9:.3g} GB are allowed")
    if size > MOST_RATIO * packed + (1 << 20):
        faults.append(f"it grows {size / packed:.0f} times, {MOST_RATIO} times are allowed")
    if any((info.external_attr >> 16) & 0o170000 == 0o120000 for info in members):
        faults.append("it holds links")
    if faults:
        raise FormatError(f"{archive.name}: {'; '.join(faults)}; unpack it yourself and open it")


def campaign_in(folder: Path) -> Path | None:
    """Return the folder with campaign.toml among dropped files; None if there is none."""
    found = sorted(folder.rglob("campaign.toml"), key=lambda path: len(path.parts))
    return found[0].parent if found else None


def foreign_in(folder: Path) -> list[Path]:
    """Return the dropped files that `tirelib import` reads."""
    return sorted(p for p in folder.rglob("*") if p.is_file() and p.suffix.lower() in FOREIGN)
