"""Step the delivered binaries of other platforms through the same frames as the one for Linux.

    pip install ziglang==0.17.1; apt-get install wine64 qemu-user libc6-arm64-cross
    python build/native_platforms.py

A C host is compiled for each platform and run: under wine for Windows, under qemu for AArch64. It
loads the FMU's library, whose resources lie in a folder with an odd name, and steps forty turns
three times: with refused steps between, by a second instance that reads its calibration from a
file, and after a reset with a state taken and given back. All three must give the same to the last
bit. The outputs are held against those on Linux; those are held against the library by the tests.
What cannot be run here is said.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from fmpy import read_model_description
from native_speed import RATE, frames

from tests.fmu import live
from tirelib.core.threads import one_thread
from tirelib.fmu.build import build_fmu
from tirelib.fmu.native import core_file

SAMPLES = 10
ODD = "50% Prüfstand #1"
HOST = Path(__file__).with_name("native_platforms.c")
PLATFORMS = {
    "linux64": ("x86_64-linux-gnu.2.17", "StrainTire.so", ()),
    "win64": ("x86_64-windows-gnu", "StrainTire.dll", ("wine64", "/usr/lib/wine/wine64")),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", "StrainTire.so", ("qemu-aarch64",)),
}
"""Folder of the binaries: the compiler's target, the library, and programs that run the host."""


def run(name: str, folder: Path, guid: str, data: np.ndarray) -> np.ndarray | None:
    """Return the outputs after each step on a platform; None where it cannot be run."""
    target, library, runners = PLATFORMS[name]
    runner = [path for path in map(shutil.which, runners) if path][:1]
    if runners and not runner:
        return None
    host, results = folder / f"host-{name}.exe", folder / f"{name}.bin"
    command = [sys.executable, "-m", "ziglang", "cc", "-O2", "-target", target, HOST, "-o", host]
    subprocess.run([*command, *(["-ldl"] if name != "win64" else [])], check=True)
    resources = (folder / ODD / "resources").as_uri()
    if name == "win64":
        resources = "file:///Z:" + resources.removeprefix("file://")
    arguments = [folder / "x" / "binaries" / name / library, guid, resources, folder / "frames"]
    settings = {**os.environ, "QEMU_LD_PREFIX": "/usr/aarch64-linux-gnu", "WINEDEBUG": "-all"}
    frame = (str(data.shape[1]), repr(SAMPLES / RATE))
    command = [*runner, host, *arguments, *frame, folder / "other.table", results]
    subprocess.run(command, check=True, env=settings)
    first, *again = np.fromfile(results).reshape(3, -1, 8)
    for one in again:
        np.testing.assert_array_equal(one, first)
    return first


def main() -> None:
    """Build, run everywhere, compare, print."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fmu = build_fmu(
            live.calibration_file(),
            folder / "x.fmu",
            samples_per_step=SAMPLES,
            sample_rate=RATE,
        )
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder / "x")
        (folder / ODD).mkdir()
        (folder / "x" / "resources").rename(folder / ODD / "resources")
        (folder / "other.table").write_bytes(core_file(live.calibration()))
        guid = read_model_description(str(folder / "x"), validate=False).guid
        data = frames(SAMPLES)
        data.tofile(folder / "frames")
        wanted = run("linux64", folder, guid, data)
        if wanted is None or not np.isfinite(wanted[-1]).any():
            raise SystemExit("linux64: the FMU estimates nothing; build its binaries again")
        for platform in PLATFORMS:
            found = wanted if platform == "linux64" else run(platform, folder, guid, data)
            if found is None:
                sys.stdout.write(f"{platform}: cannot be run here\n")
                continue
            np.testing.assert_array_equal(np.isfinite(found), np.isfinite(wanted))
            size = np.nanmax(np.abs(wanted), axis=0)
            apart = np.nanmax(np.abs(found - wanted) / size)
            sys.stdout.write(f"{platform}: {len(found)} steps, at most {apart:.1e} apart\n")


if __name__ == "__main__":
    with one_thread():
        main()
