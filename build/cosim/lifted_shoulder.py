"""What a gage reads whose strip of the tread hardly touches the road, and how steep its flanks are.

    python build/cosim/lifted_shoulder.py          # campaigns of build/cosim/calibrate.py

Prints, by the steepness of a gage's flanks over that of the median gage, the contact lengths that
the rig knows and what is read there; and what half and double of `DEAD_SHARE` leave out and let in.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import click
import numpy as np
import pandas as pd

from cosim.calibrate import plans
from tirelib.campaign import read_campaign
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.measured.observations import observe
from tirelib.measured.signal import quality
from tirelib.rig.campaign import TRUTH_FILE

SHARES = (0.0, 0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7)
"""Lower ends of the rows, over the median gage's steepness."""
FACTORS = (0.5, 1.0, 2.0)


def readings(folders: list[Path]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return share of steepness, contact length read and true one, [m], of each gage."""
    quality_share, quality.DEAD_SHARE = quality.DEAD_SHARE, 0.0  # every gage that swings
    seen = observe([read_campaign(folder) for folder in folders])
    quality.DEAD_SHARE = quality_share
    features, header = seen.features, seen.headers[0]
    steep = features.rate_lead - features.rate_trail
    good = seen.usable & np.isfinite(steep).all(axis=1)
    true = np.full(steep.shape, np.nan)
    columns = [f"contact_length_{gage}_m" for gage in range(1, steep.shape[1] + 1)]
    for number, folder in enumerate(folders):
        rows = seen.campaign == number
        truth = pd.read_csv(folder / TRUTH_FILE).set_index("run")
        true[rows] = truth.loc[seen.run[rows], columns].to_numpy()
    share = steep[good] / np.median(steep[good], axis=1, keepdims=True)
    read = features.contact_angle[good] * (header.tire.ring_radius or header.tire.free_radius)
    return share.ravel(), read.ravel(), true[good].ravel()


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path("build/out/cosim"), metavar="DIR")
    data = parser.parse_args().data
    share, read, true = readings([data / name for name in plans()])
    click.echo("| steepness | gages | true length [mm] | read less true [mm] |\n|---|---|---|---|")
    for low, high in zip(SHARES, (*SHARES[1:], np.inf), strict=True):
        row = (share >= low) & (share < high)
        if row.any():
            length, apart = 1e3 * true[row], 1e3 * (read - true)[row]
            click.echo(
                f"| {low:g} to {high:g} | {row.sum()} | {length.min():.0f} to {length.max():.0f} "
                f"| {apart.min():.0f} to {apart.max():.0f} |"
            )
    for factor in FACTORS:
        out = share < factor * quality.DEAD_SHARE
        click.echo(
            f"DEAD_SHARE x {factor:g}: {out.sum()} gages left out, the longest with "
            f"{1e3 * true[out].max(initial=0.0):.0f} mm; let in is at most "
            f"{1e3 * (read - true)[~out].max():.0f} mm too much"
        )


if __name__ == "__main__":
    with one_thread():
        main()
