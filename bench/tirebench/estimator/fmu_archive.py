"""An FMU file before it is trusted: its hash, and whether its archive may be unpacked.

An FMU is native code: to step it is to run it, with all rights of the user. The hash names what is
run; the checks keep the unpacking itself from doing harm.
"""

import hashlib
import io
import stat
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from tempfile import TemporaryDirectory

from tirebench.errors import FmuError
from tirebench.owned import prefix

LARGEST_FILE = 256 * 2**20
LARGEST_TOTAL = 512 * 2**20
LARGEST_COUNT = 20_000
LARGEST_RATIO = 200.0
"""Unpacked over packed size; an FMU's code and text reach about 10."""
RATIO_CHECKED_FROM = 2**20
"""Below this unpacked size a ratio says nothing, [bytes]."""
DESCRIPTION = "modelDescription.xml"


@dataclass(frozen=True, slots=True)
class FmuArchive:
    """An FMU in memory, so that what was checked is what is unpacked.

    Attributes
    ----------
    path : Path
    sha256 : str
        Hash of the file, hex.
    content : bytes
    """

    path: Path
    sha256: str
    content: bytes

    def unpack(self) -> "TemporaryDirectory[str]":
        """Unpack into a temporary folder, which the caller cleans up.

        Raises
        ------
        FmuError
            If the folder's path would break the FMU, or the archive is damaged.
        """
        folder = TemporaryDirectory(prefix=prefix())
        if (
            not all(c.isalnum() or c in "/\\:._- " for c in folder.name)
            or not folder.name.isascii()
        ):
            name = folder.name
            folder.cleanup()
            raise FmuError(
                f"{name}: a Python FMU crashes in a folder with such a name; a temporary folder "
                "with an ASCII name is needed; set TMPDIR"
            )
        try:
            with zipfile.ZipFile(io.BytesIO(self.content)) as archive:
                archive.extractall(folder.name)
        except Exception as error:  # of zipfile, zlib, lzma ...: damage provokes each of them
            folder.cleanup()
            raise FmuError(
                f"{self.path}: cannot be unpacked ({error}); an undamaged archive is needed; build "
                "the FMU again"
            ) from None
        return folder


def read_fmu(path: Path) -> FmuArchive:
    """Read and check an FMU file; nothing is unpacked.

    Raises
    ------
    FmuError
        With every reason why the archive must not be unpacked.
    """
    try:
        content = path.read_bytes()
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
    except OSError as error:
        raise FmuError(
            f"{path}: cannot be read ({error.strerror}); an FMU of `tirelib fmu build` is needed; "
            "check the path"
        ) from None
    except (zipfile.BadZipFile, ValueError, RuntimeError) as error:  # the last: a newer format
        raise FmuError(
            f"{path}: not an FMU ({error}); a zip archive is needed; build it with `tirelib fmu "
            "build`"
        ) from None
    problems = [f"{path}: {problem}; do not use this file" for problem in _problems(entries)]
    if problems:
        raise FmuError("\n".join(problems))
    return FmuArchive(path, hashlib.sha256(content).hexdigest(), content)


def _problems(entries: list[zipfile.ZipInfo]) -> Iterator[str]:
    """Yield why an archive must not be unpacked: given and allowed."""
    names = [entry.orig_filename for entry in entries]
    if DESCRIPTION not in names:
        yield f"{DESCRIPTION} is missing; every FMU has this file at its top level"
    if len(set(names)) != len(names):
        twice = sorted({name for name in names if names.count(name) > 1})[:3]
        yield f"{', '.join(twice)} occurs twice; every name may occur once"
    if len(entries) > LARGEST_COUNT:
        yield f"{len(entries)} files; at most {LARGEST_COUNT} are allowed"
    total = sum(entry.file_size for entry in entries)
    if total > LARGEST_TOTAL:
        yield f"{total} bytes when unpacked; at most {LARGEST_TOTAL} are allowed"
    for entry in entries:
        yield from _entry_problems(entry)


def _entry_problems(entry: zipfile.ZipInfo) -> Iterator[str]:
    name = entry.orig_filename
    windows = PureWindowsPath(name)
    if "\\" in name or "\0" in name or windows.is_absolute() or windows.drive or name[:1] == "/":
        yield f"{name!r} is not a relative path; only names below the FMU's folder are allowed"
    elif ".." in windows.parts:
        yield f"{name!r} leads out of the FMU's folder; only names below it are allowed"
    mode = entry.external_attr >> 16
    if stat.S_IFMT(mode) not in (0, stat.S_IFREG, stat.S_IFDIR):
        yield f"{name!r} is a link or a device; only files and folders are allowed"
    if entry.flag_bits & 0x1:
        yield f"{name!r} is encrypted; files of an FMU must not be"
    if entry.file_size > LARGEST_FILE:
        yield f"{name!r} has {entry.file_size} bytes; at most {LARGEST_FILE} are allowed"
    elif (
        entry.file_size > RATIO_CHECKED_FROM
        and entry.file_size > LARGEST_RATIO * entry.compress_size
    ):
        ratio = entry.file_size / max(entry.compress_size, 1)
        yield (
            f"{name!r} unpacks to {ratio:.0f} times its size; at most {LARGEST_RATIO:g} is allowed"
        )
