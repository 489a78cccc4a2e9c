"""The .tir reader and writer: nothing is lost, units are obeyed, all faults come at once."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.parameters.tir import (
    TirEntry,
    TirFile,
    TirLine,
    TirSection,
    format_tir,
    parse_tir,
    read_tir,
    write_tir,
)
from tirelib.core.parameters.tir_units import BASES, factor, words

UNITS = "LENGTH='meter'\nFORCE='newton'\nANGLE='radians'\nMASS='kg'\nTIME='second'\n"
TEXT = f"""! invented numbers, no real tire
$---------------------------------------units
[UNITS] $ all SI
{UNITS}
[MODEL]
PROPERTY_FILE_FORMAT = 'USER'
FITTYP    = 61          ! version
USE_MODE  = 14
ROAD_DIRECTION =        $ nothing here
[VENDOR_X]
PLANT     = "o'Brien, 3 $ off"   $ vendor's own
CODE      = XL
SHARE     = 1.5d-03
[SHAPE]
{{radial width}}
 1.0    0.0
 0.9    1.0
[VERTICAL]
FNOMIN    = 4.1E+003
[LATERAL_COEFFICIENTS]
PCY1 = 1.3
"""


def test_every_kind_of_line_is_read() -> None:
    tire = parse_tir(TEXT)
    assert tire.fit_type == 61
    assert tire.get("PLANT") == "o'Brien, 3 $ off"
    assert tire.get("code") == "XL"
    assert tire.get("SHARE") == 1.5e-3
    assert tire.get("ROAD_DIRECTION") is None
    assert tire.get("FNOMIN") == 4100.0
    assert tire.get("PCY1", "LATERAL_COEFFICIENTS") == 1.3
    assert tire.get("PCY1", "VERTICAL") is None
    assert tire.preamble[0].text == "! invented numbers, no real tire"
    shape = next(s for s in tire.sections if s.name == "SHAPE")
    assert [line.text for line in shape.lines] == ["{radial width}", " 1.0    0.0", " 0.9    1.0"]
    vendor = next(s for s in tire.sections if s.name == "VENDOR_X")
    assert [e.comment for e in vendor.entries] == [" vendor's own", "", ""]


def test_written_file_reads_the_same(tmp_path: Path) -> None:
    tire = parse_tir(TEXT)
    write_tir(tire, tmp_path / "a.tir")
    assert read_tir(tmp_path / "a.tir") == tire


def test_line_ends_and_old_encodings_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.tir"
    path.write_bytes(TEXT.replace("\n", "\r\n").replace("no real", "kein £").encode("latin-1"))
    assert read_tir(path).sections == parse_tir(TEXT).sections


words_of_text = st.text(
    st.characters(min_codepoint=32, max_codepoint=0x17F, exclude_characters="\x7f"), max_size=12
).filter(lambda s: s.isprintable() and not ("'" in s and '"' in s))
keys = st.from_regex(r"[A-Z][A-Z0-9_]{0,11}", fullmatch=True)
values = st.one_of(st.none(), st.floats(allow_nan=False, allow_infinity=False), words_of_text)


@given(table=st.dictionaries(keys, st.tuples(values, words_of_text), max_size=12))
def test_any_value_survives_the_round_trip(table: dict[str, tuple[object, str]]) -> None:
    entries = tuple(
        TirEntry("V_" + key, value, comment.rstrip()) for key, (value, comment) in table.items()
    )
    base = parse_tir("[UNITS]\n" + UNITS + "[MODEL]\nFITTYP=52\n")
    tire = TirFile(
        (*base.sections, TirSection("OWN", (TirLine("! x"), *entries))), (), 52, base.factors
    )
    again = parse_tir(format_tir(tire))
    assert again == tire
    for one, two in zip(tire.sections[-1].entries, again.sections[-1].entries, strict=True):
        assert repr(one.value) == repr(two.value)  # 0.0 and -0.0 are equal but not the same


def test_units_are_obeyed() -> None:
    text = """[UNITS]
LENGTH='mm'
FORCE='kN'
ANGLE='degrees'
MASS='gram'
TIME='ms'
PRESSURE='psi'
[MODEL]
FITTYP=61
LONGVL=16.6
[DIMENSION]
UNLOADED_RADIUS=310
[VERTICAL]
FNOMIN=4.5
VERTICAL_STIFFNESS=0.2
[INERTIA]
IYY=1e9
[OPERATING_CONDITIONS]
NOMPRES=30
[SLIP_ANGLE_RANGE]
ALPMAX=90
[LATERAL_COEFFICIENTS]
PDY1=0.9
"""
    tire = parse_tir(text)
    expected = {
        "LONGVL": 16.6,
        "UNLOADED_RADIUS": 0.31,
        "FNOMIN": 4500.0,
        "VERTICAL_STIFFNESS": 2e5,
        "IYY": 1.0,
        "NOMPRES": 206842.718795,
        "ALPMAX": 1.5707963267949,
        "PDY1": 0.9,
    }
    for key, value in expected.items():
        assert tire.number(key) == pytest.approx(value, rel=1e-9), key
    assert tire.number("WIDTH") is None


DEG = 0.017453292519943295


@pytest.mark.parametrize(
    ("key", "given", "si"),
    [
        ("GRAVITY", 9.81e-3, 9.81),  # mm/ms^2
        ("YAW_STIFFNESS", 4.0, 4.0 / DEG),  # kN mm/deg
        ("VERTICAL_DAMPING", 5e-4, 0.5),  # kN ms/mm
        ("BELT_IYY", 7e8, 0.7),  # g mm^2
        ("CAMMAX", 5.0, 5.0 * DEG),
    ],
)
def test_a_number_follows_the_units_that_its_own_is_made_of(
    key: str, given: float, si: float
) -> None:
    units = "LENGTH='mm'\nFORCE='kN'\nANGLE='degrees'\nMASS='gram'\nTIME='ms'\n"
    tire = parse_tir(f"[UNITS]\n{units}[MODEL]\nFITTYP=61\n[X]\n{key}={given!r}\n")
    assert tire.number(key) == pytest.approx(si, rel=1e-9)


def test_pressure_without_unit_is_force_per_length_squared() -> None:
    text = TEXT.replace("'meter'", "'mm'") + "[OPERATING_CONDITIONS]\nNOMPRES=0.25\n"
    assert parse_tir(text).number("NOMPRES") == pytest.approx(250000.0)


@pytest.mark.parametrize(
    ("base", "word", "si"),
    [
        ("length", "Inch", 0.0254),
        ("length", "foot", 0.3048),
        ("force", "pound_force", 4.4482216),
        ("force", "KILO_NEWTON", 1e3),
        ("force", "kg_force", 9.80665),
        ("mass", "slug", 14.5939029),
        ("mass", "pound_mass", 0.45359237),
        ("time", "minute", 60.0),
        ("pressure", "bar", 1e5),
        ("pressure", "kPa", 1e3),
        ("angle", "deg", 0.017453292519943295),
    ],
)
def test_unit_words(base: str, word: str, si: float) -> None:
    assert factor(base, word) == pytest.approx(si, rel=1e-8)


def test_every_unit_word_has_a_factor() -> None:
    for base in BASES:
        for word in words(base):
            assert factor(base, word) is not None


def test_all_faults_are_listed_at_once() -> None:
    bad = """stray = 1
[UNITS]
LENGTH='cubit'
FORCE='newton'
ANGLE='radians'
TIME='second'
[MODEL]
FITTYP = 77
this is nothing
PLANT = 'open
9KEY = 3
[VERTICAL]
FNOMIN = 'much'
FNOMIN = 1e999
[LATERAL_COEFFICIENTS]
PCY1 = 1
PCY1 = 2
PDY1 = none
"""
    with pytest.raises(FormatError) as caught:
        parse_tir(bad, where="x.tir")
    text = str(caught.value)
    for part in (
        "line 1: 'stray = 1' stands before the first [SECTION]",
        "LENGTH = 'cubit' is not known; allowed are meter",
        "[UNITS] has no MASS",
        "FITTYP = 77.0; allowed are 5, 6, 52, 60, 61, 62",
        "line 9: 'this is nothing'",
        "line 10: PLANT has text without a closing quote",
        "line 11: key '9KEY'",
        "FNOMIN = 'much' is text",
        "line 14: FNOMIN = 1e999",
        "PCY1 stands twice",
        "PDY1 = 'none' is text",
    ):
        assert part in text, part
    assert len(caught.value.problems) == 11
    assert all(problem.startswith("x.tir: ") for problem in caught.value.problems)


@pytest.mark.parametrize(
    ("line", "fit_type"),
    [("PROPERTY_FILE_FORMAT='PAC2002'", 6), ("PROPERTY_FILE_FORMAT='MF_05'", 5), ("FITTYP=62", 62)],
)
def test_version_is_recognised(line: str, fit_type: int) -> None:
    assert parse_tir(f"[UNITS]\n{UNITS}[MODEL]\n{line}\n").fit_type == fit_type


def test_what_cannot_be_written_is_refused() -> None:
    base = parse_tir(TEXT)
    for value in (float("inf"), "a'b\"c", "two\nlines"):
        section = TirSection("OWN", (TirEntry("KEY", value),))
        with pytest.raises(ParameterError, match="KEY = "):
            format_tir(TirFile((*base.sections, section)))


def test_text_is_no_number() -> None:
    with pytest.raises(ParameterError, match="CODE = 'XL' is text"):
        parse_tir(TEXT).number("CODE")


def test_units_are_words_and_no_data() -> None:
    """[UNITS] MASS = 'kg' stands before [INERTIA] MASS."""
    assert parse_tir(TEXT + "[INERTIA]\nMASS=9.3\n").number("MASS") == 9.3
    assert parse_tir(TEXT).number("MASS") is None


def test_two_different_numbers_are_refused_with_both_places() -> None:
    tire = parse_tir(TEXT + "[VENDOR_Y]\nFNOMIN = 5000\n")
    assert tire.places("fnomin") == (("VERTICAL", 4100.0), ("VENDOR_Y", 5000.0))
    with pytest.raises(ParameterError, match=r"4100.0 in \[VERTICAL\] but 5000.0 in \[VENDOR_Y\]"):
        tire.number("FNOMIN")
    assert parse_tir(TEXT + "[VENDOR_Y]\nFNOMIN = 4100\n").number("FNOMIN") == 4100.0


@pytest.mark.parametrize("place", ["nowhere.tir", "."])
def test_what_is_no_file_is_told(place: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=f"{place}: cannot be read"):
        read_tir(f"{tmp_path}/{place}")


@pytest.mark.parametrize(
    "data",
    [
        TEXT.encode("utf-16"),
        TEXT.encode("utf-16-le"),
        bytes(range(256)) * 40,
        TEXT.encode() + b"\x00\x01 more\n\x02\n",
        b"time,load\n0.0,4000\n0.1,4010\n",
        b"",
    ],
)
def test_what_is_no_tir_file_is_told_once(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.tir"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=r"a\.tir: .*give another") as caught:
        read_tir(path)
    assert len(caught.value.problems) == 1


def test_an_end_mark_of_old_systems_is_accepted_after_a_comment() -> None:
    assert parse_tir(TEXT + "! end \x1a").fit_type == 61
