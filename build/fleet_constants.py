"""Measure the numbers that decide on a fleet's page, at half and at double.

    python build/fleet_constants.py

Drawn tires only: what is counted is how often equal tires are marked, and how often planted ones
are; and how far joined numbers move when the grid of the scatter ends elsewhere.
"""

import click
import numpy as np

from tirelib.core.threads import one_thread
from tirelib.fleet import siblings, spread

DRAWS = 200
TIRES = 12


def main() -> None:
    """Print one table a number."""
    click.echo("| FALSE_ALARM | equal tires marked | one at 5 scatters found | drift of 3 found |")
    click.echo("|---|---|---|---|")
    usual = spread.FALSE_ALARM
    for factor in (0.5, 1.0, 2.0):
        spread.FALSE_ALARM = factor * usual
        click.echo(
            f"| {spread.FALSE_ALARM:g} | {_marked(0.0):.1%} | {_marked(5.0):.1%} | "
            f"{_drifts(3.0, spread.FALSE_ALARM):.1%} |"
        )
    spread.FALSE_ALARM = usual
    click.echo("\n| LARGEST_SHARE | equal tires marked | one at 5 scatters found |\n|---|---|---|")
    share = spread.LARGEST_SHARE
    for factor in (0.5, 1.0, 2.0):
        spread.LARGEST_SHARE = factor * share
        click.echo(f"| {spread.LARGEST_SHARE:g} | {_marked(0.0):.1%} | {_marked(5.0):.1%} |")
    spread.LARGEST_SHARE = share
    click.echo("\n| WIDEST | largest move of a joined number, in its std |\n|---|---|")
    widest = siblings.WIDEST
    for factor in (0.5, 2.0):
        click.echo(f"| {factor * widest:g} | {_moved(factor * widest, widest):.4f} |")


def _tires(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    stds = rng.uniform(0.2, 1.0, TIRES)
    return rng.normal(0.0, 1.0, TIRES) + stds * rng.standard_normal(TIRES), stds


def _marked(planted: float) -> float:
    rng = np.random.default_rng(1)
    count = 0
    for _ in range(DRAWS):
        values, stds = _tires(rng)
        stds[0] = 0.2
        values[0] += planted
        outlier = spread.spread_of(values, stds).outlier
        count += bool(outlier[0] if planted else outlier.any())
    return count / DRAWS


def _drifts(planted: float, level: float) -> float:
    """Share of twelve-point series with a drift of so many scatters that is found among ten."""
    rng = np.random.default_rng(2)
    time = np.arange(12.0)
    found = 0
    for _ in range(DRAWS):
        change = spread.change_of(time, rng.normal(0.0, 1.0, 12) + planted * time / 11.0)
        found += change is not None and change.p * 10 < level
    return found / DRAWS


def _moved(changed: float, usual: float) -> float:
    rng = np.random.default_rng(3)
    most = 0.0
    for _ in range(DRAWS):
        values = 100.0 + rng.normal(0.0, 3.0, 5)
        stds = rng.uniform(0.5, 10.0, 5)
        means = []
        for width in (usual, changed):
            siblings.WIDEST = width
            joined = siblings.join(values, stds)
            means.append(joined)
        siblings.WIDEST = usual
        first, second = means
        if first is None or second is None:
            raise SystemExit("five tires were not joined")
        std = (first.high - first.low) / 3.92
        most = max(most, float(np.max(np.abs(first.value - second.value) / std)))
    return most


if __name__ == "__main__":
    with one_thread():
        main()
