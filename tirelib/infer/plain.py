"""What plain tires show beside their model: learned from tires in which nothing is hidden.

A model is not a tire. What a fitted model leaves of a tire without any of the catalogue's effects
looks to some extent like them, and to some extent like nothing known. Both are learned, from plain
tires of families that share no code: for every family the variance of each effect's apparent
strength, in ranges, and that of each group of smooth shapes (expectation and maximisation of the
likelihood; Dempster, Laird and Rubin 1977). The tires themselves are kept as well, each as one draw
of all coefficients from its posterior. Put into a user's plan they show how large a statistic gets
where nothing is hidden.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.infer.normal import Normal, Weighed

ROUNDS = 60
SETTLED = 0.01
"""Relative change of all variances below which they are learned."""
START = 0.02**2
FLOOR = {"effect": 0.1, "shape": 0.3}
"""Least size of an effect, or of a group of shapes, over that of the largest in its family: what
twenty tires of one family hardly show, those of another may."""
TINY = 1e-8
"""Least variance while they are learned."""
BASE, ROUGHLY = "base", "roughly "


@dataclass(frozen=True, slots=True, eq=False)
class Family:
    """Plain tires of one family.

    Attributes
    ----------
    name : str
    own : float
        Median size of the misfit that each run has for itself, over its rms strain.
    blocks : mapping of name to number of rows
    draws : shape (n_tires, n_rows)
        Coefficients of all blocks, one draw of the posterior a tire; NaN where its plan did not
        show the block.
    squares : shape (n_tires, n_blocks)
        Expected mean squares of each block's coefficients; NaN likewise.
    """

    name: str
    own: float
    blocks: Mapping[str, int]
    draws: FloatArray
    squares: FloatArray

    def __len__(self) -> int:
        return len(self.draws)

    def spread(self) -> dict[str, float]:
        """Return the variances by block."""
        known = np.isfinite(self.squares)
        total = np.where(known, self.squares, 0.0).sum(axis=0)
        count = known.sum(axis=0)
        mean = np.where(count > 0, total / np.maximum(count, 1), START)
        shapes = np.array(["," in name for name in self.blocks])
        least = np.zeros(len(mean))
        for kind, which in (("effect", ~shapes), ("shape", shapes)):
            least[which] = FLOOR[kind] ** 2 * float(np.max(mean, where=which, initial=0.0))
        return dict(zip(self.blocks, np.maximum(mean, least).tolist(), strict=True))

    def on(self, blocks: Mapping[str, slice], count: int) -> FloatArray:
        """Return the tires' coefficients for the rows of a user's plan, (n_tires, count).

        A block that a tire did not show, or the family does not know, is zero.
        """
        out = np.zeros((len(self), count))
        first = 0
        for name, rows in self.blocks.items():
            block = blocks.get(name)
            if block is not None:
                out[:, block] = self.draws[:, first : first + rows]
            first += rows
        return np.nan_to_num(out)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Normal equations of a tire's plan at one size of the misfit that each run has for itself.

    Attributes
    ----------
    own : float
    normal : Normal
    log_volume : float
        Logarithm of the whitening's determinant: likelihoods at several sizes compare with it.
    white : shape (m, n)
        Whitened rows; empty where only the normal equations are kept.
    """

    own: float
    normal: Normal
    log_volume: float
    white: FloatArray


def learn(name: str, tires: Sequence[Sequence[View]], widths: FloatArray) -> Family:
    """Return a family from its plain tires.

    Parameters
    ----------
    name : str
    tires : sequence of sequence of View
        Each about a fitted model without effects, at the same sizes of a run's own misfit. Every
        tire takes its most likely one.
    widths : shape (n_base,)
        Prior standard deviations of the base.
    """
    blocks: dict[str, int] = {}
    for tire in tires:
        for block, where in tire[0].normal.blocks.items():
            if block != BASE:
                blocks.setdefault(block, where.stop - where.start)
    spread = dict.fromkeys(blocks, START)
    squares = np.zeros((len(tires), len(blocks)))
    likeliest = [tire[0] for tire in tires]
    for _ in range(ROUNDS):
        known: dict[str, float | FloatArray] = {**spread, BASE: widths**2}
        for k, tire in enumerate(tires):
            weighed = [Weighed(each.normal, each.normal.spread(known)) for each in tire]
            at = [w.log_likelihood() + e.log_volume for w, e in zip(weighed, tire, strict=True)]
            best = int(np.argmax(at))
            likeliest[k] = tire[best]
            mean = weighed[best].mean(tire[best].normal.right)
            square = mean**2 + np.diag(weighed[best].covariance)
            for j, block in enumerate(blocks):
                rows = tire[best].normal.blocks.get(block)
                squares[k, j] = np.nan if rows is None else float(np.mean(square[rows]))
        new = np.maximum(np.nanmean(squares, axis=0), TINY)
        old = np.array(list(spread.values()))
        spread = dict(zip(blocks, new.tolist(), strict=True))
        if float(np.abs(np.log(new / old)).max()) < SETTLED:
            break
    random = np.random.default_rng(0)
    draws = np.full((len(tires), sum(blocks.values())), np.nan)
    for draw, each in zip(draws, likeliest, strict=True):
        normal = each.normal
        drawn = Weighed(normal, normal.spread({**spread, BASE: widths**2})).draws(random)[0]
        first = 0
        for block, size in blocks.items():
            rows = normal.blocks.get(block)
            if rows is not None:
                draw[first : first + size] = drawn[rows]
            first += size
    own = float(np.median([each.own for each in likeliest]))
    return Family(name, own, blocks, draws, squares)


def save(path: Path, families: Sequence[Family], provenance: Mapping[str, object]) -> None:
    """Write families and where they come from."""
    arrays: dict[str, FloatArray] = {}
    about = {}
    for family in families:
        arrays[f"{family.name}/draws"] = family.draws.astype(np.float32)
        arrays[f"{family.name}/squares"] = family.squares.astype(np.float32)
        about[family.name] = {"own": family.own, "blocks": dict(family.blocks)}
    text = json.dumps({"families": about, "provenance": dict(provenance)}, indent=1)
    np.savez_compressed(path, about=np.array(text), **arrays)  # type: ignore[arg-type]


def load(path: Path) -> tuple[tuple[Family, ...], dict[str, object]]:
    """Return what `save` wrote."""
    with np.load(path, allow_pickle=False) as file:
        about = json.loads(str(file["about"]))
        families = tuple(
            Family(
                name,
                float(each["own"]),
                dict(each["blocks"]),
                file[f"{name}/draws"].astype(float),
                file[f"{name}/squares"].astype(float),
            )
            for name, each in about["families"].items()
        )
        return families, about["provenance"]


def pooled(families: Sequence[Family]) -> dict[str, float]:
    """Return variances by block over families that count the same: the metric of a fit."""
    each = [family.spread() for family in families]
    names = dict.fromkeys(name for spread in each for name in spread)
    return {
        name: float(np.mean([spread[name] for spread in each if name in spread])) for name in names
    }
