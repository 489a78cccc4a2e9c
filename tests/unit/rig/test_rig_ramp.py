"""A ramp on the rig: quasi-steady states, and the wheel turning as it really does between them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tirelib.campaign import check_campaign, read_campaign
from tirelib.core.errors import ParameterError
from tirelib.rig.campaign import run_plan
from tirelib.rig.measure import MeasuringChain, Recording, Stage, record
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import forces, trace
from tirelib.rig.plans import Plan, kind, on_one_road, plan
from tirelib.rig.ramp import Point, Ramp, changed, dense, points_of, set_point
from tirelib.rig.solve import solve
from tirelib.rig.tire import Condition, RigTire

EXACT = MeasuringChain(
    gage_noise=0.0,
    gage_gain=0.0,
    gage_offset=0.0,
    gage_drift=0.0,
    gain_repeatability=0.0,
    force_noise=0.0,
    angle_noise=0.0,
    slip_noise=0.0,
    speed_noise=0.0,
    omega_noise=0.0,
    pressure_noise=0.0,
    radius_noise=0.0,
    run_out=0.0,
    load_setting=0.0,
    speed_setting=0.0,
)
FAST = Condition(4000.0, 2.3e5, 24.0)
SLOW = replace(FAST, speed=20.0)
SECONDS = 0.5
"""Length of a ramp at -8 m/s^2: some seven turns."""


@pytest.fixture(scope="module")
def stages() -> tuple[Stage, Stage]:
    """Both ends of the ramp, on a coarse mesh."""
    grid = mesh(fine=0.02, coarse=0.2, zone=0.36)
    first = solve(RigTire(), FAST, grid=grid)
    last = solve(RigTire(), SLOW, first, grid)
    return (
        Stage(first, trace(first), forces(first)),
        Stage(last, trace(last), forces(last), SECONDS),
    )


def contacts(strain: np.ndarray) -> np.ndarray:
    """Return the middles of the contacts of the centre gage, in samples: between half heights."""
    gage = strain[2]
    level = 0.5 * (gage.max() + np.median(gage))
    above = gage > level
    up, down = (np.flatnonzero(np.diff(above.astype(int)) == sign) for sign in (1, -1))
    cross = [
        i + (level - gage[i]) / (gage[i + 1] - gage[i]) for i in np.sort(np.concatenate([up, down]))
    ]
    edges = np.array(cross[int(above[0]) :])
    return 0.5 * (edges[0 : len(edges) // 2 * 2 : 2] + edges[1::2])


def angle_of(recording: Recording, sample: np.ndarray) -> np.ndarray:
    """Return the integral of the recorded turn rate up to samples [rad]."""
    omega = recording.rig["omega"]
    angle = np.concatenate(([0.0], np.cumsum(0.5 * (omega[1:] + omega[:-1]) / EXACT.rig_rate)))
    late = sample / EXACT.gage_rate
    k = np.minimum((late * EXACT.rig_rate).astype(int), len(omega) - 2)
    rest = late - recording.rig_time[k]
    slope = (omega[k + 1] - omega[k]) * EXACT.rig_rate
    return np.asarray(angle[k] + omega[k] * rest + 0.5 * slope * rest**2)


def test_contacts_are_where_the_integral_of_the_turn_rate_says(
    stages: tuple[Stage, Stage],
) -> None:
    recording = record(stages, EXACT, 0, 0)
    top = np.flatnonzero(recording.trigger)
    middle = contacts(recording.strain)
    assert len(middle) >= 6
    period = np.diff(middle)
    assert period[-1] / period[0] > 1.1  # a wheel that turns evenly would be far off
    for place, error in ((top, 1.1e-4), (middle, 2e-5)):  # the trigger is a whole sample
        turned = angle_of(recording, place)
        omega = recording.rig["omega"].max()
        np.testing.assert_allclose(np.diff(turned), 2.0 * np.pi, atol=error * omega)


def test_channels_follow_the_ramp(stages: tuple[Stage, Stage]) -> None:
    recording = record(stages, EXACT, 0, 0)
    share = recording.rig_time / SECONDS
    rig = recording.rig
    np.testing.assert_allclose(rig["speed"], 24.0 - 4.0 * share, rtol=1e-12)
    np.testing.assert_allclose(rig["Fz"], 4000.0, rtol=1e-6)
    first, last = (s.state.omega for s in stages)
    np.testing.assert_allclose(rig["omega"], first + (last - first) * share, rtol=1e-12)
    np.testing.assert_allclose(rig["slip_ratio"], 0.0, atol=1e-12)
    assert recording.strain.shape == (5, round(SECONDS * EXACT.gage_rate))


def test_strain_lies_between_that_of_the_two_states(stages: tuple[Stage, Stage]) -> None:
    heavier = replace(
        stages[1], trace=replace(stages[0].trace, strain=3e-3 + stages[0].trace.strain)
    )
    still = replace(heavier, state=stages[0].state)
    change = (
        record((stages[0], still), EXACT, 0, 0).strain
        - record((stages[0], replace(stages[0], time=SECONDS)), EXACT, 0, 0).strain
    )
    share = np.arange(change.shape[1]) / change.shape[1]
    np.testing.assert_allclose(change, np.tile(3e-3 * share, (5, 1)), atol=2.5e-6)  # 14 bits


def test_a_ramp_that_does_not_move_is_the_steady_run(stages: tuple[Stage, Stage]) -> None:
    chain = MeasuringChain()
    state = stages[0].state
    steady = record(stages[:1], chain, 3, 5)
    turns = chain.turns * 2.0 * np.pi / state.omega
    middle, end = (replace(stages[0], time=share * turns) for share in (0.4, 1.0))
    ramp = record((stages[0], middle, end), chain, 3, 5)
    np.testing.assert_allclose(ramp.strain, steady.strain, atol=1e-12)
    np.testing.assert_array_equal(ramp.trigger, steady.trigger)
    for name, values in steady.rig.items():
        np.testing.assert_allclose(ramp.rig[name], values, rtol=1e-9)


def test_a_ramp_becomes_a_sound_sweep_of_a_campaign(tmp_path: Path) -> None:
    slower = replace(FAST, speed=18.5)
    ramp = Ramp("slower", (Point(0.0, FAST), Point(0.3, FAST), Point(0.6, slower)))
    out = tmp_path / "one"
    truths = run_plan(Plan("one", "a ramp", (ramp,)), RigTire(), out, jobs=1)
    assert [t.time for t in truths] == pytest.approx([0.0, 0.3, 0.45, 0.6])
    assert check_campaign(out) == []  # most turns are fast ones: their median is not the mean
    (run,) = read_campaign(out).runs()
    assert run.plan.kind == "sweep"
    assert run.plan.load == pytest.approx(4000.0)
    assert np.isnan(run.plan.speed)
    assert run.plan.slip_ratio == 0.0
    assert run.plan.extra["ramp"] == "slower"
    assert run.rig["speed"][0] - run.rig["speed"][-1] == pytest.approx(5.5, abs=0.3)


def test_the_plan_of_ramps() -> None:
    runs = plan("ramps").conditions
    assert all(kind(run) == "sweep" for run in runs)
    assert {set_point(run, "load") for run in runs} == {3000.0, 4800.0}
    told = [next(run for run in runs if run.about == name) for name in ("speed -8 m/s2", "brake")]  # type: ignore[union-attr]
    slowing, brake = (points_of(run) for run in told)
    rate = (slowing[2].condition.speed - slowing[1].condition.speed) / (
        slowing[2].time - slowing[1].time
    )
    assert rate == pytest.approx(-8.0)
    assert min(p.condition.slip_ratio or 0.0 for p in brake) == -0.06
    assert brake[-1].condition.slip_ratio == 0.0
    assert 6 <= len({p.condition for p in dense(slowing)}) <= 10
    wet = on_one_road(plan("ramps"), 0.4, None)
    assert {p.condition.friction for run in wet.conditions for p in points_of(run)} == {0.4}


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ((Point(0.0, FAST),), "two or more"),
        ((Point(0.1, FAST), Point(1.0, SLOW)), "grow from 0 s"),
        ((Point(0.0, FAST), Point(0.0, SLOW)), "grow from 0 s"),
        ((Point(0.0, FAST), Point(1.0, replace(SLOW, slip_ratio=0.0))), "at all points or at none"),
        ((Point(0.0, FAST), Point(1.0, replace(SLOW, friction=0.4))), "one road"),
    ],
)
def test_a_wrong_ramp_is_refused(points: tuple[Point, ...], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        Ramp("wrong", points)


def test_a_change_reaches_every_point() -> None:
    ramp = Ramp("slower", (Point(0.0, FAST), Point(1.0, SLOW)))
    heavier = changed(ramp, lambda c: replace(c, load=5000.0))
    assert {p.condition.load for p in points_of(heavier)} == {5000.0}
    assert changed(FAST, lambda c: replace(c, load=5000.0)) == replace(FAST, load=5000.0)
