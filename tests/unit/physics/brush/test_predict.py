"""The brush in closed form: the same laws as the integrated brush, every constant per point."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ConvergenceError, ParameterError, ShapeError
from tirelib.physics.brush.forces import BrushForces, brush_forces
from tirelib.physics.brush.parabola import aligning_moment, lateral_force
from tirelib.physics.brush.parameters import BrushParameters, Carcass
from tirelib.physics.brush.predict import (
    PointConditions,
    PointForces,
    PointParameters,
    predict_forces,
)
from tirelib.physics.contact.profiles import parabola

MU, LOAD, A = 0.9, 4000.0, 0.06
CPY = 6e4 / (2 * A**2)
BRUSH = PointParameters(CPY, MU, A)


def assert_same(one: PointForces | BrushForces, two: PointForces | BrushForces) -> None:
    # both are exact up to rounding; the balance with the carcass stops at 1e-10 of mu Fz
    np.testing.assert_allclose(one.Fx, two.Fx, atol=2e-6)
    np.testing.assert_allclose(one.Fy, two.Fy, atol=2e-6)
    np.testing.assert_allclose(one.Mz, two.Mz, atol=2e-7)


@given(seed=st.integers(0, 2**31))
def test_closed_form_is_the_integrated_brush(seed: int) -> None:
    """All constants differ from point to point; slip in all directions, a locked wheel as well."""
    rng = np.random.default_rng(seed)
    n = 40
    mu, a = rng.uniform(0.3, 1.3, n), rng.uniform(0.02, 0.12, n)
    load, alpha = rng.uniform(500.0, 9000.0, n), rng.uniform(-0.5, 0.5, n)
    kappa = np.where(np.arange(n) < 2, -1.0, rng.uniform(-0.9, 0.5, n))
    kappa[2:12] = 0.0
    cx, cy = rng.uniform(1e6, 3e7, (2, n))
    arm, yaw = 7e-6, 1e-4
    found = predict_forces(
        PointParameters(
            cy,
            mu,
            a,
            cx,
            0.8 * mu,
            lateral_compliance=arm,
        ),
        PointConditions(load, alpha, kappa),
    )
    plain = parabola(load, -a, a)
    assert_same(
        found,
        brush_forces(plain, BrushParameters(cy, mu, cx, 0.8 * mu, Carcass(1 / arm)), alpha, kappa),
    )
    soft = PointParameters(0.3 * cy, mu, a, 0.3 * cx, yaw_compliance=yaw)
    assert_same(
        predict_forces(soft, PointConditions(load, alpha, kappa)),
        brush_forces(
            plain,
            BrushParameters(0.3 * cy, mu, 0.3 * cx, carcass=Carcass(yaw=1 / yaw)),
            alpha,
            kappa,
        ),
    )


@given(alpha=st.floats(-0.4, 0.4))
def test_pure_side_slip_is_the_classical_closed_form(alpha: float) -> None:
    found = predict_forces(BRUSH, PointConditions(LOAD, alpha))
    assert float(found.Fy) == pytest.approx(
        float(lateral_force(alpha, CPY, MU, LOAD, A)), rel=1e-12, abs=1e-9
    )
    assert float(found.Mz) == pytest.approx(
        float(aligning_moment(alpha, CPY, MU, LOAD, A)), rel=1e-9, abs=1e-9
    )
    assert float(found.Fx) == 0.0


def test_signs_are_iso() -> None:
    turning = predict_forces(BRUSH, PointConditions(LOAD, 0.03))
    assert float(turning.Fy) < 0.0 < float(turning.Mz)
    assert float(predict_forces(BRUSH, PointConditions(LOAD, 0.0, -0.02)).Fx) < 0.0


def test_offsets_and_camber_are_where_they_say() -> None:
    shifted = PointParameters(
        CPY,
        MU,
        A,
        camber_thrust=0.2,
        slip_angle_offset=0.01,
        slip_ratio_offset=0.02,
        Fx_offset=-50.0,
        Fy_offset=30.0,
        Mz_offset=4.0,
    )
    one = predict_forces(shifted, PointConditions(LOAD, 0.03, -0.05, camber=0.1))
    two = predict_forces(BRUSH, PointConditions(LOAD, 0.03 + 0.01 + 0.02, -0.03))
    assert float(one.Fx + 50.0) == pytest.approx(float(two.Fx))
    assert float(one.Fy - 30.0) == pytest.approx(float(two.Fy))
    assert float(one.Mz - 4.0) == pytest.approx(float(two.Mz))


@given(alpha=st.floats(-0.5, 0.5), kappa=st.floats(-1.0, 0.5))
def test_force_never_exceeds_friction(alpha: float, kappa: float) -> None:
    anisotropic = PointParameters(CPY, MU, A, 1.7 * CPY)
    found = predict_forces(anisotropic, PointConditions(LOAD, alpha, kappa))
    assert float(np.hypot(found.Fx, found.Fy)) <= MU * LOAD * (1 + 1e-12)


def test_everything_broadcasts() -> None:
    found = predict_forces(
        PointParameters(CPY, np.array([[0.5], [0.9]]), A, Mz_offset=np.array([0.0, 1.0, 2.0])),
        PointConditions(LOAD, np.array([0.0, 0.02, 0.05])),
    )
    assert found.Fx.shape == found.Fy.shape == found.Mz.shape == (2, 3)


@pytest.mark.parametrize(
    ("change", "at", "message"),
    [
        ({"friction": 0.0}, {}, r"friction = 0 at 1 of 1 points; it must be finite and > 0"),
        ({"lateral_stiffness": -1.0}, {}, "lateral_stiffness = -1"),
        ({"half_length": [0.05, np.nan]}, {}, "half_length = nan at 1 of 2"),
        ({"yaw_compliance": -1e-5}, {}, r"yaw_compliance = -1e-05 .* 0 for a rigid carcass"),
        ({}, {"load": 0.0}, "load = 0"),
        ({}, {"slip_angle": 3.0}, "give angles in radians"),
        ({}, {"slip_ratio": -5.0}, "not in percent"),
    ],
)
def test_bad_numbers_are_refused(change: dict, at: dict, message: str) -> None:
    numbers = {"lateral_stiffness": CPY, "friction": MU, "half_length": A} | change
    with pytest.raises(ParameterError, match=message):
        predict_forces(
            PointParameters(**numbers), PointConditions(**({"load": LOAD, "slip_angle": 0.1} | at))
        )


def test_bad_shapes_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"load \(2,\), slip_angle \(3,\)"):
        predict_forces(BRUSH, PointConditions([1.0, 2.0], [0.0, 0.1, 0.2]))


def test_a_carcass_without_balance_is_said() -> None:
    """Many turns give the same moment: the branch hops and no balance is found."""
    soft = PointParameters(CPY, MU, A, yaw_compliance=1e10)
    with pytest.raises(ConvergenceError, match="too soft in yaw"):
        predict_forces(soft, PointConditions(LOAD, np.linspace(0.02, 0.2, 50)))
