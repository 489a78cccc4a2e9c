"""Loads and inflation pressures on the test tire of Table 6-2 (Fig. 6-22 to 6-28, 6-34 to 6-36)."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from ring_figures.contact import NAMES
from tirelib.report.figures.ring_panels import (
    ANGLE,
    NORMAL,
    RATE,
    SHEAR,
    STRAIN,
    Curve,
    draw,
    half_width,
    inflation_labels,
    load_labels,
    speed_labels,
)
from tirelib.report.simulation import Simulation
from tirelib.report.style import legend_below, new_figure, sequence, styled


def figure_6_22(loads: Simulation) -> Figure:
    """Draw normal and horizontal traction by load, radial contact. Source: Fig. 6-22."""
    return _pair(loads, load_labels(loads), (NORMAL, SHEAR), f"at {inflation_labels(loads)[0]}")


def figure_6_23(inflations: Simulation) -> Figure:
    """Draw normal and horizontal traction by inflation at one load. Source: Fig. 6-23."""
    labels = inflation_labels(inflations)
    return _pair(inflations, labels, (NORMAL, SHEAR), f"at {load_labels(inflations)[0]}")


def figure_6_24(loads: Simulation) -> Figure:
    """Draw normal and horizontal traction by load with tread shear. Source: Fig. 6-24."""
    return figure_6_22(loads)


def figure_6_26(loads: Simulation) -> Figure:
    """Draw strain and strain rate by load, simulated. Source: Fig. 6-26."""
    title = f"at {inflation_labels(loads)[0]}"
    return _pair(loads, load_labels(loads), (STRAIN, RATE), title, wider=2.0)


def figure_6_28(inflations: Simulation) -> Figure:
    """Draw strain and strain rate by inflation at one load, simulated. Source: Fig. 6-28."""
    labels, title = inflation_labels(inflations), f"at {load_labels(inflations)[0]}"
    return _pair(inflations, labels, (STRAIN, RATE), title, wider=2.0)


def figure_6_34(loads: Simulation) -> Figure:
    """Draw the traction of the rolling, damped tire by load. Source: Fig. 6-34."""
    return _pair(loads, load_labels(loads), (NORMAL, SHEAR), _rolling(loads))


def figure_6_35(inflations: Simulation) -> Figure:
    """Draw the traction of the rolling, damped tire by inflation at one load. Source: Fig. 6-35."""
    title = f"at {load_labels(inflations)[0]}, {_rolling(inflations, inflated=False)}"
    return _pair(inflations, inflation_labels(inflations), (NORMAL, SHEAR), title)


def figure_6_36(loads: Simulation) -> Figure:
    """Draw the traction of the rolling, damped tire with tread shear by load. Source: Fig. 6-36."""
    return figure_6_34(loads)


def _rolling(done: Simulation, *, inflated: bool = True) -> str:
    bar = f"at {inflation_labels(done)[0]}, " if inflated else ""
    return f"{bar}{speed_labels(done)[0]}, damping {done.tire.damping:g}"


@styled
def _pair(
    done: Simulation,
    labels: Sequence[str],
    quantities: tuple[Curve, Curve],
    title: str,
    *,
    wider: float = 1.0,
) -> Figure:
    """Draw two quantities side by side, a curve for each operating point."""
    figure = new_figure(11.5, 5.0)
    panels = figure.subplots(1, 2)
    for axes, quantity in zip(panels, quantities, strict=True):
        draw(
            axes,
            done,
            quantity,
            labels,
            sequence(len(labels)),
            within=wider * half_width(done),
            edges=True,
        )
        axes.set_xlabel(ANGLE)
    figure.suptitle(
        f"{title[0].upper()}{title[1:]}, {NAMES[done.contact]}; dotted: edges of the contact",
        fontsize=10.5,
    )
    legend_below(figure, [panels[0]])
    return figure
