"""The page of vehicle co-simulations: error table, delays, and plots of every wheel."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import DASH, Part, Table, number, write_parts_page
from tirelib.report.style import BLUE, FAINT, INK, ORANGE, RED

TITLE = "Estimates in vehicle co-simulations"
WHEELS = ("front left", "front right", "rear left", "rear right")
QUANTITIES: Mapping[str, tuple[str, float, str]] = {
    "Fz": ("Fz [kN]", 1e-3, "% of static load"),
    "alpha": ("slip angle [deg]", float(np.degrees(1.0)), "deg"),
    "kappa": ("slip ratio [%]", 100.0, "1"),
    "Fy": ("Fy [kN]", 1e-3, "% of peak"),
}
"""Axis title, factor from SI, and the unit of the error."""
_METHOD = (
    "Errors (rms) of valid turns against the true value at the contact to which the estimate "
    "belongs. Steady: from the contact before to the output, Fz changed by less than 3 % of the "
    "static load, the slip angle by less than 0.25 deg and the slip ratio by less than 0.01; "
    "every other turn is transient. Fy refers to the tire whose strain is seen, not to the "
    "vehicle's own."
)


@dataclass(frozen=True, slots=True)
class Series:
    """A manoeuvre as it is drawn; SI, ISO 8855.

    Attributes
    ----------
    name, about : str
    time : array, shape (n,), [s]
    truth : dict of arrays, shape (n, 4)
        By the names of `QUANTITIES`.
    contact : sequence of 4 arrays, [s]
        Middle of every contact of each wheel.
    told : sequence of 4 dicts of arrays
        Estimates of these contacts.
    valid : sequence of 4 dicts of bool arrays
        Whether each estimate may be used.
    steady : sequence of 4 bool arrays
    """

    name: str
    about: str
    time: FloatArray
    truth: Mapping[str, FloatArray]
    contact: Sequence[FloatArray]
    told: Sequence[Mapping[str, FloatArray]]
    valid: Sequence[Mapping[str, BoolArray]]
    steady: Sequence[BoolArray]


def write_cosim(
    document: Mapping[str, Any],
    series: Sequence[Series],
    folder: Path,
    more: Sequence[Part] = (),
) -> Path:
    """Write ``index.html`` of a ``tirelib-cosim/1``, then `more` parts; return its path.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    page, _ = write_parts_page(
        folder,
        "index",
        [*parts_of(document, series), *more],
        title=TITLE,
        summary=_summary(document),
        answer=_answer(document),
        messages=[f"Not reached: {m}." for m in document["missed"]],
    )
    return page


def _summary(document: Mapping[str, Any]) -> str:
    loops = document.get("loop_vehicle")
    closed = f" Closed loops drive the vehicle of {loops}." if loops else ""
    return (
        f"Manoeuvres: {document['vehicle']}, open loop, {1e3 * document['step_s']:g} ms a step; "
        f"four virtual tires and four strain tires under FMPy.{closed}"
    )


def _answer(document: Mapping[str, Any]) -> str:
    count, missed = len(document["manoeuvres"]), len(document["missed"])
    if not missed:
        return f"All figures are reached in {count} manoeuvres and in the range drill."
    figures = "1 figure is" if missed == 1 else f"{missed} figures are"
    where = "1 manoeuvre" if count == 1 else f"{count} manoeuvres"
    return f"{figures} not reached, in {where} and the range drill."


def parts_of(document: Mapping[str, Any], series: Sequence[Series]) -> list[Part]:
    """Return the parts of the page."""
    by_name = {one["name"]: one for one in document["manoeuvres"]}
    drives = [
        Part(
            _words(one.name),
            one.name,
            f"{one.about[0].upper()}{one.about[1:]}.",
            tables=[_wheels(by_name[one.name])],
            plots=[_tracks(one)],
        )
        for one in series
    ]
    return [
        Part(
            "Errors",
            "errors",
            _METHOD,
            tables=[_errors(document, "steady"), _errors(document, "transient")],
            plots=[_shares(document)],
        ),
        Part("Intervals", "intervals", tables=[_intervals(document)]),
        Part("Delay and validity", "delay", tables=[_delays(document), _held(document)]),
        Part("Out of range", "range", tables=[_range(document)]),
        *drives,
    ]


def _words(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _errors(document: Mapping[str, Any], part: str) -> Table:
    limits = document["limits"]
    rows = [
        [
            _words(one["name"]),
            f"{one['all'][part]['turns']}",
            *(_against(one["all"][part][name], limits[name], part) for name in QUANTITIES),
        ]
        for one in document["manoeuvres"]
    ]
    goal = [["goal", "", *(number(limits[name]) for name in QUANTITIES)]]
    heads = [f"{name} [{unit}]" for name, (_, _, unit) in QUANTITIES.items()]
    note = (
        "A star marks an error larger than its goal."
        if part == "steady"
        else "The goals apply to steady turns."
    )
    return Table(
        f"{part.capitalize()} turns, all wheels",
        ["manoeuvre", "turns", *heads],
        rows + (goal if part == "steady" else []),
        note=note,
    )


def _against(value: float, limit: float, part: str) -> str:
    return number(value, 3) + (" *" if part == "steady" and value > limit else "")


def _wheels(one: Mapping[str, Any]) -> Table:
    rows = [
        [
            WHEELS[at],
            part,
            f"{wheel[part]['turns']}",
            *(number(wheel[part][name], 3) for name in QUANTITIES),
        ]
        for at, wheel in enumerate(one["wheels"].values())
        for part in ("steady", "transient")
    ]
    heads = [f"{name} [{unit}]" for name, (_, _, unit) in QUANTITIES.items()]
    return Table(
        "Errors of each wheel (rms)",
        ["wheel", "part", "turns", *heads],
        rows,
        texts=2,
        note=f"Peak of Fy: {number(one['peak_Fy_N'], 3)} N.",
        folded=True,
    )


def _intervals(document: Mapping[str, Any]) -> Table:
    rows = []
    for one in document["manoeuvres"]:
        parts = [one["all"]["interval"][name] for name in QUANTITIES]
        rows.append(
            [
                _words(one["name"]),
                number(one["least_friction"], 2),
                *(number(100.0 * part["valid"], 3) for part in parts),
                *(number(100.0 * part["covered"], 3) for part in parts),
                *(number(part["worst"], 2) for part in parts),
            ]
        )
    heads = (
        *(f"{name}: valid [%]" for name in QUANTITIES),
        *(f"{name}: covered [%]" for name in QUANTITIES),
        *(f"{name}: largest [std]" for name in QUANTITIES),
    )
    return Table(
        "Coverage of the 95 % intervals, all turns",
        ["manoeuvre", "friction", *heads],
        rows,
        note="Friction: the lowest under any wheel, relative to the calibrated road. Valid: share "
        "of the turns. Covered: share of the valid turns whose truth lies within 1.96 standard "
        "deviations; 95 % is correct. Largest: error over standard deviation. The calibration is "
        "made on the numerical rig, so its intervals do not include the error of the response "
        "surface that replaces the rig here.",
    )


def _delays(document: Mapping[str, Any]) -> Table:
    rows = []
    for one in document["manoeuvres"]:
        whole = one["all"]
        rows.append(
            [
                _words(one["name"]),
                f"{whole['turns']}",
                number(whole["age_ms"], 3),
                number(whole["lag_deg"], 3),
                number(whole["over_deg"], 3),
                number(100.0 * whole["false_alarms"], 2),
                number(100.0 * whole["gage_out"], 2),
                number(whole["out_of_range_s"], 3),
                number(whole["missed_s"], 3),
            ]
        )
    return Table(
        "Output and validity",
        [
            "manoeuvre",
            "turns",
            "age [ms]",
            "lag [deg]",
            "late [deg]",
            "false alarms [%]",
            "gage out [%]",
            "out of range [s]",
            "valid while out of range [s]",
        ],
        rows,
        note="Age: from the middle of the contact to the output, median. Lag: largest wheel angle "
        "from the trailing edge to the output. Late: largest lag beyond 20 deg plus half the "
        "filter and one frame; a negative value is in time. Shares are of the time. False alarms: "
        "a quantity is not valid though everything was in the calibrated range for two turns. "
        "Gage out: every quantity may be used, but `valid` is false, because the strip over an "
        "outer gage carries next to nothing. Out of range: for two turns, by more than a tenth of "
        "the range.",
    )


def _held(document: Mapping[str, Any]) -> Table:
    rows = [
        [
            _words(one["name"]),
            *(number(one["all"]["held"][name], 3) for name in QUANTITIES),
            *(number(one["all"]["delay_ms"][name], 3) for name in QUANTITIES),
        ]
        for one in document["manoeuvres"]
    ]
    heads = [f"{name} [{unit}]" for name, (_, _, unit) in QUANTITIES.items()]
    return Table(
        "What a controller receives: the held value, at every step",
        ["manoeuvre", *heads, *(f"{name}: delay [ms]" for name in QUANTITIES)],
        rows,
        note=f"Delay: the delay of the true value that fits the held value best; {DASH} where the "
        "true value hardly changes or no delay is clearly best.",
    )


def _range(document: Mapping[str, Any]) -> Table:
    rows = [
        [
            check["case"],
            "yes" if check["valid_before"] else "no",
            number(check["turns"], 3),
            "yes" if check["stays"] else "no",
            "passed" if check["passed"] else "MISSED",
        ]
        for check in document["range"]
    ]
    return Table(
        "A wheel that rolls steadily leaves the range in one quantity",
        ["to", "valid before", "turns until not valid", "stays so", "within two turns"],
        rows,
    )


def _shares(document: Mapping[str, Any]) -> Plot:
    names = [_words(one["name"]) for one in document["manoeuvres"]]
    figure = go.Figure()
    rows = []
    for name, colour in zip(QUANTITIES, (BLUE, ORANGE, INK, RED), strict=True):
        share = [
            one["all"]["steady"][name] / document["limits"][name] for one in document["manoeuvres"]
        ]
        figure.add_bar(x=names, y=share, name=name, marker_color=colour)
        rows += [[a, name, b] for a, b in zip(names, share, strict=True)]
    figure.add_hline(y=1.0, line={"color": FAINT, "dash": "dash"})
    figure.update_yaxes(title="steady error / goal", rangemode="tozero")
    styled_figure(figure, 380, barmode="group", legend={"orientation": "h", "y": 1.12})
    return Plot(
        "shares",
        "Steady errors as a share of the goal",
        "Below the line the goal is reached.",
        figure,
        ["manoeuvre", "quantity", "error / goal"],
        rows,
    )


def _tracks(one: Series) -> Plot:
    """Draw truth and estimates: a row a quantity, a column a wheel."""
    figure = make_subplots(
        rows=len(QUANTITIES),
        cols=len(WHEELS),
        shared_xaxes=True,
        shared_yaxes="rows",
        column_titles=list(WHEELS),
        vertical_spacing=0.03,
        horizontal_spacing=0.015,
    )
    rows: list[list[Any]] = []
    for row, (name, (title, factor, _)) in enumerate(QUANTITIES.items(), start=1):
        for wheel in range(len(WHEELS)):
            place = {"row": row, "col": wheel + 1}
            first = row == 1 and wheel == 0
            figure.add_scatter(
                x=np.round(one.time, 4),
                y=_short(factor * one.truth[name][:, wheel]),
                mode="lines",
                name="truth",
                line={"color": FAINT, "width": 1.6},
                legendgroup="truth",
                showlegend=first,
                **place,
            )
            _marks(figure, one, wheel, name, factor, first, place)
            rows += [
                [WHEELS[wheel], name, float(t), float(v), bool(good), bool(still)]
                for t, v, good, still in zip(
                    one.contact[wheel],
                    one.told[wheel][name],
                    one.valid[wheel][name],
                    one.steady[wheel],
                    strict=True,
                )
            ]
        figure.update_yaxes(title=title, row=row, col=1)
    figure.update_xaxes(title="time [s]", row=len(QUANTITIES))
    styled_figure(figure, 860, legend={"orientation": "h", "y": 1.09})
    return Plot(
        f"tracks-{one.name}",
        "Truth and estimates of each wheel",
        "Each estimate is drawn at the middle of its contact; it becomes available about 30 deg "
        "of wheel angle after the contact's end. Filled: steady turn; open: transient; cross: not "
        "valid. ISO 8855.",
        figure,
        ["wheel", "quantity", "contact [s]", "estimate (SI)", "valid", "steady"],
        rows,
    )


def _marks(
    figure: go.Figure,
    one: Series,
    wheel: int,
    name: str,
    factor: float,
    first: bool,
    place: Mapping[str, int],
) -> None:
    valid, steady = one.valid[wheel][name], one.steady[wheel]
    kinds = (
        ("estimate, steady", valid & steady, {"symbol": "circle", "color": BLUE, "size": 5}),
        (
            "estimate, transient",
            valid & ~steady,
            {"symbol": "circle-open", "color": ORANGE, "size": 6},
        ),
        (
            "not valid",
            ~valid,
            {"symbol": "x-thin", "color": RED, "size": 6, "line": {"color": RED, "width": 1.5}},
        ),
    )
    for words, which, marker in kinds:
        figure.add_scatter(
            x=np.round(one.contact[wheel][which], 4),
            y=_short(factor * one.told[wheel][name][which]),
            mode="markers",
            name=words,
            marker=marker,
            legendgroup=words,
            showlegend=first,
            **place,
        )


def _short(values: FloatArray) -> list[float | None]:
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in values]
