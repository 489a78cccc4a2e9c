"""The ring's pressure against the parabola: each wins on its own forces, and on the rig."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tirelib.campaign import read_campaign
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import Tire, read_tire
from tirelib.inference.identify.force_data import ForceData, force_data
from tirelib.inference.identify.lateral_force import KINDS, PressureBand, compare_pressures
from tirelib.inference.identify.ring_patch import profiles, ring_contact
from tirelib.physics.brush.forces import brush_forces
from tirelib.physics.brush.parameters import BrushParameters
from tirelib.physics.contact.profiles import PressureProfile
from tirelib.rig.campaign import run_plan
from tirelib.rig.plans import Plan
from tirelib.rig.tire import Condition, RigTire

TIRE = read_tire("table-6-1").tire
C, MU, OFFSET = 9e6, 0.9, 25.0
LOADS, PRESSURES = (2500.0, 4500.0), (1.2e5, 1.5e5)
ANGLES = np.radians([-9.0, -6.0, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 9.0])


def points(*, camber: float = 0.0) -> ForceData:
    alpha, load, pressure = (
        x.ravel() for x in np.meshgrid(ANGLES, LOADS, PRESSURES, indexing="ij")
    )
    zero = np.zeros(load.size)
    lean = camber * np.sin(np.arange(load.size))
    block = np.arange(load.size)
    return ForceData(
        load, pressure, alpha, zero, lean, zero + 59.0, zero, zero, zero * np.nan, block
    )


def forces(kind: str, stiffness: float | np.ndarray = C, camber: float = 0.0) -> ForceData:
    """Return the forces of a brush with the pressure of one kind."""
    data = points(camber=camber)
    pair = profiles(TIRE, data.load, data.pressure, data.omega)
    profile = dict(zip(KINDS, pair, strict=True))[kind]
    angle = data.slip_angle + 0.1 * data.camber
    found = brush_forces(profile, BrushParameters(stiffness, MU), angle)
    return replace(data, Fy=found.Fy + OFFSET)


def pick(table: tuple[PressureBand, ...], by: str) -> list[PressureBand]:
    return [row for row in table if row.by == by]


@pytest.mark.parametrize("stiffness", ["each", "one"])
@pytest.mark.parametrize("kind", KINDS)
def test_each_pressure_wins_on_its_own_forces(kind: str, stiffness: str) -> None:
    found = compare_pressures(forces(kind), TIRE, stiffness=stiffness)
    fitted = found.fits[kind]
    np.testing.assert_allclose(fitted.stiffness, C, rtol=1e-4)
    assert fitted.values["friction"] == pytest.approx(MU, rel=1e-4)
    assert fitted.values["Fy_offset"] == pytest.approx(OFFSET, abs=0.1)
    assert fitted.values["slip_angle_offset"] == pytest.approx(0.0, abs=1e-5)
    all_points = found.table[0]
    fit = {"ring": all_points.ring_rmse, "parabola": all_points.parabola_rmse}
    unseen = {"ring": all_points.ring_rmse_unseen, "parabola": all_points.parabola_rmse_unseen}
    other = KINDS[1 - KINDS.index(kind)]
    assert fit[kind] < 0.5 < 10.0 < fit[other]
    assert unseen[kind] < 1.0 < unseen[other]
    assert all_points.better == kind


def test_stiffness_of_each_condition_is_found() -> None:
    data = points()
    stiffness = np.where(data.load > 3000.0, 7e6, 9e6) * np.where(data.pressure > 1.3e5, 1.1, 1.0)
    measured = forces("ring", stiffness)
    found = compare_pressures(measured, TIRE)
    np.testing.assert_allclose(found.fits["ring"].stiffness, stiffness, rtol=1e-4)
    assert found.table[0].ring_rmse < 0.5
    one = compare_pressures(measured, TIRE, stiffness="one")
    assert one.table[0].ring_rmse > 20.0
    # a force that is too large in size is so to either side
    larger = np.abs(one.fits["ring"].predicted) - np.abs(measured.Fy)
    assert one.table[0].ring_bias == pytest.approx(larger.mean())


def test_unseen_points_are_predicted_by_the_others() -> None:
    clean = forces("ring")
    Fy = clean.Fy.copy()
    Fy[17] += 1500.0
    found = compare_pressures(replace(clean, Fy=Fy), TIRE)
    assert found.fits["ring"].unseen[17] == pytest.approx(clean.Fy[17], abs=1.0)
    assert abs(found.fits["ring"].predicted[17] - clean.Fy[17]) > 20.0


def test_unseen_loads_are_predicted_by_the_other_loads() -> None:
    at = points()
    low = np.flatnonzero(at.pressure < 1.3e5)
    stiff = forces("ring").take(low)
    mixed = forces("ring", np.where(at.load > 3000.0, 0.5 * C, C)).take(low)
    found = compare_pressures(mixed, TIRE, stiffness="one")
    high = mixed.load > 3000.0
    np.testing.assert_allclose(found.fits["ring"].unseen[high], stiff.Fy[high], atol=2.0)


def test_camber_is_worth_a_slip_angle() -> None:
    found = compare_pressures(forces("ring", camber=0.05), TIRE)
    assert found.fits["ring"].values["camber_thrust"] == pytest.approx(0.1, rel=1e-3)
    assert "camber_thrust" not in compare_pressures(forces("ring"), TIRE).fits["ring"].values


def test_a_load_without_slip_angles_is_left_out_and_said() -> None:
    """Its stiffness would be anything: no error of it may stand in the table."""
    data = forces("ring")
    straight = np.abs(data.slip_angle) < 1e-9
    sparse = data.take(straight | (data.load < 3000.0))
    found = compare_pressures(sparse, TIRE)
    assert found.table[0].points == 26
    assert found.notes == (
        "2 of 28 points are left out, their load and pressure hold fewer than 4 points or less "
        "than 1 deg of slip angle",
    )
    with pytest.raises(CalibrationError, match="12 of 12 points are left out"):
        compare_pressures(data.take(straight | (data.slip_angle > 0.1)), TIRE)


def test_table_has_every_band_of_load_pressure_and_slip_angle() -> None:
    table = compare_pressures(forces("ring"), TIRE).table
    assert [row.by for row in table[:5]] == ["all", "load", "load", "pressure", "pressure"]
    assert [row.low for row in pick(table, "load")] == [2500.0, 4500.0]
    assert sum(row.points for row in pick(table, "slip_angle")) == table[0].points == 52
    mean = np.sqrt(np.mean([row.parabola_rmse**2 for row in pick(table, "load")]))
    assert mean == pytest.approx(table[0].parabola_rmse)  # two bands of equal size


def test_profiles_share_load_and_edges() -> None:
    data = points()
    ring, parabola = profiles(TIRE, data.load, data.pressure, data.omega)

    def carried(profile: PressureProfile) -> np.ndarray:
        return (profile.weight * profile.pressure).sum(axis=-1)

    np.testing.assert_allclose(carried(ring), data.load, rtol=1e-12)
    np.testing.assert_allclose(carried(parabola), data.load, rtol=1e-12)
    contact = ring_contact(TIRE, data.load, data.pressure, data.omega)
    np.testing.assert_allclose(ring.leading, -TIRE.ring_radius * contact.edges[:, 0])
    np.testing.assert_allclose(parabola.trailing, -TIRE.ring_radius * contact.edges[:, 1])
    # damping moves the pressure forward, and the ring's is the flatter one
    assert np.all(ring.center > parabola.center + 1e-4)
    assert np.all(ring.pressure.max(axis=-1) < parabola.pressure.max(axis=-1))


@pytest.mark.parametrize(
    ("change", "options", "error", "message"),
    [
        ({"Fy": np.nan}, {}, CalibrationError, "no freely rolling runs over slip angle with Fy"),
        ({"slip_ratio": 0.1}, {}, CalibrationError, "no freely rolling runs"),
        ({"slip_angle": 0.0}, {}, CalibrationError, "no freely rolling runs over slip angle"),
        ({}, {"stiffness": "some"}, ParameterError, "allowed are 'each' and 'one'"),
    ],
)
def test_what_cannot_be_compared_is_refused(
    change: dict, options: dict, error: type[Exception], message: str
) -> None:
    data = forces("ring")
    changed = replace(data, **{k: np.full(len(data), v) for k, v in change.items()})
    with pytest.raises(error, match=message):
        compare_pressures(changed, TIRE, **options)


def test_of_many_points_some_are_compared() -> None:
    data = forces("ring")
    found = compare_pressures(data.take(np.tile(np.arange(52), 12)), TIRE)
    assert found.table[0].points == 208  # each third of 624
    assert found.table[0].ring_rmse < 0.5


RIG = Tire(
    ring_radius=0.3035,
    free_radius=0.3165,
    belt_width=0.168,
    tread_thickness=0.0115,
    innerliner_offset=-0.003,
    bending_stiffness=2.6,
    mass=3.6,
    pressure=2.3e5,
    radial_stiffness=4.83e5,
    tangential_stiffness=1.9e5,
    tread_stiffness=5.38e7,
    damping=0.03,
    tread_hardening=1.0,
    radial_pressure_slope=1.1,
    tangential_pressure_slope=0.35,
)


def test_ring_pressure_serves_the_rig_better_at_one_load(tmp_path: Path) -> None:
    """A tire of another structure; c_py, mu and two offsets are fitted to it."""
    angles = np.radians([0.0, 1.0, 2.0, 3.0, 4.0, 6.0])
    plan = Plan(
        "part", "one load", tuple(Condition(6720.0, 2.1e5, 18.0, slip_angle=a) for a in angles)
    )
    run_plan(plan, RigTire(), tmp_path / "rig", seed=2, repeats=0, jobs=1)
    data = force_data(read_campaign(tmp_path / "rig"))
    assert len(data) == 6
    found = compare_pressures(data, RIG).table[0]
    assert found.ring_rmse < 0.7 * found.parabola_rmse
    # load cells: 30 N a sample, set points 0.017 deg of 1500 N/deg: 26 N
    assert found.ring_rmse < 60.0


def test_ring_pressure_on_a_laboratory_campaign(shared: Callable[[str], Path]) -> None:
    folder = shared("lab-set1")
    lab = replace(
        RIG,
        ring_radius=0.302,
        free_radius=0.3155,
        belt_width=0.165,
        tread_thickness=0.012,
        innerliner_offset=-0.0033,
        radial_stiffness=3.93e5,
        radial_pressure_slope=1.9,
        tread_stiffness=5.4e7,
    )
    table = compare_pressures(force_data(read_campaign(folder)), lab).table
    assert table[0].better == "ring"
    assert table[0].ring_rmse < 0.4 * table[0].parabola_rmse
    assert all(row.ring_rmse < row.parabola_rmse for row in table)
