"""From a sweep of forces to a model with the missing effects, by the command line.

The tire is a Magic Formula with its own laws of load, pressure, temperature and camber.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from tests.unit.inference.force_campaigns import brush_file, steady_runs, write_forces, write_sweep
from tirelib.campaign import read_campaign
from tirelib.cli import program
from tirelib.core.errors import TirelibError
from tirelib.core.parameters import write_tire
from tirelib.effects import CATALOGUE

PLANTED = {"friction_pressure": 0.3, "stiffness_temperature": 0.5, "brush_camber": 0.08}
PAIR = (
    *("--suspects", "friction_pressure,friction_drift"),
    *("--load-range", 1700, 1700, "--camber-range", 0, 0, "--temperature-range", 60, 60),
)
"""Two suspects, and runs in which nothing but the pressure is to be chosen."""
MINE = """
from tirelib.effects import effect

@effect("mine", stage="brush", unit="{unit}", low=0.0, high=1.0, varies_with=("load",),
        source="test")
def law(state, strength):
    "Stickier with load."
    return state.but(mu=state.mu * (1.0 + strength * state.conditions.load / 4e3))
"""


def call(*words: object) -> Result:
    return CliRunner().invoke(program, list(map(str, words)))


def done(*words: object) -> dict[str, Any]:
    target = Path(str(words[words.index("--json") + 1]))
    found = call(*words)
    assert found.exit_code == 0, found.output
    read = json.loads(target.read_text())
    assert isinstance(read, dict)
    return read


def refused(*words: object) -> str:
    found = call(*words)
    assert isinstance(found.exception, TirelibError), found.output
    return str(found.exception)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("forces")
    campaign = write_sweep(folder / "sweep", 71, PLANTED)
    write_tire(brush_file(campaign), folder / "M.toml", "tirelib-model/1")
    steady = write_forces(folder / "steady", steady_runs(slope=0.25), "steady")
    write_tire(brush_file(steady), folder / "S.toml", "tirelib-model/1")
    write_forces(folder / "single", steady_runs(repeats=1, slope=0.25), "single")
    write_forces(folder / "one", steady_runs(loads=(4000.0,), angles=(3.0,), repeats=14), "one")
    write_forces(folder / "wrong", steady_runs(factor=-1.0), "wrong")
    return folder


@pytest.fixture(scope="module")
def told(place: Path) -> dict[str, Any]:
    return done(
        "diagnose",
        place / "sweep",
        "--model",
        place / "M.toml",
        "--quantity",
        "Fy",
        "--out",
        place / "D",
        "--json",
        place / "D.json",
    )


def test_the_contracts_keys_are_there(told: dict[str, Any]) -> None:
    assert told["format"] == "tirelib-diagnosis/1"
    assert (told["quantity"], told["unit"], told["error_unit"]) == ("Fy", "N", "noise")
    assert {
        "noise",
        "floor",
        "error_before",
        "verdict",
        "named",
        "candidates",
        "dead",
        "unexplained",
        "next_test",
    } <= set(told)
    for entry in told["candidates"]:
        assert set(entry) >= {
            "effect",
            "rank",
            "score",
            "threshold",
            "level",
            "strength",
            "std",
            "in_range",
            "error_after",
            "heldout_error_after",
            "twins",
            "power",
        }
    assert [entry["rank"] for entry in told["candidates"]] == list(
        range(1, len(told["candidates"]) + 1)
    )


def test_planted_pressure_temperature_and_camber_are_named_and_nothing_else(
    told: dict[str, Any],
) -> None:
    assert set(told["named"]) == set(PLANTED)
    assert told["verdict"] == "named"
    levels = {entry["effect"]: entry["level"] for entry in told["candidates"]}
    assert all(levels[name] == "alarm" for name in PLANTED)
    assert levels["relaxation"] == "quiet"
    assert told["error_after"] < 0.6 * told["error_before"]
    # the sweep visits one pressure after the other, the cambers in turn
    (warned,) = [line for line in told["messages"] if "order of measurement" in line]
    assert warned.startswith("pressure went with")


def test_names_stand_in_the_order_of_their_held_out_gain(told: dict[str, Any]) -> None:
    held = {entry["effect"]: entry["heldout_error_after"] for entry in told["candidates"]}
    alone = [held[name] for name in told["named"]]
    assert alone == sorted(alone)
    assert all(error < told["heldout_error_before"] for error in alone)
    falls = [told["heldout_error_before"], *(step["heldout_error"] for step in told["steps"])]
    assert falls == sorted(falls, reverse=True)
    assert falls[-1] < 0.6 * falls[0]


def test_what_the_plan_cannot_show_is_said_before(told: dict[str, Any]) -> None:
    assert set(told["dead"]) == {"friction_speed", "ply_steer", "combined_slip"}
    assert told["dead_reasons"]["friction_speed"] == "no run varies speed"
    assert told["next_test"]["would_revive"]["friction_speed"] == "no run varies speed"


def test_the_report_is_one_file_with_its_figures(place: Path, told: dict[str, Any]) -> None:
    page = (place / "D/diagnosis.html").read_text()
    assert "Error as the named effects are added one after the other" in page
    assert "https://" not in page.split("plotly.js v")[0]
    words = (place / "D/diagnosis.md").read_text()
    assert words.startswith("# Which effect is missing: Fy")
    assert told["named"][0] in words


@pytest.fixture(scope="module")
def grown(place: Path, told: dict[str, Any]) -> list[dict[str, Any]]:
    """Add what was named, one after the other: M2.toml, M3.toml and M4.toml."""
    model, found = place / "M.toml", []
    for k, name in enumerate(told["named"], start=2):
        target = place / f"M{k}.toml"
        words = ("--data", place / "sweep", "--out", target, "--json", place / "A.json")
        found.append(done("add", name, "--model", model, *words))
        model = target
    return found


def test_adding_what_was_named_lets_the_held_out_error_fall_step_by_step(
    place: Path, told: dict[str, Any], grown: list[dict[str, Any]]
) -> None:
    for added in grown:
        assert added["quantity"] == "Fy"
        assert added["error_after"] < added["error_before"]
        assert added["heldout_error_after"] < added["heldout_error_before"]
        assert added["in_range"]
        assert added["std"] > 0.0
    errors = [added["heldout_error_after"] for added in grown]
    assert errors == sorted(errors, reverse=True)
    # noise is of the data alone: the next step starts where the one before has ended
    assert added["error_before"] == pytest.approx(added["history"][-2]["error_after"], rel=1e-4)
    assert [entry["effect"] for entry in added["history"]] == told["named"]
    # what is left is near the floor that the shape of the brush leaves
    assert added["error_after"] < 1.3 * added["floor"]
    words = ("--model", place / "M4.toml", "--quantity", "Fy", "--json", place / "C.json")
    again = done("compare", place / "sweep", *words)
    assert [used["effect"] for used in again["effects"]] == told["named"]
    assert again["error"] == pytest.approx(added["error_after"], rel=0.02)


def test_the_next_test_of_forces_is_the_diagnosis_s_advice(
    place: Path, told: dict[str, Any]
) -> None:
    words = ("next-test", place / "sweep", "--model", place / "M.toml", "--quantity", "Fy")
    plan = done(*words, "--diagnosis", place / "D.json", "--json", place / "N.json")
    assert plan["format"] == "tirelib-next-test/1"
    assert (plan["quantity"], plan["verdict"]) == ("Fy", told["verdict"])
    # one set of effects is left
    assert plan["between"] == []
    found = call(*words, *PAIR, "--json", place / "N.json")
    assert found.exit_code == 0, found.output
    assert re.search(r"-\d[\d.]* to", found.output), found.output
    plan = json.loads((place / "N.json").read_text())
    assert plan["between"] == ["friction_pressure", "friction_drift"]
    # the campaign is one of sweeps, and so is the advised run
    angles = plan["best"]["slip_angles_deg"]
    assert plan["best"]["slip_angle_deg"] is None
    assert len(angles) == plan["envelope"]["points_of_run"] > 10
    assert (min(angles), max(angles)) == pytest.approx((-9.0, 9.0), abs=0.6)


def test_a_point_in_the_place_of_a_sweep_may_be_asked_for(place: Path) -> None:
    plan = done(
        "next-test",
        place / "sweep",
        "--model",
        place / "M.toml",
        "--quantity",
        "Fy",
        *PAIR,
        "--no-sweep",
        "--json",
        place / "P.json",
    )
    assert "slip_angles_deg" not in plan["best"]
    assert -9.5 < plan["best"]["slip_angle_deg"] < 9.5
    assert plan["envelope"]["points_of_run"] == 1


def test_undo_goes_back_to_the_digit_and_remove_fits_anew(
    place: Path, tmp_path: Path, told: dict[str, Any], grown: list[dict[str, Any]]
) -> None:
    first, second = told["named"][:2]
    one, two, added = place / "M2.toml", place / "M3.toml", grown[1]
    words = ("--data", place / "sweep", "--quantity", "Fy", "--json", tmp_path / "A.json")
    call("add", "--undo", "--model", two, "--out", tmp_path / "back.toml")
    assert (tmp_path / "back.toml").read_bytes() == one.read_bytes()
    gone = done("add", second, "--remove", "--model", two, "--out", tmp_path / "3.toml", *words)
    assert gone["action"] == "remove"
    # both are the minimum of one cost
    assert gone["error_after"] == pytest.approx(added["error_before"], rel=1e-4)
    assert [entry["effect"] for entry in gone["effects"]] == [first]


@pytest.mark.parametrize("seed", [81, 82])
def test_a_tire_whose_curve_is_no_brush_but_lacks_no_effect_is_given_no_name(
    tmp_path: Path, seed: int
) -> None:
    campaign = write_sweep(tmp_path / "sweep", seed, {})
    write_tire(brush_file(campaign), tmp_path / "M.toml", "tirelib-model/1")
    found = done(
        "diagnose",
        tmp_path / "sweep",
        "--model",
        tmp_path / "M.toml",
        "--json",
        tmp_path / "D.json",
    )
    assert (found["verdict"], found["named"]) == ("none", [])
    # the misfit is there: the verdict is none because variants of the brush show as much
    assert found["error_before"] > 1.2


@pytest.fixture(scope="module")
def steady(place: Path) -> dict[str, Any]:
    words = ("--model", place / "S.toml", "--json", place / "S.json")
    return done("diagnose", place / "steady", *words)


def test_steady_runs_name_friction_over_load_and_cannot_know_relaxation(
    steady: dict[str, Any],
) -> None:
    found = steady
    assert found["named"] == ["friction_load"]
    assert "relaxation" in found["dead"]
    assert found["candidates"][0]["strength"] == pytest.approx(0.25, abs=0.03)
    assert {part["condition"] for part in found["held_out"]} == {"load"}
    assert found["dead_reasons"]["friction_temperature"] == (
        "tread temperature is not measured at every point"
    )


def test_a_next_test_without_a_diagnosis_makes_its_own(place: Path, steady: dict[str, Any]) -> None:
    words = ("next-test", place / "steady", "--model", place / "S.toml")
    plan = done(*words, "--json", place / "N.json")
    assert (plan["quantity"], plan["verdict"]) == ("Fy", steady["verdict"])
    assert plan["between"] == []
    assert plan["what"] == steady["next_test"]["what"]


def test_without_repeats_there_are_hints_only(place: Path) -> None:
    found = done(
        "diagnose",
        place / "single",
        "--model",
        place / "S.toml",
        "--json",
        place / "N.json",
    )
    assert found["noise"] is None
    assert (found["verdict"], found["named"], found["error_unit"]) == ("none", [], "N")
    assert {entry["level"] for entry in found["candidates"]} <= {"hint", "quiet"}
    assert "no condition was repeated" in found["messages"][-1]


def test_a_model_that_does_not_fit_at_all_gets_no_name(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = {name: CATALOGUE[name] for name in ("friction_load", "stiffness_load", "ply_steer")}
    monkeypatch.setattr("tirelib.model.registration.registered_effects", lambda files: few)
    found = done(
        "diagnose",
        place / "wrong",
        "--model",
        place / "S.toml",
        "--json",
        place / "W.json",
    )
    assert found["named"] == []
    assert any("does not fit at all" in line for line in found["messages"])


def test_bad_input_is_told(place: Path, tmp_path: Path) -> None:
    diagnose = ("diagnose", place / "sweep", "--model", place / "M.toml")
    add = ("--model", place / "M.toml", "--data", place / "sweep", "--out", tmp_path / "M2.toml")
    assert "Fx is not measured" in refused(*diagnose, "--quantity", "Fx")
    assert "it has no strain gages" in refused(*diagnose, "--quantity", "strain")
    assert "one slip angle only" in refused(
        "diagnose", place / "one", "--model", place / "M.toml", "--quantity", "Fy"
    )
    assert "cannot show it: no run varies speed" in refused("add", "friction_speed", *add)
    assert "acts on strain" in refused("add", "sidewall_load", *add, "--quantity", "Fy")
    assert "no effect 'carcass' of the brush" in refused("add", "carcass", "--remove", *add)
    assert "did you mean friction_load" in refused("add", "friction_laod", *add)
    for unit, said in (("furlong", "unit 'furlong'"), ("1", "")):
        (tmp_path / "mine.py").write_text(MINE.format(unit=unit))
        if said:
            assert said in refused(*diagnose, "--effects", tmp_path / "mine.py")
    assert not (tmp_path / "M2.toml").exists()


def test_a_users_effect_joins_and_a_strength_out_of_range_is_flagged(
    place: Path, tmp_path: Path
) -> None:
    (tmp_path / "mine.py").write_text(MINE.format(unit="1"))
    found = call(
        "add",
        "mine",
        "--effects",
        tmp_path / "mine.py",
        "--model",
        place / "S.toml",
        "--data",
        place / "steady",
        "--out",
        tmp_path / "M2.toml",
        "--json",
        tmp_path / "A.json",
    )
    assert found.exit_code == 0, found.output
    added = json.loads((tmp_path / "A.json").read_text())
    # friction falls with load there: the law would need a strength below zero
    assert added["flags"][0] == "out_of_range"
    assert "the fitted strength lies outside the plausible range 0 to 1" in " ".join(
        found.output.split()
    )
    # a model with it needs the file again
    words = ("compare", place / "steady", "--model", tmp_path / "M2.toml")
    assert "effect 'mine' is not known" in refused(*words)
    assert call(*words, "--effects", tmp_path / "mine.py").exit_code == 0


def test_real_flat_belt_data_name_pressure_load_temperature_and_camber(
    shared: Callable[[str], Path], tmp_path: Path
) -> None:
    source = shared("real/cornering.mat").parent
    found = call(
        "import",
        source / "cornering.mat",
        "--map",
        source / "cornering.map.toml",
        "--out",
        tmp_path / "real",
    )
    assert found.exit_code == 0, found.output
    write_tire(brush_file(read_campaign(tmp_path / "real")), tmp_path / "M.toml", "tirelib-model/1")
    told = done(
        "diagnose",
        tmp_path / "real",
        "--model",
        tmp_path / "M.toml",
        "--quantity",
        "Fy",
        "--json",
        tmp_path / "D.json",
    )
    named = set(told["named"])
    for condition in ("pressure", "load", "temperature", "camber"):
        assert any(name.endswith(condition) for name in named), condition
    assert "relaxation" not in named
    falls = [told["heldout_error_before"], *(step["heldout_error"] for step in told["steps"])]
    assert falls[:4] == sorted(falls[:4], reverse=True)
    # a third of the error that a brush without effects leaves on points that it has not seen
    assert told["heldout_error_after"] < 0.67 * told["heldout_error_before"]
