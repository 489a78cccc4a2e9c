"""A verdict in four lines: what they say, and when."""

from typing import Any

import pytest

from tirelib.report.error_sentences import error_line, held_out_line, unmoved
from tirelib.report.explanation import STANDS_OUT, explained, mark_of, titled


def candidate(effect: str, **changes: Any) -> dict[str, Any]:
    return {
        "effect": effect,
        "title": f"What {effect} does.",
        "score": 14.0,
        "threshold": 2.0,
        "level": "alarm",
        "strength": 0.0812,
        "std": 0.0011,
        "unit": "1",
        "range": [0.0, 0.3],
        "in_range": True,
    } | changes


def diagnosis(**changes: Any) -> dict[str, Any]:
    return {
        "quantity": "strain",
        "verdict": "named",
        "named": ["damping"],
        "error_unit": "noise",
        "error_before": 30.01,
        "error_refitted": 23.5,
        "error_after": 7.74,
        "floor": 7.1,
        "residual_rms_before": 84.26,
        "residual_rms_after": 37.6,
        "residual_rms_unit": "ustrain",
        "heldout_error_before": 25.9,
        "heldout_error_after": 9.9,
        "held_out": [],
        "candidates": [candidate("damping"), candidate("shear", level="quiet", score=0.2)],
        "sets": [["damping"]],
        "p": 0.41,
        "p_without": 0.0004,
        "p_least": 0.0002,
        "false_alarm": 0.05,
        "misfit_of": "roughly damping",
        "dead": [],
        "unexplained": {"where": None},
        "next_test": {"what": "more levels of load"},
    } | changes


def fold(condition: str, before: float, after: float) -> dict[str, Any]:
    return {
        "condition": condition,
        "value": 7506.0,
        "unit": "N",
        "runs": 12,
        "error_before": before,
        "error_after": after,
    }


def test_what_is_named_is_told_with_its_size_its_fall_and_the_command_that_adds_it() -> None:
    told = explained(diagnosis(), "M.toml", "DIR")
    assert told.missing == "damping (what damping does), strength 0.0812 \u00b1 0.001."
    assert told.sure == (
        "Without it the model is rejected (p = 0.0004); with it nothing stands out from what plain "
        "tires show (p = 0.41). No other effect of the catalogue explains these measurements as "
        "well."
    )
    assert told.error == (
        "It falls from 30 to 7.7 times the noise with it (84.3 to 37.6 microstrain rms, errors of "
        "the set points included). Noise and the structure of a tire explain 7.1 of what is left. "
        "On what was held out of the fit it falls from 25.9 to 9.9. Without it, the model's own "
        "numbers fitted anew leave 23.5."
    )
    assert error_line(diagnosis(named=["damping", "shear"])).endswith(
        "Without them, the model's own numbers fitted anew leave 23.5."
    )
    assert error_line(diagnosis(error_after=30.0)).startswith("It stays at 30 times the noise")


def test_the_smallest_p_value_of_the_table_is_told_as_such() -> None:
    told = explained(diagnosis(p_without=1 / 41, p_least=1 / 41))
    assert told.sure.startswith(
        "Without it the model is rejected (p = 0.024, the smallest value that the table of plain "
        "tires can give); with it "
    )


def test_an_effect_that_is_taken_out_is_told_as_a_rise() -> None:
    removed = diagnosis(action="remove", error_before=7.7, error_after=30.0, error_refitted=7.5)
    told = error_line(removed | {"named": []})
    assert told.startswith("It rises from 7.7 to 30 times the noise without it (84.3 to 37.6")
    assert told.endswith("With it, the model's own numbers fitted anew leave 7.5.")


def test_what_is_named_is_added_by_a_command_that_can_be_pasted() -> None:
    told = explained(diagnosis(), "M.toml", "DIR")
    assert told.next.startswith("Add it: tirelib add damping --model M.toml --data DIR --out M2")
    spaced = explained(diagnosis(), "my M.toml", "a b", ["own law.py"])
    assert "--model 'my M.toml' --data 'a b' --effects 'own law.py' --out M2" in spaced.next
    assert [title for title, _ in titled(told._asdict())] == [
        "What is missing",
        "How sure",
        "The error",
        "What to do next",
    ]


def test_an_error_in_its_own_unit_is_told_once() -> None:
    changes = {"error_unit": "ustrain", "error_before": 84.26, "error_refitted": 84.26}
    told = error_line(diagnosis(verdict="none", named=[], error_after=84.26, floor=None, **changes))
    assert told.startswith("It is 84.3 microstrain.")


def test_two_effects_that_are_named_together_are_added_together() -> None:
    """One of two alone may raise the error on what is held out: it was judged with the other."""
    told = explained(diagnosis(named=["damping", "shear"]), "M.toml", "DIR")
    assert told.next.startswith("Add them together: tirelib add damping shear --model M.toml ")


def test_an_effect_of_a_users_file_is_added_with_that_file() -> None:
    told = explained(diagnosis(), "M.toml", "DIR", ["mine.py"])
    assert "--data DIR --effects mine.py --out M2.toml" in told.next


def test_a_plain_difference_that_rises_while_the_error_falls_is_told_with_its_reason() -> None:
    told = error_line(diagnosis(residual_rms_before=28.2, residual_rms_after=46.9))
    assert "It falls from 30 to 7.7 times the noise with it. Noise" in told
    rose = "The rms that includes the errors of the set points rose from 28.2 to 46.9 microstrain."
    assert rose in told
    assert "rose" not in error_line(diagnosis())


def test_what_does_not_fall_on_what_was_held_out_is_said() -> None:
    same = diagnosis(heldout_error_before=6.7, heldout_error_after=6.68)
    assert held_out_line(same) == (
        "The error of the runs held out did not fall: 6.7 before, 6.7 after."
    )
    grown = diagnosis(held_out=[fold("load", 4.96, 7.1), fold("pressure", 8.0, 3.0)])
    assert unmoved(grown) == [
        "The error with the load 7506 N (12 runs) held out did not fall: 5 before, 7.1 after."
    ]
    assert "it falls from 25.9 to 9.9" in held_out_line(grown)
    assert unmoved(grown)[0] in held_out_line(grown)
    assert unmoved(diagnosis()) == []
    points = diagnosis(heldout_error_before=6.7, heldout_error_after=7.9, quantity="Fy")
    assert "of the points held out did not fall" in error_line(points)


@pytest.mark.parametrize(
    ("changes", "missing", "sure"),
    [
        (
            {"verdict": "none", "named": [], "sets": []},
            "Nothing",
            "The most conspicuous effect, damping, reaches 7 of the score that would count",
        ),
        (
            {
                "verdict": "indistinguishable",
                "named": ["damping", "shear"],
                "sets": [["damping"], ["shear"]],
            },
            "do not show which: damping (what damping does) or shear",
            "equally well",
        ),
        (
            {
                "verdict": "unknown",
                "named": [],
                "sets": [],
                "unexplained": {"where": {"text": "in the contact"}},
            },
            "no effect of the catalogue explains. It appears in the contact",
            "Every hypothesis that was tried is rejected",
        ),
        (
            {"verdict": "form_inadequate"},
            "a law is not right, or more is missing",
            "law of damping",
        ),
        (
            {"error_unit": "ustrain", "verdict": "none", "named": []},
            "This is not known",
            "measured twice",
        ),
    ],
)
def test_every_verdict_has_its_words(changes: dict[str, Any], missing: str, sure: str) -> None:
    told = explained(diagnosis(**changes))
    assert missing in told.missing
    assert sure in told.sure
    for said in told:
        assert said[0].isupper() or said.startswith("damping")
        assert said.endswith(".")


def test_alternatives_and_doubts_are_named() -> None:
    hint = candidate("drift", level="hint")
    told = explained(diagnosis(candidates=[candidate("damping", in_range=False), hint]))
    assert "outside the plausible 0 to 0.3" in told.sure
    assert "not needed in addition to what is named: drift." in told.sure
    blind = explained(diagnosis(dead=["camber", "a", "b", "c", "d"]))
    assert "cannot show 5 effects at all (camber, a, b and 2 more)" in blind.sure


def test_p_values_say_how_sure_a_name_is() -> None:
    told = explained(
        diagnosis(
            candidates=[candidate("damping", p=0.41)],
            sets=[["damping"], ["shear", "drift"]],
            p=0.41,
            p_without=0.048,
            false_alarm=0.05,
        )
    )
    assert "Without it the model is rejected (p = 0.048); with it nothing stands out" in told.sure
    assert "(p = 0.41)" in told.sure
    assert "Not ruled out: shear with drift." in told.sure


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (
            "form_inadequate",
            "Without it the model is rejected (p = 0.024), and with it as well (p = 0.03; 0.05 is "
            "needed): the law of damping stands out",
        ),
        ("unknown", "Every hypothesis that was tried is rejected (p = 0.03 of the likeliest"),
    ],
)
def test_a_rejected_model_says_what_stands_out(verdict: str, said: str) -> None:
    named = ["damping"] if verdict == "form_inadequate" else []
    told = explained(
        diagnosis(
            verdict=verdict,
            named=named,
            candidates=[candidate("damping", p=0.03)],
            sets=[named] if named else [],
            p=0.03,
            p_without=0.024,
            false_alarm=0.05,
            misfit_of="roughly damping",
        )
    )
    assert said in told.sure


def test_what_stands_out_beside_the_named_effects_has_a_mark_and_is_told() -> None:
    left = {"where": "at the ends of load", "scaling": "rises with pressure"}
    told = diagnosis(verdict="form_inadequate", misfit_of="shear", unexplained=left)
    marks = [mark_of(told, entry) for entry in told["candidates"]]
    assert marks == ["alarm", STANDS_OUT]
    assert [entry["level"] for entry in told["candidates"]] == ["alarm", "quiet"]
    lines = explained(told)
    assert lines.missing.endswith(
        " What is left appears at the ends of load; it rises with pressure."
    )
    assert "No other effect" not in lines.sure
    assert lines.next.endswith("What stands out in addition is shear.")
    named = diagnosis(misfit_of="shear")
    assert [mark_of(named, entry) for entry in named["candidates"]] == ["alarm", "quiet"]


def test_the_worst_held_out_part_is_named_and_a_useless_effect_is_told_once() -> None:
    folds = [fold("load", 41.0, 18.0), fold("pressure", 20.0, 9.0)]
    assert held_out_line(diagnosis(held_out=folds)) == (
        "On what was held out of the fit it falls from 25.9 to 9.9 (worst: the load 7506 N "
        "(12 runs), where it falls from 41 to 18)."
    )
    same = [fold("cell", 9.0, 9.0)] * 4
    assert unmoved(diagnosis(heldout_error_after=25.9, held_out=same)) == [
        "The error on the runs held out fell in none of 4 parts: 25.9 before, 25.9 after, on "
        "average."
    ]


def test_effects_that_the_plan_would_mostly_miss_need_other_runs() -> None:
    found, missed = candidate("damping", power=0.9), candidate("shear", power=0.008)
    enough = "No further run is needed for the effects that this plan finds."
    more = (
        "At a third of its plausible strength it would mostly miss shear: only other runs would "
        "show such an effect."
    )

    def said(*candidates: dict[str, Any]) -> str:
        fits = {"error_before": 1.2, "error_refitted": 1.2, "error_after": 1.2, "floor": 1.2}
        told = diagnosis(verdict="none", named=[], candidates=list(candidates), **fits)
        return explained(told).next

    assert said(found) == enough
    assert said(found, missed) == f"{enough} {more}"
    assert said(missed) == more


def test_without_a_name_one_error_is_told() -> None:
    told = explained(diagnosis(verdict="none", named=[], error_after=23.5, floor=23.5))
    assert "In 41 % of plain tires" in told.sure
    assert told.error == (
        "It is 30 times the noise (84.3 microstrain rms, errors of the set points included), 23.5 "
        "with the model's own numbers fitted anew. What is left (23.5 times the noise, 37.6 "
        "microstrain) is no more than simulated tires leave; a missing effect of this size cannot "
        "be excluded."
    )
    assert "No further run" in told.next
    odd = explained(diagnosis(verdict="unknown", named=[], error_after=23.5, floor=23.5, p=0.03))
    assert odd.error.endswith(
        "Noise and the structure of a tire can be as large, but not of this shape."
    )


def test_numbers_that_cover_for_a_missing_effect_are_told_by_what_was_held_out() -> None:
    """Fitted anew without the effect they may leave less on their own runs, and fail on others."""
    line = error_line(diagnosis(error_refitted=7.1))
    assert line.endswith(
        "Without it, the model's own numbers fitted anew leave 7.1 on the runs that they are "
        "fitted to: less, but 25.9 on those held out. Numbers that cover for a missing effect fit, "
        "and do not predict."
    )
    not_held_out = {"heldout_error_before": None, "heldout_error_after": None}
    line = error_line(diagnosis(error_refitted=7.1, **not_held_out))
    assert line.endswith("to: less, but of a shape that plain tires do not show.")


@pytest.mark.parametrize(("refitted", "advised"), [(4.5, True), (50.0, False)])
def test_a_model_that_is_not_fitted_to_the_measurements_is_not_said_to_lack_nothing(
    refitted: float, advised: bool
) -> None:
    plain = diagnosis(verdict="none", named=[], sets=[], error_before=71.6, error_after=refitted)
    told = explained(plain | {"error_refitted": refitted, "p": 0.4}, "M.toml", "DIR")
    assert ("once its own numbers are fitted to them" in told.missing) is advised
    assert told.next.startswith("Fit the model to these measurements") is advised
