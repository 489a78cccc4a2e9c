"""From the numerical rig to estimates: another day of the same tire, against the noise-free truth.

The rig shares no model with the library, so nothing here was made by what is being tested.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tirelib.campaign import read_campaign
from tirelib.cli.limits import outside
from tirelib.core.flags import TurnFlag
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.result import estimate_document
from tirelib.estimators.train import Trained, take, train
from tirelib.measured.observations import Observations, observe
from tirelib.rig.campaign import run_plan
from tirelib.rig.plans import Plan
from tirelib.rig.tire import TIRES, Condition

LOADS = (1500.0, 3000.0, 4500.0, 6000.0, 7500.0)
ANGLES = (-4.0, -1.5, 1.5, 4.0)


def plan(name: str, loads: tuple[float, ...], angles: tuple[float, ...]) -> Plan:
    conditions = tuple(
        Condition(load=load, pressure=2.3e5, speed=65 / 3.6, slip_angle=float(np.deg2rad(angle)))
        for load in loads
        for angle in angles
    )
    return Plan(name, name, conditions)


@pytest.fixture(scope="module")
def days(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("rig")
    run_plan(plan("first", LOADS, ANGLES), TIRES["reference"], folder / "first", seed=1, jobs=1)
    # loads and slip angles that lie between those of the first day
    run_plan(
        plan("second", (2200.0, 5200.0, 6700.0), (-3.0, 0.5, 3.0)),
        TIRES["reference"],
        folder / "second",
        seed=2,
        jobs=1,
    )
    return {name: folder / name for name in ("first", "second")}


@pytest.fixture(scope="module")
def trained(days: dict[str, Path]) -> Trained:
    return train(observe([read_campaign(days["first"])]))


@pytest.fixture(scope="module")
def second(days: dict[str, Path], trained: Trained) -> tuple[Observations, Estimates]:
    observed = observe([read_campaign(days["second"])])
    return observed, trained.calibration.estimate(observed.features)


def test_every_turn_but_the_first_is_usable(second: tuple[Observations, Estimates]) -> None:
    observed, _ = second
    assert (observed.usable == (np.arange(len(observed)) % 5 != 0)).mean() > 0.95


def test_conditions_between_the_calibrated_ones_on_another_day(
    trained: Trained, second: tuple[Observations, Estimates]
) -> None:
    observed, estimates = second
    summary = estimate_document(observed, estimates, trained.calibration)["summary"]
    assert summary["Fz"]["rmse"] < 0.01 * 7500.0
    assert summary["alpha"]["rmse"] < 0.25
    assert summary["Fy"]["rmse"] < 0.015 * 4000.0
    assert summary["kappa"]["rmse"] < 1e-3
    assert all(summary[quantity]["n"] == 9 for quantity in summary)


def test_a_load_beyond_the_calibrated_ones_is_said_to_be_beyond(
    days: dict[str, Path], second: tuple[Observations, Estimates], trained: Trained
) -> None:
    """Calibrated without the highest load, and estimated at it: every turn is out of range."""
    observed = observe([read_campaign(days["first"])])
    highest = observed.nominal["load"] > 7000.0
    fitted = train(take(observed, ~highest & observed.usable)).calibration
    left_out = take(observed, highest & observed.usable)
    found = fitted.estimate(left_out.features)
    assert ((found.flags & int(TurnFlag.OUT_OF_RANGE)) != 0).all()
    assert not found.valid["Fz"].any()
    assert not found.valid["Fy"].any()
    document = estimate_document(left_out, found, fitted)
    said = outside(document["turns"], fitted)
    assert said.startswith(f"{len(left_out)} of {len(left_out)} turns lie beyond")
    assert re.search(r"Fz from 1,[45]\d\d to (5,9|6,0)\d\d N", said)
    own = estimate_document(*second, trained.calibration)
    assert outside(own["turns"], trained.calibration) == ""


def blind(observed: Observations, trained: Trained) -> Estimates:
    """Return what is said where nobody gives the camber."""
    nothing = np.full(len(observed), np.nan)
    return trained.calibration.estimate(replace(observed.features, camber=nothing))


def test_the_strain_tells_that_a_wheel_stands_upright(
    trained: Trained, second: tuple[Observations, Estimates]
) -> None:
    """By the prior alone, 2 deg, the standard deviation of Fy would be 1,400 N at 4 kN."""
    observed, given = second
    found = blind(observed, trained)
    assert found.valid["alpha"].sum() > 0.8 * given.valid["alpha"].sum() > 0
    assert np.median(found.std["Fy"][found.valid["Fy"]]) < 350.0


def test_a_tilted_wheel_whose_camber_nobody_gives_holds_its_intervals(
    trained: Trained, tmp_path: Path
) -> None:
    """0.8 deg are 500 to 600 N of Fy here; they must neither be missed nor be another tire."""
    runs = tuple(
        Condition(load, 2.3e5, 65 / 3.6, float(np.deg2rad(angle)), float(np.deg2rad(camber)))
        for load, angle, camber in ((3000.0, 1.5, 0.8), (4500.0, -1.5, 0.8), (6500.0, 1.5, -0.8))
    )
    run_plan(
        Plan("tilted", "tilted", runs), TIRES["reference"], tmp_path / "tilted", seed=3, jobs=1
    )
    observed = observe([read_campaign(tmp_path / "tilted")])
    found = blind(observed, trained)
    assert not (found.flags & int(TurnFlag.OTHER_TIRE)).any()
    for quantity, truth in (("Fy", "Fy"), ("alpha", "slip_angle")):
        good = found.valid[quantity]
        error = np.abs(found.value[quantity] - observed.truth[truth])[good]
        assert good.sum() >= 8
        assert (error <= 2.0 * found.std[quantity][good]).mean() > 0.9, quantity
    assert np.median(found.std["Fy"][found.valid["Fy"]]) < 500.0


def test_the_contact_length_holds_its_interval_on_the_rig(
    days: dict[str, Path], second: tuple[Observations, Estimates]
) -> None:
    """The strain rate peaks inside the true edges: the reading is short, the estimate is not."""
    observed, estimates = second
    truth = pd.read_csv(days["second"] / "truth.csv").set_index("run")
    names = [f"contact_length_{gage}_m" for gage in range(1, 6)]
    good = observed.usable & np.isfinite(estimates.contact_length).all(axis=1)
    true = truth.loc[observed.run[good], names].to_numpy()
    length, std = estimates.contact_length[good], estimates.contact_length_std[good]
    read = observed.features.contact_angle[good] * estimates.radius[good, None]
    assert np.mean(read / true - 1.0) < -0.07
    assert abs(np.mean(length / true - 1.0)) < 0.02
    assert 0.9 <= np.mean(np.abs(length - true) <= 1.96 * std) <= 1.0
    assert np.sqrt(np.mean((length - true) ** 2)) < 4e-3


def test_the_working_estimators_beat_the_dissertations(trained: Trained) -> None:
    by_source = {regression.source: regression for regression in trained.regressions}
    links = trained.links

    def held_out(quantity: str, truth: str, factor: float = 1.0) -> float:
        error = links.held_out[quantity] - links.truth[truth]
        return factor * float(np.sqrt(np.mean(error**2)))

    assert held_out("Fz", "Fz") < by_source["Fig. 4-4"].cross_validated
    assert held_out("Fy", "Fy") < by_source["Table 4-1"].cross_validated
    degrees = held_out("alpha", "slip_angle", 180.0 / np.pi)
    assert degrees < by_source["Fig. 4-7"].cross_validated
