"""Where the measured and the modelled chain meet: shapes that must agree."""

import numpy as np
import pytest

from tirelib.core.errors import ShapeError
from tirelib.core.traces import StrainTrace, TraceConditions

NAMES = ("omega", "speed", "pressure", "camber")


def conditions(n: int = 3, **other: int) -> TraceConditions:
    return TraceConditions(**{name: np.zeros(other.get(name, n)) for name in NAMES})


@pytest.mark.parametrize("name", NAMES)
def test_every_condition_has_a_value_for_each_trace(name: str) -> None:
    with pytest.raises(ShapeError, match=rf"conditions differ in shape: .*'{name}': \(2,\)"):
        conditions(**{name: 2})


@pytest.mark.parametrize("name", ["strain", "rate"])
@pytest.mark.parametrize("shape", [(2, 5, 7), (3, 4, 7), (3, 5, 6)])
def test_strain_and_rate_are_over_traces_gages_and_angles(
    name: str, shape: tuple[int, ...]
) -> None:
    curves = {"strain": np.zeros((3, 5, 7)), "rate": np.zeros((3, 5, 7)), name: np.zeros(shape)}
    with pytest.raises(ShapeError, match=rf"{name} has shape .*\(3, 5, 7\) is needed"):
        StrainTrace(
            phi=np.zeros(7),
            pulse=np.zeros(3),
            lateral=np.zeros(5),
            axis_shift=np.zeros(3),
            conditions=conditions(),
            **curves,
        )


@pytest.mark.parametrize("offset", [0.0, 0.004, -0.004])
def test_the_centre_gage_is_the_nearest_to_the_middle_and_angles_are_evenly_apart(
    offset: float,
) -> None:
    lateral = np.array([0.06, 0.03, 0.0, -0.03, -0.06]) + offset
    trace = StrainTrace(
        phi=np.linspace(-0.3, 0.3, 7),
        strain=np.zeros((3, 5, 7)),
        rate=np.zeros((3, 5, 7)),
        pulse=np.zeros(3),
        lateral=lateral,
        axis_shift=np.zeros(3),
        conditions=conditions(),
    )
    assert trace.centre_gage == 2
    assert trace.spacing == pytest.approx(0.1)
