"""Figures of the benchmark from its verdicts, as numbers and as Markdown."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hidden.cases import NONE

Rows = Sequence[Mapping[str, Any]]
LIMIT = 1.05
"""Error after the right addition over the structural floor, up to which it counts as reached."""


def figures(rows: Rows) -> dict[str, Any]:
    """Return all figures; shares with the number of cases they are from."""
    done = [r for r in rows if r["outcome"] != "failed"]
    none = [r for r in done if r["kind"] == NONE]
    pairs = [r for r in done if "+" in r["kind"]]
    single = [r for r in done if r["kind"] != NONE and "+" not in r["kind"] and r["known"]]
    unknown = [r for r in done if not r["known"]]
    ratios = sorted({r["wanted"] for r in single}, reverse=True)
    return {
        "cases": len(rows),
        "failed": len(rows) - len(done),
        "none": {
            "cases": len(none),
            "false_alarms": _share(none, "alarm"),
            "named_falsely": _mean([bool(r["outcome"] == "alarm" and r["named"]) for r in none]),
            "belt": _mean([bool(r["outcome"] == "quiet" and r["named"]) for r in none]),
        },
        "single": {f"{x:g}": _single([r for r in single if r["wanted"] == x]) for x in ratios},
        "by_kind": {
            kind: {
                f"{x:g}": dict(
                    Counter(r["outcome"] for r in single if r["kind"] == kind and r["wanted"] == x)
                )
                for x in ratios
            }
            for kind in sorted({r["kind"] for r in single})
        },
        "unknown": {
            "cases": len(unknown),
            "kinds": len({r["kind"] for r in unknown}),
            "flagged": _share(unknown, "flagged"),
            "wrong_name": _share(unknown, "wrong"),
            "by_kind": {
                kind: dict(Counter(r["outcome"] for r in unknown if r["kind"] == kind))
                for kind in sorted({r["kind"] for r in unknown})
            },
        },
        "pairs": {
            "cases": len(pairs),
            "exact": _share(pairs, "right"),
            "partly": _share(pairs, "partly"),
            "wrong_name": _share(pairs, "wrong"),
        },
        "addition": {f"{x:g}": _addition([r for r in single if r["wanted"] == x]) for x in ratios},
    }


def _single(rows: Rows) -> dict[str, Any]:
    return {
        "cases": len(rows),
        "right": _share(rows, "right"),
        "with_twin": _share(rows, "twins"),
        "wrong": _share(rows, "wrong"),
        "flagged_unknown": _share(rows, "flagged"),
        "missed": _share(rows, "missed"),
    }


def _share(rows: Rows, outcome: str) -> float | None:
    return _mean([r["outcome"] == outcome for r in rows])


def _mean(values: Sequence[bool]) -> float | None:
    return float(np.mean(values)) if values else None


def _addition(rows: Rows) -> dict[str, Any]:
    done = [r for r in rows if r.get("addition") == "done"]
    if not done:
        return {"cases": 0}
    out: dict[str, Any] = {"cases": len(done)}
    for name in ("error", "white_error"):
        before, after, floor = (
            np.array([r[name][key] for r in done]) for key in ("before", "after", "floor")
        )
        out[name] = {
            "at_floor": float(np.mean(after <= LIMIT * floor)),
            "removed": _removed(before, after, floor),
        }
    sheared, floor = (np.array([r["error"][key] for r in done]) for key in ("with_shear", "floor"))
    out["at_floor_with_shear"] = float(np.mean(sheared <= LIMIT * floor))
    for name in ("load", "pressure", "speed"):
        before, after, floor = (
            np.array([r["held_out"][name][key] for r in done])
            for key in ("before", "after", "floor")
        )
        out[f"held_out_{name}"] = {
            "fell": float(np.mean(after < before)),
            "removed": _removed(before, after, floor),
        }
    return out


def _removed(
    before: np.ndarray[Any, Any], after: np.ndarray[Any, Any], floor: np.ndarray[Any, Any]
) -> float | None:
    """Return the median share of the removable mean square that is gone."""
    counts = before > 1.02 * floor
    if not counts.any():
        return None
    gone = (before**2 - after**2)[counts] / (before**2 - floor**2)[counts]
    return float(np.median(gone))


def markdown(told: Mapping[str, Any]) -> str:
    """Return the table for the README."""
    f = told["figures"]
    ratios = list(f["single"])
    lines = [
        f"{told['date']}, {f['cases']} cases, seeds {told['seeds']}, {told['members']} variants "
        "in the null ensemble.",
        "",
        "| | " + " | ".join(f"ratio {x}" for x in ratios) + " |",
        "|---|" + "---|" * len(ratios),
    ]
    for name, words in (
        ("right", "named right"),
        ("with_twin", "right, with a twin beside it"),
        ("wrong", "wrong name"),
        ("flagged_unknown", "called unknown"),
        ("missed", "missed"),
    ):
        lines.append(_row(words, [_percent(f["single"][x][name]) for x in ratios]))
    lines.append(_row("cases", [str(f["single"][x]["cases"]) for x in ratios]))
    added = [f["addition"][x] for x in ratios]
    for key, words in (
        ("error", "plain residual"),
        ("white_error", "residual, set points discounted"),
    ):
        lines.append(
            _row(
                f"after adding, {words}: at most {LIMIT} floor",
                [_percent(a.get(key, {}).get("at_floor")) for a in added],
            )
        )
        lines.append(
            _row(
                f"after adding, {words}: removable mean square gone, median",
                [_percent(a.get(key, {}).get("removed")) for a in added],
            )
        )
    lines.append(
        _row(
            f"after adding the belt's shear too, plain residual: at most {LIMIT} floor",
            [_percent(a.get("at_floor_with_shear")) for a in added],
        )
    )
    for name in ("load", "pressure", "speed"):
        lines.append(
            _row(
                f"held-out {name}: the same, median",
                [_percent(a.get(f"held_out_{name}", {}).get("removed")) for a in added],
            )
        )
    none, unknown, pairs = f["none"], f["unknown"], f["pairs"]
    lines += [
        "",
        "| | share | cases |",
        "|---|---|---|",
        f"| nothing hidden: false alarm (a name, or unknown) | {_percent(none['false_alarms'])} | "
        f"{none['cases']} |",
        f"| nothing hidden: a name | {_percent(none['named_falsely'])} | {none['cases']} |",
        f"| nothing hidden: `belt_shear` alone, which every belt has | {_percent(none['belt'])} | "
        f"{none['cases']} |",
        f"| in no catalogue: flagged unknown | {_percent(unknown['flagged'])} | "
        f"{unknown['cases']} ({unknown['kinds']} kinds) |",
        f"| in no catalogue: wrong name | {_percent(unknown['wrong_name'])} | {unknown['cases']} |",
        f"| pairs: exactly right | {_percent(pairs['exact'])} | {pairs['cases']} |",
        f"| pairs: one of two | {_percent(pairs['partly'])} | {pairs['cases']} |",
        f"| pairs: wrong name | {_percent(pairs['wrong_name'])} | {pairs['cases']} |",
        "",
    ]
    return "\n".join(lines)


def _row(words: str, cells: Sequence[str]) -> str:
    return f"| {words} | " + " | ".join(cells) + " |"


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.0f} %"
