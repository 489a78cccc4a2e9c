"""Compile the gate of the FMUs, `fmu_src/gate/gate.c`, for linux64: same source, same bytes.

    pip install ziglang==0.17.1
    python build/fmu_gate.py

The compiler comes with the C library's versions of old, so that the gate runs on every Linux with
glibc 2.17 or newer, as pythonfmu's own library does from 2.32 on.
"""

import hashlib
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "fmu_src" / "gate"
FLAGS = (
    "-target",
    "x86_64-linux-gnu.2.17",
    "-shared",
    "-fPIC",
    "-Os",
    "-s",
    "-std=c11",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-fvisibility=default",
    "-Wl,--build-id=none",
)


def compiled(source: Path, target: Path) -> None:
    """Compile a gate; its source's hash becomes part of it."""
    digest = hashlib.sha256(source.read_bytes()).hexdigest()
    command = (
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        *FLAGS,
        f'-DSOURCE="{digest}"',
        str(source),
        "-ldl",
        "-o",
        str(target),
    )
    subprocess.run(command, check=True)


if __name__ == "__main__":
    compiled(FOLDER / "gate.c", FOLDER / "linux64.so")
