"""CPU time of four wheels in a drive: virtual tires that Python computes, and compiled ones.

    python build/cosim/loop_speed.py [--seconds 3]

The same course of wheel states (a multi-body vehicle's) goes through four virtual and four strain
tires, stepped by FMPy as in ``make cosim``. CPU time is that of this process, so that a busy
machine changes it little; what the wheels say is compared.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from cosim.calibrate import CALIBRATION
from cosim.manoeuvres import MANOEUVRES
from cosim.recording import RATE, TIME_STEP, drive, follow
from cosim.wheels import FourWheels
from tirelib.core.threads import one_thread
from tirelib.fmu.build import build_fmu
from tirelib.fmu.virtual.spec import build_virtual, friction_surface


def main() -> None:
    """Build, drive, follow with each, print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=float, default=3.0)
    given = options.parse_args()
    steps, samples = round(given.seconds / TIME_STEP), round(TIME_STEP * RATE)
    begin = time.process_time()
    course = [
        m.wheels for m, _ in zip(drive(next(iter(MANOEUVRES.values()))), range(steps), strict=False)
    ]
    spent = (time.process_time() - begin) / len(course)
    sys.stdout.write(f"vehicle: {1e6 * spent:.0f} us a step of {1e3 * TIME_STEP:g} ms\n")
    told = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        strain = {
            python: build_fmu(
                CALIBRATION,
                folder / f"S{python}.fmu",
                samples_per_step=samples,
                sample_rate=RATE,
                python=python,
            )
            for python in (True, False)
        }
        virtual = {
            python: build_virtual(
                folder / f"V{python}.fmu",
                samples_per_step=samples,
                sample_rate=RATE,
                surface=friction_surface(),
                python=python,
            )
            for python in (True, False)
        }
        for tire, estimator in ((True, True), (True, False), (False, False)):
            with FourWheels(virtual[tire], strain[estimator]) as wheels:
                begin = time.process_time()
                told[tire] = follow(course, wheels)
                spent = (time.process_time() - begin) / len(course)
            words = [f"{'Python' if k else 'compiled'}" for k in (tire, estimator)]
            sys.stdout.write(
                f"virtual tires {words[0]}, strain tires {words[1]}: {1e6 * spent:.0f} us a step "
                f"of four wheels\n"
            )
    apart = [
        np.nanmax(np.abs(told[True][name] - values) / np.nanmax(np.abs(values)), initial=0.0)
        for name, values in told[False].items()
        if values.dtype.kind == "f" and np.isfinite(values).any()
    ]
    sys.stdout.write(f"what the wheels say is at most {max(apart):.1e} of its size apart\n")


if __name__ == "__main__":
    with one_thread():
        main()
