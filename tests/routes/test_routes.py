"""Both routes as a document: angles with their bias, tables by method, damping by both laws."""

import json
from typing import Any

import numpy as np
import pytest
from routes.document import routes_document
from routes.dynamic_pressure import dynamic_pressure
from routes.follow import Routes, follow_routes
from routes.run import lines

from tests.routes.route_campaign import SERIES, runs, tire, tire_file
from tirelib.cli.common import plain

DAMPING = 0.08
# two speeds, and five loads at one of them
CONDITIONS = [SERIES[i] for i in range(3, 8)] + [(2600.0, 2.1, 15.0), (6000.0, 2.1, 130.0)]


@pytest.fixture(scope="module")
def routes() -> Routes:
    made = runs(tire(), CONDITIONS, damping=DAMPING)
    return follow_routes(made, tire_file(tire(), bending_stiffness=0.3))


@pytest.fixture(scope="module")
def document(routes: Routes) -> dict[str, Any]:
    return dict(json.loads(json.dumps(plain(routes_document(routes)), allow_nan=False)))


def test_the_bias_of_contact_angles_is_told_by_run(document: dict[str, Any]) -> None:
    rows = document["chapter_6"]["contact_angles"]
    assert [row["run"] for row in rows] == list(range(1, 8))
    for row in rows:
        read, true = (np.ptp(row[key]) / 2 for key in ("read_deg", "corrected_deg"))
        assert true - read == pytest.approx(-row["half_bias_deg"])
        assert 0.5 < true - read < 3.0, "read inside the edges, Fig. 6-12"
        assert row["half_bias_std_deg"] < true - read
        assert row["short_percent"] == pytest.approx(100.0 * (1.0 - read / true))


def test_loads_as_printed_stand_beside_corrected_ones(document: dict[str, Any]) -> None:
    rows = document["chapter_6"]["loads"]
    loads = [row["measured_N"] for row in rows]
    assert loads == sorted(loads)
    printed, corrected = (
        np.array([row[key] for row in rows]) for key in ("as_printed_percent", "corrected_percent")
    )
    told = document["chapter_6"]["load_error_percent"]
    assert np.sqrt(np.mean(printed**2)) == pytest.approx(told["as_printed"])
    assert np.sqrt(np.mean(corrected**2)) == pytest.approx(told["corrected"])
    assert told["corrected"] < told["as_printed"]


def test_pressure_by_method_carries_the_load(document: dict[str, Any]) -> None:
    """Fig. 5-22: what the strain says and what the contact model says, over one length."""
    rows = document["chapter_5"]["pressure"]
    assert len(rows) == 5
    for row in rows:
        x = 1e-3 * np.array(row["x_mm"])
        for key in ("from_strain_N_per_m", "from_contact_model_N_per_m"):
            carried = np.trapezoid(np.array(row[key], dtype=float), x)
            # a curve of 41 points; the static ring's load is known to a few percent
            assert carried == pytest.approx(row["load_N"], rel=0.15), key


def test_the_rolling_pressure_is_that_of_both_contacts(
    document: dict[str, Any], routes: Routes
) -> None:
    assert routes.dynamic is not None
    rows = document["chapter_6"]["pressure"]
    assert [row["contact"] for row in rows] == ["radial"] * 5 + ["sheared"] * 5
    row = rows[2]
    again = dynamic_pressure(
        routes.dynamic.values, row["load_N"], 1e5 * row["pressure_bar"], row["omega_rad_s"]
    )
    assert 1e3 * again.length[0] == pytest.approx(row["length_mm"])
    for row in rows:
        angle = np.deg2rad(np.array(row["angle_deg"]))
        carried = routes.dynamic.values["ring_radius"] * np.trapezoid(row["q_N_per_m"], angle)
        assert carried == pytest.approx(row["load_N"], rel=0.05)
        assert row["center_mm"] < 0.0, "damping moves the pressure toward the entry"


def test_damping_names_its_law_and_the_ratio_of_the_other(document: dict[str, Any]) -> None:
    damping = document["damping"]
    assert damping["law"] == "sidewall"
    assert damping["low"] < DAMPING < damping["high"]
    assert damping["readings"]["with_angle"] is not None
    modal = damping["modal"]["without_angle"]
    # the modal law damps bending and tension too: a several times smaller ratio, the same shift
    assert 0.1 * damping["value"] < modal["value"] < 0.5 * damping["value"]


def test_the_program_prints_each_run_and_both_laws_of_damping(document: dict[str, Any]) -> None:
    printed = list(lines(document))
    table = printed[4:11]
    assert [int(line.split()[0]) for line in table] == [
        row["run"] for row in document["chapter_6"]["loads"]
    ]
    for line, load in zip(table, document["chapter_6"]["loads"], strict=True):
        assert line.endswith(f"{load['corrected_percent']:+.1f}")
    said = "\n".join(printed[11:])
    modal = document["damping"]["modal"]["without_angle"]
    for value in (document["damping"]["value"], modal["value"]):
        assert f"{value:.3f}, 95 %" in said
