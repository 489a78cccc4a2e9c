"""The calibration of a vehicle on virtual tires: measured on them, over what a car's wheels do."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tirelib.campaign import read_campaign
from tirelib.core.errors import ParameterError
from tirelib.fmu.virtual.drive import ALPHA, CAMBER, DRIVING, KAPPA, LOAD, PRESSURE, SPEED, drive
from tirelib.fmu.virtual.measure import measure
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.spec import default_surface
from tirelib.fmu.virtual.surface import shared_surface
from tirelib.fmu.virtual.wheel import VirtualWheel


def test_what_a_car_does_lies_in_the_range_of_the_surface_and_fills_the_calibrations() -> None:
    surface, table = shared_surface(default_surface()), drive()
    load, alpha, along, camber, speed = table.T
    kappa = (1.0 + along) * np.cos(alpha) - 1.0
    given = np.stack((load, alpha, kappa, camber, speed, np.full(len(table), PRESSURE)), axis=1)
    assert [row for row in given if surface.outside(row)] == []
    for values, low, high in (
        (load, *LOAD),
        (alpha, -ALPHA, ALPHA),
        (along, -KAPPA, DRIVING),
        (camber, -CAMBER, CAMBER),
        (speed, *SPEED),
    ):
        assert low <= values.min() < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < values.max() <= high


def test_a_campaign_shows_the_strain_of_the_fmu(tmp_path: Path) -> None:
    surface = shared_surface(default_surface())
    assert measure(surface, tmp_path / "car", conditions=drive()[:3], seed=4) == 3
    campaign = read_campaign(tmp_path / "car")
    assert campaign.header.gage_lateral == tuple(surface.lateral)
    run = list(campaign.runs())[1]
    given = [run.rig[name][0] for name in ("Fz", "slip_angle", "slip_ratio", "camber", "speed")]
    wheel = VirtualWheel(surface, replace(Options(), noise=0.0), 256)
    wheel.begin([*given, PRESSURE])
    seen = []
    for _ in range(12):
        wheel.step(256 / run.rate, [*given, PRESSURE])
        seen.append(np.reshape(wheel.outputs()[0][: 256 * 5], (256, 5)))
    turn = np.concatenate(seen)
    assert run.strain is not None
    # whole turns of both, so that ends of the range do not depend on where a recording begins
    measured = np.ptp(run.strain, axis=1)
    np.testing.assert_allclose(measured, np.ptp(turn, axis=0), rtol=0.02)


def test_a_folder_that_is_not_empty_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("x")
    with pytest.raises(ParameterError, match="is not empty"):
        measure(shared_surface(default_surface()), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
