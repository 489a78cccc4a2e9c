"""Reference signals of ``StrainTire.fmu``: strain in the middle of the calibrated range.

It is that of the turn which the calibration carries, again and again; where it carries none (it was
made by an older version, or had no valid turn), strain is made up, and may lie out of range. Three
good turns, two lost samples, a lost frame, two good turns, then a wheel that stands: an estimate, a
bridged gap, a gap and the watchdog are all met. What is expected is what the library says, not what
an FMU said.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.held import HELD
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.reference_turn import ReferenceTurn
from tirelib.fmu.reference import Reference, contact_strain
from tirelib.fmu.strain_variables import inputs, outputs
from tirelib.fmu.wheel import Wheel
from tirelib.stream.reference import NumpyEstimator

TURNS, STILL = 6.4, 2.3
"""Number of rolling turns, and the duration of standstill in turns."""
RESOLUTION = 1e-7
"""Strain is written in steps of this."""
SLIP = 0.01
"""Slip ratio of the made-up wheel; at zero, rounding would be all that is compared."""
WAVE = 0.06
"""How much a made-up contact grows and shrinks, relative, over two turns."""
BREATH = 0.01
"""As `WAVE`, of the measured turn."""
PHASE = 0.7
TILT = 0.02
"""Relative growth of a made-up contact from the centre to the outermost gage."""
LARGEST_ANGLE_STEP = 0.01
"""Largest wheel angle between two samples, [rad]."""
_PASSES = 4


@dataclass(frozen=True, slots=True)
class _Scene:
    """The rolling tire of the reference, SI; `strain` by growing wheel angle, 0 over the road."""

    omega: float
    speed: float
    pressure: float
    camber: float
    strain: Callable[[FloatArray], FloatArray]


def strain_reference(
    calibration: Calibration,
    rate: float,
    samples: int,
    *,
    buffered: bool = False,
    lose: bool = True,
) -> Reference:
    """Return input and expected output of an FMU with these properties.

    `lose` makes the two lost samples NaN. Arrays cannot have them: importers interpolate those
    (FMPy), and zero times NaN loses the next sample too.
    """
    turn = calibration.reference
    scene = _made_up(calibration, rate) if turn is None else _measured(turn, rate)
    strain = _strain(scene, rate, TURNS)
    still = int(STILL * 2.0 * math.pi / scene.omega * rate)
    strain = np.concatenate((strain, np.repeat(strain[:, -1:], still, axis=1)), axis=1)
    period = int(2.0 * math.pi / scene.omega * rate)
    if lose:
        strain[:, int(2.6 * period) : int(2.6 * period) + 2] = np.nan
    counts = _counts(strain.shape[1], samples, buffered)
    firsts = np.concatenate(([0], np.cumsum(counts)))
    step = samples / rate
    given = _inputs(calibration, scene, strain, counts, samples, buffered=buffered)
    lost = (firsts[:-1] > 3.40 * period) & (firsts[:-1] < 3.44 * period)
    given["frame_valid"] = np.where(lost, 0.0, 1.0)
    wheel = Wheel(calibration, rate, samples)
    names = [v.name for v in outputs(calibration.lateral) if v.kind != "String"]
    rows = [_row(wheel)]
    strains = [v.name for v in inputs(calibration.lateral, samples) if v.name[:7] == "strain_"]
    frames = np.stack([given[name] for name in strains], axis=1)
    conditions = [getattr(scene, name, math.nan) for name in HELD]
    for at in range(counts.size - 1):
        wheel.step(
            frames[at].tolist(),
            step,
            not lost[at],
            *conditions,
            count=int(counts[at]) if buffered else None,
        )
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
    calibration: Calibration,
    scene: _Scene,
    strain: FloatArray,
    counts: FloatArray,
    samples: int,
    *,
    buffered: bool,
) -> dict[str, FloatArray]:
    n = counts.size
    frames = np.zeros((n, samples, strain.shape[0]))
    first = 0
    for at, count in enumerate(counts):
        frames[at, :count] = strain[:, first : first + count].T
        first += int(count)
    flat = frames.reshape(n, -1)
    held = {name: getattr(scene, name, math.nan) for name in HELD}
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


def _measured(turn: ReferenceTurn, rate: float) -> _Scene:
    """Return the measured turn, again and again; slowed down where the rate asks for it."""
    slow = min(1.0, LARGEST_ANGLE_STEP * rate / turn.omega)

    def strain(angle: FloatArray) -> FloatArray:
        return turn.at(angle + BREATH * np.sin(0.5 * angle + PHASE) * np.sin(angle))

    return _Scene(slow * turn.omega, slow * turn.speed, turn.pressure, turn.camber, strain)


@dataclass(frozen=True, slots=True)
class _Shape:
    """Shape of the made-up strain; SI."""

    half: float
    dip: float
    tension: float
    imbalance: float

    def strain(self, angle: FloatArray, lateral: tuple[float, ...]) -> FloatArray:
        half = self.half * (1.0 + WAVE * np.sin(0.5 * angle + PHASE))
        return contact_strain(angle, half, lateral, TILT, self.dip, self.tension, self.imbalance)


def _made_up(calibration: Calibration, rate: float) -> _Scene:
    """Return a scene whose features lie in the middle of the calibrated range."""
    angle = _middle(calibration, "contact_angle", 0.4)
    compression = abs(_middle(calibration, "compression", 0.3))
    traction = _middle(calibration, "traction", 0.0)
    tension = _middle(calibration, "tension", 8e-3)
    speed = _middle(calibration, "speed", 20.0)
    pressure = _middle(calibration, "pressure", 2.2e5)
    shape = _Shape(0.5 * angle, compression * tension, tension, -0.5 * traction / compression)
    omega = min(speed / 0.3, LARGEST_ANGLE_STEP * rate)

    def scene() -> _Scene:
        return _Scene(
            omega, speed, pressure, 0.0, partial(shape.strain, lateral=calibration.lateral)
        )

    for _ in range(_PASSES):
        estimator = NumpyEstimator(calibration, rate)
        strain = _strain(scene(), rate, 3.4)
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
        omega = speed / radius if 0.1 < radius < 1.0 else omega
        shape = replace(
            shape,
            half=shape.half * angle / found[0],
            dip=shape.dip * compression / found[1],
            tension=shape.tension * tension / found[2],
        )
    omega *= 1.0 + SLIP
    return scene()


def _strain(scene: _Scene, rate: float, turns: float) -> FloatArray:
    n = int(turns * 2.0 * math.pi / scene.omega * rate)
    angle: FloatArray = np.pi + np.arange(n) * np.float64(scene.omega / rate)
    return np.round(scene.strain(angle) / RESOLUTION) * RESOLUTION
