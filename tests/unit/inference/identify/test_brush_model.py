"""The brush of a tire file: what is written comes back, old files are read, gaps are named."""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.inference.identify.test_brush_fit import LOADS, WIDE, make
from tirelib.core.errors import CalibrationError, FormatError, ParameterError
from tirelib.core.parameters import NUMBERS, Number, TireFile, read_tire, write_tire
from tirelib.inference.identify.brush_law import (
    SPECS,
    STORED,
    Reference,
    brush_of,
    predict,
    stored_number,
)
from tirelib.inference.identify.ring_patch import half_lengths

BASE = read_tire("table-6-1")
DATA = make(WIDE, ratios=(-0.05, 0.0), loads=LOADS[:2], pressures=(1.2e5, 1.4e5))
VALUES = {
    "lateral_stiffness": 8e6,
    "longitudinal_stiffness": 1.1e7,
    "friction": 0.93,
    "half_length": 0.061,
    "load_power": 0.45,
    "pressure_power": -0.3,
    "camber_thrust": 0.1,
    "slip_angle_offset": 0.003,
    "slip_ratio_offset": -0.002,
    "Fx_offset": -12.0,
    "Fy_offset": 25.0,
    "Mz_offset": -1.5,
    "yaw_compliance": 3e-5,
    "lateral_compliance": 4e-6,
}
REFERENCE = {"reference_load": 2500.0, "reference_pressure": 1.3e5}


def tire_file(
    values: dict[str, float], more: dict[str, float] | None = None, *, ring: bool = False
) -> TireFile:
    numbers = dict(BASE.numbers) if ring else {}
    numbers.pop("friction", None)
    numbers |= dict(
        stored_number(name, value, 0.05 * abs(value), "fitted", "made up", {"flags": []})
        for name, value in values.items()
    )
    numbers |= {
        name: Number(value, np.nan, "measured", "made up") for name, value in (more or {}).items()
    }
    return TireFile("t", numbers)


def test_every_parameter_of_the_law_has_a_place_in_a_file() -> None:
    assert set(VALUES) == set(SPECS) == set(STORED)
    assert set(STORED.values()) <= set(NUMBERS)


def test_a_brush_alone_is_written_and_read_to_the_last_digit(tmp_path: Path) -> None:
    write_tire(tire_file(VALUES, REFERENCE), tmp_path / "b.toml", "tirelib-model/1")
    file = read_tire(tmp_path / "b.toml")
    found = brush_of(file)
    assert found.tire is None
    assert set(found.values) == set(VALUES)
    for name, value in VALUES.items():
        # the carcass stands there as a stiffness: one division on the way
        assert found.values[name] == pytest.approx(value, rel=1e-15), name
    assert (found.reference.load, found.reference.pressure) == (2500.0, 1.3e5)
    assert file.numbers["bristle_lateral"].std == 0.05 * 8e6
    assert file.numbers["carcass_stiffness"].std == pytest.approx(0.05 / 4e-6)
    wanted = predict(VALUES, DATA, Reference(2500.0, 1.3e5))
    for name in ("Fx", "Fy", "Mz"):
        np.testing.assert_allclose(getattr(found.predict(DATA), name), getattr(wanted, name))
    half = 0.061 * (DATA.load / 2500.0) ** 0.45 * (DATA.pressure / 1.3e5) ** -0.3
    np.testing.assert_allclose(found.parameters(DATA).half_length, half)


def test_a_rigid_carcass_survives(tmp_path: Path) -> None:
    rigid = {**VALUES, "lateral_compliance": 0.0}
    write_tire(tire_file(rigid, REFERENCE), tmp_path / "b.toml")
    assert brush_of(read_tire(tmp_path / "b.toml")).values["lateral_compliance"] == 0.0


def test_without_a_half_length_the_ring_gives_it() -> None:
    plain = {"lateral_stiffness": 8e6, "friction": 0.93}
    found = brush_of(tire_file(plain, ring=True))
    assert found.tire == tire_file(plain, ring=True).tire
    np.testing.assert_allclose(
        found.parameters(DATA).half_length, half_lengths(found.tire, DATA.load, DATA.pressure)
    )
    own = brush_of(tire_file({**plain, "half_length": 0.05}, ring=True))
    assert own.tire is None
    np.testing.assert_allclose(own.parameters(DATA).half_length, 0.05)


def test_a_file_without_brush_says_so() -> None:
    with pytest.raises(CalibrationError, match=r"states no bristle_lateral: .* campaign with slip"):
        brush_of(BASE)
    with pytest.raises(CalibrationError, match=r"nor a complete ring \(ring_radius"):
        brush_of(tire_file({"lateral_stiffness": 8e6, "friction": 0.93}))
    with pytest.raises(CalibrationError, match="load_power but no reference_load"):
        brush_of(tire_file(VALUES, {"reference_pressure": 1.3e5}))


def test_the_ring_of_a_brush_alone_is_missing_only_when_it_is_asked_for(tmp_path: Path) -> None:
    write_tire(tire_file(VALUES, REFERENCE), tmp_path / "b.toml")
    file = read_tire(tmp_path / "b.toml")
    assert "bending_stiffness" in file.missing
    with pytest.raises(ParameterError, match=r"no complete ring, .*\[belt.bending_stiffness\]"):
        _ = file.tire
    assert not BASE.missing


def test_half_a_ring_is_no_brush_alone(tmp_path: Path) -> None:
    ring = {"mass": BASE.numbers["mass"]}
    file = tire_file(VALUES, REFERENCE)
    write_tire(TireFile("t", {**file.numbers, **ring}), tmp_path / "b.toml")
    with pytest.raises(FormatError, match=r"\[belt.bending_stiffness\] is missing"):
        read_tire(tmp_path / "b.toml")


def test_a_law_without_its_reference_is_refused(tmp_path: Path) -> None:
    write_tire(tire_file(VALUES, {"reference_load": 2500.0}), tmp_path / "b.toml")
    with pytest.raises(FormatError, match=r"\[brush.reference_pressure\] is missing") as caught:
        read_tire(tmp_path / "b.toml")
    assert "reference_load" not in str(caught.value)
