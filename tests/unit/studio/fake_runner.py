"""`tirelib.studio.runner` whose jobs write at once what a command would write.

While the file of the environment variable HOLD exists, `add` goes on; every command line is noted
in the file of the environment variable SAID.
"""

import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

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
    for step in range(1, 100000):
        label = f"error {9 - step}"
        told = {"progress": "fitting", "done": step, "total": None, "label": label}
        sys.stderr.write(json.dumps(told) + "\n")
        if verb != "add" or not Path(os.environ["HOLD"]).exists():
            break
        time.sleep(0.02)
    if "sidewall_pressure" in words or (verb == "diagnose" and "Fy" in words):
        sys.stderr.write("Error: it does not fit; choose another\n")
        sys.exit(2)
    if target := value(words, "--json"):
        target.write_text(json.dumps(WRITES.get(verb, {})))
    if (target := value(words, "--data")) and verb == "compare":
        import numpy as np  # most commands need it not

        np.savez(target, angle=np.arange(3.0), quantity=np.array("strain"))
    if (target := value(words, "--out")) and target.suffix == ".toml":
        target.write_text("model = 1\n")


if __name__ == "__main__":
    runner.main(work, loaded=())
