"""Every fault of maps and files has its message, and all come at once."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import synthetic
from tests.unit.campaign.importing.conftest import Importer, Refused
from tests.unit.campaign.importing.importing_synthetic import (
    Columns,
    sae_columns,
    sae_map,
    with_channels,
    write_csv,
    write_mat5,
    write_mat73,
    write_parquet,
)
from tirelib.campaign.importing.suggest import suggest_map
from tirelib.campaign.mdf import Channel, Group, write_mdf


def says(lines: tuple[str, ...], *parts: str) -> None:
    """Assert that one line holds every part."""
    assert any(all(part in line for part in parts) for line in lines), "\n".join(lines)


FZ = {"column": "FZ", "unit": "N"}


@pytest.mark.parametrize(
    ("document", "parts"),
    [
        (sae_map(axes=None), ["map.toml, axes", "the key is missing", "iso, sae, adapted_sae"]),
        (sae_map(axes="din"), ["map.toml, axes", "'din' is an unknown axis system"]),
        (sae_map(format="tirelib-map/2"), ["format", "'tirelib-map/2' is an unknown version"]),
        (sae_map(format=None), ["format: the key is missing", "'tirelib-map/1'"]),
        (sae_map(tire=None), ["[tire]: the table is missing", "free_radius_m"]),
        (sae_map(tire={"free_radius_m": 203.0}), ["free_radius_m", "millimetres: write 0.203"]),
        (sae_map(kind="corners"), ["kind: 'corners'", "did you mean 'corner'"]),
        (sae_map(run_colum="RUN"), ["run_colum: the key is unknown", "'run_column'"]),
        (sae_map(channels=None), ["[channels]: no channel is mapped"]),
        (sae_map(channels={"Fz": "FZ"}), ["[channels] Fz: 'FZ' is given", "a table is needed"]),
        (with_channels(FZ=FZ), ["[channels] FZ: the quantity is unknown", "'Fz'"]),
        (with_channels(load=FZ), ["[channels] load: the quantity is unknown"]),
        (with_channels(strain_01=FZ), ["[channels] strain_01: the quantity is unknown"]),
        (with_channels(Mz={"unit": "Nm"}), ["[channels] Mz: no column is named"]),
        (
            with_channels(Fz={"column": "FZ", "unit": "bar"}),
            ["Fz unit: unit 'bar' is a unit of pressure", "allowed for force are N"],
        ),
        (with_channels(Fz={"column": "FZ", "unit": "newton"}), ["'newton' is not a unit"]),
        (with_channels(Fz={**FZ, "factr": 2}), ["Fz factr: the key is unknown", "'factor'"]),
        (with_channels(Fz={**FZ, "sign": 2}), ["Fz sign: 2 is given", "1 and -1"]),
        (with_channels(Fz={**FZ, "factor": 0.0}), ["Fz factor: 0 is given"]),
        (with_channels(Fz={**FZ, "offset": "1"}), ["Fz offset: '1' is given", "finite number"]),
        (with_channels(Fz={"column": "FY", "unit": "N"}), ["column 'FY' is that of Fy already"]),
        (
            with_channels(time={"column": "ET", "unit": "s", "rate_hz": 9}),
            ["together with a column"],
        ),
        (with_channels(time={"rate_hz": -1.0}), ["rate_hz = -1", "above 0"]),
        (with_channels(Fz={**FZ, "override_unit": 1}), ["override_unit: 1 is given"]),
        (
            with_channels(strain_1={"column": "FX", "unit": "ustrain"}, Fx=None),
            ["[gages]", "strain_1 is mapped, but the table is missing", "lateral_m"],
        ),
        (sae_map(gages={"lateral_m": [0.0, 0.03]}), ["0 strain channels", "declares 2"]),
        (sae_map(set_points={"load": 1}), ["[set_points] load: the key is unknown", "'load_N'"]),
        (sae_map(set_points={"load_N": {"mean_to": 0}}), ["mean_to: 0", "a step above 0"]),
        (sae_map(set_points={"slip_ratio": {"mean_to": 1}}), ["[channels] slip_ratio is needed"]),
        (sae_map(set_points={"load_N": {"unit": "N"}}), ["load_N: no column is named"]),
        (sae_map(set_points={"load_N": {"column": "L", "unit": "bar"}}), ["a unit of pressure"]),
        (sae_map(runs={"a": {}}), ["[runs.a]", "write for instance [runs.18]"]),
        (sae_map(runs={"0": {"kind": "free?"}}), ["[runs.0] kind: 'free?'", "'free'"]),
        (sae_map(runs={"0": {"load_N": "4"}}), ["[runs.0] load_N: '4' is given"]),
        (sae_map(runs={"0": {"file": "x"}}), ["[runs.0] file", "are taken"]),
        (sae_map(runs={"0": {"skip": "yes"}}), ["[runs.0] skip", "true or false"]),
        (sae_map(runs={"0": {"skip": True}}), ["every run is skipped"]),
        (sae_map(runs={"4": {"kind": "free"}}), ["[runs.4]: there is no such run", "are 0"]),
        (sae_map(kind="corner"), ["load_N: no set point for run(s) 0", "only a sweep"]),
        (sae_map(csv={"separator": ";;"}), ["[csv] separator", "one character"]),
        (sae_map(csv={"decimal": ";"}), ["[csv] decimal", "'.' and ','"]),
        (sae_map(csv={"names_line": 0}), ["names_line", "a line number from 1 on"]),
        (sae_map(csv={"units_line": 2}), ["units_line", "add names_line"]),
        (sae_map(tolerance={"load": 0.005}), ["[tolerance] pressure: the key is missing"]),
        ("axes = ", ["map.toml: not TOML", "tirelib-map/1"]),
    ],
)
def test_each_fault_of_a_map_is_named(
    document: Any, parts: list[str], refused: Refused, tmp_path: Path
) -> None:
    says(refused(write_csv(tmp_path / "a.csv", sae_columns()), by=document), *parts)


def test_a_map_that_is_not_there_is_named(tmp_path: Path) -> None:
    from tirelib.campaign.importing import read_map

    with pytest.raises(ValueError, match=r"no\.toml: the map cannot be read \(No such file"):
        read_map(tmp_path / "no.toml")


def test_all_faults_of_a_map_come_at_once(refused: Refused, tmp_path: Path) -> None:
    document = with_channels(FZ=FZ, Fy={"column": "FY", "unit": "bar"}, camber={"unit": "deg"})
    document |= {"axes": "x", "kind": "y", "tire": {"free_radius_m": -1.0}}
    lines = refused(write_csv(tmp_path / "a.csv", sae_columns()), by=document)
    assert len(lines) == 6, "\n".join(lines)
    assert all(line.count(";") >= 2 for line in lines)  # given; allowed; what to do


def test_all_faults_of_all_files_come_at_once(refused: Refused, tmp_path: Path) -> None:
    one, two, three = (sae_columns(seed=k) for k in range(3))
    one["FY"][[4, 9]] = np.nan
    one["FX"][2] = np.inf
    two["Fy"] = two.pop("FY")
    two["ET"][7] = two["ET"][6]
    three["FZ"] = -three["FZ"]
    files = [
        write_parquet(tmp_path / f"{n}.parquet", c)
        for n, c in (("one", one), ("two", two), ("three", three))
    ]
    empty = tmp_path / "four.csv"
    empty.write_text("")
    lines = refused(*files, empty)
    says(lines, "one.parquet", "'FY' (Fy)", "2 value(s) are NaN or infinite, in rows 5, 10")
    says(lines, "one.parquet", "'FX' (Fx)", "1 value(s) are NaN or infinite, in row 3")
    says(lines, "two.parquet", "column 'FY' (Fy)", "no such column", "did you mean 'Fy'")
    says(lines, "three.parquet", "'FZ' (Fz)", "wrong sign: positive throughout")
    says(lines, "two.parquet, time", "the time of the preceding row occurs again in row 8")
    says(lines, "four.csv: the file is empty")
    assert len(lines) == 6, "\n".join(lines)


def test_faults_of_the_map_and_of_the_files_come_together(refused: Refused, tmp_path: Path) -> None:
    columns = sae_columns()
    columns["FX"][2] = np.nan
    columns["FYY"] = columns.pop("FY")
    file = write_parquet(tmp_path / "a.parquet", columns)
    document = with_channels(pressure={"column": "P", "unit": "N"}) | {"axes": "z_down"}
    lines = refused(file, tmp_path / "no.mat", by=document)
    says(lines, "map.toml, axes: 'z_down' is an unknown axis system")
    says(lines, "map.toml, [channels] pressure unit: unit 'N' is a unit of force")
    says(lines, "a.parquet, column 'FX' (Fx)", "NaN or infinite, in row 3")
    says(lines, "a.parquet, column 'FY' (Fy)", "did you mean 'FYY'")
    says(lines, "no.mat: it cannot be read")
    assert len(lines) == 5, "\n".join(lines)


def test_a_missing_column_hides_no_wrong_sign(refused: Refused, tmp_path: Path) -> None:
    columns = changed("FZ", np.negative)
    del columns["P"]
    lines = refused(write_parquet(tmp_path / "a.parquet", columns))
    says(lines, "column 'P' (pressure): the file has no such column")
    says(lines, "'FZ' (Fz): wrong sign: positive throughout")
    assert len(lines) == 2, "\n".join(lines)


def changed(name: str, change: Callable[[Any], Any]) -> Columns:
    columns = sae_columns()
    columns[name] = change(columns[name].copy())
    return columns


def put(index: int, value: float) -> Callable[[Any], Any]:
    def apply(samples: Any) -> Any:
        samples[index] = value
        return samples

    return apply


@pytest.mark.parametrize(
    ("columns", "parts"),
    [
        (
            changed("ET", put(7, 10.06)),
            ["time: the time of the preceding row occurs again in row 8"],
        ),
        (changed("ET", put(7, 1.0)), ["time: the time decreases in row 8 (t = 1 s)"]),
        (changed("ET", put(7, np.nan)), ["time: no finite time in row 8"]),
        (
            changed("FZ", np.negative),
            ["Fz of a loaded tire is negative in these axes", "sign = -1", "(median 1499 N)"],
        ),
        (
            changed("FY", np.negative),
            [
                "Fy against slip angle contradicts axes = 'sae' in 100 %",
                "opposite signs",
                "column 'FY' (Fy)",
            ],
        ),
        (
            changed("FZ", lambda x: x / 1e3),
            [
                "would find 1 error",
            ],
        ),
        (changed("FZ", lambda x: x / 1e3), ["a.parquet, channel Fz", "is plausible"]),
    ],
)
def test_each_fault_of_the_numbers_is_named(
    columns: Columns, parts: list[str], refused: Refused, tmp_path: Path
) -> None:
    says(refused(write_parquet(tmp_path / "a.parquet", columns)), *parts)


def test_pacejka_axes_want_fy_and_slip_angle_of_one_sign(
    refused: Refused, imported: Importer, tmp_path: Path
) -> None:
    columns = changed("FZ", np.negative)
    file = write_parquet(tmp_path / "a.parquet", columns)
    says(refused(file, by=sae_map(axes="adapted_sae")), "Fy and slip angle have the same sign")
    assert imported(file, by=sae_map(axes="iso")).header.axes == "iso"


def test_an_aligning_moment_acts_behind_the_contact_in_all_axes(
    refused: Refused, imported: Importer, tmp_path: Path
) -> None:
    columns = sae_columns()
    columns["MZ"] = 0.03 * columns["FY"]
    file = write_parquet(tmp_path / "a.parquet", columns)
    moment = {"column": "MZ", "unit": "Nm"}
    says(
        refused(file, by=with_channels(Mz=moment)),
        "column 'MZ' (Mz)",
        "contradicts axes = 'sae' in 100 % of the samples with a small slip angle",
        "write sign = -1 for the column that is turned",
    )
    assert imported(file, by=with_channels(Mz={**moment, "sign": -1})).header.axes == "sae"


def test_a_fault_that_most_files_share_is_one_line(refused: Refused, tmp_path: Path) -> None:
    files = [
        write_parquet(tmp_path / f"{k}.parquet", changed("FZ", lambda x: -x)) for k in range(5)
    ]
    lines = refused(*files)
    assert len(lines) == 1
    says(lines, "5 of 5 runs", "wrong sign: positive throughout")


def test_what_the_file_says_of_a_unit_must_agree(refused: Refused, tmp_path: Path) -> None:
    file = write_mat73(tmp_path / "a.mat", sae_columns(), units=True)
    bar = {"column": "P", "unit": "bar"}
    says(
        refused(file, by=with_channels(pressure=bar)),
        "'P' (pressure)",
        "the file states 'kPa', the map 'bar'",
        "override_unit",
    )


def test_a_unit_that_is_stated_nowhere_is_asked_for(refused: Refused, tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", sae_columns())
    lines = refused(file, by=with_channels(Fz={"column": "FZ"}))
    says(lines, "'FZ' (Fz)", "map and file state no unit", "allowed are N, daN")


def test_lengths_that_differ_are_named(refused: Refused, tmp_path: Path) -> None:
    columns = sae_columns()
    columns["FY"] = columns["FY"][:-3]
    lines = refused(write_mat5(tmp_path / "a.mat", columns))
    says(lines, "column 'FY'", "it has 397 rows, the time column 'ET' has 400")


def test_text_where_numbers_should_be_is_named(refused: Refused, tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", sae_columns())
    lines = file.read_text().splitlines()
    cells = lines[300].split(",")
    cells[3] = "fault"
    lines[300] = ",".join(cells)
    file.write_text("\n".join(lines))
    says(refused(file), "column 'FZ' (Fz)", "line 301 holds 'fault', which is no number")
    assert "# 'FZ' is left out: line 301 holds 'fault'" in suggest_map(file).replace('"', "'")


def test_no_time_and_no_rate_is_named(refused: Refused, tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", sae_columns())
    says(refused(file, by=with_channels(time=None)), "no time is mapped for the rig quantities")


def test_one_row_is_no_recording(refused: Refused, tmp_path: Path) -> None:
    file = write_parquet(tmp_path / "a.parquet", sae_columns(rows=1))
    says(refused(file), "1 row(s) of data", "two are needed")


def test_channels_on_several_clocks_are_refused(refused: Refused, tmp_path: Path) -> None:
    groups = [
        Group(k, Channel("t", "s", np.arange(50.0 + k) / 100), (Channel(n, "N", np.ones(50 + k)),))
        for k, n in enumerate(["FZ", "FX"])
    ]
    write_mdf(tmp_path / "a.mf4", groups)
    document = sae_map(channels={"Fz": FZ, "Fx": {"column": "FX", "unit": "N"}})
    says(refused(tmp_path / "a.mf4", by=document), "have 2 clocks (1/time, 2/time)")


def gage_file(path: Path, times: Any) -> tuple[Path, dict[str, Any]]:
    run = synthetic.synthetic_run(0, turns=3.2)
    assert run.strain is not None
    columns = {"t": times} | {f"G{k}": row[: times.size] for k, row in enumerate(run.strain, 1)}
    document = sae_map(gages={"lateral_m": [0.06, 0.03, 0.0, -0.03, -0.06]})
    document["channels"] = {"time": {"column": "t", "unit": "s"}} | {
        f"strain_{k}": {"column": f"G{k}", "unit": "m/m"} for k in range(1, 6)
    }
    return write_parquet(path, columns), document


def test_a_gap_in_the_strain_is_named_with_its_place(refused: Refused, tmp_path: Path) -> None:
    times = np.arange(3000) / 1e4
    times[1200:] += 5e-4
    file, document = gage_file(tmp_path / "a.parquet", times)
    says(refused(file, by=document), "1 gap(s)", "after sample 1199", "about 5 samples are lost")


def test_an_uneven_clock_of_the_strain_is_refused(refused: Refused, tmp_path: Path) -> None:
    times = np.arange(3000) / 1e4
    times[700] -= 5e-5
    file, document = gage_file(tmp_path / "a.parquet", times)
    says(refused(file, by=document), "after sample 700", "time of the gages")


def test_a_declared_rate_must_be_that_of_the_times(refused: Refused, tmp_path: Path) -> None:
    file, document = gage_file(tmp_path / "a.parquet", np.arange(3000) / 1e4)
    document["gages"]["rate_hz"] = 5000.0
    says(refused(file, by=document), "the samples come at 10000 Hz", "map.toml declares 5000 Hz")


def test_files_of_two_rates_are_no_campaign(refused: Refused, tmp_path: Path) -> None:
    one, document = gage_file(tmp_path / "a.parquet", np.arange(3000) / 1e4)
    two, _ = gage_file(tmp_path / "b.parquet", np.arange(3000) / 1.1e4)
    assert any("the samples come at" in line for line in refused(one, two, by=document))


@pytest.mark.parametrize(
    ("run", "part"),
    [
        ([1.0, 1.5, 2.0], "1.5 in rows 101"),
        ([1.0, -2.0, 3.0], "-2 in rows 101"),
        ([1.0, 2.0, 1.0], "run 1 comes again in row 201"),
    ],
)
def test_a_run_column_that_does_not_count_is_named(
    run: list[float], part: str, refused: Refused, tmp_path: Path
) -> None:
    columns = sae_columns(rows=300)
    columns["RUN"] = np.repeat(run, 100)
    file = write_parquet(tmp_path / "a.parquet", columns)
    says(refused(file, by=sae_map(run_column="RUN")), "'RUN' (run_column)", part)


def test_a_run_in_two_files_is_named(refused: Refused, tmp_path: Path) -> None:
    files = []
    for name in "ab":
        columns = sae_columns(rows=100, seed=ord(name))
        columns["RUN"] = np.full(100, 5.0)
        files.append(write_parquet(tmp_path / f"{name}.parquet", columns))
    says(
        refused(*files, by=sae_map(run_column="RUN")), "b.parquet, run 5: run 5 is in", "a.parquet"
    )


def test_a_set_point_that_changes_within_a_run_is_named(refused: Refused, tmp_path: Path) -> None:
    columns = sae_columns()
    file = write_parquet(tmp_path / "a.parquet", columns)
    document = sae_map(set_points={"pressure_bar": {"column": "P", "unit": "kPa"}})
    says(refused(file, by=document), "column 'P' (pressure_bar)", "within the run")


def test_a_file_named_twice_and_a_copy_are_named(refused: Refused, tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", sae_columns())
    copy = write_csv(tmp_path / "b.csv", sae_columns())
    says(refused(file, file), "a.csv: it is named twice")
    says(refused(file, copy), "b.csv: duplicate run: its samples are those of", "a.csv")
