"""`tirelib.studio.runner` whose jobs write at once what a command would write.

While the file of the environment variable HOLD exists, fits go on; a base fit tells its ring first
if the file holds "first". If it holds "check" or "diagnose", these go on instead. The check of a
campaign whose header says "bad" tells an error. An import with a map of the name "bad" fails. Every
command line is noted in the file of the environment variable SAID.
"""

import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tirelib.studio import runner

VERDICT = {
    "format": "tirelib-diagnosis/1",
    "made_by_hand": True,
    "verdict": "named",
    "named": ["sidewall_load"],
    "dead": ["camber"],
    "candidates": [
        {"effect": "sidewall_load", "strength": 0.3, "std": 0.01, "rank": 1},
        {"effect": "nonuniformity", "strength": [1.0, 2.0], "std": [0.1, 0.1], "rank": 2},
    ],
    "explanation": {"missing": "A.", "sure": "B.", "error": "C.", "next": "D."},
}
WRITES = {
    "effects": {
        "effects": [
            {"effect": name, "stage": "stiffness"} for name in ("sidewall_load", "nonuniformity")
        ]
    },
    "check": {"errors": 0, "warnings": 0, "problems": []},
    "show": {"header": {"gage_lateral_mm": [0.0]}, "runs": []},
    "identify": {
        "parameters": [{"name": "bending", "flags": ["not_identifiable"], "helps": "run at 6 bar"}],
        "error": 15.2,
        "force_errors": {"Fy": {"error": 3.0}},
    },
    "compare": {"error": 15.25, "error_unit": "noise", "effects": []},
    "diagnose": VERDICT,
    "next-test": {"what": "measure", "candidates": []},
    "add": {"effect": "sidewall_load", "error_before": 15.25, "error_after": 5.5},
}


def value(words: Sequence[str], option: str) -> Path | None:
    return Path(words[words.index(option) + 1]) if option in words else None


def work(words: Sequence[str]) -> None:
    with Path(os.environ["SAID"]).open("a") as said:
        said.write(json.dumps({"pid": os.getpid(), "argv": words}) + "\n")
    verb = words[1] if words[0] == "campaign" else words[0]
    hold = Path(os.environ["HOLD"])
    held = hold.read_text() if hold.exists() else None
    slow = (held,) if held in ("check", "diagnose") else ("add", "identify")
    if (first := value(words, "--first")) and held == "first":
        first.write_text("model = 0\n")
    for step in range(1, 100000):
        label = f"step {step + 1}, cost {9 - step}"
        told = {"progress": "fitting", "done": step, "total": None, "label": label}
        sys.stderr.write(json.dumps(told) + "\n")
        if verb not in slow or not hold.exists():
            break
        time.sleep(0.02)
    map_file = value(words, "--map")
    bad = map_file is not None and 'name = "bad"' in map_file.read_text()
    if bad or "sidewall_pressure" in words or (verb == "diagnose" and "Fy" in words):
        sys.stderr.write("Error: it does not fit; choose another\n")
        sys.exit(2)
    if target := value(words, "--json"):
        header = Path(words[2]) / "campaign.toml"
        wrong = verb == "check" and header.exists() and "bad" in header.read_text()
        target.write_text(json.dumps(WRITES.get(verb, {}) | ({"errors": 1} if wrong else {})))
    if (target := value(words, "--data")) and verb in ("compare", "show"):
        import numpy as np  # most commands need it not

        arrays = {"angle": np.arange(3.0), "quantity": np.array("strain")}
        np.savez(target, **(arrays | _measured(arrays["angle"]) if verb == "show" else arrays))
    if (target := value(words, "--out")) and target.suffix == ".toml":
        target.write_text("model = 1\n")
    elif target and verb == "import":
        target.mkdir()
        (target / "campaign.toml").write_text("x = 1\n")


def _measured(angle: Any) -> dict[str, Any]:
    """Return two runs as `tirelib campaign show --data` does."""
    run = angle[:2]
    conditions = ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio")
    return {
        **dict.fromkeys(("run", "order", "counted", *conditions), 1.0 + run),
        **{f"level_{name}": run for name in conditions[:3]},
        "gages": angle[:1],
        "measured": angle + 10.0 * run[:, None],
        "measured_by_gage": angle + 10.0 * run[:, None, None],
    }


if __name__ == "__main__":
    runner.main(work, loaded=())
