"""Arrays for the page: one message with a head in JSON and 32-bit numbers behind it."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.errors import FormatError


def packed(file: Path) -> bytes:
    """Return the arrays of an .npz file as the page reads them.

    The first four bytes are the length of the head, little endian. The head names each array's
    shape and the place of its first number; texts stand in the head itself.

    Raises
    ------
    FormatError
        If the file cannot be read.
    """
    head: dict[str, Any] = {"arrays": {}, "texts": {}}
    parts: list[np.ndarray[Any, Any]] = []
    at = 0
    try:
        with np.load(file, allow_pickle=False) as data:
            for name in data.files:
                value = data[name]
                if value.dtype.kind in "US":
                    head["texts"][name] = str(value)
                    continue
                head["arrays"][name] = {"shape": list(value.shape), "at": at}
                parts.append(np.ascontiguousarray(value, dtype="<f4").ravel())
                at += value.size
    except (OSError, ValueError, EOFError) as error:
        raise FormatError(f"{file.name}: cannot be read ({error}); compute it again") from None
    words = json.dumps(head).encode()
    words += b" " * (-len(words) % 4)
    return struct.pack("<I", len(words)) + words + b"".join(part.tobytes() for part in parts)
