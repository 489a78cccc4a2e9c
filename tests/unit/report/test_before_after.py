"""What is drawn of two models side by side: the same runs, one scale, the order of measurement."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from tirelib.inference.compare.sectors import SECTORS
from tirelib.inference.compare.tracks import Track
from tirelib.report.figures.before_after import _paired, run_errors
from tirelib.report.figures.compare_plot import Plot
from tirelib.report.figures.compare_trends import run_means, set_point_plot, track_plots

LOADS = {1: 6000.0, 2: 2000.0, 3: 4000.0}


def step(order: list[int], size: float) -> dict[str, Any]:
    """Return a step's runs in some order: run k has `size` times k before and a tenth after."""
    return {
        "runs": [
            {
                "run": k,
                "load": LOADS[k],
                "error_before": size * k,
                "error_after": 0.1 * size * k,
                "held_out": [
                    {"error_before": 2.0 * size * k, "error_after": 0.2 * size * k}
                    for _ in range(k > 1)
                ],
            }
            for k in order
        ]
    }


def test_a_run_keeps_its_errors_whatever_the_order_of_the_steps() -> None:
    """Before: the first step's; after: the last one's; by load."""
    (plot,) = run_errors([step([1, 2, 3], 10.0), step([3, 1, 2], 5.0)], "noise")
    assert [row[0] for row in plot.rows] == ["run 2: 2000 N", "run 3: 4000 N", "run 1: 6000 N"]
    before, after, out_before, out_after = np.array(plot.rows, dtype=object)[:, 1:].T.tolist()
    assert [float(x) for x in before] == [20.0, 30.0, 10.0]
    assert np.allclose([float(x) for x in after], [1.0, 1.5, 0.5])
    assert [x and float(x) for x in out_before[:2]] == [40.0, 60.0]
    assert np.allclose([float(x) for x in out_after[:2]], [2.0, 3.0])
    assert not out_before[2]


def test_two_maps_have_one_scale_and_it_holds_both() -> None:
    for limits in ((1.0, 3.0), (3.0, 1.0)):
        maps = [go.Figure(go.Heatmap(z=[[0.0]], zmin=-x, zmax=x)) for x in limits]
        pair = [[Plot.of("map", "map", "", each, {"a": [1]})] for each in maps]
        drawn = [plot.figure.data[0] for plot in _paired(pair)]
        assert [(scale.zmin, scale.zmax) for scale in drawn] == [(-3.0, 3.0)] * 2


def test_set_points_stand_in_the_order_of_measurement() -> None:
    scaled = np.arange(12.0).reshape(3, 4)
    found: Any = SimpleNamespace(
        chosen=SimpleNamespace(waves=SimpleNamespace(start=np.array([20.0, 0.0, 10.0]))),
        run=np.array([7, 8, 9]),
        points=SimpleNamespace(scaled=scaled, value=1e-3 * scaled),
    )
    plot = set_point_plot(found)
    assert [int(row[0]) for row in plot.rows] == [8, 9, 7]
    load = plot.figure.data[0]
    assert (list(load.customdata), list(load.y)) == ([8, 9, 7], [4.0, 8.0, 0.0])


def test_the_mean_of_a_sector_is_over_its_own_angles() -> None:
    sector = np.array([[0, 0, 0, 1, 5, 5], [0, 1, 1, 1, 1, 2]])
    found: Any = SimpleNamespace(sector=sector, difference=3.0 + sector)
    means = run_means(found)
    assert means.shape == (2, len(SECTORS))
    for run, row in enumerate(means):
        here = np.isin(np.arange(len(SECTORS)), sector[run])
        np.testing.assert_array_equal(row, np.where(here, 3.0 + np.arange(len(SECTORS)), np.nan))


def test_bars_hold_95_percent_of_noise_and_set_points() -> None:
    std, noise = np.array([3e-4, 0.0, 6e-4]), 4e-4
    length = np.array([0.10, 0.12, 0.14])
    track = Track("contact length", "mm", 1e3, length, length + 1e-3, std, noise, 5)
    straight = np.ones(3, dtype=bool)
    found: Any = SimpleNamespace(
        tracks=[track],
        run=np.arange(3),
        chosen=SimpleNamespace(
            straight=straight,
            factors=(),
            waves=SimpleNamespace(conditions={"Fz": np.array([2e3, 4e3, 6e3])}),
        ),
    )
    (plot,) = track_plots(found)
    measured, _, apart = plot.figure.data[:3]
    assert measured.error_y.value == 1.96 * 1e3 * noise
    np.testing.assert_allclose(apart.error_y.array, 1.96e3 * np.hypot(std, noise))
    np.testing.assert_allclose(apart.y, 1.0)
