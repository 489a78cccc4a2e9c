from dataclasses import replace

import numpy as np
import pytest

from bench.rig.solve import solve
from bench.rig.tire import TIRES, Condition, RigTire, tire
from tirelib.errors import ParameterError


@pytest.mark.parametrize(
    "change",
    [
        {"bending": 0.0},
        {"mass": -1.0},
        {"extension": float("nan")},
        {"sidewall_share": (0.5, 0.5)},
        {"sidewall_softening": 1.0},
    ],
)
def test_impossible_tires_are_refused(change: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match="allowed"):
        replace(RigTire(), **change)


def test_every_named_tire_is_of_the_class() -> None:
    for name in TIRES:
        one = tire(name)
        assert 0.30 < one.free_radius < 0.33
        assert one.innerliner_offset < 0.0
    with pytest.raises(ParameterError, match="reference"):
        tire("square")


def test_stiffness_is_linear_in_pressure() -> None:
    one = RigTire()
    p = np.array([1e5, 2e5, 3e5])
    for stiffness in (one.radial_stiffness, one.tangential_stiffness, one.lateral_stiffness):
        low, middle, high = (stiffness(float(x)) for x in p)
        assert high - middle == pytest.approx(middle - low)
        assert high > low > 0.0


@pytest.mark.parametrize(
    "change", [{"load": 10.0}, {"pressure": 0.0}, {"speed": -1.0}, {"slip_ratio": -1.0}]
)
def test_conditions_beyond_the_rig_are_refused(change: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match="change the plan"):
        solve(RigTire(), replace(Condition(4000.0, 2.3e5, 20.0), **change))
