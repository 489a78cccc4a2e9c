"""A stability controller with four wheels: what it does with what it knows."""

import json
import math

import numpy as np
import pytest
from cosim import closed_loop, closed_loop_stability_report
from cosim.closed_loop_sources import TIME_STEP, Known, Perfect, Strain
from cosim.closed_loop_stability import (
    StabilityController,
    StabilityOutcome,
    Swerve,
    document,
    swerve,
)
from cosim.wheels import FourWheels

from tests.cosim import fmus

CONTROL = StabilityController()
TURNING = Swerve(lasts=1.1, angle=0.06, rear_friction=0.6)
"""To the first swing of the rear: six turns of a wheel, some of them with brakes."""


def known(rear: float, kappa: float = 0.0, load: float = 4e3) -> Known:
    alpha = np.array([0.0, 0.0, rear, rear])
    return Known(np.full(4, kappa), np.full(4, load), alpha)


def test_the_front_brake_outside_the_turn_holds_the_rear_axle() -> None:
    """A left turn has slip angles below zero; its outside is on the right."""
    excess = math.radians(1.0)
    left = CONTROL.torque(known(-CONTROL.threshold - excess))
    assert np.flatnonzero(left).tolist() == [1]
    force = CONTROL.gain * excess / CONTROL.half_track
    assert left[1] == pytest.approx(CONTROL.radius * force)
    right = CONTROL.torque(known(CONTROL.threshold + excess))
    assert right.tolist() == [left[1], 0.0, 0.0, 0.0]
    assert not CONTROL.torque(known(0.99 * CONTROL.threshold)).any()


def test_the_brake_keeps_within_load_and_slip_and_waits_for_knowledge() -> None:
    most = CONTROL.torque(known(-0.2))[1]
    assert most == pytest.approx(CONTROL.radius * CONTROL.most * 4e3)
    assert CONTROL.torque(known(-0.2, load=2e3))[1] == pytest.approx(0.5 * most)
    assert CONTROL.torque(known(-0.2, kappa=0.75 * CONTROL.deepest))[1] == pytest.approx(0.5 * most)
    assert CONTROL.torque(known(-0.2, kappa=1.5 * CONTROL.deepest))[1] == 0.0
    for blind in (known(math.nan), known(-0.2, kappa=math.nan), known(-0.2, load=math.nan)):
        assert not CONTROL.torque(blind).any()


def test_the_driver_steers_a_sine_that_dwells() -> None:
    road = Swerve()
    times = np.arange(0.0, road.lasts, TIME_STEP)
    angle = np.array([road.steer(time) for time in times])
    assert angle.max() == pytest.approx(road.angle, rel=1e-3)
    held = np.isclose(angle, -road.angle, rtol=1e-3).sum() * TIME_STEP
    assert held == pytest.approx(road.dwell, abs=0.04)
    assert np.abs(np.diff(angle)).max() < 1.1 * road.angle * 2 * np.pi * road.frequency * TIME_STEP
    assert not angle[times < road.rolling].any()
    assert angle[-1] == 0.0


@pytest.fixture(scope="module")
def runs() -> dict[str, StabilityOutcome]:
    with FourWheels(fmus.virtual(), fmus.strain()) as four:
        strain = swerve(Strain(four), TURNING)
    truth, nobody = swerve(Perfect(), TURNING), swerve(None, TURNING)
    found = {"no control": nobody, "perfect": truth, "strain": strain}
    found |= {"one turn late": truth, "once per turn": truth}  # rows of the report only
    return {name: StabilityOutcome(name, (run,)) for name, run in found.items()}


def test_with_strain_tires_the_rear_axle_is_held_as_with_the_truth(
    runs: dict[str, StabilityOutcome],
) -> None:
    free, perfect, strain = (runs[n].runs[0] for n in ("no control", "perfect", "strain"))
    assert perfect.rear_angle < free.rear_angle - math.radians(0.5)
    # held once per turn, a slip angle is up to 90 ms old
    assert perfect.rear_angle <= strain.rear_angle < free.rear_angle
    assert strain.out_of_range == 0
    settled = np.isfinite(strain.known_alpha).all(axis=1)
    assert settled.mean() > 0.8
    assert not free.torque.any()
    # the brakes' yaw moment takes speed
    assert perfect.lost_speed > free.lost_speed


def test_the_study_is_a_document_a_table_and_figures(runs: dict[str, StabilityOutcome]) -> None:
    outcomes = list(runs.values())
    rows = json.loads(json.dumps(document(outcomes), allow_nan=False))["rows"]
    assert [row["source"] for row in rows] == list(runs)
    part = closed_loop_stability_report.part(outcomes)
    assert "with strain tires" in part.text
    assert len(part.tables[0].rows) == len(outcomes)
    assert len(part.plots[0].figure.data) == 3 * len(outcomes) + 1
    assert len(part.plots[0].rows[0]) == len(part.plots[0].columns)


def test_a_driver_holds_the_course_on_a_split_road() -> None:
    """The brakes turn the vehicle to the side that grips; steering takes it back."""
    split = closed_loop.ROADS[3]
    held = closed_loop.brake(split, Perfect(), end_speed=24.0)
    free = closed_loop.brake(
        closed_loop.Braking("free", "nobody steers", split.friction), Perfect(), end_speed=24.0
    )
    assert abs(held.yaw) < 0.5 * abs(free.yaw)
    assert held.yaw < 0.0  # grip is on the right
    assert free.yaw < 0.0
    assert closed_loop.ROADS[0].angles(0.1, 0.1).tolist() == [0.0] * 4
    assert (split.angles(0.1, 0.1)[:2] < 0.0).all()  # a yaw to the left is steered to the right
