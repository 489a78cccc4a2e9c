"""Prove the intervals of `tirelib identify` on random tires of the numerical rig.

    python build/proof/run.py --seeds 1-50                    table of finished and new seeds
    python build/proof/run.py --seeds 101-116                 development: sizes for structure.py
    python build/proof/run.py --seeds 5-50 --golden FILE      store the table

Resumable: campaigns and results are kept in build/out/proof, results as long as the code is the
same. `--have` takes the seeds whose campaigns are there and makes none.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from proof.case import case
from proof.tires import CACHE
from tirelib.core.threads import one_thread
from tirelib.core.version import __version__
from tirelib.inference.identify.structure import STRUCTURE_STD

TYPICAL = {
    "radial_pressure_slope": 1.0,
    "tangential_pressure_slope": 0.35,
    "tread_hardening": 1.0,
    "section_pull": 0.03,
}
"""Size to which errors are related of what may be zero: slopes [m], as in `tirelib.identify`."""


def table(cases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return coverage, errors and half-widths over seeds."""
    held = [c["held_out"] for c in cases if c["held_out"] is not None]
    return {
        "parameters": {name: _row(name, cases) for name in STRUCTURE_STD},
        "coverage_all": float(np.mean([_row(name, cases)["coverage"] for name in STRUCTURE_STD])),
        "vertical_stiffness_error": _spread(
            [
                c["vertical_stiffness"]["model"] / c["vertical_stiffness"]["laboratory"] - 1.0
                for c in cases
            ]
        ),
        "held_out_ratio": {
            name: _spread([row[name] for row in held]) for name in (held[0] if held else {})
        },
        "held_out_tires": len(held),
        "rms_share": _spread([c["rms_share"] for c in cases]),
        "seconds": _spread([c["seconds"] for c in cases]),
    }


def _row(name: str, cases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    # a road without friction does not let the tread's shear act, and no rig section has inertia
    rows = [c["parameters"][name] for c in cases if c["parameters"][name]["laboratory"] != 0.0]
    if not rows:
        none = dict.fromkeys(("bias", "rms_error", "half_width"), 0.0)
        told = dict.fromkeys(("coverage", "coverage_definition", "flagged"), 1.0)
        return {**told, **none, "half_width_unflagged": None, "cases": 0}
    value, low, high, truth, own = (
        np.array([r[key] for r in rows])
        for key in ("value", "low", "high", "laboratory", "definition")
    )
    size = TYPICAL.get(name, np.abs(truth))
    error = (value - truth) / size * np.sign(truth if name not in TYPICAL else 1.0)
    flagged = np.array(["not_identifiable" in r["flags"] for r in rows])
    half = 0.5 * (high - low) / np.abs(value)
    inside = (low <= truth) & (truth <= high)
    return {
        "coverage": float(inside.mean()),
        "coverage_definition": float(((low <= own) & (own <= high)).mean()),
        "bias": float(error.mean()),
        "rms_error": float(np.sqrt(np.mean(error**2))),
        "half_width": float(np.median(half)),
        "half_width_unflagged": float(half[~flagged].max()) if (~flagged).any() else None,
        "flagged": float(flagged.mean()),
        "cases": len(rows),
    }


def _spread(values: Sequence[float]) -> dict[str, float]:
    x = np.asarray(values, dtype=float)
    return {
        "mean": float(x.mean()),
        "rms": float(np.sqrt(np.mean(x**2))),
        "median": float(np.median(x)),
        "largest": float(x[np.argmax(np.abs(x))]),
    }


def show(found: dict[str, Any]) -> str:
    """Return the table as text."""
    lines = ["parameter                  in 95 %  (def.)   bias    rms   half-width  flagged"]
    for name, row in found["parameters"].items():
        lines.append(
            f"{name:26s} {row['coverage']:6.2f}  {row['coverage_definition']:6.2f} "
            f"{row['bias']:+7.3f} {row['rms_error']:6.3f}   {row['half_width']:6.3f}     "
            f"{row['flagged']:5.2f}"
        )
    lines.append(f"coverage, all: {found['coverage_all']:.3f}")
    for name in ("vertical_stiffness_error", "rms_share", "seconds"):
        lines.append(f"{name}: " + _numbers(found[name]))
    for name, row in found["held_out_ratio"].items():
        lines.append(f"held out, {name}: " + _numbers(row))
    return "\n".join(lines)


def _numbers(row: dict[str, float]) -> str:
    return ", ".join(f"{key} {value:.3f}" for key, value in row.items())


def main() -> None:
    """Run the proof."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1-50")
    parser.add_argument("--golden", type=Path)
    parser.add_argument("--have", action="store_true")
    chosen = parser.parse_args()
    first, last = (int(part) for part in chosen.seeds.split("-"))
    seeds = [
        seed
        for seed in range(first, last + 1)
        if not chosen.have or (CACHE / f"rig{seed}.pkl").exists()
    ]
    cases = []
    for seed in seeds:
        cases.append(case(seed))
        sys.stderr.write(f"seed {seed} done\n")
    found = table(cases)
    sys.stdout.write(show(found) + "\n")
    if chosen.golden is not None:
        recipe = {
            "made_by": f"python build/proof/run.py --seeds {chosen.seeds}",
            "seeds": seeds,
            "runs_per_tire": cases[0]["runs"],
            "tirelib": __version__,
            "code": cases[0]["fingerprint"],
            "date": datetime.now(UTC).date().isoformat(),
            "structure_std": dict(STRUCTURE_STD),
        }
        chosen.golden.write_text(json.dumps({"recipe": recipe, **found}, indent=1) + "\n")


if __name__ == "__main__":
    with one_thread():
        main()
