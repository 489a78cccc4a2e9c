"""Results as pandas tables: they hold what the objects hold, in SI units."""

from dataclasses import replace

import numpy as np
import pytest

import tirelib
from tirelib.campaign import Campaign
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import NUMBERS
from tirelib.core.units import TABLE, to_si
from tirelib.estimators.train import Trained
from tirelib.measured.features.table import rate_slope
from tirelib.measured.observations import Observations
from tirelib.tables import SI_UNITS


def test_a_row_of_estimates_is_a_turn_beside_what_was_measured(
    observed: Observations, trained: Trained
) -> None:
    estimates = trained.calibration.estimate(observed.features)
    table = tirelib.estimate_table(observed, estimates)
    assert len(table) == len(observed)
    assert table["Fz"].to_numpy() == pytest.approx(estimates.value["Fz"], nan_ok=True)
    assert table["alpha_measured"].to_numpy() == pytest.approx(observed.truth["slip_angle"])
    first = table.groupby("run").first()
    assert not first["valid"].any()
    assert set(first["flags"]) == {"first_turn"}
    assert table.attrs["units"]["alpha_std"] == "rad"
    error = (table["Fz"] - table["Fz_measured"])[table["valid"]]
    assert np.sqrt(np.mean(error**2)) < 50.0


def test_estimates_of_other_turns_are_refused(
    observed: Observations, pressures: Campaign, trained: Trained
) -> None:
    others = trained.calibration.estimate(tirelib.observe([pressures]).features)
    with pytest.raises(ParameterError, match="the same turns"):
        tirelib.estimate_table(observed, others)


def test_a_row_of_features_is_a_turn_and_a_gage(observed: Observations) -> None:
    table = tirelib.feature_table(observed)
    gages = observed.features.lateral.size
    assert len(table) == len(observed) * gages
    assert table["run"].to_numpy() == pytest.approx(np.repeat(observed.run, gages))
    assert table["contact_angle"].to_numpy() == pytest.approx(
        observed.features.contact_angle.ravel(), nan_ok=True
    )
    assert table.attrs["units"]["contact_angle"] == "rad"


def test_the_rows_of_a_turn_are_its_gages_in_their_order(observed: Observations) -> None:
    features = observed.features
    table = tirelib.feature_table(observed)
    turns = table.groupby("turn", sort=False)
    assert len(turns) == len(features)
    assert (turns["time"].nunique() == 1).all()
    assert turns["time"].first().to_numpy() == pytest.approx(features.time)
    for column, each in (("gage", np.arange(1, 6)), ("lateral", features.lateral)):
        assert (np.stack(list(turns[column].apply(np.array))) == each).all()


@pytest.mark.parametrize("offset", [0.0, 0.004, -0.007])
def test_the_slope_across_does_not_ask_where_the_middle_of_the_tire_is(
    observed: Observations, offset: float
) -> None:
    lateral = observed.features.lateral + offset
    rate = 3.0 - 40.0 * lateral + np.zeros((len(observed), 1))
    made = replace(observed.features, lateral=lateral, rate_lead=rate)
    np.testing.assert_allclose(rate_slope(made), -40.0)


def test_the_interval_of_a_number_is_that_of_its_file() -> None:
    file = tirelib.read_tire("table-6-1")
    number = replace(file.numbers["mass"], notes={"interval_SI": [3.0, 3.4]})
    table = tirelib.parameter_table(replace(file, numbers={**file.numbers, "mass": number}))
    assert table.loc["mass", ["low", "high"]].tolist() == [3.0, 3.4]


def test_every_number_of_a_tire_has_its_si_unit() -> None:
    table = tirelib.parameter_table(tirelib.read_tire("table-6-1"))
    assert table.loc["ring_radius", "value"] == pytest.approx(0.2855, rel=0.2)
    assert table.loc["ring_radius", "unit"] == "m"
    for field in NUMBERS.values():
        unit = SI_UNITS[field.dimension]
        assert to_si(1.0, unit, field.dimension) == 1.0
    assert {row.dimension for row in TABLE} >= {field.dimension for field in NUMBERS.values()}
