"""The effective radius is that of free rolling, whatever slip the runs had that told it."""

import numpy as np
import pytest

from tirelib.estimators.fit_links import FREE_ROLLING, fit_radius
from tirelib.estimators.links import Links

RADIUS = 0.31


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_runs_that_all_brake_or_all_drive_a_little_tell_the_same_radius(sign: float) -> None:
    kappa = sign * np.linspace(0.2, 0.95, 12) * FREE_ROLLING
    speed = np.repeat([10.0, 20.0, 30.0], 4)
    values = {
        "speed": speed,
        "speed_squared": speed**2,
        "omega": speed * (1.0 + kappa) / RADIUS,
        "load": np.tile([2e3, 4e3, 6e3, 8e3], 3),
        "pressure": np.full(12, 2.3e5),
    }
    rows = np.arange(12)
    links = Links(rows, rows, values, {"slip_ratio": kappa}, {}, {}, {}, {})
    model = fit_radius(links, lambda _: None)
    assert model is not None
    radius, std = model.predict(values)
    np.testing.assert_allclose(radius, RADIUS, rtol=1e-6)
    assert (std < 1e-4).all()
    np.testing.assert_allclose(links.held_out["kappa"], kappa, atol=1e-6)
    np.testing.assert_allclose(links.values["slip_size"], np.abs(kappa), atol=1e-6)
