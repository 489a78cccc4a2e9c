"""A few cases through the whole chain: files of 10 kHz, then the command line as a user would.

    python build/hidden/chain.py 5000:temperature:1.2 5000:none:1

The strength is that of the case of the same name; tire and conditions are its, the day is another.
"""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from click.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1]))

from hidden.cases import NONE, Case, make_case
from hidden.judge import fingerprint, outcome
from hidden.measured import CACHE, keep
from hidden.plan import HELD_OUT, REPEATS, day
from tirelib.cli import program
from tirelib.rig.campaign import run_plan
from tirelib.rig.plans import Plan
from tirelib.threads import one_thread


def by_files(case: Case) -> dict[str, Any]:
    """Return the verdict on a case by the command line, from the cache if the code is the same."""
    file = CACHE / "chain" / fingerprint() / f"{case.seed}-{case.kind}-{case.wanted:.2f}.json"
    if file.exists():
        stored: dict[str, Any] = json.loads(file.read_text())
        return stored
    with TemporaryDirectory() as name:
        made = _by_files(case, Path(name))
    keep(file, json.dumps(made, indent=1).encode())
    return made


def _by_files(case: Case, folder: Path) -> dict[str, Any]:
    today = day(case.seed)
    fitted = tuple(dict.fromkeys(c for c in today.nominal if c not in HELD_OUT))
    campaign, model, told = folder / "campaign", folder / "M.toml", folder / "D.json"
    run_plan(
        Plan("hidden", "12 conditions", fitted),
        today.tire,
        campaign,
        seed=case.seed,
        repeats=REPEATS,
        jobs=1,
        chain=today.chain,
        planted=case.strength,
    )
    _call("identify", campaign, "--out", model)
    _call("diagnose", campaign, "--model", model, "--json", told)
    verdict = json.loads(told.read_text())
    out = {
        "seed": case.seed,
        "kind": case.kind,
        "wanted": case.wanted,
        "outcome": outcome(case, verdict["verdict"], verdict["named"]),
        "verdict": verdict["verdict"],
        "named": verdict["named"],
    }
    if case.kind != NONE and case.known and len(case.names) == 1:
        second, added = folder / "M2.toml", folder / "A.json"
        _call(
            "add", case.kind, "--model", model, "--data", campaign, "--out", second, "--json", added
        )
        document = json.loads(added.read_text())
        out |= {key: document[key] for key in ("error_before", "error_after", "floor")}
        out |= {key: document[key] for key in ("heldout_error_before", "heldout_error_after")}
    return out


def _call(*words: object) -> None:
    found = CliRunner().invoke(program, [str(word) for word in words])
    if found.exit_code != 0:
        raise SystemExit(f"tirelib {' '.join(map(str, words))}: {found.output}{found.exception}")


def main() -> None:
    """Run the cases that are named."""
    for text in sys.argv[1:]:
        seed, kind, ratio = text.split(":")
        told = by_files(make_case(int(seed), kind, float(ratio)))
        sys.stdout.write(json.dumps(told) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    with one_thread():
        main()
