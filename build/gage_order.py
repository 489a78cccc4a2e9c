"""What the agreement of the gages tells: their order, and smooth disturbances of one.

    python build/gage_order.py CAMPAIGN... --calibration cal.toml

Every pair of gages is exchanged in every turn, and an outer gage of every run gets six disturbances
of 50 to 630 microstrain: a bump in every turn or a wave, 0.05 to 1.5 turns long. Printed are own
turns that are flagged `other_tire`, and valid turns that are wrong: off by more than three standard
deviations, and by more than 105 N of load, 0.2 deg or 150 N of side force. Without the agreement,
and with half, the whole and double of its limit.
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from itertools import combinations
from pathlib import Path

import click
import numpy as np

from tirelib.campaign import Campaign, read_campaign
from tirelib.core.arrays import BoolArray
from tirelib.core.flags import TurnFlag
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.measured.features import Features
from tirelib.measured.observations import measure_run, observe
from tirelib.measured.signal import LowPass

GOALS = {"Fz": 105.0, "alpha": float(np.deg2rad(0.2)), "Fy": 150.0}
SIZES, LENGTHS, TRIALS = (50e-6, 630e-6), (0.05, 1.5), 6
Pair = tuple[Features, Features]


def exchanged(features: Features) -> Iterator[Features]:
    """Yield what two gages show whose wires are exchanged, for every pair."""
    rows = {field.name: getattr(features, field.name) for field in fields(features)}
    for one, two in combinations(range(features.lateral.size), 2):
        order = np.arange(features.lateral.size)
        order[[one, two]] = two, one
        wired = {name: x[:, order] for name, x in rows.items() if x.ndim == 2}
        yield replace(features, **wired)


def disturbed(campaign: Campaign, low_pass: LowPass) -> Iterator[Pair]:
    """Yield features of runs as they are, and with a smooth disturbance of an outer gage."""
    rng = np.random.default_rng(7)
    for run in campaign.runs():
        if run.strain is None:
            continue
        clean, _ = measure_run(run, campaign.header, low_pass)
        outer = [g for g in range(len(run.strain)) if g != clean.centre_gage]
        turn = 2.0 * np.pi / float(np.nanmedian(clean.omega)) * run.rate
        for _ in range(TRIALS):
            size, length = (np.exp(rng.uniform(*np.log(ends))) for ends in (SIZES, LENGTHS))
            x = np.arange(run.strain.shape[1]) / turn + rng.uniform()
            bump = np.exp(-0.5 * ((x % 1.0 - 0.5) / (0.25 * length)) ** 2)
            strain = run.strain.copy()
            shape = bump if rng.random() < 0.5 else np.sin(2.0 * np.pi * x / length)
            strain[rng.choice(outer)] += size * rng.choice([-1.0, 1.0]) * shape
            other, _ = measure_run(replace(run, strain=strain), campaign.header, low_pass)
            if len(other) == len(clean):
                yield clean, other


def wrong(known: Calibration, every: Calibration, pair: Pair) -> BoolArray:
    """Tell which turns are valid by `known` and wrong, where the clean ones are valid."""
    clean, found = (every.estimate(features) for features in pair)
    off = np.zeros(len(pair[0]), dtype=np.bool_)
    for quantity, goal in GOALS.items():
        apart = np.abs(found.value[quantity] - clean.value[quantity])
        off |= (apart > goal) & (apart > 3.0 * found.std[quantity])
    valid = known.estimate(pair[1]).turn_valid
    return np.asarray(off & valid & clean.turn_valid, dtype=np.bool_)


def with_limit(known: Calibration, factor: float) -> Calibration:
    """Return a calibration whose limit of the agreement is another; none for an infinite one."""
    chains = {}
    for missing, chain in known.chains.items():
        one = chain.agreement
        if one is not None:
            one = replace(one, limit=factor * one.limit) if np.isfinite(factor) else None
        chains[missing] = replace(chain, agreement=one)
    return replace(known, chains=chains)


def main() -> None:
    """Print a line for each campaign and limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaigns", type=Path, nargs="+")
    parser.add_argument("--calibration", type=Path, required=True)
    given = parser.parse_args()
    own = read_calibration(given.calibration)
    kinds: Mapping[str, Calibration] = {
        name: with_limit(own, factor)
        for name, factor in (("without", np.inf), ("half", 0.5), ("whole", 1.0), ("double", 2.0))
    }
    every = kinds["without"]
    for path in given.campaigns:
        campaign = read_campaign(path)
        features = observe([campaign]).features
        order = [(features, other) for other in exchanged(features)]
        smooth = list(disturbed(campaign, LowPass(own.order, own.cut_off)))
        for name, known in kinds.items():
            found = known.estimate(features)
            other = (found.flags & int(TurnFlag.OTHER_TIRE)) != 0
            turns = sum(int(wrong(known, every, pair).sum()) for pair in order)
            trials = sum(bool(wrong(known, every, pair).any()) for pair in smooth)
            click.echo(
                f"{path}, {name}: {other.sum()} of {(found.turn_valid | other).sum()} own turns "
                f"flagged; exchanged: {turns} of {10 * every.estimate(features).turn_valid.sum()} "
                f"turns valid and wrong; disturbed: {trials} of {len(smooth)} runs"
            )


if __name__ == "__main__":
    with one_thread():
        main()
