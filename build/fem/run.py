"""Make the finite-element reference of a tire pressed on a flat road: ``make fem``.

Needs CalculiX (program ``ccx``). Decks, results and plots land in ``build/out/fem``; the numbers
that the tests compare with are written to ``tests/golden``. A deck that is solved already is not
solved again.
"""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import against_ring
import calculix
import plots
import store
import verify
from cases import CHECKS, STORED, Case
from fields import states
from rich.console import Console

from tirelib.core.threads import one_thread

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "build" / "out" / "fem"
GOLDEN = ROOT / "tests" / "golden"


def main() -> None:
    """Solve, check, store, draw."""
    console = Console()
    calculix.program()
    console.print(f"fem: {len(STORED) + len(CHECKS)} jobs, two at a time, up to 40 minutes")

    def solve(case: Case) -> None:
        calculix.run(case.deck(), OUT / case.name)
        console.print(f"fem: {case.name} solved")

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(solve, (*STORED, *CHECKS)))

    found = {c.name: states(OUT, c) for c in STORED}
    solid, blocks, stretchy = (STORED[k] for k in (1, 3, 5))
    checks = {
        "balance": verify.balance(found),
        "inflation": {c.tire: verify.inflation(OUT, c) for c in (solid, blocks, stretchy)},
        "harmonic_loads": {
            f"{c.tire}_{'inflated' if inflated else 'plain'}": verify.harmonics(
                OUT, c, inflated=inflated
            )
            for c in (solid, blocks)
            for inflated in (False, True)
        },
        "convergence": verify.convergence(OUT),
    }
    results = {c.name: store.mesh_note(c) | verify.summary(found[c.name]) for c in STORED}
    GOLDEN.mkdir(parents=True, exist_ok=True)
    for case in STORED:
        store.table(GOLDEN / f"fem_tire_{case.name}.csv", case.loads, found[case.name])
    store.recipe(GOLDEN / "fem_tire.toml", f"CalculiX, {calculix.version()}", results, checks)

    ring = against_ring.tensioned(solid.section, extensible=False)
    loose = STORED[-1]
    slack = against_ring.slack(loose.section, loose.loads)
    apart = {n: against_ring.distance(ring, found[n]) for n in found if n != loose.name}
    apart[loose.name] = against_ring.distance(slack, found[loose.name])
    (OUT / "against_ring.json").write_text(json.dumps(apart, indent=1))
    plots.strains(OUT / "strain.png", found)
    plots.tractions(OUT / "traction.png", found)
    plots.tensions(OUT / "tension.png", {n: found[n] for n in found if n != loose.name}, ring)
    plots.rings(
        OUT / "ring.png",
        {
            "with tension": (found["solid_mu000"], ring),
            "without tension": (found[loose.name], slack),
        },
    )
    console.print(f"fem: stored in {GOLDEN}, plots in {OUT}")


if __name__ == "__main__":
    with one_thread():
        main()
