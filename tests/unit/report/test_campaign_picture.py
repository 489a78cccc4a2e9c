"""The picture of a campaign shows loads against their set points, and samples in shown units."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes

from tests.synthetic import header, synthetic_run
from tirelib.campaign import Run
from tirelib.campaign.overview import run_row
from tirelib.report.campaign_overview import overview_figure

TIME = np.arange(200) / 100.0


def right_panel(runs: list[Run]) -> tuple[Axes, np.ndarray]:
    """Return the panel of the forces, and its points, (n, 2)."""
    alone = [replace(run, strain=None, trigger=None) for run in runs]
    figure = overview_figure(header(), [run_row(run) for run in alone], alone)
    panel = figure.axes[1]
    return panel, np.asarray(panel.collections[0].get_offsets())


def test_a_load_above_its_set_point_stands_above_zero() -> None:
    loads, above = np.array([2e3, 4e3, 6e3]), np.array([0.5, -0.25, 0.25])
    runs = [
        replace(synthetic_run(k, load=load), rig={"Fz": np.full(9, load * (1.0 + 0.01 * more))})
        for k, (load, more) in enumerate(zip(loads, above, strict=True))
    ]
    panel, points = right_panel(runs)
    assert panel.get_ylabel() == "measured / set point - 1 [%]"
    np.testing.assert_allclose(points, np.stack([loads, above], axis=1), rtol=1e-3)


def test_samples_of_a_sweep_are_drawn_in_degrees() -> None:
    angle = np.deg2rad(6.0) * np.sin(3.0 * TIME)
    rig = {"Fz": np.full(200, 4e3), "slip_angle": angle, "Fy": -3e4 * angle}
    run = replace(synthetic_run(0, kind="sweep"), rig=rig, rig_time=TIME)
    panel, points = right_panel([run])
    assert panel.get_xlabel() == "slip angle [deg]"
    assert np.abs(points[:, 0]).max() == pytest.approx(6.0, abs=0.05)
    np.testing.assert_allclose(points[:, 1], -3e4 * np.deg2rad(points[:, 0]))
