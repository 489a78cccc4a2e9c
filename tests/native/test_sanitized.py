"""Sanitizers find nothing in the core, whatever it is fed: damaged files, wild samples, calls."""

import os
import shutil
import subprocess
import zipfile
from pathlib import Path

import native_fmu
import numpy as np
import pytest

from tests.fmu import live, virtual_host
from tests.native.core import SOURCE

HERE = Path(__file__).parent
SANITIZERS = (
    *("-g", "-O1", "-fno-omit-frame-pointer", "-fno-sanitize-recover=all"),
    "-fsanitize=address,undefined,float-cast-overflow",
)
INPUTS = int(os.environ.get("TIRELIB_FUZZ", "300"))
"""How many inputs are tried; each takes ten milliseconds."""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The core under sanitizers, with a driver that makes up what it is fed."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    out = tmp_path_factory.mktemp("fuzz") / "fuzz"
    rooms = [SOURCE, *(SOURCE.parent / room for room in ("tire", "slave", "fmi2", "fmi3"))]
    sources = [source for room in rooms for source in room.glob("*.c")]
    flags = (*native_fmu.C99, *native_fmu.STRICT, *SANITIZERS, "-DALONE")
    command = [compiler, *flags, HERE / "fuzz.c", *sorted(sources), "-lm", "-o", out]
    subprocess.run(command, check=True)
    return out


@pytest.fixture(scope="module")
def fed(program: Path) -> Path:
    """What the driver starts from: an FMU's numbers, and samples of a wheel."""
    folder = program.parent / "fed"
    for place in (folder, folder / "virtual"):
        (place / "damaged").mkdir(parents=True)
    with zipfile.ZipFile(live.fmu_file(10)) as archive:
        core = archive.read("resources/StrainTire.core")
    (folder / "StrainTire.core").write_bytes(core)
    with zipfile.ZipFile(virtual_host.file(10)) as archive:
        surface = archive.read("resources/VirtualTire.core")
    (folder / "virtual" / "VirtualTire.core").write_bytes(surface)
    strain = live.strain_of(4e3, 0.1, turns=6.4)[0]
    np.ascontiguousarray(strain.T).tofile(folder / "samples.bin")
    return folder


@pytest.mark.parametrize("seed", [1, 2])
def test_sanitizers_are_silent(program: Path, fed: Path, seed: int) -> None:
    done = subprocess.run(
        [program, str(seed), str(INPUTS)],
        capture_output=True,
        text=True,
        env=os.environ | {"FUZZ": str(fed), "UBSAN_OPTIONS": "print_stacktrace=1"},
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, f"{INPUTS} inputs\n"), done.stderr[-3000:]
