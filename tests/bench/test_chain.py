"""The chain gives what the library gives, whatever the steps, the reads and the frames."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.bench.campaigns import tiny_runs
from tests.bench.in_process import InProcess
from tests.synthetic import frames as cuts
from tirebench.emulator.emulator import Script, write_script
from tirebench.emulator.faults import Faults, parse_faults
from tirebench.estimator.chain import Outputs, Turn
from tirebench.recording.document import document
from tirebench.wire.conditions import Condition, Conditions, condition
from tirebench.wire.device import Device
from tirebench.wire.frames import SAMPLES
from tirelib.campaign import read_campaign
from tirelib.core.arrays import FloatArray
from tirelib.core.flags import TurnFlag
from tirelib.core.held import HELD
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.result import estimate_document
from tirelib.measured.observations import observe
from tirelib.stream import StreamEstimator

QUANTITIES = ("Fz", "alpha", "kappa", "Fy")


class StandIn:
    """The streaming estimator behind the interface of the FMU."""

    def __init__(self, calibration: Calibration, samples: int) -> None:
        self.samples = samples
        self._calibration = calibration

    def start(self, period: float) -> None:
        self._stream = StreamEstimator(self._calibration, 1.0 / period)

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> Outputs | None:
        done = self._stream.push(strain.T, **dict(zip(HELD, conditions, strict=True)))
        if not done:
            return None
        turn = done[-1]
        values = {q: turn.value(q) for q in QUANTITIES}
        stds = {f"{q}_std": turn.std(q) for q in QUANTITIES}
        valids = {f"{q}_valid": float(turn.is_valid(q)) for q in QUANTITIES}
        numbers = {
            **values,
            **stds,
            **valids,
            "contact_time": turn.time,
            "age": self._stream.age,
            "valid": float(turn.valid),
            "flags": turn.flags,
        }
        return numbers, {}


@pytest.fixture(scope="module")
def script() -> Script:
    return write_script(tiny_runs(), Device(), Faults({}))


def constant(script: Script) -> Conditions:
    """Conditions that do not change, with the runs of the script."""
    return Conditions((0,), (condition(18.0, 2.3e5, 0.0),), script.conditions.runs)


def estimates(
    calibration: Calibration,
    frames: Sequence[bytes],
    conditions: Conditions,
    samples: int = 16,
    longest: int | None = None,
) -> tuple[list[Turn], InProcess]:
    chain = InProcess(lambda _: StandIn(calibration, samples), conditions)
    stream = b"".join(frames)
    parts = [slice(0, len(stream))] if longest is None else cuts(len(stream), longest, 1)
    turns = [turn for part in parts for turn in chain.push(stream[part])]
    return [*turns, *chain.finish()], chain


def numbers(turns: Sequence[Turn]) -> FloatArray:
    names = [*QUANTITIES, *(f"{q}_std" for q in QUANTITIES), "valid"]
    return np.array(
        [[t.run, t.t, t.ready, t.flags, *(t.outputs[name] for name in names)] for t in turns]
    )


@pytest.mark.parametrize("samples", [1, 7, 10, 16])
def test_the_bench_gives_the_estimates_of_the_library(
    calibration: Calibration, campaign: Path, script: Script, samples: int
) -> None:
    turns, chain = estimates(calibration, script.frames, script.conditions, samples)
    observations = observe([read_campaign(campaign)])
    library = estimate_document(
        observations, calibration.estimate(observations.features), calibration
    )
    bench = document(turns, script.conditions.runs, chain.wheels, {})
    assert len(bench["turns"]) == len(library["turns"]) >= 15
    assert sum(turn["valid"] for turn in bench["turns"]) >= 12
    for mine, theirs in zip(bench["turns"], library["turns"], strict=True):
        for name in ("run", "valid", *(f"{q}_valid" for q in QUANTITIES)):
            assert mine[name] == theirs[name]
        for name in ("t", "ready", *QUANTITIES, *(f"{q}_std" for q in QUANTITIES)):
            if theirs[name] is None:
                assert mine[name] is None
            else:
                assert mine[name] == pytest.approx(theirs[name], rel=1e-9, abs=1e-12)
    for quantity in QUANTITIES:
        if library["summary"][quantity]:
            assert bench["summary"][quantity]["rmse"] == pytest.approx(
                library["summary"][quantity]["rmse"], rel=1e-6
            )


def test_estimates_do_not_depend_on_samples_a_step_or_on_reads(
    calibration: Calibration, script: Script
) -> None:
    first = numbers(estimates(calibration, script.frames, constant(script), 16)[0])
    for samples, longest in ((1, None), (10, None), (7, 300), (16, 100)):
        other = estimates(calibration, script.frames, constant(script), samples, longest)[0]
        np.testing.assert_allclose(numbers(other), first, rtol=1e-9, atol=1e-12)


def test_the_last_turn_comes_with_its_last_sample(calibration: Calibration, script: Script) -> None:
    """Cut the record just before and just after the last sample that a turn needs."""
    turns, _ = estimates(calibration, script.frames[:400], constant(script), 1)
    last = math.floor(turns[-1].ready * 1e4)  # the number of the last sample, from 0
    run = tiny_runs()[0]
    for samples in (1, 16):
        counts = []
        for length in (last, last + 1):
            short = [_shortened(run, length)]
            frames = write_script(short, Device(), Faults({})).frames
            counts.append(len(estimates(calibration, frames, constant(script), samples)[0]))
        assert counts == [len(turns) - 1, len(turns)]
    followed = write_script([_shortened(run, last + 1), tiny_runs()[1]], Device(), Faults({}))
    both = estimates(calibration, followed.frames, constant(followed))[0]
    assert sum(turn.run == 1 for turn in both) == len(turns)


def _shortened(run, length):
    from dataclasses import replace

    return replace(run, strain=run.strain[:, :length], trigger=None)


def test_a_saturated_gage_is_flagged_and_the_others_go_on(
    calibration: Calibration, script: Script
) -> None:
    frames = write_script(tiny_runs(), Device(), Faults(parse_faults(["saturate=2"]))).frames
    turns, chain = estimates(calibration, frames, constant(script))
    assert all(turn.flags & TurnFlag.SATURATED for turn in turns)
    again = estimates(calibration, frames, constant(script), 10, longest=150)[0]
    assert [turn.saturated for turn in again] == [turn.saturated for turn in turns]
    valid = [turn for turn in turns if turn.valid]
    assert valid
    assert all(turn.flags & TurnFlag.REDUCED_GAGES for turn in valid)
    assert chain.timeline.counts.saturated[1] > 500
    sound = estimates(calibration, script.frames, constant(script))[0]
    load = {turn.t: turn.outputs["Fz"] for turn in sound}
    for turn in valid:
        assert turn.outputs["Fz"] == pytest.approx(load[turn.t], rel=0.05)


def test_a_gap_is_flagged_never_bridged_in_silence(
    calibration: Calibration, script: Script
) -> None:
    frames = list(script.frames[:400])
    sound = estimates(calibration, frames, constant(script))[0]
    hit = int(sound[3].t * 1e4 / 16)  # the frame of a contact
    del frames[hit]
    turns = estimates(calibration, frames, constant(script))[0]
    assert len(turns) == len(sound)
    assert turns[3].flags & TurnFlag.GAP
    assert not turns[3].valid
    np.testing.assert_allclose(numbers(turns[:3]), numbers(sound[:3]), rtol=1e-12)


def test_damaged_and_repeated_frames_change_nothing_else(
    calibration: Calibration, script: Script
) -> None:
    faults = Faults(parse_faults(["dup=0.1"]), seed=1)
    frames = faults.wire(script.frames)
    turns, chain = estimates(calibration, frames, constant(script))
    assert chain.timeline.counts.duplicates == faults.done["dup"] > 50
    sound = estimates(calibration, script.frames, constant(script))[0]
    np.testing.assert_array_equal(numbers(turns), numbers(sound))


def test_without_a_speed_there_is_no_slip_ratio(calibration: Calibration, script: Script) -> None:
    turns = estimates(calibration, script.frames[:400], Conditions.constant(math.nan, 2.3e5, 0.0))[
        0
    ]
    assert all(turn.flags & (TurnFlag.NO_SPEED | TurnFlag.FIRST_TURN) for turn in turns)
    assert not any(turn.outputs["kappa_valid"] for turn in turns)
    assert {turn.run for turn in turns} == {0}


def test_every_run_starts_the_estimator_afresh(calibration: Calibration, script: Script) -> None:
    turns, chain = estimates(calibration, script.frames, constant(script))
    assert chain.timeline.counts.resets == 2
    assert [turn.run for turn in turns] == sorted(turn.run for turn in turns)
    firsts = [turn for turn in turns if turn.flags & TurnFlag.FIRST_TURN]
    assert [turn.segment for turn in firsts] == [0, 1, 2]


def test_every_turn_that_lost_samples_is_flagged_and_no_other_is_changed(
    calibration: Calibration, script: Script
) -> None:
    """A lost frame far from the contact moves an estimate, although the estimator needs it not.

    Later turns remember how period and offset changed in it: less than a hundredth of a deviation.
    """
    frames, gap = script.frames[:300], int(TurnFlag.GAP)
    whole, _ = estimates(calibration, frames, constant(script))
    unflagged_by_the_estimator = 0
    for place in range(90, 240, 6):
        turns, chain = estimates(
            calibration, [*frames[:place], *frames[place + 1 :]], constant(script)
        )
        assert chain.timeline.counts.lost_samples == SAMPLES
        assert len(turns) == len(whole)
        readies = [turn.ready for turn in turns]
        lost = 1e-4 * (SAMPLES * place + np.arange(SAMPLES))
        struck = {int(turn) for turn in np.searchsorted(readies, lost)} - {len(turns)}
        for number, (turn, clean) in enumerate(zip(turns, whole, strict=True)):
            if number in struck:
                assert turn.flags & gap
                unflagged_by_the_estimator += not int(turn.outputs["flags"]) & gap
                continue
            assert turn.flags == int(turn.outputs["flags"])
            if not turn.flags & gap:
                assert turn.flags == clean.flags
                for name in QUANTITIES:
                    assert turn.outputs[name] == pytest.approx(
                        clean.outputs[name], abs=0.01 * clean.outputs[f"{name}_std"], nan_ok=True
                    )
    assert unflagged_by_the_estimator > 10
