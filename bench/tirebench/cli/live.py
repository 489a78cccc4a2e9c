"""What `tirebench run` shows while it runs: a live table on a terminal, plain lines elsewhere."""

import math
import time
from collections import deque
from collections.abc import Sequence
from types import TracebackType

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from tirebench.estimator.chain import Turn, quantity_valid
from tirebench.estimator.estimation import News
from tirebench.estimator.session import Source
from tirebench.estimator.wheels import Wheels
from tirebench.recording.document import QUANTITIES, flags, line_document

ROWS = 20
"""Turns that the live table holds."""
REFRESH = 0.25
"""Time between two drawings, [s]."""
FORMATS = {"Fz": (".0f", "N"), "alpha": (".2f", "deg"), "kappa": (".4f", ""), "Fy": (".0f", "N")}
UNITS = [
    f"{name} [{unit}] ± std" if unit else f"{name} ± std" for name, (_, unit) in FORMATS.items()
]
LEGEND = "± std: one standard deviation; ?: this quantity is not valid"
HEADINGS = ("wheel", "run", "t [s]", *UNITS, "valid", "flags")
LOSSES = (
    "crc_bad",
    "framing_bad",
    "lost_frames",
    "duplicates",
    "out_of_order",
    "resets",
    "unknown_type",
    "other_wheel",
    "unplaced_samples",
    "overruns",
    "reconnects",
)


class Screen:
    """Show turns and the line's counters; a context manager.

    Parameters
    ----------
    console : Console
    source : Source
        Whose counters are shown.
    patience : float, [s]
        So long a port that is lost is tried again.
    """

    def __init__(self, console: Console, source: Source, patience: float = 0.0) -> None:
        self._console = console
        self._source = source
        self._turns: deque[Turn] = deque(maxlen=ROWS)
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None
        self._drawn = 0.0
        self._patience = patience
        self._lost: float | None = None

    def __enter__(self) -> "Screen":
        if self._live is not None:
            self._live.start()
        else:
            self._console.print(LEGEND, soft_wrap=True, markup=False)
            self._console.print(_plain_row(HEADINGS), soft_wrap=True, markup=False)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._live is not None:
            self._live.update(self._table(), refresh=True)
            self._live.stop()

    def watch(self, news: News) -> None:
        """Draw the present state; called again and again, also without news."""
        for said in news.messages:
            self._console.print(f"FMU: {said}", soft_wrap=True, markup=False)
        for said in news.alarms:
            self._console.print(f"ALARM: {said}", style="bold red", soft_wrap=True, markup=False)
        self._port()
        self._turns.extend(news.turns)
        if self._live is None:
            rows = [_plain_row(_cells(turn)) for turn in news.turns]
            if rows:
                self._console.out("\n".join(rows), highlight=False)
        elif time.monotonic() - self._drawn > REFRESH:
            self._live.update(self._table(), refresh=True)
            self._drawn = time.monotonic()

    def _port(self) -> None:
        """Say when the port goes away and when it is back."""
        lost, was = self._source.lost, self._lost
        if lost is not None and was is None:
            self._console.print(
                f"port lost, tried again for {self._patience:g} s", style="bold red"
            )
        elif lost is None and was is not None:
            self._console.print(f"back after {time.time() - was:.1f} s")
        self._lost = lost

    def _table(self) -> RenderableType:
        table = Table(box=SIMPLE_HEAD, title=self._source.name, caption=LEGEND)
        for heading in HEADINGS:
            table.add_column(Text(heading), justify="left" if heading == "flags" else "right")
        for turn in self._turns:
            table.add_row(*_cells(turn), style=None if turn.valid else "dim")
        return Group(table, Text(counters(self._source.wheels, live=self._source.live)))


def counters(wheels: Wheels, *, live: bool = True) -> str:
    """Return the line's counters as one line of text; zero counters are left out except the frames.

    Where no frame came of a line or of a wheel that is known beforehand, it says so, and what to
    look at where the line is `live`.
    """
    counts = line_document(*wheels.counts)
    parts = [f"{counts['frames']} frames"]
    parts += [f"{counts[name]} {name}" for name in LOSSES if counts[name]]
    saturated = {f"gage {i}": n for i, n in enumerate(counts["saturated_samples"], 1) if n}
    parts += [f"{n} saturated samples of {gage}" for gage, n in saturated.items()]
    hints = list(wheels.hints().values())
    if hints and not live:
        hints = ["the recording holds no valid frame"]
    if counts["frames"]:
        hints += [f"wheel {number}: no frame came" for number in wheels.missing]
    return "; ".join([", ".join(parts), *hints])


def _cells(turn: Turn) -> tuple[str, ...]:
    cells = [str(turn.wheel), str(turn.run), f"{turn.ready if math.isnan(turn.t) else turn.t:.3f}"]
    for name, (_, factor) in QUANTITIES.items():
        value = turn.outputs[name] * factor
        std = turn.outputs.get(f"{name}_std", math.nan) * factor
        spec = FORMATS[name][0]
        mark = "" if quantity_valid(turn, name) else "?"
        cells.append("-" if math.isnan(value) else f"{value:{spec}} ± {std:{spec}}{mark}")
    return (*cells, "yes" if turn.valid else "no", " ".join(flags(turn)))


def _plain_row(cells: Sequence[str]) -> str:
    widths = (5, 4, 9, 15, 17, 18, 15, 5, 0)
    return "  ".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))
