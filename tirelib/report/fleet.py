"""The page of a fleet: tires side by side, changes with time, effects, failures, joined tires.

Every point and every row opens the page of its campaign or recording.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from tirelib.report.figures.compare_plot import Plot, dots, level_line, styled_figure
from tirelib.report.page import DASH, INTERVAL, Columns, Part, Table, number, write_parts_page
from tirelib.report.style import BLUE, FAINT, ORANGE, RED

MOST_ROWS = 200
"""Rows of a table on the page; the tables of the data set have all."""
NOT_YET = {task: f"not known: {task} has not run" for task in ("identify", "estimate", "diagnose")}
"""What stands in the place of a result that nobody has asked for."""


def write_fleet(
    folder: Path, document: Mapping[str, Any], parts: Sequence[Part], url: str
) -> tuple[Path, Path]:
    """Write ``index.html`` and ``index.md``; return their paths."""
    return write_parts_page(
        folder,
        "index",
        parts,
        title="Fleet",
        summary=f"{_count(document)}. Data set: {url}",
        lines=_lines(document),
    )


def _count(document: Mapping[str, Any]) -> str:
    by_task = Counter(row["task"] for row in document["containers"])
    tires = {row["tire"] for row in document["containers"] if row["tire"]}
    tasks = ", ".join(f"{task} {count}" for task, count in sorted(by_task.items())) or "none"
    return f"Finished campaigns and recordings: {tasks}; tires: {len(tires)}"


def _lines(document: Mapping[str, Any]) -> list[tuple[str, str]]:
    odd = [
        f"{point['tire']} ({each['name']})"
        for each in document["parameters"]
        for point in each["points"]
        if point["outlier"]
    ]
    changing = [
        f"{each['tire']}{f' {wheel}' if (wheel := each['wheel']) else ''}: {each['cause']}"
        for each in document["changes"]
        if each["changes"]
    ]
    named = Counter(name for each in document["effects"] for name in each["named"])
    failed = sum(each["number"] for each in document["failures"])
    gains = [row["gain"] for each in document["parameters"] for row in each["joined"]]
    count = ", ".join(f"{name} in {count}" for name, count in named.most_common())
    tires = max((len(each["points"]) for each in document["parameters"]), default=0)
    times = max((len(each["time"]) for each in document["changes"]), default=0)
    usual = _judged(tires, document["fewest"]["tires"], "campaigns of one size of tire", "identify")
    still = _judged(times, document["fewest"]["in_time"], "recordings of one wheel", "estimate")
    stand = usual or "no tire, beyond its interval and the scatter of the others"
    change = still or "none, beyond the scatter of the recordings"
    lines = [
        ("Stand out", _some(odd) or stand),
        ("Change with time", _some(changing) or change),
        ("Effects", count or ("none named" if document["effects"] else NOT_YET["diagnose"])),
        ("Failed", f"{failed}, see the causes below" if failed else "none"),
    ]
    if document["negative"]:
        lines.append(("Negative answers", f"{len(document['negative'])}, see below"))
    if gains:
        fall = f"the standard deviations fall by a factor of up to {max(gains):.2f} (see below)"
        lines.append(("Joined tires", fall))
    return lines


def _judged(count: int, fewest: int, of: str, task: str) -> str:
    """Return why so many values do not tell anything, or an empty text."""
    if not count:
        return NOT_YET[task]
    return f"not known: at least {fewest} {of} are needed, here are {count}" * (count < fewest)


def _some(items: Sequence[str]) -> str:
    more = f", and {len(items) - 6} more" if len(items) > 6 else ""
    return ", ".join(items[:6]) + more


def _scattered(each: Mapping[str, Any]) -> str:
    """Say mean and scatter of a number; one value has no scatter."""
    if len(each["points"]) == 1:
        return "One value, which scatters about nothing. "
    unit = "" if each["unit"] == "1" else f" {each['unit']}"
    scatter = number(each["scatter"])
    return f"Mean {number(each['centre'])}, scatter between tires {scatter}{unit}. "


def fleet_parts(document: Mapping[str, Any]) -> list[Part]:
    """Return the parts of the page; one that has nothing to show is left out."""
    parts = [
        _parameters(document["parameters"]),
        _changes(document["changes"]),
        _effects(document["effects"]),
        _joined(document["parameters"]),
        _failures(document["failures"]),
        _negative(document["negative"]),
        _containers(document["containers"]),
    ]
    return [part for part in parts if part.plots or part.tables]


def _part(title: str, anchor: str, text: str, table: Table, plots: Sequence[Plot] = ()) -> Part:
    """Return a part; a table without rows is left out, one with many is cut off and says so."""
    cut = replace(table, rows=table.rows[:MOST_ROWS])
    if len(table.rows) > MOST_ROWS:
        text = f"{text} The first {MOST_ROWS} of {len(table.rows)} rows.".strip()
    return Part(title, anchor, text, [cut] if table.rows else [], plots)


def _link(page: str, text: str) -> Markup:
    return Markup('<a href="{}">{}</a>').format(page, text) if page else Markup.escape(text)


_OF: Columns = {"tire": lambda row: _link(row["page"], row["tire"])}
_WHICH: Columns = {
    "campaign": lambda row: _link(row["page"], row["name"]),
    "tire": lambda row: row["tire"],
    "task": lambda row: row["task"],
}


def _parameters(parameters: Sequence[Mapping[str, Any]]) -> Part:
    plots = [_parameter_plot(index, each) for index, each in enumerate(parameters)]
    odd = [{**each, **p} for each in parameters for p in each["points"] if p["outlier"]]
    table = Table.of(
        "Tires that stand out",
        odd,
        {
            **_OF,
            "campaign": lambda row: row["campaign"],
            "parameter": lambda row: row["name"],
            "unit": lambda row: row["unit"],
            "value": lambda row: number(row["value"]),
            **INTERVAL,
            "mean of the others": lambda row: number(row["centre"]),
            "distance in std": lambda row: f"{row['score']:+.1f}",
        },
        texts=4,
    )
    text = (
        "Points are campaigns with 95 % intervals; the band is the mean of the tires with "
        "twice the scatter between them. Orange: farther from the others than interval and "
        "scatter explain (on one page in fifteen by chance). A click on a point opens its page."
    )
    return _part("Parameters over the tires", "parameters", text, table, plots)


def _parameter_plot(index: int, each: Mapping[str, Any]) -> Plot:
    points, name = each["points"], each["name"].replace("_", " ")
    figure = go.Figure()
    labels = [f"{point['tire']}, {point['campaign']}" for point in points]
    for outlier, colour, said in ((False, BLUE, "usual"), (True, ORANGE, "stands out")):
        chosen = [k for k, point in enumerate(points) if point["outlier"] is outlier]
        if not chosen:
            continue
        low, values, high = ([points[k][key] for k in chosen] for key in ("low", "value", "high"))
        at, symbol = [labels[k] for k in chosen], "diamond" if outlier else "circle"
        figure.add_scatter(
            **dots(at, values, said, colour, 9, symbol=symbol),
            error_y={
                "array": np.subtract(high, values).tolist(),
                "arrayminus": np.subtract(values, low).tolist(),
                "thickness": 1.2,
            },
            customdata=[points[k]["page"] for k in chosen],
            hovertemplate="%{x}<br>%{y:.4g}<extra></extra>",
        )
    low, high = each["centre"] - 2 * each["scatter"], each["centre"] + 2 * each["scatter"]
    figure.add_hrect(y0=low, y1=high, fillcolor=FAINT, opacity=0.12, line_width=0)
    level_line(figure, each["centre"])
    figure.update_xaxes(
        categoryorder="array", categoryarray=labels, showticklabels=len(points) <= 40
    )
    styled_figure(figure, 360, showlegend=True, legend={"orientation": "h", "y": 1.12})
    figure.update_yaxes(title=f"{name} [{each['unit']}]")
    columns = {key: key for key in ("tire", "campaign", "value", "low", "high")}
    columns["stands out"] = "outlier"
    return Plot.of(
        f"parameter-{index}",
        f"{name}, free radius {each['size']}" if each["size"] else name,
        _scattered(each),
        figure,
        {heading: [point[key] for point in points] for heading, key in columns.items()},
    )


def _changes(changes: Sequence[Mapping[str, Any]]) -> Part:
    table = Table.of(
        "Changes",
        [each for each in changes if each["changes"]],
        {
            "tire": lambda each: _link(each["pages"][-1], each["tire"]),
            "wheel": lambda each: each["wheel"] or DASH,
            "channel": lambda each: each["channel"],
            "unit": lambda each: each["unit"],
            "what it may be": lambda each: each["cause"],
            "recordings": lambda each: str(len(each["values"])),
            "change": lambda each: number(each["change"], 3),
            "a day": lambda each: number(each["per_day"], 3),
            "chance": lambda each: f"{each['p']:.1g}",
        },
        texts=5,
    )
    by_channel: dict[str, list[Mapping[str, Any]]] = {}
    for each in changes:
        if len(each["values"]) > 1 and any(each["values"]):
            by_channel.setdefault(each["channel"], []).append(each)
    plots = [_change_plot(channel, series) for channel, series in by_channel.items()]
    text = (
        "Means of recordings over time, a line for each tire and wheel. Orange: steeper than "
        "the scatter about it explains; for the rolling radius pressure and load are taken out."
    )
    return _part("Changes with time", "changes", text, table, plots)


def _change_plot(channel: str, series: Sequence[Mapping[str, Any]]) -> Plot:
    figure, rows = go.Figure(), []
    for each in series:
        look = {"color": ORANGE, "width": 2.2} if each["changes"] else {"color": BLUE, "width": 0.8}
        figure.add_scatter(
            x=[datetime.fromtimestamp(t, UTC) for t in each["time"]],
            y=each["values"],
            mode="lines+markers",
            name=f"{each['tire']} {each['wheel']}".strip(),
            line=look,
            opacity=1.0 if each["changes"] else 0.55,
            customdata=each["pages"],
            hovertemplate="%{x|%Y-%m-%d}<br>%{y:.4g}<extra>%{fullData.name}</extra>",
        )
        pairs = zip(each["time"], each["values"], strict=True)
        rows += [[each["tire"], each["wheel"], *pair] for pair in pairs]
    styled_figure(figure, 340, showlegend=len(series) <= 12)
    figure.update_yaxes(title=f"{channel.replace('_', ' ')} [{series[0]['unit']}]")
    return Plot(
        f"change-{channel}",
        channel.replace("_", " "),
        f"{sum(each['changes'] for each in series)} of {len(series)} lines change. ",
        figure,
        ("tire", "wheel", "time_s", "value"),
        rows,
    )


def _effects(effects: Sequence[Mapping[str, Any]]) -> Part:
    names = sorted({name for each in effects for name in (*each["named"], *each["hints"])})
    table = Table.of(
        "Verdicts",
        effects,
        {
            **_OF,
            "campaign": lambda each: each["campaign"],
            "quantity": lambda each: each["quantity"],
            "verdict": lambda each: each["verdict"],
            "named": lambda each: ", ".join(each["named"]) or DASH,
            "hints": lambda each: ", ".join(each["hints"]) or DASH,
        },
        texts=6,
    )
    plots = [_effect_plot(effects, names)] if names else []
    return _part("Effects by tire", "effects", "", table, plots)


def _effect_plot(effects: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Plot:
    tires = [f"{each['tire']}, {each['campaign']}" for each in effects]
    level = [
        [2 if name in each["named"] else int(name in each["hints"]) for each in effects]
        for name in names
    ]
    figure = go.Figure(
        go.Heatmap(
            x=tires,
            y=names,
            z=level,
            zmin=0,
            zmax=2,
            colorscale=[[0.0, "#f2f4f6"], [0.5, "#9ecae1"], [1.0, RED]],
            xgap=2,
            ygap=2,
            showscale=False,
            customdata=[[each["page"] for each in effects] for _ in names],
            hovertemplate="%{x}<br>%{y}<extra></extra>",
        )
    )
    styled_figure(figure, 180 + 26 * len(names))
    figure.update_xaxes(showticklabels=len(tires) <= 40)
    rows = [[t, n, level[j][i]] for i, t in enumerate(tires) for j, n in enumerate(names)]
    return Plot(
        "effects",
        "Effects by tire",
        "Orange: named. Blue: a hint. Grey: neither. ",
        figure,
        ("tire", "effect", "level"),
        rows,
    )


def _joined(parameters: Sequence[Mapping[str, Any]]) -> Part:
    rows = [{**each, **row} for each in parameters for row in each["joined"]]
    rows.sort(key=lambda row: -round(row["gain"], 2))
    note = (
        "Gain: the standard deviation of the tire alone divided by that after joining. Its square "
        "is how many times as many runs the tire alone would need. Tires that stand out are not "
        "joined."
    )
    table = Table.of(
        "Joined numbers",
        rows,
        {
            **_OF,
            "parameter": lambda row: row["name"],
            "unit": lambda row: row["unit"],
            "campaigns": lambda row: str(row["campaigns"]),
            "alone": lambda row: number(row["own"]),
            "std alone": lambda row: number(row["own_std"], 3),
            "joined": lambda row: number(row["value"]),
            **INTERVAL,
            "gain": lambda row: f"{row['gain']:.2f}",
        },
        texts=3,
        note=note,
        folded=len(rows) > 40,
    )
    text = (
        "Tires of one size are one population: a tire with few runs borrows from its siblings, as "
        "far as these scatter less than its own interval is wide."
    )
    return _part("Joined tires", "joined", text, table)


def _failures(failures: Sequence[Mapping[str, Any]]) -> Part:
    table = Table.of(
        "Failures by cause",
        failures,
        {
            "task": lambda each: each["task"],
            "cause": lambda each: each["cause"],
            "first message": lambda each: each["message"].splitlines()[0],
            "where": lambda each: (
                ", ".join(path.rpartition("/")[2] for path in each["paths"][:3])
                + (", ..." if len(each["paths"]) > 3 else "")
            ),
            "number": lambda each: str(each["number"]),
        },
        texts=4,
    )
    return _part("Failures", "failures", "The same command tries them again.", table)


def _negative(negative: Sequence[Mapping[str, Any]]) -> Part:
    table = Table.of(
        "Negative answers",
        negative,
        {
            **_WHICH,
            "first reason": lambda each: each["first"].partition(";")[0],
            "reasons": lambda each: str(each["reasons"]),
        },
        texts=4,
    )
    text = "The work was done and its answer is no: a check found errors, or no turn is valid."
    return _part("Negative answers", "negative", text, table)


def _containers(containers: Sequence[Mapping[str, Any]]) -> Part:
    note = (
        f"The first {MOST_ROWS} of {len(containers)}; the table container_metrics has all."
        if len(containers) > MOST_ROWS
        else ""
    )
    table = Table.of(
        "Pages of all",
        containers,
        {
            **_WHICH,
            "path": lambda row: "; copy: ".join((row["file_path"], *row["copies"])),
        },
        texts=4,
        note=note,
        folded=True,
    )
    return _part("Campaigns and recordings", "containers", "", table)
