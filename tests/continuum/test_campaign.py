"""A campaign of the rolling continuum: what is drawn, hidden, measured and written."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from continuum import campaign as made
from continuum.effects import EFFECTS, Run
from continuum.measure import laboratory, record, settled
from continuum.observe import trace
from continuum.sidewall import at
from continuum.solve import model
from continuum.tire import Condition, draw

from tests.continuum.rolling import COARSE, COND, TIRE, plain, state
from tirelib.campaign import read_campaign
from tirelib.core.errors import ParameterError

RUN = Run(COND, 0.5, 1.0, 60.0, 2.5e5)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_an_effect_of_no_strength_changes_nothing(name: str) -> None:
    effect, seen, law = EFFECTS[name], trace(state()), plain().law
    assert effect.tire(TIRE, RUN, 0.0) == TIRE
    after, w, p = effect.law(law, RUN, 0.0), np.linspace(-0.03, 0.004, 9), COND.pressure
    np.testing.assert_allclose(after.force(w, p, 1.0), law.force(w, p, 1.0), rtol=1e-12)
    assert at(after.tangential, p) == pytest.approx(at(law.tangential, p), rel=1e-12)
    np.testing.assert_allclose(effect.shown(seen, TIRE, RUN, 0.0).strain, seen.strain, atol=1e-12)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_an_effect_of_its_visible_strength_changes_something(name: str) -> None:
    effect, seen, law = EFFECTS[name], trace(state()), plain().law
    s = effect.visible
    changed = (
        effect.tire(TIRE, RUN, s) != TIRE
        or not np.array_equal(effect.law(law, RUN, s).radial, law.radial)
        or np.abs(effect.shown(seen, TIRE, RUN, s).strain - seen.strain).max() > 5e-6
    )
    assert changed


def test_every_constant_of_the_tire_is_drawn() -> None:
    one, other = asdict(draw(1)), asdict(draw(2))
    assert draw(1) == draw(1)
    fixed = {"friction", "creep", "damping", "softening", "roughness", "water"}
    assert {k for k in one if one[k] == other[k]} == fixed
    fixed_arch = {"ply_thickness"}
    assert {k for k in one["arch"] if one["arch"][k] == other["arch"][k]} == fixed_arch
    offsets = [draw(seed).innerliner_offset for seed in range(40)]
    assert min(offsets) < -0.0042
    assert max(offsets) > -0.0022


def test_the_recorded_strain_is_the_state_s_through_gain_and_noise() -> None:
    lab, s = laboratory(3), state()
    seen = trace(s)
    out = record(lab, s, seen, 0, 0.0)
    n = out.strain.shape[1]
    turn = 2.0 * np.pi / s.omega * lab.rate
    assert n == int(np.ceil(5.1 * turn))
    marks = np.flatnonzero(out.trigger)
    phi = -np.pi + (np.arange(n) - marks[1]) * s.omega / lab.rate
    error = np.empty(5)
    for gage in range(5):
        at_ = np.mod(phi + np.pi, 2 * np.pi) - np.pi
        true, slope = (
            np.interp(at_, seen.phi, y)
            for y in (seen.strain[:, gage], np.gradient(seen.strain[:, gage], seen.phi))
        )
        left = np.stack([true, slope, np.ones(n)], axis=1)
        (gain, late, offset), rest, *_ = np.linalg.lstsq(left, out.strain[gage], rcond=None)
        error[gage] = np.sqrt(rest[0] / n)
        assert gain == pytest.approx(lab.gain[gage], abs=5.0 * lab.gain_repeat)
        # the trigger is late by its delay and by what is left of a sample
        assert -0.1 < late / s.omega * lab.rate < 1.0 + lab.delay * lab.rate + 0.1
        assert abs(offset) < 2e-4
    # noise of 3 to 6 microstrain, quantisation of 0.7, and some of a load that swings by 25 N
    assert error.max() < 20e-6
    assert out.rig["Fz"].mean() == pytest.approx(COND.load, abs=60.0)


def test_a_gage_beyond_its_range_is_refused() -> None:
    s = state()
    with pytest.raises(ArithmeticError, match=r"run 7: a gage shows .* its range is 8000"):
        record(replace(laboratory(3), range=0.008), s, trace(s), 7, 0.0)


def test_plans_repeat_conditions_and_errors_belong_to_the_run() -> None:
    for runs, different in ((66, 60), (15, 12)):
        plan = made.plan(runs, 5)
        assert len(plan) == runs
        assert len(set(plan)) == different
    with pytest.raises(ParameterError, match="runs = 20; allowed are 66 and 15"):
        made.plan(20, 5)
    lab = laboratory(5)
    assert settled(lab, COND, 3) == settled(lab, COND, 3) != settled(lab, COND, 4)


@pytest.mark.parametrize(
    ("hidden", "message"),
    [
        ({"camber": 0.1}, "'camber' is unknown; allowed are sidewall_load"),
        ({"tread_wear": 1.2}, r"tread_wear, strength = 1.2 1; allowed are 0 to 0.6 1"),
    ],
)
def test_what_cannot_be_hidden_is_refused(
    tmp_path: Path, hidden: dict[str, float], message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        made.make(tmp_path / "c", 4, hidden=hidden)
    assert not (tmp_path / "c").exists()


def test_a_campaign_is_written_and_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    two = (Condition(3000.0, 2.2e5, 12.0), Condition(3000.0, 1.9e5, 12.0))
    monkeypatch.setattr(made, "plan", lambda runs, seed: two)
    monkeypatch.setattr(made, "model", lambda tire: model(tire, COARSE))
    made.make(tmp_path / "c", 4, hidden={"angle_zero": 0.01, "tread_wear": 0.6})
    truth = json.loads((tmp_path / "c" / "truth.json").read_text())
    assert truth["hidden"] == {"angle_zero": 0.01, "tread_wear": 0.6}
    assert truth["ring"]["EI"] > 0.0
    # the second run is the last: 60 % of the tread is gone, and the axle is lower by more
    first, last = (run["axle_height_m"] for run in truth["runs"])
    assert first - last > 0.6 * draw(4).tread_thickness
    read = read_campaign(tmp_path / "c")
    assert [run.plan.pressure for run in read.runs()] == pytest.approx([2.2e5, 1.9e5])
