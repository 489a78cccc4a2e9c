"""Campaigns of the rig, stored: the verdict on what they hide, by tires of every family."""

from pathlib import Path

import numpy as np
from hidden.cases import load_case

from tirelib.effects import CATALOGUE
from tirelib.inference.diagnose.diagnose import diagnose
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import fitted

DATA = Path(__file__).parent / "data"


def test_where_nothing_is_hidden_nothing_is_named() -> None:
    """That the belt of this tire shears is a number of the base."""
    case = load_case(DATA / "1700-belt_shear-1.50.npz")
    runs = straight_runs(case.waves.take(~case.held_out))
    told = diagnose(runs, fitted(runs)[1].values, list(CATALOGUE.values()))
    assert (told.verdict.kind, told.named) == ("none", ())
    assert told.verdict.base.p > 0.05


def test_a_stored_case_keeps_its_campaign() -> None:
    stored = load_case(DATA / "1000-oval_tire-1.50.npz")
    assert stored.names == ("oval_tire",)
    assert not stored.known
    assert len(stored.waves) == 18
    assert stored.held_out.sum() == 3
    change = (stored.waves.strain - stored.floor_waves.strain).mean(axis=1)
    order = np.abs(np.fft.rfft(change, axis=1))
    assert (order.argmax(axis=1) == 2).all()
