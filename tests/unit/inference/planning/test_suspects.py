"""Who is on trial, and within which ranges."""

from typing import Any

import numpy as np
import pytest

from tests.unit.inference.planning.made import CONDITIONS, points_at
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.inference.planning.document import Plan, plan_document
from tirelib.inference.planning.envelope import Envelope, operating_at
from tirelib.inference.planning.suspects import given_suspects, suspects_of


def entry(name: str, level: str, twins: tuple[str, ...] = (), in_range: bool = True) -> Any:
    return {
        "effect": name,
        "level": level,
        "in_range": in_range,
        "strength": 0.1,
        "twins": [{"effect": twin, "angle_deg": 10.0} for twin in twins],
    }


def told(verdict: str, named: list[str], *entries: Any) -> dict[str, Any]:
    return {"verdict": verdict, "named": named, "candidates": list(entries)}


def test_indistinguishable_effects_are_the_suspects() -> None:
    found = suspects_of(
        told(
            "indistinguishable",
            ["low_pass", "angle_zero"],
            entry("low_pass", "alarm"),
            entry("angle_zero", "alarm"),
        ),
        CATALOGUE,
    )
    assert found.names == ("low_pass", "angle_zero")
    assert not found.with_nothing


def test_a_named_effect_stands_beside_its_living_twins_and_the_others_stay() -> None:
    found = suspects_of(
        told(
            "named",
            ["camber", "low_pass"],
            entry("camber", "alarm"),
            entry("low_pass", "alarm", ("angle_zero", "gage_drift", "tread_wear")),
            entry("angle_zero", "hint"),
            entry("gage_drift", "quiet"),
            entry("tread_wear", "hint", in_range=False),
        ),
        CATALOGUE,
    )
    assert found.names == ("low_pass", "angle_zero")
    assert found.beside == ("camber",)


def test_what_every_explanation_holds_stands_beside_what_they_differ_in() -> None:
    names = ["camber", "low_pass", "angle_zero"]
    diagnosis = told("indistinguishable", names, *(entry(name, "alarm") for name in names))
    diagnosis["sets"] = [["camber", "low_pass"], ["camber", "angle_zero"]]
    found = suspects_of(diagnosis, CATALOGUE)
    assert found.names == ("low_pass", "angle_zero")
    assert found.beside == ("camber",)


def test_a_single_given_effect_stands_against_nothing() -> None:
    alone = given_suspects(["centrifugal"], [], CATALOGUE)
    assert alone.with_nothing
    assert not given_suspects(["centrifugal", "low_pass"], [], CATALOGUE).with_nothing


def test_hints_stand_against_nothing() -> None:
    found = suspects_of(
        told("none", [], entry("low_pass", "hint"), entry("camber", "quiet")), CATALOGUE
    )
    assert found.names == ("low_pass",)
    assert found.with_nothing


@pytest.mark.parametrize(
    "diagnosis",
    [
        told("none", [], entry("low_pass", "quiet")),
        told("unknown", []),
        told(
            "named",
            ["low_pass"],
            entry("low_pass", "alarm", ("angle_zero",)),
            entry("angle_zero", "quiet"),
        ),
    ],
)
def test_where_nothing_is_in_doubt_there_is_no_plan(diagnosis: dict[str, Any]) -> None:
    found = suspects_of(diagnosis, CATALOGUE)
    assert found.names == ()
    document = plan_document(Plan(found, None, {}, 20.0, "x"))
    assert document["candidates"] == []
    assert document["best"] is None
    assert "nothing is in doubt" in document["message"]
    named = " ".join(diagnosis["named"])
    assert ("give --suspects low_pass" in document["why"]) == (named == "low_pass")


def test_a_diagnosis_with_strange_effects_is_refused() -> None:
    with pytest.raises(ParameterError, match="'mine', which is not known"):
        suspects_of(told("none", [], entry("mine", "hint")), CATALOGUE)


def test_all_faults_of_given_names_are_told_at_once() -> None:
    with pytest.raises(ParameterError) as error:
        given_suspects(
            ["oops", "gage_gain", "camber", "belt_extension"],
            ["camber"],
            CATALOGUE,
            in_base={"belt_extension"},
        )
    for part in (
        "'oops' is not known",
        "cannot be tested",
        "has camber already",
        "fits belt_extension",
        "4 effects are given",
    ):
        assert part in str(error.value)
    with pytest.raises(ParameterError, match=r"'low_pas' is not known, did you mean low_pass\?"):
        given_suspects(["low_pas"], [], CATALOGUE)
    with pytest.raises(ParameterError, match="given 2 times"):
        given_suspects(["low_pass", "low_pass"], [], CATALOGUE)


def test_an_envelope_is_the_campaigns_wider_by_a_known_share_or_as_declared() -> None:
    points = points_at(CONDITIONS)
    free = Envelope.of(points)
    assert free.ranges["load"] == pytest.approx((2250.0, 7500.0))
    assert free.ranges["pressure"] == pytest.approx((1.53e5, 2.76e5))
    assert free.ranges["speed"] == pytest.approx((8.25, 35.0))
    given = Envelope.of(points, load=(3e3, 4e3), speed=(10.0, 10.0))
    assert given.ranges["load"] == (3e3, 4e3)
    assert given.declared == ("load", "speed")
    assert len(given.grid()) == 15
    assert set(given.grid()[:, 2]) == {10.0}


@pytest.mark.parametrize("load", [(5e3, 4e3), (-1.0, 4e3), (0.0, 1.0), (1.0, np.inf)])
def test_a_range_that_is_none_is_refused(load: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match="load"):
        Envelope.of(points_at(CONDITIONS), load=load)


def test_a_range_that_is_none_is_told_in_the_unit_that_was_given() -> None:
    with pytest.raises(ParameterError, match=r"pressure 2\.5 to 1\.5 bar; speed 90 to 36 km/h"):
        Envelope.of(points_at(CONDITIONS), pressure=(2.5e5, 1.5e5), speed=(25.0, 10.0))


def test_possible_runs_come_after_the_present_ones_and_roll_as_they_do() -> None:
    present = points_at(CONDITIONS)
    new = operating_at(np.array([[4e3, 2e5, 20.0]]), present)
    assert new.order.tolist() == [1.0]
    assert new.omega[0] / new.speed[0] == pytest.approx(present.omega[0] / present.speed[0])
    assert np.isnan(new.temperature).all()
