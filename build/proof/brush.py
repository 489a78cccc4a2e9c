"""Coverage of the brush's intervals on random tires of the Magic Formula, whose truth is exact.

    python build/proof/brush.py                  the table of docs/theory/identification_measured.md
    python build/proof/brush.py --seeds 200-209  fewer tires

Another structure than the brush's: its friction and slopes at zero slip are those of the formula.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.magic_tires import ANGLES, LOADS, RATIOS, magic, magic_data
from tirelib.core.threads import one_thread
from tirelib.inference.identify.brush_estimates import estimates_of, slip_stiffness
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.brush_study import study_of
from tirelib.physics.brush.mf import magic_forces

FEW = (2000.0, 4000.0, 6000.0)
FAR = np.radians([-12, -9, -6, -4, -2, -1, 0, 1, 2, 4, 6, 9, 12])
SEVEN = np.radians([-8, -4, -2, 0, 2, 4, 8])
PLANS: dict[str, tuple[Sequence[float], Sequence[float], Sequence[float]]] = {
    "4 loads, 13 angles to 6 deg": (LOADS, ANGLES, ()),
    "4 loads, 13 angles to 12 deg": (LOADS, FAR.tolist(), ()),
    "3 loads, 7 angles to 8 deg": (FEW, SEVEN.tolist(), ()),
    "3 loads, 81 angles to 10 deg": (FEW, np.radians(np.arange(-10, 10.1, 0.25)).tolist(), ()),
    "3 loads, 7 angles, 8 slip ratios": (FEW, SEVEN.tolist(), RATIOS),
}


class Row(NamedTuple):
    """One number of one tire: what it is, whether its interval holds it, error, half-width."""

    name: str
    held: bool
    error: float
    half: float


def rows(plan: str, seed: int) -> list[Row]:
    """Return friction and slip stiffnesses of one random tire beside the tire's own."""
    rng = np.random.default_rng(seed)
    tire = magic(rng)
    loads, angles, ratios = PLANS[plan]
    data = magic_data(tire, rng, ratios, loads, angles)
    study = study_of(fit_brush(data))
    friction = float(magic_forces(tire, study.fit.reference.load, 0.1).friction_y)
    told = [("friction", friction, e) for e in estimates_of(study) if e.name == "friction"]
    out = [_row(name, true, e.value, e.low, e.high) for name, true, e in told]
    for each in slip_stiffness(study):
        at = magic_forces(tire, each.load, 0.0)
        across = each.slip == "slip_angle"
        true = -float(at.cornering_stiffness) if across else float(at.slip_stiffness)
        out.append(_row(each.slip, true, each.value, each.low, each.high))
    return out


def _row(name: str, true: float, value: float, low: float, high: float) -> Row:
    return Row(name, low <= true <= high, value / true - 1.0, 0.5 * (high - low) / value)


def line(plan: str, found: Sequence[Row]) -> str:
    """Return one line of the table."""
    said = [f"all {np.mean([r.held for r in found]):.2f}"]
    for name in dict.fromkeys(r.name for r in found):
        mine = [r for r in found if r.name == name]
        said.append(
            f"{name} {np.mean([r.held for r in mine]):.2f} "
            f"(half-width {np.median([r.half for r in mine]):.2f}, "
            f"rms error {np.sqrt(np.mean([r.error**2 for r in mine])):.2f})"
        )
    return f"{plan}: " + "; ".join(said)


if __name__ == "__main__":
    with one_thread():
        parser = argparse.ArgumentParser(description="Coverage of the brush's intervals.")
        parser.add_argument("--seeds", default="200-239", metavar="FIRST-LAST")
        first, last = map(int, parser.parse_args().seeds.split("-"))
        for plan in PLANS:
            sys.stdout.write(
                line(plan, [r for seed in range(first, last + 1) for r in rows(plan, seed)]) + "\n"
            )
