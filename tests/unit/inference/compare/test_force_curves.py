"""Curves of a force: set points, best and worst, and the page's figures with their data."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tirelib.inference.compare.document import comparison_document
from tirelib.inference.compare.error import last_floor
from tirelib.inference.compare.force_curves import curves_of, ranked
from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.identify.force_data import ForceData
from tirelib.report.comparison import force_parts

ANGLES = np.deg2rad([-4.0, -2.0, 0.0, 2.0, 4.0])
EXCESS = {2000.0: 0.0, 4000.0: 0.02, 6000.0: 0.1}


def comparison(noise: float = 5.0) -> ForceComparison:
    """Return a model whose size is too large by a share that grows with load."""
    load = np.repeat(list(EXCESS), ANGLES.size)
    angle = np.tile(ANGLES, len(EXCESS))
    flat, unknown = np.zeros(load.size), np.full(load.size, np.nan)
    measured = -5.0 * load * angle
    data = ForceData(
        load,
        np.full(load.size, 2.1e5),
        angle,
        flat,
        flat,
        unknown,
        unknown,
        measured,
        unknown,
        np.arange(load.size),
    )
    share = np.array([EXCESS[value] for value in load])
    predicted = measured * (1.0 + share)
    rms = float(np.sqrt(np.mean((predicted - measured) ** 2)))
    return ForceComparison(
        "Fy",
        "made",
        "model",
        data,
        np.arange(load.size),
        measured,
        predicted,
        noise,
        3,
        rms / noise,
        rms,
        1.0,
        0.0,
        "lack_of_fit",
        (),
        (),
        (),
    )


def test_curves_are_set_points_in_the_order_of_their_difference() -> None:
    curves = curves_of(comparison())
    assert [curve.words for curve in curves] == ["2,000 N", "4,000 N", "6,000 N"]
    assert [curve.points for curve in curves] == [5, 5, 5]
    assert curves[0].rms == 0.0
    wanted = 0.1 * 5.0 * 6000.0 * np.sqrt(np.mean(ANGLES**2))
    assert curves[2].rms == pytest.approx(wanted)
    assert [curve.words for curve in ranked(curves).values()] == ["2,000 N", "4,000 N", "6,000 N"]
    assert list(ranked(curves[:1])) == ["best"]
    assert ranked(()) == {}


def test_few_points_make_no_curve_and_unknown_pressure_is_no_fault() -> None:
    made = comparison()
    few = replace(made, data=replace(made.data, load=1000.0 * 1.3 ** np.arange(15.0)))
    assert all(curve.points >= 3 for curve in curves_of(few))
    bare = replace(made, data=replace(made.data, pressure=np.full(15, np.nan)))
    assert len(curves_of(bare)) == 3


def test_the_floor_is_of_the_same_force() -> None:
    said = (("strain", 7.0), ("Fy", 3.0), ("Fy", 2.0), ("Mz", 5.0))
    history: list[dict[str, Any]] = [
        {"quantity": q, "floor": floor, "data_sha256": "hash"} for q, floor in said
    ]
    del history[0]["quantity"]
    assert last_floor(history, "Fy", "hash") == 2.0
    assert last_floor(history, "strain", "hash") == 7.0
    assert np.isnan(last_floor(history, "Fx", "hash"))
    assert np.isnan(last_floor(history, "Fy", "other"))
    made = replace(comparison(), floor=2.0)
    assert comparison_document(made)["floor"] == 2.0
    assert (
        "explain an error of 2 (the floor, from the last entry for Fy" in force_parts(made)[0].text
    )
    assert "states no floor for Fy" in force_parts(comparison())[0].text


def test_json_has_the_curves() -> None:
    found = comparison_document(comparison())
    assert found["ranked"] == {"best": "2,000 N", "median": "4,000 N", "worst": "6,000 N"}
    assert found["curves"][2]["pressure"] == pytest.approx(2.1)
    assert found["curves"][2]["rms_noise"] == pytest.approx(found["curves"][2]["rms"] / 5.0)


def test_every_figure_has_units_and_data_and_the_map_is_in_noise() -> None:
    plots = {plot.name: plot for part in force_parts(comparison()) for plot in part.plots}
    assert {
        "force-map",
        "force-best",
        "force-median",
        "force-worst",
        "force-trend-load",
        "force-trend-slip-angle",
    } <= set(plots)
    for plot in plots.values():
        assert plot.rows, plot.name
        assert {len(row) for row in plot.rows} == {len(plot.columns)}, plot.name
        assert "[" in ",".join(plot.columns), plot.name
    heat = plots["force-map"].figure.data[0]
    z = np.array(heat.z)
    # rows by rising load, columns by slip angle; at -4 deg Fy is positive and too large
    assert z[2, 0] == pytest.approx(0.1 * 5.0 * 6000.0 * ANGLES[-1] / 5.0, rel=1e-3)
    assert z[2, -1] == pytest.approx(-z[2, 0])
    assert z[0, 0] == 0.0
    assert heat.zmin == -heat.zmax
    without = {p.name: p for part in force_parts(comparison(np.nan)) for p in part.plots}
    assert "[N]" in without["force-map"].columns[1]


def test_trends_over_load_are_of_sizes_so_that_both_signs_do_not_cancel() -> None:
    plots = {plot.name: plot for part in force_parts(comparison()) for plot in part.plots}
    rows = np.array(plots["force-trend-load"].rows)
    size = 5.0 * np.mean(np.abs(ANGLES))
    wanted = [share * load * size for load, share in EXCESS.items()]
    np.testing.assert_allclose(rows[:, 2], wanted, atol=1e-4)
