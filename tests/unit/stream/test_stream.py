"""Laws of the stream: it is the batch, whatever the frames; faults make flags, never numbers."""

import gc
import tracemalloc
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from multiprocessing import get_context

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fmu import live
from tests.synthetic import LATERAL, frames
from tirelib.campaign import conditions_of, read_campaign
from tirelib.core.errors import CalibrationError, ParameterError, ShapeError
from tirelib.core.flags import TurnFlag, flag_names
from tirelib.estimators.estimate import Estimates
from tirelib.measured.features import Features, extract_features
from tirelib.measured.observations import measure_run
from tirelib.measured.signal import LowPass, cut_turns
from tirelib.stream import StreamEstimator, TurnEstimate

QUANTITIES = ("Fz", "alpha", "kappa", "Fy")
HELD = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
TURN = round(2 * np.pi * live.RADIUS / live.SPEED * live.RATE)
"""Samples of one turn."""


def stream() -> StreamEstimator:
    return StreamEstimator(live.calibration(), live.RATE)


def played(strain: np.ndarray, **conditions: object) -> list[TurnEstimate]:
    return stream().push(strain, **{**HELD, **conditions})


def assert_row(turn: TurnEstimate, features: Features, estimates: Estimates, row: int) -> None:
    """Every field of one turn is that of a row of the batch."""
    for field in fields(Features):
        if field.name != "lateral":
            np.testing.assert_allclose(
                getattr(turn.features, field.name)[0],
                getattr(features, field.name)[row],
                rtol=1e-9,
                atol=1e-12,
                err_msg=field.name,
            )
    for field in fields(Estimates):
        given, wanted = getattr(turn.estimates, field.name), getattr(estimates, field.name)
        if isinstance(wanted, dict):
            for quantity in QUANTITIES:
                np.testing.assert_allclose(
                    given[quantity][0], wanted[quantity][row], rtol=1e-9, atol=1e-12
                )
        elif isinstance(wanted, tuple):
            assert given[0] == wanted[row]
        else:
            np.testing.assert_allclose(given[0], wanted[row], rtol=1e-9, atol=1e-12)


@settings(max_examples=12)
@given(
    longest=st.sampled_from([1, 3, 10, 64, 700]),
    seed=st.integers(0, 99),
    start=st.floats(-3.0, 3.0),
    dead=st.sampled_from([None, 0, 3]),
)
def test_the_length_of_a_frame_does_not_matter(
    longest: int, seed: int, start: float, dead: int | None
) -> None:
    strain, trigger = live.strain_of(3.7e3, 0.07, seed=seed, start=start)
    if dead is not None:
        strain[dead] = 0.0
    strain[:, 1900:1904] = np.nan
    speed = live.SPEED * (1 + 1e-3 * np.sin(np.arange(strain.shape[1]) / 300.0))
    turns = cut_turns(
        strain, live.RATE, LATERAL, speed=speed, pressure=live.PRESSURE, camber=0.0, trigger=trigger
    )
    features = extract_features(turns)
    estimates = live.calibration().estimate(features)
    estimator, found = stream(), []
    for part in frames(strain.shape[1], longest, seed):
        found += estimator.push(
            strain[:, part],
            speed=speed[part],
            pressure=live.PRESSURE,
            camber=0.0,
            trigger=trigger[part],
        )
    assert len(found) == len(features) >= 3
    for row, turn in enumerate(found):
        assert turn.turn == row + 1
        assert_row(turn, features, estimates, row)


def test_a_campaign_streams_to_the_numbers_of_the_batch() -> None:
    campaign = read_campaign(live.campaign_folder())
    calibration = live.calibration()
    low_pass = LowPass(calibration.order, calibration.cut_off)
    for run in campaign.runs():
        features, _ = measure_run(run, campaign.header, low_pass)
        estimates = calibration.estimate(features)
        estimator = StreamEstimator(
            calibration,
            run.rate,
            lateral=campaign.header.gage_lateral,
            tire=campaign.header.tire.name,
        )
        assert run.strain is not None
        assert run.trigger is not None
        held = conditions_of(run, run.time())
        found: list[TurnEstimate] = []
        for first in range(0, run.strain.shape[1], 10):
            part = slice(first, first + 10)
            found += estimator.push(
                run.strain[:, part],
                trigger=run.trigger[part],
                **{name: values[part] for name, values in held.items()},
            )
        assert len(found) == len(features)
        for row, turn in enumerate(found):
            assert_row(turn, features, estimates, row)


def test_an_estimate_is_ready_twenty_degrees_half_the_filter_and_a_frame_after_the_edge() -> None:
    strain, _ = live.strain_of(4e3, 0.05)
    estimator = stream()
    omega = live.SPEED / live.RADIUS
    reach = np.deg2rad(20.0) + 4 * LowPass().sigma(omega / (2 * np.pi))
    delays = []
    for first in range(0, strain.shape[1], 10):
        for turn in estimator.push(strain[:, first : first + 10], **HELD):
            if turn.turn > 1:
                trailing = turn.time + turn.features.trail[0, 2] / omega
                delays.append(estimator.time - trailing)
                assert 0.0 < estimator.age <= 11 / live.RATE
    # the pulse's end, from which the 20 degrees count, lies within 0.03 rad of the steepest edge
    assert len(delays) >= 2
    assert max(delays) <= (reach + 0.03) / omega + 12 / live.RATE


def test_the_age_grows_with_the_samples() -> None:
    strain, _ = live.strain_of(4e3, 0.0, turns=2.8)
    estimator = stream()
    assert np.isnan(estimator.age)
    (*_, last) = estimator.push(strain, **HELD)
    age = estimator.age
    assert age == pytest.approx(strain.shape[1] / live.RATE - last.ready)
    estimator.push(np.zeros((5, 50)), **HELD)
    assert estimator.age == pytest.approx(age + 50 / live.RATE)


@pytest.mark.parametrize("gage", [0, 1, 3, 4])
@pytest.mark.parametrize("fault", ["zero", "missing", "stuck", "saturated"])
def test_with_one_gage_out_the_others_estimate_and_say_so(gage: int, fault: str) -> None:
    strain, _ = live.strain_of(4e3, 0.08)
    full = played(strain)[-1]
    faulty = strain.copy()
    if fault == "saturated":
        faulty[gage] = np.minimum(faulty[gage], np.quantile(faulty[gage], 0.97) - 1e-3)
    else:
        faulty[gage] = {"zero": 0.0, "missing": np.nan, "stuck": 2.7e-3}[fault]
    turn = played(faulty)[-1]
    assert "reduced_gages" in flag_names(turn.flags)
    assert turn.valid
    for quantity in QUANTITIES:
        # the chains see the same waveform through other gages
        apart = abs(turn.value(quantity) - full.value(quantity))
        assert apart < 6.0 * np.hypot(turn.std(quantity), full.std(quantity))
    assert np.isnan(turn.estimates.contact_length[0, gage])


@pytest.mark.parametrize("gages", [[2], [0, 1], [0, 1, 2, 3, 4]])
def test_without_the_centre_gage_or_two_others_there_is_no_number(gages: list[int]) -> None:
    strain, _ = live.strain_of(4e3, 0.08, turns=5.4)
    dead = strain.copy()
    dead[gages, 2 * TURN :] = 0.0
    estimator = stream()
    late = [t for t in estimator.push(dead, **HELD) if t.time * live.RATE > 2.2 * TURN]
    for turn in late:
        assert not turn.valid
        assert all(np.isnan(turn.value(quantity)) for quantity in QUANTITIES)
    assert not estimator.valid


@pytest.mark.parametrize("missing", [3, 60])
def test_a_gap_in_the_contact_makes_a_flag_and_no_number_and_the_next_turn_is_well(
    missing: int,
) -> None:
    strain, _ = live.strain_of(4e3, 0.05, turns=5.4)
    clean = played(strain)
    at = int(clean[2].time * live.RATE)
    holed = strain.copy()
    holed[:, at : at + missing] = np.nan
    turns = played(holed)
    bad = min(turns, key=lambda turn: abs(turn.time - clean[2].time))
    assert {"gap", "too_few_gages"} <= set(flag_names(bad.flags))
    assert all(np.isnan(bad.value(quantity)) for quantity in QUANTITIES)
    assert turns[-1].valid
    # the levels that cut the next pulse come from a turn that lacks its noise in the gap
    np.testing.assert_allclose(turns[-1].value("Fz"), clean[-1].value("Fz"), rtol=1e-5)


def test_a_valid_turn_after_a_gap_opposite_the_contact_has_every_standard_deviation() -> None:
    strain, _ = live.strain_of(4e3, 0.05, turns=5.4)
    clean = played(strain)
    at = int((1.5 * clean[1].time - 0.5 * clean[0].time) * live.RATE)
    strain[:, at - 100 : at + 100] = np.nan
    *_, bad, after, _ = played(strain)
    assert "too_few_gages" in flag_names(bad.flags)
    for quantity in QUANTITIES:
        assert after.is_valid(quantity)
        assert np.isfinite(after.std(quantity))


@pytest.mark.parametrize("speed", [np.nan, 0.0])
def test_without_a_speed_kappa_is_unknown_and_flagged(speed: float) -> None:
    turn = played(live.strain_of(4e3, 0.05)[0], speed=speed)[-1]
    assert "no_speed" in flag_names(turn.flags)
    assert np.isnan(turn.value("kappa"))
    assert not turn.is_valid("kappa")
    assert turn.is_valid("Fz")


def test_reversed_rolling_is_flagged_and_not_estimated() -> None:
    turn = played(live.strain_of(4e3, 0.05)[0], speed=-live.SPEED)[-1]
    assert "reversed" in flag_names(turn.flags)
    assert not turn.valid
    assert np.isnan(turn.value("Fz"))


@pytest.mark.parametrize("end", ["frozen", "missing", "zero", "offset"])
@pytest.mark.parametrize("size", [1, 10, 333])
def test_the_watchdog_drops_validity_two_turns_after_the_last_contact(end: str, size: int) -> None:
    strain, _ = live.strain_of(4e3, 0.05, turns=3.0)
    last_value = strain[:, -1:]
    tail = {
        "frozen": last_value,
        "missing": last_value * np.nan,
        "zero": 0 * last_value,
        "offset": last_value + 1e-3,
    }[end]
    estimator = stream()
    last = estimator.push(strain, **HELD)[-1]
    limit = int((last.time + 2 * last.features.period[0]) * live.RATE)
    count = strain.shape[1]
    assert estimator.valid
    while count < limit + 3 * TURN:
        estimator.push(np.repeat(tail, size, axis=1), **HELD)
        count += size
        assert estimator.valid == (count <= limit)
        assert bool(estimator.flags & TurnFlag.NO_CONTACT) == (count > limit)
    assert estimator.latest == last
    estimator.push(live.strain_of(4e3, 0.05, turns=5.4)[0], **HELD)
    assert estimator.valid


def test_before_the_first_contact_nothing_is_valid() -> None:
    estimator = stream()
    assert estimator.latest is None
    estimator.push(np.zeros((5, 40)), **HELD)
    assert not estimator.valid
    assert flag_names(estimator.flags) == ["first_turn"]
    estimator.push(np.zeros((5, int(3.1 * live.RATE))), **HELD)
    assert flag_names(estimator.flags) == ["first_turn", "no_contact"]


def test_a_measured_standstill_drops_validity_at_once() -> None:
    strain, _ = live.strain_of(4e3, 0.05, turns=2.9)
    estimator = stream()
    estimator.push(strain, omega=59.0, **HELD)
    assert estimator.valid
    estimator.push(strain[:, -1:], omega=0.0, **HELD)
    assert not estimator.valid
    other = stream()
    standing = np.full(strain.shape[1], 59.0)
    standing[-1] = 0.01
    other.push(strain, omega=standing, **HELD)
    assert not other.valid


def test_a_calibration_of_another_gage_layout_or_tire_is_refused() -> None:
    calibration = live.calibration()
    with pytest.raises(CalibrationError, match="gages lie at"):
        StreamEstimator(calibration, live.RATE, lateral=[-y for y in LATERAL])
    with pytest.raises(CalibrationError, match="gages lie at"):
        StreamEstimator(calibration, live.RATE, lateral=LATERAL[:4])
    with pytest.raises(CalibrationError, match="the tire is"):
        StreamEstimator(calibration, live.RATE, tire="another")


@pytest.mark.parametrize("rate", [0.0, 50.0, 2e6, np.nan])
def test_a_rate_out_of_range_is_refused(rate: float) -> None:
    with pytest.raises(ParameterError, match="allowed are 100"):
        StreamEstimator(live.calibration(), rate)


def test_a_frame_of_another_number_of_gages_is_refused() -> None:
    with pytest.raises(ShapeError, match="strain has shape"):
        stream().push(np.zeros((4, 10)))


def test_a_fixed_cut_off_of_the_calibration_is_used() -> None:
    strain, _ = live.strain_of(4e3, 0.05)
    fixed = replace(live.calibration(), cut_off=300.0)
    turn = StreamEstimator(fixed, live.RATE).push(strain, **HELD)[-1]
    features = extract_features(
        cut_turns(strain, live.RATE, LATERAL, low_pass=LowPass(cut_off=300.0), **HELD)
    )
    np.testing.assert_allclose(turn.features.tp[0], features.tp[-1], rtol=1e-12)
    assert turn.features.tp[0, 0] != played(strain)[-1].features.tp[0, 0]


@pytest.mark.parametrize("start", [3.0, 1.0, -1.0])
def test_a_turn_does_not_depend_on_what_lies_far_before_it(start: float) -> None:
    strain, _ = live.strain_of(4e3, 0.05, turns=124.0, start=start)
    estimator, found = stream(), []
    for first in range(0, strain.shape[1], 10):
        found += estimator.push(strain[:, first : first + 10], **HELD)
    assert strain.shape[1] > 65_000  # the buffer of 12 s has been compacted
    for turn in found[108:118]:
        stop = int(turn.ready * live.RATE) + 2
        fresh = played(strain[:, stop - 7 * TURN : stop])[-1]
        for quantity in QUANTITIES:
            # positions are counted from another start: the last digits of 68000 samples
            np.testing.assert_allclose(
                turn.value(quantity), fresh.value(quantity), rtol=1e-7, atol=1e-9
            )


def grown_memory() -> int:
    """What eight more plays of six turns leave in memory, B."""
    strain, _ = live.strain_of(4e3, 0.05, turns=6.0)
    estimator = stream()

    def play() -> None:
        for first in range(0, strain.shape[1], 10):
            estimator.push(strain[:, first : first + 10], **HELD)

    for _ in range(3):
        play()
    tracemalloc.start()
    play()
    gc.collect()  # what waits to be collected is no growth
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(8):
        play()
    gc.collect()
    return tracemalloc.get_traced_memory()[0] - before


def test_memory_does_not_grow() -> None:
    # in a process of its own: what other tests left running also asks for memory
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        grown = pool.submit(grown_memory).result()
    # 48 turns and 12000 samples: 500 kB of strain, 1.4 MB of traces
    assert grown < 20_000
