"""The benchmark's figures: shares over cases that ran, and nothing else."""

import pytest
from hidden.cases import NONE
from hidden.run import FIRST, PAIRS, RATIOS, wanted
from hidden.table import figures, markdown

from tirelib.rig.hidden import HIDDEN


def row(kind: str, outcome: str, wanted_ratio: float = 1.5, **more: object) -> dict:
    known = all(HIDDEN[name].known for name in kind.split("+") if name != NONE)
    return {
        "kind": kind,
        "outcome": outcome,
        "wanted": wanted_ratio,
        "known": known,
        "named": [],
    } | more


def added(before: float, after: float, floor: float) -> dict:
    errors = {"before": before, "after": after, "floor": floor}
    held = dict.fromkeys(("load", "pressure", "speed"), errors)
    plain = errors | {"with_shear": 0.98 * after}
    return {"addition": "done", "error": plain, "white_error": errors, "held_out": held}


ROWS = [
    row(NONE, "quiet"),
    row(NONE, "alarm", named=["tread_load"]),
    row(NONE, "alarm"),
    row(NONE, "quiet", named=["belt_shear"]),
    row("temperature", "right", **added(1.5, 1.0, 1.0)),
    row("tread_load", "wrong", **added(1.5, 1.06, 1.0)),
    row("gage_drift", "twins", **added(1.5, 1.04, 1.0)),
    row("gage_drift", "missed", 1.2),
    row("roughness", "failed"),
    row("oval_tire", "flagged"),
    row("flat_spot", "wrong"),
    row("temperature+gage_drift", "right"),
    row("temperature+low_pass", "partly"),
]


def test_shares_are_of_the_cases_that_ran() -> None:
    told = figures(ROWS)
    assert (told["cases"], told["failed"]) == (13, 1)
    assert told["none"] == {"cases": 4, "false_alarms": 0.5, "named_falsely": 0.25, "belt": 0.25}
    strong, weak = told["single"]["1.5"], told["single"]["1.2"]
    assert strong["cases"] == 3
    assert strong["right"] == strong["wrong"] == strong["with_twin"] == pytest.approx(1 / 3)
    assert (weak["cases"], weak["right"], weak["missed"]) == (1, 0.0, 1.0)
    assert (told["unknown"]["kinds"], told["unknown"]["flagged"]) == (2, 0.5)
    assert (told["pairs"]["exact"], told["pairs"]["partly"]) == (0.5, 0.5)


def test_what_an_addition_takes_away_is_held_against_what_could_be_taken() -> None:
    told = figures(ROWS)["addition"]["1.5"]
    assert told["cases"] == 3
    assert told["error"]["at_floor"] == pytest.approx(2 / 3)
    assert told["at_floor_with_shear"] == 1.0
    assert told["error"]["removed"] == pytest.approx((1.5**2 - 1.04**2) / (1.5**2 - 1.0))
    assert told["held_out_speed"]["fell"] == 1.0


def test_the_table_says_date_seeds_and_numbers() -> None:
    told = {"date": "2026-01-31", "seeds": "5000-5001", "members": 100, "figures": figures(ROWS)}
    text = markdown(told)
    for part in ("2026-01-31", "13 cases", "5000-5001", "| named right | 33 % | 0 % |", "2 kinds"):
        assert part in text


def test_a_part_of_the_list_holds_every_column_and_no_development_seed() -> None:
    wants = wanted(none=100, per_ratio=40, unknown=27, pairs=16, first=FIRST)
    assert len(set(wants)) == len(wants)
    assert min(seed for seed, _, _ in wants) >= 5000
    start = wants[:12]
    assert {ratio for _, kind, ratio in start if kind in HIDDEN} == set(RATIOS)
    assert NONE in {kind for _, kind, _ in start}
    assert any(kind in PAIRS for _, kind, _ in start)
    assert {kind for _, kind, _ in wants} == {NONE, *HIDDEN, *PAIRS}
