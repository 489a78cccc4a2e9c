"""A plot for each main equation, drawn from the code that computes it when the site is built.

Ring, tread and liner are those of the dissertation's Table 6-1; the standing ring has a bending
stiffness of 20 N m^2 in place of the tension that it lacks.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from plots_laws import LAWS

from tirelib.core.parameters import read_tire
from tirelib.effects import CATALOGUE
from tirelib.inference.diagnose.diagnose import TABLE
from tirelib.inference.statistics.plain import load
from tirelib.physics.brush.parabola import (
    aligning_moment,
    bristle_stiffness,
    lateral_force,
    sliding_angle,
)
from tirelib.physics.brush.parameters import Carcass
from tirelib.physics.contact import radial, shear
from tirelib.physics.contact.profiles import convex_concave, power_law
from tirelib.physics.contact.static import StaticContact, StaticTire, press_to_deflection
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.frequencies import natural_frequency, three_mode_sensitivity
from tirelib.physics.ring.green import point_response, pressed_shape
from tirelib.physics.ring.ring import Ring
from tirelib.physics.strain.deformation import arc_nodes, contact_deformation
from tirelib.physics.strain.innerliner import strain_at
from tirelib.report.style import label, legend_below, new_figure, sequence, styled

TIRE = read_tire("table-6-1").tire
STANDING = StaticTire(
    ring_radius=TIRE.ring_radius,
    free_radius=TIRE.free_radius,
    bending_stiffness=20.0,
    radial_stiffness=TIRE.radial_stiffness,
    tread_stiffness=TIRE.tread_stiffness,
)
OMEGA = 59.0
"""Table 6-1, [rad/s]."""
LOADS = np.array([1500.0, 3000.0, 4500.0, 6000.0])
"""[N]."""
DEFLECTIONS = np.array([0.01, 0.02, 0.03, 0.04])
"""Deflections of the standing ring, [m]."""
DEPTHS = [f"{1e3 * d0:g} mm" for d0 in DEFLECTIONS]
AROUND = np.radians(np.linspace(-60.0, 60.0, 481))
Panels = list[Axes]


def rolling(load: float | np.ndarray, damping: float) -> radial.RadialContact:
    """Return the contact of the rolling ring with radial springs."""
    ring = replace(Ring.of(TIRE, TIRE.pressure), damping=damping)
    return radial.load(compliance(ring, OMEGA), Tread.of(TIRE), load)


def strain_parts(axes: Panels) -> None:
    """Draw a trace and its two parts, (11)."""
    found = rolling(4500.0, 0.09)
    strain = (
        1e6 * strain_at(found.displacement, TIRE.ring_radius, TIRE.innerliner_offset, AROUND)[0]
    )
    odd = 0.5 * (strain - strain[::-1])
    for values, name in ((strain, "strain"), (strain - odd, "even part"), (odd, "odd part")):
        axes[0].plot(np.degrees(AROUND), values, label=name)
    axes[0].set(xlabel=label("wheel angle", "deg"), ylabel=label("strain", "microstrain"))


def carcass(axes: Panels) -> None:
    """Draw the belt's line of (2), corrected and as printed."""
    belt = Carcass(lateral=1.5e5, yaw=8e3, bend=400.0)
    x, force, moment = np.linspace(-0.06, 0.06, 61), -2000.0, 40.0
    rest = moment / np.asarray(belt.yaw) * x + force / np.asarray(belt.lateral)
    bent = force / (2.0 * np.asarray(belt.bend)) * x**2
    for sign, name in ((-1.0, "corrected"), (1.0, "as printed")):
        axes[0].plot(1e3 * x, 1e3 * (rest + sign * bent), label=name)
    axes[0].set(xlabel=label("x, forward", "mm"), ylabel=label("belt, to the left", "mm"))


def brush(axes: Panels) -> None:
    """Draw force, moment and friction of (3), (4), (8)."""
    angle = np.radians(np.linspace(0.05, 14.0, 200))
    stiffness, load, a = bristle_stiffness(6e4, 0.06), 4000.0, 0.06
    for mu, color in zip((0.5, 0.9), sequence(2), strict=True):
        given = (angle, stiffness, mu, load, a)
        axes[0].plot(np.degrees(angle), 1e-3 * lateral_force(*given), color=color)
        axes[1].plot(
            np.degrees(angle), aligning_moment(*given), color=color, label=f"friction {mu}"
        )
    t = np.tan(angle) / np.tan(sliding_angle(stiffness, 0.9, load, a))
    printed = -0.9 * load * -a * np.where(t < 1.0, t * (1.0 - 3.0 * t + 3.0 * t**2 - t), 0.0)
    axes[1].plot(np.degrees(angle), printed, "k:", label="0.9, last term as printed")
    axes[0].set(ylabel=label("Fy", "kN", signed=True))
    axes[1].set(ylabel=label("Mz", "N m", signed=True))
    for panel in axes:
        panel.set(xlabel=label("slip angle", "deg"))


def pressure_shapes(axes: Panels) -> None:
    """Draw the pressures of (28) and (53)."""
    x, load, h = np.linspace(-0.0599, 0.0599, 241), 4000.0, 0.06
    for n, color in zip((0.7, 1.0, 2.0, 4.0), sequence(4), strict=True):
        axes[0].plot(1e3 * x, 1e-3 * power_law(load, -h, h, n).pressure_at(x), color=color, label=n)
    for s_f, color in zip((4.0, 18.0, 100.0), sequence(3), strict=True):
        shape = convex_concave(load, -h, h, n_p=4.0, S_f=s_f, S=3.0)
        axes[1].plot(1e3 * x, 1e-3 * shape.pressure_at(x), color=color, label=f"{s_f:g}")
    axes[0].legend(title="(28): n")
    axes[1].legend(title="(53): S_f")
    for panel in axes:
        panel.set(xlabel=label("x, forward", "mm"), ylabel=label("pressure", "kN/m"))


@cache
def standing() -> tuple[StaticContact, np.ndarray]:
    """Return the standing ring at all deflections, and the strain of its liner at the contact."""
    contact = press_to_deflection(STANDING, DEFLECTIONS, nodes=121)
    u, curved = (
        pressed_shape(
            AROUND,
            contact.angle,
            contact.pressure,
            ring_radius=TIRE.ring_radius,
            bending_stiffness=STANDING.bending_stiffness,
            radial_stiffness=STANDING.radial_stiffness,
            derivative=order,
        )
        for order in (0, 2)
    )
    return contact, -TIRE.innerliner_offset / TIRE.ring_radius**2 * (u + curved)


def curves(axes: Axes, x: np.ndarray, rows: np.ndarray, names: Sequence[str]) -> None:
    """Draw a curve for each row."""
    places = np.broadcast_to(x, rows.shape)
    for at, row, name, color in zip(places, rows, names, sequence(len(rows)), strict=True):
        axes.plot(at, row, color=color, label=name)


def liner_strain(axes: Panels) -> None:
    """Draw the strain (35) of the standing ring."""
    curves(axes[0], np.degrees(AROUND), 1e6 * standing()[1], DEPTHS)
    axes[0].set(xlabel=label("wheel angle", "deg"), ylabel=label("strain", "microstrain"))


def deformation(axes: Panels) -> None:
    """Draw the belt's place in the contact, from its strain by (36) to (40) and as it is."""
    contact, strain = standing()
    for row, color in enumerate(sequence(len(DEFLECTIONS))):
        half, d0 = contact.half_angle[row], contact.deflection[row]
        nodes = arc_nodes(-half, half, 25)
        found = contact_deformation(
            np.interp(nodes, AROUND, strain[row]),
            -half,
            half,
            deflection=d0,
            ring_radius=TIRE.ring_radius,
            free_radius=TIRE.free_radius,
            liner_offset=TIRE.innerliner_offset,
        )
        inside = np.abs(contact.angle[row]) <= half
        x, u = contact.angle[row][inside], contact.deformation[row][inside]
        axes[0].plot(np.degrees(x), 1e3 * u, color=color, label=DEPTHS[row])
        axes[0].plot(np.degrees(found.angle), 1e3 * found.deformation, ".", color=color)
    axes[0].set(xlabel=label("wheel angle", "deg"), ylabel=label("u; dots: from strain", "mm"))


def point_load(axes: Panels) -> None:
    """Draw the ring under one force for three stiffnesses of bending, (43) to (46)."""
    phi = np.radians(np.linspace(-180.0, 180.0, 721))
    for stiffness, color in zip((1.0, 4.0, 16.0), sequence(3), strict=True):
        u = point_response(
            phi,
            ring_radius=TIRE.ring_radius,
            bending_stiffness=stiffness,
            radial_stiffness=TIRE.radial_stiffness,
        )
        axes[0].plot(np.degrees(phi), 1e6 * u, color=color, label=f"EI = {stiffness:g} N m²")
    axes[0].set(xlabel=label("angle from the force", "deg"), ylabel=label("u by 1 N", "µm"))


def standing_pressure(axes: Panels) -> None:
    """Draw the pressure of the standing ring, (47) to (52)."""
    contact, _ = standing()
    curves(axes[0], np.degrees(contact.angle), 1e-3 * contact.pressure, DEPTHS)
    axes[0].set(xlabel=label("wheel angle", "deg"), ylabel=label("pressure", "kN/m"))


def answer(axes: Panels) -> None:
    """Draw amplitude and phase of the radial answer to a radial load, (89) and (90)."""
    n = np.arange(1, 31)
    for damping, color in zip((0.0, 0.03, 0.09), sequence(3), strict=True):
        ring = replace(Ring.of(TIRE, TIRE.pressure), damping=damping)
        response = compliance(ring, OMEGA, 30).radial[0, 1:]
        axes[0].semilogy(n, 1e9 * np.abs(response), ".-", color=color)
        axes[1].plot(n, -np.degrees(np.angle(response)), ".-", color=color, label=f"λ = {damping}")
    axes[0].set(xlabel="harmonic n", ylabel=label("u per q_u", "mm per kN/mm"))
    axes[1].set(xlabel="harmonic n", ylabel=label("phase lag", "deg"))


def damping(axes: Panels) -> None:
    """Draw the pressure with more and more damping, (107)."""
    for ratio, color in zip((0.0, 0.05, 0.1), sequence(3), strict=True):
        found = rolling(4500.0, ratio)
        axes[0].plot(
            np.degrees(AROUND),
            1e-3 * found.pressure_at(AROUND[None])[0],
            color=color,
            label=f"λ = {ratio}",
        )
    axes[0].set(xlim=(-25, 25), ylabel=label("pressure", "kN/m"))
    axes[0].set(xlabel=label("wheel angle; the contact begins at the left", "deg"))


def frequencies(axes: Panels) -> None:
    """Draw (109) over the order, and what one percent of a frequency does to (110)."""
    ring = Ring.of(TIRE, TIRE.pressure)
    stiffness = (ring.bending_stiffness, ring.radial_stiffness, ring.tangential_stiffness)
    n = np.arange(9)
    omega = natural_frequency(
        n,
        ring_radius=ring.radius,
        bending_stiffness=stiffness[0],
        radial_stiffness=stiffness[1],
        tangential_stiffness=stiffness[2],
        inflation=ring.inflation,
        mass=ring.mass,
    )
    axes[0].plot(n, omega / (2.0 * np.pi), "o-")
    axes[0].set(xlabel="order n", ylabel=label("frequency", "Hz"))
    change = three_mode_sensitivity(
        omega[1:4], ring_radius=ring.radius, inflation=ring.inflation, mass=ring.mass
    )
    axes[1].bar(("f1", "f2", "f3", "p b"), np.ravel(change))
    axes[1].axhline(0.0, color="k", linewidth=0.8)
    axes[1].set(ylabel=label("EI by 1 % of it", "%"))


def rolling_pressure(axes: Panels) -> None:
    """Draw the pressure of the rolling ring, (78) and (91) to (97)."""
    found = rolling(LOADS, 0.04)
    pressure = found.pressure_at(np.broadcast_to(AROUND, (len(LOADS), AROUND.size)))
    names = [f"{1e-3 * load:g} kN" for load in LOADS]
    curves(axes[0], np.degrees(AROUND), 1e-3 * pressure, names)
    axes[0].set(xlim=(-25, 25), ylabel=label("pressure", "kN/m"))
    axes[0].set(xlabel=label("wheel angle", "deg"))


def sheared_tread(axes: Panels) -> None:
    """Draw pressure and traction of tread elements, (79) to (81)."""
    ring = replace(Ring.of(TIRE, TIRE.pressure), damping=0.04)
    found = shear.load(compliance(ring, OMEGA), Tread.of(TIRE), shear.Shear(2.5e7, 0.65), 4500.0)
    x = np.degrees(found.phi[0])
    axes[0].plot(x, 1e-3 * found.pressure[0], label="pressure, (80)")
    axes[0].plot(x, 1e-3 * found.shear_traction[0], label="traction, rearward")
    axes[0].plot(x, 0.65e-3 * found.pressure[0], "k:", label="limit of friction")
    axes[0].set(xlabel=label("wheel angle", "deg"), ylabel=label("per length", "kN/m"))


def plain_tires(axes: Panels) -> None:
    """Draw what plain tires show of each effect: mean and standard deviation over a family."""
    families, _ = load(TABLE)
    names = [name for name in families[0].means if name in CATALOGUE]
    for k, family in enumerate(families):
        mean = [family.means[name] for name in names]
        width = np.sqrt([family.shown()[name] for name in names])
        axes[0].errorbar(mean, np.arange(len(names)) + 0.2 * (k - 1), xerr=width, fmt="o", ms=3)
        axes[0].lines[-1].set_label(family.name)
    axes[0].set_yticks(range(len(names)), names)
    axes[0].set(xlabel="apparent strength, in whole ranges", xticks=[-0.05, 0.0, 0.05])
    axes[0].invert_yaxis()
    axes[0].legend()


PLOTS: dict[str, tuple[int, Callable[[Panels], None]]] = {
    "strain_parts": (1, strain_parts),
    "carcass": (1, carcass),
    "brush": (2, brush),
    "pressure_shapes": (2, pressure_shapes),
    "liner_strain": (1, liner_strain),
    "deformation": (1, deformation),
    "point_load": (1, point_load),
    "standing_pressure": (1, standing_pressure),
    "compliance": (2, answer),
    "damping": (1, damping),
    "frequencies": (2, frequencies),
    "rolling_pressure": (1, rolling_pressure),
    "sheared_tread": (1, sheared_tread),
    "plain_tires": (1, plain_tires),
    **LAWS,
}
"""Panels of each plot, and what draws them; `plot` in `theory/equations.toml` names one, and
`theory/inference.md` the last."""


@styled
def draw(name: str, folder: Path) -> None:
    """Draw one plot into the folder."""
    panels, paint = PLOTS[name]
    figure = new_figure(4.6 * panels, 3.0)
    axes = list(np.ravel(figure.subplots(1, panels)))
    paint(axes)
    if all(panel.get_legend() is None for panel in axes):
        legend_below(figure, axes)
    figure.dpi = 110
    FigureCanvasAgg(figure).print_png(folder / f"{name}.png")  # `savefig` would draw it twice
