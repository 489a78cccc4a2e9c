"""Table and plot of the drive into water, as a part of a page."""

import numpy as np
from plotly.subplots import make_subplots

from cosim.antilock_report import EVERY, LOOK
from cosim.hydroplaning import ALLOWED, BEGINS, PLACE, SPEED, Drives
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import Part, Table, number
from tirelib.report.style import FAINT

NOTE = (
    "Vehicle: 14 degrees of freedom; the wedge's strain is that of the numerical rig. Stopping "
    "way: to 25 km/h, by all the grip that the tread has at each speed, the water staying as deep. "
    "Today: wheel speeds, gyroscope and accelerometer show nothing while the car rolls straight; "
    "the drag of the water is not in the vehicle."
)


def part(drives: Drives) -> Part:
    """Return the part of a page."""
    return Part(
        "Closed loop: hydroplaning (14-DOF vehicle)",
        "hydroplaning",
        sentence(drives),
        tables=[table(drives)],
        plots=[_plot(drives)],
    )


def table(drives: Drives) -> Table:
    """Return what is left of speed and grip."""
    rows = []
    for kind, run in drives.items():
        found = run.figures()
        rows.append(
            (
                kind,
                number(round(found["noticed_after_m"], 1), 3),
                number(found["speed_kmh"], 3),
                number(100.0 * found["share_of_water"], 3),
                number(found["stopping_way_m"], 3),
            )
        )
    head = (
        "knowledge",
        "noticed after [m]",
        "speed [km/h]",
        "load on the water [%]",
        "stopping way from there [m]",
    )
    title = f"{PLACE - BEGINS:.0f} m into the water, from {3.6 * SPEED:.0f} km/h"
    return Table(title, head, rows, note=NOTE)


def sentence(drives: Drives) -> str:
    """Say who notices."""
    told = {kind: run.figures() for kind, run in drives.items()}
    strain, today = told["strain"], told["today"]
    return (
        f"Strain tires notice the water {strain['noticed_after_m']:.1f} m after the front wheels "
        f"enter it; {PLACE - BEGINS:.0f} m into it the car is at {strain['speed_kmh']:.0f} km/h "
        f"and would stop in {strain['stopping_way_m']:.0f} m. Without them nobody notices: "
        f"{today['speed_kmh']:.0f} km/h and {today['stopping_way_m']:.0f} m."
    )


def _plot(drives: Drives) -> Plot:
    figure = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06)
    rows: list[tuple[str | float, ...]] = []
    for kind, run in drives.items():
        colour, dash = LOOK[kind]
        line = {"color": colour, "dash": dash, "width": 1.6}
        for row, values in ((1, 3.6 * run.speed), (2, 100.0 * run.share)):
            figure.add_scatter(
                x=run.way[::EVERY],
                y=values[::EVERY],
                name=kind,
                mode="lines",
                line=line,
                legendgroup=kind,
                showlegend=row == 1,
                row=row,
                col=1,
            )
        table = (run.way, 3.6 * run.speed, 100.0 * run.share, 100.0 * run.known)
        rows += [
            (kind, *(round(float(x), 4) for x in values))
            for values in np.stack(table, axis=1)[::EVERY]
        ]
    strain = drives["strain"]
    figure.add_scatter(
        x=strain.way[::EVERY],
        y=100.0 * strain.known[::EVERY],
        name="told by strain",
        mode="lines",
        line={"color": FAINT, "shape": "hv", "width": 1.2},
        row=2,
        col=1,
    )
    figure.add_hline(100.0 * ALLOWED, row=2, col=1, line_width=0.8, line_color=FAINT)
    figure.update_yaxes(title_text="speed [km/h]", row=1, col=1)
    figure.update_yaxes(title_text="load on the water [%]", row=2, col=1)
    figure.update_xaxes(title_text="way [m]", row=2, col=1)
    styled_figure(figure, 520, legend={"orientation": "h", "y": -0.14})
    return Plot(
        "hydroplaning",
        "Into standing water",
        f"The water begins at {BEGINS:.0f} m; above the horizontal line the car brakes gently.",
        figure,
        ("knowledge", "way [m]", "speed [km/h]", "load on the water [%]", "known [%]"),
        rows,
    )
