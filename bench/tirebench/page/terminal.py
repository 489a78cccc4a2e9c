"""The live page in a terminal (``--tui``): the same numbers, from the same board."""

import math
import os
import signal
import time
from multiprocessing import parent_process
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.columns import Columns
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from tirebench.live.board import Board
from tirebench.live.priority import below
from tirebench.page.history import History, WheelHistory
from tirebench.page.quantities import DIGITS, NORMAL_95, UNITS

REFRESH = 0.2
"""Time between two drawings, [s]."""
BLOCKS = " ▁▂▃▄▅▆▇█"
NOW = (
    ("rate_hz", "samples/s", 0),
    ("loss_percent", "lost %", 2),
    ("rssi_dbm", "dBm", 0),
    ("temperature_c", "degC", 0),
    ("battery_v", "V", 2),
    ("tire_pressure_bar", "bar", 2),
)
"""Columns of the table: values of the last seconds and of the wheel's HEALTH frame, as key,
heading, digits."""
LOSSES = (
    "crc_bad",
    "framing_bad",
    "lost_frames",
    "lost_samples",
    "duplicates",
    "out_of_order",
    "resets",
    "overruns",
    "reconnects",
    "queue_overruns",
    "skipped_turns",
    "estimator_restarts",
    "radio_loss",
    "low_battery",
)


def show(board_name: str, starts: int) -> None:
    """Draw the board until the run ends; the target of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    below()
    board, parent = Board(board_name), parent_process()
    history = History(board)
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    console = Console()
    with Live(console=console, auto_refresh=False, screen=console.is_terminal) as live:
        while not stopped and (parent is None or parent.is_alive()):
            board.beat()
            if history.update():
                live.update(picture(history, starts), refresh=True)
            time.sleep(REFRESH)
    if console.is_terminal:
        history.update()
        console.print(picture(history, starts))
    os._exit(0)  # nothing to give back: the board belongs to the run


def picture(history: History, starts: int = 1) -> RenderableType:
    """Return what is shown: state, numbers, strain, losses."""
    state = history.state
    parts: list[RenderableType] = [_heading(state)]
    parts += [Text(f" ALARM {text} ", "bold white on red") for text in alarms(state)]
    wheels = [(number, wheel) for number, wheel in sorted(history.wheels.items()) if wheel.last]
    if len(wheels) == 1:
        parts.append(_wheel(*wheels[0], state))
    else:  # two beside each other, so that four are seen at once
        grid = Table.grid(expand=True)
        for _ in range(2):
            grid.add_column(ratio=1)
        panels = [_wheel(number, wheel, state, traces=False) for number, wheel in wheels]
        for row in range(0, len(panels), 2):
            grid.add_row(*panels[row : row + 2])
        parts.append(grid)
    parts.append(_health(state, history, starts))
    parts.append(Text(_room(state)))
    return Group(*parts)


def alarms(state: dict[str, Any]) -> list[str]:
    """Return the alarms that go on, in words."""
    error = state.get("chain", {}).get("recording", {}).get("error")
    found = [alarm["text"] for alarm in state.get("alarms", {}).get("active", [])]
    return [f"recording: {error}", *found] if error else found


def status(state: dict[str, Any]) -> str:
    """Return how the line is, in words."""
    if not state:
        return "connecting"
    if state["lost"]:
        return f"UNPLUGGED since {_clock(state['lost'])}"
    if state["ended"]:
        return f"run ended: {state['ended']}"
    if not state["wheels"]:
        return "waiting for the first frame"
    if state["live"] and state["time"] - state["heard"] > 1.0:
        return f"SILENT since {_clock(state['heard'])}"
    return "live" if state["live"] else "replay"


def numbers(entry: dict[str, Any]) -> list[tuple[str, str]]:
    """Return name with unit, and value with 95 % limits and validity, of a turn's quantities."""
    cells = []
    for name, unit in UNITS.items():
        value, std, digits = entry[name], entry[f"{name}_std"], DIGITS[name]
        text = "-" if value is None else f"{value:.{digits}f}"
        limits = "" if std is None else f" ± {NORMAL_95 * std:.{digits}f}"
        mark = "" if entry[f"{name}_valid"] else "  INVALID"
        cells.append((f"{name} [{unit}]", f"{text}{limits}{mark}"))
    return cells


def sparkline(trace: Any, width: int = 48) -> str:
    """Return a trace in one line of blocks, from its least to its largest value.

    Examples
    --------
    >>> sparkline(np.array([0.0, 1.0, 2.0, np.nan]), 4)
    ' ▄█·'
    """
    columns = np.array_split(np.asarray(trace, dtype=float), width)
    values = [float(np.max(c[np.isfinite(c)], initial=-math.inf)) for c in columns]
    finite = [x for x in values if math.isfinite(x)]
    if not finite:
        return "·" * width
    low, span = min(finite), (max(finite) - min(finite)) or 1.0
    top = len(BLOCKS) - 1
    return "".join(BLOCKS[int(top * (x - low) / span)] if math.isfinite(x) else "·" for x in values)


def _heading(state: dict[str, Any]) -> RenderableType:
    said = status(state)
    style = "bold white on red" if said.split()[0].isupper() else "bold"
    recording = state.get("recording", {})
    rec = f"  REC {recording.get('name', '')} {recording.get('bytes', 0) / 1e6:.1f} MB"
    rec = rec if recording.get("on") else ""
    return Text.assemble(
        (f" {said} ", style), f"  {state.get('link', '')}  ISO 8855", (rec, "bold red")
    )


def _wheel(
    number: int, wheel: WheelHistory, state: dict[str, Any], *, traces: bool = True
) -> RenderableType:
    entry = wheel.last
    table = Table(box=None, show_header=False, padding=(0, 2))
    for name, text in numbers(entry):
        table.add_row(Text(name), Text(text, "red" if text.endswith("INVALID") else "bold green"))
    lengths = [entry[f"contact_length_{gage}_mm"] for gage in range(1, 6)]
    table.add_row(Text("contact [mm]"), " ".join("-" if x is None else f"{x:.0f}" for x in lengths))
    counts = state.get("wheels", {}).get(str(number), {})
    table.add_row("in use", in_use_line(counts.get("in_use", {})))
    if entry["flags"]:
        table.add_row("flags", " ".join(entry["flags"]))
    lines = Table(box=None, show_header=False, padding=(0, 1))
    for gage, trace in enumerate(wheel.laps[-1] if wheel.laps and traces else (), 1):
        lines.add_row(f"gage {gage}", sparkline(trace))
    title = f"wheel {number}, turn {entry['turn']}, t = {entry['device_time']:.2f} s, ± 95 %"
    return Panel(Columns([table, lines]), title=title, title_align="left")


def _health(state: dict[str, Any], history: History, starts: int) -> RenderableType:
    table = Table(box=SIMPLE_HEAD)
    for name in (
        "wheel",
        "frames",
        "turns",
        "invalid",
        "lost",
        "saturated",
        "ppm",
        "age [ms]",
        *(heading for _, heading, _ in NOW),
    ):
        table.add_column(Text(name), justify="right")
    for number, counts in state.get("wheels", {}).items():
        lost = " ".join(f"{name} {counts[name]}" for name in LOSSES if counts[name]) or "nothing"
        table.add_row(
            number,
            str(counts["frames"]),
            str(counts["turns"]),
            str(counts["invalid_turns"]),
            lost,
            " ".join(map(str, counts["saturated_samples"])),
            _or_dash(counts["clock_drift_ppm"]),
            _or_dash(counts["newest_sample_age_ms"]),
            *(_or_dash(counts.get(key), digits) for key, _, digits in NOW),
        )
    starts += sum(state.get("chain", {}).get("restarts", {}).values())
    dropped = history.missed + state.get("left_out", 0)
    said = "".join(f"\nFMU: {message}" for message in state.get("messages", []))
    return Group(table, Text(f"{dropped} frames of this view dropped, {starts - 1} restarts{said}"))


def _clock(moment: float) -> str:
    return time.strftime("%H:%M:%S", time.localtime(moment))


def in_use_line(conditions: dict[str, dict[str, Any]]) -> str:
    """Return which conditions are in use and where each comes from, in one line."""
    return ", ".join(
        f"{name} unknown"
        if one["value"] is None
        else f"{name} {one['value']:.2f} {one['unit']} ({one['source']})"
        for name, one in conditions.items()
    )


def _room(state: dict[str, Any]) -> str:
    """Return what room the recording has, in words."""
    recorded = state.get("chain", {}).get("recording", {})
    free, left = recorded.get("free_bytes"), recorded.get("minutes_left")
    if free is None or not state.get("recording", {}).get("on"):
        return ""
    return f"{1e-9 * free:.1f} GB free" + ("" if left is None else f", for {left:.0f} min")


def _or_dash(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
