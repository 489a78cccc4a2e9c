"""The simulation behind `tirelib simulate`: anchors, balance, refusals, files."""

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.parameters import Tire, read_tire
from tirelib.report.simulation import LARGEST_BELT_SPEED, Simulation, simulate
from tirelib.report.simulation_document import columns, point_document, write_curves

TIRE = read_tire("table-6-1").tire
CONTACTS = pytest.mark.parametrize("contact", ["radial", "shear"])


@pytest.fixture(scope="module")
def rolling() -> Simulation:
    return simulate(TIRE, deflection=[0.025, 0.035, 0.045], turn_rate=59.0)


@pytest.mark.parametrize(
    ("damping", "turn_rate", "deflection", "edges", "load", "middle", "largest", "centre"),
    [
        (0.0, 0.0, 0.025, (-0.2380, 0.2380), 5127.5, 40777, 41331, 0.0),
        (0.0, 59.0, 0.025, (-0.2380, 0.2380), 5127.5, 40777, 41331, 0.0),
        (0.04, 59.0, 0.025, (-0.2413, 0.2347), 5128.7, 40787, 41812, -1.44),
        (0.09, 59.0, 0.025, (-0.2454, 0.2305), 5133.7, 40828, 42489, -3.24),
        (0.04, 59.0, 0.035, (-0.3144, 0.3070), 7946.1, 48534, 48549, -1.68),
        (0.04, 59.0, 0.045, (-0.3827, 0.3748), 11176.6, 56932, 56940, -1.86),
    ],
)
def test_table_6_1_gives_the_anchors_of_an_independent_solver(
    damping: float,
    turn_rate: float,
    deflection: float,
    edges: tuple[float, float],
    load: float,
    middle: float,
    largest: float,
    centre: float,
) -> None:
    """Tolerances: the last digit that is given."""
    tire = TIRE.changed(damping=damping)
    found = point_document(simulate(tire, deflection=deflection, turn_rate=turn_rate), 0)
    assert found["edges_rad"] == pytest.approx(edges, abs=1e-4)
    assert found["Fz_N"] == pytest.approx(load, abs=0.2)
    assert found["q_center_N_per_m"] == pytest.approx(middle, abs=5.0)
    assert found["q_max_N_per_m"] == pytest.approx(largest, abs=5.0)
    assert found["pressure_center_mm"] == pytest.approx(centre, abs=0.01)


@CONTACTS
def test_the_road_carries_the_load_along_its_normal(contact: str) -> None:
    """Trapezoidal rule over the kinks at the edges: 1e-3."""
    done = simulate(TIRE, load=[1500.0, 4500.0, 7500.0], turn_rate=59.0, contact=contact)
    np.testing.assert_allclose(done.load, [1500.0, 4500.0, 7500.0], rtol=1e-6)
    carried = TIRE.ring_radius * np.trapezoid(done.normal, done.phi, axis=1)
    np.testing.assert_allclose(carried, done.load, rtol=1e-3)


@CONTACTS
def test_load_and_deflection_are_each_others_inverse(contact: str) -> None:
    by_load = simulate(TIRE, load=4000.0, turn_rate=59.0, contact=contact)
    back = simulate(TIRE, deflection=by_load.deflection, turn_rate=59.0, contact=contact)
    assert back.load[0] == pytest.approx(4000.0, rel=1e-6)


@CONTACTS
def test_strain_rate_is_the_slope_of_strain_and_the_belt_keeps_its_length(contact: str) -> None:
    done = simulate(TIRE, load=4000.0, turn_rate=59.0, contact=contact)
    # the rate has kinks, so it is summed up: by the trapezoidal rule, h^2/8 of each kink's bend
    step = done.phi[1] - done.phi[0]
    summed = np.cumsum(0.5 * step * (done.rate[0, 1:] + done.rate[0, :-1]))
    np.testing.assert_allclose(
        summed, done.strain[0, 1:] - done.strain[0, 0], atol=3e-3 * np.ptp(done.strain)
    )
    stretch = done.u[0] + np.gradient(done.v[0], done.phi)
    np.testing.assert_allclose(stretch[1:-1], 0.0, atol=2e-3 * np.abs(done.u).max())


def test_radial_traction_is_the_pressure_seen_from_the_road(rolling: Simulation) -> None:
    """It points to the axle: up, and toward the middle of the contact."""
    np.testing.assert_allclose(np.hypot(rolling.normal, rolling.shear), rolling.pressure, atol=1e-6)
    entry = (rolling.pressure > 0.0) & (rolling.phi < 0.0)
    assert (rolling.shear[entry] > 0.0).all()
    assert (rolling.normal[rolling.pressure > 0.0] > 0.0).all()


def test_a_slippery_tread_feels_the_road_along_its_normal_only() -> None:
    """Without friction the pressure stands on the belt, which the road has made flat.

    A radial pressure of the same size would have q sin(phi) along the road; the belt is
    flat to 4 % of that where the pressure is above half of its largest.
    """
    done = simulate(TIRE.changed(friction=0.0), load=4500.0, contact="shear")
    inside = (done.pressure > 0.5 * done.pressure.max()) & (np.abs(done.phi) > 0.02)
    along = np.abs(done.shear[inside])
    radial = (done.pressure * np.abs(np.sin(done.phi)))[inside]
    assert along.sum() < 0.1 * radial.sum()


def test_the_belt_is_flattened_below_and_the_entry_lies_forward(rolling: Simulation) -> None:
    x, z = rolling.belt()
    below = np.argmin(np.abs(rolling.phi))
    entry = np.argmin(np.abs(rolling.phi[:, None] - rolling.edges[:, 0]), axis=0)
    assert (np.diff(z[:, below]) > 0.0).all()
    assert (x[np.arange(3), entry] > 0.05).all()


def test_peaks_stand_in_their_order(rolling: Simulation) -> None:
    peaks = rolling.peaks
    order = (
        peaks.cp1_angle,
        rolling.edges[:, 0],
        peaks.rate_lead_angle,
        peaks.tp_angle,
        peaks.rate_trail_angle,
        rolling.edges[:, 1],
        peaks.cp2_angle,
    )
    assert (np.diff(np.stack(order), axis=0) > 0.0).all()
    assert (peaks.cp1 < 0.0).all()
    assert (peaks.tp > 0.0).all()
    assert (peaks.rate_lead > 0.0).all()
    assert (peaks.rate_trail < 0.0).all()


def test_inflation_is_the_tires_own_by_default() -> None:
    own = simulate(TIRE, load=4000.0)
    stated = simulate(TIRE, load=4000.0, inflation=1.32e5)
    assert own.inflation[0] == pytest.approx(1.32e5)
    np.testing.assert_allclose(own.strain, stated.strain)
    assert simulate(TIRE, load=4000.0, inflation=2e5).deflection[0] < own.deflection[0]


def test_a_sidewall_that_softens_with_deflection_is_softer() -> None:
    """k_u = A exp(B d0), Eq. (54), inside the iteration for the load as well."""
    soft = TIRE.changed(radial_deflection_rate=-5.0)
    found = simulate(soft, load=4000.0)
    assert found.deflection[0] > 1.01 * simulate(TIRE, load=4000.0).deflection[0]
    d0 = float(found.deflection[0])
    frozen = TIRE.changed(radial_stiffness=TIRE.radial_stiffness * np.exp(-5.0 * d0))
    assert simulate(frozen, deflection=d0).load[0] == pytest.approx(4000.0, rel=1e-6)


def test_contact_length_is_the_belts_and_speed_the_rings(rolling: Simulation) -> None:
    found = point_document(rolling, 0)
    lead, trail = found["edges_rad"]
    assert found["contact_length_mm"] == pytest.approx(300.0 * (trail - lead))
    assert found["speed_kmh"] == pytest.approx(59.0 * 0.3 * 3.6)


def test_rates_are_per_radian_and_per_second(rolling: Simulation) -> None:
    peak = point_document(rolling, 1)["strain_rate_peaks"]["trail"]
    assert peak["ustrain_per_s"] == pytest.approx(59.0 * peak["ustrain_per_rad"])
    assert peak["ustrain_per_rad"] == pytest.approx(1e6 * rolling.rate[1].min(), rel=1e-3)


def test_only_the_contact_with_shear_tells_the_effective_radius() -> None:
    radial = point_document(simulate(TIRE, load=4000.0), 0)
    assert radial["effective_radius_mm"] is None
    shear = point_document(simulate(TIRE, load=4000.0, contact="shear"), 0)
    assert 300.0 < shear["effective_radius_mm"] < 312.5


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "nothing": ({}, "neither load nor deflection"),
    "both": ({"load": 4000.0, "deflection": 0.02}, "both load and deflection"),
    "contact": ({"load": 4000.0, "contact": "magic"}, "allowed are radial, shear"),
    "no load": ({"load": 0.0}, "> 0"),
    "pull": ({"deflection": -0.01}, "> 0"),
    "vacuum": ({"load": 4000.0, "inflation": -1e4}, "-0.1 bar; the model holds from 0 to 20"),
    "kilopascal": ({"load": 4000.0, "inflation": 132e5}, "132 bar; the model holds from 0 to 20"),
    "backward": ({"load": 4000.0, "turn_rate": -1.0}, "-1 rad/s; the model holds from 0 to 500"),
    "fast": ({"load": 4000.0, "turn_rate": 501.0}, "0 to 500 rad/s; no tire's belt runs faster"),
    "no number": ({"load": 4000.0, "turn_rate": np.nan}, "nan rad/s"),
    "heavy": ({"load": 1e5}, "100000 N"),
    "deep": ({"deflection": 0.29}, "290"),
    "lists": (
        {"load": [1.0, 2.0], "turn_rate": [1.0, 2.0, 3.0]},
        "2 values where the longest list has 3",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_the_model_cannot_say_is_refused(case: str) -> None:
    values, message = REFUSED[case]
    with pytest.raises(ParameterError, match=re.escape(message)):
        simulate(TIRE, **values)


def test_a_tread_that_is_pressed_through_is_refused() -> None:
    soft = TIRE.changed(tread_stiffness=1.0e6)
    with pytest.raises(ParameterError, match=r"thickness (is )?12\.5 mm"):
        simulate(soft, load=5000.0)


def test_the_speed_limit_itself_is_allowed() -> None:
    assert simulate(TIRE, load=4000.0, turn_rate=LARGEST_BELT_SPEED / 0.3).load[0] > 0.0


def test_the_speed_limit_is_the_belts_so_that_a_small_wheel_may_turn_faster() -> None:
    kart = TIRE.changed(ring_radius=0.125, free_radius=0.1375)
    assert simulate(kart, load=600.0, turn_rate=400.0).load[0] > 0.0
    with pytest.raises(ParameterError, match="0 to 1200 rad/s"):
        simulate(kart, load=600.0, turn_rate=1201.0)


def test_curves_come_back_from_the_file(rolling: Simulation, tmp_path: Path) -> None:
    path = tmp_path / "new" / "curves.csv"
    write_curves(rolling, path)
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["point", "Fz_N", "phi_rad", *columns(rolling)]
    assert len(rows) == rolling.strain.size
    second = [row for row in rows if row["point"] == "1"]
    for name, expected in columns(rolling).items():
        read = [float(row[name]) for row in second]
        np.testing.assert_allclose(read, expected[1], rtol=1e-8, atol=1e-8 * abs(expected).max())
    with pytest.raises(FormatError, match="choose another"):
        write_curves(rolling, path / "below-a-file.csv")


def test_a_stiffer_sidewall_carries_more() -> None:
    stiff = Tire.changed(TIRE, radial_stiffness=1.1 * TIRE.radial_stiffness)
    assert simulate(stiff, deflection=0.025).load[0] > simulate(TIRE, deflection=0.025).load[0]
