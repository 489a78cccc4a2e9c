"""Drawings of the sign conventions: ``python build/conventions.py`` writes docs/reference/signs.

The signs themselves come from `tirelib.core.axes`; the drawings show one and the same situation in
each axis system.
"""

from pathlib import Path

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, FancyBboxPatch

from tirelib.core.axes import FLIPPED, sign
from tirelib.core.threads import one_thread

OUT = Path(__file__).resolve().parent.parent / "docs/reference/signs"
NAMES = {
    "iso": "iso (ISO 8855, TYDEX W)",
    "sae": "sae (SAE J670)",
    "adapted_sae": "adapted_sae (Pacejka)",
}
GREY, BLUE, RED, GREEN = "0.35", "tab:blue", "tab:red", "tab:green"


def arrow(
    ax: Axes, start: tuple[float, float], way: tuple[float, float], colour: str, text: str
) -> None:
    """Draw an arrow with its name at the head."""
    end = (start[0] + way[0], start[1] + way[1])
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2})
    length = float(np.hypot(*way))
    ax.text(
        end[0] + 0.16 * way[0] / length,
        end[1] + 0.16 * way[1] / length,
        text,
        color=colour,
        ha="center",
        va="center",
    )


def frame(ax: Axes, title: str, half: float = 1.7) -> None:
    """Make an empty, square drawing."""
    ax.set(xlim=(-half, half), ylim=(-half, half), title=title, aspect="equal")
    ax.axis("off")


def signed(name: str, quantity: str, iso: float, axes: str) -> str:
    """Return the name with its sign in this axis system."""
    return f"{name} {'>' if iso * sign(quantity, axes) > 0 else '<'} 0"


def slip_angle() -> plt.Figure:
    """Draw a wheel from above that moves to the left of where it points."""
    figure, panels = plt.subplots(1, 3, figsize=(11, 4.2))
    for ax, axes in zip(panels, FLIPPED, strict=True):
        frame(ax, NAMES[axes])
        ax.add_patch(FancyBboxPatch((-0.25, -0.7), 0.5, 1.4, "round,pad=0.05", fc="0.9", ec=GREY))
        angle = np.deg2rad(25)
        arrow(ax, (0, 0), (-1.35 * np.sin(angle), 1.35 * np.cos(angle)), BLUE, "v")
        ax.plot([0, 0], [0, 1.35], color=GREY, lw=1, ls="--")
        ax.add_patch(Arc((0, 0), 1.9, 1.9, theta1=90, theta2=115, color=BLUE))
        ax.text(-0.75, 1.45, signed(r"$\alpha$", "slip_angle", 1, axes), color=BLUE, ha="right")
        arrow(ax, (0, -0.1), (1.0, 0), RED, "")
        ax.text(1.08, -0.1, signed("$F_y$", "Fy", -1, axes), color=RED, va="center")
        left = sign("lateral", axes)
        arrow(ax, (-1.0 * left, -1.35), (0, 0.5), GREEN, "x")
        arrow(ax, (-1.0 * left, -1.35), (-0.5 * left, 0), GREEN, "y")
        z = "z up (towards you)" if axes == "iso" else "z down (away from you)"
        if axes == "adapted_sae":
            z = "loads positive all the same"
        ax.text(0, -1.68, f"{z}; {signed('$F_z$', 'Fz', 1, axes)}", ha="center", color=GREEN)
    figure.suptitle(
        "The same wheel from above: it points up the page and moves to the left of that"
    )
    figure.tight_layout()
    return figure


def camber_and_gages() -> plt.Figure:
    """Draw a wheel from behind: camber; and the order of the gages for each axis system."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), width_ratios=(1, 1.6))
    frame(left, "camber, seen from behind")
    lean = np.deg2rad(14)
    side, up = np.array([np.cos(lean), -np.sin(lean)]), np.array([np.sin(lean), np.cos(lean)])
    foot = np.array([0.0, -1.1])
    corners = [foot - 0.3 * side, foot + 0.3 * side, foot + 0.3 * side + 2.1 * up]
    corners += [foot - 0.3 * side + 2.1 * up, foot - 0.3 * side]
    left.plot(*np.transpose(corners), color=GREY, lw=2)
    left.plot([-1.6, 1.6], [-1.13, -1.13], color="k", lw=1)
    left.plot([0, 0], [-1.1, 1.4], color=GREY, ls="--", lw=1)
    left.plot(*np.transpose([foot, foot + 2.5 * up]), color=BLUE, ls="--", lw=1)
    left.text(0.85, 1.35, r"$\gamma$ > 0 in all three", color=BLUE, ha="center")
    left.text(0, -1.5, "top of the wheel to the right", ha="center")
    right.set(xlim=(-135, 95), ylim=(-1.1, 3.5), title="gages in the tire, seen from behind")
    right.axis("off")
    for row, axes in enumerate(FLIPPED):
        height = 2.6 - 1.2 * row
        right.plot([-80, 80], [height, height], color=GREY, lw=6, alpha=0.3)
        for place, y in enumerate((-60, -30, 0, 30, 60)):
            at = -y * sign("lateral", axes)  # drawn from behind: left of the vehicle is left
            right.plot(at, height, "s", color=RED)
            right.text(at, height + 0.17, f"{place + 1}", ha="center", color=RED)
            right.text(at, height - 0.42, f"{y:+d}" if y else "0", ha="center", color=GREEN)
        right.text(-98, height, NAMES[axes].split()[0], ha="right", va="center")
    right.text(
        0, -0.75, "red: strain_N; green: lateral_m in mm, as written in the file", ha="center"
    )
    right.text(-86, -1.1, "left of the vehicle", ha="left")
    right.text(86, -1.1, "right of the vehicle", ha="right")
    figure.tight_layout()
    return figure


def wheel_angle() -> plt.Figure:
    """Draw wheels from the side: the wheel angle of a gage, and the slip ratio."""
    figure, panels = plt.subplots(1, 3, figsize=(11, 4.2))
    contact = np.deg2rad(22)
    for ax, title in zip(
        panels, ("wheel angle", r"braking: $\kappa$ < 0", r"driving: $\kappa$ > 0"), strict=True
    ):
        frame(ax, title)
        ax.plot([-1.6, 1.6], [-0.93, -0.93], color="k", lw=1)
        ax.add_patch(Circle((0, 0), 1, fc="none", ec=GREY, lw=2))
        arrow(ax, (0, 0), (1.25, 0), BLUE, "")
        ax.text(1.3, 0.12, "v, x", color=BLUE)
        ax.add_patch(Arc((0, 0), 0.7, 0.7, theta1=100, theta2=190, color=GREY))
        ax.annotate(
            "",
            (0.02, 0.35),
            (-0.1, 0.335),
            arrowprops={"arrowstyle": "-|>", "color": GREY},
        )
        ax.text(-0.3, 0.42, r"$\Omega$", color=GREY, ha="right")
    ax = panels[0]
    for angle, colour in ((-contact, RED), (contact, RED)):
        ax.plot([0, -np.sin(angle)], [0, -np.cos(angle)], color=colour, lw=1)
    ax.plot([0, 0], [0, -1.0], color=GREY, ls="--", lw=1)
    ax.text(0.42, -1.12, r"leading edge, $\varphi$ < 0", color=RED, fontsize=9)
    ax.text(-0.42, -1.12, r"trailing edge, $\varphi$ > 0", color=RED, ha="right", fontsize=9)
    ax.text(0, -1.4, r"$\varphi$ = 0 under the axle, grows with time", ha="center")
    ax.plot(np.sin(0.9), -np.cos(0.9), "s", color=GREEN)
    ax.text(np.sin(0.9) + 0.1, -np.cos(0.9), "gage", color=GREEN, va="center")
    arrow(panels[1], (0, -0.93), (-0.9, 0), RED, "")
    panels[1].text(-1.6, -1.22, "$F_x$ < 0", color=RED)
    arrow(panels[2], (0, -0.93), (0.9, 0), RED, "")
    panels[2].text(0.8, -1.22, "$F_x$ > 0", color=RED)
    for ax, text in ((panels[1], r"$\Omega R_e < v$"), (panels[2], r"$\Omega R_e > v$")):
        ax.text(0, -1.55, text + r",   $\kappa = (\Omega R_e - v) / v$", ha="center")
    figure.suptitle(
        "From the right-hand side of the vehicle, which drives to the right of the page"
    )
    figure.tight_layout()
    return figure


def main() -> None:
    """Write the drawings."""
    OUT.mkdir(parents=True, exist_ok=True)
    plt.rcParams["font.size"] = 11
    for draw in (slip_angle, camber_and_gages, wheel_angle):
        draw().savefig(OUT / f"{draw.__name__}.png", dpi=100)


if __name__ == "__main__":
    with one_thread():
        main()
