"""How well calibrations serve VirtualTire.fmu: error, interval and validity on conditions of a car.

    python build/virtual_calibration.py car.toml build/cosim/calibration.toml --out virtual.json

The conditions are drawn as those of `tirelib fmu measure`, by another seed; strain comes from the
same response surface. Prints for each calibration and quantity the share of turns that are valid,
and of those the rms error, the median standard deviation and the share within two of them.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from tirelib.campaign import read_campaign
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration_file import read_calibration
from tirelib.fmu.virtual.drive import USUAL, design
from tirelib.fmu.virtual.measure import measure
from tirelib.fmu.virtual.spec import default_surface
from tirelib.fmu.virtual.surface import shared_surface
from tirelib.measured.observations import observe
from tirelib.measured.signal import LowPass

POINTS, SEED, DAY = 60, 11, 21
GENTLE = 2
"""Every other condition is upright, at 65 km/h and rolls freely, as the plan ``set1`` does."""


def conditions() -> np.ndarray:
    """Return the conditions, shape (n, 5)."""
    table = design(POINTS, USUAL, seed=SEED)
    table[::GENTLE, 2:] = 0.0, 0.0, 65.0 / 3.6
    return table


def judge(calibration: Path, folder: Path) -> dict[str, dict[str, float]]:
    """Return the figures of a calibration by quantity and kind of condition."""
    known = read_calibration(calibration)
    seen = observe([read_campaign(folder)], low_pass=LowPass(known.order, known.cut_off))
    estimates, out = known.estimate(seen.features), {}
    gentle = seen.run % GENTLE == 0
    kinds = {"free, upright, 65 km/h": gentle, "as a car": ~gentle}
    for kind, kept in kinds.items():
        rows = kept & seen.usable
        for name, channel in (("Fz", "Fz"), ("alpha", "slip_angle"), ("Fy", "Fy")):
            valid = estimates.valid[name] & rows
            error = (estimates.value[name] - seen.truth[channel])[valid]
            std = estimates.std[name][valid]
            out[f"{name}, {kind}"] = {
                "turns": float(rows.sum()),
                "valid": float(valid.sum() / rows.sum()),
                "rms": float(np.sqrt(np.mean(error**2))) if error.size else np.nan,
                "std": float(np.median(std)) if error.size else np.nan,
                "within": float(np.mean(np.abs(error) < 2.0 * std)) if error.size else np.nan,
            }
    return out


def main() -> None:
    """Measure once and judge every calibration."""
    parser = argparse.ArgumentParser(description="Judge calibrations on the virtual tire.")
    parser.add_argument("calibrations", nargs="+", type=Path, metavar="CAL.toml")
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        surface = shared_surface(default_surface())
        measure(surface, folder, conditions=conditions(), seed=DAY)
        found = {str(path): judge(path, folder) for path in given.calibrations}
    for path, rows in found.items():
        sys.stdout.write(f"{path}\n")
        for row, figures in rows.items():
            said = ", ".join(f"{name} {value:.4g}" for name, value in figures.items())
            sys.stdout.write(f"  {row}: {said}\n")
    if given.out is not None:
        given.out.write_text(json.dumps(found, indent=1), encoding="utf-8")


if __name__ == "__main__":
    with one_thread():
        main()
