"""A load is less certain under traction than it is freely rolling, and both are told."""

from pathlib import Path

import numpy as np
import pytest

from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.polynomial import Polynomial, Variable
from tirelib.estimators.pulled import FEWEST_PULLED, parted, pull_share
from tirelib.estimators.train import Trained


def made(pulled: float) -> Polynomial:
    variable = Variable("contact_angle", 0.3, 0.1)
    return Polynomial(
        (variable,), ((0,),), np.array([4e3]), np.zeros((1, 1)), 30.0, 4.0, None, pulled
    )


def test_errors_that_come_with_traction_do_not_widen_free_rolling() -> None:
    rng = np.random.default_rng(4)
    traction = np.concatenate((0.005 * rng.standard_normal(300), rng.uniform(0.08, 0.3, 100)))
    error = np.hypot(30.0, 110.0 * np.sqrt(pull_share(traction))) * rng.standard_normal(400)
    free, pulled = parted(error, np.zeros(400), traction) or (0.0, 0.0)
    assert free == pytest.approx(30.0, rel=0.1)
    assert pulled == pytest.approx(110.0, rel=0.2)


def test_too_few_runs_with_traction_count_as_the_others() -> None:
    traction = np.zeros(50)
    traction[: FEWEST_PULLED - 1] = 0.2
    assert parted(np.ones(50), np.zeros(50), traction) is None


def test_the_standard_deviation_grows_with_traction_alike_to_both_sides() -> None:
    traction = np.array([0.0, 0.1, -0.1, 5.0])
    values = {"contact_angle": np.full(4, 0.3), "traction": traction}
    _, std = made(110.0).predict(values)
    assert std[0] == pytest.approx(np.hypot(30.0, 4.0))
    assert std[1] == std[2] > 2.0 * std[0]
    assert std[3] == pytest.approx(np.sqrt(30.0**2 + 4.0**2 + 110.0**2), rel=1e-3)
    _, same = made(0.0).predict({"contact_angle": np.full(1, 0.3)})  # needs no traction
    assert same[0] == std[0]


def test_a_file_keeps_what_traction_adds(trained: Trained, tmp_path: Path) -> None:
    from dataclasses import replace

    chain = trained.calibration.chains[-1]
    assert chain.load is not None
    chains = {
        **trained.calibration.chains,
        -1: replace(chain, load=replace(chain.load, pulled=77.0)),
    }
    write_calibration(replace(trained.calibration, chains=chains), tmp_path / "cal.toml")
    again = read_calibration(tmp_path / "cal.toml").chains[-1].load
    assert again is not None
    assert again.pulled == 77.0
