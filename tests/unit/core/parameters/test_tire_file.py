"""Tire files: the ones that come along, exact round trips, and a message for every fault."""

import math
import tomllib
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.parameters import FIELDS, Number, Tire, TireFile, find_tire, read_tire, write_tire
from tirelib.core.parameters.tire_file import KINDS, models_folder
from tirelib.physics.contact.radial import load
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.ring import Ring

SHIPPED = ["gong", "jenkins", "kim", "table-6-1", "table-6-2-195-65r15", "zegelaar"]
BASE = read_tire("table-6-1")


def test_the_tires_of_the_dissertation_come_along() -> None:
    assert set(SHIPPED) <= {path.stem for path in (models_folder() / "tires").glob("*.toml")}


@pytest.mark.parametrize("name", SHIPPED)
def test_each_tire_makes_a_physical_contact(name: str) -> None:
    tire = read_tire(name).tire
    contact = load(compliance(Ring.of(tire, tire.pressure), 59.0, 60), Tread.of(tire), 4000.0)
    assert 0.01 < contact.deflection[0] < 0.035
    length = np.diff(contact.edges[0])[0] * tire.free_radius
    assert 0.09 < length < 0.15  # a passenger car's tire at 4 kN
    assert -0.006 < contact.pressure_centre[0] < 0  # damping: toward the entry
    assert (contact.pressure > 0).all()


@pytest.mark.parametrize("name", SHIPPED)
def test_each_number_says_where_it_is_from(name: str) -> None:
    for number in read_tire(name).numbers.values():
        assert number.kind in ("literature", "assumed")
        assert "Table 6-" in number.source or "Eq." in number.source


def test_values_of_table_6_1() -> None:
    assert BASE.tire == Tire(
        ring_radius=0.30,
        free_radius=0.3125,
        belt_width=0.165,
        tread_thickness=0.0125,
        innerliner_offset=-0.002,
        bending_stiffness=1.144,
        mass=3.16,
        pressure=1.32e5,
        radial_stiffness=6.24e5,
        tangential_stiffness=2.18e5,
        tread_stiffness=7.5e7,
        damping=0.04,
        tread_shear_stiffness=2.5e7,
        friction=0.65,
    )
    assert BASE.numbers["innerliner_offset"].kind == "assumed"


def test_table_6_2_as_corrected() -> None:
    file = read_tire("table-6-2-195-65r15")
    tire = file.tire
    assert tire.tread_stiffness == 9.9e7  # printed 99e7
    assert tire.innerliner_offset == -0.002  # printed 2
    assert tire.free_radius - tire.ring_radius == pytest.approx(tire.tread_thickness, abs=1e-12)
    # Eq. (111): k_t = E b / tau
    rubber = 6.58e6 * tire.belt_width / tire.tread_thickness
    assert rubber == pytest.approx(tire.tread_stiffness, rel=0.01)
    for bar, k_u in ((2.5, 3.09e5), (2.1, 3.09e5), (1.7, 2.94e5), (1.3, 2.84e5)):
        ring = Ring.of(tire, bar * 1e5)
        assert ring.radial_stiffness == pytest.approx(k_u, rel=0.04)  # a line through four
        assert 0.97e5 < ring.tangential_stiffness < 1.19e5
    assert file.numbers["free_radius"].notes["at_bar"]["1.3"] == 316.72


def test_table_6_3() -> None:
    rows = {
        "gong": (1.571, 1.16e6, 4.70e5, 7.5e7),
        "jenkins": (1.8829, 4.36e5, 0.0, 9.81e7),
        "kim": (2.0, 6.30e5, 1.89e5, 5.14e7),
        "zegelaar": (4.0, 6.49e5, 1.93e5, 7.906e7),  # sidewall: a tenth of the print
    }
    for name, row in rows.items():
        tire = read_tire(name).tire
        assert row == (
            tire.bending_stiffness,
            tire.radial_stiffness,
            tire.tangential_stiffness,
            tire.tread_stiffness,
        )
    for name in ("radial_stiffness", "tangential_stiffness"):
        source = read_tire("zegelaar").numbers[name].source
        assert "DOUBTFUL" in source
        assert "printed" in source
    jenkins = read_tire("jenkins").tire
    for bar, k_u in ((2.01, 4.36e5), (1.67, 3.48e5), (1.26, 2.62e5)):
        assert Ring.of(jenkins, bar * 1e5).radial_stiffness == pytest.approx(k_u, rel=0.03)


text = st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), max_size=20)
keys = st.text("xyz", min_size=3, max_size=8)  # unlike every table's name: that would be a typo


@st.composite
def files(draw: st.DrawFn) -> TireFile:
    numbers = {}
    for name, field in FIELDS.items():
        value = draw(st.floats(field.lowest, min(field.highest, 1e15)))
        if name == "ring_radius":
            value = draw(st.floats(0.05, 1.0))
        if name == "free_radius":
            value = draw(st.floats(1.0, 2.0, exclude_min=True))
        if math.isinf(field.highest) and draw(st.booleans()):
            value = math.inf
        numbers[name] = Number(
            value,
            draw(st.one_of(st.just(math.nan), st.floats(0.0, 1e9))),
            draw(st.sampled_from(KINDS)),
            draw(text),
            draw(st.dictionaries(keys, st.one_of(st.floats(-9, 9), text), max_size=2)),
        )
    return TireFile(draw(text), numbers, draw(st.dictionaries(keys, st.just({"a": 1}), max_size=2)))


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    max_examples=10,  # each holds every number of a tire
)
@given(files())
def test_a_written_tire_reads_back_from_one_unit_a_quantity(tmp_path: Path, file: TireFile) -> None:
    write_tire(file, tmp_path / "t.toml")
    back = read_tire(tmp_path / "t.toml")
    document = tomllib.loads((tmp_path / "t.toml").read_text(encoding="utf-8"))
    assert back.name == file.name
    assert dict(back.extra) == dict(file.extra)
    for name, number in file.numbers.items():
        found = back.numbers[name]
        assert (found.kind, found.source, found.notes) == (
            number.kind,
            number.source,
            number.notes,
        )
        # one rounding each way
        assert found.value == pytest.approx(number.value, rel=4e-16)
        assert found.std == pytest.approx(number.std, rel=4e-16, nan_ok=True)
        assert document[FIELDS[name].group][name]["unit"] == FIELDS[name].unit


def test_a_number_at_its_limit_reads_back(tmp_path: Path) -> None:
    name = "tangential_pressure_slope"
    numbers = {**BASE.numbers, name: Number(FIELDS[name].highest, math.nan, "assumed", "its limit")}
    write_tire(TireFile("limit", numbers), tmp_path / "t.toml")
    back = read_tire(tmp_path / "t.toml").numbers[name].value
    assert back == pytest.approx(FIELDS[name].highest, rel=4e-16)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_tires_survive_a_round_trip_in_their_usual_units(name: str, tmp_path: Path) -> None:
    file = read_tire(name)
    write_tire(file, tmp_path / "made" / "t.toml")
    back = read_tire(tmp_path / "made" / "t.toml").tire
    assert asdict(back) == pytest.approx(asdict(file.tire), rel=4e-16)
    written = (tmp_path / "made" / "t.toml").read_text()
    for number in file.numbers:
        assert f"[{FIELDS[number].group}.{number}]" in written
    assert 'unit = "bar"' in written


def faulty(tmp_path: Path, old: str, new: str) -> str:
    """Return what is said about the Table 6-1 tire after one change of its text."""
    text = find_tire("table-6-1").read_text()
    assert old in text
    path = tmp_path / "faulty.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError) as caught:
        read_tire(path)
    assert all(str(path) in problem for problem in caught.value.problems)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("radial_stiffness", "radial_stifness", ["is unknown", "did you mean radial_stiffness"]),
        ("radial_stiffness", "radial_stifness", ["[sidewall.radial_stiffness] is missing"]),
        ('unit = "mm"', 'unit = "bar"', ["[geometry.ring_radius]", "'bar'", "pressure", "mm"]),
        ('unit = "mm"', 'unit = "furlong"', ["'furlong'", "not a unit that is known", "mm"]),
        ('unit = "mm"', 'unit = ""', ["no unit is given", "length", "mm"]),
        (', unit = "mm"', "", ["[geometry.ring_radius]", "lacks value or unit"]),
        ("value = 300.0, ", "", ["lacks value or unit"]),
        ("value = 300.0", 'value = "300"', ["value = '300' is not a number"]),
        ("value = 300.0", "value = true", ["value = True is not a number"]),
        ("value = 300.0", "value = nan", ["ring_radius = nan is not a number"]),
        ("value = 300.0", "value = 3e5", ["ring_radius = 300 (SI) is outside", "mm"]),
        ("value = 300.0", "value = 312.5", ["is not below free_radius", "exchange"]),
        ("value = 6.24e5", "value = -6.24e5", ["radial_stiffness = -624000", "outside", "k_u"]),
        ("value = -2.0", "value = 2.0", ["innerliner_offset = 0.002", "inward"]),
        ('kind = "literature"', 'kind = "guess"', ["kind = 'guess'", "measured, fitted"]),
        ('unit = "mm"', 'unit = "mm", std = -1.0', ["std = -1.0", ">= 0"]),
        ('unit = "mm"', 'unit = "mm", std = inf', ["std = inf", "finite"]),
        ('unit = "mm"', 'unit = "mm", std = "x"', ["std = 'x'"]),
        ("[geometry]", "[geometri]", ["[geometri] is not a table", "did you mean [geometry]"]),
        ("[geometry]", "[geometry", ["is not TOML"]),
        ("[belt]", "[[belt]]", ["[belt] is not a table"]),
        ("[belt]", "[belt]\nfriction = 1", ["[belt.friction]: stands in [tread]"]),
        ('name = "Table', 'mass = 3\nname = "Table', ["mass is at the top level", "[belt]"]),
        ("tirelib-tire/1", "tirelib-tire/9", ["'tirelib-tire/9'", "'tirelib-tire/1'", "give"]),
        ('format = "tirelib-tire/1"', "", ["format = None", "allowed"]),
    ],
)
def test_every_fault_has_its_message(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    message = faulty(tmp_path, old, new)
    for part in parts:
        assert part in message


def test_all_faults_are_named_at_once(tmp_path: Path) -> None:
    text = find_tire("table-6-1").read_text()
    text = text.replace("value = 6.24e5", "value = -1.0").replace("friction =", "frction =")
    (tmp_path / "t.toml").write_text(text.replace('"kg/m"', '"kg"'))
    with pytest.raises(FormatError) as caught:
        read_tire(tmp_path / "t.toml")
    assert len(caught.value.problems) == 3


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "t.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FormatError, match="is not TOML"):
        read_tire(tmp_path / "t.toml")


def test_an_unknown_tire_is_answered_with_the_nearest() -> None:
    with pytest.raises(ParameterError, match="did you mean table-6-1"):
        read_tire("table-6.1")
    with pytest.raises(ParameterError, match="known: gong, jenkins"):
        read_tire("qqqqqqq")


def test_other_tables_of_a_model_are_kept(tmp_path: Path) -> None:
    text = find_tire("table-6-1").read_text().replace("tirelib-tire/1", "tirelib-model/1")
    (tmp_path / "m.toml").write_text(text + "\n[history]\nsteps = 3\n")
    file = read_tire(tmp_path / "m.toml")
    assert file.extra == {"history": {"steps": 3}}
    write_tire(file, tmp_path / "n.toml", "tirelib-model/1")
    assert read_tire(tmp_path / "n.toml") == read_tire(tmp_path / "m.toml") or math.isnan(
        file.numbers["mass"].std
    )
    assert read_tire(tmp_path / "n.toml").extra == file.extra


def test_a_belt_outside_the_tread_is_refused(tmp_path: Path) -> None:
    file = read_tire("table-6-1")
    free = file.numbers["free_radius"].value
    ring = replace(file.numbers["ring_radius"], value=free)
    path = tmp_path / "tire.toml"
    write_tire(replace(file, numbers={**file.numbers, "ring_radius": ring}), path)
    with pytest.raises(FormatError, match=r"tire\.toml: ring_radius = .* is not below free_radius"):
        read_tire(path)
