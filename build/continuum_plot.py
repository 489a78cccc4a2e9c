"""Draw the strain of the rolling continuum and of the numerical rig over the wheel angle.

python build/continuum_plot.py    writes docs/theory/continuum.png
"""

import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from continuum.observe import trace
from continuum.solve import model, solve
from continuum.tire import Condition, Tire

from tirelib.core.threads import one_thread
from tirelib.rig.observe import trace as rig_trace
from tirelib.rig.solve import solve as rig_solve
from tirelib.rig.tire import Condition as RigCondition
from tirelib.rig.tire import RigTire

ROOT = Path(__file__).resolve().parents[1]
LOADS = (2500.0, 4500.0, 6500.0)
PRESSURE, SPEED = 2.2e5, 65.0 / 3.6


def main() -> None:
    """Solve both at three loads, and draw."""
    figure, panels = plt.subplots(2, 2, figsize=(11.0, 7.0), sharex="col")
    plain, gripping = model(Tire()), None
    gripping = replace(plain, tire=replace(plain.tire, friction=0.6))
    state = grips = rig = None
    for load, color in zip(LOADS, ("tab:blue", "tab:orange", "tab:green"), strict=True):
        state = solve(plain, Condition(load, PRESSURE, SPEED), state)
        grips = solve(gripping, Condition(load, PRESSURE, SPEED), grips or state)
        tire = replace(RigTire(), friction=0.0, sidewall_damping=0.0)
        rig = rig_solve(tire, RigCondition(load, PRESSURE, SPEED), rig)
        at, on, rigs = trace(state), trace(grips), rig_trace(rig)
        name = f"{load / 1e3:.1f} kN"
        for gage, style in ((2, "-"), (0, ":")):
            label = name if gage == 2 else None
            panels[0, 0].plot(np.degrees(at.phi), 1e6 * at.strain[:, gage], style, color=color)
            panels[1, 0].plot(
                np.degrees(rigs.phi), 1e6 * rigs.strain[:, gage], style, color=color, label=label
            )
        line = state.model.mesh.surface
        angle = np.degrees(line.phi.reshape(3, -1)[0])
        for solved, style in ((state, "-"), (grips, "--")):
            road = solved.balance.road
            panels[0, 1].plot(angle, 1e-5 * road.q.reshape(3, -1)[0], style, color=color)
        panels[1, 1].plot(np.degrees(on.phi), 1e6 * (on.strain - at.strain)[:, 2], color=color)
    titles = (
        ("continuum: strain, center (full) and shoulder (dotted)", "microstrain"),
        ("continuum: middle pressure, friction 0 (full) and 0.6 (dashed)", "bar"),
        ("numerical rig: the same of its own tire", "microstrain"),
        ("continuum: what friction 0.6 does to the strain at the center", "microstrain"),
    )
    for panel, (title, unit) in zip(panels.ravel(), titles, strict=True):
        panel.set_title(title, fontsize=10)
        panel.set_ylabel(unit)
        panel.grid(alpha=0.3)
    panels[1, 0].legend()
    panels[1, 0].set_xlim(-75.0, 75.0)
    panels[1, 1].set_xlim(-25.0, 25.0)
    for panel in panels[1]:
        panel.set_xlabel("wheel angle [deg], 0 under the axle")
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "theory" / "continuum.png", dpi=90)


if __name__ == "__main__":
    with one_thread():
        main()
