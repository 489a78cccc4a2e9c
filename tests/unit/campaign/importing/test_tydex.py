"""TYDEX 1.3: what is written is read again; fixed columns; every fault with its line."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.campaign.importing import (
    TydexChannel,
    TydexEntry,
    TydexFile,
    read_table,
    read_tydex,
    write_tydex,
)
from tirelib.core.errors import FormatError, ParameterError, ShapeError

# Written by hand, column by column: name 10, comment 30, unit 10, then 10 characters a value.
BY_HAND = """\
! a comment line
**HEADER
RELEASE   Release of TYDEX-Format                 1.3
MEASID    Measurement ID                          made up, day 2

**COMMENTS
cornering, hand-written
**CONSTANTS
INFLPRES  Inflation pressure            bar       2.3
LOCATION  Where                                   nowhere
**MEASURCHANNELS
RUNTIME   Running time                  s
SLIPANGL  Slip angle                    deg       1         0         0
FYW       Lateral force                 kN        0.001     0         0
INCLANGL  Camber                        deg       0.5       2.0       -1.0
**MEASURDATA
       0.0      -1.0     820.0       0.0
      0.01       0.0      10.0       4.0
      0.02       1.0    -805.0      -2.0
**MODELPARAMETERS
ignored
**END
after the end nobody reads **
"""

name = st.text(st.sampled_from("ABCDEFGHXYZ0123456789_"), min_size=1, max_size=10)
text = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=30).map(str.strip)
number = st.floats(-9.9e7, 9.9e7)


@st.composite
def files(draw: st.DrawFn) -> TydexFile:
    names = draw(st.lists(name, min_size=1, max_size=6, unique=True))
    channels = tuple(
        TydexChannel(
            n,
            draw(text),
            draw(st.sampled_from(["N", "deg", "km/h", "-", ""])),
            draw(st.sampled_from([1.0, 0.001, -1.0])),
            draw(st.integers(-99, 99)) / 4,
            draw(st.integers(-99, 99)) / 8,
        )
        for n in names
    )
    rows = draw(st.integers(1, 5))
    cells = draw(st.lists(number, min_size=rows * len(names), max_size=rows * len(names)))
    constants = tuple(TydexEntry(n, draw(text), "N", draw(text)) for n in ("CONST1", "CONST2"))
    comments = tuple(
        c for c in draw(st.lists(text, max_size=3)) if c and not c.startswith(("!", "**"))
    )
    return TydexFile(
        channels, np.reshape(cells, (rows, len(names))), comments=comments, constants=constants
    )


@given(content=files())
def test_what_is_written_is_read_again(
    content: TydexFile, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("tydex") / "a.tdx"
    write_tydex(path, content)
    back = read_tydex(path)
    assert back.channels == content.channels
    assert (back.header, back.constants) == (content.header, content.constants)
    assert back.comments == content.comments
    # nine characters, one of them a sign and one a point
    bound = 5e-7 * np.maximum(1.0, np.abs(content.recorded)) * (1.0 + 1e-9)
    assert (np.abs(back.recorded - content.recorded) <= bound).all()

    first = path.read_bytes()
    write_tydex(path, back)
    assert path.read_bytes() == first  # and nothing more is lost


def by_hand(folder: Path, old: str = "", new: str = "") -> Path:
    assert old in BY_HAND
    path = folder / "a.tdx"
    path.write_text(BY_HAND.replace(old, new, 1) if old else BY_HAND, encoding="latin-1")
    return path


def test_a_file_written_by_hand_is_read_by_its_columns(tmp_path: Path) -> None:
    content = read_tydex(by_hand(tmp_path))
    assert content.header[1] == TydexEntry("MEASID", "Measurement ID", "", "made up, day 2")
    assert content.comments == ("cornering, hand-written",)
    assert content.constants[0].number() == 2.3
    assert content.constants[1].number() is None
    assert content.channels[2] == TydexChannel("FYW", "Lateral force", "kN", 0.001)
    assert content.skipped == ("MODELPARAMETERS",)
    physical = content.physical()
    np.testing.assert_allclose(physical[:, 2], [0.82, 0.01, -0.805])
    np.testing.assert_allclose(physical[:, 3], [0.0, 2.0, -1.0])  # 0.5 (x + 2) - 1


def test_the_table_has_constants_as_columns_and_says_what_it_did(tmp_path: Path) -> None:
    table = read_table(by_hand(tmp_path))
    np.testing.assert_array_equal(table.columns["INFLPRES"].rows(3), [2.3, 2.3, 2.3])
    assert [c.unit for c in table.columns.values()] == ["s", "deg", "kN", "deg", "bar"]
    assert "nowhere" in table.left_out["LOCATION"]
    assert any("INCLANGL: the offset 2 was added" in note for note in table.notes)
    assert any("**MODELPARAMETERS is skipped" in note for note in table.notes)


def test_touching_columns_and_blanks_are_both_read(tmp_path: Path) -> None:
    touching = "      0.01-12345.678-1234567.8-123456.78"
    path = by_hand(tmp_path, "      0.01       0.0      10.0       4.0", touching)
    np.testing.assert_array_equal(
        read_tydex(path).recorded[1], [0.01, -12345.678, -1234567.8, -123456.78]
    )
    path = by_hand(tmp_path, "      0.01       0.0      10.0       4.0", "0.01 0.5\t10 4.0")
    np.testing.assert_array_equal(read_tydex(path).recorded[1], [0.01, 0.5, 10.0, 4.0])


def test_an_empty_cell_is_no_number(tmp_path: Path) -> None:
    path = by_hand(tmp_path, "      0.01       0.0      10.0", "      0.01                10.0")
    np.testing.assert_array_equal(read_tydex(path).recorded[1], [0.01, np.nan, 10.0, 4.0])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("**END\n", "", "**END is missing: the file is truncated"),
        ("**MEASURDATA", "**MEASDATA", "**MEASURDATA is missing"),
        ("**MEASURCHANNELS", "**CHANNELS", "**MEASURCHANNELS is missing"),
        ("**COMMENTS", "**HEADER", "line 6: **HEADER occurs again"),
        (
            "0.02       1.0",
            "0.02       1,0",
            "line 19: 4 values that are no row of 4 numbers (decimal commas?)",
        ),
        ("       0.0      -1.0     820.0", "       0.0      -1.0", "line 17: 3 values"),
        ("kN        0.001", "kN      0.001  ", "line 14: the channel 'FYW'"),
        ("SLIPANGL", "RUNTIME ", "line 13: channel RUNTIME occurs again"),
    ],
)
def test_each_fault_is_named_with_its_line(old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError) as caught:
        read_tydex(by_hand(tmp_path, old, new))
    assert any(said in problem for problem in caught.value.problems), caught.value.problems
    assert all(problem.startswith(str(tmp_path)) for problem in caught.value.problems)


def test_a_truncated_row_and_its_missing_end_are_both_named(tmp_path: Path) -> None:
    path = by_hand(tmp_path)
    path.write_text(BY_HAND[: BY_HAND.index("-805.0") + 3])
    with pytest.raises(FormatError) as caught:
        read_tydex(path)
    assert len(caught.value.problems) == 2


def test_what_is_no_tydex_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.tdx").write_text("a,b\n1,2\n")
    with pytest.raises(FormatError, match="not a TYDEX file"):
        read_tydex(tmp_path / "a.tdx")


def test_what_does_not_fit_its_columns_is_not_written(tmp_path: Path) -> None:
    one = np.ones((2, 1))
    for channel in (
        TydexChannel("A" * 11),
        TydexChannel(""),
        TydexChannel("!A"),
        TydexChannel("A", "c" * 31),
        TydexChannel("A", unit="u" * 11),
        TydexChannel("A", "two\nlines"),
        TydexChannel("A", factor=np.inf),
    ):
        with pytest.raises(ParameterError):
            write_tydex(tmp_path / "a.tdx", TydexFile((channel,), one))
    with pytest.raises(ParameterError, match="NaN or infinity"):
        write_tydex(tmp_path / "a.tdx", TydexFile((TydexChannel("A"),), one * np.nan))
    with pytest.raises(ShapeError, match=r"\(2, 1\); \(n_rows, 2\) is needed"):
        write_tydex(tmp_path / "a.tdx", TydexFile((TydexChannel("A"), TydexChannel("B")), one))
    assert not (tmp_path / "a.tdx").exists()
