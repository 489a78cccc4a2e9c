"""What a tire's numbers may be."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError
from tirelib.core.parameters import FIELDS, Tire, read_tire
from tirelib.core.parameters.tire_file import KINDS
from tirelib.core.units import units_of

TIRE = read_tire("table-6-1").tire


def test_every_field_of_the_table_is_a_field_of_the_tire() -> None:
    assert set(FIELDS) == set(Tire.__dataclass_fields__)
    for field in FIELDS.values():
        assert field.unit in units_of(field.dimension)
        assert field.lowest < field.highest
        assert field.meaning


@given(name=st.sampled_from(list(FIELDS)), share=st.floats(0.0, 1.0))
def test_a_value_in_its_range_is_taken_and_others_stay(name: str, share: float) -> None:
    field = FIELDS[name]
    value = field.lowest + share * (min(field.highest, 1e12) - field.lowest)
    if name in ("ring_radius", "free_radius"):
        value = TIRE.ring_radius + (share - 1.0) * 0.01 if name == "ring_radius" else 0.3126 + share
    changed = TIRE.changed(**{name: value})
    assert getattr(changed, name) == value
    assert all(getattr(changed, n) == getattr(TIRE, n) for n in FIELDS if n != name)


@given(name=st.sampled_from(list(FIELDS)))
def test_a_value_beyond_its_range_is_refused_with_unit_and_meaning(name: str) -> None:
    field = FIELDS[name]
    beyond = [field.lowest - 1e-3 * (1 + abs(field.lowest)), math.nan, -math.inf]
    if math.isfinite(field.highest):
        beyond += [field.highest * 1.01 + 1e-3, math.inf]
    for value in beyond:
        with pytest.raises(ParameterError) as caught:
            TIRE.changed(**{name: value})
        message = str(caught.value)
        assert name in message
        assert field.unit in message
        assert field.meaning in message


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"radial_stifness": 6e5}, ["'radial_stifness' is unknown", "mean radial_stiffness"]),
        ({"zzz": 1.0}, ["'zzz' is unknown", "known are ring_radius"]),
        ({"radial_stiffness": -5.0}, ["radial_stiffness = -5", "N/m^2", "1000"]),
        ({"ring_radius": 0.3125}, ["ring_radius = 312.5 mm", "free_radius = 312.5 mm", "below"]),
        ({"ring_radius": 0.4}, ["is not below free_radius", "correct"]),
        ({"innerliner_offset": 0.002}, ["innerliner_offset = 0.002", "inward"]),
        ({"mass": "3"}, ["mass = '3' is not a number", "kg/m"]),
        ({"mass": -1.0, "damping": 2.0}, ["mass = -1", "damping = 2"]),
    ],
)
def test_refusals_name_the_fault_and_the_way_out(
    changes: dict[str, float], parts: list[str]
) -> None:
    with pytest.raises(ParameterError) as caught:
        TIRE.changed(**changes)
    for part in parts:
        assert part in str(caught.value)


def test_kinds_are_those_of_the_contract() -> None:
    assert KINDS == ("measured", "fitted", "literature", "assumed")
