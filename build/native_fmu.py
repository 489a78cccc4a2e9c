"""Compile ``fmu_src/core`` and ``fmu_src/fmi2`` for every platform: same sources, same bytes.

    pip install ziglang==0.17.1
    python build/native_fmu.py

The binaries go to ``fmu_src/binaries``, one folder a platform, named as FMI names them. The
compiler comes with the C libraries of all of them: glibc 2.17 or newer, Windows with the UCRT
(10 and newer), macOS 11 or newer on both kinds of Mac.
"""

import hashlib
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "fmu_src"
FLAGS = (
    *("-shared", "-O2", "-s", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"),
    *("-ffp-contract=off", "-fno-sanitize=undefined", "-fvisibility=hidden"),
)
ELF = ("-fPIC", "-Wl,--build-id=none", "-lm")
PLATFORMS = {
    "linux64/StrainTire.so": (("x86_64-linux-gnu.2.17", ELF),),
    "aarch64-linux/StrainTire.so": (("aarch64-linux-gnu.2.17", ELF),),
    "win64/StrainTire.dll": (("x86_64-windows-gnu", ()),),
    "darwin64/StrainTire.dylib": (("x86_64-macos.11.0", ()), ("aarch64-macos.11.0", ())),
}
_CPU = {"x86_64": (0x01000007, 3), "aarch64": (0x0100000C, 0)}
_PAGE = 1 << 14


def sources() -> list[Path]:
    """Return all sources, in the order in which they are hashed and compiled."""
    return sorted(path for name in ("core", "fmi2") for path in (FOLDER / name).glob("*.[ch]"))


def source_hash() -> str:
    """Return the hash of names and contents of all sources."""
    digest = hashlib.sha256()
    for path in sources():
        digest.update(f"{path.parent.name}/{path.name}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


def compiled(platform: str) -> bytes:
    """Return the binary of a platform."""
    parts = []
    for target, flags in PLATFORMS[platform]:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / Path(platform).name
            command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *FLAGS]
            command.append(f'-DSOURCE="{source_hash()}"')
            command += [str(path.relative_to(FOLDER)) for path in sources() if path.suffix == ".c"]
            subprocess.run([*command, *flags, "-o", str(out)], check=True, cwd=FOLDER)
            parts.append((target.split("-")[0], out.read_bytes()))
    return parts[0][1] if len(parts) == 1 else universal(parts)


def universal(parts: list[tuple[str, bytes]]) -> bytes:
    """Return one file for several kinds of Mac (Apple, *Mach-O fat headers*, ``mach-o/fat.h``)."""
    head, body = struct.pack(">II", 0xCAFEBABE, len(parts)), b""
    for cpu, data in parts:
        start = _PAGE * (1 + len(body) // _PAGE)
        head += struct.pack(">IIIII", *_CPU[cpu], start, len(data), 14)
        body += data + bytes(-len(data) % _PAGE)
    return head + bytes(_PAGE - len(head)) + body


if __name__ == "__main__":
    for platform in PLATFORMS:
        path = FOLDER / "binaries" / platform
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(compiled(platform))
        sys.stdout.write(f"{platform}: {path.stat().st_size} bytes\n")
