"""The page of a next test: ranked runs, and the separation over load, speed and pressure."""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.planning.document import BAR, KMH, Plan, advice, plan_document, run_text
from tirelib.planning.envelope import WIDER
from tirelib.planning.next_test import RESOLVED, NextTest, PairForecast
from tirelib.planning.rivals import NOTHING
from tirelib.report.comparison import Part
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import Table, number
from tirelib.report.parts_page import write_parts_page
from tirelib.report.style import BLUE, FAINT, RED

TITLE = "Which run to measure next"
METHOD = (
    "Every suspect is fitted to the present runs, with what the structure of the ring does anyway "
    "among the unknowns. At each possible run one suspect is taken as true and the other may adapt "
    "within what the present runs leave open of it; what it still misses, in chi-square, is the "
    "separation. The smaller of both directions counts. A chi-square of "
    f"{RESOLVED:.0f} between two suspects rules the worse one out."
)
SOURCES = (
    "Criterion: A. C. Atkinson, V. V. Fedorov, Biometrika 62 (1975) 57: T-optimum designs for "
    "discriminating between two rival models; here with the parameters' uncertainty integrated out "
    "as in G. E. P. Box, W. J. Hill, Technometrics 9 (1967) 57.",
)
SHOWN = 20


def write_next_test(plan: Plan, folder: Path) -> tuple[Path, Path]:
    """Write ``next_test.html`` and ``next_test.md``; return their paths.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    text = advice(plan)
    return write_parts_page(
        folder, "next_test", parts_of(plan), title=TITLE, summary=_summary(plan),
        answer=f"{text[0].upper()}{text[1:]}.", messages=_messages(plan),
    )  # fmt: skip


def _summary(plan: Plan) -> str:
    names = ", ".join(plan.suspects.names) or "none"
    return f"Campaign {plan.campaign}, strain. Suspects: {names} ({plan.suspects.why})."


def _messages(plan: Plan) -> list[str]:
    if plan.test is None:
        return []
    return [f"{name} is left out: {why}" for name, why in plan.test.trial.left_out.items()]


def parts_of(plan: Plan) -> list[Part]:
    """Return the parts of the page; only the method where there is nothing to plan."""
    test = plan.test
    if test is None or not len(test.points):
        return [Part("Method", "method", METHOD, sources=SOURCES)]
    shown = test.open_pairs or test.pairs
    return [
        Part("Runs by rank", "runs", tables=[_runs(test)]),
        Part("Where suspects part", "map", _envelope_text(test),
             plots=[_map(test, pair) for pair in shown]),
        Part("Suspects on the present runs", "suspects", tables=[_suspects(test), _pairs(test)]),
        Part("Repeats", "repeats", tables=_repeat_tables(plan, test),
             plots=[_repeats(test, shown, plan.wanted)]),
        Part("Method", "method", METHOD, sources=SOURCES),
    ]  # fmt: skip


def _said(pair: PairForecast) -> str:
    return " / ".join(name.replace(NOTHING, "no effect") for name in pair.names)


def _runs(test: NextTest) -> Table:
    rows = []
    for k in range(min(SHOWN, len(test.points))):
        load, pressure, speed = test.points[k]
        rows.append([
            str(k + 1), number(load), number(pressure / BAR, 3), number(speed / KMH, 3),
            number(test.score[k], 3), number(2.0 * float(np.sqrt(test.score[k])), 2),
            number(100.0 * test.probability[k], 2), _said(test.pairs[test.hardest[k]]),
        ])  # fmt: skip
    median = [
        "any run", "", "", "", number(float(np.median(test.score)), 3), "",
        number(100.0 * float(np.mean(test.probability)), 2), "",
    ]  # fmt: skip
    return Table(
        "Possible runs",
        ["rank", "load [N]", "pressure [bar]", "speed [km/h]", "separation", "std",
         "chance to resolve [%]", "hardest pair"],
        [*rows, median],
        note="Separation of the pair that is hardest there; the chance is a mean over the pairs in "
             "doubt. Last row: median separation and mean chance over all possible runs.",
    )  # fmt: skip


def _envelope_text(test: NextTest) -> str:
    envelope = test.envelope
    low = run_text(np.array([envelope.load[0], envelope.pressure[0], envelope.speed[0]]))
    high = run_text(np.array([envelope.load[1], envelope.pressure[1], envelope.speed[1]]))
    open_ = [name for name in WIDER if name not in envelope.declared]
    text = f"Envelope: from {low} to {high}."
    if open_:
        wider = ", ".join(f"{name} by {100 * WIDER[name]:.0f} %" for name in open_)
        text += f" Not declared, so the campaign's range was widened to both sides: {wider}."
    if test.dropped:
        text += f" {test.dropped} runs are beyond the tire's validity and were dropped."
    return text


def _map(test: NextTest, pair: PairForecast) -> Plot:
    """Draw the separation over load and speed, one panel per pressure."""
    loads, pressures, speeds = (np.unique(test.points[:, k]) for k in range(3))
    top = max(float(pair.separation.max()), 1.0)
    figure = make_subplots(
        cols=len(pressures), shared_yaxes=True, horizontal_spacing=0.03,
        subplot_titles=[f"{p / BAR:.3g} bar" for p in pressures],
    )  # fmt: skip
    for column, pressure in enumerate(pressures, start=1):
        grid = np.full((len(speeds), len(loads)), np.nan)
        chance = grid.copy()
        for k in np.flatnonzero(test.points[:, 1] == pressure):
            at = (
                np.searchsorted(speeds, test.points[k, 2]),
                np.searchsorted(loads, test.points[k, 0]),
            )
            grid[at], chance[at] = pair.separation[k], 100.0 * pair.probability[k]
        figure.add_trace(
            go.Heatmap(
                z=np.round(grid, 3), x=np.round(loads), y=np.round(speeds / KMH, 1), zmin=0.0,
                zmax=top, colorscale="Viridis", customdata=np.round(chance), coloraxis="coloraxis",
                hovertemplate="%{x} N, %{y} km/h: separation %{z:.3g}, chance %{customdata} %"
                "<extra></extra>", texttemplate="%{z:.2g}", textfont={"size": 11},
            ),
            row=1, col=column,
        )  # fmt: skip
    best = test.points[0]
    figure.add_trace(
        go.Scatter(
            x=[best[0]], y=[best[2] / KMH], mode="markers", showlegend=False,
            marker={"symbol": "circle-open", "size": 30, "color": RED, "line": {"width": 3}},
            hovertemplate="advised<extra></extra>",
        ),
        row=1, col=int(np.searchsorted(pressures, best[1])) + 1,
    )  # fmt: skip
    figure.update_xaxes(title="load [N]")
    figure.update_yaxes(title="speed [km/h]", col=1)
    styled_figure(
        figure, 420, coloraxis={"colorscale": "Viridis", "cmin": 0.0, "cmax": top,
                                "colorbar": {"title": {"text": "separation"}}},
    )  # fmt: skip
    rows = [
        [round(float(point[0]), 1), round(float(point[1] / BAR), 4),
         round(float(point[2] / KMH), 2), float(f"{sep:.5g}"), float(f"{chance:.4g}")]
        for point, sep, chance in zip(test.points, pair.separation, pair.probability, strict=True)
    ]  # fmt: skip
    return Plot(
        f"separation-{'-'.join(pair.names)}", f"Separation of {_said(pair)}",
        "Chi-square that one run is expected to add against the wrong suspect. The ring marks the "
        "advised run; blank fields are beyond the tire's validity.",
        figure, ["load [N]", "pressure [bar]", "speed [km/h]", "separation", "chance to resolve"],
        rows,
    )  # fmt: skip


def _suspects(test: NextTest) -> Table:
    rows = [
        [
            rival.name.replace(NOTHING, "no effect"), "yes" if rival.in_range else "no",
            ", ".join(number(float(x), 3) for x in rival.strength), number(rival.cost, 4),
        ]
        for rival in test.trial.rivals
    ]  # fmt: skip
    return Table("Suspects", ["suspect", "in range", "strength", "chi-square left"], rows, texts=2)


def _pairs(test: NextTest) -> Table:
    rows = [
        [_said(pair), pair.better.replace(NOTHING, "no effect"), "yes" if pair.resolved else "no",
         number(abs(pair.gap), 3), number(float(pair.separation[0]), 3),
         number(100.0 * float(pair.probability[0]), 2)]
        for pair in test.pairs
    ]  # fmt: skip
    return Table(
        "Pairs",
        ["pair", "better now", "resolved now", "chi-square apart now", "advised run adds",
         "chance [%]"],
        rows, texts=3,
    )  # fmt: skip


def _repeats(test: NextTest, pairs: tuple[PairForecast, ...], wanted: float) -> Plot:
    figure = go.Figure()
    rows = []
    for pair in pairs:
        times, reached = list(pair.repeats), list(pair.repeats.values())
        figure.add_trace(
            go.Scatter(x=times, y=np.round(reached, 3), mode="lines+markers", name=_said(pair))
        )
        figure.add_trace(
            go.Scatter(x=[1, times[-1]], y=[pair.limit] * 2, mode="lines", hoverinfo="skip",
                       line={"dash": "dot", "color": FAINT}, name=f"limit, {_said(pair)}")
        )  # fmt: skip
        rows += [[_said(pair), n, float(f"{x:.5g}")] for n, x in pair.repeats.items()]
    figure.add_hline(
        y=wanted, line={"dash": "dash", "color": BLUE}, annotation_text="wanted",
        annotation_position="top left",
    )  # fmt: skip
    figure.update_xaxes(title="repeats of the advised run", rangemode="tozero")
    figure.update_yaxes(title="separation", rangemode="tozero")
    styled_figure(figure, 380, showlegend=True)
    return Plot(
        "repeats", "What repeats of the advised run add",
        "Dotted: what no number of repeats exceeds, for the structure of the ring does not average "
        "out.",
        figure, ["pair", "repeats", "separation"], rows,
    )  # fmt: skip


def _repeat_tables(plan: Plan, test: NextTest) -> list[Table]:
    of_plan = plan_document(plan)["repeats"]["of_plan"]
    if not of_plan:
        return []
    rows = [
        [name, number(entry["gain_now"], 3), number(entry["gain_limit"], 3),
         str(entry["times"] or "never")]
        for name, entry in of_plan.items()
    ]  # fmt: skip
    return [
        Table(
            "Repeating the whole plan",
            ["effect", "chi-square over no effect, now", "the same, endless repeats",
             f"times the plan until {RESOLVED:.0f}"],
            rows,
        )
    ]  # fmt: skip
