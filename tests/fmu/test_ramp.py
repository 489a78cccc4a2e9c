"""Laws of estimates while the wheel's speed changes: one definition, right to 8 m/s2."""

from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
import pytest

from tests.fmu import live
from tests.fmu.virtual_host import RATE, surface
from tests.synthetic import waveform
from tirelib.campaign import CampaignHeader, Run, RunPlan, TireGeometry, write_campaign
from tirelib.campaign.read import read_campaign
from tirelib.core.held import HELD
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.estimators.train import train
from tirelib.fmu.run import LoadedFmu
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.wheel import VirtualWheel
from tirelib.measured.features.extract import Features, extract_features
from tirelib.measured.observations import observe
from tirelib.measured.signal import LowPass, cut_turns
from tirelib.stream import StreamEstimator

SOURCES = {"omega": ("speed", "omega"), "speed": ("speed",), "turns": ()}
ROAD = {"friction": 1.0, "tread_depth": 8e-3, "tread_temperature": 300.0}
"""A road and a tread that are known, so that the rolling radius is."""


def estimate(
    calibration: Calibration, strain: np.ndarray, rate: float, held: dict[str, Any]
) -> tuple[Features, Estimates]:
    low_pass = LowPass(calibration.order, calibration.cut_off)
    turns = cut_turns(strain, rate, calibration.lateral, low_pass=low_pass, **held)
    features = extract_features(turns)
    return features, calibration.estimate(features)


@pytest.mark.parametrize("source", SOURCES)
def test_batch_stream_and_fmu_agree_while_braking(source: str) -> None:
    step, n = 10, 4000
    time = np.arange(n) / live.RATE
    omega = 58.0 - 26.0 * time
    phi = np.pi + 58.0 * time - 13.0 * time**2
    noise = 4e-6 * np.random.default_rng(1).standard_normal((5, n))
    strain = waveform(phi, half=0.2, dip=2.6e-3)[None] + 2.7e-3 + noise
    told = {"speed": live.RADIUS * omega, "omega": omega}
    held = {name: np.repeat(told[name][::step], step) for name in SOURCES[source]}
    held["pressure"], held["camber"] = np.full(n, live.PRESSURE), np.zeros(n)
    _, batch = estimate(live.calibration(), strain, live.RATE, held)
    stream, streamed = StreamEstimator(live.calibration(), live.RATE), []
    rows = np.stack([held.get(name, np.full(n, np.nan)) for name in HELD])
    with LoadedFmu(live.fmu_file(step)) as fmu:
        fmu.start(live.RATE)
        seen = []
        for first in range(0, n, step):
            part = slice(first, first + step)
            streamed += stream.push(
                strain[:, part], **{name: float(x[first]) for name, x in held.items()}
            )
            fmu.step(strain[:, part], rows[:, first])
            if fmu.slave.getInteger([fmu.references["turn"]])[0] > len(seen):
                seen.append(fmu.read())
    assert len(seen) == len(streamed) == len(batch.flags) >= 6
    for name in QUANTITIES:
        for column, unit in ((batch.value, ""), (batch.std, "_std")):
            wanted = column[name]
            of_stream = [turn.value(name) if not unit else turn.std(name) for turn in streamed]
            np.testing.assert_allclose(of_stream, wanted, rtol=1e-9)
            np.testing.assert_allclose([row[name + unit] for row in seen], wanted, rtol=1e-9)
    assert [row["flags"] for row in seen] == [turn.flags for turn in streamed]
    assert [turn.flags for turn in streamed] == batch.flags.tolist()
    assert source == "turns" or np.isfinite(batch.value["Fz"][1:]).all()


def play(seconds: float, law: Any, *, rate: float = RATE, samples: int = 20) -> dict[str, Any]:
    """Strain of the virtual tire along a manoeuvre, and what holds at each sample."""
    known = surface()
    wheel = VirtualWheel(known, Options(rate=rate, seed=1), samples)
    wheel.begin([law(0.0)[name] for name in known.inputs])
    rows, strain = [], []
    for frame in range(int(seconds * rate / samples)):
        inputs = law(frame * samples / rate)
        wheel.step(samples / rate, [inputs[name] for name in known.inputs])
        reals = wheel.outputs()[0]
        strain.append(np.array(reals[: 5 * samples]).reshape(samples, 5))
        rows.append([*(inputs[name] for name in known.inputs), reals[5 * samples]])
    held = np.repeat(np.array(rows), samples, axis=0).T
    return {
        "strain": np.concatenate(strain).T,
        **dict(zip((*known.inputs, "omega"), held, strict=True)),
    }


def steadily(load: float, speed: float, kappa: float = 0.0) -> dict[str, float]:
    return {
        "Fz": load,
        "alpha": 0.0,
        "kappa": kappa,
        "camber": 0.0,
        "speed": speed,
        "pressure": 2.3e5,
    }


@cache
def calibration() -> Calibration:
    """Made on steady runs of the virtual tire, loads and speeds about those of the ramps."""
    known, place = surface(), live.folder() / "ramp_calibration"
    header = CampaignHeader(
        name="steady",
        axes="iso",
        tire=TireGeometry("virtual", 0.316, 0.303, 0.0115, 0.168, -3e-3),
        gage_lateral=tuple(known.lateral.tolist()),
        rate=RATE,
    )
    points = [
        (load, speed, 0.0)
        for load in (1500.0, 2500.0, 3500.0, 4500.0)
        for speed in (8.0, 15.0, 23.0)
    ]
    points += [
        (load, 15.0, kappa)
        for load in (1500.0, 2500.0, 3500.0, 4500.0)
        for kappa in (-0.06, -0.03, 0.03)
    ]
    runs = []
    for number, (load, speed, kappa) in enumerate(points, start=1):
        made = play(7.5 / speed, lambda _, at=(load, speed, kappa): steadily(*at))
        rig = {name: np.full(5, made[name][0]) for name in ("speed", "omega", "pressure", "camber")}
        rig |= {"Fz": np.full(5, load), "slip_ratio": np.full(5, kappa)}
        rig |= {"Fx": np.full(5, 2e4 * kappa), "slip_angle": np.zeros(5), "Fy": np.zeros(5)}
        kind = "free" if kappa == 0.0 else "brake" if kappa < 0.0 else "drive"
        plan = RunPlan(number, f"runs/{number:03d}.mf4", kind, load, 2.3e5, speed, 0.0, 0.0, kappa)
        times = np.linspace(0.0, made["strain"].shape[1] / RATE, 5)
        runs.append(Run(plan, made["strain"], RATE, 0.0, None, rig, times))
    write_campaign(place, header, runs)
    return train(observe([read_campaign(place)])).calibration


@cache
def ramp(acceleration: float, load: float) -> dict[str, Any]:
    """Straight, between 80 and 29 km/h at a held load, after half a second at a steady speed."""
    first = 80.0 / 3.6 if acceleration < 0.0 else 8.0
    seconds = abs(14.0 / acceleration)
    return play(0.5 + seconds, lambda t: steadily(load, first + acceleration * max(t - 0.5, 0.0)))


@pytest.mark.parametrize("load", [2000.0, 4000.0])
@pytest.mark.parametrize("acceleration", [-8.0, -4.0, 4.0, 8.0])
@pytest.mark.parametrize("source", ["omega", "speed"])
def test_load_and_slip_are_right_while_the_speed_changes(
    source: str, acceleration: float, load: float
) -> None:
    made = ramp(acceleration, load)
    held = {name: made[name] for name in (*SOURCES[source], "pressure", "camber")}
    _, told = estimate(calibration(), made["strain"], RATE, held)
    good = told.turn_valid
    assert good[2:].all()
    error = told.value["Fz"][good] - load
    assert np.abs(error).max() < 0.03 * load
    assert np.abs(error / told.std["Fz"][good]).max() < 3.0
    assert np.abs(told.value["kappa"][good] / told.std["kappa"][good]).max() < 3.0


PHASES = (0.0, 0.35, 0.7)
"""When in the turn a change begins: its share of a turn."""


def rising(t: float, begins: float, lasts: float) -> tuple[float, float]:
    """A share that rises evenly from 0 to 1, and its integral."""
    x = min(max(t - begins, 0.0), lasts)
    return x / lasts, 0.5 * x**2 / lasts + max(t - begins - lasts, 0.0)


def brake(speed: float, phase: float, t: float) -> dict[str, float]:
    """Slip ratio and deceleration come together within 0.15 s."""
    share, passed = rising(t, 0.4 + phase * 1.92 / speed, 0.15)
    return steadily(3500.0, speed - 8.0 * passed, -0.04 * share)


def pulse(speed: float, phase: float, t: float) -> dict[str, float]:
    """Three pulses of the brake a second."""
    x, w = max(t - 0.4 - phase / 3.0, 0.0), 6.0 * np.pi
    slip = 0.5 * (1.0 - np.cos(w * x))
    return steadily(3500.0, speed - 2.0 * (x - np.sin(w * x) / w), -0.05 * slip)


def begin(speed: float, phase: float, t: float) -> dict[str, float]:
    """A slip ratio that grows by 0.12 a second while the speed is held."""
    return steadily(3500.0, speed, -0.12 * max(t - 0.4 - phase * 1.92 / speed, 0.0))


def press(speed: float, phase: float, t: float) -> dict[str, float]:
    """A load that jumps."""
    return steadily(3000.0 if t < 0.4 + phase * 1.92 / speed else 4000.0, speed)


@cache
def transient(law: Any, speed: float, phase: float) -> dict[str, Any]:
    return play(0.85, partial(law, speed, phase))


@pytest.mark.parametrize("law", [brake, pulse, begin, press])
@pytest.mark.parametrize("source", ["omega", "speed"])
def test_the_interval_of_the_slip_ratio_holds_while_slip_or_load_change(
    source: str, law: Any
) -> None:
    apart, still = [], []
    for speed, phase in product((12.0, 20.0), PHASES):
        made = transient(law, speed, phase)
        held = {name: made[name] for name in (*SOURCES[source], "pressure", "camber")}
        held |= {name: np.full(made["Fz"].size, x) for name, x in ROAD.items()}
        features, told = estimate(calibration(), made["strain"], RATE, held)
        here = np.minimum((features.time * RATE).astype(int), made["Fz"].size - 1)
        good = told.turn_valid.copy()
        good[0] = False  # no turn before it
        apart += ((told.value["kappa"] - made["kappa"][here]) / told.std["kappa"])[good].tolist()
        still += told.std["kappa"][good & (features.time < 0.4)].tolist()
    assert 0.5 < np.abs(apart).max() < 3.0  # what is doubted is there, and is enough
    assert np.max(still) < 5e-4  # where nothing changes it is as narrow as ever
