"""The sparse Jacobian of the rig against differences of its residual."""

import numpy as np
import pytest

from tirelib.rig.belt import FIELDS, PSI, U
from tirelib.rig.mesh import mesh
from tirelib.rig.system import Balance, balance
from tirelib.rig.tire import Condition, RigTire


def condensed(state: Balance, belt: int) -> np.ndarray:
    """Eliminate the bristles, as the march does in the residual."""
    dense = np.empty(state.matrix.shape)
    dense[np.ix_(state.order, state.order)] = state.matrix.toarray()
    inner = slice(belt, len(dense) - 2)
    keep = np.r_[0:belt, len(dense) - 2, len(dense) - 1]
    to_shear = np.linalg.solve(dense[inner, inner], dense[inner][:, keep])
    return dense[np.ix_(keep, keep)] - dense[keep][:, inner] @ to_shear


@pytest.mark.parametrize("slip_angle", [0.0, 0.03, 0.2])
def test_jacobian_is_the_derivative_of_the_residual(slip_angle: float) -> None:
    tire = RigTire(sidewall_softening=0.2, tread_hardening=2.0)
    grid = mesh(0.03, 0.2, 0.44)
    cond = Condition(4000.0, 2.3e5, 18.0, slip_angle=slip_angle, camber=0.03)
    rng = np.random.default_rng(0)
    control = 1e-3 * rng.standard_normal((grid.n, FIELDS))
    control[:, PSI] += 0.3 * np.sin(3.0 * grid.knots[:-1, None] + np.arange(5))
    control[:, U] -= 0.02 * np.exp(-((grid.knots[:-1, None] / 0.25) ** 2))
    belt = grid.n * FIELDS
    point = np.concatenate([control.ravel(), [tire.free_radius - 0.02, 0.309]])

    def residual(x: np.ndarray) -> np.ndarray:
        state = balance(tire, cond, grid, x[:-2].reshape(grid.n, FIELDS), x[-2], x[-1], None)
        return np.concatenate([state.residual[:belt], state.residual[-2:]])

    base = balance(tire, cond, grid, control, point[-2], point[-1], None)
    assert base.road.shear.sliding.any()
    jacobian = condensed(base, belt)
    near = np.flatnonzero(np.repeat(np.abs(grid.knots[:-1]) < 0.15, FIELDS))
    chosen = np.union1d(rng.choice(belt, 20, replace=False), rng.choice(near, 40, replace=False))
    columns = [*chosen, belt, belt + 1]
    errors, wheel = [], []
    for column in columns:
        step = np.zeros(len(point))
        step[column] = 1e-7
        numeric = (residual(point + step) - residual(point - step)) / 2e-7
        error = np.abs(numeric - jacobian[:, column]).max() / np.abs(numeric).max()
        errors.append(error)
        wheel.append(numeric[-2:] - jacobian[-2:, column])
    # a difference may straddle the moment when a bristle begins to touch or to slide
    assert np.median(errors) < 1e-6
    assert np.sort(errors)[-3] < 1e-4
    # load and torque have their own scale; only coefficients in the contact move them
    exact = np.abs(jacobian[-2:, columns[:-2]]).T
    moves = exact > 0.01 * exact.max(axis=0)
    assert moves.sum(axis=0).min() >= 5
    relative = np.abs(np.array(wheel)[:-2])[moves] / exact[moves]
    assert np.median(relative) < 1e-5
    assert np.quantile(relative, 0.8) < 1e-3
