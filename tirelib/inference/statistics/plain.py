"""What plain tires show beside their model: learned from tires in which nothing is hidden.

A model is not a tire. What a fitted model leaves of a tire without any of the catalogue's effects
looks to some extent like them, and to some extent like nothing known. Both are learned, from plain
tires of families that share no code: for every family the mean and the variance of each effect's
apparent strength, in ranges, and the variance of each group of smooth shapes (expectation and
maximisation of the likelihood; Dempster, Laird and Rubin 1977). The tires themselves are kept as
well, each as one draw of all coefficients from its posterior. Put into a user's plan they show how
large a statistic gets where nothing is hidden.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.normal import Weighed
from tirelib.inference.statistics.size import FAR, LARGEST
from tirelib.inference.statistics.views import View

ROUNDS = 60
SETTLED = 0.01
"""Relative change of all variances below which they are learned."""
START = 0.02**2
EVEN = 0.25
"""Least that a tire shows of one block, over what its family shows of all on the average: what
the tires of one family hardly show, those of another may. It counts as a change of what is
measured, in which one effect is as good as another, and does not hold where families cover each
other (`covering`). Half and double of it: docs/theory/verdict_numbers.md."""
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
    largest : float
        Most by which one tire shows more of the smooth shapes than its family; for effects,
        never more than `LARGEST`.
    least : mapping of block to variance
        What the tire may show at least (`covering`). Where it is empty, `spread` says it.
    means : mapping of effect to float
        What all tires of the family show of an effect of one number, in ranges; the squares are
        about it.
    """

    name: str
    own: float
    blocks: Mapping[str, int]
    draws: FloatArray
    squares: FloatArray
    largest: float = LARGEST
    least: Mapping[str, float] = field(default_factory=dict)
    means: Mapping[str, float] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.draws)

    def shown(self) -> dict[str, float]:
        """Return the mean squares of coefficients by block, and `least` where it is more."""
        known = np.isfinite(self.squares)
        total = np.where(known, self.squares, 0.0).sum(axis=0)
        count = known.sum(axis=0)
        mean = np.where(count > 0, total / np.maximum(count, 1), START)
        shown = dict(zip(self.blocks, mean.tolist(), strict=True))
        return shown | {k: max(least, shown.get(k, 0.0)) for k, least in self.least.items()}

    def spread(self, sizes: Mapping[str, float]) -> dict[str, float]:
        """Return the variances by block in a plan, with what it shows at least.

        Parameters
        ----------
        sizes : mapping of block to float
            Mean square of its rows in this plan; zero where they do nothing, and nothing is added.
        """
        shown = self.shown()
        if self.least:
            return shown
        mean = float(np.mean([shown[k] * size for k, size in sizes.items() if k in shown]))
        least = {
            k: EVEN**2 * mean / size if size and not k.endswith(FAR) else 0.0
            for k, size in sizes.items()
        }
        return {k: max(shown.get(k, 0.0), least[k]) for k in sizes}

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


def learn(
    name: str,
    tires: Sequence[Sequence[View]],
    widths: FloatArray,
    largest: float = LARGEST,
) -> Family:
    """Return a family from its plain tires.

    Parameters
    ----------
    name : str
    tires : sequence of sequence of View
        Each about a fitted model without effects, at the same sizes of a run's own misfit. Every
        tire takes its most likely one.
    widths : shape (n_base,)
        Prior standard deviations of the base.
    largest : float
        Most by which one tire shows more of the smooth shapes than its family.
    """
    blocks: dict[str, int] = {}
    for tire in tires:
        for block, where in tire[0].normal.blocks.items():
            if block != BASE:
                blocks.setdefault(block, where.stop - where.start)
    spread = dict.fromkeys(blocks, START)
    means = {block: 0.0 for block, rows in blocks.items() if rows == 1}
    squares = np.zeros((len(tires), len(blocks)))
    shown = np.full((len(tires), len(blocks)), np.nan)
    likeliest = [tire[0] for tire in tires]
    for _ in range(ROUNDS):
        known: dict[str, float | FloatArray] = {**spread, BASE: widths**2}
        for k, tire in enumerate(tires):
            views = [replace(each, normal=each.normal.about(means)) for each in tire]
            weighed = [Weighed(each.normal, each.normal.spread(known)) for each in views]
            at = [w.log_likelihood() + e.log_volume for w, e in zip(weighed, views, strict=True)]
            best = int(np.argmax(at))
            likeliest[k] = views[best]
            mean = weighed[best].mean(views[best].normal.right)
            square = mean**2 + np.diag(weighed[best].covariance)
            for j, block in enumerate(blocks):
                rows = views[best].normal.blocks.get(block)
                squares[k, j] = np.nan if rows is None else float(np.mean(square[rows]))
                if rows is not None and block in means:
                    shown[k, j] = means[block] + float(mean[rows][0])
        new = np.maximum(np.nanmean(squares, axis=0), TINY)
        old = np.array(list(spread.values()))
        spread = dict(zip(blocks, new.tolist(), strict=True))
        means = {
            block: float(np.nanmean(shown[:, j]))
            for j, block in enumerate(blocks)
            if block in means
        }
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
                draw[first : first + size] = drawn[rows] + means.get(block, 0.0)
            first += size
    own = float(np.median([each.own for each in likeliest]))
    return Family(name, own, blocks, draws, squares, largest, means=means)


def save(path: Path, families: Sequence[Family], provenance: Mapping[str, object]) -> None:
    """Write families and where they come from."""
    arrays: dict[str, FloatArray] = {}
    about = {}
    for family in families:
        arrays[f"{family.name}/draws"] = family.draws.astype(np.float32)
        arrays[f"{family.name}/squares"] = family.squares.astype(np.float32)
        about[family.name] = {
            "own": family.own,
            "blocks": dict(family.blocks),
            "largest": family.largest,
            "means": dict(family.means),
        }
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
                float(each.get("largest", LARGEST)),
                means=dict(each.get("means", {})),
            )
            for name, each in about["families"].items()
        )
        return families, about["provenance"]


def covering(families: Sequence[Family]) -> tuple[Family, ...]:
    """Return families each of which shows at least what these show on the average.

    What tires of one family hardly show, those of another may.
    """
    each = [family.shown() for family in families]
    names = dict.fromkeys(name for shown in each for name in shown)
    least = {
        name: float(np.mean([shown[name] for shown in each if name in shown])) for name in names
    }
    return tuple(replace(family, least=least) for family in families)


def pooled(families: Sequence[Family], sizes: Mapping[str, float]) -> dict[str, float]:
    """Return variances by block over families that count the same: the metric of a fit.

    The sizes are those of `Family.spread`.
    """
    each = [
        {k: v + family.means.get(k, 0.0) ** 2 for k, v in family.spread(sizes).items()}
        for family in families
    ]
    names = dict.fromkeys(name for spread in each for name in spread)
    return {
        name: float(np.mean([spread[name] for spread in each if name in spread])) for name in names
    }
