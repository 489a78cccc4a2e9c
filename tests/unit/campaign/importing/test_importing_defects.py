"""Defects of recordings: refused with the choice by name, and what each choice leaves."""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.campaign.importing.conftest import Importer, Refused
from tests.unit.campaign.importing.importing_synthetic import (
    Columns,
    sae_columns,
    sae_map,
    write_csv,
)
from tirelib.campaign import Run, read_campaign
from tirelib.campaign.importing.columns import Column, Table
from tirelib.campaign.importing.defects import Clock, Defects, mended


def repeated(columns: Columns) -> None:
    columns["ET"][[50, 51, 90]] = columns["ET"][[49, 49, 89]]


def falling(columns: Columns) -> None:
    columns["ET"][200:] -= 1.5  # the last 50 of the first 200 rows again, and on


def lacking(columns: Columns) -> None:
    columns["FZ"][[7, 8]] = np.nan


DEFECTS = {"repeated_time": repeated, "backward_time": falling, "missing": lacking}


def damaged(tmp_path: Path, defect: str) -> Path:
    columns = sae_columns()
    DEFECTS[defect](columns)
    return write_csv(tmp_path / "rig.csv", columns)


def only_run(folder: Path) -> Run:
    (run,) = read_campaign(folder).runs()
    return run


@pytest.mark.parametrize("defect", DEFECTS)
def test_a_defect_is_refused_with_the_choice_that_the_map_has(
    tmp_path: Path, refused: Refused, defect: str
) -> None:
    lines = refused(damaged(tmp_path, defect))
    assert any(f'{defect} = "drop"' in line and "in line" in line for line in lines), lines


@pytest.mark.parametrize(
    ("defect", "choice", "rows", "said"),
    [
        ("repeated_time", "drop", 397, "3 rows with the time of the row before were left out"),
        ("backward_time", "drop", 250, "150 rows whose time fell back were left out"),
        ("backward_time", "join", 400, "1 segments were joined"),
        ("missing", "drop", 398, "2 rows without a number were left out (lines 9, 10)"),
        ("missing", "interpolate", 400, "2 numbers of column 'FZ' were interpolated"),
    ],
)
def test_a_choice_is_carried_out_and_noted_in_the_campaign(
    tmp_path: Path, imported: Importer, defect: str, choice: str, rows: int, said: str
) -> None:
    file = damaged(tmp_path, defect)
    report = imported(file, by=sae_map(**{defect: choice}, rig={"name": "rig 4", "note": "dry"}))
    run = only_run(report.campaign)
    assert run.rig_time is not None
    assert run.rig_time.size == rows
    assert (np.diff(run.rig_time) > 0.0).all()
    assert all(np.isfinite(samples).all() for samples in run.rig.values())
    note = read_campaign(report.campaign).header.rig_note
    assert note.startswith(f'dry; rig.csv: {defect} = "{choice}": ')
    assert said in note
    assert any(said in line for line in report.notes)


def test_joined_segments_keep_their_steps(tmp_path: Path, imported: Importer) -> None:
    run = only_run(
        imported(damaged(tmp_path, "backward_time"), by=sae_map(backward_time="join")).campaign
    )
    assert run.rig_time is not None
    assert np.diff(run.rig_time) == pytest.approx(0.01, abs=1e-9)


def test_interpolated_numbers_lie_on_the_line_between_their_neighbours(
    tmp_path: Path, imported: Importer
) -> None:
    given = sae_columns()["FZ"]
    run = only_run(
        imported(damaged(tmp_path, "missing"), by=sae_map(missing="interpolate")).campaign
    )
    line = -(given[6] + (given[9] - given[6]) * np.array([1.0, 2.0]) / 3.0)
    assert run.rig["Fz"][[7, 8]] == pytest.approx(line, rel=1e-9)


def test_a_heading_in_the_middle_of_a_joined_file_is_text_that_the_map_may_call_missing(
    tmp_path: Path, imported: Importer, refused: Refused
) -> None:
    file = write_csv(tmp_path / "rig.csv", sae_columns())
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:200], lines[0], *lines[200:]]) + "\n")
    assert any('text = "missing"' in line for line in refused(file))
    report = imported(file, by=sae_map(text="missing", missing="drop"))
    assert report.runs[0].rows == 400
    assert "'FZ', which is no number" in read_campaign(report.campaign).header.rig_note


def test_lines_are_those_of_the_file_after_others_were_left_out(
    tmp_path: Path, refused: Refused
) -> None:
    columns = sae_columns()
    columns["FZ"][[2, 3]] = np.nan  # lines 4 and 5, which the map leaves out
    columns["ET"][99] = columns["ET"][98]  # line 101
    lines = refused(write_csv(tmp_path / "rig.csv", columns), by=sae_map(missing="drop"))
    assert any("occurs again in line 101 (t =" in line for line in lines), lines


def test_times_that_start_anew_in_each_run_are_no_defect(
    tmp_path: Path, imported: Importer
) -> None:
    columns = sae_columns()
    columns["RUN"] = np.repeat([3.0, 4.0], 200)
    columns["ET"][200:] -= 2.0
    columns["ET"][250] = columns["ET"][249]
    by = sae_map(run_column="RUN", repeated_time="drop", backward_time="drop")
    report = imported(write_csv(tmp_path / "rig.csv", columns), by=by)
    assert [run.rows for run in report.runs] == [200, 199]


def test_segments_of_a_run_are_joined_and_another_run_keeps_its_own_times() -> None:
    """A clock that starts again five times, the third time with another run."""
    run = np.repeat([1.0, 2.0], [12, 8])
    table = Table(
        "a.csv",
        "text table",
        {"t": Column("t", np.tile(0.5 * np.arange(4.0), 5)), "run": Column("run", run)},
    )
    found, notes = mended(table, Defects(backward_time="join"), [Clock("t", ("run",))], "run")
    times = found.columns["t"].values
    np.testing.assert_allclose(times[:12], 0.5 * np.arange(12.0))
    np.testing.assert_allclose(times[12:], 0.5 * np.arange(8.0))
    assert "3 segments were joined" in notes[0]


def test_what_is_missing_is_interpolated_in_time_and_not_from_row_to_row() -> None:
    time = np.cumsum([0.0, 1.0, 1.0, 5.0, 0.5, 0.5, 3.0])
    load = 1e3 + 20.0 * time
    holed = load.copy()
    holed[[2, 4, 5]] = np.nan
    table = Table("a.csv", "text table", {"t": Column("t", time), "Fz": Column("Fz", holed)})
    found, _ = mended(table, Defects(missing="interpolate"), [Clock("t", ("Fz",))], "")
    np.testing.assert_allclose(found.columns["Fz"].values, load)


def test_an_unknown_choice_is_refused_with_those_that_are_known(
    tmp_path: Path, refused: Refused
) -> None:
    lines = refused(damaged(tmp_path, "repeated_time"), by=sae_map(backward_time="sort"))
    assert any("backward_time: 'sort' is given; 'drop', 'join'" in line for line in lines), lines
