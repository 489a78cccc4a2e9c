"""Laws of frames and buffers: the estimate does not depend on how samples are packed."""

import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu import live, player
from tests.synthetic import frames as cut
from tests.synthetic import record
from tirelib.core.flags import TurnFlag
from tirelib.core.held import HELD
from tirelib.fmu.run import LoadedFmu

RATE = 1e4
CONDITIONS = player.CONDITIONS
ESTIMATES = (
    "Fz",
    "alpha",
    "kappa",
    "Fy",
    "Fz_std",
    "alpha_std",
    "kappa_std",
    "Fy_std",
    *(f"contact_length_{g}" for g in range(1, 6)),
    "rolling_radius",
    "turn_rate",
    "contact_time",
)


@pytest.fixture(scope="module")
def strain() -> np.ndarray:
    # the dip of the calibrated waveforms at this contact, or nothing is in range
    found = record(turns=4.4, speed=live.SPEED, noise=4e-6, rate=RATE, tilt=0.05, dip=2.6e-3)[0]
    found[2, 2600:2602] = np.nan
    return found


@pytest.fixture(scope="module")
def buffered() -> Iterator[LoadedFmu]:
    with LoadedFmu(live.fmu_file(100, buffered=True)) as fmu:
        yield fmu


def turns_of(fmu: LoadedFmu, strain: np.ndarray, parts: list[slice]) -> list[dict[str, Any]]:
    """Outputs at the end of every turn."""
    fmu.start(RATE)
    turn, seen = 0, []
    for part in parts:
        fmu.step(strain[:, part], CONDITIONS)
        now = fmu.slave.getInteger([fmu.references["turn"]])[0]
        if now != turn:
            turn = now
            seen.append(fmu.read())
    return seen


def even(n: int, samples: int) -> list[slice]:
    return [slice(a, min(a + samples, n)) for a in range(0, n, samples)]


@pytest.fixture(scope="module")
def one_by_one(strain: np.ndarray) -> list[dict[str, Any]]:
    with LoadedFmu(live.fmu_file(1)) as fmu:
        found = turns_of(fmu, strain, even(strain.shape[1], 1))
    assert [values["turn"] for values in found] == [1, 2, 3, 4]
    assert found[-1]["valid"]
    assert found[2]["flags"] & TurnFlag.BRIDGED
    return found


def assert_same(given: list[dict[str, Any]], wanted: list[dict[str, Any]]) -> None:
    assert len(given) == len(wanted)
    for a, b in zip(given, wanted, strict=True):
        for name in ESTIMATES:
            np.testing.assert_allclose(a[name], b[name], rtol=1e-9, err_msg=name)
        for name in ("turn", "flags", "valid", "rolling", "status"):
            assert a[name] == b[name], name


@pytest.mark.parametrize("samples", [10, 100])
def test_10_khz_by_1_is_1_khz_by_10_is_100_hz_by_100(
    samples: int, strain: np.ndarray, one_by_one: list[dict[str, Any]]
) -> None:
    with LoadedFmu(live.fmu_file(samples)) as fmu:
        assert fmu.samples == samples
        assert_same(turns_of(fmu, strain, even(strain.shape[1], samples)), one_by_one)


def test_variable_steps_give_the_same(strain: np.ndarray, one_by_one: list[dict[str, Any]]) -> None:
    with LoadedFmu(live.fmu_file(100)) as fmu:
        assert_same(turns_of(fmu, strain, cut(strain.shape[1], 100, seed=1)), one_by_one)


@pytest.mark.parametrize("longest", [3, 100])
def test_a_buffer_filled_in_fits_and_starts_gives_the_same(
    longest: int, buffered: LoadedFmu, strain: np.ndarray, one_by_one: list[dict[str, Any]]
) -> None:
    assert_same(turns_of(buffered, strain, cut(strain.shape[1], longest, seed=2)), one_by_one)


def push(fmu: LoadedFmu, frame: np.ndarray, step: float) -> None:
    """A buffered step of any length."""
    names = [f"strain_{s}_{g}" for s in range(1, frame.shape[1] + 1) for g in range(1, 6)]
    at = fmu.references
    fmu.slave.setReal(
        [at[n] for n in (*names, *HELD)], [*frame.T.ravel().tolist(), *CONDITIONS.tolist()]
    )
    fmu.slave.setInteger([at["samples"]], [frame.shape[1]])
    fmu.slave.doStep(0.0, step)


def test_steps_of_a_buffered_fmu_need_not_hold_whole_samples(
    buffered: LoadedFmu, strain: np.ndarray, one_by_one: list[dict[str, Any]]
) -> None:
    random = np.random.default_rng(3)
    buffered.start(RATE)
    for part in cut(strain.shape[1], 100, seed=4):
        push(buffered, strain[:, part], float(random.uniform(1e-5, 0.012)))
        push(buffered, np.zeros((5, 0)), float(random.uniform(1e-5, 0.002)))
    last = buffered.read()
    assert_same([last], one_by_one[-1:])


def test_without_samples_a_buffered_estimate_ages_and_expires_within_two_turns(
    buffered: LoadedFmu, strain: np.ndarray
) -> None:
    turns_of(buffered, strain, even(strain.shape[1], 100))
    before = buffered.read()
    assert before["valid"]
    period = 2.0 * math.pi / before["turn_rate"]
    push(buffered, np.zeros((5, 0)), 0.5 * period)
    aged = buffered.read()
    assert aged["valid"]
    assert aged["age"] == pytest.approx(before["age"] + 0.5 * period, rel=1e-12)
    push(buffered, np.zeros((5, 0)), 1.5 * period)
    late = buffered.read()
    assert not late["valid"]
    assert late["flags"] & TurnFlag.NO_CONTACT
    assert late["Fz"] == before["Fz"]


def test_the_time_without_samples_is_part_of_the_state(
    buffered: LoadedFmu, strain: np.ndarray
) -> None:
    turns_of(buffered, strain, even(strain.shape[1], 100))
    push(buffered, np.zeros((5, 0)), 0.05)
    state, now = buffered.slave.getFMUState(), buffered.read()
    push(buffered, strain[:, :50], 0.001)
    later = buffered.read()
    buffered.slave.setFMUState(state)
    assert json.dumps(buffered.read()) == json.dumps(now)
    push(buffered, strain[:, :50], 0.001)
    assert json.dumps(buffered.read()) == json.dumps(later)
    assert later["age"] < now["age"]
    buffered.slave.freeFMUState(state)


@pytest.mark.parametrize("count", [-1, 101])
def test_a_count_outside_the_frame_is_refused_with_its_cause(
    buffered: LoadedFmu, count: int
) -> None:
    buffered.start(RATE)
    buffered.slave.setInteger([buffered.references["samples"]], [count])
    with pytest.raises(FMICallException, match="status 3"):
        buffered.slave.doStep(0.0, 0.01)
    assert f"samples = {count}; allowed are 0 .. 100" in buffered.messages[-1]
    assert buffered.read()["status"].startswith("step_refused: samples = ")
