"""The page of a self-test: the chance of finding each effect, and what the plan cannot show."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

from tirelib.report.diagnosis import dead_effects
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import DASH, TWINS, Part, Table, number, write_parts_page

TITLE = "Effects that this plan can find"


def write_selftest(document: Mapping[str, Any], folder: Path) -> tuple[Path, Path]:
    """Write ``selftest.html`` and ``selftest.md`` of a ``tirelib-selftest/1``; return the paths."""
    return write_parts_page(
        folder,
        "selftest",
        parts_of(document),
        title=TITLE,
        summary=f"Campaign {document['campaign']}, strain; {document['repeats']} tires for each "
        f"effect and error ratio; false-alarm probability {document['false_alarm']:g}, seed "
        f"{document['seed']}.",
        answer=_answer(document),
        messages=[document["note"]],
    )


def _answer(document: Mapping[str, Any]) -> str:
    said = [
        f"at an error ratio of {entry['ratio']:g} the planted effect alone is named in "
        f"{100 * entry['found']:.0f}\u00a0% of the tires, is in the set in "
        f"{100 * entry['in_set']:.0f}\u00a0%, and only others are in "
        f"{100 * entry['wrong']:.0f}\u00a0% "
        f"({entry['effects']} of {len(document['effects'])} effects could be planted)"
        for entry in document["summary"]
        if entry["n"]
    ]
    alarms = document["false_alarms"]
    text = "; ".join(said) or "no effect could be planted"
    return (
        f"{text[0].upper()}{text[1:]}. With nothing planted there is a false alarm in "
        f"{100 * alarms['share']:.0f}\u00a0% of {alarms['n']} tires."
    )


def parts_of(document: Mapping[str, Any]) -> list[Part]:
    """Return the parts of the page."""
    return [
        Part(
            "Chance of finding",
            "chance",
            "The error ratio is the rms residual of the fitted model with the effect, divided by "
            "that without.",
            plots=[_map(document)] if document["effects"] else [],
        ),
        Part("Effects", "effects", tables=[_effects(document)]),
        Part("Effects that this plan cannot show", "blind", tables=dead_effects(document["dead"])),
    ]


def _map(document: Mapping[str, Any]) -> Plot:
    names = [entry["effect"] for entry in document["effects"]]
    ratios = [f"{ratio:g}" for ratio in document["ratios"]]
    results = [entry["results"] for entry in document["effects"]]
    chance = [[100.0 * each["found"] if each["n"] else None for each in row] for row in results]
    words = [["beyond range" if x is None else f"{x:.0f} %" for x in row] for row in chance]
    rows = [
        [name, *(each[key] for key in _KEYS)]
        for name, row in zip(names, results, strict=True)
        for each in row
    ]
    figure = go.Figure(
        go.Heatmap(
            z=chance,
            x=ratios,
            y=names,
            zmin=0.0,
            zmax=100.0,
            colorscale="Blues",
            text=words,
            texttemplate="%{text}",
            hoverongaps=False,
            hovertemplate="%{y} at %{x}: %{z:.0f} %<extra></extra>",
            colorbar={"title": {"text": "found [%]"}},
        )
    )
    figure.update_xaxes(title="error ratio", type="category", showgrid=False)
    figure.update_yaxes(autorange="reversed", showgrid=False)
    styled_figure(figure, 150 + 26 * len(names))
    return Plot(
        "chance",
        "Chance that the planted effect is named, and no other",
        "Beyond range: no plausible strength makes the error that much larger.",
        figure,
        ["effect", *_KEYS],
        rows,
    )


_KEYS = ("ratio", "strength", "n", "found", "found_low", "found_high", "in_set", "wrong", "seen")


def _effects(document: Mapping[str, Any]) -> Table:
    rows = [{**entry, **result} for entry in document["effects"] for result in entry["results"]]
    return Table.of(
        "Effects",
        rows,
        {
            "effect": lambda row: row["effect"],
            "in a set": lambda row: ", ".join(row["named"]),
            **TWINS,
            "error ratio": lambda row: number(row["ratio"]),
            "strength": lambda row: number(row["strength"], 3),
            "unit": lambda row: row["unit"],
            "found [%]": lambda row: _percent(row, "found"),
            "95 %": lambda row: (
                f"{_percent(row, 'found_low')} to {_percent(row, 'found_high')}"
                if row["n"]
                else DASH
            ),
            "in the set [%]": lambda row: _percent(row, "in_set"),
            "only others [%]": lambda row: _percent(row, "wrong"),
            "something missing [%]": lambda row: _percent(row, "seen"),
        },
        texts=3,
    )


def _percent(row: Mapping[str, Any], key: str) -> str:
    """Return a share of the tires in which the effect was planted; a dash where there are none."""
    return f"{100.0 * row[key]:.0f}" if row["n"] else DASH
