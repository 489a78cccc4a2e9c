"""The reference signals meet estimates, gaps and the watchdog; a measured turn makes them valid."""

from dataclasses import replace

import numpy as np
import pytest

from tests.fmu import live
from tirelib.core.flags import TurnFlag
from tirelib.fmu.reference import Reference
from tirelib.fmu.strain_reference import strain_reference


def made(*, measured: bool, rate: float = live.RATE, buffered: bool = False) -> Reference:
    calibration = live.calibration()
    assert calibration.reference is not None
    known = calibration if measured else replace(calibration, reference=None)
    return strain_reference(known, rate, 10, buffered=buffered)


@pytest.mark.parametrize("buffered", [False, True])
@pytest.mark.parametrize("measured", [False, True])
def test_a_gap_a_bridge_and_the_watchdog_are_met(measured: bool, buffered: bool) -> None:
    wanted = made(measured=measured, buffered=buffered).expected
    flags = wanted["flags"].astype(int)
    for flag in (TurnFlag.BRIDGED, TurnFlag.GAP, TurnFlag.NO_CONTACT):
        assert (flags & int(flag)).any(), flag.name
    assert flags[-1] & int(TurnFlag.NO_CONTACT)
    assert wanted["turn"][-1] == 6.0


def test_every_quantity_of_a_measured_turn_is_valid_and_changes() -> None:
    wanted = made(measured=True).expected
    valid = wanted["valid"] == 1.0
    turns = np.unique(wanted["turn"][valid])
    assert turns.tolist() == [2.0, 3.0, 5.0, 6.0]
    for name in ("Fz", "alpha", "kappa", "Fy"):
        values = wanted[name][valid]
        assert np.isfinite(values).all()
        assert np.unique(values).size >= 4


def test_a_slow_rate_is_met_by_a_slow_wheel() -> None:
    signals = made(measured=True, rate=500.0)
    omega, speed = signals.given["omega"][0], signals.given["speed"][0]
    turn = live.calibration().reference
    assert turn is not None
    assert omega < turn.omega
    assert speed / omega == pytest.approx(turn.speed / turn.omega)
    assert signals.expected["turn"][-1] == 6.0
