"""The overview plot of a campaign. Signs are ISO; units are those that engineers say."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tirelib.campaign.model import CampaignHeader, FloatArray, Run
from tirelib.campaign.overview import COLUMNS, RunRow, place_label
from tirelib.campaign.turns import trigger_samples, turn_samples
from tirelib.core.quantities import QUANTITIES
from tirelib.core.units import from_si
from tirelib.report.style import new_figure, zero_line

_BY_NAME = {column.name: column for column in COLUMNS}
_TITLE = {
    "Fz": "vertical load Fz",
    "Fx": "longitudinal force Fx",
    "Fy": "lateral force Fy",
    "Mz": "aligning moment Mz",
}
_ABSCISSAE = ("slip_angle", "slip_ratio", "speed", "pressure", "camber")
_SWEEP_POINTS = 4000


def overview_figure(header: CampaignHeader, rows: Sequence[RunRow], runs: Sequence[Run]) -> Figure:
    """Return plan, strain of one turn of `runs`, and measured forces as one figure.

    Parameters
    ----------
    rows : sequence of RunRow
        All runs.
    runs : sequence of Run
        The few whose strain is drawn; with sweeps also those whose samples are drawn.
    """
    turns = [(run, turn) for run in runs if (turn := _one_turn(run, header)) is not None]
    figure = new_figure(13.0, 8.6 if turns else 4.8)
    figure.suptitle(f"{header.name}: {header.tire.name}   (signs iso 8855, files {header.axes})")
    upper, *lower = figure.subfigures(2 if turns else 1, 1, squeeze=False)[:, 0]
    sweep = any(row.kind == "sweep" for row in rows)
    points = _sweep_points(runs) if sweep else _row_points(rows)
    left, right = upper.subplots(1, 2)
    _draw_plan(left, points, sweep)
    _draw_forces(right, points, rows, sweep)
    for panel in lower:
        _draw_turns(panel, header, turns)
    return figure


def save_figure(figure: Figure, file: Path) -> Path:
    """Write a figure as PNG, make the folder if needed, and return the file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=110)
    return file


def _row_points(rows: Sequence[RunRow]) -> dict[str, FloatArray]:
    """Return measured means by quantity; the set point replaces a missing measurement."""
    return {
        name: np.array(
            [
                row.planned.get(name) if row.measured[name] is None else row.measured[name]
                for row in rows
            ],
            dtype=np.float64,  # None becomes NaN
        )
        for name in _BY_NAME
    }


def _sweep_points(runs: Sequence[Run]) -> dict[str, FloatArray]:
    """Return rig samples by quantity, thinned evenly."""
    points: dict[str, list[FloatArray]] = {name: [] for name in _BY_NAME}
    for run in runs:
        if run.rig_time is None or not run.rig_time.size:
            continue
        step = max(1, run.rig_time.size * len(runs) // _SWEEP_POINTS)
        for name, column in _BY_NAME.items():
            samples = run.rig.get(name, np.full(run.rig_time.size, np.nan))[::step]
            points[name].append(np.asarray(from_si(samples, column.unit, column.dimension)))
    return {name: np.concatenate(parts) if parts else np.empty(0) for name, parts in points.items()}


def _label(name: str) -> str:
    unit = _BY_NAME[name].unit
    title = _TITLE[name] if name in _TITLE else QUANTITIES[name].title
    return f"{title} [{'-' if unit == '1' else unit}]"


def _spread(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if known.size else 0.0


def _abscissae(points: dict[str, FloatArray]) -> list[str]:
    """Return the conditions that vary, the most important first; slip angle when none does."""
    enough = {"slip_angle": 0.7, "slip_ratio": 0.02, "speed": 5.0, "pressure": 0.15, "camber": 0.7}
    return [n for n in _ABSCISSAE if _spread(points[n]) > enough[n]] or ["slip_angle"]


def _second(points: dict[str, FloatArray], taken: Sequence[str]) -> str | None:
    """Return the next condition that varies and is not drawn yet, the load first."""
    load = ["Fz"] if _spread(points["Fz"]) > 300.0 else []
    return next((name for name in (*load, *_abscissae(points)) if name not in taken), None)


def _draw_plan(axes: Axes, points: dict[str, FloatArray], sweep: bool) -> None:
    across = _abscissae(points)[0]
    upward = _second(points, [across]) or "Fz"
    _scatter(axes, points, across, upward, _second(points, [across, upward]), sweep)
    axes.set_title("plan: samples of sweeps" if sweep else "plan: each point is a run")
    if upward == "Fz":
        axes.set_ylim(0.0, 1.08 * float(np.nanmax(points["Fz"], initial=1.0)))


def _draw_forces(
    axes: Axes, points: dict[str, FloatArray], rows: Sequence[RunRow], sweep: bool
) -> None:
    across = _abscissae(points)[0]
    force = {"slip_angle": "Fy", "camber": "Fy", "slip_ratio": "Fx"}.get(across)
    if force is None or not np.isfinite(points[force]).any():
        _draw_loads(axes, rows)
        return
    _scatter(axes, points, across, force, _second(points, [across]), sweep)
    axes.set_title("measured force" + (": samples" if sweep else ": mean of each run"))
    zero_line(axes)


def _draw_loads(axes: Axes, rows: Sequence[RunRow]) -> None:
    """Draw how well the rig held the load: all that straight, free rolling has to show."""
    pairs = [(row.planned["Fz"], row.measured["Fz"]) for row in rows]
    known = [(p, m) for p, m in pairs if p and m is not None]
    if not known:
        axes.set_axis_off()
        axes.text(0.5, 0.5, "no forces were measured", ha="center", va="center")
        return
    planned, measured = np.array(known).T
    axes.scatter(planned, 100.0 * (measured / planned - 1.0), s=26.0)
    zero_line(axes)
    axes.set_title("measured load against its set point")
    axes.set_xlabel("set point of the load [N]")
    axes.set_ylabel("measured / set point - 1 [%]")
    axes.grid(alpha=0.3)


def _scatter(
    axes: Axes, points: dict[str, FloatArray], x: str, y: str, colour: str | None, sweep: bool
) -> None:
    size = 4.0 if sweep else 26.0
    if colour is None:
        axes.scatter(points[x], points[y], s=size)
    else:
        drawn = axes.scatter(points[x], points[y], s=size, c=points[colour], cmap="viridis")
        axes.figure.colorbar(drawn, ax=axes, label=_label(colour))
    axes.set_xlabel(_label(x))
    axes.set_ylabel(_label(y))
    axes.grid(alpha=0.3)


def _one_turn(run: Run, header: CampaignHeader) -> tuple[FloatArray, FloatArray] | None:
    """Return wheel angle, deg, and strain, microstrain, of the second turn with a contact.

    The turn begins at the trigger, phi = -pi; without one the contact is put in the middle.
    """
    samples = turn_samples(run, header)
    if run.strain is None or samples is None or run.strain.shape[1] < 2.0 * samples:
        return None
    length = round(samples)
    pulses = trigger_samples(run)
    if pulses is not None and pulses.size >= 2:
        fits = pulses[pulses + length <= run.strain.shape[1]]
        begin = int(fits[min(1, fits.size - 1)]) if fits.size else 0
    else:
        begin = int(np.argmax(run.strain[:, length // 2 : 2 * length].mean(axis=0)))
        begin = min(begin, run.strain.shape[1] - length)
    turn = run.strain[:, begin : begin + length]
    return np.linspace(-180.0, 180.0, length, endpoint=False), 1e6 * turn


def _draw_turns(panel: Any, header: CampaignHeader, turns: Sequence[Any]) -> None:
    row = panel.subplots(1, len(turns), sharey=True, squeeze=False)[0]
    for axes, (run, (angle, strain)) in zip(row, turns, strict=True):
        for gage, samples in enumerate(strain):
            axes.plot(angle, samples, linewidth=0.9, label=place_label(header.gage_lateral[gage]))
        axes.set_title(_conditions(run), fontsize=9)
        axes.set_xlabel("wheel angle phi [deg]")
        axes.set_xticks([-180, -90, 0, 90, 180])
        axes.grid(alpha=0.3)
    row[0].set_ylabel("strain [microstrain]")
    handles, labels = row[0].get_legend_handles_labels()
    panel.legend(
        handles, labels, loc="outside right center", title="gage, y", fontsize=9, frameon=False
    )
    panel.suptitle("strain over one turn of a few runs, as recorded")


def _conditions(run: Run) -> str:
    """Return the measured conditions of a run in two short lines."""
    parts = []
    for name in ("Fz", "pressure", "speed", "slip_angle", "camber", "slip_ratio"):
        column = _BY_NAME[name]
        mean = run.mean(name)
        value = getattr(run.plan, column.planned) if mean is None else mean
        value = from_si(value, column.unit, column.dimension)
        if not np.isfinite(value) or (name in ("camber", "slip_ratio") and abs(value) < 0.01):
            continue
        text = f"{value:.{column.digits}f}"
        text = text.lstrip("-") if float(text) == 0.0 else text
        prefix = {"slip_angle": "slip ", "camber": "camber ", "slip_ratio": "kappa "}.get(name, "")
        parts.append(prefix + text + ("" if column.unit == "1" else f" {column.unit}"))
    return f"run {run.plan.run}: {', '.join(parts[:2])}\n{', '.join(parts[2:])}"
