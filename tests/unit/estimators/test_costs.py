"""What a condition that nobody gave costs is what giving it would bring, and it is said."""

from dataclasses import replace

import numpy as np
import pytest

from tirelib.cli.limits import not_checked, not_given
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.costs import COLUMN, costs_of
from tirelib.estimators.result import cost_rows, estimate_document
from tirelib.estimators.train import Trained
from tirelib.measured.observations import Observations


def without(observed: Observations, name: str) -> Observations:
    nothing = np.full(len(observed), np.nan)
    return replace(observed, features=replace(observed.features, **{name: nothing}))  # type: ignore[arg-type]


def test_the_cost_is_what_giving_it_brings(trained: Trained, observed: Observations) -> None:
    calibration, features = trained.calibration, observed.features
    unknown = replace(features, tread_depth=np.full(len(observed), np.nan))
    told = replace(features, tread_depth=np.full(len(observed), 0.008))
    found, given = calibration.estimate(unknown), calibration.estimate(told)
    costs = {(c.unknown, c.quantity): c for c in costs_of(calibration, unknown, found)}
    cost = costs["tread_depth", "Fz"]
    rows = np.isfinite(given.std["Fz"])
    assert cost.std == pytest.approx(np.median(found.std["Fz"][rows]))
    assert cost.std_if_given == pytest.approx(np.median(given.std["Fz"][rows]))
    assert cost.std > 2.0 * cost.std_if_given


def test_what_is_given_costs_nothing(trained: Trained, observed: Observations) -> None:
    calibration = trained.calibration
    told = replace(observed.features, tread_depth=np.full(len(observed), 0.008))
    costs = costs_of(calibration, told, calibration.estimate(told))
    assert {"camber", "pressure", "tread_depth"}.isdisjoint(c.unknown for c in costs)


def test_the_dearest_is_named_with_its_column(trained: Trained, observed: Observations) -> None:
    calibration = trained.calibration
    blind = without(observed, "camber")
    found = calibration.estimate(blind.features)
    costs = costs_of(calibration, blind.features, found)
    ratios = [cost.ratio for cost in costs]
    assert ratios == sorted(ratios, reverse=True)
    document = estimate_document(blind, found, calibration, costs)
    line = not_given(document["not_given"])
    dearest = costs[0].unknown
    assert line.startswith(f"The {dearest.replace('_', ' ')} was not given: the standard deviation")
    assert f"column {COLUMN[dearest]} of runs.csv" in line
    by = {(row["condition"], row["quantity"]): row for row in document["not_given"]}
    assert by["camber", "Fy"]["std"] > 2.0 * by["camber", "Fy"]["std_if_given"]
    assert by["camber", "Fy"]["unit"] == "N"


def test_a_condition_without_which_nothing_is_valid_is_the_dearest(
    trained: Trained, observed: Observations
) -> None:
    """Where a model needs the camber there is no standard deviation at all without it."""
    row = {
        "condition": "camber",
        "column": "camber_deg",
        "quantity": "Fy",
        "unit": "N",
        "std": None,
        "std_if_given": 80.0,
        "valid": 0.0,
        "valid_if_given": 0.9,
    }
    line = not_given([row])
    assert "Fy is unknown instead of 80 N and valid in 0% instead of 90% of turns" in line
    assert not_given([]) == ""
    assert not_given([{**row, "std": 81.0}]) == ""


def test_a_turn_whose_interval_the_camber_decides_says_so(
    trained: Trained, observed: Observations
) -> None:
    calibration = trained.calibration
    given = calibration.estimate(observed.features)
    assert not any("camber_unknown" in notes for notes in given.notes)
    blind = calibration.estimate(without(observed, "camber").features)
    rows = np.isfinite(blind.std["Fy"])
    more = blind.std["Fy"][rows] ** 2 - given.std["Fy"][rows] ** 2
    decided = more > 0.5 * blind.std["Fy"][rows] ** 2
    said = np.array(["camber_unknown" in notes for notes in blind.notes])[rows]
    assert decided.sum() > 0.9 * rows.sum()
    np.testing.assert_array_equal(said, decided)


def test_a_calibration_that_cannot_notice_another_tire_says_so(
    trained: Trained, observed: Observations
) -> None:
    def silent(calibration: Calibration) -> Calibration:
        chains = {i: replace(chain, likeness=None) for i, chain in calibration.chains.items()}
        return replace(calibration, chains=chains)

    few = silent(trained.calibration)
    found = few.estimate(observed.features)
    assert estimate_document(observed, found, few)["other_tire"] is None
    assert not_checked(trained.calibration) == []
    (line,) = not_checked(few)
    assert "17 are needed" in line
    first, second = not_checked(replace(few, version=1))
    assert "earlier version" in first
    assert second.startswith("Another tire would not be detected")


def test_a_file_keeps_its_version(trained: Trained) -> None:
    assert trained.calibration.version == 2
    assert cost_rows(()) == []


def test_a_turn_that_no_slip_angle_fits_keeps_its_load(
    trained: Trained, observed: Observations
) -> None:
    """Where a force is more than any slip angle gives, any share of the tread may slide."""
    full = trained.calibration.chains[-1]
    narrow = tuple(
        replace(known, low=-1e-4, high=1e-4) if known.name == "alpha" else known
        for known in full.guards["alpha"]
    )
    chain = replace(full, guards={**full.guards, "alpha": narrow})
    blind = without(observed, "friction").features
    calibration = replace(trained.calibration, chains={**trained.calibration.chains, -1: chain})
    found, usual = calibration.estimate(blind), trained.calibration.estimate(blind)
    lost = usual.valid["alpha"] & ~found.valid["alpha"]
    assert lost.sum() > 20
    for quantity in ("Fz", "Fy"):
        np.testing.assert_array_equal(found.valid[quantity], usual.valid[quantity])
        assert (found.std[quantity][lost] >= usual.std[quantity][lost]).all()
