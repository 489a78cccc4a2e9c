"""What the library computes with its compiled core is what its numpy reference computes."""

import json
import pickle
import warnings
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import tirelib.core.compiled
from tests.fmu import live
from tests.native.test_native_turns import SEQUENCES, sequences
from tests.native.test_native_wheel import KINDS, spoilt
from tests.synthetic import LATERAL, frames
from tirelib.core.compiled import Core, loaded_core
from tirelib.core.errors import FormatError, ParameterError, ShapeError
from tirelib.core.held import HELD
from tirelib.estimators.compiled import core_calibration
from tirelib.estimators.estimate import Estimates
from tirelib.measured.features import (
    Features,
    RecordReader,
    concatenate_features,
    extract_features,
    features_of_record,
)
from tirelib.measured.features.extract import reference_features
from tirelib.measured.signal import TurnCutter, Turns, cut_turns, stack_turns
from tirelib.stream import StreamEstimator
from tirelib.stream.compiled import CompiledEstimator
from tirelib.stream.reference import NumpyEstimator

pytestmark = pytest.mark.skipif(
    loaded_core() is None, reason="no compiled core for this machine, or numpy was asked for"
)


def conditions(n: int) -> dict[str, Any]:
    """Conditions that change, are held or unknown."""
    speed = live.SPEED * (1.0 + 1e-3 * np.sin(np.arange(n) / 300.0))
    return {"speed": speed, "pressure": live.PRESSURE, "camber": 0.0, "friction": np.nan}


def reference_turns(strain: np.ndarray, **held: Any) -> Turns:
    cut = TurnCutter(LATERAL, live.RATE).push(strain, **held)
    return stack_turns(cut, np.array(LATERAL), live.RATE)


FLAT = ("stop", "jump", "clipped gage")
"""Here a curve stands still somewhere, so that its peak is anywhere there."""


def assert_alike(got: Any, wanted: Any, kind: str = "") -> None:
    """Hold all fields of a dataclass against those of another: 1e-9, words and flags exactly."""
    for field in fields(wanted):
        if kind in FLAT and field.name.endswith("_angle"):
            continue
        one, other = getattr(got, field.name), getattr(wanted, field.name)
        if isinstance(other, dict):
            for name, values in other.items():
                np.testing.assert_allclose(one[name], values, 1e-9, 1e-9, err_msg=name)
        elif isinstance(other, np.ndarray) and other.dtype.kind == "f":
            assert one.shape == other.shape
            np.testing.assert_allclose(one, other, 1e-9, 1e-11, err_msg=field.name)
        elif isinstance(other, np.ndarray):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other, err_msg=field.name)
        elif hasattr(other, "__dataclass_fields__"):
            assert_alike(one, other)
        else:
            assert one == other


@pytest.mark.parametrize("kind", KINDS)
def test_a_record_has_the_turns_features_and_estimates_of_numpy(kind: str) -> None:
    strain, known = spoilt(kind), live.calibration()
    held = conditions(strain.shape[1])
    trigger = np.arange(strain.shape[1]) % 533 == 200
    wanted = reference_turns(strain, trigger=trigger, **held)
    got = cut_turns(strain, live.RATE, LATERAL, trigger=trigger, **held)
    assert_alike(got, wanted)
    features = reference_features(wanted)
    assert_alike(extract_features(wanted), features, kind)
    found = features_of_record(strain, live.RATE, LATERAL, trigger=trigger, **held)
    assert_alike(extract_features(got), found)
    estimates = known.estimate(features)
    assert_alike(estimates, known.reference_estimate(features))
    assert len(estimates.notes) == len(wanted) >= 3


@given(case=sequences())
@settings(max_examples=SEQUENCES)
def test_samples_that_are_looked_at_together_say_the_same(
    case: tuple[np.ndarray, dict[str, Any]],
) -> None:
    """The finder skips samples in which nothing happens where they lie in one piece."""
    strain, held = case
    found = []
    for laid in (np.ascontiguousarray, np.asfortranarray):
        try:
            turns = cut_turns(laid(strain), 2e3, (0.04, 0.0, -0.04), **held)
        except ParameterError as error:
            found.append(str(error))
        else:
            found.append(pickle.dumps(turns))
    assert found[0] == found[1]


def test_more_turns_than_a_block_and_no_turn_at_all() -> None:
    strain = live.strain_of(4e3, 0.05, turns=70.4)[0]
    held = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
    wanted = reference_features(reference_turns(strain, **held))
    assert len(wanted) == 70
    assert_alike(features_of_record(strain, live.RATE, LATERAL, **held), wanted)
    for n in (0, 60):
        none = features_of_record(strain[:, :n], live.RATE, LATERAL, **held)
        assert len(none) == 0
        assert none.lead.shape == (0, 5)
        assert len(live.calibration().estimate(none).notes) == 0


def test_records_one_after_the_other_have_the_features_of_each_alone() -> None:
    strain = live.strain_of(4e3, 0.05, turns=70.4)[0]
    records = [(strain, live.RATE)] * 5  # more turns than the core writes side by side
    records[2:2] = [(strain[:, :1000], 2e6), (strain[:, :60], live.RATE)]  # one too fast, one empty
    reader, parts = RecordReader(LATERAL), []
    for number, (samples, rate) in enumerate(records):
        alone = features_of_record(samples, rate, LATERAL, speed=live.SPEED)
        time, omega = reader.add(samples, rate, start=float(number), speed=live.SPEED)
        shifted = replace(alone, time=alone.time + number, ready=alone.ready + number)
        np.testing.assert_array_equal(time, shifted.time)
        np.testing.assert_array_equal(omega, shifted.omega)
        parts.append(shifted)
    assert len(reader.features()) == 5 * 70 + 2
    assert_alike(reader.features(), concatenate_features(parts))


def test_strain_may_lie_in_memory_in_any_way() -> None:
    strain = live.strain_of(4e3, 0.05, turns=3.4)[0]
    wanted = features_of_record(strain, live.RATE, LATERAL, speed=live.SPEED)
    wide = np.zeros((7, 2 * strain.shape[1]))
    wide[1:6, ::2] = strain
    shifted = np.frombuffer(b"x" + strain.tobytes(), dtype=np.uint8)[1:].view(np.float64)
    for other in (
        *(np.asfortranarray(strain), strain.T.copy().T, wide[1:6, ::2]),
        *(strain[:, ::-1][:, ::-1], strain[::-1].copy()[::-1], shifted.reshape(strain.shape)),
    ):
        assert_alike(features_of_record(other, live.RATE, LATERAL, speed=live.SPEED), wanted)


def told(estimator: StreamEstimator) -> tuple[Any, ...]:
    """All that an estimator says between turns."""
    return (
        *(estimator.turns, estimator.flags, estimator.stale, estimator.valid),
        *(estimator.is_valid(quantity) for quantity in ("Fz", "alpha", "kappa", "Fy")),
    )


@pytest.mark.parametrize("kind", ["stop", "gap", "clipped gage", "lost centre"])
def test_a_stream_says_at_every_frame_what_numpy_says(kind: str) -> None:
    strain, known = spoilt(kind), live.calibration()
    held = conditions(strain.shape[1])
    one, other = StreamEstimator(known, live.RATE), NumpyEstimator(known, live.RATE)
    assert type(one) is CompiledEstimator
    for number, part in enumerate(frames(strain.shape[1], 300, 3)):
        now = {name: x[part] if isinstance(x, np.ndarray) else x for name, x in held.items()}
        if number % 7 == 6:
            now["omega"] = 0.0 if number % 14 == 6 else live.SPEED / live.RADIUS
        got, wanted = (each.push(strain[:, part], **now) for each in (one, other))
        if number == 5:
            for each in (one, other):
                each.wait(0.02)
        assert len(got) == len(wanted)
        for turn, reference in zip(got, wanted, strict=True):
            assert turn.turn == reference.turn
            assert_alike(turn.features, reference.features, kind)
            assert_alike(turn.estimates, reference.estimates)
        assert told(one) == told(other)
        np.testing.assert_allclose(
            [one.age, one.time, one.elapsed], [other.age, other.time, other.elapsed], 1e-9
        )
    assert one.turns >= 3


def test_a_state_is_of_what_computes() -> None:
    known = live.calibration()
    one, other = StreamEstimator(known, live.RATE), NumpyEstimator(known, live.RATE)
    with pytest.raises(FormatError, match="this version reads 'tirelib-core-state/3'"):
        one.restore(other.state())
    with pytest.raises(FormatError, match="this version reads 'tirelib-stream-state"):
        other.restore(one.state())
    state = json.loads(json.dumps(one.state()))
    for damaged in ({**state, "core": "another"}, {**state, "wheel": "AAAA" + state["wheel"]}):
        with pytest.raises(FormatError, match="damaged, or of another build"):
            one.restore(damaged)


@pytest.fixture
def no_core(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TIRELIB_CORE", "numpy")
    loaded_core.cache_clear()
    yield
    monkeypatch.undo()
    loaded_core.cache_clear()


@pytest.mark.usefixtures("no_core")
def test_without_a_core_numpy_computes() -> None:
    strain, known = live.strain_of(4e3, 0.05, turns=3.4)[0], live.calibration()
    held = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
    assert loaded_core() is None
    wanted = reference_features(reference_turns(strain, **held))
    assert_alike(features_of_record(strain, live.RATE, LATERAL, **held), wanted)
    assert_alike(known.estimate(wanted), known.reference_estimate(wanted))
    assert type(StreamEstimator(known, live.RATE)) is NumpyEstimator
    with pytest.raises(FormatError, match="there is none for this machine"):
        CompiledEstimator(known, live.RATE)


def test_a_calibration_that_the_core_does_not_know_is_left_to_numpy() -> None:
    known = live.calibration()
    chain = known.chains[-1]
    assert chain.load is not None
    strange = replace(chain.load.variables[0], name="phase_of_the_moon")
    load = replace(chain.load, variables=(strange, *chain.load.variables[1:]))
    other = replace(known, chains={**known.chains, -1: replace(chain, load=load)})
    assert core_calibration(known) is core_calibration(known) is not None
    assert core_calibration(other) is None
    assert type(StreamEstimator(other, live.RATE)) is NumpyEstimator


def test_a_library_that_is_damaged_or_of_another_version_leaves_the_work_to_numpy_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    damaged = tmp_path / "core.so"
    damaged.write_bytes(b"\x7fELF nothing else")
    monkeypatch.setattr(tirelib.core.compiled, "shipped", lambda name: damaged)
    loaded_core.cache_clear()
    with pytest.warns(UserWarning, match="the compiled core cannot be loaded"):
        assert loaded_core() is None
    monkeypatch.undo()
    loaded_core.cache_clear()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert isinstance(loaded_core(), Core)


def test_bad_frames_are_refused_as_numpy_refuses_them() -> None:
    strain = live.strain_of(4e3, 0.05, turns=1.2)[0]
    with pytest.raises(ShapeError, match=r"\(5, n\) is needed"):
        features_of_record(strain[:4], live.RATE, LATERAL)
    with pytest.raises(ShapeError, match="speed has shape"):
        features_of_record(strain, live.RATE, LATERAL, speed=np.ones(3))
    with pytest.raises(ShapeError, match="trigger has shape"):
        StreamEstimator(live.calibration(), live.RATE).push(strain, trigger=np.zeros(2, bool))
    with pytest.raises(ParameterError, match="sample rate = 0"):
        features_of_record(strain, 0.0, LATERAL)


def test_the_held_conditions_are_those_of_the_core() -> None:
    assert HELD[:4] == ("speed", "pressure", "camber", "omega")
    assert {f.name for f in fields(Features)} > {"lead", "tp", "skew"}
    assert {f.name for f in fields(Estimates)} >= {"value", "std", "valid", "notes"}
