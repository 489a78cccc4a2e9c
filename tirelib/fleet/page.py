"""What a data set says of its tires together, and the page that shows it."""

import json
import tempfile
from collections import Counter, defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.dataset as pads

from tirelib.core.arrays import FloatArray
from tirelib.fleet.dataset import ALSO_AT, DataSet
from tirelib.fleet.siblings import join
from tirelib.fleet.spread import (
    FALSE_ALARM,
    FEWEST_IN_TIME,
    FEWEST_SPREAD,
    change_of,
    spread_of,
)
from tirelib.fleet.tables import PARTITION
from tirelib.report.fleet import fleet_parts, write_fleet

DAY = 86400.0
WATCHED: Mapping[str, tuple[str, ...]] = {
    "pressure": (),
    "rolling_radius": ("pressure", "Fz"),
    "offset": (),
    "gage_out": (),
}
"""Channels whose change with time is judged, with the conditions that are taken out."""
CAUSES = {
    ("pressure", False): "the tire loses pressure",
    ("pressure", True): "the pressure rises",
    ("rolling_radius", False): "the tire wears, or carries more load than is estimated",
    ("rolling_radius", True): "the tire grows, or was changed",
    ("offset", False): "gage {gage} comes off or ages",
    ("offset", True): "gage {gage} comes off or ages",
    ("gage_out", True): "gage {gage} fails more and more often",
    ("gage_out", False): "gage {gage} works again",
}
LARGEST_P = FALSE_ALARM


def fleet_document(data: DataSet) -> dict[str, Any]:
    """Return what stands out, what changes, what is joined, what is missing and what failed."""
    columns = ["container_id", "task", "name", "tire", "start_ts", "page", "answer", "file_path"]
    rows = data.table("container_metrics", columns).to_pylist()
    copies = _tags(data, ALSO_AT)
    for row in rows:  # which of the copies was first depends on the workers
        places = [row["file_path"], *copies.get(row["container_id"], ())]
        row["file_path"], *row["copies"] = sorted(set(places))
    rows = sorted(_told_apart(rows), key=_known_as)
    containers = {row["container_id"]: row for row in rows}
    sizes = {container: values[0] for container, values in _tags(data, "size").items()}
    return {
        "format": "tirelib-fleet-page/1",
        "containers": list(containers.values()),
        "fewest": {"tires": FEWEST_SPREAD, "in_time": FEWEST_IN_TIME},
        "parameters": _parameters(data, containers, sizes),
        "changes": _changes(data, containers),
        "effects": _effects(data, containers),
        "negative": _negative(data, containers),
        "failures": _failures(data, containers),
    }


def _told_apart(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return containers whose names differ within a task and tire: with folder, else with path."""
    for whole in (False, True):
        count = Counter(map(_known_as, rows))
        for row in rows:
            if count[_known_as(row)] > 1:
                place = row["file_path"]
                row["name"] += f" ({place if whole else place.rpartition('/')[2]})"
    return rows


def _known_as(row: Mapping[str, Any]) -> tuple[str, str, str]:
    return row["task"], row["tire"], row["name"]


def write_fleet_page(data: DataSet) -> str:
    """Write ``index.html``, ``index.md`` and ``index.json`` of a data set; return the address."""
    document = fleet_document(data)
    with tempfile.TemporaryDirectory() as folder:
        for path in write_fleet(Path(folder), document, fleet_parts(document), data.url):
            data.write(path.read_bytes(), path.name)
    data.write(json.dumps(document).encode(), "index.json")
    return f"{data.url.rstrip('/')}/index.html"


def _tags(data: DataSet, key: str) -> dict[int, list[str]]:
    found: dict[int, list[str]] = defaultdict(list)
    rows = data.table("container_tags", ["container_id", "value"], pads.field("key") == key)
    for row in rows.to_pylist():
        found[row["container_id"]].append(row["value"])
    return found


def _results(data: DataSet, task: str, kind: str, columns: list[str]) -> list[dict[str, Any]]:
    chosen = (pads.field(PARTITION) == task) & (pads.field("kind") == kind)
    rows: list[dict[str, Any]] = data.table(
        "results", ["container_id", *columns], chosen
    ).to_pylist()
    return rows


def _parameters(
    data: DataSet, containers: Mapping[int, Any], sizes: Mapping[int, str]
) -> list[dict[str, Any]]:
    """Return each identified number over the containers, with outliers, and joined by size."""
    columns = ["name", "value", "std", "low", "high", "unit", "flags"]
    by_name: dict[tuple[str, str], list[dict[str, Any]]] = defaultdict(list)
    for row in _results(data, "identify", "parameter", columns):
        whole = row["container_id"] in containers and row["std"] and row["value"] is not None
        if whole and "fixed" not in row["flags"]:
            by_name[sizes.get(row["container_id"], ""), row["name"]].append(row)
    found = []
    for (size, name), rows in sorted(by_name.items()):
        rows.sort(key=lambda row: _known_as(containers[row["container_id"]]))
        values = np.array([row["value"] for row in rows])
        stds = np.array([row["std"] for row in rows])
        spread = spread_of(values, stds, len(by_name))
        points = [
            {
                **{key: row[key] for key in ("value", "std", "low", "high", "flags")},
                "container_id": row["container_id"],
                "tire": containers[row["container_id"]]["tire"],
                "campaign": containers[row["container_id"]]["name"],
                "page": containers[row["container_id"]]["page"],
                "score": score,
                "outlier": bool(outlier),
            }
            for row, score, outlier in zip(rows, spread.score.tolist(), spread.outlier, strict=True)
        ]
        found.append(
            {
                "size": size,
                "name": name,
                "unit": rows[0]["unit"],
                "centre": spread.centre,
                "scatter": spread.scatter,
                "points": points,
                "joined": _joined(points),
            }
        )
    return found


def _joined(points: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the number of each tire in one fit of all that do not stand out."""
    by_tire: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for point in points:
        if not point["outlier"]:
            by_tire[point["tire"]].append(point)
    if not by_tire:
        return []
    own = [_of_tire(each) for each in by_tire.values()]
    values, stds = (np.array(column) for column in zip(*own, strict=True))
    joined = join(values, stds)
    if joined is None:
        return []
    return [
        {
            "tire": tire,
            "campaigns": len(by_tire[tire]),
            "own": float(values[i]),
            "own_std": float(stds[i]),
            "value": float(joined.value[i]),
            "low": float(joined.low[i]),
            "high": float(joined.high[i]),
            "gain": float(joined.gain[i]),
            "page": by_tire[tire][0]["page"],
        }
        for i, tire in enumerate(by_tire)
    ]


def _of_tire(points: list[dict[str, Any]]) -> tuple[float, float]:
    """Return the weighted mean of a tire's campaigns and its standard deviation."""
    weight = np.array([1.0 / point["std"] ** 2 for point in points])
    values = np.array([point["value"] for point in points])
    return float((weight * values).sum() / weight.sum()), float(1.0 / np.sqrt(weight.sum()))


def _changes(data: DataSet, containers: Mapping[int, Any]) -> list[dict[str, Any]]:
    """Return the watched channels of each tire and wheel over time, with what changes."""
    chosen = pads.field(PARTITION) == "estimate"
    columns = ["container_id", "channel_name", "unit", "mean", "sample_count"]
    series: dict[tuple[str, str, str], list[tuple[int, float, str]]] = defaultdict(list)
    for row in data.table("channel_metrics", columns, chosen).to_pylist():
        container = containers.get(row["container_id"])
        if container is None or container["start_ts"] is None or row["mean"] is None:
            continue
        wheel, _, channel = row["channel_name"].rpartition(".")
        key = (container["tire"], wheel, channel)
        series[key].append((row["container_id"], row["mean"], row["unit"]))
    watched = {key: rows for key, rows in series.items() if _quantity(key[2])[0] in WATCHED}
    found = []
    for (tire, wheel, channel), rows in sorted(watched.items()):
        quantity, gage = _quantity(channel)
        ids = [container for container, _, _ in rows]
        time = np.array([1e-6 * containers[each]["start_ts"] for each in ids])
        values = np.array([mean for _, mean, _ in rows])
        given = [
            _same_order(series.get((tire, wheel, name), []), ids) for name in WATCHED[quantity]
        ]
        change = change_of(time, values, given)
        order = np.argsort(time)
        found.append(
            {
                "tire": tire,
                "wheel": wheel,
                "channel": channel,
                "unit": rows[0][2],
                "time": time[order].tolist(),
                "values": values[order].tolist(),
                "pages": [containers[ids[k]]["page"] for k in order],
                "change": None if change is None else change.change,
                "per_day": None if change is None else change.slope * DAY,
                "p": None if change is None else change.p,
                "quantity": quantity,
                "gage": gage,
            }
        )
    tests = max(sum(each["p"] is not None for each in found), 1)
    for each in found:
        each["changes"] = each["p"] is not None and each["p"] * tests < LARGEST_P
        rises = bool(each["change"] is not None and each["change"] > 0.0)
        cause = CAUSES[each["quantity"], rises].format(gage=each["gage"])
        each["cause"] = cause if each["changes"] else ""
    return found


def _quantity(channel: str) -> tuple[str, str]:
    """Return quantity and gage of a channel's name."""
    name, _, last = channel.rpartition("_")
    return (name, last) if last.isdigit() else (channel, "")


def _same_order(rows: list[tuple[int, float, str]], ids: list[int]) -> FloatArray:
    means = {container: mean for container, mean, _ in rows}
    return np.array([means.get(each, np.nan) for each in ids])


def _effects(data: DataSet, containers: Mapping[int, Any]) -> list[dict[str, Any]]:
    """Return the verdict of each diagnosed container, with what is named and hinted at."""
    found = _results(data, "diagnose", "verdict", ["name", "flags", "text"])
    verdicts = sorted(
        (row for row in found if row["container_id"] in containers),
        key=lambda row: _known_as(containers[row["container_id"]]),
    )
    hints: dict[int, list[str]] = defaultdict(list)
    for row in _results(data, "diagnose", "effect", ["name", "flags"]):
        if row["flags"] == "hint":
            hints[row["container_id"]].append(row["name"])
    return [
        {
            "tire": containers[row["container_id"]]["tire"],
            "campaign": containers[row["container_id"]]["name"],
            "page": containers[row["container_id"]]["page"],
            "quantity": row["name"],
            "verdict": row["text"],
            "named": [name for name in row["flags"].split(";") if name],
            "hints": hints[row["container_id"]],
        }
        for row in verdicts
    ]


def _negative(data: DataSet, containers: Mapping[int, Any]) -> list[dict[str, Any]]:
    """Return what ended with a negative answer, with the first reason and their number."""
    kinds = pads.field("kind").isin(["error", "reason"]) & pads.field("text").is_valid()
    reasons: dict[int, list[str]] = defaultdict(list)
    for row in data.table("results", ["container_id", "name", "text"], kinds).to_pylist():
        reasons[row["container_id"]].append(": ".join(filter(None, (row["name"], row["text"]))))
    return [
        {
            **{key: row[key] for key in ("task", "name", "tire", "page", "file_path")},
            "reasons": len(reasons[number]),
            "first": next(iter(reasons[number]), ""),
        }
        for number, row in containers.items()
        if row["answer"]
    ]


def _failures(data: DataSet, containers: Mapping[int, Any]) -> list[dict[str, Any]]:
    """Return what failed and has not been done since, by cause."""
    done = {
        (row["task"], path)
        for row in containers.values()
        for path in (row["file_path"], *row["copies"])
    }
    columns = ["task", "file_path", "cause", "message", "failed_dt"]
    latest = {}
    for row in sorted(
        data.table("failures", columns).to_pylist(), key=lambda each: each["failed_dt"]
    ):
        if (row["task"], row["file_path"]) not in done:
            latest[row["task"], row["file_path"]] = row
    count = Counter((row["task"], row["cause"]) for row in latest.values())
    return [
        {
            "task": task,
            "cause": cause,
            "number": number,
            "paths": sorted(
                p for (t, p), row in latest.items() if (t, row["cause"]) == (task, cause)
            ),
            "message": next(
                row["message"]
                for row in latest.values()
                if (row["task"], row["cause"]) == (task, cause)
            ),
        }
        for (task, cause), number in count.most_common()
    ]
