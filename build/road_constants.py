"""What the rig says of the constants of tread and road, and what half and double of each does.

    python build/road_constants.py build/out/road/reference-21 [more folders] --out build/out/road
    python build/road_constants.py --measure reference
    python build/road_constants.py --measure random --seed 30

Folders are those of `build/road_coverage.py`. With `--measure`, straight and 1 deg runs of one tire
on a tread of 8, 6 and 4 mm give `EDGE`, `BENT` and `CORNERING`; nothing is estimated there. Where
`build/road_coverage.py` has calibrated the tire, the columns below are what L and a sliding share
of one shift (`ROAD_DRIFT`), and what slippery roads do to its estimates.
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import click
import numpy as np
from road_coverage import measured, rows_of, silent, tire_of

from tirelib.campaign import read_campaign
from tirelib.core.compiled import choose_numpy
from tirelib.core.threads import one_thread
from tirelib.estimators import any_road, chain, sliding, unknowns
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.estimators.likeness import DRIFT
from tirelib.estimators.regressors import SIDED, compute_regressors
from tirelib.estimators.unknowns import UNDER_GROOVES
from tirelib.measured.observations import Observations, mean_by, observe
from tirelib.rig.plans import Plan
from tirelib.rig.tire import NEW_DEPTH, Condition

TRIED: tuple[tuple[ModuleType, str, str], ...] = (
    (chain, "EDGE", "Fz"),
    (unknowns, "UNDER_GROOVES", "Fz"),
    (unknowns, "SOFTENING", "Fz"),
    (unknowns, "TEMPERATURE", "Fz"),
    (chain, "BENT", "kappa"),
    (chain, "CORNERING", "alpha"),
    (chain, "MOMENT_DOUBT", "alpha"),
    (any_road, "HIDDEN", "alpha"),
    (any_road, "HIDDEN_DOUBT", "alpha"),
    (any_road, "CURVE_DOUBT", "alpha"),
    (sliding, "CURVE_DOUBT", "alpha"),
    (chain, "LOAD_DOUBT", "Fz"),
    (chain, "FORCE_DOUBT", "Fy"),
    (chain, "FORCE", "Fy"),
    (chain, "LAW_DOUBT", "kappa"),
)
"""Module that uses a constant, its name, and the quantity on which it acts most."""
DEPTHS = (0.008, 0.006, 0.004)
LOADS = (2000.0, 4000.0, 6000.0)


@contextmanager
def times(module: ModuleType, name: str, factor: float) -> Iterator[None]:
    """Multiply a constant for a while."""
    own = getattr(module, name)
    setattr(module, name, factor * own)
    try:
        yield
    finally:
        setattr(module, name, own)


def judged(calibration: Calibration, dry: Observations, seen: Observations, quantity: str) -> str:
    """Return coverage with nothing said (all said), and the growth over what is lost."""
    factor = EDGE_UNIT[quantity][1]
    held, lost = [], np.nan
    for given in (silent(seen), seen):
        found = rows_of(calibration.estimate(given.features), seen, quantity, seen.usable)
        held.append(100.0 * found[2])
        lost = found[3] if len(held) == 1 else lost
    known, unknown = (calibration.estimate(x.features) for x in (dry, silent(dry)))
    good = known.valid[quantity] & unknown.valid[quantity]
    more = unknown.std[quantity][good] ** 2 - known.std[quantity][good] ** 2
    growth = factor * float(np.sqrt(max(more.mean(), 0.0)))
    return f"{held[0]:.0f} ({held[1]:.0f}) %, {growth / lost:.2f}"


def halves(folder: Path) -> list[str]:
    """Return the table of half and double for a tire."""
    dry, seen = (observe([read_campaign(folder / name)]) for name in ("set1", "drawn"))
    calibration = read_calibration(folder / "calibration.toml")
    lines = [
        "",
        f"{folder.name}: in the 95 % interval, nothing said (all said); growth over lost",
        "",
        "| constant | quantity | half | as it is | double |",
        "|---|---|---|---|---|",
    ]
    for module, name, quantity in TRIED:
        cells = []
        for factor in (0.5, 1.0, 2.0):
            with times(module, name, factor):
                cells.append(judged(calibration, dry, seen, quantity))
        lines.append(f"| `{name}` | {quantity} | {' | '.join(cells)} |")
    return lines


def measure(name: str, seed: int, out: Path, jobs: int) -> list[str]:
    """Return the three constants as straight and 1 deg runs of one tire give them."""
    own = tire_of(name, seed)
    runs = tuple(
        Condition(load, 2.3e5, 65.0 / 3.6, angle, friction=own.friction, tread_depth=depth)
        for depth in DEPTHS
        for angle in (0.0, np.deg2rad(1.0))
        for load in LOADS
    )
    seen = measured(out / f"worn-{name}-{seed}", Plan("worn", "worn treads", runs), own, seed, jobs)
    regressors = compute_regressors(seen.features, range(5))

    def mean(x: np.ndarray) -> np.ndarray:
        return mean_by(seen.run, x, seen.usable)

    load, angle, force = (mean(seen.truth[n]) for n in ("Fz", "slip_angle", "Fy"))
    contact = mean(regressors["contact_angle"])
    radius = mean(regressors["speed"] / regressors["omega"])
    worn = NEW_DEPTH - mean(seen.features.tread_depth)
    thick = UNDER_GROOVES + NEW_DEPTH
    harder = np.log(thick / (thick - worn))
    x = np.log(load / 4000.0)
    curve = np.stack((np.ones_like(x), x, x**2), axis=1)
    straight = np.abs(angle) < np.deg2rad(0.5)

    def fitted(y: np.ndarray, last: np.ndarray, rows: np.ndarray) -> tuple[float, float]:
        design = np.column_stack((curve, last))[rows]
        answer, *_ = np.linalg.lstsq(design, y[rows], rcond=None)
        left = y[rows] - design @ answer
        spread = np.sqrt(left @ left / (rows.sum() - 4) * np.linalg.inv(design.T @ design)[3, 3])
        return float(answer[3]), float(spread)

    edge, edge_std = fitted(-contact * own.free_radius, harder, straight)
    bent, bent_std = fitted(-radius, worn / contact, straight)
    corner, corner_std = fitted(np.log(np.abs(force / np.tan(angle))), harder, ~straight)
    return [
        f"{own.name}: under the grooves {1e3 * (own.tread_thickness - NEW_DEPTH):.1f} mm; "
        f"EDGE {1e3 * edge:.1f} +- {1e3 * edge_std:.1f} mm; BENT {bent:.3f} +- {bent_std:.3f} rad; "
        f"CORNERING {corner:.3f} +- {corner_std:.3f}"
    ]


def shifts(name: str, seed: int, out: Path, jobs: int) -> np.ndarray:
    """Return what L and a sliding share of one shift in `DRIFT`'s regressors, shape (2, m)."""
    own = tire_of(name, seed)
    runs = tuple(
        Condition(load, 2.3e5, 65.0 / 3.6, np.deg2rad(angle), friction=friction)
        for friction in (0.4, 0.6)
        for angle in (-3.0, 1.5, 4.0)
        for load in LOADS
    )
    slid = measured(
        out / f"slid-{name}-{seed}", Plan("slid", "slippery roads", runs), own, seed, jobs
    )
    worn = observe([read_campaign(out / f"worn-{name}-{seed}")])
    full = read_calibration(out / f"{name}-{seed}" / "calibration.toml").chains[-1]
    if full.likeness is None or full.agreement is None or full.sliding is None:
        raise SystemExit(f"{name}: run build/road_coverage.py for this tire first")
    found = []
    for seen in (worn, slid):
        use, truth = seen.usable, seen.truth
        values = compute_regressors(seen.features, range(5))
        every = {**values, "speed_squared": values["speed"] ** 2}
        known = (full.likeness, full.agreement)
        rest = np.hstack([one.rest(every) for one in known])[use]
        lost = own.tread_thickness - NEW_DEPTH + seen.features.tread_depth
        at = np.abs(truth["slip_angle"]), truth["Fz"]
        share = full.sliding.forward(*at, seen.features.friction)[3]
        share = share - full.sliding.forward(*at, full.sliding.friction)[3]
        side = np.where(truth["slip_angle"] < 0.0, -1.0, 1.0)
        column = (np.log(own.tread_thickness / lost) if seen is worn else share)[use]
        odd = np.array([regressor in SIDED for one in known for regressor in one.names])
        even = np.stack((np.ones_like(column), column), axis=1)
        sided = column * side[use]
        shift = np.linalg.lstsq(even, rest, rcond=None)[0][1]
        found.append(np.where(odd, 0.0 if seen is worn else sided @ rest / (sided @ sided), shift))
    return np.array(found)


def doubts(name: str, seed: int, out: Path) -> list[str]:
    """Return what slippery roads do to one tire's estimates, as the doubts of `sliding` count it.

    The runs are those of `shifts`; the calibration is dry.
    """
    seen = observe([read_campaign(out / f"slid-{name}-{seed}")])
    full = read_calibration(out / f"{name}-{seed}" / "calibration.toml").chains[-1]
    curve, truth, use = full.sliding, seen.truth, seen.usable
    if curve is None or full.moment is None:
        raise SystemExit(f"{name}: run build/road_coverage.py for this tire first")
    values = compute_regressors(seen.features, range(5))
    found = full.predict(values)[0]
    load, angle, side = truth["Fz"], np.abs(truth["slip_angle"]), np.sign(truth["slip_angle"])
    used = np.abs(truth["Fy"]) / load
    friction = seen.features.friction * curve.friction / tire_of(name, seed).friction
    told = curve.at(used, load, friction)
    share = np.abs(
        curve.forward(angle, load, friction)[3] - curve.share(used, curve.friction, load)
    )

    def ratio(error: np.ndarray, scale: np.ndarray, rows: np.ndarray) -> float:
        return float(np.sqrt(np.mean(error[rows] ** 2) / np.mean(scale[rows] ** 2)))

    slip = found["kappa"].value
    at = {
        **values,
        "speed_squared": values["speed"] ** 2,
        "load": found["Fz"].value,
        "slip_ratio": slip,
        "slip_size": np.abs(slip),
    }
    read = side * full.moment.predict(at)[0]
    moment = side * truth["Mz"] / (load * curve.longest(load))
    dry = used * (1.0 - curve.share(used, curve.friction, load)) ** curve.fading
    taken, off = dry - moment, read - moment
    far = use & found["Fy"].valid & (taken > 0.05)
    hidden = float(np.sum((off * taken)[far]) / np.sum(taken[far] ** 2))
    near = use & found["Fy"].valid & ~far
    force, heavier = np.abs(found["Fy"].value) / load - used, found["Fz"].value / load - 1.0
    measured_doubts = {
        "CURVE_DOUBT": ratio(angle - told.angle, told.change, use & np.isfinite(told.std)),
        "LOAD_DOUBT": ratio(heavier, share, use & found["Fz"].valid),
        "FORCE_DOUBT": ratio(force, share * used, use & found["Fy"].valid),
        "HIDDEN": hidden,
        "MOMENT_DOUBT": float(np.sqrt(np.mean(off[near] ** 2))),
        "fitted friction": curve.friction,
    }
    return [f"{name}: " + "; ".join(f"{what} {x:.3f}" for what, x in measured_doubts.items())]


def main() -> None:
    """Measure, or try half and double."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="*")
    parser.add_argument("--out", type=Path, default=Path("build/out/road"))
    parser.add_argument("--measure", metavar="TIRE")
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    lines = [line for folder in given.folders for line in halves(folder)]
    if given.measure:
        asked = (given.measure, given.seed, given.out, given.jobs)
        lines += measure(*asked)
    if (
        given.measure
        and (given.out / f"{given.measure}-{given.seed}" / "calibration.toml").exists()
    ):
        for name, (hard, slid) in zip(DRIFT, shifts(*asked).T, strict=True):
            lines.append(f"{name:18} {hard:9.4f} {slid:9.4f}")
        lines += doubts(given.measure, given.seed, given.out)
    click.echo("\n".join(lines))


if __name__ == "__main__":
    choose_numpy()  # constants of the compiled core cannot be changed
    with one_thread():
        main()
