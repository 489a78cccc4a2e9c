"""Half and double of the numbers of `tirelib export`, on made-up tires of the brush.

Prints one table for each constant of `tirelib.inference.magic.fit` and
`tirelib.inference.compare.magic_points`: the error that it admits, or the error of the fitted Magic
Formula against the brush, at half of it, at itself and at double. Takes two minutes:
``.venv/bin/python build/export_constants.py``.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from tirelib.core.errors import CalibrationError
from tirelib.core.parameters import Number, TireFile
from tirelib.core.threads import one_thread
from tirelib.inference.compare import magic_points
from tirelib.inference.compare.force_model import ForceModel, force_model_of
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.magic import fit as magic_fit
from tirelib.inference.magic.fit import fit_magic
from tirelib.physics.brush.mf import magic_forces

TIRES = 8
RANGE = {"slip_angle": 0.2, "slip_ratio": 0.15, "speed": 16.0, "radius": 0.32}
NAMES = ("load", "slip_angle", "slip_ratio", "camber", "pressure")


def brush(seed: int) -> ForceModel:
    """Return a brush with numbers drawn about those of a passenger car's tire."""
    random = np.random.default_rng(seed)
    values = {
        "bristle_lateral": 9e6 * random.uniform(0.6, 1.6),
        "bristle_longitudinal": 12e6 * random.uniform(0.6, 1.6),
        "friction": random.uniform(0.7, 1.2),
        "half_length": 0.06 * random.uniform(0.8, 1.2),
        "load_power": random.uniform(0.3, 0.6),
        "reference_load": 4000.0,
        "reference_pressure": 2.2e5,
        "pressure_power": random.uniform(-0.6, -0.2),
        "free_radius": 0.32,
    }
    numbers = {name: Number(x, np.nan, "assumed", "drawn") for name, x in values.items()}
    return force_model_of(TireFile("drawn", numbers))


@contextmanager
def changed(module: Any, **values: Any) -> Iterator[None]:
    """Set constants of a module for a while."""
    before = {name: getattr(module, name) for name in values}
    for name, value in values.items():
        setattr(module, name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            setattr(module, name, value)


def error(points: ForceData, asked: ForceData) -> float:
    """Return the rms error of Fy at points asked for, over the largest Fy; NaN without a fit."""
    try:
        tire = fit_magic(points, radius=0.32, nominal_load=4000.0).tire
    except CalibrationError:
        return np.nan
    found = magic_forces(tire, *(getattr(asked, name) for name in NAMES))
    return float(np.sqrt(np.mean((found.Fy - asked.Fy) ** 2)) / np.abs(asked.Fy).max())


def shown(name: str, tried: dict[str, list[float]]) -> None:
    """Print a constant's line: median and largest over the tires, in percent."""
    sys.stdout.write(f"{name}\n")
    for value, found in tried.items():
        kept = np.array(found)[np.isfinite(found)]
        said = f"{100 * np.median(kept):.2f} {100 * kept.max():.2f}" if kept.size else "no fit"
        sys.stdout.write(f"  {value:>16}: {said}  ({kept.size} of {len(found)} tires)\n")


def pure(models: list[ForceModel]) -> None:
    """Show by how much the other slip changes a force, where it counts as none."""
    alpha, kappa = magic_fit.PURE_ANGLE, magic_fit.PURE_RATIO
    own = np.concatenate([-np.geomspace(0.005, 0.2, 20), np.geomspace(0.005, 0.2, 20)])

    def loss(model: ForceModel, force: str, other: float) -> float:
        along = force == "Fx"
        rows = [
            (4000.0, 2.2e5, 0.0, x if along else s, s if along else x)
            for x in (0.0, other)
            for s in own
        ]
        at = model.predict(magic_points._points(np.array(rows), 16.0, 0.32))
        plain, with_ = getattr(at, force).reshape(2, -1)
        return float(np.abs(with_ - plain).max() / np.abs(plain).max())

    for name, force, middle in (("PURE_RATIO", "Fy", kappa), ("PURE_ANGLE [rad]", "Fx", alpha)):
        tried = {
            f"{s * middle:.4f}": [loss(m, force, s * middle) for m in models]
            for s in (0.5, 1.0, 2.0)
        }
        shown(f"{name}: largest change of {force} by the other slip, % of its peak", tried)


def noisy(points: ForceData, seed: int, share: float = 0.01) -> ForceData:
    """Return points whose side force has noise, as a share of its peak."""
    noise = share * np.abs(points.Fy).max()
    return replace(
        points, Fy=points.Fy + noise * np.random.default_rng(seed).standard_normal(points.Fy.size)
    )


def made(models: list[ForceModel], **constants: Any) -> list[ForceData]:
    """Return the points of every model with some constants of `magic_points` changed."""
    with changed(magic_points, **constants):
        return [magic_points.model_points(model, **RANGE) for model in models]


def upright(models: list[ForceModel], **constants: Any) -> list[ForceData]:
    """Return the points in pure side slip at the reference pressure."""
    return [
        p.take((p.slip_ratio == 0.0) & (p.pressure == 2.2e5)) for p in made(models, **constants)
    ]


def main() -> None:
    """Print all tables."""
    models = [brush(seed) for seed in range(TIRES)]
    pure(models)
    side = upright(models)
    tried: dict[str, list[float]] = {}
    for each in (1, 2, 4):
        rng = np.random.default_rng(0)
        few = [p.take(np.sort(rng.permutation(p.load.size)[: 12 * each])) for p in side]
        with changed(magic_fit, POINTS_PER_COEFFICIENT=1):
            tried[str(each)] = [
                error(noisy(a, k), b) for k, (a, b) in enumerate(zip(few, side, strict=True))
            ]
    shown("POINTS_PER_COEFFICIENT: error of Fy, noise of 1 %", tried)
    tried = {}
    for ratio in (1.025, 1.05, 1.1):
        near = upright(models, LOADS=(1.0, 0.5 * (1.0 + ratio), ratio))
        for what, limit in (("fitted", 1.0), ("not fitted", 9.0)):
            with changed(magic_fit, VARIED=limit):
                tried[f"{ratio} {what}"] = [error(noisy(p, k), p) for k, p in enumerate(near)]
    shown("VARIED: error of Fy with and without coefficients of load, noise of 1 %", tried)
    asked = made(models, LOADS=(0.3, 0.6, 0.9, 1.1, 1.4, 1.7), PRESSURES=(0.9, 1.1))
    tried = {}
    for count in (4, 7, 14):
        given = made(models, LOADS=tuple(np.linspace(0.25, 1.75, count).tolist()))
        tried[f"{count} loads"] = [error(p, q) for p, q in zip(given, asked, strict=True)]
    shown("LOADS: error of Fy at loads and pressures between", tried)
    tried = {}
    for step in (0.075, 0.15, 0.3):
        given = made(models, PRESSURES=(1.0 - step, 1.0 + step))
        tried[f"+-{step}"] = [error(p, q) for p, q in zip(given, asked, strict=True)]
    shown("PRESSURES: error of Fy at loads and pressures between", tried)


if __name__ == "__main__":
    with one_thread():
        main()
