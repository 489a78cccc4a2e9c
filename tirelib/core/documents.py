"""Results as JSON documents, and the hashes of the files that they come from."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.errors import FormatError
from tirelib.core.version import __version__


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Make the folder of a file that is about to be written, and yield the file.

    Raises
    ------
    FormatError
        If the folder cannot be made, or what the block writes cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield path
    except OSError as error:
        raise FormatError(
            f"{path}: cannot be written ({error.strerror}); choose another file"
        ) from None


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Write JSON with the version of tirelib; NaN and infinity become null.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    with new_file(path):
        path.write_text(json.dumps(plain(stamped(document)), indent=1, allow_nan=False) + "\n")


def stamped(document: dict[str, Any]) -> dict[str, Any]:
    """Return a document with the version that writes it, behind its format."""
    head = {key: document[key] for key in ("format",) if key in document}
    return {**head, "tirelib": __version__, **document}


def plain(value: Any) -> Any:
    """Return numbers and containers as JSON knows them."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value.tolist()]
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file, in hex; the file may be larger than the memory."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
