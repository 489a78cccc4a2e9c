"""What the rig says of constants of the signal chain, and what half and double of each does.

    python build/signal_constants.py build/out/other_tire/reference build/out/other_tire/stiff

Each folder holds the campaigns `set1` and `set3` of a tire and its `calibration.toml` (as
`build/other_tire.py` leaves them). Three tables: the contact lengths of the truth against those
read and corrected, with the constants fitted anew; what gaps in the strain do to the load, one gap
in every turn, anywhere; and what a contact does that a gap has swallowed whole.
"""

import argparse
from pathlib import Path

import click
import numpy as np
import pandas as pd
from road_constants import times
from scipy.optimize import least_squares

from tirelib.campaign import conditions_of, read_campaign
from tirelib.core.arrays import FloatArray
from tirelib.core.compiled import choose_numpy
from tirelib.core.threads import one_thread
from tirelib.estimators import contact_length
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.contact_length import contact_lengths
from tirelib.measured.features.extract import extract_features
from tirelib.measured.observations import observe
from tirelib.measured.signal import contacts, cut_turns
from tirelib.measured.signal import turns as turns_module

LENGTH = ("BIAS", "MIDDLE", "WIDTH", "LEAST_STD", "SHORT_STD", "SHORT_WIDTH")
SHORT, LONG = 40, 200
"""Samples of a gap at 10 kHz: within a contact; longer than one (80 at 65 km/h)."""
RADIUS = 0.31
"""Way of a turn over 2 pi, [m]."""
TWO_SIGMA = 1.96


def lengths(folder: Path) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return angle read, rolling radius, its doubt, and true length of every gage and turn."""
    parts = []
    calibration = read_calibration(folder / "calibration.toml")
    for name in ("set1", "set3"):
        seen = observe([read_campaign(folder / name)])
        found = calibration.estimate(seen.features)
        truth = pd.read_csv((folder / name) / "truth.csv").set_index("run")
        true = truth.loc[seen.run, [f"contact_length_{g}_m" for g in range(1, 6)]].to_numpy()
        use = seen.usable & np.isfinite(found.radius)
        of_turn = (found.radius[use, None], seen.features.angle_std[use, None])
        radius, doubt = (np.repeat(x, 5, axis=1) for x in of_turn)
        parts.append((seen.features.contact_angle[use], radius, doubt, true[use]))
    columns = [np.concatenate([part[i].ravel() for part in parts]) for i in range(4)]
    good = np.isfinite(columns).all(axis=0)
    return tuple(column[good] for column in columns)  # type: ignore[return-value]


def said(angle: FloatArray, radius: FloatArray, std: FloatArray, true: FloatArray) -> str:
    """Return rms and mean error of the corrected lengths, coverage and rms deviation."""
    length, doubt = contact_lengths(angle[:, None], radius, std)
    error = length[:, 0] - true
    held = np.mean(np.abs(error) <= TWO_SIGMA * doubt[:, 0])
    return (
        f"{1e3 * np.sqrt(np.mean(error**2)):.1f} mm rms, {1e3 * error.mean():+.1f} mean, "
        f"{100 * held:.0f} % held, std {1e3 * np.sqrt(np.mean(doubt**2)):.1f}"
    )


def fitted(angle: FloatArray, radius: FloatArray, true: FloatArray) -> FloatArray:
    """Return BIAS, MIDDLE and WIDTH that fit the lengths best."""

    def left(x: FloatArray) -> FloatArray:
        return np.asarray(angle + x[0] / (1.0 + np.exp((x[1] - angle) / x[2])) - true / radius)

    return np.asarray(least_squares(left, (0.05, 0.17, 0.02), x_scale=(0.05, 0.1, 0.02)).x)


def with_gaps(folder: Path, *, swallowed: bool) -> str:
    """Return how many turns are valid with gaps, and the rms and worst error of their load.

    Errors are in standard deviations, against what is said of the same turn without a gap. Each
    turn has a short gap anywhere, or a long one swallows the third contact of each run.
    """
    rng, campaign = np.random.default_rng(1), read_campaign(folder / "set1")
    calibration, gages = (
        read_calibration(folder / "calibration.toml"),
        campaign.header.gage_lateral,
    )
    count, valid, apart = 0, 0, [0.0]
    for run in campaign.runs():
        if run.strain is None:
            continue
        broken, held = run.strain.copy(), conditions_of(run, run.time())
        whole = extract_features(cut_turns(run.strain, run.rate, gages, **held))
        if swallowed:
            middle = round(whole.time[2] * run.rate)
            broken[:, middle - LONG // 2 : middle + LONG // 2] = np.nan
        else:
            turn = round(run.rate * 2.0 * np.pi * RADIUS / run.plan.speed)
            for start in range(turn, broken.shape[1], turn):
                at = start + int(rng.integers(turn))
                broken[:, at : at + SHORT] = np.nan
        gapped = extract_features(cut_turns(broken, run.rate, gages, **held))
        true, found = calibration.estimate(whole), calibration.estimate(gapped)
        near = np.abs(gapped.time[:, None] - whole.time).argmin(axis=1)
        good = found.valid["Fz"] & true.valid["Fz"][near]
        over = (found.value["Fz"] - true.value["Fz"][near]) / found.std["Fz"]
        count, valid = count + len(gapped), valid + int(good.sum())
        apart += np.abs(over[good & np.isfinite(over)]).tolist()
    return f"{valid} of {count}, {np.sqrt(np.mean(np.square(apart))):.2f}, {max(apart):.2f}"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    given = parser.parse_args()
    parts = [lengths(folder) for folder in given.folders]
    every = tuple(np.concatenate(columns) for columns in zip(*parts, strict=True))
    for folder, part in zip(given.folders, parts, strict=True):
        bias, middle, width = fitted(part[0], part[1], part[3])
        click.echo(
            f"{folder.name}: {part[0].size} lengths; {said(*part)}; "
            f"own BIAS {bias:.4f}, MIDDLE {middle:.3f}, WIDTH {width:.3f} rad"
        )
    click.echo(f"all: {every[0].size} lengths; {said(*every)}\n")
    for name in LENGTH:
        for factor in (0.5, 2.0):
            with times(contact_length, name, factor):
                click.echo(f"{name} x {factor:g}: {said(*every)}")
    click.echo("\ngaps: valid turns, rms and worst error of the load in standard deviations")
    for swallowed in (False, True):
        for module, name in ((contacts, "GAP_REACH"), (turns_module, "MISSED_RATIO")):
            for factor in (0.5, 1.0, 2.0):
                with times(module, name, factor):
                    found = with_gaps(given.folders[0], swallowed=swallowed)
                kind = "a contact is swallowed" if swallowed else "4 ms in every turn"
                click.echo(f"{kind}, {name} x {factor:g}: {found}")


if __name__ == "__main__":
    choose_numpy()  # constants of the compiled core cannot be changed
    with one_thread():
        main()
