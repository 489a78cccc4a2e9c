"""The native core says of every sample what the library says: cutter, filter, quality, features."""

import ctypes
import os
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.native.core import CoreError, NativeCutter, assert_same_features, assert_same_turn
from tests.synthetic import LATERAL, RATE, record, waveform
from tirelib.core.errors import ParameterError
from tirelib.core.flags import TurnFlag
from tirelib.measured.features.extract import reference_features
from tirelib.measured.signal import LowPass, TurnCutter, stack_turns

SEQUENCES = int(os.environ.get("TIRELIB_SEQUENCES", "100"))
SPEED = 18.0
TURN = int(2.0 * np.pi * 0.305 / SPEED * RATE)


def assert_same(
    core: ctypes.CDLL,
    strain: np.ndarray,
    *,
    lateral: tuple[float, ...] = LATERAL,
    rate: float = RATE,
    low_pass: LowPass | None = None,
    **given: Any,
) -> list[int]:
    """Cut a record with both; return the flags of its turns."""
    cutter = TurnCutter(lateral, rate, low_pass)
    try:
        wanted = cutter.push(strain, **given)
    except ParameterError:  # the filter reaches beyond the samples
        with pytest.raises(CoreError):
            list(NativeCutter(core, lateral, rate, low_pass).push(strain, **given))
        return []
    got = list(NativeCutter(core, lateral, rate, low_pass).push(strain, **given))
    assert len(got) == len(wanted)
    features = reference_features(stack_turns(wanted, cutter.lateral, rate))
    for row, ((turn, said), reference) in enumerate(zip(got, wanted, strict=True)):
        assert_same_turn(turn, reference)
        assert_same_features(said, features, row, reference.strain)
    return [turn.flags for turn in wanted]


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 100, 1001])
@pytest.mark.parametrize("levels", [1, 2, 5, 10**6])
def test_the_median_is_that_of_numpy(core: ctypes.CDLL, n: int, levels: int) -> None:
    for seed in range(10):
        x = np.random.default_rng(seed).integers(0, levels, n) / 7.0
        wanted = np.median(x)
        assert core.median(x.ctypes.data, n) == wanted


@pytest.mark.parametrize("speed", [3.0, 18.0, 60.0])
@pytest.mark.parametrize("rate", [2e3, 1e4, 3e4])
def test_a_steady_wheel_at_any_speed_and_rate(core: ctypes.CDLL, speed: float, rate: float) -> None:
    strain, trigger, omega = record(turns=4.4, speed=speed, rate=rate, noise=4e-6, tilt=0.1)
    n = strain.shape[1]
    flags = assert_same(
        core,
        strain,
        rate=rate,
        trigger=trigger,
        speed=speed,
        pressure=2.3e5,
        camber=np.linspace(0.0, 0.01, n),
        omega=omega,
        friction=np.where(np.arange(n) % 700, 0.9, np.nan),
        tread_depth=0.008,
        tread_temperature=313.15,
    )
    assert len(flags) == 4


SOURCES = ("both", "omega", "speed", "held speed", "none")


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("gain", [-26.0, -9.0, 26.0])
def test_a_wheel_that_brakes_or_drives(core: ctypes.CDLL, gain: float, source: str) -> None:
    time = np.arange(int(1.3 * RATE)) / RATE
    omega = (48.0 if gain < 0.0 else 25.0) + gain * time
    angle = np.pi + np.concatenate(([0.0], np.cumsum(omega[:-1]))) / RATE
    rng = np.random.default_rng(1)
    strain = waveform(angle)[None] * np.array([0.9, 1.0, 1.1, 1.0, 0.9])[:, None] + 2.7e-3
    strain += 1e-3 * (omega[0] ** 2 - omega**2) / omega[0] ** 2
    strain += 4e-6 * rng.standard_normal(strain.shape)
    slip = 1.0 + 0.03 * np.sin(6.0 * time)
    speed = 0.305 * omega * slip + 0.02 * rng.standard_normal(omega.size)
    held = speed[np.arange(speed.size) // 200 * 200]
    told = {
        "both": {"omega": omega + 0.05 * rng.standard_normal(omega.size), "speed": held},
        "omega": {"omega": np.round(omega, 1)},
        "speed": {"speed": speed},
        "held speed": {"speed": held},
        "none": {},
    }
    flags = assert_same(core, strain, **told[source])
    assert len(flags) >= 4


def test_a_change_that_cannot_be_followed(core: ctypes.CDLL) -> None:
    """The wheel locks nearly, and turns again: more than is known of it."""
    omega = np.interp(np.arange(14000), [0, 3000, 4500, 6000, 9000, 14000], [59, 59, 9, 9, 59, 59])
    strain = np.tile(waveform(np.cumsum(omega) / RATE), (5, 1)) + 2.7e-3
    strain += 4e-6 * np.random.default_rng(2).standard_normal(strain.shape)
    flags = assert_same(core, strain, speed=18.0, omega=np.round(omega, 2))
    assert any(flag & TurnFlag.ACCELERATING for flag in flags)


def spoilt(fault: str) -> tuple[np.ndarray, np.ndarray]:
    """Six turns in which something happens; strain and trigger."""
    strain, trigger, _ = record(turns=6.3, noise=4e-6, start=0.5)
    at = int(2.92 * TURN)  # a contact
    part = slice(at - 100, at + 150)
    if fault[4:].isdigit():
        part = slice(at - 40, at - 40 + int(fault.split()[1]))
        strain[:, part] = np.nan
    elif fault == "gap of a gage":
        strain[1, part] = np.inf
    elif fault == "gap before the contact":
        strain[:, at - 300 : at - 120] = np.nan
    elif fault == "lost turn":
        strain[:, at - 200 : at + 200] = np.nan
    elif fault == "spikes":
        strain[2, at - 5] += 0.02
        strain[3, at::97] -= 0.01
        strain[0, at : at + 4] += 0.02
    elif fault.startswith("burst"):
        first, n, height = (float(word) for word in fault.split()[1:])
        strain[2, at + int(first) : at + int(first) + int(n)] = height
    elif fault == "frozen":
        strain[0, at:] = strain[0, at]
    elif fault == "dead":
        strain[4] = 2.7e-3 + 1e-6 * np.sin(np.arange(strain.shape[1]))
    elif fault == "two dead":
        strain[3:] = 2.7e-3
    elif fault == "centre dead":
        strain[2, at:] = 2.7e-3 + 1e-9 * np.arange(strain.shape[1] - at)
    elif fault == "clipped":
        strain[1] = np.minimum(strain[1], 8e-3)
    elif fault == "clipped below":
        strain[1] = np.maximum(strain[1], 0.5e-3)
    elif fault == "quantised":
        strain = np.round(strain / 5e-5) * 5e-5
    elif fault == "drift":
        strain += np.linspace(0.0, 8e-3, strain.shape[1])
    elif fault == "jump":
        strain[:, at + 400 :] *= 6.0
    elif fault == "stop":
        strain[:, at + 300 : at + 1500] = strain[:, at + 300][:, None]
    elif fault == "lifted":
        strain[0] = 2.7e-3 + 0.1 * (strain[0] - 2.7e-3)
    elif fault == "no trigger":
        trigger[:] = False
    elif fault == "bouncing trigger":
        trigger[np.flatnonzero(trigger)[2] + 50] = True
    elif fault == "begins lost":
        strain[:, :500] = np.nan
    elif fault == "all lost":
        strain[:] = np.nan
    elif fault == "noise":
        strain = 2e-3 * np.random.default_rng(3).standard_normal((5, 1500))
        trigger = trigger[:1500]
    elif fault == "sawtooth":
        strain = np.tile(1e-2 * ((np.arange(1000) % 7) / 7.0), (5, 1))
        trigger = trigger[:1000]
    return strain, trigger


FAULTS = {
    "none": 0,
    "gap 1": TurnFlag.BRIDGED,
    "gap 2": TurnFlag.BRIDGED,
    "gap 3": TurnFlag.GAP,
    "gap 60": TurnFlag.TOO_FEW_GAGES,
    "gap of a gage": TurnFlag.REDUCED_GAGES,
    "gap before the contact": TurnFlag.GAP,
    "lost turn": TurnFlag.FIRST_TURN | TurnFlag.GAP,
    "spikes": TurnFlag.SPIKE,
    "burst 500 3 0.05": TurnFlag.SPIKE,
    "burst 500 3 -0.05": TurnFlag.SPIKE,
    "burst 500 60 0.05": TurnFlag.FIRST_TURN | TurnFlag.SPIKE,
    "burst -30 5 0.05": TurnFlag.FIRST_TURN | TurnFlag.SPIKE,
    "burst 0 8 -0.01": TurnFlag.SPIKE | TurnFlag.TOO_FEW_GAGES,
    "frozen": TurnFlag.REDUCED_GAGES,
    "dead": TurnFlag.DEAD_GAGE,
    "two dead": TurnFlag.TOO_FEW_GAGES,
    "centre dead": 0,
    "clipped": TurnFlag.SATURATED,
    "clipped below": TurnFlag.SATURATED,
    "quantised": 0,
    "drift": TurnFlag.DRIFT,
    "jump": 0,
    "stop": TurnFlag.PERIOD_JUMP,
    "lifted": TurnFlag.DEAD_GAGE,
    "no trigger": TurnFlag.TRIGGER_MISMATCH,
    "bouncing trigger": TurnFlag.TRIGGER_MISMATCH,
    "begins lost": 0,
    "all lost": 0,
    "noise": 0,
    "sawtooth": 0,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_told_alike(core: ctypes.CDLL, fault: str) -> None:
    strain, trigger = spoilt(fault)
    flags = assert_same(core, strain, trigger=trigger, speed=SPEED, pressure=2.3e5)
    assert any(flag & FAULTS[fault] == FAULTS[fault] for flag in flags) or not FAULTS[fault]


@pytest.mark.parametrize(("length", "apart"), [(1, 2), (4, 7)])
def test_a_gap_anywhere_in_a_turn(core: ctypes.CDLL, length: int, apart: int) -> None:
    """A gap at every distance from the contact's edges and from the strain's extremes near it."""
    clean, _, _ = record(turns=4.2, noise=4e-6, rate=2e3, start=0.5)
    turn = int(2.0 * np.pi * 0.305 / SPEED * 2e3)
    said = set()
    for start in range(2 * turn - 20, 3 * turn, apart):
        strain = clean.copy()
        strain[2, start : start + length] = np.nan
        strain[:, 3 * turn - 60 :] *= 1.05
        said |= set(assert_same(core, strain, rate=2e3, speed=SPEED))
    assert len(said) > 3


@pytest.mark.parametrize("speed", [0.0, np.nan, np.inf, -18.0])
def test_a_speed_that_says_nothing(core: ctypes.CDLL, speed: float) -> None:
    strain, _, _ = record(turns=3.3, noise=4e-6)
    assert_same(core, strain, speed=speed)


@pytest.mark.parametrize("low_pass", [LowPass(12.0), LowPass(cut_off=300.0), LowPass(cut_off=20.0)])
def test_any_cut_off(core: ctypes.CDLL, low_pass: LowPass) -> None:
    strain, _, _ = record(turns=3.3, noise=4e-6)
    assert_same(core, strain, low_pass=low_pass, speed=SPEED)


@pytest.mark.parametrize("lateral", [(0.0,), (0.03, -0.01), LATERAL[:4]])
def test_any_number_of_gages(core: ctypes.CDLL, lateral: tuple[float, ...]) -> None:
    strain, _, _ = record(turns=3.3, noise=4e-6, gages=len(lateral))
    assert_same(core, strain, lateral=lateral, speed=SPEED)


def test_standstill_starts_afresh(core: ctypes.CDLL) -> None:
    strain, _, _ = record(turns=2.6, noise=4e-6, rate=1e3, speed=18.0)
    still = np.full((5, 4000), 2.7e-3)
    assert_same(core, np.hstack((strain, still, strain, still, still, strain)), rate=1e3)


def test_a_day_of_one_wheel_outlasts_the_ring(core: ctypes.CDLL) -> None:
    strain, trigger, omega = record(turns=190.0, noise=4e-6, rate=1e3, speed=18.0)
    assert strain.shape[1] > 3 * 6000
    flags = assert_same(core, strain, rate=1e3, trigger=trigger, omega=omega, speed=18.0)
    assert len(flags) >= 189


@st.composite
def sequences(draw: st.DrawFn) -> tuple[np.ndarray, dict[str, Any]]:
    """Short records of pieces: wheels at changing rate and load, gaps, standstill, steps, noise."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    angle, pieces = draw(st.floats(-3.0, 3.0)), []
    for _ in range(draw(st.integers(2, 7))):
        n = draw(st.integers(20, 900))
        ends = [draw(st.floats(15.0, 90.0)) for _ in range(2)]
        omega = np.linspace(*ends, n) if draw(st.booleans()) else np.full(n, ends[0])
        phi = angle + np.cumsum(omega) / 2e3
        angle = float(phi[-1])
        piece = np.tile(waveform(phi, half=draw(st.floats(0.1, 0.3))), (3, 1))
        piece *= draw(st.sampled_from([1.0, 1.0, 1.2, 0.7, 3.0]))
        kinds = ["plain"] * 4 + ["gap", "still", "step", "noise", "one lost", "burst", "burst"]
        kind = draw(st.sampled_from(kinds))
        if kind == "gap":
            piece[:] = np.nan
        elif kind == "still":
            piece[:] = piece[:, :1]
        elif kind == "step":
            piece += 5e-3
        elif kind == "noise":
            piece += 2e-3 * rng.standard_normal(piece.shape)
        elif kind == "one lost":
            piece[draw(st.integers(0, 2)), ::17] = np.nan
        elif kind == "burst":
            first = draw(st.integers(0, n - 1))
            part = piece[:, first : first + draw(st.integers(1, 30))]
            part += draw(st.sampled_from([0.05, 0.02, 8e-3, -5e-3, -0.03]))
            part[draw(st.integers(0, 2)), draw(st.integers(1, 9)) :: 7] = np.nan
        pieces.append((piece, omega))
    strain = np.hstack([piece for piece, _ in pieces])
    strain += 4e-6 * rng.standard_normal(strain.shape)
    omega = np.hstack([rate for _, rate in pieces])
    speed = 0.3 * omega + 0.05 * rng.standard_normal(omega.size)
    held = draw(st.sampled_from(["both", "omega", "speed", "none"]))
    told = {"omega": omega, "speed": speed[np.arange(speed.size) // 20 * 20]}
    return strain, {name: x for name, x in told.items() if held in (name, "both")}


@given(case=sequences())
@settings(max_examples=SEQUENCES)
def test_whatever_comes_is_told_alike(
    core: ctypes.CDLL, case: tuple[np.ndarray, dict[str, Any]]
) -> None:
    strain, held = case
    assert_same(core, strain, lateral=(0.04, 0.0, -0.04), rate=2e3, **held)


def broken_off(seed: int) -> tuple[np.ndarray, dict[str, Any]]:
    """Pieces of wheels that stop, step and lose samples, one of them within a contact."""
    rng = np.random.default_rng(seed)
    angle, pieces = float(rng.uniform(-3.0, 3.0)), []
    for _ in range(int(rng.integers(2, 6))):
        n = int(rng.integers(20, 900))
        ends = rng.choice([15.0, 18.0, 30.0, 52.0, 70.0, 90.0], 2)
        omega = np.linspace(*ends, n) if rng.random() < 0.5 else np.full(n, ends[0])
        phi = angle + np.cumsum(omega) / 2e3
        angle = float(phi[-1])
        piece = np.tile(waveform(phi, half=rng.choice([0.1, 0.2, 0.3])), (3, 1))
        kind = rng.choice(["plain"] * 4 + ["gap", "still", "step", "noise"])
        if kind == "gap":
            piece[:] = np.nan
        elif kind == "still":
            piece[:] = piece[:, :1]
        elif kind == "step":
            piece += 5e-3
        elif kind == "noise":
            piece += 2e-3 * rng.standard_normal(piece.shape)
        pieces.append((piece, omega))
    strain = np.hstack([piece for piece, _ in pieces])
    strain += 4e-6 * rng.standard_normal(strain.shape)
    omega = np.hstack([rate for _, rate in pieces])
    speed = 0.3 * omega + 0.05 * rng.standard_normal(omega.size)
    return strain, {"omega": omega, "speed": speed[np.arange(speed.size) // 20 * 20]}


@pytest.mark.parametrize("seed", [204, 680])
def test_a_wheel_that_stops_within_its_contact_has_no_angle_there(
    core: ctypes.CDLL, seed: int
) -> None:
    """Two of six thousand such records; the law of the angle turns back between the edges."""
    strain, held = broken_off(seed)
    told = assert_same(core, strain, lateral=(0.04, 0.0, -0.04), rate=2e3, **held)
    turns = TurnCutter((0.04, 0.0, -0.04), 2e3).push(strain, **held)
    lost = [t for t in turns if np.isnan(t.pulse) and not t.flags & TurnFlag.FIRST_TURN]
    assert told
    assert lost
    assert all(t.flags & TurnFlag.ACCELERATING and np.isnan(t.strain).all() for t in lost)
