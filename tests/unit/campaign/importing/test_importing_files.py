"""Formats: what is damaged, mistaken or ambiguous is refused; what was found out is said."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.unit.campaign.importing.importing_synthetic import (
    sae_columns,
    write_csv,
    write_mat5,
    write_mat73,
    write_parquet,
)
from tirelib.campaign.importing import CsvOptions, read_table
from tirelib.campaign.importing.columns import did_you_mean
from tirelib.campaign.importing.suggest import list_columns, suggest_map
from tirelib.campaign.mdf import Channel, Group, write_mdf
from tirelib.core.errors import FormatError


def refusal(path: Path, options: CsvOptions | None = None) -> str:
    with pytest.raises(FormatError) as caught:
        read_table(path, options)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert text.count(";") >= 2
    return text


def text_file(folder: Path, text: str, name: str = "a.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


WRITERS = {"a.mat": write_mat5, "b.mat": write_mat73, "c.parquet": write_parquet}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("share", [0.1, 0.5, 0.97])
def test_a_truncated_binary_file_is_refused(name: str, share: float, tmp_path: Path) -> None:
    path = WRITERS[name](tmp_path / name, sae_columns())
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    assert "truncated or damaged" in refusal(path)


def test_a_truncated_mdf_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mf4"
    write_mdf(path, [Group(0, Channel("t", "s", np.arange(9.0)), (Channel("F", "N", np.ones(9)),))])
    path.write_bytes(path.read_bytes()[:-100])
    text = refusal(path)
    assert "truncated or damaged MDF 4" in text
    assert "runs.csv" not in text


def test_a_truncated_text_table_is_refused(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "a.csv", sae_columns())
    content = path.read_text()
    path.write_text(content[: content.rindex(",", 0, -30)])
    assert "the file is truncated in its last line" in refusal(path)


def test_a_row_with_a_cell_too_many_is_named(tmp_path: Path) -> None:
    rows = "".join(f"{k},1\n" for k in range(9))
    assert "line 4 has 3" in refusal(text_file(tmp_path, "a,b\n1,2\n3,4\n5,6,7\n" + rows))


@pytest.mark.parametrize(
    ("name", "source", "found"),
    [
        ("x.csv", "a.mat", "its content is MATLAB"),
        ("x.mat", "c.parquet", "its content is Parquet"),
        ("x.parquet", "b.mat", "its content is MATLAB"),
        ("x.mf4", "a.mat", "its content is MATLAB"),
        ("x.tdx", "c.parquet", "its content is Parquet"),
    ],
)
def test_content_must_be_what_the_suffix_states(
    name: str, source: str, found: str, tmp_path: Path
) -> None:
    path = WRITERS[source](tmp_path / source, sae_columns()).rename(tmp_path / name)
    assert found in refusal(path)


def test_what_is_no_file_of_a_known_format_is_refused(tmp_path: Path) -> None:
    assert "the suffix '.xyz' states no format" in refusal(tmp_path / "a.xyz")
    assert "it cannot be read (No such file" in refusal(tmp_path / "a.csv")
    (tmp_path / "b.mat").write_bytes(b"")
    assert "the file is empty" in refusal(tmp_path / "b.mat")
    (tmp_path / "c.mat").write_bytes(b"\0\1\2\3" * 99)
    assert "its content is no known binary format" in refusal(tmp_path / "c.mat")
    (tmp_path / "d.csv").write_bytes(b"a,b\n1,2\n" * 99 + b"\0\0")
    assert "not a text file" in refusal(tmp_path / "d.csv")
    hdf = write_mat73(tmp_path / "e.mat", {"x": np.ones(3)})
    hdf.write_bytes(hdf.read_bytes()[512:])
    assert "HDF5 without a MATLAB heading" in refusal(hdf)
    assert "no column of numbers" in refusal(write_mat5(tmp_path / "f.mat", {"x": "text"}))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1.5,2\n2.5,3\n", "separator ',', decimal '.'"),
        ("a;b\n1,5;2\n2,5;3\n", "separator ';', decimal ','"),
        ("a;b\n1.5;2\n2.5;3\n", "separator ';', decimal '.'"),
        ("a\tb\n1,5\t2,0\n2,5\t3,0\n", "separator tab, decimal ','"),
        ("a|b\n1.5|2\n2.5|3\n", "separator '|', decimal '.'"),
        ("a b\n1.5  2\n 2.5  3\n", "separator blanks, decimal '.'"),
        ("a  b\n1,5  2,0\n2,5 3,0\n", "separator blanks, decimal ','"),
        ("a , b\n1.5 , 2\n2.5, 3\n", "separator ',', decimal '.'"),
        ('"a";"b"\n1,5;2\n2,5;3\n', "separator ';', decimal ','"),
        ("a,b,\n1.5,2,\n2.5,3,\n", "separator ',', decimal '.'"),
        ("rig 5, day 2\n\na,b\n1.5,2\n2.5,3\n", "names in line 3, 2 rows from line 4"),
        ("title\na,b\ns,N\n1.5,2\n2.5,3\n", "names in line 2, units in line 3"),
        ("\ufeffa,b\n1.5,2\n2.5,3\n", "2 rows"),
        ("a,b\r\n1.5,2\r\n2.5,3\r\n", "2 rows"),
    ],
)
def test_the_layout_of_a_text_table_is_found_and_said(text: str, said: str, tmp_path: Path) -> None:
    table = read_table(text_file(tmp_path, text))
    assert said in table.notes[0]
    np.testing.assert_array_equal(table.columns["a"].values, [1.5, 2.5])
    np.testing.assert_array_equal(table.columns["b"].values, [2.0, 3.0])


def test_latin_letters_and_utf16_are_read_and_said(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes("a [°C];b\n1,5;2\n2,5;3\n".encode("cp1252"))
    table = read_table(path)
    assert "encoding cp1252" in table.notes[0]
    assert table.columns["a [°C]"].unit == "°C"
    path.write_bytes("a;b\n1,5;2\n2,5;3\n".encode("utf-16"))
    assert list(read_table(path).columns) == ["a", "b"]


def test_units_are_taken_from_their_line_or_from_brackets(tmp_path: Path) -> None:
    table = read_table(text_file(tmp_path, "t;F\n[s];[kN]\n1;2\n2;3\n"))
    assert [column.unit for column in table.columns.values()] == ["s", "kN"]
    table = read_table(text_file(tmp_path, "t [s];F (kN);x (left)\n1;2;3\n2;3;4\n"))
    assert [column.unit for column in table.columns.values()] == ["s", "kN", ""]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,5,2,5\n3,5,4,5\n5,5,6,5\n", "no line with 4 names"),
        ("1,2\n3,4\n5,6\n", "no line with 2 names"),
        ("a,b\n", "1 line(s) with text"),
        ("once upon\na time\nthere was\n", "no table of numbers"),
        ("a;b|c\n1;2|3\n4;5|6\n7;8|9\n", "it reads equally well with separator ';'"),
        ("a;b\n1.234,5;2\n2.234,5;3\n", "it reads equally well with separator ';'"),
    ],
)
def test_a_layout_that_cannot_be_told_is_refused(text: str, said: str, tmp_path: Path) -> None:
    assert said in refusal(text_file(tmp_path, text))


def test_the_map_settles_a_layout(tmp_path: Path) -> None:
    path = text_file(tmp_path, "x y\na;b|c\nu;v|w\n1;2|3\n4;5|6\n7;8|9\n")
    options = CsvOptions(separator=";", names_line=2, units_line=3)
    table = read_table(path, options)
    assert list(table.columns) == ["a"]
    assert "b|c" in table.left_out
    wrong = CsvOptions(separator=";", names_line=1)
    assert "names_line has 1 cells" in refusal(path, wrong)


def test_two_columns_of_one_name_are_left_out(tmp_path: Path) -> None:
    table = read_table(text_file(tmp_path, "a,b,a\n1,2,3\n4,5,6\n"))
    assert list(table.columns) == ["b"]
    assert table.left_out == {"a": "several columns have this name"}


def test_matlab_structs_matrices_and_scalars_become_columns(tmp_path: Path) -> None:
    path = write_mat5(
        tmp_path / "a.mat",
        {
            "run": {"FZ": np.arange(4.0), "p": 2.3, "tag": "x"},
            "G": np.arange(8.0).reshape(4, 2),
            "cube": np.ones((2, 2, 2)),
        },
    )
    table = read_table(path)
    np.testing.assert_array_equal(table.columns["run.FZ"].values, np.arange(4.0))
    np.testing.assert_array_equal(table.columns["G(:,2)"].values, [1.0, 3.0, 5.0, 7.0])
    assert table.columns["run.p"].constant
    np.testing.assert_array_equal(table.columns["run.p"].rows(3), [2.3, 2.3, 2.3])
    assert set(table.left_out) == {"run.tag", "cube"}
    assert table.left_out["run.tag"] == "it holds the text 'x', no numbers"


def test_matlab_73_stands_transposed_in_its_file(tmp_path: Path) -> None:
    matrix = np.arange(8.0).reshape(4, 2)
    path = write_mat73(tmp_path / "a.mat", {"G": matrix.T})
    np.testing.assert_array_equal(read_table(path).columns["G(:,2)"].values, matrix[:, 1])


def test_near_names_come_first_whatever_their_case() -> None:
    assert did_you_mean("fz", ["FX", "FZ"]).startswith("did you mean 'FZ'")
    assert did_you_mean("abc", []) == "there are none"
    assert did_you_mean("?", [str(k) for k in range(20)]).endswith("and 8 more")


def test_a_listing_shows_extremes_and_missing_values(tmp_path: Path) -> None:
    columns = sae_columns()
    columns["SA"][3] = np.nan
    _, items = list_columns(write_parquet(tmp_path / "a.parquet", columns))
    by_name = {item.name: item for item in items}
    assert by_name["SA"].missing == 1
    assert by_name["SA"].high == pytest.approx(6.0)
    assert (by_name["FZ"].quantity, by_name["TSTC"].quantity) == ("Fz", "tread_temperature")


@pytest.mark.parametrize(
    ("turned", "axes"), [((), "sae"), (("FZ",), "iso"), (("FZ", "FY"), "adapted_sae")]
)
def test_a_draft_is_a_map_once_its_gaps_are_filled(
    turned: tuple[str, ...], axes: str, tmp_path: Path
) -> None:
    from tirelib.campaign.importing import import_campaign

    columns = sae_columns()
    for name in turned:
        columns[name] = -columns[name]
    file = write_mat73(tmp_path / "a.mat", columns, units=True)
    draft = suggest_map(file)
    assert f'axes = "{axes}"' in draft
    (tmp_path / "map.toml").write_text(draft)
    with pytest.raises(FormatError, match="free_radius_m"):
        import_campaign([file], tmp_path / "map.toml", tmp_path / "out")
    (tmp_path / "map.toml").write_text(
        draft.replace("# free_radius_m = ...", "free_radius_m = 0.2")
    )
    report = import_campaign([file], tmp_path / "map.toml", tmp_path / "out")
    assert set(report.runs[0].channels) == {
        "Fx",
        "Fy",
        "Fz",
        "slip_angle",
        "camber",
        "pressure",
        "speed",
        "tread_temperature",
    }


def test_an_english_file_is_drafted_with_the_column_that_numbers_its_runs(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    names = (
        "Test No,Part,Time [ms],Wheel load [kN],Slip angle [deg],SG1 [um/m],SG2 [um/m],Index pulse"
    )
    rows = [f"{k // 4},{k % 3},{k},4.{k},0.{k},10{k},-1{k},{k % 2}" for k in range(9)]
    file.write_text("\n".join([names, *rows]))
    draft = tomllib.loads(suggest_map(file))
    assert draft["run_column"] == "Test No"
    assert {quantity: rule["unit"] for quantity, rule in draft["channels"].items()} == {
        "time": "ms",
        "Fz": "kN",
        "slip_angle": "deg",
        "strain_1": "um/m",
        "strain_2": "um/m",
        "trigger": "1",
    }
    assert draft["kind"] == "free"  # strain is of use in steady runs only
    assert draft["set_points"] == {
        "load_N": {"mean_to": 100},
        "slip_angle_deg": {"mean_to": 0.5},
        "camber_deg": 0.0,
        "slip_ratio": 0.0,
    }
    back = [rows[8], *rows[:8]]  # numbers that go back count something else
    file.write_text("\n".join([names, *back]))
    assert "run_column" not in tomllib.loads(suggest_map(file))


@pytest.mark.parametrize(("turn_rate", "known"), [(520, True), (0.1, False)])
def test_a_draft_leaves_out_an_encoder_at_which_no_wheel_rolls(
    turn_rate: float, known: bool, tmp_path: Path
) -> None:
    rows = "".join(f"{k},40.{k},{turn_rate + 0.01 * k}\n" for k in range(9))
    (tmp_path / "a.csv").write_text(f"Time [s],V [km/h],N [rpm]\n{rows}")
    draft = suggest_map(tmp_path / "a.csv")
    assert ("omega" in tomllib.loads(draft)["channels"]) == known
    assert ('# "N [rpm]"' in draft) != known


def test_a_german_file_is_drafted_with_what_the_rig_held(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    names = (
        "Zeit [s];Radlast [kN];Schr\u00e4glaufwinkel [\u00b0];Geschwindigkeit [km/h];Schlupf [%]"
    )
    rows = [f"0,{k};4,{k};{k},5;64,8;0" for k in range(9)]
    file.write_bytes("\n".join([names, *rows]).encode("latin-1"))
    draft = tomllib.loads(suggest_map(file))["channels"]
    assert {quantity: rule["unit"] for quantity, rule in draft.items()} == {
        "time": "s",
        "Fz": "kN",
        "slip_angle": "\u00b0",
        "speed": "km/h",  # constant, as a rig holds it; a slip that is always 0 was not connected
    }


def test_a_condition_that_a_file_holds_at_zero_is_mapped(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    rows = [f"0,{k};4,{k};{k};0;{40 + k};0" for k in range(9)]
    names = "Zeit [s];Last [kN];SA [deg];Sturz [deg];Laufflächentemperatur [degC];Schlupf [%]"
    file.write_text("\n".join([names, *rows]), encoding="utf-8")
    draft = suggest_map(file)
    channels = tomllib.loads(draft)["channels"]
    assert channels["camber"] == {"column": "Sturz [deg]", "unit": "deg"}
    assert set(channels) == {"time", "Fz", "slip_angle", "camber", "tread_temperature"}
    assert '# "Schlupf [%]": 0 .. 0 %; known as slip_ratio, but it never changes, as a' in draft
