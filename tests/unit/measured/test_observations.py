"""What the rig measured of each turn, and which turns are one measurement."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.synthetic import synthetic_run, write
from tirelib.campaign import Run, read_campaign
from tirelib.measured.observations import observe, truth_of

OMEGA, RATE, TURNS = 60.0, 1000.0, 12
PERIOD = 2.0 * np.pi / OMEGA
TIME = np.arange(0.0, TURNS * PERIOD, 1.0 / RATE)
CONTACTS = PERIOD * np.arange(2.0, TURNS - 2.0)


def told(load: np.ndarray, kind: str = "sweep") -> np.ndarray:
    run = synthetic_run(0, kind=kind)
    measured: Run = replace(run, rig={"Fz": load}, rig_time=TIME)
    return truth_of(measured, "Fz", CONTACTS, np.full(CONTACTS.size, OMEGA))


def test_a_ramp_is_told_as_it_is_in_the_contact() -> None:
    slope = 3e4
    # the turn holds a sample more or less, of which half counts on either side
    np.testing.assert_allclose(told(slope * TIME), slope * CONTACTS, atol=slope / RATE)
    assert np.ptp(told(slope * TIME, kind="corner")) == 0.0


def test_the_mean_is_over_one_turn_about_the_contact() -> None:
    once = np.cos(OMEGA * TIME)
    np.testing.assert_allclose(told(once), 0.0, atol=2.0 / (PERIOD * RATE))
    slow = np.cos(0.5 * OMEGA * TIME)  # a crest or a trough in each contact
    expected = 2.0 / np.pi * np.cos(0.5 * OMEGA * CONTACTS)
    np.testing.assert_allclose(told(slow), expected, atol=2.0 / (PERIOD * RATE))


def test_a_sample_that_is_missing_takes_no_part() -> None:
    holed = np.full(TIME.size, 4000.0)
    holed[::3] = np.nan
    np.testing.assert_allclose(told(holed), 4000.0)
    holed[CONTACTS[4] < TIME] = np.nan
    assert np.isfinite(told(holed)).tolist() == [k < 5 for k in range(CONTACTS.size)]


@pytest.mark.parametrize(("kind", "turns_apart"), [("corner", False), ("sweep", True)])
def test_turns_of_a_run_are_one_measurement_and_those_of_a_sweep_are_each_its_own(
    kind: str, turns_apart: bool, tmp_path: Path
) -> None:
    """The same run number in another campaign is another measurement."""
    campaigns = [
        read_campaign(write(tmp_path / name, [synthetic_run(i, kind=kind) for i in range(2)]))
        for name in ("one", "two")
    ]
    found = observe(campaigns)
    whole = set(zip(found.campaign.tolist(), found.run.tolist(), strict=True))
    assert len(whole) == 4
    assert np.unique(found.unit).size == (len(found) if turns_apart else 4)
    for campaign, run in whole:
        member = (found.campaign == campaign) & (found.run == run)
        assert np.unique(found.unit[member]).size == (member.sum() if turns_apart else 1)
