"""What is left, said in words and powers; what is held out; the floor; the next test."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.unit.diagnose.planted import EFFECT, LOADS, STRENGTH, model_file, runs
from tests.unit.identify.model_waves import TIRE
from tirelib.compare.error import Yardstick, error_of
from tirelib.compare.model import model_of
from tirelib.diagnose.diagnose import fitted_problem, plain_tires
from tirelib.diagnose.document import next_test
from tirelib.diagnose.floor import floor_of
from tirelib.diagnose.held_out import folds, held_out_errors, part_of, pooled
from tirelib.diagnose.left import left_of
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE
from tirelib.identify.waveform_fit import Data
from tirelib.infer.select import Hypotheses
from tirelib.model.base import values_of
from tirelib.waveforms import GRID


@pytest.fixture(scope="module")
def fitted() -> tuple[Data, Refit]:
    data = runs().data(with_deflection=False)
    return data, refit(data, values_of(TIRE))


def test_a_misfit_is_told_where_it_is_and_how_it_grows(fitted: tuple[Data, Refit]) -> None:
    data, model = fitted
    bump = np.exp(-(((GRID - 2.0) / 0.05) ** 2))
    size = 1e-3 * (data.points.load / 4000.0) ** 2
    left = left_of(replace(data, strain=model.waveform - size[:, None] * bump), model)
    assert left.where.startswith("away from the contact")
    assert left.sectors["far side"] == pytest.approx(1.0, abs=0.05)
    power = left.powers["load"]
    assert power is not None
    assert power.value == pytest.approx(2.0, abs=0.1)
    assert power.low < power.value < power.high
    assert left.powers["camber"] is None
    assert left.span[0] == pytest.approx(2.0, abs=0.06)
    assert left.span[1] == pytest.approx(2.0, abs=0.06)
    assert "grows with load" in left.scaling
    assert "pressure" not in left.scaling
    # model less measured
    assert left.white[:, np.argmax(bump)].min() > 0.0


def test_the_highest_load_and_the_highest_pressure_are_held_out() -> None:
    data = runs().data(with_deflection=False)
    load, pressure = folds(data)
    assert (data.points.load[load.out] == LOADS[-1]).all()
    assert (data.points.load[~load.out] < LOADS[-1]).all()
    assert (data.points.pressure[pressure.out] == 2.3e5).all()
    assert not (data.points.pressure[~pressure.out] == 2.3e5).any()


def test_two_loads_or_one_pressure_are_not_held_out() -> None:
    data = runs().data(with_deflection=False)
    few = part_of(data, (data.points.load < 5000.0) & (data.points.pressure < 2e5))
    assert folds(few) == ()


def test_pooled_errors_are_weighed_by_runs_and_nothing_is_no_number() -> None:
    chosen = folds(runs().data(with_deflection=False))
    counts = [int(fold.out.sum()) for fold in chosen]
    expected = np.sqrt((counts[0] * 9.0 + counts[1] * 16.0) / sum(counts))
    assert pooled((3.0, 4.0), chosen) == pytest.approx(expected)
    assert np.isnan(pooled((), ()))
    assert np.isnan(pooled((3.0, np.nan), chosen))


def test_held_out_errors_are_of_runs_that_the_fit_has_not_seen(
    fitted: tuple[Data, Refit], monkeypatch: pytest.MonkeyPatch
) -> None:
    data, model = fitted
    (load, _), seen = folds(data), []
    monkeypatch.setattr(
        "tirelib.diagnose.held_out.refit",
        lambda part, *_, **__: seen.append(part.points.load) or model,
    )
    strain = data.strain + 1e-3 * load.out[:, None] * np.cos(3.0 * GRID)
    spoiled = Yardstick.of(replace(runs(), strain=strain))
    (error,) = held_out_errors(data, model, [load], spoiled)
    assert seen[0].max() < LOADS[-1]
    assert error == pytest.approx(spoiled.take(load.out).error(model.model, model.delay).value)
    assert error > 10.0 * spoiled.take(~load.out).error(model.model, model.delay).value


@pytest.mark.parametrize(("effect", "strength"), [("", 0.0), (EFFECT, STRENGTH)])
def test_the_floor_is_the_error_unless_more_is_missing_than_plain_tires_show(
    effect: str, strength: float
) -> None:
    planted = runs(effect, strength)
    base, problem = fitted_problem(planted, values_of(TIRE), list(CATALOGUE.values()))
    hypothesis = Hypotheses(problem, plain_tires()).base
    error = Yardstick.of(planted).error(base.model)
    floor = floor_of(error, hypothesis, 0.05)
    if effect:
        assert hypothesis.p <= 0.05
        assert 0.5 < floor < 0.9 * error.value
    else:
        assert floor == error.value


def test_errors_are_in_noise_or_without_repeats_in_microstrain() -> None:
    known, unknown = runs(), runs(repeats=0)
    told = error_of(known, model_of(model_file()))
    assert (told.unit, told.known) == ("noise", True)
    other = error_of(unknown, model_of(model_file()))
    assert other.unit == "ustrain"
    assert np.isnan(other.noise)
    assert other.value == pytest.approx(1e6 * other.rms)


def _told(verdict: str, *named: str) -> Any:
    findings = [SimpleNamespace(effect=CATALOGUE[name]) for name in named]
    return SimpleNamespace(
        verdict=verdict,
        named=named,
        findings=findings,
        diagnosis=SimpleNamespace(
            dead={"camber": "no run has a camber", "gage_gain": "always"}, like=None
        ),
        left=SimpleNamespace(where="in the contact", scaling="grows with load"),
        unit=SimpleNamespace(known=True),
    )


def test_the_next_test_parts_two_that_look_alike_by_what_only_one_varies_with() -> None:
    step = next_test(_told("indistinguishable", "hydroplaning", "sidewall_damping"))
    assert step["between"] == ["hydroplaning", "sidewall_damping"]
    assert "more levels of pressure," in step["what"]
    assert step["would_revive"] == {"camber": "no run has a camber"}


@pytest.mark.parametrize(
    ("verdict", "names", "says"),
    [
        ("none", (), "none is needed"),
        ("named", ("sidewall_load",), "tirelib add sidewall_load"),
        ("form_inadequate", ("sidewall_damping",), "more levels of speed"),
        ("unknown", (), "in the contact; it grows with load"),
    ],
)
def test_every_verdict_has_a_next_step(verdict: str, names: tuple[str, ...], says: str) -> None:
    assert says in next_test(_told(verdict, *names))["what"]
