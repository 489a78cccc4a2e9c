"""What the bench has to stand, and the table that says whether it did."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

LATENCY = 20.0
"""From the bytes that end a turn to its estimate, for 99 % of the turns, [ms]."""
CORES = 1.0
"""CPU of one wheel's processes together, without the browser."""
BACK = 2.0
"""From a cable that is plugged in to its first byte, [s]."""
LOST = 1.0
"""Longest time without bytes around a `kill -9`, [s]."""


@dataclass(frozen=True, slots=True)
class Row:
    """A figure, what is asked of it, and whether it is met."""

    what: str
    figure: str
    asked: str = ""
    good: bool = True


def rows(name: str, one: dict[str, Any]) -> Iterator[Row]:
    """Yield the figures of a part, by its name: ``plug``, ``kill``, or a line."""
    yield from {"plug": _plug, "kill": _kill}.get(name, _line)(one)


def _line(one: dict[str, Any]) -> Iterator[Row]:
    lost = {key: n for key, n in one["lost"].items() if n}
    lost |= {"unheard": one["unheard"]} if one["unheard"] else {}
    lost |= {"missing": n} if (n := one["frames_sent"] - one["frames"]) else {}
    yield Row(
        f"{one['line']}, {one['minutes']:g} min: lost of {one['frames_sent']} frames",
        str(lost or 0),
        "0",
        not lost,
    )
    p50, p99 = one["p50_ms"], one["p99_ms"]
    yield Row(
        "  byte in to estimate out, p50 / p99",
        f"{p50} / {p99} ms",
        f"{LATENCY:g} ms",
        p99 is not None and p99 < LATENCY,
    )
    cpu, alone = one["cpu_per_second"], "1 wheel" in one["line"]
    yield Row(
        "  CPU a second, without the browser",
        f"{cpu:.2f} s",
        f"{CORES:g} s" if alone else "",
        not alone or cpu < CORES,
    )
    yield Row("  load average", f"{one['load_average']:.1f}")


def _plug(one: dict[str, Any]) -> Iterator[Row]:
    yield Row(
        f"{one['cycles']} times unplugged: back after p50 / longest",
        f"{one['back_p50_s']:.2f} / {one['back_max_s']:.2f} s",
        f"{BACK:g} s",
        one["not_back"] == 0 and one["back_max_s"] <= BACK,
    )
    yield Row("  load average", f"{one['load_average']:.1f}")


def _kill(one: dict[str, Any]) -> Iterator[Row]:
    roles = ", ".join(one["processes"])
    yield Row(
        f"{len(one['kills'])} times kill -9 ({roles}): lost",
        f"{one['lost_max_s']:.2f} s",
        f"{LOST:g} s",
        one["lost_max_s"] <= LOST,
    )
    readable = all(one["readable"].values())
    yield Row("  recordings readable", str(readable), "True", readable)
    yield Row("  back after, at most", f"{one['back_max_s']:.1f} s", "always", one["not_back"] == 0)
    alone = [k["all_gone_s"] for k in one["kills"] if k["role"] == "run"]
    said = ", ".join("never" if t is None else f"{t:.1f} s" for t in alone)
    yield Row("  the run killed: all others end after", said, "always", None not in alone)
    yield Row("  load average", f"{one['load_average']:.1f}")


def show(results: dict[str, Any], judged: set[str], console: Console) -> bool:
    """Print what was measured, now or before; tell whether the parts that are judged are good."""
    table, good = Table("what", "figure", "asked", "", title="endurance"), True
    for name, one in results.items():
        for row in rows(name, one):
            good &= row.good or name not in judged
            table.add_row(
                row.what,
                row.figure,
                row.asked,
                ("good" if row.good else "BAD") if row.asked else "",
            )
    console.print(table)
    return good
