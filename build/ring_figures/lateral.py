"""The ring's pressure in the brush, against the parabola (Fig. 6-40)."""

import numpy as np
from matplotlib.figure import Figure

from tirelib.physics.brush.forces import brush_distribution, brush_forces
from tirelib.physics.brush.parameters import BrushParameters
from tirelib.physics.contact.profiles import PressureProfile, parabola, sampled
from tirelib.report.figures.ring_panels import load_labels
from tirelib.report.simulation import Simulation
from tirelib.report.style import (
    BLUE,
    FAINT,
    RED,
    label,
    legend_below,
    new_figure,
    styled,
)

ANGLES = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
"""Slip angles, [deg]."""
SHOWN = (1.0, 2.0, 4.0)
NODES = 400


def ring_profile(done: Simulation, point: int) -> PressureProfile:
    """Return the ring's pressure along the road, x forward from below the axle.

    The belt's length is laid out flat: x = -R phi; the profile is scaled to the load.
    """
    lead, trail = done.edges[point]
    phi = np.linspace(lead, trail, NODES)
    q = np.interp(phi, done.phi, done.normal[point])
    q[[0, -1]] = 0.0
    x = -done.tire.ring_radius * phi[::-1]
    return sampled(x, np.maximum(q, 0.0)[::-1], load=float(done.load[point]))


def parabolic_profile(done: Simulation, point: int) -> PressureProfile:
    """Return the parabola with the same load and edges."""
    lead, trail = -done.tire.ring_radius * done.edges[point]
    return parabola(float(done.load[point]), trail, lead, nodes=NODES)


@styled
def figure_6_40(done: Simulation) -> Figure:
    """Lateral traction at slip angles with the ring's pressure and with the parabola, by load.

    The right column has the lateral force over slip angle. Bristle stiffness and friction are the
    tire's. Source: dissertation, Fig. 6-40, 6-41.
    """
    tire, count = done.tire, len(done)
    brush = BrushParameters(lateral_stiffness=tire.bristle_lateral, friction=tire.friction)
    figure = new_figure(14.0, 2.9 * count + 1.0)
    grid = figure.subplots(count, len(SHOWN) + 1, squeeze=False, sharex="col", sharey=False)
    for row in range(count):
        kinds = (
            ("pressure of the ring", BLUE, ring_profile(done, row)),
            ("parabola", RED, parabolic_profile(done, row)),
        )
        for column, angle in enumerate(SHOWN):
            axes = grid[row, column]
            for text, colour, profile in kinds:
                spread = brush_distribution(profile, brush, np.deg2rad(angle))
                limit = -1e-3 * tire.friction * profile.pressure
                axes.plot(
                    1e3 * profile.x, limit, ":", color=colour, label=f"limit of friction, {text}"
                )
                axes.plot(1e3 * spread.x, 1e-3 * spread.fy, color=colour, label=text)
            axes.set_title(f"{load_labels(done)[row]}, slip angle {angle:g} deg")
            if column:
                axes.sharey(grid[row, 0])
                axes.tick_params(labelleft=False)
        grid[row, 0].set_ylabel(label("lateral traction", "N/mm", signed=True))
        axes = grid[row, -1]
        angles = np.linspace(ANGLES[0], ANGLES[-1], 41)
        for text, colour, profile in kinds:
            force = [brush_forces(profile, brush, np.deg2rad(a)).Fy for a in angles]
            axes.plot(angles, 1e-3 * np.array(force), color=colour, label=text)
        axes.axhline(
            -1e-3 * tire.friction * done.load[row],
            color=FAINT,
            linewidth=1.0,
            label="friction times load",
        )
        axes.set_title(f"{load_labels(done)[row]}, lateral force")
        axes.set_ylabel(label("Fy", "kN", signed=True))
    for axes in grid[-1, :-1]:
        axes.set_xlabel(label("x, exit < 0 < entry", "mm", signed=True))
    grid[-1, -1].set_xlabel(label("slip angle", "deg", signed=True))
    legend_below(figure, [grid[0, 0], grid[0, -1]], columns=5)
    return figure
