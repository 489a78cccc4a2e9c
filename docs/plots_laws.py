"""Plots of the laws behind the main equations: gages, slip, brush, layers, the ring's constants."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes

from tirebench.wire.gage_setup import apparent_strain
from tirelib.core.parameters import read_tire
from tirelib.physics.brush.forces import brush_forces
from tirelib.physics.brush.parabola import bristle_stiffness, friction_at_angle
from tirelib.physics.brush.parameters import BrushParameters
from tirelib.physics.contact import radial
from tirelib.physics.contact.profiles import power_law
from tirelib.physics.contact.static import StaticTire, press_to_deflection
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.frequencies import rim_stiffness
from tirelib.physics.ring.ring import Ring, modal_stiffness, plain_stiffness
from tirelib.physics.strain.relations import bending_strain, full_strain, series_shape
from tirelib.report.style import label, sequence

TIRE = read_tire("table-6-1").tire
Panels = list[Axes]


def bridge(axes: Panels) -> None:
    """Draw what a quarter bridge gives, (20), and what the exact bridge does."""
    strain, factor = np.linspace(-0.02, 0.02, 81), 2.0
    x = factor * strain
    axes[0].plot(100.0 * strain, 250.0 * factor * strain, label="(20)")
    axes[0].plot(100.0 * strain, 1e3 * x / (4.0 + 2.0 * x), label="exact bridge")
    shunt = np.geomspace(2e4, 1e6, 60)
    looks = [-1e6 * apparent_strain(350.0, ohm, factor) for ohm in shunt]
    axes[1].loglog(1e-3 * shunt, looks, label="shunt of a 350 ohm gage")
    axes[0].set(xlabel=label("strain", "%"), ylabel=label("output", "mV/V"))
    axes[1].set(xlabel=label("shunt", "kohm"), ylabel=label("compression", "microstrain"))


def slip(axes: Panels) -> None:
    """Draw the slip ratio of (21) over the wheel's rate, and what the radius does to it."""
    rate, radius = np.linspace(0.7, 1.2, 101), 0.31
    for speed, color in zip((10.0, 20.0, 30.0), sequence(3), strict=True):
        omega = rate * speed / radius
        axes[0].plot(omega, omega * radius / speed - 1.0, color=color, label=f"{speed:g} m/s")
    error = np.linspace(-0.02, 0.02, 41)
    for kappa, color in zip((-0.1, 0.0, 0.1), sequence(3), strict=True):
        axes[1].plot(100.0 * error, (1.0 + kappa) * error, color=color, label=f"κ = {kappa:g}")
    axes[0].set(xlabel=label("turn rate", "rad/s"), ylabel="slip ratio")
    axes[1].set(xlabel=label("error of the radius", "%"), ylabel="error of the slip ratio")
    for panel in axes:
        panel.axhline(0.0, color="k", linewidth=0.8)
        panel.legend()


def friction(axes: Panels) -> None:
    """Draw the friction of (8) over the angle of full sliding."""
    limit = np.radians(np.linspace(2.5, 14.0, 100))
    for force, color in zip((1000.0, 2000.0, 3000.0), sequence(3), strict=True):
        found = friction_at_angle(-force, 4000.0, np.radians(2.0), limit)
        axes[0].plot(np.degrees(limit), found, color=color, label=f"Fy = -{force:.0f} N at 2 deg")
    axes[0].set(xlabel=label("angle of full sliding", "deg"), ylabel="friction of (8)")


def any_pressure(axes: Panels) -> None:
    """Draw force and moment of (23) to (25) for flatter and flatter pressures."""
    angle, load, a = np.radians(np.linspace(0.1, 12.0, 100)), 4000.0, 0.06
    given = BrushParameters(bristle_stiffness(6e4, a), friction=0.9)
    for n, color in zip((1.0, 2.0, 4.0), sequence(3), strict=True):
        found = brush_forces(power_law(load, -a, a, n), given, angle)
        axes[0].plot(np.degrees(angle), 1e-3 * found.Fy, color=color, label=f"n = {n:g}")
        axes[1].plot(np.degrees(angle), found.Mz, color=color)
    axes[0].set(ylabel=label("Fy", "kN", signed=True))
    axes[1].set(ylabel=label("Mz", "N m", signed=True))
    for panel in axes:
        panel.set(xlabel=label("slip angle", "deg"))


def bristles(axes: Panels) -> None:
    """Draw the bristles' stiffness of (26) over the length of the contact."""
    half = np.linspace(0.03, 0.09, 61)
    for cornering, color in zip((3e4, 6e4, 9e4), sequence(3), strict=True):
        said = f"C = {cornering * np.pi / 180.0:.0f} N/deg"
        found = bristle_stiffness(cornering, half)
        axes[0].plot(2e3 * half, 1e-6 * found, color=color, label=said)
    axes[0].set(xlabel=label("contact length", "mm"), ylabel=label("c_py", "N/mm²"))


def layers(axes: Panels) -> None:
    """Draw the strain of three layers by (29), in full and of bending alone."""
    n, phi = np.arange(25), np.radians(np.linspace(-60.0, 60.0, 241))
    u = -4e-3 * np.exp(-((n / 6.0) ** 2)) * (n > 0)
    v = np.divide(u, n, out=np.zeros(n.size), where=n > 0)  # v' = -u
    nothing = np.zeros(n.size)
    shape = series_shape(phi, u, nothing, nothing, -v)
    for y, color in zip((-6e-3, -3e-3, 3e-3), sequence(3), strict=True):
        given = {"ring_radius": TIRE.ring_radius, "layer_offset": y}
        axes[0].plot(
            np.degrees(phi),
            100.0 * full_strain(shape, **given),
            color=color,
            label=f"y = {1e3 * y:+.0f} mm",
        )
        axes[0].plot(np.degrees(phi), 100.0 * bending_strain(shape, **given), ":", color=color)
    axes[0].set(
        xlabel=label("wheel angle", "deg"),
        ylabel=label("strain; dotted: bending", "%"),
    )


def softening(axes: Panels) -> None:
    """Draw the load over the deflection with a sidewall that softens, (54)."""
    deflection = np.linspace(0.004, 0.04, 10)
    for rate, color in zip((0.0, -10.0, -20.0), sequence(3), strict=True):
        tire = StaticTire(
            ring_radius=TIRE.ring_radius,
            free_radius=TIRE.free_radius,
            bending_stiffness=20.0,
            radial_stiffness=TIRE.radial_stiffness,
            tread_stiffness=TIRE.tread_stiffness,
            softening=rate,
        )
        found = press_to_deflection(tire, deflection, nodes=121)
        axes[0].plot(1e3 * deflection, 1e-3 * found.load, color=color, label=f"B = {rate:g} 1/m")
    axes[0].set(xlabel=label("deflection", "mm"), ylabel=label("load", "kN"))


def elastic_parts(axes: Panels) -> None:
    """Draw what a radial wave that keeps the belt's length costs by (76), for three belts."""
    ring, n = Ring.of(TIRE, TIRE.pressure), np.arange(2, 31)
    for bending, color in zip((1.0, 4.0, 16.0), sequence(3), strict=True):
        matrix = modal_stiffness(replace(ring, bending_stiffness=bending), 59.0, 30)[0, 2:]
        follow = np.stack([np.ones(n.size), 1j / n, np.zeros(n.size)], axis=1)
        cost = np.einsum("ni,nij,nj->n", follow.conj(), matrix, follow).real
        axes[0].semilogy(n, 1e-6 * cost, ".-", color=color, label=f"EI = {bending:g} N m²")
    axes[0].set(xlabel="harmonic n", ylabel=label("stiffness to u", "N/mm²"))


def harmonics(axes: Panels) -> None:
    """Draw the stiffness of each harmonic, (85), at three inflations."""
    for bar, color in zip((1.0, 2.0, 3.0), sequence(3), strict=True):
        found = plain_stiffness(Ring.of(TIRE, 1e5 * bar), 20)[0]
        axes[0].semilogy(1e-6 * found, ".-", color=color, label=f"{bar:g} bar")
    axes[0].set(xlabel="harmonic n", ylabel=label("k_n", "N/mm²"))


def held_tread(axes: Panels) -> None:
    """Draw the stiffness of the rim with the tread held, (112), over that of the sidewall."""
    k_v = np.linspace(0.2, 1.0, 50) * TIRE.radial_stiffness
    for share, color in zip((0.5, 1.0, 1.5), sequence(3), strict=True):
        k_u = share * TIRE.radial_stiffness
        shift, turn = rim_stiffness(TIRE.ring_radius, k_u, k_v)
        axes[0].plot(1e-6 * k_v, 1e-3 * shift, color=color, label=f"k_u = {1e-6 * k_u:.2f} N/mm²")
    axes[1].plot(1e-6 * k_v, turn * np.pi / 180.0, color="k")
    axes[0].set(ylabel=label("S_v", "N/mm"))
    axes[1].set(ylabel=label("S_θ", "N m/deg"))
    for panel in axes:
        panel.set(xlabel=label("k_v", "N/mm²"))


def speed_shift(axes: Panels) -> None:
    """Draw how far the contact moves ahead with speed, which (113) reads from the strain."""
    speed = np.linspace(10.0, 150.0, 8) / 3.6
    for ratio, color in zip((0.0, 0.05, 0.1), sequence(3), strict=True):
        ring = replace(Ring.of(TIRE, TIRE.pressure), damping=ratio)
        middle = [
            radial.load(compliance(ring, v / TIRE.free_radius), Tread.of(TIRE), 4500.0).edges.mean()
            for v in speed
        ]
        moved = np.degrees(np.array(middle) - middle[0])
        axes[0].plot(3.6 * speed, moved, ".-", color=color, label=f"λ = {ratio:g}")
    axes[0].set(xlabel=label("speed", "km/h"), ylabel=label("shift of the contact", "deg"))


def at_a_load(axes: Panels) -> None:
    """Draw deflection and edges of the contact at a given load, (114)."""
    load = np.linspace(500.0, 7000.0, 14)
    for bar, color in zip((1.0, 1.32, 2.0), sequence(3), strict=True):
        ring = replace(Ring.of(TIRE, 1e5 * bar), damping=0.04)
        found = radial.load(compliance(ring, 59.0), Tread.of(TIRE), load)
        axes[0].plot(1e-3 * load, 1e3 * found.deflection, color=color, label=f"{bar:g} bar")
        for side in range(2):
            axes[1].plot(1e-3 * load, np.degrees(found.edges[:, side]), color=color)
    axes[0].set(ylabel=label("deflection", "mm"))
    axes[1].set(ylabel=label("edges: entry < 0 < exit", "deg"))
    for panel in axes:
        panel.set(xlabel=label("load", "kN"))


LAWS: dict[str, tuple[int, Callable[[Panels], None]]] = {
    "bridge": (2, bridge),
    "slip": (2, slip),
    "friction": (1, friction),
    "any_pressure": (2, any_pressure),
    "bristles": (1, bristles),
    "layers": (1, layers),
    "softening": (1, softening),
    "elastic_parts": (1, elastic_parts),
    "harmonics": (1, harmonics),
    "held_tread": (2, held_tread),
    "speed_shift": (1, speed_shift),
    "at_a_load": (2, at_a_load),
}
"""As `plots.PLOTS`."""
