"""A linear problem without any tire: what a model leaves is known exactly."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects import Effect, effect
from tirelib.inference.statistics.null import OWN
from tirelib.inference.statistics.plain import Family
from tirelib.inference.statistics.problem import Point

N, SHAPES = 300, 6
PLAIN = {"swell": 0.05, "bend": 0.002, "twist": 0.002, "smooth, all": 0.3, "smooth, there": 0.05}
"""Standard deviations of what the toy's plain tires show."""


def _law(name: str, low: float = -2.0, high: float = 2.0) -> Effect:
    def law(state: Any, strength: float) -> Any:
        return state

    law.__doc__ = f"The {name}."
    return effect(name, stage="gage", unit="1", low=low, high=high, source="toy")(law)


EFFECTS = {
    name: _law(name, *ends)
    for name, ends in {"swell": (-2.0, 2.0), "bend": (-2.0, 2.0), "twist": (0.0, 2.0)}.items()
}


@dataclass(frozen=True)
class Solved:
    rest: FloatArray


LEAST_OWN = OWN[0]
"""Size of a sample's own misfit at which there is none."""


class Louder:
    """Whitening of noise that is larger by what each sample has for itself."""

    def __init__(self, own: float) -> None:
        self.std = np.hypot(1.0, (own - LEAST_OWN) / 0.001)
        self.log_volume = -N * float(np.log(self.std))

    def __call__(self, rows: FloatArray) -> FloatArray:
        return self.white(rows)

    def reduced(self, rows: FloatArray) -> FloatArray:
        return rows

    def white(self, reduced: FloatArray) -> FloatArray:
        return np.asarray(reduced / self.std)

    def coloured(self, white: FloatArray) -> FloatArray:
        return np.asarray(white * self.std)


class Toy:
    """Measured numbers that are linear in everything."""

    def __init__(self, measured: FloatArray, *, alike: bool = False, seed: int = 7) -> None:
        random = np.random.default_rng(seed)
        self.measured = measured
        self.base = random.standard_normal((3, N))
        self.shapes = random.standard_normal((SHAPES, N)) / 5.0
        self.there = random.standard_normal((SHAPES, N)) / 5.0
        self.by = {name: random.standard_normal((1, N)) for name in EFFECTS}
        if alike:
            self.by["bend"] = self.by["twist"] + 1e-6 * self.by["bend"]
        self.start = Point(np.zeros(3))
        self.starts = (self.start,)
        self.widths = np.full(3, 10.0)
        self.ends = np.full(3, -np.inf), np.full(3, np.inf)
        self.dead: Mapping[str, str] = {}
        self.living = tuple(EFFECTS.values())
        self.lookalike = 0.075

    def whitener(self, own: float) -> "Louder":
        return Louder(own)

    def thinned(self) -> "Toy":
        return self

    def forget(self) -> None:
        pass

    def about(self, solved: Any) -> "Toy":
        return self

    def solve(self, point: Point, near: Any = None) -> Solved:
        model = point.base @ self.base
        for each, strength in zip(point.effects, point.strengths, strict=True):
            model = model + (strength / each.scale) @ self.by[each.name]
        return Solved(self.measured - model)

    def slopes(self, point: Point, solved: Any, *, near: bool = False) -> FloatArray:
        return np.concatenate([self.base, *(self.by[e.name] for e in point.effects)])

    def remainder(self, point: Point, solved: Any) -> dict[str, FloatArray]:
        return {"smooth, all": self.shapes, "smooth, there": self.there}

    def roughly(
        self, point: Point, solved: Any, slopes: FloatArray, count: int
    ) -> list[FloatArray]:
        each = by_effect(point, slopes, count)
        return [np.linalg.norm(size) * own * np.sin(np.arange(N) / 10.0) for own, size in each]


def by_effect(
    point: Point, slopes: FloatArray, count: int
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the slopes of each of the first effects, and its strength, in ranges."""
    first = len(point.base)
    for size in point.ranges[:count]:
        yield slopes[first : first + len(size)], size
        first += len(size)


def drawn(random: np.random.Generator, *, size: float = 1.0, **planted: float) -> FloatArray:
    """Return what a plain toy tire shows, with effects planted, in ranges."""
    toy = Toy(np.zeros(N))
    rest = random.standard_normal(N) + random.standard_normal(3) @ toy.base
    for name, rows in toy.by.items():
        strength = size * PLAIN[name] * random.standard_normal() + planted.get(name, 0.0)
        rest = rest + strength * rows[0]
    for name, rows in toy.remainder(toy.start, None).items():
        rest = rest + size * PLAIN[name] * random.standard_normal(SHAPES) @ rows
    return np.asarray(rest)


def family(count: int, seed: int = 1, name: str = "toys") -> Family:
    """Return a family whose tires are as `PLAIN` says."""
    random = np.random.default_rng(seed)
    blocks = {**dict.fromkeys(EFFECTS, 1), "smooth, all": SHAPES, "smooth, there": SHAPES}
    sizes = np.concatenate([np.full(rows, PLAIN[block]) for block, rows in blocks.items()])
    draws = sizes * random.standard_normal((count, sizes.size))
    parts = np.split(draws**2, [1, 2, 3, 3 + SHAPES], axis=1)
    squares = np.stack([part.mean(axis=1) for part in parts], axis=1)
    return Family(name, 0.001, blocks, draws, squares)
