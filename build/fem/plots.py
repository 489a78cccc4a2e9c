"""Plots of the reference, to be looked at."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from against_ring import GRID, Curves
from cases import LOADS
from fields import State

COLORS = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(LOADS)))
EARLIER = {
    0.5: (6715.0, 9685.0, 10387.0, 10405.0, 10326.0),
    0.0: (7009.0, 10209.0, 10849.0, 10685.0, 10397.0),
}
"""Centre tension [microstrain] that an earlier study of such a tire found, by friction."""


def mirrored(
    phi: np.ndarray, value: np.ndarray, sign: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Both halves of the section, in degrees."""
    angle = np.degrees(np.concatenate([-phi[::-1], phi]))
    return angle, np.concatenate([sign * value[::-1], value])


def strains(path: Path, found: dict[str, list[State]]) -> None:
    """Innerliner strain with friction above and without below, as in Fig. 5-25."""
    fig, axes = plt.subplots(2, 1, sharex=True, sharey=True, figsize=(7, 8), layout="constrained")
    for ax, (name, title) in zip(
        axes, (("solid_mu050", "friction 0.5"), ("solid_mu000", "friction 0")), strict=True
    ):
        for s, load, color in zip(found[name], LOADS, COLORS, strict=True):
            ax.plot(*mirrored(s.phi, 1e6 * s.strain), color=color, label=f"{load:.0f} N")
        ax.set(title=title, ylabel="innerliner strain [µε]", xlim=(-45, 45))
        ax.grid(alpha=0.3)
        ax.legend()
    axes[1].set_xlabel("wheel angle [deg]")
    fig.savefig(path, dpi=120)
    plt.close(fig)


def tractions(path: Path, found: dict[str, list[State]]) -> None:
    """Pressure and shear over the road, with and without friction."""
    fig, axes = plt.subplots(3, 1, sharex=True, figsize=(7, 9), layout="constrained")
    for s, f, load, color in zip(
        found["solid_mu050"], found["solid_mu000"], LOADS, COLORS, strict=True
    ):
        bottom = s.phi_tread < 0.8
        x = 1e3 * s.x[bottom]
        axes[0].plot(x, s.pressure[bottom] / 1e3, color=color, label=f"{load:.0f} N")
        axes[1].plot(1e3 * f.x[bottom], f.pressure[bottom] / 1e3, color=color)
        axes[2].plot(x, s.shear[bottom] / 1e3, color=color)
        axes[2].plot(x, -0.5 * s.pressure[bottom] / 1e3, color=color, ls=":", lw=0.8)
    axes[0].set(title="friction 0.5", ylabel="pressure [kN/m]", xlim=(0, 110))
    axes[1].set(title="friction 0", ylabel="pressure [kN/m]")
    axes[2].set(
        title="friction 0.5; dotted: sliding limit",
        ylabel="road on tire, outward [kN/m]",
        xlabel="place on the road [mm]",
    )
    axes[0].legend()
    for ax in axes:
        ax.grid(alpha=0.3)
    fig.savefig(path, dpi=120)
    plt.close(fig)


def tensions(path: Path, found: dict[str, list[State]], ring: Curves) -> None:
    """Tension at the centre over the load: every case, the ring, the earlier study."""
    fig, ax = plt.subplots(figsize=(7.5, 5.5), layout="constrained")
    for name, loaded in found.items():
        style = {"mu000": "-", "mu050": "--", "mu100": ":"}[name.split("_")[1]]
        color = {"solid": "C0", "blocks": "C1", "stretchy": "C2"}[name.split("_")[0]]
        ax.plot(
            LOADS,
            [1e6 * s.beam_strain[0] for s in loaded],
            style,
            color=color,
            marker="o",
            label=name.replace("_mu", ", friction ")
            .replace("000", "0")
            .replace("050", "0.5")
            .replace("100", "1"),
        )
    ax.plot(
        LOADS, 1e6 * ring.strain[:, 0], "k-s", mfc="none", label="ring with tension, friction 0"
    )
    for friction, values in EARLIER.items():
        ax.plot(LOADS, values, "x", color="C3", label=f"earlier study, friction {friction:g}")
    ax.set(xlabel="vertical load [N]", ylabel="tension at the centre [µε]", ylim=(5000, None))
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    fig.savefig(path, dpi=120)
    plt.close(fig)


def rings(path: Path, models: dict[str, tuple[list[State], Curves]]) -> None:
    """Strain and pressure of the frictionless finite elements and of the rings."""
    fig, axes = plt.subplots(2, len(models), sharex=True, figsize=(11, 8), layout="constrained")
    for column, (title, (loaded, ring)) in zip(axes.T, models.items(), strict=True):
        for k, (s, color) in enumerate(zip(loaded, COLORS, strict=True)):
            near = s.phi < 0.8
            label = f"{s.load:.0f} N"
            column[0].plot(
                np.degrees(s.phi[near]), 1e6 * s.beam_strain[near], color=color, label=label
            )
            column[0].plot(np.degrees(GRID), 1e6 * ring.strain[k], "--", color=color)
            near = s.phi_tread < 0.8
            column[1].plot(np.degrees(s.phi_tread[near]), s.pressure[near] / 1e3, color=color)
            column[1].plot(np.degrees(GRID), ring.pressure[k] / 1e3, "--", color=color)
        column[0].set(title=f"Ring {title} (dashed), finite elements (full)")
        column[0].set(ylabel="innerliner strain [µε]")
        column[0].legend()
        column[1].set(xlabel="wheel angle [deg]", ylabel="pressure [kN/m]")
        for ax in column:
            ax.grid(alpha=0.3)
    fig.savefig(path, dpi=120)
    plt.close(fig)
