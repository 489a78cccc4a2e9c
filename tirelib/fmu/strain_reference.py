"""Reference signals of ``StrainTire.fmu``: made-up strain in the middle of the calibrated range.

Three good turns, two lost samples, a lost frame, two good turns, then a wheel that stands: an
estimate, a bridged gap, a gap and the watchdog are all met. What is expected is what the library
says, not what an FMU said.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.estimators.calibration import Calibration
from tirelib.fmu.reference import Reference, contact_strain
from tirelib.fmu.variables import inputs, outputs
from tirelib.fmu.wheel import Wheel
from tirelib.stream.estimator import StreamEstimator

TURNS, STILL = 6.4, 2.3
"""Turns that roll, and what would be turns that stand."""
RESOLUTION = 1e-7
"""Strain is written in steps of this."""
SLIP = 0.01
"""Slip ratio of the made-up wheel; at zero, rounding would be all that is compared."""
WAVE = 0.06
"""How much the contact grows and shrinks, relative, over two turns."""
_PASSES = 4


@dataclass(frozen=True, slots=True)
class _Scene:
    """What the made-up strain is made of; SI."""

    half: float
    dip: float
    tension: float
    omega: float
    speed: float
    pressure: float
    imbalance: float


def strain_reference(
    calibration: Calibration, rate: float, samples: int, *, buffered: bool = False
) -> Reference:
    """Return input and expected output of an FMU with these properties."""
    scene = _fitted(calibration, rate)
    scene = replace(scene, omega=scene.omega * (1.0 + SLIP))
    strain = _strain(calibration, rate, scene, TURNS)
    still = int(STILL * 2.0 * math.pi / scene.omega * rate)
    strain = np.concatenate((strain, np.repeat(strain[:, -1:], still, axis=1)), axis=1)
    turn = int(2.0 * math.pi / scene.omega * rate)
    strain[:, int(2.6 * turn) : int(2.6 * turn) + 2] = np.nan
    counts = _counts(strain.shape[1], samples, buffered)
    firsts = np.concatenate(([0], np.cumsum(counts)))
    step = samples / rate
    given = _inputs(calibration, scene, strain, counts, samples, buffered=buffered)
    lost = (firsts[:-1] > 3.40 * turn) & (firsts[:-1] < 3.44 * turn)
    given["frame_valid"] = np.where(lost, 0.0, 1.0)
    wheel = Wheel(calibration, rate, samples)
    names = [v.name for v in outputs(calibration.lateral) if v.kind != "String"]
    rows = [_row(wheel)]
    strains = [v.name for v in inputs(calibration.lateral, samples) if v.name[:7] == "strain_"]
    frames = np.stack([given[name] for name in strains], axis=1)
    for at in range(counts.size - 1):
        wheel.step(
            frames[at].tolist(), step, not lost[at], scene.speed, scene.pressure, 0.0, scene.omega,
            count=int(counts[at]) if buffered else None,
        )  # fmt: skip
        rows.append(_row(wheel))
    table = np.array(rows)
    return Reference(step, given, {name: table[:, i] for i, name in enumerate(names)})


def _row(wheel: Wheel) -> list[float]:
    values, others = wheel.outputs()
    return [*values, *(float(value) for value in others if not isinstance(value, str))]


def _counts(n: int, samples: int, buffered: bool) -> FloatArray:
    """Return how many samples each step brings; in a buffered FMU they come in fits and starts."""
    pattern = np.array([samples, 0, samples, max(1, samples // 2)] if buffered else [samples])
    steps = int(n / pattern.mean())
    found: FloatArray = np.resize(pattern, steps)
    return found[: int(np.searchsorted(np.cumsum(found), n, side="right"))]


def _inputs(
    calibration: Calibration, scene: _Scene, strain: FloatArray, counts: FloatArray, samples: int,
    *, buffered: bool,
) -> dict[str, FloatArray]:  # fmt: skip
    n = counts.size
    frames = np.zeros((n, samples, strain.shape[0]))
    first = 0
    for at, count in enumerate(counts):
        frames[at, :count] = strain[:, first : first + count].T
        first += int(count)
    flat = frames.reshape(n, -1)
    held = {"speed": scene.speed, "pressure": scene.pressure, "camber": 0.0, "omega": scene.omega}
    given: dict[str, FloatArray] = {}
    for column, variable in enumerate(inputs(calibration.lateral, samples, buffered=buffered)):
        if variable.name in held:
            given[variable.name] = np.full(n, held[variable.name])
        elif variable.name == "samples":
            given[variable.name] = counts.astype(np.float64)
        elif variable.name != "frame_valid":
            given[variable.name] = flat[:, column]
    return given


def _middle(calibration: Calibration, name: str, otherwise: float) -> float:
    """Return the middle of the calibrated range of a regressor, where there is one."""
    for ranges in calibration.chains[-1].guards.values():
        for known in ranges:
            if known.name == name and math.isfinite(known.low + known.high):
                return 0.5 * (known.low + known.high)
    return otherwise


def _fitted(calibration: Calibration, rate: float) -> _Scene:
    """Return a scene whose features lie in the middle of the calibrated range."""
    angle = _middle(calibration, "contact_angle", 0.4)
    compression = abs(_middle(calibration, "compression", 0.3))
    traction = _middle(calibration, "traction", 0.0)
    tension = _middle(calibration, "tension", 8e-3)
    speed = _middle(calibration, "speed", 20.0)
    pressure = _middle(calibration, "pressure", 2.2e5)
    scene = _Scene(
        0.5 * angle,
        compression * tension,
        tension,
        min(speed / 0.3, 0.01 * rate),
        speed,
        pressure,
        -0.5 * traction / compression,
    )
    for _ in range(_PASSES):
        estimator = StreamEstimator(calibration, rate)
        strain = _strain(calibration, rate, scene, 3.4)
        estimator.push(strain, speed=speed, pressure=pressure, camber=0.0)
        latest = estimator.latest
        if latest is None:
            break
        seen = latest.features
        tp = float(np.mean(seen.tp[0]))
        found = (
            float(np.mean(seen.contact_angle[0])),
            -0.5 * float(np.mean(seen.cp1[0] + seen.cp2[0])) / tp,
            tp,
        )
        if not all(math.isfinite(x) and x > 0.0 for x in found):
            break
        radius = float(latest.estimates.radius[0])
        scene = replace(
            scene,
            half=scene.half * angle / found[0],
            dip=scene.dip * compression / found[1],
            tension=scene.tension * tension / found[2],
            omega=speed / radius if 0.1 < radius < 1.0 else scene.omega,
        )
    return scene


def _strain(calibration: Calibration, rate: float, scene: _Scene, turns: float) -> FloatArray:
    n = int(turns * 2.0 * math.pi / scene.omega * rate)
    angle: FloatArray = np.pi + np.arange(n) * np.float64(scene.omega / rate)
    tilt = 0.02
    half = scene.half * (1.0 + WAVE * np.sin(0.5 * angle + 0.7))
    found = contact_strain(
        angle, half, calibration.lateral, tilt, scene.dip, scene.tension, scene.imbalance
    )  # fmt: skip
    return np.round(found / RESOLUTION) * RESOLUTION
