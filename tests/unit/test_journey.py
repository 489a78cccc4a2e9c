"""Which quantity of a campaign a verb looks at if none is named."""

from types import SimpleNamespace
from typing import Any

import pytest

from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.journey import explains_forces


def campaign(*slip_angles: float, gages: int = 5) -> Any:
    """Return what is asked of a campaign: its gages, and the slip of its runs."""
    plans = [
        SimpleNamespace(slip_angle=angle, camber=0.0, slip_ratio=0.0, kind="steady")
        for angle in slip_angles
    ]
    header = SimpleNamespace(name="drive", gage_lateral=(0.0,) * gages)
    return SimpleNamespace(header=header, plans=plans)


def model(*missing: str) -> Any:
    """Return what is asked of a model: its numbers, and those of the ring that it lacks."""
    numbers = {"bristle_lateral": 1.0} if missing else {}
    return SimpleNamespace(name="M.toml", missing=missing, numbers=numbers)


def test_strain_comes_first_where_there_is_strain_and_the_model_has_a_ring() -> None:
    assert not explains_forces(None, campaign(0.0, 0.03), model())
    assert explains_forces("Fy", campaign(0.0, 0.03), model())
    assert explains_forces(None, campaign(0.0, 0.03, gages=0), model())


def test_a_model_of_the_brush_is_compared_with_forces_where_runs_have_slip() -> None:
    brush = model("bending_stiffness", "radial_stiffness")
    assert explains_forces(None, campaign(0.0, 0.03), brush)
    with pytest.raises(CalibrationError, match="2 numbers of the ring are missing"):
        explains_forces(None, campaign(0.0, 0.0), brush)
    with pytest.raises(CalibrationError, match="brush only"):
        explains_forces("strain", campaign(0.0, 0.03), brush)


def test_a_quantity_that_is_not_there_is_refused() -> None:
    with pytest.raises(ParameterError, match="strane"):
        explains_forces("strane", campaign(0.0), model())
    with pytest.raises(CalibrationError, match="no strain gages"):
        explains_forces("strain", campaign(0.0, gages=0), model())
