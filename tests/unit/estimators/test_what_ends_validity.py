"""What ends the validity of an estimate, and how much a law of a condition is doubted."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.synthetic import header, synthetic_run
from tirelib.core.flags import TurnFlag
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.estimators.laws import ConditionLaws
from tirelib.estimators.polynomial import Range
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.train import Trained
from tirelib.measured.features import Features
from tirelib.measured.observations import measure_run


@pytest.fixture(scope="module")
def features() -> Features:
    return measure_run(synthetic_run(0, slip_angle=np.deg2rad(1.0)), header())[0]


BOTH = pytest.mark.parametrize("estimate", [Calibration.estimate, Calibration.reference_estimate])
"""The compiled core, where there is one, and numpy."""
Estimate = Callable[[Calibration, Features], Estimates]


@BOTH
@pytest.mark.parametrize(
    "flag",
    [
        TurnFlag.FIRST_TURN,
        TurnFlag.PERIOD_JUMP,
        TurnFlag.ACCELERATING,
        TurnFlag.TRIGGER_MISMATCH,
        TurnFlag.REVERSED,
        TurnFlag.CUT_OFF,
        TurnFlag.NO_CONTACT,
    ],
)
def test_a_turn_whose_angle_or_contact_is_in_doubt_gives_no_estimate(
    flag: TurnFlag, estimate: Estimate, trained: Trained, features: Features
) -> None:
    good = estimate(trained.calibration, features).turn_valid
    assert good.sum() >= 3
    marked = replace(features, flags=features.flags | int(flag))
    found = estimate(trained.calibration, marked)
    assert not found.turn_valid.any()
    assert not any(found.valid[quantity].any() for quantity in QUANTITIES)


@BOTH
@pytest.mark.parametrize(("std", "valid"), [(0.9, True), (1.2, False), (2.8, False)])
def test_a_slip_angle_is_valid_up_to_a_standard_deviation_of_one_degree(
    std: float, valid: bool, estimate: Estimate, trained: Trained, features: Features
) -> None:
    chains = {}
    for missing, chain in trained.calibration.chains.items():
        assert chain.angle is not None
        # the reading of a slippery road would replace the polynomial
        sure = replace(chain.angle, blur=0.0, bend=0.0)
        polynomial = replace(sure.polynomial, residual=np.deg2rad(std), floor=0.0)
        chains[missing] = replace(chain, angle=replace(sure, polynomial=polynomial), sliding=None)
    found = estimate(replace(trained.calibration, chains=chains), features)
    usable = trained.calibration.estimate(features).turn_valid
    told = np.rad2deg(found.std["alpha"][usable])
    np.testing.assert_allclose(told, std, rtol=0.1)
    assert (found.valid["alpha"][usable] == valid).all()
    assert all(
        ("alpha_saturated" in notes) != valid for notes in np.array(found.notes, object)[usable]
    )
    assert found.valid["Fz"][usable].all()


LAWS = ConditionLaws((2e5, 2e5), (10.0, 20.0), False, False, 0.17, 0.3)


@BOTH
@pytest.mark.parametrize(("kappa", "valid"), [(0.05, True), (0.08, False), (-0.08, False)])
def test_a_slip_ratio_that_was_not_calibrated_ends_load_force_and_slip_angle(
    kappa: float, valid: bool, estimate: Estimate, trained: Trained, features: Features
) -> None:
    """Calibrated from -0.07 to 0.05; the traction of these turns says nothing against them."""
    own = Range("kappa", -0.07, 0.05, 0.003)
    chains = {
        missing: replace(chain, guards={**chain.guards, "kappa": (own,)})
        for missing, chain in trained.calibration.chains.items()
    }
    good = trained.calibration.estimate(features)
    quick = features.omega * (1.0 + kappa) / (1.0 + np.median(good.value["kappa"][good.turn_valid]))
    found = estimate(replace(trained.calibration, chains=chains), replace(features, omega=quick))
    usable = good.turn_valid
    np.testing.assert_allclose(found.value["kappa"][usable], kappa, atol=0.003)
    for quantity in QUANTITIES:
        assert (found.valid[quantity][usable] == valid).all(), quantity
    blind = replace(features, omega=quick, speed=np.full_like(features.speed, np.nan))
    unknown = estimate(replace(trained.calibration, chains=chains), blind)
    assert unknown.valid["Fz"][usable].all()


@BOTH
def test_a_slip_ratio_that_no_rolling_wheel_has_is_not_valid(
    estimate: Estimate, trained: Trained, features: Features
) -> None:
    """Backwards, or so quick that the wheel moves less in a turn than its contact is long."""
    known, good = trained.calibration, trained.calibration.estimate(features)
    usable = good.turn_valid
    contact = compute_regressors(features, known.chains[-1].gages)["contact_angle"]
    for share, valid in ((0.98, True), (1.02, False)):
        quick = features.omega * share * 2.0 * np.pi / contact
        found = estimate(known, replace(features, omega=quick))
        assert (found.valid["kappa"][usable] == valid).all()
    forward = estimate(known, replace(features, omega=1e-3 * features.omega))
    backward = estimate(known, replace(features, omega=-1e-3 * features.omega))
    assert forward.valid["kappa"][usable].all()
    assert not backward.valid["kappa"].any()


def test_a_speed_outside_the_calibration_doubts_by_two_percent_per_1600_m2_s2() -> None:
    speed = np.sqrt([15.0**2, 20.0**2 + 1600.0, 20.0**2 + 800.0, 36.0])
    found = LAWS.spread({"speed": speed}, np.array([4e3, 4e3, -4e3, 4e3]))
    np.testing.assert_allclose(found, [0.0, 80.0, 40.0, 80.0 * 64.0 / 1600.0])


def test_a_lateral_force_doubts_three_tenths_of_what_the_pressure_law_changes() -> None:
    factor, doubt = LAWS.force_factor({"pressure": np.array([2e5, 2.5e5, 1.6e5])})
    np.testing.assert_allclose(factor, [1.0, 1.25**0.8, 0.8**0.8])
    np.testing.assert_allclose(doubt, 0.3 * np.abs(factor - 1.0))


def test_a_tire_rolls_at_half_the_pressure_as_it_does_under_twice_the_load() -> None:
    load = np.array([3e3, 3e3, 3e3, 3e3])
    found = LAWS.equivalent_load(load, {"pressure": np.array([2e5, 1e5, 4e5, np.nan])})
    np.testing.assert_allclose(found, [3e3, 6e3, 1.5e3, 3e3])
    fitted = replace(LAWS, pressure_fitted=True)
    np.testing.assert_array_equal(fitted.equivalent_load(load, {}), load)
