"""Campaigns of the rig, stored: the verdict on what they hide, by tires of every family."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hidden.cases import Case, load_case

from tirelib.effects import CATALOGUE
from tirelib.inference.diagnose.diagnose import Diagnosis, diagnose
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import estimated

DATA = Path(__file__).parent / "data"


@cache
def case(name: str) -> Case:
    return load_case(DATA / f"{name}.npz")


@cache
def found(name: str) -> Diagnosis:
    runs = straight_runs(case(name).waves.take(~case(name).held_out))
    return diagnose(runs, estimated(runs)[1].values, list(CATALOGUE.values()))


@pytest.mark.parametrize("name", ["1001-none", "1700-belt_shear-1.50"])
def test_where_nothing_is_hidden_nothing_is_named(name: str) -> None:
    """That a belt shears is a number of the base."""
    told = found(name)
    assert (told.verdict.kind, told.named) == ("none", ())
    assert told.verdict.base.p > 0.05


def test_a_stored_case_keeps_its_campaign() -> None:
    stored = case("1000-oval_tire-1.50")
    assert stored.names == ("oval_tire",)
    assert not stored.known
    assert len(stored.waves) == 18
    assert stored.held_out.sum() == 3
    change = (stored.waves.strain - stored.floor_waves.strain).mean(axis=1)
    order = np.abs(np.fft.rfft(change, axis=1))
    assert (order.argmax(axis=1) == 2).all()
