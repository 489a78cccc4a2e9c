"""Starts, priors, intervals and flags of an identification, on what the model itself made."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from proof.case import fingerprint
from scipy import stats

from tests.synthetic import header
from tests.unit.inference.identify.model_waves import LOADS, TIRE, made_waves
from tirelib.campaign.model import TireGeometry
from tirelib.core.errors import CalibrationError
from tirelib.core.parameters import Number, TireFile, read_tire
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.inference.identify.estimate import Estimate
from tirelib.inference.identify.identify import estimates_of, fitted, start_file
from tirelib.inference.identify.structure import STRUCTURE_STD, WITHOUT_SHEAR
from tirelib.model.base import BARE, PLAIN

GOLDEN = Path(__file__).parents[3] / "golden/identification_proof.json"


@pytest.fixture(scope="module")
def runs() -> StraightRuns:
    return straight_runs(made_waves(loads=LOADS[::2]))


@pytest.fixture(scope="module")
def estimates(runs: StraightRuns) -> dict[str, Estimate]:
    return {e.name: e for e in estimates_of(*fitted(runs, base="dissertation"))}


def test_true_values_lie_in_the_intervals(estimates: dict[str, Estimate]) -> None:
    for name, e in estimates.items():
        assert e.low < getattr(TIRE, name) < e.high, name
        assert e.low < e.value < e.high


def test_intervals_hold_structure_beside_the_fit(estimates: dict[str, Estimate]) -> None:
    e = estimates["bending_stiffness"]
    structure = WITHOUT_SHEAR["bending_stiffness"] * e.value
    assert e.std == pytest.approx(np.hypot(e.fit_std, structure))
    assert e.high - e.value >= 1.96 * structure
    assert set(STRUCTURE_STD) == {c.name for c in PLAIN}
    assert set(WITHOUT_SHEAR) == {c.name for c in BARE}


def test_wide_numbers_are_flagged_with_help(estimates: dict[str, Estimate]) -> None:
    for e in estimates.values():
        wide = 0.5 * (e.high - e.low) > 0.25 * abs(e.value)
        if wide:
            assert "not_identifiable" in e.flags
        assert bool(e.helps) == ("not_identifiable" in e.flags)
    assert not estimates["radial_stiffness"].flags
    assert estimates["tangential_stiffness"].helps.startswith("a torsional sidewall test (S_theta")
    assert estimates["tread_stiffness"].helps.startswith("a press test of the tread alone")
    slope = estimates["tangential_pressure_slope"].helps
    assert slope.startswith("torsional sidewall tests (S_theta to 3%) at 1.4 and 3.0 bar")


def test_the_help_tells_the_widths_now_and_then(estimates: dict[str, Estimate]) -> None:
    e = estimates["tangential_stiffness"]
    now, then = re.findall(r"interval from (\d+) to (\d+) %", e.helps)[0]
    assert int(now) == pytest.approx(100.0 * 0.5 * (e.high - e.low) / e.value, abs=1.0)
    # S_theta is in proportion to k_v, so its 3 % are those of k_v
    assert int(then) == pytest.approx(196.0 * 0.03, abs=1.0)


def test_one_pressure_tells_no_slopes() -> None:
    found = {
        e.name: e
        for e in estimates_of(
            *fitted(straight_runs(made_waves(pressures=(2.1e5,))), base="dissertation")
        )
    }
    slope = found["radial_pressure_slope"]
    assert "not_identifiable" in slope.flags
    assert "straight run" in slope.helps
    assert re.search("1.7 bar|2.5 bar", slope.helps), "a pressure that the campaign lacks"
    assert "not_identifiable" in found["tangential_pressure_slope"].flags


def test_one_pressure_tells_nothing_of_an_offset_that_goes_with_it() -> None:
    runs = straight_runs(made_waves(pressures=(2.1e5,)))
    (slope,) = (e for e in estimates_of(*fitted(runs)) if e.name == "offset_pressure_slope")
    assert slope.value == 0.0
    assert slope.fit_std == pytest.approx(0.03, rel=1e-3), "the prior's"
    assert "not_identifiable" in slope.flags
    assert not re.search("inf|nan", slope.helps)


def test_the_start_is_geometry_then_literature(runs: StraightRuns) -> None:
    start = start_file(header(), runs, None)
    pressure = float(np.mean(runs.waves.conditions["pressure"]))
    assert start.tire.pressure == pytest.approx(pressure)
    assert start.tire.ring_radius == 0.302
    assert start.tire.radial_stiffness == pytest.approx(1.0 * pressure + 2.4e5)
    assert start.numbers["innerliner_offset"].std == pytest.approx(0.05 * 0.0033)
    assert np.isfinite(start.tire.extension_stiffness)
    assert start.tire.damping == 0.0


def test_lengths_that_a_campaign_does_not_state_are_named(runs: StraightRuns) -> None:
    bare = replace(header(), tire=TireGeometry("bare", 0.3165, ring_radius=0.302))
    with pytest.raises(CalibrationError, match="state belt_width_m, tread_thickness_m, inn"):
        start_file(bare, runs, None)
    given = read_tire("table-6-1")
    assert start_file(bare, runs, given).tire.belt_width == given.tire.belt_width


def test_a_given_tire_is_moved_to_the_pressure_of_the_campaign(runs: StraightRuns) -> None:
    given = read_tire("table-6-1")
    numbers = {**given.numbers, "radial_pressure_slope": Number(1.0, 0.1, "fitted", "a test")}
    start = start_file(header(), runs, TireFile("a", numbers))
    shift = start.tire.pressure - given.tire.pressure
    assert shift > 5e4
    assert start.tire.radial_stiffness == pytest.approx(given.tire.radial_stiffness + shift)
    assert start.tire.damping == 0.0, "damping is no part of the base model"
    assert np.isfinite(start.tire.extension_stiffness), "an infinite one is no start"


def test_without_loaded_radius_and_repeats_it_works() -> None:
    waves = made_waves(loads=LOADS[::2], repeats=0, radius=False)
    for e in estimates_of(*fitted(straight_runs(waves), base="dissertation")):
        assert e.low < getattr(TIRE, e.name) < e.high


def test_a_value_far_from_its_prior_is_at_a_boundary(runs: StraightRuns) -> None:
    given = {"bending_stiffness": Number(1.0, 0.05, "measured", "a wrong test")}
    start = start_file(header(), runs, None)
    wrong = replace(start, numbers={**start.numbers, **given})
    found = {e.name: e for e in estimates_of(*fitted(runs, wrong, base="dissertation"))}
    assert "at_boundary" in found["bending_stiffness"].flags


def test_the_proof_holds_what_the_documentation_says() -> None:
    proof = json.loads(GOLDEN.read_text())
    assert len(proof["recipe"]["seeds"]) >= 15
    assert proof["recipe"]["structure_std"] == dict(STRUCTURE_STD)
    assert proof["coverage_all"] >= 0.9
    for name, row in proof["parameters"].items():
        held, cases = round(row["coverage"] * row["cases"]), row["cases"]
        assert stats.binom.cdf(held, cases, 0.95) > 0.05 or not cases, name
        if row["half_width_unflagged"] is not None:
            assert row["half_width_unflagged"] <= 0.25
    assert proof["vertical_stiffness_error"]["rms"] <= 0.05
    # of the strain of runs at a load or pressure that the fit has not seen
    for row in proof["held_out_ratio"].values():
        assert row["median"] * proof["rms_share"]["median"] <= 0.025


def test_every_file_that_the_proof_depends_on_is_there() -> None:
    assert re.fullmatch("[0-9a-f]{16}", fingerprint())
