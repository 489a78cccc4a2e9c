"""Make the virtual tire's surface of the rig's solutions, and state its error at points left out.

    python build/virtual_tire/surface.py --points 372 --out models/virtual_tire/reference.npz
    python build/virtual_tire/surface.py --friction --out models/virtual_tire/friction.npz

With `--friction` the solutions at the tire's own friction and those at others make one surface. The
solutions come from `design.py`. Errors are those of a tenfold cross-validation in which a point
and its mirror image are left out together; only the scales of the coordinates were fitted to all.
"""

import argparse
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from design import FRICTION as FRICTION_DESIGN
from design import OUT, OUT_FRICTION, limits
from scipy.interpolate import CubicSpline, RBFInterpolator
from scipy.optimize import minimize

from tirelib.core.threads import one_thread
from tirelib.core.version import __version__
from tirelib.fmu.virtual.coordinates import coordinates, half_angle, warped
from tirelib.fmu.virtual.surface import (
    DEGREE,
    KERNEL,
    Surface,
    mirrored,
    radius_terms,
    write_surface,
)
from tirelib.rig.tire import tire

GRID = 720
"""Angles of a component."""
KEPT = 1e-5
"""Share of the waveforms' variance that the components may miss."""
FOLDS = 10
RANGE_LOW = np.array([800.0, -np.radians(8.0), -0.12, -np.radians(4.0), 20.0 / 3.6, 1.8e5])
RANGE_HIGH = np.array([9000.0, np.radians(8.0), 0.12, np.radians(4.0), 150.0 / 3.6, 3.0e5])
FRICTION_RANGE = (0.3, 1.1)
SLIP = (24.2, 13.5, 0.0, -0.98)
"""Start of the fit of the coordinates."""
_EFFORT = {"maxfev": 200, "xatol": 0.01, "fatol": 0.05, "adaptive": True}
RESTARTS = 0
SCALES = (1.97, 0.78, 0.12, 1.08, 0.89, 0.66, 0.42, 0.32)
FRICTION_SCALE = 0.6
"""Start of the ninth scale, where there is one."""


@dataclass(frozen=True)
class Solutions:
    """What `design.py` solved, one row a point."""

    inputs: np.ndarray
    strain: np.ndarray
    edges: np.ndarray
    forces: np.ndarray
    free_radius: np.ndarray
    failed: int

    def part(self, chosen: np.ndarray) -> "Solutions":
        """Return some of the points."""
        return Solutions(
            self.inputs[chosen],
            self.strain[chosen],
            self.edges[chosen],
            self.forces[chosen],
            self.free_radius[chosen],
            0,
        )


def range_of(dimensions: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the range of the surface's inputs."""
    if dimensions == RANGE_LOW.size:
        return RANGE_LOW, RANGE_HIGH
    return np.append(RANGE_LOW, FRICTION_RANGE[0]), np.append(RANGE_HIGH, FRICTION_RANGE[1])


def start_scales(dimensions: int) -> np.ndarray:
    """Return where the fit of the scales starts."""
    return np.array(SCALES if dimensions == RANGE_LOW.size else (*SCALES, FRICTION_SCALE))


def places_of(inputs: np.ndarray, slip: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Return coordinates of conditions and of their mirror images, shape (2 n, ...)."""
    both = np.concatenate((inputs, mirrored(inputs)))
    return np.stack(coordinates(list(both.T), slip.tolist(), scales.tolist()), axis=1)


def read_solutions(folder: Path, most: int | None = None, more: Path | None = None) -> Solutions:
    """Read the first solved points, or all; fill in the edges of strips that touch no road.

    `more` is a folder of points that have friction as an input; the others then get the tire's.
    """
    files = [np.load(path) for path in sorted(folder.glob("*.npz"))[:most]]
    with_friction = [np.load(path) for path in sorted(more.glob("*.npz"))] if more else []
    good = [file for file in (*files, *with_friction) if "strain" in file.files]
    own = [tire("reference").friction] if with_friction else []
    inputs = np.array(
        [
            file["inputs"]
            if file["inputs"].size > RANGE_LOW.size
            else np.append(file["inputs"], own)
            for file in good
        ]
    )
    ends = np.array([file["edges"] for file in good])
    edges = np.stack((0.25 * (ends[..., 1] - ends[..., 0]) ** 2, ends.mean(axis=2)), axis=1)
    force = np.array([file["forces"] for file in good])
    radius = np.array([float(file["loaded_radius"]) for file in good])
    return Solutions(
        inputs,
        np.array([file["strain"] for file in good]),
        _filled(inputs, edges),
        np.column_stack((force[:, [0, 1, 4]], radius)),
        np.array([float(file["free_radius"]) for file in good]),
        len(files) + len(with_friction) - len(good),
    )


def _filled(inputs: np.ndarray, edges: np.ndarray) -> np.ndarray:
    places = places_of(inputs, np.array(SLIP), start_scales(inputs.shape[1]))
    both = np.concatenate((edges, edges[:, :, ::-1]))
    for gage in range(edges.shape[2]):
        free = np.isnan(both[:, 0, gage])
        if free.any():
            known = RBFInterpolator(places[~free], both[~free, :, gage], kernel="linear", degree=1)
            both[free, :, gage] = known(places[free])
    return both[: len(edges)]


def common(solutions: Solutions) -> np.ndarray:
    """Return the waveforms moved to the common contact, shape (n, GRID, 5)."""
    n, points, gages = solutions.strain.shape
    angle = -np.pi + 2.0 * np.pi / points * np.arange(points)
    grid = -np.pi + 2.0 * np.pi / GRID * np.arange(GRID)
    found = np.empty((n, GRID, gages))
    for i in range(n):
        half = half_angle(solutions.edges[i, 0])
        for g in range(gages):
            seen = warped(angle, solutions.edges[i, 1, g], half[g])
            order = np.argsort(seen)
            x, y = seen[order], solutions.strain[i, order, g]
            spline = CubicSpline(
                np.append(x, x[0] + 2.0 * np.pi), np.append(y, y[0]), bc_type="periodic"
            )
            found[i, :, g] = spline(x[0] + (grid - x[0]) % (2.0 * np.pi))
    return found


def make(solutions: Solutions, waves: np.ndarray, slip: np.ndarray, scales: np.ndarray) -> Surface:
    """Return the surface of these solutions."""
    n = len(waves)
    turned = waves[:, :, ::-1]
    even, odd = 0.5 * (waves + turned), 0.5 * (waves - turned)
    mean = even.mean(axis=0)
    parts = [_components(even - mean), _components(odd)]
    scores = [part.reshape(len(part), -1) for part in parts]
    terms = radius_terms(solutions.inputs)
    low, high = range_of(solutions.inputs.shape[1])
    return Surface(
        lateral=tire("reference").lateral,
        low=low,
        high=high,
        slip=slip,
        scales=scales,
        points=solutions.inputs,
        even=(even - mean).reshape(n, -1) @ scores[0].T,
        odd=odd.reshape(n, -1) @ scores[1].T,
        edges=solutions.edges,
        forces=solutions.forces,
        mean=mean,
        basis=np.concatenate(parts),
        rolling=np.linalg.lstsq(terms, solutions.free_radius, rcond=None)[0],
        about={},
    )


def _components(waves: np.ndarray) -> np.ndarray:
    _, size, rows = np.linalg.svd(waves.reshape(len(waves), -1), full_matrices=False)
    left = 1.0 - np.cumsum(size**2) / np.sum(size**2)
    count = int(np.argmax(left < KEPT)) + 1
    return rows[:count].reshape(count, *waves.shape[1:])


def fitted_coordinates(solutions: Solutions, waves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return slip constants and scales with the least error at points left out."""
    start = np.concatenate((SLIP, np.log(start_scales(solutions.inputs.shape[1]))))
    first = make(solutions, waves, start[:4], np.exp(start[4:]))
    n, gages = len(first.points), first.lateral.size
    slope = float(np.sqrt(np.mean(np.gradient(waves, 2.0 * np.pi / GRID, axis=1) ** 2)))
    size = np.full(2 * gages, slope * np.sqrt(1.0 / gages))
    size[:gages] /= 2.0 * np.sqrt(np.mean(first.edges[:, 0], axis=0))
    weights = np.concatenate((np.full(len(first.basis), (GRID * gages) ** -0.5), size))
    one = np.hstack((first.even, first.odd, first.edges.reshape(n, -1)))
    two = np.hstack((first.even, -first.odd, first.edges[:, :, ::-1].reshape(n, -1)))
    values = np.concatenate((one, two)) * weights
    fold = np.tile(np.arange(n) % 5, 2)

    def error(guess: np.ndarray) -> float:
        places = places_of(first.points, guess[:4], np.exp(guess[4:]))
        total = 0.0
        for k in range(5):
            out = fold == k
            known = RBFInterpolator(places[~out], values[~out], kernel=KERNEL, degree=DEGREE)
            total += float(np.sum((known(places[out]) - values[out]) ** 2))
        return 1e6 * float(np.sqrt(total / len(values)))

    best = minimize(error, start, method="Nelder-Mead", options=_EFFORT)
    for factors in np.random.default_rng(1).uniform(0.5, 2.0, (RESTARTS, start.size)):
        guess = np.where(np.arange(start.size) < 4, best.x * factors, best.x + np.log(factors))
        again = minimize(error, guess, method="Nelder-Mead", options=_EFFORT)
        best = again if again.fun < best.fun else best
    _tell(f"left-out error while the coordinates were fitted: {error(start):.1f} -> {best.fun:.1f}")
    return best.x[:4], np.exp(best.x[4:])


def predicted(surface: Surface, inputs: np.ndarray, points: int) -> np.ndarray:
    """Return the strain over the angle, shape (n, points, 5)."""
    angle = -np.pi + 2.0 * np.pi / points * np.arange(points)
    answers = surface.answers(inputs)
    return np.array([surface.strain(row[None], angle) for row in answers])


def left_out(solutions: Solutions, waves: np.ndarray, like: Surface) -> dict[str, np.ndarray]:
    """Return the errors at every point when it was left out: strain, forces, R_e."""
    n = len(waves)
    strain = np.empty_like(solutions.strain)
    force, radius = np.empty_like(solutions.forces), np.empty(n)
    for k in range(FOLDS):
        out = np.arange(n) % FOLDS == k
        known = make(solutions.part(~out), waves[~out], like.slip, like.scales)
        inputs = solutions.inputs[out]
        strain[out] = predicted(known, inputs, strain.shape[1]) - solutions.strain[out]
        force[out] = known.forces_of(known.answers(inputs)) - solutions.forces[out]
        radius[out] = radius_terms(inputs) @ known.rolling - solutions.free_radius[out]
    return {"strain": strain, "forces": force, "R_e": radius}


def statement(solutions: Solutions, errors: dict[str, np.ndarray]) -> dict[str, Any]:
    """Return errors by part of the range: rms and largest, [ustrain], [N], [N m], [m]."""
    x = solutions.inputs
    low, high = range_of(x.shape[1])
    inside = np.all((x >= low) & (x <= high), axis=1)
    slip = np.hypot(x[:, 1] / RANGE_HIGH[1], x[:, 2] / RANGE_HIGH[2])
    parts = {
        "all": inside,
        "Fz 0.8 .. 2 kN": inside & (x[:, 0] < 2e3),
        "Fz 2 .. 6 kN": inside & (x[:, 0] >= 2e3) & (x[:, 0] < 6e3),
        "Fz 6 .. 9 kN": inside & (x[:, 0] >= 6e3),
        "|alpha| <= 4 deg": inside & (np.abs(x[:, 1]) <= np.radians(4.0)),
        "|alpha| > 4 deg": inside & (np.abs(x[:, 1]) > np.radians(4.0)),
        "|kappa| <= 0.04": inside & (np.abs(x[:, 2]) <= 0.04),
        "|kappa| > 0.04": inside & (np.abs(x[:, 2]) > 0.04),
        "small slip: hypot(alpha / 8 deg, kappa / 0.12) < 0.5": inside & (slip < 0.5),
        "|camber| > 2 deg": inside & (np.abs(x[:, 3]) > np.radians(2.0)),
        "|camber| <= 2 deg": inside & (np.abs(x[:, 3]) <= np.radians(2.0)),
        "speed < 60 km/h": inside & (x[:, 4] < 60.0 / 3.6),
        "speed >= 60 km/h": inside & (x[:, 4] >= 60.0 / 3.6),
        "pressure < 2.4 bar": inside & (x[:, 5] < 2.4e5),
        "pressure >= 2.4 bar": inside & (x[:, 5] >= 2.4e5),
    }
    if x.shape[1] > RANGE_LOW.size:
        own = tire("reference").friction
        for start, end in ((0.3, 0.5), (0.5, 0.8), (0.8, 1.1)):
            parts[f"friction {start} .. {end}"] = (
                inside & (x[:, 6] >= start) & (x[:, 6] < end) & (x[:, 6] != own)
            )
        parts[f"friction {own}"] = inside & (x[:, 6] == own)
    return {
        name: {
            "points": int(chosen.sum()),
            **_sizes(1e6 * errors["strain"][chosen], "strain_ustrain"),
            **{
                f"{force}_rms": float(np.sqrt(np.mean(errors["forces"][chosen, i] ** 2)))
                for i, force in enumerate(("Fx_N", "Fy_N", "Mz_Nm", "loaded_radius_m"))
            },
            "R_e_m_rms": float(np.sqrt(np.mean(errors["R_e"][chosen] ** 2))),
        }
        for name, chosen in parts.items()
        if chosen.any()
    }


def _tell(*words: object) -> None:
    sys.stdout.write(" ".join(map(str, words)) + "\n")


def _sizes(error: np.ndarray, name: str) -> dict[str, float]:
    largest = np.abs(error).max(axis=(1, 2))
    return {
        f"{name}_rms": float(np.sqrt(np.mean(error**2))),
        f"{name}_median_of_largest": float(np.median(largest)),
        f"{name}_largest": float(largest.max()),
    }


def main(folder: Path, out: Path, most: int | None, more: Path | None) -> None:
    """Fit, state the error, write."""
    solutions = read_solutions(folder, most, more)
    waves = common(solutions)
    slip, scales = fitted_coordinates(solutions, waves)
    surface = make(solutions, waves, slip, scales)
    errors = left_out(solutions, waves, surface)
    told = statement(solutions, errors)
    low, high = limits(more is not None)
    size = 1e6 * float(np.sqrt(np.mean((solutions.strain - solutions.strain.mean((0, 1))) ** 2)))
    about = {
        "tire": tire("reference").name,
        "made_by": f"build/virtual_tire of tirelib {__version__}, numerical rig, default mesh",
        "inputs": list(surface.inputs),
        "solutions": len(waves),
        "not_solved": solutions.failed,
        "design": "scrambled Sobol points, seed 2"
        + (f"; with friction {FRICTION_DESIGN}, seed 3" if more else ""),
        "design_low": low.tolist(),
        "design_high": high.tolist(),
        "error": f"{FOLDS}-fold cross-validation, a point and its mirror image left out together",
        "strain_spread_ustrain": size,
        "left_out": told,
    }
    write_surface(replace(surface, about=about), out)
    _tell(json.dumps(about, indent=1))
    _tell(f"components {surface.even.shape[1]} + {surface.odd.shape[1]}")
    _tell("slip", slip.round(3), "scales", scales.round(3))
    _tell(f"{out}: {out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    with one_thread():
        parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
        parser.add_argument("--folder", type=Path, default=OUT)
        parser.add_argument("--out", type=Path, default=OUT.parent / "virtual_tire.npz")
        parser.add_argument("--points", type=int, help="take only the first ones")
        parser.add_argument("--friction", action="store_true", help="with friction as an input")
        given = parser.parse_args()
        main(given.folder, given.out, given.points, OUT_FRICTION if given.friction else None)
