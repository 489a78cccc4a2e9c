"""Load levels of a calibration: errors and intervals between them.

What it found is in docs/theory/estimates_measured.md.

    python build/load_levels.py

The virtual tire of the tutorials is calibrated at 4 to 9 load levels and five slip angles, and
another day is estimated at fifteen loads between. A minute of one core.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

import tirelib
from tirelib.core.threads import one_thread

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs" / "tutorials"))
LOADS = np.arange(1700.0, 7400.0, 380.0)
"""Loads of the day that is estimated, [N]."""
LEVELS = (4, 5, 6, 7, 9)
ANGLES = (-4, -2, 0, 2, 4)
SEEDS = (1, 3)


def main() -> None:
    """Print a row for each calibration."""
    from example_rig import measure

    table = Table("seed", "levels", "rms [N]", "std [N]", "in the 95 % interval", "bias [N]")
    with TemporaryDirectory() as folder:
        other = measure(
            Path(folder) / "other", [(load, a, 0.0) for load in LOADS for a in (-3.2, 1.8)], seed=2
        )
        seen = tirelib.observe([other])
        true = seen.truth["Fz"]
        for seed in SEEDS:
            for levels in LEVELS:
                loads = np.linspace(1500.0, 7500.0, levels)
                plan = [(float(load), a, 0.0) for load in loads for a in ANGLES]
                day = measure(Path(folder) / f"{seed}-{levels}", plan, seed=seed)
                calibration = tirelib.train(tirelib.observe([day])).calibration
                found = calibration.estimate(seen.features)
                good = found.turn_valid
                error, std = (found.value["Fz"] - true)[good], found.std["Fz"][good]
                near = [np.abs(true[good] - load) < 100.0 for load in LOADS]
                bias = [float(error[rows].mean()) for rows in near if rows.any()]
                table.add_row(
                    str(seed),
                    str(levels),
                    f"{np.sqrt(np.mean(error**2)):.1f}",
                    f"{np.median(std):.1f}",
                    f"{100.0 * np.mean(np.abs(error) < 1.96 * std):.0f} %",
                    f"{min(bias):.0f} .. {max(bias):.0f}",
                )
    Console().print(table)


if __name__ == "__main__":
    with one_thread():
        main()
