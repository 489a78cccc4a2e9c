"""How many samples a turn takes, by the trigger, the rig's channels or the set points."""

import numpy as np
import pytest

from tests.synthetic import header
from tirelib.campaign import Run, RunPlan
from tirelib.campaign.turns import expected_period, turn_samples, turn_stack

RADIUS = header().tire.free_radius
NAN = float("nan")


def run(*pulses: int, planned: float = NAN, slip: float = NAN, **rig: float) -> Run:
    """A run of 1000 samples at 1 kHz: speed and slip that were planned, and what was measured."""
    trigger = np.isin(np.arange(1000), pulses) if pulses else None
    plan = RunPlan(0, "a.mf4", "free", 4e3, 2e5, planned, 0.0, 0.0, slip)
    measured = {name: np.full(5, value) for name, value in rig.items()}
    return Run(plan, np.zeros((5, 1000)), 1e3, 0.0, trigger, measured, 0.1 * np.arange(5.0))


def test_one_missing_pulse_does_not_change_a_turn() -> None:
    assert turn_samples(run(100, 200, 300, 500, 600), header()) == 100.0


def test_fewer_than_two_pulses_leave_it_to_the_rig() -> None:
    once = run(100, omega=20.0, speed=5.0)
    assert turn_samples(once, header()) == pytest.approx(1e3 * 2.0 * np.pi / 20.0)
    assert turn_samples(run(), header()) is None


def test_a_measured_turn_rate_is_believed_before_a_speed() -> None:
    for rate in (20.0, -20.0):
        found = expected_period(run(omega=rate, speed=5.0), header())
        assert found == (pytest.approx(2.0 * np.pi / 20.0), "omega", 0.03)


@pytest.mark.parametrize("kappa", [-0.2, 0.0, 0.1, NAN])
def test_a_wheel_that_brakes_turns_longer(kappa: float) -> None:
    """The rim's speed is that of the road times one plus the slip ratio, which is 0 if unknown."""
    expected = 2.0 * np.pi * RADIUS / (5.0 * (1.0 + np.nan_to_num(kappa)))
    found = expected_period(run(planned=5.0, slip=kappa), header())
    assert found == (pytest.approx(expected), "the set point of the speed", 0.15)


def test_what_was_measured_stands_before_the_set_points() -> None:
    found = expected_period(run(planned=9.0, slip=0.3, speed=5.0, slip_ratio=-0.1), header())
    assert found == (pytest.approx(2.0 * np.pi * RADIUS / (5.0 * 0.9)), "speed", 0.15)


@pytest.mark.parametrize("speed", [0.0, 0.09, -0.09, NAN])
def test_a_wheel_that_stands_has_no_period(speed: float) -> None:
    assert expected_period(run(planned=speed), header()) is None
    assert expected_period(run(planned=speed, omega=0.0), header()) is None


@pytest.mark.parametrize("samples", [100.0, 100.4, 99.55])
def test_turns_of_a_stack_begin_where_turns_do_though_a_turn_is_no_number_of_samples(
    samples: float,
) -> None:
    angle = 2.0 * np.pi * np.arange(6000) / samples
    stack = turn_stack(np.stack([np.cos(angle), np.sin(angle)]), samples)
    assert stack is not None
    assert stack.shape[1] > 50
    # each turn begins within half a sample of its place
    assert np.abs(stack - stack[:, :1]).max() <= 1.01 * np.pi / samples
