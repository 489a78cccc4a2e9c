"""Several threads of a C program, each with an instance of its own, get what one alone gets."""

import shutil
import subprocess
import sys
from pathlib import Path

import native_fmu
import numpy as np
import pytest
from fmpy import extract, read_model_description

from tests.fmu import live
from tests.native.core import SOURCE
from tests.synthetic import LATERAL
from tirelib.core.held import HELD

HOST = Path(__file__).with_name("threads.c")
THREADS, SAMPLES = 4, 10
RACES = ("-g", "-O0", "-fsanitize=thread")


def compiled_library(out: Path, *flags: str) -> Path:
    """Compile the sources of the FMU."""
    rooms = [SOURCE, *(SOURCE.parent / room for room in ("tire", "slave", "fmi2", "fmi3"))]
    sources = sorted(source for room in rooms for source in room.glob("*.c"))
    command = ["gcc", *native_fmu.C99, *native_fmu.STRICT, *flags, *sources]
    subprocess.run([*command, "-shared", "-fPIC", "-lm", "-o", out], check=True)
    return out


def compiled_host(out: Path, *flags: str) -> Path:
    """Compile the host that loads them."""
    command = ["gcc", "-std=c99", *flags, HOST, "-ldl", "-lm", "-pthread", "-o", out]
    subprocess.run(command, check=True)
    return out


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Samples of a wheel, and the host."""
    if shutil.which("gcc") is None or sys.platform != "linux":
        pytest.skip("no gcc on this machine, or it is not Linux")
    out = tmp_path_factory.mktemp("threads")
    compiled_host(out / "plain", "-O1")
    strain = live.strain_of(4e3, 0.05, turns=4.4)[0]
    n = strain.shape[1] // SAMPLES
    known = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
    held = np.tile([known.get(name, np.nan) for name in HELD], (n, 1))
    np.hstack((strain[:, : n * SAMPLES].T.reshape(n, -1), held)).tofile(out / "frames")
    return out


@pytest.fixture(scope="module")
def fmu(folder: Path) -> Path:
    """An unpacked FMU of the estimator."""
    return Path(extract(str(live.fmu_file(SAMPLES)), unzipdir=str(folder / "fmu")))


def run(host: Path, library: Path, fmu: Path, threads: int) -> list[np.ndarray]:
    """Return what each thread got, shape (2 n steps, 8)."""
    guid = read_model_description(str(fmu), validate=False).guid
    width, out = len(LATERAL) * SAMPLES + len(HELD), host.parent / f"{library.stem}{threads}-"
    arguments = [library, guid, (fmu / "resources").as_uri(), host.parent / "frames", str(width)]
    command = [host, *arguments, repr(SAMPLES / live.RATE), out, str(threads)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return [np.fromfile(f"{out}{number}").reshape(-1, 8) for number in range(threads)]


def test_threads_get_what_one_alone_gets(folder: Path, fmu: Path) -> None:
    shipped = fmu / "binaries" / "linux64" / "StrainTire.so"
    (alone,) = run(folder / "plain", shipped, fmu, 1)
    first, second = np.split(alone, 2)
    np.testing.assert_array_equal(first, second)
    assert np.isfinite(first[-1]).any()
    for one in run(folder / "plain", shipped, fmu, THREADS):
        np.testing.assert_array_equal(one, alone)


def test_an_importer_may_trap_exceptions_round_upwards_and_have_small_stacks(
    folder: Path, fmu: Path
) -> None:
    odd = compiled_host(folder / "odd", "-O1", "-DODD")
    shipped = fmu / "binaries" / "linux64" / "StrainTire.so"
    (alone,) = run(folder / "plain", shipped, fmu, 1)
    for one in run(odd, shipped, fmu, THREADS):
        np.testing.assert_array_equal(one, alone)


def test_the_thread_sanitizer_sees_no_race(folder: Path, fmu: Path) -> None:
    empty = folder / "empty.c"
    empty.write_text("int main(void) { return 0; }\n")
    command = ["gcc", *RACES, empty, "-o", empty.with_suffix("")]
    if subprocess.run(command, check=False, capture_output=True).returncode:
        pytest.skip("the thread sanitizer is not installed")
    watched = compiled_library(folder / "races.so", *RACES)
    (alone,) = run(folder / "plain", compiled_library(folder / "plain.so", "-O0"), fmu, 1)
    for one in run(compiled_host(folder / "races", *RACES), watched, fmu, THREADS):
        np.testing.assert_array_equal(one, alone)
