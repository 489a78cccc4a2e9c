"""Twins of what is named: they serve as well, with the belt's shear beside them as it has it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose.diagnose import _verdict
from tirelib.diagnose.rivals import inseparable
from tirelib.diagnose.rounds import Rounds
from tirelib.effects import CATALOGUE


def finding(name: str, twins: tuple[str, ...] = (), level: str = "alarm") -> Any:
    return SimpleNamespace(
        effect=CATALOGUE[name],
        strength=np.array([0.1 * CATALOGUE[name].high]),
        threshold=10.0,
        twins=[(twin, 0.2) for twin in twins],
        in_range=True,
        level=level,
    )


def look(
    monkeypatch: pytest.MonkeyPatch, named: tuple[str, ...], left: dict[str, float]
) -> tuple[list[str], list[list[str]]]:
    """Return the twins of what is named, by the misfit that each leaves, and what is fitted."""
    made: list[list[str]] = []

    def refit(_: Any, effects: Any, strengths: Any) -> Any:
        names = [effect.name for effect in effects]
        made.append(names)
        if names[-1] not in left:
            return None  # it does not settle
        wave = np.full((1, 1), left[names[-1]])
        return SimpleNamespace(on_time=lambda _: SimpleNamespace(waveform=wave))

    base = SimpleNamespace(values={}, effects=(), strengths=(), delay=0.0, whiten=lambda x: x)
    structure = SimpleNamespace(normal=lambda _, white: SimpleNamespace(square=float(-white[0])))
    first: Any = SimpleNamespace(model=base, ranking=SimpleNamespace(structure=structure))
    data: Any = SimpleNamespace(strain=np.zeros((1, 1)), points=None)
    findings = [
        finding("temperature", ("tread_wear", "gage_drift")),
        finding("tread_wear"),
        finding("gage_drift", level="hint"),
        finding("belt_shear", ("temperature",)),
    ]
    return inseparable(data, first, findings, named, refit), made


@pytest.mark.parametrize("beside", [(), ("belt_shear",)])
def test_a_twin_that_serves_as_well_is_told_with_the_shear_beside_it_or_not(
    monkeypatch: pytest.MonkeyPatch, beside: tuple[str, ...]
) -> None:
    told, made = look(
        monkeypatch, ("temperature", *beside), {"temperature": 100.0, "tread_wear": 109.0}
    )
    assert told == ["tread_wear"]
    assert made == [[*beside, "temperature"], [*beside, "tread_wear"]]


@pytest.mark.parametrize(
    "left", [{"temperature": 100.0, "tread_wear": 111.0}, {"temperature": 1.0}]
)
def test_a_twin_that_leaves_more_or_does_not_settle_is_none(
    monkeypatch: pytest.MonkeyPatch, left: dict[str, float]
) -> None:
    assert look(monkeypatch, ("temperature", "belt_shear"), left)[0] == []


def test_two_that_are_hidden_have_no_twins_and_the_shear_alone_may(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert look(monkeypatch, ("temperature", "gage_drift"), {}) == ([], [])
    left = {"belt_shear": 100.0, "temperature": 100.0}
    assert look(monkeypatch, ("belt_shear",), left)[0] == ["temperature"]


def test_the_verdict_names_the_twins_without_the_shear() -> None:
    def stage(misfit: float, error: float) -> Any:
        return SimpleNamespace(
            scores=SimpleNamespace(misfit=misfit),
            unit=1.0,
            beyond=1.0,
            model=SimpleNamespace(error=error),
        )

    named = ["temperature", "belt_shear"]
    found = Rounds(stage(1.0, 0.1), named, 1, None, ())
    told = _verdict(named, ["tread_wear"], stage(1000.0, 1.0), found, None)
    assert told == ("indistinguishable", ["temperature", "tread_wear"])
    assert _verdict(named, [], stage(1000.0, 1.0), found, None) == ("named", named)
