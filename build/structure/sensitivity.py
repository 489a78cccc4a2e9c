"""What half and double of each number that decides a verdict change, to first order.

    python build/structure/sensitivity.py --family rig --seeds 101-170

For every number of `tirelib.inference.statistics` that decides, as it is, halved and doubled: how
many plain tires of each family are rejected by the other families at 5 %, and how many campaigns of
a family with something hidden are rejected by all families, of these by their own effect. Reads the
campaigns of `build/structure/make.py`, the fits of `build/structure/learn.py`, and the library's
table.
"""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from structure.cases import NONE
from structure.learn import FAMILIES, OUT, TABLE, Fit, fits_of, kept_fit, say
from structure.make import seeds
from tirelib.core.threads import one_thread
from tirelib.inference.statistics import hypothesis, null, plain, size
from tirelib.inference.statistics.hypothesis import judged
from tirelib.inference.statistics.plain import Family, load

LEVEL = 0.05
LARGEST = 1.3
"""Error ratio of the campaigns with something hidden, at most: larger ones are seen by all."""
NUMBERS = ("PRIOR", "MORE", "SIZES", "SIZE_STD", "OWN", "OPPOSITE", "EVEN")


@contextmanager
def scaled(name: str, factor: float) -> Iterator[None]:
    """Change a number of `tirelib.inference.statistics` for a while, wherever it is imported."""
    places = [module for module in (size, null, hypothesis, plain) if hasattr(module, name)]
    old = getattr(places[0], name)
    new: Any = tuple(factor * np.array(old)) if isinstance(old, tuple) else factor * old
    for module in places:
        setattr(module, name, new)
    yield
    for module in places:
        setattr(module, name, old)


def counts(
    plain_fits: dict[str, dict[int, Fit]], planted: dict[str, Fit], families: tuple[Family, ...]
) -> str:
    """Return false alarms by family, and what is seen of what is hidden."""
    said = []
    for name, fits in plain_fits.items():
        others = [family for family in families if family.name != name]
        p = [judged(*fit, others, LEVEL, own_effects=0).p for fit in fits.values()]
        said.append(f"{name} {np.sum(np.array(p) <= LEVEL)}/{len(p)}")
    for ratio in sorted({case.split("-")[2] for case in planted}):
        cases = {case: fit for case, fit in planted.items() if case.endswith(ratio)}
        found = {case: judged(*fit, families, LEVEL, own_effects=0) for case, fit in cases.items()}
        seen = {case: h for case, h in found.items() if h.p <= LEVEL}
        right = sum(h.against == case.split("-")[1] for case, h in seen.items())
        said.append(f"at {ratio}: {len(seen)} of {len(cases)} seen, {right} by its effect")
    return "; ".join(said)


def main() -> None:
    """Judge with every number as it is, halved and doubled."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--family", choices=FAMILIES, default="rig")
    parser.add_argument("--seeds", type=seeds, default=list(range(101, 171)), help="of the planted")
    parser.add_argument("--numbers", default=",".join(NUMBERS))
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    families, provenance = load(TABLE)
    of: Any = provenance["seeds"]
    plain_fits = {name: fits_of(options.out, name, of[name]) for name in FAMILIES}
    planted = {}
    for file in sorted((options.out / options.family).glob("*.npz")):
        seed, kind, *ratio = file.stem.split("-")
        if kind == NONE or int(seed) not in options.seeds or float(ratio[0]) > LARGEST:
            continue
        fit = kept_fit(options.out, file)
        if fit is not None:
            planted[file.stem] = fit
    say(f"as it is: {counts(plain_fits, planted, families)}")
    for name in options.numbers.split(","):
        for factor in (0.5, 2.0):
            with scaled(name, factor):
                say(f"{name} times {factor:g}: {counts(plain_fits, planted, families)}")


if __name__ == "__main__":
    with one_thread():
        main()
