from dataclasses import replace

import numpy as np
import pytest

from tirelib.core.errors import ParameterError
from tirelib.rig.observe import edges, forces
from tirelib.rig.solve import solve
from tirelib.rig.tire import NEW_DEPTH, TIRES, Condition, RigTire, on_road, tire


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


def test_a_worn_tread_is_thinner_stiffer_and_lighter() -> None:
    cond = Condition(4000.0, 2.3e5, 20.0, friction=0.4, tread_depth=NEW_DEPTH - 0.003)
    new, worn = RigTire(), on_road(RigTire(), cond)
    assert worn.friction == 0.4
    assert new.tread_thickness - worn.tread_thickness == pytest.approx(0.003)
    for name in ("tread_normal", "tread_shear_x", "tread_shear_y"):
        modulus = getattr(new, name) * new.tread_thickness
        assert getattr(worn, name) * worn.tread_thickness == pytest.approx(modulus)
    assert new.mass - worn.mass == pytest.approx(0.4, abs=0.1)
    assert on_road(new, Condition(4000.0, 2.3e5, 20.0)) == new


def test_a_slippery_road_gives_less_force_and_a_worn_tread_a_shorter_contact() -> None:
    cond = Condition(4000.0, 2.3e5, 20.0, slip_angle=0.06)
    dry, wet, worn = (
        solve(on_road(RigTire(), c), c)
        for c in (cond, replace(cond, friction=0.4), replace(cond, tread_depth=0.004))
    )
    assert 0.9 * 0.4 * 4000.0 < abs(forces(wet).fy) < 0.4 * 4000.0
    assert abs(forces(dry).fy) > 1.3 * abs(forces(wet).fy)
    angle = [np.diff(edges(state)[0])[2, 0] for state in (dry, worn)]
    assert angle[1] < 0.98 * angle[0]


@pytest.mark.parametrize(
    "change",
    [
        {"friction": 0.0},
        {"tread_depth": 0.009},
        {"load": 10.0},
        {"pressure": 0.0},
        {"speed": -1.0},
        {"slip_ratio": -1.0},
    ],
)
def test_conditions_beyond_the_rig_are_refused(change: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match="change the plan"):
        solve(RigTire(), replace(Condition(4000.0, 2.3e5, 20.0), **change))
