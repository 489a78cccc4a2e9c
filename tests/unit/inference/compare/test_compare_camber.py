"""A force that camber shifts, which a model without camber lacks, is reported as a shift."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.inference.force_campaigns import brush_file, steady_runs, write_forces
from tirelib.campaign import Run
from tirelib.inference.compare.forces import ForceComparison, compare_forces
from tirelib.report.comparison import force_parts

LEAN = float(np.deg2rad(4.0))
THRUST = 150.0


def leaned() -> Iterator[Run]:
    """Yield cornering runs upright and leaned to both sides, whose thrust shifts Fy."""
    number = 0
    for side in (0.0, 1.0, -1.0):
        for run in steady_runs():
            size = run.rig["Fy"].size
            plan = replace(
                run.plan,
                run=number,
                file=f"runs/{number:03d}.mf4",
                camber=side * LEAN,
                start=12.0 * number,
            )
            rig = run.rig | {
                "camber": np.full(size, side * LEAN),
                "Fy": run.rig["Fy"] + side * THRUST,
            }
            yield replace(run, plan=plan, rig=rig)
            number += 1


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> ForceComparison:
    place: Path = tmp_path_factory.mktemp("lean")
    upright = write_forces(place / "upright", steady_runs(), "upright")
    return compare_forces(
        write_forces(place / "leaned", leaned(), "leaned"), brush_file(upright), "Fy"
    )


def test_the_shift_by_camber_stands_first_with_its_sign(found: ForceComparison) -> None:
    first = found.sentences[0]
    assert first.startswith("At camber 4 deg the model's Fy is shifted by -15"), first
    assert "the other way where it is negative" in first
    (cell,) = (each for each in found.table if each.by == "camber" and each.low > 0.0)
    assert cell.shift == pytest.approx(-THRUST, abs=10.0)
    assert abs(cell.excess) < 10.0  # in size both sides cancel


def test_the_plot_over_camber_does_not_cancel_the_two_sides(found: ForceComparison) -> None:
    plots = {plot.name: plot for part in force_parts(found) for plot in part.plots}
    rows = np.array(plots["force-trend-camber"].rows)
    assert rows[:, 0] == pytest.approx([-4.0, 0.0, 4.0])
    assert rows[:, 2] == pytest.approx([THRUST, 0.0, -THRUST], abs=10.0)
