"""Several wheels on one line, their clocks, and what each is told."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.bench.campaigns import tiny_runs
from tests.bench.in_process import InProcess
from tirebench.cli.live import counters
from tirebench.emulator.emulator import Player, record_tape
from tirebench.emulator.faults import Faults, parse_faults
from tirebench.estimator.chain import Outputs
from tirebench.estimator.wheels import MOST_WHEELS, Wheels
from tirebench.protocols import SERIAL
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.transmitter import transmitter
from tirebench.recording.document import document, wheel_document
from tirebench.wire.clock import ClockFit
from tirebench.wire.conditions import Condition, Conditions
from tirebench.wire.device import Device
from tirelib.core.arrays import FloatArray


class Sums:
    """An estimator that keeps the samples it was given."""

    samples = 16

    def __init__(self) -> None:
        self.seen: list[FloatArray] = []

    def start(self, period: float) -> None:
        pass

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> Outputs | None:
        self.seen.append(strain.copy())
        return None


def played(
    numbers: tuple[int, ...], chosen: tuple[int, ...] = ()
) -> tuple[Wheels, dict[int, Sums]]:
    made: dict[int, Sums] = {}

    def estimator(wheel: int) -> Sums:
        made[wheel] = Sums()
        return made[wheel]

    devices = {None: Device(), 2: Device(scale=1e-6)}
    line = InProcess(estimator, Conditions.constant(), devices, chosen=chosen)
    faults = Faults(parse_faults(["flips=0.05"]), 2)
    tape = record_tape(tiny_runs()[:1], Device(), Faults({}), numbers)
    for piece in Player(transmitter("serial"), SERIAL, faults).pieces(tape):
        line.push(b"".join(piece.frames), round(1e9 * (1 + piece.due[-1])))
    line.finish()
    return line.wheels, made


def test_a_line_without_a_frame_says_what_to_look_at() -> None:
    wheels = Wheels.of_one(ProtocolPlan().decoder(), {None: Device()})
    assert counters(wheels).endswith(
        "0 frames; no byte was received: check that the transmitter is on and that this is its port"
    )
    assert counters(wheels, live=False) == "0 frames; the recording holds no valid frame"
    wheels.push(b"temperature 23.1\r\n" * 9)  # text: not even a bad frame
    assert "--baud" in counters(wheels)
    wheels, _ = played((0, 2), (5,))
    assert counters(wheels).startswith(f"{wheels.line.counts.ok} frames, ")
    assert f"{wheels.counts[1].other_wheel} other_wheel" in counters(wheels)
    assert "--baud" not in counters(wheels)


def test_each_wheel_has_its_own_estimator_device_and_counters() -> None:
    wheels, made = played((0, 2))
    assert sorted(made) == [0, 2]
    one, two = (np.concatenate(made[n].seen)[:, 0] for n in (0, 2))
    both = np.isfinite(one[:4000]) & np.isfinite(two[:4000])
    ratio = two[:4000][both] / one[:4000][both]
    np.testing.assert_allclose(ratio, 1e-6 / Device().scale, rtol=1e-9)
    own = [wheel.timeline.counts.lost_frames for wheel in wheels.heard.values()]
    line, total = wheels.counts
    assert line.bad > 10
    assert min(own) > 0
    assert total.lost_frames == sum(own)
    shown = document([], (), wheels, {})["wheels"]
    assert [entry["lost_frames"] for entry in shown.values()] == own
    assert shown[0]["crc_bad"] == line.crc  # a damaged frame does not say whose it was
    assert wheel_document(wheels, 2)["clock_drift_ppm"] is None  # less than three seconds


def test_no_more_wheels_than_can_be_afforded_unless_they_are_named() -> None:
    numbers = (3, 4, 5, 6, 7, 8)
    wheels, made = played(numbers)
    assert sorted(made) == [3, 4, 5, 6][:MOST_WHEELS]
    assert wheels.ignored > 500
    assert sorted(played(numbers, (8, 3))[1]) == [3, 8]


def test_a_broken_line_is_counted_and_joined_anew() -> None:
    wheels, _ = played((0,))
    wheels.line.push(b"half a frame")
    bad = wheels.line.counts.bad
    wheels.interrupt()
    wheels.push(b"end of another\0", 1)
    assert (wheels.line.counts.bad, wheels.line.counts.reconnects) == (bad, 1)


@settings(max_examples=8)
@given(ppm=st.floats(-200.0, 200.0), seed=st.integers(0, 10**6), start=st.integers(0, 2**40))
def test_a_clock_is_fitted_through_its_earliest_arrivals(ppm: float, seed: int, start: int) -> None:
    """Latencies of 3 ms on average and outliers of 100 ms; the drift is known to 8 ppm.

    The earliest of 100 arrivals in a second is 30 us late, give or take as much: over 20 s that is
    1.2 ppm, one sigma.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 30.0, 0.01)
    latency = rng.exponential(0.003, len(time)) + 0.1 * (rng.random(len(time)) < 0.01)
    device = start + np.rint(1e6 * time * (1.0 + 1e-6 * ppm)).astype(np.int64)
    arrival = np.maximum.accumulate(np.rint(1e9 * (5.0 + time + latency)).astype(np.int64))
    fit = ClockFit()
    for d, a in zip(device.tolist(), arrival.tolist(), strict=True):
        fit.push(d, a)
    assert fit.drift_ppm == pytest.approx(ppm, abs=8.0)
    assert fit.host_time(float(device[-1])) == pytest.approx(5.0 + time[-1], abs=2e-4)
    assert fit.residual < 2e-4
    fit.restart()
    assert np.isnan(fit.drift_ppm)
