"""Compile the C of the FMUs, the core and the gate: same sources, same bytes.

    pip install ziglang==0.17.1
    python build/native_fmu.py

The estimator, the virtual tire and the functions of FMI 2.0 and 3.0 (``fmu_src/core``, ``tire``,
``slave``, ``fmi2``, ``fmi3``) become one library for every platform in ``fmu_src/binaries``, whose
folders are named as FMI 2.0 names them; the gate before pythonfmu's library (``fmu_src/gate``) is
for Linux. The compiler comes with the C libraries of all of them: glibc 2.17 or newer, Windows with
the UCRT (10 and newer), macOS 11 or newer on both kinds of Mac.
"""

import hashlib
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "fmu_src"
STRICT = ("-Wall", "-Wextra", "-Werror")
C99 = ("-std=c99", "-pedantic", "-ffp-contract=off")
"""The core's language; a product must not be fused with a sum."""
SHARED = ("-shared", "-s")
LINUX = ("-fPIC", "-Wl,--build-id=none")
MAC = ("-Wl,-install_name,@rpath/StrainTire.dylib",)
"""Without a name the linker takes the path of its output, which is another one in every run."""
CORE = (*SHARED, "-O2", *C99, *STRICT, "-fno-sanitize=undefined", "-fvisibility=hidden")
GATE = (*SHARED, "-Os", "-std=c11", *STRICT, "-fvisibility=default")
_CPU = {"x86_64": (0x01000007, 3), "aarch64": (0x0100000C, 0)}
_PAGE = 1 << 14


@dataclass(frozen=True, slots=True)
class Binary:
    """A library to be made.

    Attributes
    ----------
    rooms : sequence of str
        Files, or folders of C files, of ``fmu_src``.
    flags, libraries : sequence of str
    targets : sequence of str
        What the compiler calls a platform; several become one file for both kinds of Mac.
    """

    rooms: Sequence[str]
    flags: Sequence[str]
    targets: Sequence[str]
    libraries: Sequence[str] = ()

    def sources(self) -> list[Path]:
        """Return all sources, in the order in which they are hashed and compiled."""
        places = [FOLDER / room for room in self.rooms]
        files = {file for place in places for file in place.glob("*.[ch]")}
        return sorted(files | {place for place in places if place.is_file()})

    def source_hash(self) -> str:
        """Return the hash of names and contents of all sources."""
        digest = hashlib.sha256()
        for path in self.sources():
            digest.update(f"{path.parent.name}/{path.name}\0".encode() + path.read_bytes() + b"\0")
        return digest.hexdigest()

    def compiled(self) -> bytes:
        """Return the library; its sources' hash becomes part of it."""
        files = [str(path.relative_to(FOLDER)) for path in self.sources() if path.suffix == ".c"]
        parts = []
        for target in self.targets:
            with tempfile.TemporaryDirectory() as folder:
                out = Path(folder) / "library"
                command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *self.flags]
                command += [f'-DSOURCE="{self.source_hash()}"', *files, *self.libraries]
                subprocess.run([*command, "-o", str(out)], check=True, cwd=FOLDER)
                parts.append((target.split("-")[0], out.read_bytes()))
        return parts[0][1] if len(parts) == 1 else universal(parts)


_CORE = ("core", "tire", "slave", "fmi2", "fmi3")
BINARIES = {
    "binaries/linux64/StrainTire.so": Binary(
        _CORE, (*CORE, *LINUX), ("x86_64-linux-gnu.2.17",), ("-lm",)
    ),
    "binaries/aarch64-linux/StrainTire.so": Binary(
        _CORE, (*CORE, *LINUX), ("aarch64-linux-gnu.2.17",), ("-lm",)
    ),
    "binaries/win64/StrainTire.dll": Binary(_CORE, CORE, ("x86_64-windows-gnu",)),
    "binaries/darwin64/StrainTire.dylib": Binary(
        _CORE, (*CORE, *MAC), ("x86_64-macos.11.0", "aarch64-macos.11.0")
    ),
    "gate/linux64.so": Binary(
        ("gate/gate.c", "fmi2/fmi2.h"), (*GATE, *LINUX), ("x86_64-linux-gnu.2.17",), ("-ldl",)
    ),
}
"""By place in ``fmu_src``."""


def universal(parts: list[tuple[str, bytes]]) -> bytes:
    """Return one file for several kinds of Mac (Apple, *Mach-O fat headers*, ``mach-o/fat.h``)."""
    head, body = struct.pack(">II", 0xCAFEBABE, len(parts)), b""
    for cpu, data in parts:
        start = _PAGE * (1 + len(body) // _PAGE)
        head += struct.pack(">IIIII", *_CPU[cpu], start, len(data), 14)
        body += data + bytes(-len(data) % _PAGE)
    return head + bytes(_PAGE - len(head)) + body


if __name__ == "__main__":
    for place, binary in BINARIES.items():
        path = FOLDER / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(binary.compiled())
        sys.stdout.write(f"{place}: {path.stat().st_size} bytes\n")
