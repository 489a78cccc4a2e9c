"""How the noise of forces depends on the constants of `tirelib.inference.identify.force_noise`.

    python build/force_noise.py [CAMPAIGN...]

A sweep of the tests, whose noise is known, and campaigns of the user's own: the noise with the
constants as they are, half and double.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.magic_sweep import Sweep, magic_sweep
from tirelib.campaign import read_campaign
from tirelib.core.threads import one_thread
from tirelib.inference.identify import force_noise
from tirelib.inference.identify.force_data import FORCES, force_data
from tirelib.inference.identify.force_points import ForcePoints, force_points

CONSTANTS = ("FEWEST_NEIGHBOURS", "MOST_NEIGHBOURS", "NEIGHBOUR_REACH", "STEEPEST")


def main() -> None:
    """Print a line for each force and constant."""
    sweep = force_points(magic_sweep(81, {}))
    repeated = np.bincount(sweep.cell)[sweep.cell] > 1
    truth = Sweep().noise * np.sqrt(np.mean(1.0 / sweep.samples[repeated]))
    _say(f"sweep of the tests, true noise {truth:.2f} N")
    _table("sweep", sweep)
    for folder in sys.argv[1:]:
        _table(Path(folder).name, force_points(force_data(read_campaign(Path(folder)))))


def _table(name: str, points: ForcePoints) -> None:
    for quantity in FORCES:
        force = getattr(points.data, quantity)
        if not np.isfinite(force).all():
            continue
        _say(f"{name} {quantity}: {_noise(points, force):.3g}")
        for constant in CONSTANTS:
            usual = getattr(force_noise, constant)
            told = []
            for factor in (0.5, 2.0):
                setattr(force_noise, constant, type(usual)(factor * usual))
                told.append(f"{_noise(points, force):.3g}")
            setattr(force_noise, constant, usual)
            _say(f"  {constant} half {told[0]}, double {told[1]}")


def _noise(points: ForcePoints, force: np.ndarray) -> float:
    return force_noise.force_noise(points, force)[0]


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    with one_thread():
        main()
