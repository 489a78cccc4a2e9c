"""What is checked of the library for Macs without a Mac: format, dependencies, signature.

Structures: Apple, ``mach-o/fat.h``, ``mach-o/loader.h``, ``mach-o/nlist.h``, and of the signature
``kern/cs_blobs.h``. Numbers of the headers are in the comments.
"""

import hashlib
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path
from shutil import which

import pytest

BINARIES = Path(__file__).parents[2] / "fmu_src" / "binaries"
INTEL, APPLE = 0x01000007, 0x0100000C


def slices() -> dict[int, bytes]:
    """Return the libraries of the file by their kind of processor."""
    data = (BINARIES / "darwin64" / "StrainTire.dylib").read_bytes()
    magic, count = struct.unpack_from(">II", data)
    assert magic == 0xCAFEBABE
    rows = [struct.unpack_from(">IIIII", data, 8 + 20 * k) for k in range(count)]
    assert all(start % (1 << align) == 0 for _, _, start, _, align in rows)
    return {cpu: data[start : start + size] for cpu, _, start, size, _ in rows}


def commands(library: bytes) -> Iterator[tuple[int, bytes]]:
    """Give the load commands of a library: number and bytes."""
    magic, _, _, kind, count, size = struct.unpack_from("<IIIIII", library)
    assert (magic, kind) == (0xFEEDFACF, 6)  # MH_MAGIC_64, MH_DYLIB
    at = 32
    for _ in range(count):
        number, length = struct.unpack_from("<II", library, at)
        yield number & 0x7FFFFFFF, library[at : at + length]  # without LC_REQ_DYLD
        at += length
    assert at == 32 + size


def text(command: bytes) -> str:
    """Return the name in a command about a library."""
    return command[struct.unpack_from("<I", command, 8)[0] :].split(b"\0")[0].decode()


def exported(library: bytes) -> set[str]:
    """Return the names that are defined for others."""
    (table,) = (command for number, command in commands(library) if number == 0x2)  # LC_SYMTAB
    first, count, names, _ = struct.unpack_from("<IIII", table, 8)
    found = set()
    for k in range(count):
        name, kind, section, _, _ = struct.unpack_from("<IBBHQ", library, first + 16 * k)
        if kind & 0x1 and not kind & 0x10 and section:  # N_EXT, not N_PEXT
            found.add(library[names + name :].split(b"\0", 1)[0].decode())
    return {name.removeprefix("_") for name in found} - {"__dso_handle", "_mh_dylib_header"}


@pytest.mark.parametrize("cpu", [INTEL, APPLE])
def test_it_needs_nothing_but_a_mac_with_system_11(cpu: int) -> None:
    found = list(commands(slices()[cpu]))
    (build,) = (command for number, command in found if number == 0x32)  # LC_BUILD_VERSION
    assert struct.unpack_from("<II", build, 8) == (1, 11 << 16)  # macOS 11.0
    assert [text(c) for n, c in found if n == 0xC] == ["/usr/lib/libSystem.B.dylib"]
    assert [text(c) for n, c in found if n == 0xD] == ["@rpath/StrainTire.dylib"]


@pytest.mark.parametrize("cpu", [INTEL, APPLE])
def test_it_has_the_functions_of_the_library_for_linux(cpu: int) -> None:
    if which("nm") is None:
        pytest.skip("no nm on this machine")
    command = ["nm", "-D", "--defined-only", BINARIES / "linux64" / "StrainTire.so"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert exported(slices()[cpu]) == {line.split()[2] for line in lines}


def test_its_signature_is_that_of_its_bytes() -> None:
    """A Mac with a processor of Apple's loads no library without one, be it of nobody (ad hoc)."""
    library = slices()[APPLE]
    (place,) = (command for number, command in commands(library) if number == 0x1D)
    start, size = struct.unpack_from("<II", place, 8)
    blob = library[start : start + size]
    magic, _, count = struct.unpack_from(">III", blob)
    assert magic == 0xFADE0CC0  # CSMAGIC_EMBEDDED_SIGNATURE
    directories = dict(struct.unpack_from(">II", blob, 12 + 8 * k) for k in range(count))
    signed = blob[directories[0] :]  # CSSLOT_CODEDIRECTORY
    magic, _, _, flags, hashes, _, _, pages, limit = struct.unpack_from(">IIIIIIIII", signed)
    assert (magic, flags & 0x2, limit) == (0xFADE0C02, 0x2, start)  # CS_ADHOC
    length, kind, _, shift = struct.unpack_from(">BBBB", signed, 36)
    assert (length, kind, pages) == (32, 2, 1 + (limit - 1 >> shift))  # SHA-256, all pages
    for k in range(pages):
        page = library[k << shift : min((k + 1) << shift, limit)]
        assert signed[hashes + 32 * k :][:32] == hashlib.sha256(page).digest()
