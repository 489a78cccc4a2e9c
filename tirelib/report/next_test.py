"""The page of a next test: ranked runs, and the separation over load, speed and pressure."""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.core.arrays import FloatArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.planning.document import PROMISING, STRUCTURE, Plan, advice, plan_document
from tirelib.inference.planning.envelope import AXES
from tirelib.inference.planning.next_test import NOTHING, NextTest, PairForecast
from tirelib.report.figures.compare_plot import Plot, dots, line, styled_figure
from tirelib.report.page import Part, Table, number, numbers, write_parts_page
from tirelib.report.style import BLUE, FAINT, RED

TITLE = "Which run to measure next"
METHOD = (
    "Every suspect is fitted to the present runs, as a hypothesis of the diagnosis. At each "
    "possible run one suspect is assumed to be true: measurements are drawn from what the present "
    "runs leave open of it, with noise, errors of the set points, and the misfit that a run has "
    "for itself. The share of draws in which the other suspect leaves the confidence set is the "
    "chance that the run resolves the pair, over the odds that the present runs give to either. "
    "The separation is the mean rise of the likelihood ratio against the wrong one, in chi-square; "
    "the smaller of both directions counts."
)
SOURCES = (
    "Criterion: G. E. P. Box, W. J. Hill, Technometrics 9 (1967) 57: discrimination among models; "
    "here with the test of the diagnosis in the place of an entropy.",
)
SHOWN = 20


def write_next_test(plan: Plan, folder: Path) -> tuple[Path, Path]:
    """Write ``next_test.html`` and ``next_test.md``; return their paths."""
    text, names = advice(plan), ", ".join(plan.suspects.names) or "none"
    left_out = {} if plan.test is None else plan.test.left_out
    return write_parts_page(
        folder,
        "next_test",
        parts_of(plan),
        title=TITLE,
        summary=f"Campaign {plan.campaign}, {plan.quantity}. Suspects: {names} "
        f"({plan.suspects.why}).",
        answer=f"{text[0].upper()}{text[1:]}.",
        messages=[f"{name} is left out: {why}" for name, why in left_out.items()],
    )


def parts_of(plan: Plan) -> list[Part]:
    """Return the parts of the page; only the method where there is nothing to plan."""
    test = plan.test
    if test is None or not len(test.points):
        return [Part("Method", "method", METHOD, sources=SOURCES)]
    shown = test.open_pairs or test.pairs
    return [
        Part("Runs by rank", "runs", tables=[_runs(test)]),
        Part(
            "Where suspects part",
            "map",
            _envelope_text(test),
            plots=[_map(test, pair) for pair in shown],
        ),
        Part("Suspects on the present runs", "suspects", tables=[_suspects(test), _pairs(test)]),
        Part(
            "Repeats",
            "repeats",
            tables=_repeat_tables(plan, test),
            plots=[_repeats(plan, test, shown)],
        ),
        Part("Method", "method", METHOD, sources=SOURCES),
    ]


def _said(*names: str) -> str:
    return " / ".join(name.replace(NOTHING, "no effect") for name in names)


def _runs(test: NextTest) -> Table:
    names, swept = test.envelope.names, [test.envelope.slips] if test.envelope.sweep else []
    rows = [
        [
            str(k + 1),
            *(number(float(x), 4) for x in _told(test, test.points[k])),
            *swept,
            number(test.score[k], 3),
            number(float(test.std[k]), 2),
            number(100.0 * test.probability[k], 2),
            _said(*test.pairs[test.hardest[k]].names),
        ]
        for k in range(min(SHOWN, len(test.points)))
    ]
    score, chance = float(np.median(test.score)), 100.0 * float(np.mean(test.probability))
    blank = [""] * (len(names) + len(swept))
    headings = [QUANTITIES[name].heading for name in names] + ["sweep"] * len(swept)
    results = ["separation [chi-square]", "std", "chance to resolve [%]", "hardest pair"]
    return Table(
        "Possible runs",
        ["rank", *headings, *results],
        [*rows, ["any run", *blank, number(score, 3), "", number(chance, 2), ""]],
        note="Separation of the pair that this run separates least; the chance is a mean over the "
        "undecided pairs. Last row: median separation and mean chance over all possible runs.",
    )


def _told(test: NextTest, points: FloatArray) -> list[FloatArray]:
    """Return the conditions of points, the last axis of an array, in their units."""
    pairs = zip(test.envelope.names, np.moveaxis(points, -1, 0), strict=True)
    return [np.asarray(QUANTITIES[name].told(values)) for name, values in pairs]


def _envelope_text(test: NextTest) -> str:
    envelope = test.envelope
    low, high = (
        envelope.text(np.array(ends)) for ends in zip(*envelope.ranges.values(), strict=True)
    )
    open_ = [n for n in envelope.names if n not in envelope.declared and AXES[n].wider > 0.0]
    text = f"Envelope: from {low} to {high}."
    if envelope.sweep is not None:
        name, values = envelope.sweep.name, envelope.sweep.values
        slips = ", ".join(f"{QUANTITIES[name].told(value):.3g}" for value in values)
        text += f" Every run is a sweep: {QUANTITIES[name].heading} {slips}."
    if open_:
        wider = ", ".join(f"{name} by {100 * AXES[name].wider:.0f} %" for name in open_)
        text += (
            f" No range was declared, so the campaign's range was widened to both sides: {wider}."
        )
    if test.dropped:
        text += f" {test.dropped} runs lie outside the tire's range of validity and were dropped."
    return text


def _plane(test: NextTest) -> tuple[int, int | None, int | None]:
    """Return the columns of the points that a map shows: along, upward, and one panel each.

    Upward of sweeps is what they vary beside load and pressure, where there is such.
    """
    names, ranges = test.envelope.names, test.envelope.ranges
    slip = next((name for name in names if name.startswith("slip")), None)
    panel = names.index("pressure") if "pressure" in names else None
    if slip is not None:
        return names.index(slip), names.index("load"), panel
    other = [name for name in names if name not in ("load", "pressure")]
    varied = [name for name in other if ranges[name][1] > ranges[name][0]]
    up = next(iter([*varied, *other]), None)
    return names.index("load"), None if up is None else names.index(up), panel


def _map(test: NextTest, pair: PairForecast) -> Plot:
    """Draw the separation over two conditions, one panel per pressure, others as advised."""
    x, y, panel = _plane(test)
    names, best = test.envelope.names, test.points[0]
    others = [k for k in range(len(names)) if k not in (x, y, panel)]
    shown = np.flatnonzero((test.points[:, others] == best[others]).all(axis=1))
    across, up, pressure = (None if k is None else QUANTITIES[names[k]] for k in (x, y, panel))
    assert across is not None  # noqa: S101 - every map is over a condition
    points = np.zeros((len(test.points), 3))
    for column, (k, said) in enumerate(zip((x, y, panel), (across, up, pressure), strict=True)):
        if k is not None and said is not None:
            points[:, column] = said.told(test.points[:, k])
    xs, ys, panels = (np.unique(points[shown, column]) for column in range(3))
    figure = make_subplots(
        cols=len(panels),
        shared_yaxes=True,
        horizontal_spacing=0.03,
        subplot_titles=[f"{p:.3g} {pressure.unit}" for p in panels] if pressure else None,
    )
    upward = "" if up is None else f", %{{y}} {up.unit}"
    hover = f"%{{x}} {across.unit}{upward}: separation %{{z:.3g}}, chance %{{customdata}} %"
    for column, level in enumerate(panels, start=1):
        grid, chance = np.full((2, len(ys), len(xs)), np.nan)
        for k in shown[points[shown, 2] == level]:
            at = np.searchsorted(ys, points[k, 1]), np.searchsorted(xs, points[k, 0])
            grid[at], chance[at] = pair.separation[k], 100.0 * pair.probability[k]
        field = go.Heatmap(
            z=np.round(grid, 3),
            x=np.round(xs, 2),
            y=np.round(ys, 2),
            customdata=np.round(chance),
            coloraxis="coloraxis",
            hovertemplate=f"{hover}<extra></extra>",
            texttemplate="%{z:.2~r}",
            textfont={"size": 11},
        )
        figure.add_trace(field, row=1, col=column)
    ring = {"symbol": "circle-open", "line": {"width": 3}}
    advised = dots([points[0, 0]], [points[0, 1]], "advised", RED, 30, **ring)
    place = {"row": 1, "col": int(np.searchsorted(panels, points[0, 2])) + 1}
    figure.add_scatter(**advised, showlegend=False, hovertemplate="advised<extra></extra>", **place)
    figure.update_xaxes(title=across.heading)
    figure.update_yaxes(title="" if up is None else up.heading, col=1)
    if len(ys) == 1:
        figure.update_yaxes(tickvals=[] if up is None else list(np.round(ys, 2)))
    top = max(float(pair.separation[shown].max()), 1.0)
    bar = {"title": {"text": "separation"}}
    scale = {"colorscale": "Viridis", "cmin": 0.0, "cmax": top, "colorbar": bar}
    note = (
        "Chi-square that one run is expected to add against the wrong suspect. The ring marks the "
        "advised run; blank fields are beyond the tire's validity."
    )
    if others:
        note += " Conditions that are not drawn are those of the advised run."
    headings = [QUANTITIES[name].heading for name in names]
    data = {**dict(zip(headings, _told(test, test.points), strict=True))}
    data |= {"separation": pair.separation, "chance to resolve": pair.probability}
    return Plot.of(
        f"separation-{'-'.join(pair.names)}",
        f"Separation of {_said(*pair.names)}",
        note,
        styled_figure(figure, 420, coloraxis=scale),
        {name: [float(f"{x:.5g}") for x in values] for name, values in data.items()},
    )


def _suspects(test: NextTest) -> Table:
    return Table.of(
        "Suspects",
        test.rivals,
        {
            "suspect": lambda rival: _said(rival.name),
            "in range": lambda rival: "yes" if rival.in_range else "no",
            "strength": lambda rival: numbers(rival.strength),
            "chi-square left": lambda rival: number(rival.cost, 4),
        },
        texts=2,
    )


def _pairs(test: NextTest) -> Table:
    return Table.of(
        "Pairs",
        test.pairs,
        {
            "pair": lambda pair: _said(*pair.names),
            "better now": lambda pair: _said(pair.better),
            "resolved now": lambda pair: "yes" if pair.resolved else "no",
            "chi-square apart now": lambda pair: number(abs(pair.gap), 3),
            "advised run adds": lambda pair: number(float(pair.separation[0]), 3),
            "chance [%]": lambda pair: number(100.0 * float(pair.probability[0]), 2),
        },
        texts=3,
    )


def _repeats(plan: Plan, test: NextTest, pairs: tuple[PairForecast, ...]) -> Plot:
    figure = go.Figure()
    rows = []
    for pair in pairs:
        said, times = _said(*pair.names), list(pair.repeats)
        reached = np.round(list(pair.repeats.values()), 3)
        figure.add_scatter(x=times, y=reached, mode="lines+markers", name=said)
        ends, limit = [1, times[-1]], [pair.limit] * 2
        dotted = line(ends, limit, f"limit, {said}", FAINT, dash="dot")
        figure.add_scatter(**dotted, hoverinfo="skip")
        rows += [[said, n, float(f"{x:.5g}")] for n, x in pair.repeats.items()]
    wanted = {"annotation_text": "wanted", "annotation_position": "top left"}
    figure.add_hline(y=plan.wanted, line={"dash": "dash", "color": BLUE}, **wanted)
    figure.update_xaxes(title="repeats of the advised run", rangemode="tozero")
    figure.update_yaxes(title="separation", rangemode="tozero")
    return Plot(
        "repeats",
        "What repeats of the advised run add",
        f"Dotted: the limit that no number of repeats exceeds, because {STRUCTURE} does not "
        "average out.",
        styled_figure(figure, 380, showlegend=True),
        ["pair", "repeats", "separation"],
        rows,
    )


def _repeat_tables(plan: Plan, test: NextTest) -> list[Table]:
    of_plan = plan_document(plan)["repeats"]["of_plan"]
    if not of_plan:
        return []
    return [
        Table.of(
            "Repeating the whole plan",
            of_plan.items(),
            {
                "effect": lambda item: item[0],
                "chance to show it, now [%]": lambda item: number(100.0 * item[1]["gain_now"], 2),
                "the same, infinitely many repeats [%]": lambda item: number(
                    100.0 * item[1]["gain_limit"], 2
                ),
                f"repeats of the plan until {100 * PROMISING:.0f} %": lambda item: str(
                    item[1]["times"] or "never"
                ),
            },
        )
    ]
