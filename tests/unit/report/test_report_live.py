"""The section "Live" holds the numbers of the JSON files, and no difference goes unsaid."""

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pages.agreement import agreement, agreement_table, difference, read_turns
from pages.live import (
    LiveFiles,
    find_faults,
    last_turn,
    live_table,
    live_text,
    read_line,
    read_strip,
)

from tests.unit.report.conftest import World
from tirelib.core.errors import CalibrationError
from tirelib.estimators.result import estimate_document
from tirelib.measured.signal import LowPass

RUNS = (2, 5)
SCALE = 1e-6
Document = dict[str, Any]


@pytest.fixture(scope="module")
def library(world: World) -> Document:
    return estimate_document(world.observations["set1"], world.estimates["set1"], world.calibration)


def as_live(library: Document) -> Document:
    chosen = [t for t in library["turns"] if t["run"] in RUNS]
    turns = [{**turn, "device_time": 0.1 * i} for i, turn in enumerate(chosen)]
    line = {"frames": 99, "lost_frames": 0, "crc_bad": 0, "framing_bad": 0, "unknown_type": 0}
    return {"turns": turns, "line": line}


@pytest.fixture
def documents(library: Document) -> dict[str, Document]:
    live = as_live(library)
    truth = {"Fz": 4500.0, "alpha": -1.0, "kappa": 0.01, "Fy": 900.0}
    made = {
        "direct": library,
        "fmu": library,
        "live": live,
        "replay": live,
        "conditions": {"runs": [{"run": run, "truth": truth} for run in RUNS]},
    }
    return {name: copy.deepcopy(document) for name, document in made.items()}  # none shared


def written(folder: Path, documents: dict[str, Document]) -> LiveFiles:
    for name, document in documents.items():
        (folder / f"{name}.json").write_text(json.dumps(document))
    device = folder / "device.toml"
    device.write_text(f"[scale]\nstrain_per_count = {SCALE!r}\n")
    return LiveFiles(**{name: folder / f"{name}.json" for name in documents}, device=device)


def valid_turn(document: Document) -> dict[str, Any]:
    turn: dict[str, Any] = next(turn for turn in document["turns"] if turn["Fz_valid"])
    return turn


def row(table_rows: Any, title: str) -> list[str]:
    return next(list(row) for row in table_rows if row[0] == title)


def test_equal_documents_have_no_fault(
    world: World, documents: dict[str, Document], tmp_path: Path
) -> None:
    files, campaign = written(tmp_path, documents), world.campaigns["set1"]
    assert find_faults(files, campaign) == []
    table = live_table(files, read_line(files, campaign))
    assert table.title == "Library = FMU = bench"
    compared = sum(t["Fz"] is not None for t in documents["direct"]["turns"])
    live = sum(t["Fz"] is not None for t in documents["live"]["turns"])
    assert row(table.rows, "vertical load Fz") == [
        "vertical load Fz",
        "N",
        str(compared),
        "0",
        "0",
        str(live),
        "0",
        str(live),
        "0",
        "0",
    ]


def test_the_table_tells_the_largest_difference_of_each_pair(
    world: World, documents: dict[str, Document], tmp_path: Path
) -> None:
    valid_turn(documents["fmu"])["Fz"] += 2.5e-8  # below 1e-9 of the largest load
    valid_turn(documents["live"])["Fy"] += 1.5
    valid_turn(documents["replay"])["Fy"] += 1.5
    files, campaign = written(tmp_path, documents), world.campaigns["set1"]
    table = live_table(files, read_line(files, campaign))
    load, force = row(table.rows, "vertical load Fz"), row(table.rows, "lateral force Fy")
    largest = max(abs(t["Fz"]) for t in documents["direct"]["turns"] if t["Fz"] is not None)
    assert float(load[3]) == pytest.approx(2.5e-8, rel=0.05)  # two digits
    assert float(load[4]) == pytest.approx(2.5e-8 / largest, rel=0.05)
    assert (load[6], load[8]) == ("0", "0")
    assert (force[3], force[6], force[8]) == ("0", "0", difference(1.5))


def test_library_and_fmu_must_agree_to_1e_9(
    world: World, documents: dict[str, Document], tmp_path: Path
) -> None:
    turn = valid_turn(documents["fmu"])
    turn["Fz"] *= 1.0 + 1e-8
    files, campaign = written(tmp_path, documents), world.campaigns["set1"]
    (fault,) = find_faults(files, campaign)
    assert "library \N{MINUS SIGN} FMU: vertical load Fz differs" in fault
    table = live_table(files, read_line(files, campaign))
    assert table.title.startswith("NOT EQUAL")
    assert fault in table.note


def test_live_and_replay_must_agree_to_the_last_bit(
    world: World, documents: dict[str, Document], tmp_path: Path
) -> None:
    turn = valid_turn(documents["replay"])
    turn["contact_length_3_mm"] = float(np.nextafter(turn["contact_length_3_mm"], np.inf))
    (fault,) = find_faults(written(tmp_path, documents), world.campaigns["set1"])
    assert "live \N{MINUS SIGN} replay: contact lengths differs" in fault


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda turns: turns.pop(), "turns"),
        (lambda turns: turns[1].update(valid=not turns[1]["valid"]), "'valid' differs in 1"),
        (lambda turns: turns[1].update(Fy=None), "lateral force Fy is there in one"),
        (lambda turns: [turn.update(run=99) for turn in turns if turn["run"] == 5], "99"),
        (lambda turns: turns.clear(), "runs"),
    ],
    ids=["turn lost", "validity", "number lost", "another run", "nothing"],
)
@pytest.mark.parametrize("name", ["fmu", "replay"])
def test_what_is_missing_is_a_difference(
    world: World, documents: dict[str, Document], tmp_path: Path, name: str, change: Any, said: str
) -> None:
    change(documents[name]["turns"])
    faults = find_faults(written(tmp_path, documents), world.campaigns["set1"])
    assert any(said in fault for fault in faults)


def test_nothing_to_compare_is_no_agreement(documents: dict[str, Document]) -> None:
    firsts = [{**turn, "Fz": None} for turn in documents["live"]["turns"]]
    found = agreement("one and other", firsts, firsts, 0.0)
    assert "not one turn" in found.faults[0]
    assert row(agreement_table([found], "").rows, "vertical load Fz")[3] == "\N{EN DASH}"


def test_rounding_of_the_line_is_said_and_then_equality_is_not_asked_for(
    world: World, documents: dict[str, Document], tmp_path: Path
) -> None:
    for name in ("live", "replay"):
        valid_turn(documents[name])["Fz"] += 3.0
    files, campaign = written(tmp_path, documents), world.campaigns["set1"]
    line = read_line(files, campaign)  # closed-form strain lies on no grid
    assert 0.4 * SCALE < line.rounding <= 0.5 * SCALE * (1 + 1e-6)
    assert find_faults(files, campaign) == []
    assert "rounds strain to whole counts of 1 microstrain" in live_table(files, line).note
    exact = live_table(files, replace(line, rounding=0.0))
    assert "the line rounds nothing" in exact.note
    assert exact.title.startswith("NOT EQUAL")  # without rounding there is no excuse


def test_losses_of_the_line_are_said(
    world: World, documents: dict[str, Document], tmp_path: Path
) -> None:
    documents["live"]["line"].update(lost_frames=3, crc_bad=2)
    line = read_line(written(tmp_path, documents), world.campaigns["set1"])
    assert "99 SERIAL v1 frames" in live_text(line)
    assert "5 were lost" in live_text(line)


def test_the_strip_holds_the_turns_of_the_bench_beside_the_rig(
    documents: dict[str, Document], tmp_path: Path
) -> None:
    strip = read_strip(written(tmp_path, documents))
    turns = documents["live"]["turns"]
    assert strip.run.tolist() == [turn["run"] for turn in turns]
    for i, turn in enumerate(turns):
        assert strip.truth["kappa"][i] == pytest.approx(1.0)  # percent
        if turn["alpha_valid"]:
            assert strip.value["alpha"][i] == turn["alpha"]
            assert strip.std["Fz"][i] == turn["Fz_std"]
        else:
            assert np.isnan(strip.value["alpha"][i])


def test_the_last_turn_is_that_of_the_last_run(
    world: World, documents: dict[str, Document], tmp_path: Path
) -> None:
    turn = last_turn(written(tmp_path, documents), world.campaigns["set1"], LowPass())
    assert turn.run == RUNS[-1]
    assert turn.strain.shape == (5, turn.phi.size)
    seen = turn.strain[:, np.isfinite(turn.strain).all(axis=0)]
    assert float(np.ptp(seen)) > 5e-3  # plateau and dips of a contact are in it


def test_a_file_that_is_no_document_is_named(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text("[]")
    with pytest.raises(CalibrationError, match=r"x\.json"):
        read_turns(tmp_path / "x.json")
