"""What is left, said in words and powers; what is held out; the floor; the next test."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.unit.inference.diagnose.planted import EFFECT, LOADS, model_file, runs
from tests.unit.inference.identify.model_waves import TIRE
from tirelib.core.arrays import BoolArray
from tirelib.effects import CATALOGUE
from tirelib.inference.compare.error import Yardstick, error_of
from tirelib.inference.compare.model import TireModel, model_of
from tirelib.inference.diagnose import strain_models
from tirelib.inference.diagnose.diagnose import plain_tires
from tirelib.inference.diagnose.document import next_test
from tirelib.inference.diagnose.held_out import pooled, strain_folds
from tirelib.inference.diagnose.left import left_of, powers_of, told_range
from tirelib.inference.diagnose.strain_models import Fitted, floor_of
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.measured.waveforms import GRID
from tirelib.model.base import values_of


def base_of(measured: StraightRuns) -> Fitted:
    """Return the base model fitted to runs, among hypotheses of the whole catalogue."""
    problem = StrainProblem(measured, values_of(TIRE), list(CATALOGUE.values()))
    among = Hypotheses(problem, plain_tires())
    return Fitted.of(among, among.base, Yardstick.of(measured))


@pytest.fixture(scope="module")
def plain() -> Fitted:
    return base_of(runs())


def test_a_misfit_is_told_where_it_is_and_how_it_grows(plain: Fitted) -> None:
    points = runs().data().points
    bump = np.exp(-(((GRID - 2.0) / 0.05) ** 2))
    size = 1e-3 * (points.load / 4000.0) ** 2
    left = left_of(replace(plain.reached, rest=-size[:, None] * bump), points)
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
    load, pressure = strain_folds(data)
    assert (data.points.load[load.out] == LOADS[-1]).all()
    assert (data.points.load[~load.out] < LOADS[-1]).all()
    assert (data.points.pressure[pressure.out] == 2.3e5).all()
    assert not (data.points.pressure[~pressure.out] == 2.3e5).any()


def test_two_loads_or_one_pressure_are_not_held_out() -> None:
    data = runs().data(with_deflection=False)
    few = (data.points.load < 5000.0) & (data.points.pressure < 2e5)
    assert strain_folds(replace(data, points=data.points.take(few))) == ()


def test_pooled_errors_are_weighed_by_runs_and_nothing_is_no_number() -> None:
    chosen = strain_folds(runs().data(with_deflection=False))
    counts = [int(fold.out.sum()) for fold in chosen]
    expected = np.sqrt((counts[0] * 9.0 + counts[1] * 16.0) / sum(counts))
    assert pooled((3.0, 4.0), chosen) == pytest.approx(expected)
    assert np.isnan(pooled((), ()))
    assert np.isnan(pooled((3.0, np.nan), chosen))


def test_held_out_errors_are_of_runs_that_the_fit_has_not_seen(
    plain: Fitted, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = runs().data()
    (load, _), seen = strain_folds(data), []

    def trained(_: Fitted, out: BoolArray) -> tuple[TireModel, float]:
        seen.append(data.points.load[~out])
        return plain.model, 0.0

    monkeypatch.setattr(Fitted, "without_runs", trained)
    strain = data.strain + 1e-3 * load.out[:, None] * np.cos(3.0 * GRID)
    spoiled = Yardstick.of(replace(runs(), strain=strain))
    error = plain.held_out(load, spoiled)
    assert error is not None
    assert seen[0].max() < LOADS[-1]
    assert error.value == pytest.approx(spoiled.take(load.out).error(plain.model, 0.0).value)
    assert error.value > 10.0 * spoiled.take(~load.out).error(plain.model, 0.0).value


def test_what_is_held_out_moves_no_number(plain: Fitted, monkeypatch: pytest.MonkeyPatch) -> None:
    """Spoiled runs that are left out change nothing; the same runs in the fit do."""
    # errors alone need no more than a rough fit, which depends on where it starts
    monkeypatch.setattr(strain_models, "ROUGH", 1e-3)
    load, _ = strain_folds(runs().data())
    strain = runs().strain + 1e-4 * load.out[:, None] * np.cos(3.0 * GRID)
    spoiled = base_of(replace(runs(), strain=strain))
    alone, _ = plain.without_runs(load.out)
    again, _ = spoiled.without_runs(load.out)
    name = "radial_stiffness"
    assert float(again.values[name]) == pytest.approx(float(alone.values[name]), rel=2e-3)
    moved = abs(float(spoiled.values[name]) / float(plain.values[name]) - 1.0)
    assert moved > 1e-2


WEAK = 0.08
"""Strength that acts to first order."""


@pytest.mark.parametrize(("effect", "strength"), [("", 0.0), (EFFECT, WEAK)])
def test_the_floor_is_the_error_unless_more_is_missing_than_plain_tires_show(
    effect: str, strength: float
) -> None:
    base = base_of(runs(effect, strength))
    floor = floor_of(base.reached, base.hypothesis, 0.05)
    if effect:
        assert base.hypothesis.p <= 0.05
        assert 0.0 < floor < 0.5 * base.error
    else:
        assert floor == base.error


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
        after=SimpleNamespace(known=True),
    )


def test_the_next_test_parts_two_that_look_alike_by_what_only_one_varies_with() -> None:
    step = next_test(_told("indistinguishable", "temperature", "gage_drift"))
    assert step["between"] == ["temperature", "gage_drift"]
    assert "more levels of temperature," in step["what"]
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


def test_a_range_through_the_seam_of_the_turn_is_told_in_the_angles_of_the_plots() -> None:
    assert told_range(*np.deg2rad([-6.0, 7.0])) == "from -6 to 7 deg"
    assert told_range(*np.deg2rad([154.0, 296.0])) == "from 154 through 180 to -64 deg"


def test_intervals_of_powers_hold_95_percent_of_them() -> None:
    """Of sizes that scatter by a fifth about a law of load and speed, in few runs."""
    random = np.random.default_rng(8)
    load, speed = (grid.ravel() for grid in np.meshgrid([2e3, 4e3, 6e3], [10.0, 20.0, 30.0]))
    inside = []
    for _ in range(600):
        size = load**0.5 / speed * np.exp(0.2 * random.standard_normal(load.size))
        found = powers_of({"load": load, "speed": speed}, size)
        inside += [
            p.low < true < p.high for p, true in zip(found.values(), (0.5, -1.0), strict=True)
        ]
    # 1200 intervals: 0.6 % of a share of 95 %
    assert np.mean(inside) == pytest.approx(0.95, abs=0.02)
