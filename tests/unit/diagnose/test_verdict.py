"""What a verdict makes of an explanation: in the metric of structure, and in plain error."""

from types import SimpleNamespace
from typing import Any

import pytest

from tirelib.diagnose.diagnose import BARELY, BEYOND, EXPLAINED, OUTSIDE, _verdict
from tirelib.diagnose.refit import FELL
from tirelib.diagnose.rounds import HALVED, Rounds


def stage(misfit: float, error: float, beyond: float = 1.0, **told: float) -> Any:
    """Return what a verdict looks at of a stage."""
    seen = {"outside": 0.0, "imitated": 0.0} | told
    return SimpleNamespace(
        scores=SimpleNamespace(misfit=misfit),
        unit=100.0,
        beyond=beyond,
        model=SimpleNamespace(error=error),
        **seen,
    )


FIRST = stage(1100.0, 1.0, 5.0)


def after(explained: float, fell: float, beyond: float = 1.0) -> Any:
    return stage(100.0 + 1000.0 * (1.0 - explained), float((1.0 - fell) ** 0.5), beyond)


def told(last: Any, *, by_share: tuple[str, ...] = ()) -> Rounds:
    return Rounds(last, ["a"], 1, None, by_share)


@pytest.mark.parametrize(
    ("explained", "fell", "beyond", "verdict"),
    [
        (EXPLAINED + 0.01, FELL + 0.01, 1.0, "named"),
        (EXPLAINED - 0.01, FELL + 0.01, 1.0, "unknown"),
        (0.0, HALVED + 0.01, 1.0, "named"),
        (0.0, HALVED + 0.01, BEYOND + 0.1, "form_inadequate"),
        (0.0, HALVED - 0.01, 1.0, "unknown"),
        (EXPLAINED + 0.01, FELL - 0.01, 1.0, "unknown"),
    ],
)
def test_what_is_named_takes_the_misfit_or_half_of_the_error_and_never_none_of_it(
    explained: float, fell: float, beyond: float, verdict: str
) -> None:
    assert pytest.approx(0.8) == EXPLAINED
    said, named = _verdict(["a"], [], FIRST, told(after(explained, fell, beyond)), None)
    assert said == verdict
    assert named == (["a"] if verdict != "unknown" else [])


@pytest.mark.parametrize(("fell", "verdict"), [(FELL + 0.01, "named"), (FELL - 0.01, "unknown")])
def test_what_takes_most_beside_the_shear_need_not_take_half_without_it(
    fell: float, verdict: str
) -> None:
    last = after(0.0, fell)
    assert _verdict(["a"], [], FIRST, told(last, by_share=("a",)), None)[0] == verdict
    assert _verdict(["a"], [], FIRST, told(last, by_share=("gone",)), None)[0] == "unknown"


@pytest.mark.parametrize(
    ("outside", "imitated", "verdict"),
    [
        (OUTSIDE - 0.1, BARELY - 0.1, "none"),
        (OUTSIDE + 0.1, 0.0, "unknown"),
        (0.0, BARELY + 0.1, "unknown"),
    ],
)
def test_what_cannot_be_but_explains_tells_of_something_unknown(
    outside: float, imitated: float, verdict: str
) -> None:
    scores = SimpleNamespace(misfit=1.0)
    stage = SimpleNamespace(scores=scores, unit=1.0, beyond=1.0, outside=outside, imitated=imitated)
    assert _verdict([], (), stage, told(stage), None) == (verdict, [])


@pytest.mark.parametrize(
    ("named", "verdict"),
    [(["belt_shear"], "unknown"), (["a"], "named"), (["a", "belt_shear"], "named")],
)
def test_the_shear_of_every_belt_does_not_explain_what_no_catalogue_holds(
    named: list[str], verdict: str
) -> None:
    last: Any = after(EXPLAINED + 0.01, FELL + 0.01)
    like: Any = SimpleNamespace(effect=SimpleNamespace(name="gain_by_load"))
    assert _verdict(named, [], FIRST, told(last), None) == ("named", named)
    assert _verdict(named, [], FIRST, told(last), like)[0] == verdict
