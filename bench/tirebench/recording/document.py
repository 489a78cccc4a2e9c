"""Estimates of a line as a document (``tirelib-estimate/1``), as `tirelib estimate --json` has it.

Units at this edge are what engineers say: N and deg. Axes are ISO 8855. Where a sidecar told what
the rig measured, the summary holds the errors of each run's mean; else its numbers are null.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tirebench.estimator.chain import Turn, quantity_valid
from tirebench.estimator.wheels import Wheels
from tirebench.wire.conditions import RunMark
from tirebench.wire.line_counts import LineCounts
from tirebench.wire.timeline import TimelineCounts
from tirelib.core.flags import flag_names
from tirelib.core.version import __version__
from tirelib.estimators.edge import EDGE_UNIT, FORMAT, VARIED

if TYPE_CHECKING:
    from tirelib.estimators.calibration import Calibration

QUANTITIES = EDGE_UNIT
"""Unit and factor of each quantity in the document."""


def document(
    turns: Sequence[Turn],
    runs: Iterable[RunMark],
    wheels: Wheels,
    source: Mapping[str, Any],
    calibration: "Calibration | None" = None,
) -> dict[str, Any]:
    """Return summary, turns, what the line and each wheel lost, and where all came from.

    `calibration` is that of the FMU, where it is known: a quantity that it lacks has no summary.
    """
    truth = {mark.run: mark.truth for mark in runs}
    chain = None if calibration is None else calibration.chains[-1]
    return {
        "format": FORMAT,
        "tirelib": __version__,
        "axes": "iso",
        "tire": None if calibration is None else calibration.tire,
        "summary": {
            name: _summary(name, turns, truth) if chain is None or chain.has(name) else None
            for name in QUANTITIES
        },
        "turns": [turn_document(turn) for turn in turns],
        "line": line_document(*wheels.counts),
        "wheels": {wheel: wheel_document(wheels, wheel) for wheel in wheels.heard},
        "source": dict(source),
    }


def line_document(line: LineCounts, timeline: TimelineCounts) -> dict[str, Any]:
    """Return what a line has shown: good frames, and every loss by its kind."""
    return {
        "bytes": line.bytes,
        "frames": line.ok,
        "crc_bad": line.crc,
        "framing_bad": line.framing,
        "unknown_type": line.unknown,
        "unplaced_samples": line.unplaced,
        "overruns": line.overruns,
        "reconnects": line.reconnects,
        "gaps": timeline.gaps,
        "lost_frames": timeline.lost_frames,
        "lost_samples": timeline.lost_samples,
        "duplicates": timeline.duplicates,
        "out_of_order": timeline.out_of_order,
        "other_wheel": timeline.other_wheel,
        "resets": timeline.resets,
        "saturated_samples": list(timeline.saturated),
        "low_battery": timeline.low_battery,
        "radio_loss": timeline.radio_loss,
    }


def wheel_document(wheels: Wheels, number: int) -> dict[str, Any]:
    """Return the losses of one wheel, those of its line included, and its clock.

    A damaged frame does not say whose it was: what the line counts, all its wheels show.
    """
    wheel = wheels.heard[number]
    clock = wheel.clock
    return {
        **line_document(wheels.line_counts(number), wheel.timeline.counts),
        "clock_drift_ppm": _number(clock.drift_ppm),
        "clock_residual_us": _number(1e6 * clock.residual),
    }


def turn_document(turn: Turn) -> dict[str, Any]:
    """Return one turn in the units of the document."""
    outputs = turn.outputs
    entry: dict[str, Any] = {
        "run": turn.run,
        "wheel": turn.wheel,
        "t": _number(turn.t),
        "ready": _number(turn.ready),
    }
    for name, (_, factor) in QUANTITIES.items():
        entry[name] = _number(outputs[name] * factor)
        entry[f"{name}_std"] = _number(outputs.get(f"{name}_std", math.nan) * factor)
        entry[f"{name}_valid"] = quantity_valid(turn, name)
    for gage in range(1, len(turn.saturated) + 1):
        length = outputs.get(f"contact_length_{gage}", math.nan)
        length_std = outputs.get(f"contact_length_std_{gage}", math.nan)
        entry[f"contact_length_{gage}_mm"] = _number(1e3 * length)
        entry[f"contact_length_{gage}_std_mm"] = _number(1e3 * length_std)
    entry["omega_rad_s"] = _number(outputs.get("turn_rate", math.nan))
    entry["rolling"] = turn.texts.get("rolling", "unknown")
    entry["valid"] = turn.valid
    entry["flags"] = flags(turn)
    entry["segment"] = turn.segment
    entry["device_time"] = turn.device_time
    entry["saturated_samples"] = list(turn.saturated)
    return entry


def flags(turn: Turn) -> list[str]:
    """Return the names of a turn's flags, then the estimator's notes."""
    names = flag_names(turn.flags)
    said = [*turn.texts.get("status", "").split(";"), turn.texts.get("note", "")]
    return [*names, *(note for note in said if note and note not in names)]


def empty_summary(name: str) -> dict[str, Any]:
    """Return the summary of a quantity that was not measured."""
    return {
        "rmse": None,
        "unit": QUANTITIES[name][0],
        "r2": None,
        "n": 0,
        "rmse_percent_of_range": None,
        "coverage_95": None,
        "bias": None,
    }


def _summary(
    name: str, turns: Sequence[Turn], truth: Mapping[int, Mapping[str, float]]
) -> dict[str, Any]:
    unit, factor = QUANTITIES[name]
    rows: dict[int, list[tuple[float, float]]] = {}
    for turn in turns:
        if quantity_valid(turn, name) and name in truth.get(turn.run, {}):
            std = turn.outputs.get(f"{name}_std", math.nan)
            rows.setdefault(turn.run, []).append((turn.outputs[name], std))
    if not rows:
        return empty_summary(name)
    measured = factor * np.array([truth[run][name] for run in rows])
    means = factor * np.array([np.mean(values, axis=0) for values in rows.values()])
    error = means[:, 0] - measured
    spread = float(np.sum((measured - measured.mean()) ** 2))
    span = float(np.ptp(measured))
    varied = span > VARIED[name]
    rmse = float(np.sqrt(np.mean(error**2)))
    return {
        "rmse": rmse,
        "unit": unit,
        "r2": 1.0 - float(np.sum(error**2)) / spread if varied else None,
        "n": len(rows),
        "rmse_percent_of_range": 100.0 * rmse / span if varied else None,
        "coverage_95": float(np.mean(np.abs(error) <= 1.96 * means[:, 1])),
        "bias": float(error.mean()),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
