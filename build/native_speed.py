"""Time of a step of the compiled FMU in a C host, beside an FMU that does nothing.

    python build/native_speed.py [--samples 10] [--repeat 50]
    python build/native_speed.py --repeat 235        # ten million samples

A step is what an importer does: set frame and conditions, step, get the estimates. Needs gcc. Both
FMUs do the same number of steps. Times by the clock include pauses by the operating system. The CPU
time of the thread does not, but still holds what the system does within it (interrupts, caches that
other programs emptied, other guests of a virtual machine); reading it costs as much as the empty
FMU shows. "Again" is the worst place of the record at its best repetition: work that is there every
time. "Arithmetic" is a third FMU, which only multiplies, 37 us at the end of each turn, and touches
no memory: how much longer its worst step takes is the machine's part. Four wheels are then stepped
in real time, where each step finds the processor's caches as others left them.
"""

import argparse
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from fmpy import read_model_description

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.fmu import live
from tests.synthetic import record
from tirelib.core.held import HELD
from tirelib.core.threads import one_thread
from tirelib.fmu.build import build_fmu

ROOT = Path(__file__).parents[1]

RATE = 1e4
COLUMNS = ("mean", "least", "median", "99 %", "99.9 %", "99.99 %", "99.999 %", "again", "worst")
FMU = """
static int wheel;
void *fmi2Instantiate(void) { return &wheel; }
int fmi2ExitInitializationMode(void) { return 0; }
int fmi2SetReal(void) { return 0; }
int fmi2GetReal(void) { return 0; }
"""
EMPTY = FMU + "int fmi2DoStep(void) { return 0; }"
# 86 steps of ten samples are a turn of the record; a multiplication waits for the one before
ARITHMETIC = (
    FMU
    + """
static volatile double seed = 1.0;
int fmi2DoStep(void) {
    static int step;
    int n = step++ % 86 ? 450 : 50000;
    double x = seed;
    while (n--) x *= 1.0000001;
    return x < 0.0;
}
"""
)


def frames(samples: int) -> np.ndarray:
    """Return strain of forty turns and the conditions, shape (steps, doubles of a step)."""
    strain = record(turns=40.0, speed=live.SPEED, noise=4e-6, rate=RATE, tilt=0.05, dip=2.6e-3)[0]
    n = strain.shape[1] // samples
    known = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
    held = np.tile([known.get(name, np.nan) for name in HELD], (n, 1))
    return np.hstack((strain[:, : n * samples].T.reshape(n, -1), held))


def main() -> None:
    """Build, compile, run, print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--samples", type=int, default=10)
    options.add_argument("--repeat", type=int, default=50)
    given = options.parse_args()
    folder = Path(tempfile.mkdtemp())
    fmu = build_fmu(
        live.calibration_file(),
        folder / "x.fmu",
        samples_per_step=given.samples,
        sample_rate=RATE,
    )
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder / "x")
    guid = read_model_description(str(folder / "x"), validate=False).guid
    data = frames(given.samples)
    data.tofile(folder / "frames")
    gcc = ["gcc", "-O2", "-std=c99"]
    for name, source in (("empty", EMPTY), ("arithmetic", ARITHMETIC)):
        (folder / f"{name}.c").write_text(source)
        library = folder / f"{name}.so"
        subprocess.run([*gcc, "-shared", "-fPIC", folder / f"{name}.c", "-o", library], check=True)
    host = folder / "host"
    subprocess.run([*gcc, ROOT / "build" / "native_speed.c", "-ldl", "-o", host], check=True)
    native = folder / "x" / "binaries" / "linux64" / "StrainTire.so"
    libraries = {"empty": folder / "empty.so", "arithmetic": folder / "arithmetic.so"}
    for name, library in {**libraries, "native": native}.items():
        *told, share = subprocess.run(
            [
                *(host, library, guid, (folder / "x" / "resources").as_uri(), folder / "frames"),
                *(str(data.shape[1]), repr(given.samples / RATE), str(given.repeat)),
            ],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()
        steps = data.shape[0] * given.repeat
        sys.stdout.write(f"{name}: {steps} steps of {given.samples} samples [us]\n")
        for by, line in zip(("clock", "CPU of the thread"), told, strict=True):
            numbers = (f"{1e6 * float(x):.2f}" for x in line.split())
            pairs = zip(COLUMNS, numbers, strict=True)
            sys.stdout.write(f"  {by}: {', '.join(f'{what} {x}' for what, x in pairs)}\n")
        sys.stdout.write(f"  four wheels in real time: {100 * float(share):.2f} % of a core\n")


if __name__ == "__main__":
    with one_thread():
        main()
