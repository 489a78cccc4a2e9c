"""The table of units: one test a row, each number from its definition."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import UnitError
from tirelib.core.units import (
    DIMENSIONS,
    TABLE,
    UnitRow,
    dimension_of,
    dimensions_of_unit,
    from_si,
    to_si,
    units_of,
)

# What one (for temperatures: 100) of the unit is in SI, written out from the definitions and
# not taken from the table.
ONE = {
    ("N", "force"): 1.0,
    ("daN", "force"): 10.0,
    ("kN", "force"): 1000.0,
    ("lbf", "force"): 0.45359237 * 9.80665,
    ("lb", "force"): 0.45359237 * 9.80665,
    ("kgf", "force"): 9.80665,
    ("kp", "force"): 9.80665,
    ("Pa", "pressure"): 1.0,
    ("hPa", "pressure"): 100.0,
    ("mbar", "pressure"): 100.0,
    ("kPa", "pressure"): 1000.0,
    ("bar", "pressure"): 100000.0,
    ("MPa", "pressure"): 1000000.0,
    ("psi", "pressure"): 6894.757293168361,
    ("PSI", "pressure"): 6894.757293168361,
    ("kgf/cm2", "pressure"): 98066.5,
    ("m/s", "speed"): 1.0,
    ("km/h", "speed"): 1000.0 / 3600.0,
    ("kmh", "speed"): 1000.0 / 3600.0,
    ("kph", "speed"): 1000.0 / 3600.0,
    ("mph", "speed"): 1609.344 / 3600.0,
    ("rad", "angle"): 1.0,
    ("mrad", "angle"): 0.001,
    ("deg", "angle"): math.pi / 180.0,
    ("degree", "angle"): math.pi / 180.0,
    ("degrees", "angle"): math.pi / 180.0,
    ("°", "angle"): math.pi / 180.0,
    ("1", "ratio"): 1.0,
    ("-", "ratio"): 1.0,
    ("none", "ratio"): 1.0,
    ("%", "ratio"): 0.01,
    ("rad/s", "angular_speed"): 1.0,
    ("deg/s", "angular_speed"): math.pi / 180.0,
    ("rpm", "angular_speed"): 2.0 * math.pi / 60.0,
    ("1/min", "angular_speed"): 2.0 * math.pi / 60.0,
    ("Hz", "angular_speed"): 2.0 * math.pi,
    ("Hz", "frequency"): 1.0,
    ("kHz", "frequency"): 1000.0,
    ("m", "length"): 1.0,
    ("cm", "length"): 0.01,
    ("mm", "length"): 0.001,
    ("um", "length"): 1e-6,
    ("in", "length"): 0.0254,
    ("ft", "length"): 0.3048,
    ("Nm", "moment"): 1.0,
    ("N.m", "moment"): 1.0,
    ("N·m", "moment"): 1.0,
    ("N*m", "moment"): 1.0,
    ("N-m", "moment"): 1.0,
    ("kNm", "moment"): 1000.0,
    ("Nmm", "moment"): 0.001,
    ("N.mm", "moment"): 0.001,
    ("N·mm", "moment"): 0.001,
    ("N*mm", "moment"): 0.001,
    ("N-mm", "moment"): 0.001,
    ("lbf.ft", "moment"): 1.3558179483314004,
    ("ft-lb", "moment"): 1.3558179483314004,
    ("s", "time"): 1.0,
    ("sec", "time"): 1.0,
    ("ms", "time"): 0.001,
    ("us", "time"): 1e-6,
    ("min", "time"): 60.0,
    ("h", "time"): 3600.0,
    ("K", "temperature"): 100.0,
    ("degC", "temperature"): 373.15,
    ("°C", "temperature"): 373.15,
    ("deg C", "temperature"): 373.15,
    ("degF", "temperature"): 310.92777777777775,
    ("deg F", "temperature"): 310.92777777777775,
    ("°F", "temperature"): 310.92777777777775,
    ("1", "strain"): 1.0,
    ("strain", "strain"): 1.0,
    ("m/m", "strain"): 1.0,
    ("%", "strain"): 0.01,
    ("mm/m", "strain"): 0.001,
    ("ustrain", "strain"): 1e-6,
    ("microstrain", "strain"): 1e-6,
    ("um/m", "strain"): 1e-6,
    ("uE", "strain"): 1e-6,
    ("ue", "strain"): 1e-6,
    ("kg", "mass"): 1.0,
    ("g", "mass"): 0.001,
    ("tonne", "mass"): 1000.0,
    ("lb", "mass"): 0.45359237,
    ("slug", "mass"): 0.45359237 * 9.80665 / 0.3048,
    ("m/s2", "acceleration"): 1.0,
    ("m/s^2", "acceleration"): 1.0,
    ("g", "acceleration"): 9.80665,
    ("V", "voltage"): 1.0,
    ("mV", "voltage"): 0.001,
    ("N/m", "stiffness"): 1.0,
    ("N/mm", "stiffness"): 1000.0,
    ("kN/m", "stiffness"): 1000.0,
    ("N/m^2", "line_stiffness"): 1.0,
    ("kN/m^2", "line_stiffness"): 1000.0,
    ("N/m^2/bar", "stiffness_per_pressure"): 1e-5,
    ("N/m^2/Pa", "stiffness_per_pressure"): 1.0,
    ("N m^2", "bending_stiffness"): 1.0,
    ("Nm^2", "bending_stiffness"): 1.0,
    ("kg/m", "line_density"): 1.0,
    ("kg m", "rotary_inertia"): 1.0,
    ("1/m", "curvature"): 1.0,
    ("1/mm", "curvature"): 1000.0,
    ("rad/Nm", "compliance"): 1.0,
    ("deg/Nm", "compliance"): 0.017453292519943295,
}

rows = pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row.unit}-{row.dimension}")


@rows
def test_one_of_each_unit_is_what_its_definition_says(row: UnitRow) -> None:
    given_value = 100.0 if row.dimension == "temperature" else 1.0
    expected = ONE[row.unit, row.dimension]
    assert to_si(given_value, row.unit, row.dimension) == pytest.approx(expected, rel=1e-14)


def test_no_row_stands_twice_and_none_is_untested() -> None:
    names = [(row.unit, row.dimension) for row in TABLE]
    assert len(set(names)) == len(names)
    assert set(names) == set(ONE)


@given(row=st.sampled_from(TABLE), value=st.floats(-1e6, 1e6))
def test_there_and_back_changes_nothing(row: UnitRow, value: float) -> None:
    back = from_si(to_si(value, row.unit, row.dimension), row.unit, row.dimension)
    # 1e-9 absolute: a temperature near 0 loses the digits of its 273.15 K
    assert back == pytest.approx(value, rel=1e-12, abs=1e-9)


@given(values=st.lists(st.floats(-1e6, 1e6), min_size=1), row=st.sampled_from(TABLE))
def test_an_array_converts_like_its_elements(values: list[float], row: UnitRow) -> None:
    array = to_si(np.array(values), row.unit, row.dimension)
    np.testing.assert_array_equal(array, [to_si(v, row.unit, row.dimension) for v in values])


def test_the_argument_is_left_alone() -> None:
    values = np.array([1.0, 2.0])
    to_si(values, "kN", "force")
    from_si(values, "kN", "force")
    np.testing.assert_array_equal(values, [1.0, 2.0])


@pytest.mark.parametrize("unit", ["µm/m", "μm/m", " ustrain ", "µstrain", "με", "µE"])
def test_blanks_and_greek_letters_are_tolerated(unit: str) -> None:
    assert to_si(1.0, unit, "strain") == 1e-6


def test_an_unknown_unit_names_those_allowed() -> None:
    with pytest.raises(UnitError, match=r"'furlong' is not a unit .* allowed for length are m, cm"):
        to_si(1.0, "furlong", "length")


def test_a_unit_of_another_dimension_is_named_as_such() -> None:
    with pytest.raises(UnitError, match=r"'bar' is a unit of pressure; allowed for force are N"):
        from_si(1.0, "bar", "force")


def test_a_missing_unit_is_refused() -> None:
    with pytest.raises(UnitError, match=r"no unit is given for a speed; allowed are m/s, km/h"):
        to_si(1.0, " ", "speed")


def test_an_unknown_dimension_names_those_allowed() -> None:
    with pytest.raises(UnitError, match=r"dimension 'colour' is unknown; allowed are force, pres"):
        to_si(1.0, "N", "colour")


def test_case_counts_since_milli_is_not_mega() -> None:
    with pytest.raises(UnitError, match="'KN' is not a unit"):
        to_si(1.0, "KN", "force")


@pytest.mark.parametrize(
    ("quantity", "dimension"),
    [
        ("Fy", "force"),
        ("strain_12", "strain"),
        ("tread_temperature", "temperature"),
        ("omega", "angular_speed"),
        ("whatever", None),
    ],
)
def test_a_quantity_knows_its_dimension(quantity: str, dimension: str | None) -> None:
    assert dimension_of(quantity) == dimension


def test_a_unit_knows_where_it_may_stand() -> None:
    assert dimensions_of_unit("%") == ("ratio", "strain")
    assert dimensions_of_unit("g") == ("acceleration", "mass")
    assert dimensions_of_unit("t") == ()  # a column's name, not tonnes
    assert dimensions_of_unit("parsec") == ()
    assert all(units_of(dimension) for dimension in DIMENSIONS)
