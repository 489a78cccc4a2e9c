"""What a calibration cannot use is said before the first turn, in the units of the options."""

from typing import Any

import pytest

from tirebench.cli.start_checks import check_conditions, least_rate, slow
from tirebench.errors import DeviceError
from tirebench.estimator.remark_units import in_options_units
from tirebench.wire.conditions import Conditions
from tirelib.estimators.calibration import Calibration
from tirelib.fmu.remarks import TEXTS, Remark


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"tread_depth": 8e-6},
            r"=0\.008 mm: 0\.5 \.\. \d+ mm is possible.*tread_depth=8",
        ),
        ({"pressure": 230e5}, r"--pressure 230 bar: .* bar is what .* such as --pressure 2\.3"),
        ({"friction": 95.0}, "friction=95: 0.05 .. 1.8"),
    ],
)
def test_a_condition_in_another_unit_is_refused(
    given: dict[str, float], said: str, calibration: Calibration
) -> None:
    with pytest.raises(DeviceError, match=said):
        check_conditions(Conditions.constant(**given), calibration)


def test_a_condition_within_its_range_is_taken(calibration: Calibration) -> None:
    check_conditions(Conditions.constant(pressure=2.3e5, tread_depth=0.008), calibration)


def test_the_least_rate_grows_with_the_speed(calibration: Calibration) -> None:
    slow_wheel, fast_wheel = (least_rate(calibration, v) for v in (10.0, 20.0))
    assert fast_wheel == pytest.approx(2.0 * slow_wheel)
    assert slow(calibration, fast_wheel, 20.0) == ""
    assert "other_tire" in slow(calibration, 0.99 * fast_wheel, 20.0)
    assert "NO TURN WILL BE VALID" in slow(calibration, 0.49 * fast_wheel, 20.0)
    assert f"needs at least {fast_wheel:.0f} Hz" in slow(calibration, 1000.0, 20.0)
    assert "is enough for this calibration up to 36 km/h" in slow(calibration, slow_wheel, 0.0)


REMARKS: list[tuple[str, Any, str]] = [
    ("pressure_out_of_range", (230e5, 1.3e5, 2.5e5), "[bar] = 230; the calibration holds for 1.3"),
    ("tread_depth_implausible", (8e-6, 5e-4, 0.012), "[mm] = 0.008; allowed are 0.5 .. 12;"),
    ("alpha_out_of_range", (0.1745, -0.0873, 0.0873), "[deg] = 10; calibrated are -5 .. 5;"),
]


@pytest.mark.parametrize(("kind", "values", "said"), REMARKS)
def test_remarks_of_the_fmu_are_told_in_the_units_of_the_options(
    kind: str, values: tuple[float, float, float], said: str
) -> None:
    text = in_options_units(Remark(*values).text(kind))
    assert said in text
    assert not any(word in text for word in ("pascal", "metres", "radians", "[rad]", "[Pa]"))


def test_remarks_without_such_a_unit_stay_as_they_are() -> None:
    for kind in ("other_tire", "Fz_out_of_range", "friction_implausible"):
        text = Remark(5.0, 1.0, 2.0).text(kind)
        assert in_options_units(text) == text
    assert set(TEXTS) >= {kind for kind, _, _ in REMARKS}
