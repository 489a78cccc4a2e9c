"""Traffic of the serial line and its estimates: the section "Live" of the demonstration."""

import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pages.agreement import (
    TOLERANCE,
    Agreement,
    agreement,
    agreement_table,
    read_turns,
)
from pages.figures.live import LastTurn, Strip, figure_live
from tirelib.campaign import Campaign
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.measured.signal import LowPass, cut_turns
from tirelib.report.accuracy import QUANTITIES
from tirelib.report.page import Picture, Table

IN_REPORT = {"Fz": 1.0, "alpha": 1.0, "kappa": 100.0, "Fy": 1.0}
"""From the unit of the document to that of reports: a slip ratio is given in percent."""


@dataclass(frozen=True, slots=True)
class LiveFiles:
    """Files that the steps of the demonstration wrote.

    `direct` (by the library itself), `fmu`, `live` and `replay` are JSON of estimates;
    `conditions` is the emulator's sidecar, `device` says what a count of the line is.
    """

    direct: Path
    fmu: Path
    live: Path
    replay: Path
    conditions: Path
    device: Path


@dataclass(frozen=True, slots=True)
class Line:
    """Counters of the line: frames, losses, and the largest rounding of the strain."""

    frames: int
    lost: int
    rounding: float
    scale: float


def agreements(files: LiveFiles, rounding: float) -> list[Agreement]:
    """Compare library and FMU, live bench and replay, bench and library.

    The last must agree only where the line rounded nothing.
    """
    library, live = read_turns(files.direct), read_turns(files.live)
    return [
        agreement("library \N{MINUS SIGN} FMU", library, read_turns(files.fmu), TOLERANCE),
        agreement("live \N{MINUS SIGN} replay", live, read_turns(files.replay), 0.0),
        agreement(
            "live \N{MINUS SIGN} library",
            live,
            library,
            np.nan if rounding else TOLERANCE,
            same_runs=False,
        ),
    ]


def find_faults(files: LiveFiles, campaign: Campaign) -> list[str]:
    """Return a sentence on every forbidden difference between library, FMU and bench."""
    rounding = read_line(files, campaign).rounding
    return [fault for one in agreements(files, rounding) for fault in one.faults]


def read_line(files: LiveFiles, campaign: Campaign) -> Line:
    """Return what the line lost, by count and by rounding strain to whole counts."""
    counters = _json(files.live)["line"]
    scale = read_scale(files.device)
    worst = 0.0
    for number in _played(files):
        strain = _strain(campaign, number)
        worst = max(worst, float(np.nanmax(np.abs(strain - _rounded(strain, scale)))))
    lost = sum(
        int(counters[name]) for name in ("lost_frames", "crc_bad", "framing_bad", "unknown_type")
    )
    return Line(int(counters["frames"]), lost, worst if worst > 1e-6 * scale else 0.0, scale)


def read_scale(device: Path) -> float:
    """Return the strain of one count."""
    return float(tomllib.loads(device.read_text(encoding="utf-8"))["scale"]["strain_per_count"])


def live_table(files: LiveFiles, line: Line) -> Table:
    """Return the table library = FMU = bench."""
    rounded = (
        f"The line rounds strain to whole counts of {1e6 * line.scale:.3g} microstrain, which "
        f"changed a sample by at most {1e6 * line.rounding:.2g} microstrain; this causes the "
        "difference between live and library"
        if line.rounding
        else f"A count of the line is {1e6 * line.scale:.3g} microstrain, the rig's own step, so "
        "the line rounds nothing"
    )
    return agreement_table(
        agreements(files, line.rounding),
        f"Number of compared turns, and the largest difference. {rounded}. Relative: divided by "
        f"the largest magnitude of the quantity. Library and FMU must agree to {TOLERANCE:.0e}, "
        "live and replay to the last bit. Turns are matched by their order within each run; the "
        "first turn of a run has no estimate in any of them.",
    )


def live_text(line: Line) -> str:
    """Return a sentence on the traffic of the line."""
    lost = "none was lost or damaged" if line.lost == 0 else f"{line.lost} were lost or damaged"
    return (
        f"Runs of the unseen day as {line.frames} SERIAL v1 frames through a pseudo-terminal, at "
        f"the pace of the wheel; {lost}. The bench stepped the FMU file, recorded the bytes, and "
        "replayed them."
    )


def live_drawing(files: LiveFiles, campaign: Campaign, low_pass: LowPass) -> Picture:
    """Return the strip: the last turn's strain, and every estimate with the rig's value."""
    return Picture(
        "live",
        "The live strip",
        "Top: strain of the last turn on the line. Below: estimates of the bench, turn after turn "
        "and run after run, with their 95 % bands and the mean that the rig measured in the run; "
        "right: their difference. The first turn of a run has no estimate.",
        lambda: figure_live(last_turn(files, campaign, low_pass), read_strip(files)),
    )


def read_strip(files: LiveFiles) -> Strip:
    """Return the estimates of the live bench with the rig's values, in the units of reports."""
    turns = read_turns(files.live)
    truth = {int(mark["run"]): mark["truth"] for mark in _json(files.conditions)["runs"]}

    def column(key: str, factor: float) -> FloatArray:
        name = key.removesuffix("_std")
        return np.array(
            [
                factor * turn[key] if turn[f"{name}_valid"] and turn[key] is not None else np.nan
                for turn in turns
            ]
        )

    return Strip(
        time=np.array([turn["device_time"] for turn in turns], dtype=np.float64),
        run=_runs(turns),
        value={name: column(name, IN_REPORT[name]) for name in QUANTITIES},
        std={name: column(f"{name}_std", IN_REPORT[name]) for name in QUANTITIES},
        truth={
            name: np.array(
                [
                    IN_REPORT[name] * truth.get(int(turn["run"]), {}).get(name, np.nan)
                    for turn in turns
                ]
            )
            for name in QUANTITIES
        },
    )


def last_turn(files: LiveFiles, campaign: Campaign, low_pass: LowPass) -> LastTurn:
    """Cut the last turn out of the strain of the last run as the line brought it.

    Raises
    ------
    CalibrationError
        If it has no turn that is whole.
    """
    number = _played(files)[-1]
    strain = _rounded(_strain(campaign, number), read_scale(files.device))
    turns = cut_turns(
        strain, campaign.header.rate, campaign.header.gage_lateral, speed=np.nan, low_pass=low_pass
    )
    whole = np.flatnonzero(np.isfinite(turns.trace.rate).any(axis=(1, 2)))
    if whole.size == 0:
        raise CalibrationError(
            f"{campaign.header.name}, run {number}: the run holds no whole turn, and the figure "
            "shows the last one; play a longer run"
        )
    trace = turns.trace
    return LastTurn(number, trace.phi, trace.strain[whole[-1]], np.asarray(trace.lateral))


def _strain(campaign: Campaign, number: int) -> FloatArray:
    plan = next((plan for plan in campaign.plans if plan.run == number), None)
    run = None if plan is None else campaign.load(plan)
    if run is None or run.strain is None:
        raise CalibrationError(
            f"{campaign.header.name}: run {number}, which was played, has no strain here; give the "
            "campaign that was played"
        )
    return np.asarray(run.strain, dtype=np.float64)


def _rounded(strain: FloatArray, scale: float) -> FloatArray:
    return np.asarray(np.rint(strain / scale) * scale)


def _played(files: LiveFiles) -> list[int]:
    return [int(mark["run"]) for mark in _json(files.conditions)["runs"]]


def _runs(turns: Sequence[Any]) -> IntArray:
    return np.array([turn["run"] for turn in turns], dtype=np.int64)


def _json(file: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return document
