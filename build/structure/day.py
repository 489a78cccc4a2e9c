"""A campaign's day: its plan, its set points, and how frames become measured waveforms.

The errors are those of the rolling continuum's laboratory (`continuum.measure`): each seed draws
their sizes. The solved trace is filtered, sampled and disturbed as the reading of a campaign would
do it, without files of 10 kHz (`hidden.measured`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from continuum.campaign import SPACING
from continuum.campaign import plan as straight_plan
from continuum.measure import Laboratory, laboratory, settled
from continuum.tire import Condition

from structure.family import LATERAL, PHI, Array, Frame, Setting
from tirelib.campaign import CampaignHeader, TireGeometry, Tolerance
from tirelib.core.arrays import IntArray
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import CONDITIONS, N_PHI, Waveforms

TURNS = 4
RIG_SAMPLES = 50
"""Samples of a rig channel that a run's mean is of."""
PLANS = (66, 66, 15)
"""Runs of a campaign: two thirds of the seeds have the long plan."""
PLAIN_TIRES = (*range(2, 60, 3), *range(302, 360, 3), *(s for s in range(400, 430) if s % 3 < 2))
"""Seeds of the plain tires of the library's table: forty of a family have plans of 15 runs, twenty
of 66."""


@dataclass(frozen=True)
class Day:
    """Nominal conditions in order of time, what the rig held, and the errors of the day.

    Attributes
    ----------
    group : shape (n_runs,)
        Equal for equal set points.
    delay : float
        Delay of the gages against the trigger [s].
    angle : float
        Wheel angle of a mark on the tire [rad].
    """

    lab: Laboratory
    nominal: tuple[Condition, ...]
    settings: tuple[Setting, ...]
    group: IntArray
    delay: float
    angle: float


def day(family: int, seed: int) -> Day:
    """Return the day of a family's seed; no two families share one."""
    own = 1_000_000 * family + seed
    lab, nominal = laboratory(own), straight_plan(PLANS[seed % len(PLANS)], own)
    rng = np.random.default_rng([own, 21])
    held = [settled(lab, c, run) for run, c in enumerate(nominal)]
    place = np.arange(len(nominal)) / (len(nominal) - 1)
    every = list(dict.fromkeys(nominal))
    return Day(
        lab,
        nominal,
        tuple(
            Setting(c.load, c.pressure, c.speed, float(o)) for c, o in zip(held, place, strict=True)
        ),
        np.array([every.index(c) for c in nominal]),
        float(rng.uniform(-1e-4, 1e-4)),
        float(rng.uniform(-np.pi, np.pi)),
    )


def measured(today: Day, frames: Sequence[Frame], geometry: TireGeometry) -> Waveforms:
    """Return the mean waveforms of a day; its random numbers are the same whatever the frames."""
    lab, n, low_pass = today.lab, len(frames), LowPass()
    rng = np.random.default_rng([lab.seed, 22])
    omega = np.array([f.omega for f in frames])
    angle_std = omega / lab.rate / np.sqrt(12.0 * (TURNS + 1))
    strain = np.empty((n, LATERAL.size, N_PHI))
    for run, frame in enumerate(frames):
        late = today.delay * frame.omega + angle_std[run] * rng.standard_normal()
        swing = frame.stiffness * lab.run_out * np.cos(PHI - lab.run_out_angle)
        wave = (frame.strain + frame.by_load * swing[:, None]).T
        gain = lab.gain * (1.0 + lab.gain_repeat * rng.standard_normal(LATERAL.size))
        noise = lab.noise * np.sqrt(N_PHI * frame.omega / (TURNS * 2.0 * np.pi * lab.rate))
        strain[run] = _filtered(wave, late, low_pass) * gain[:, None]
        strain[run] += _filtered(noise * rng.standard_normal(strain[run].shape), 0.0, low_pass)
    return Waveforms(
        header=_header(today, geometry),
        strain=strain,
        run=np.arange(n),
        turns=np.full(n, TURNS),
        scatter=np.full(n, lab.noise),
        angle_std=angle_std,
        start=np.arange(n) * SPACING,
        group=today.group,
        conditions=_conditions(today, frames, rng),
        extra={},
        low_pass=low_pass,
        left_out={},
    )


def _filtered(wave: Array, late: float, low_pass: LowPass) -> Array:
    """Filter waves (n, points from -pi), move them later, and sample them without their mean."""
    spectrum = np.fft.rfft(wave, axis=1)[:, : N_PHI // 2] * (N_PHI / wave.shape[1])
    order = np.arange(N_PHI // 2)
    gain = np.exp(-0.5 * (low_pass.sigma(1.0) * order) ** 2 - 1j * order * late) * (order > 0)
    return np.asarray(np.fft.irfft(spectrum * gain, N_PHI, axis=1))


def _conditions(today: Day, frames: Sequence[Frame], rng: np.random.Generator) -> dict[str, Array]:
    lab, n = today.lab, len(frames)

    def read(values: list[float], sigma: float) -> Array:
        return np.asarray(values + sigma / np.sqrt(RIG_SAMPLES) * rng.standard_normal(n))

    zero = [0.0] * n
    found = {name: np.full(n, np.nan) for name in CONDITIONS}
    found["Fz"] = read([s.load for s in today.settings], lab.force_noise)
    found["Fx"], found["Fy"] = read(zero, lab.force_noise), read(zero, lab.force_noise)
    found["Mz"] = read(zero, 0.5)
    found["pressure"] = read([s.pressure for s in today.settings], lab.pressure_noise)
    found["speed"] = read([s.speed for s in today.settings], lab.speed_noise)
    found["omega"] = read([f.omega for f in frames], 0.01)
    found["loaded_radius"] = read([f.height for f in frames], lab.radius_noise)
    found["slip_angle"], found["camber"] = read(zero, 2e-4), read(zero, 2e-4)
    found["slip_ratio"] = read(zero, 3e-4)
    return found


def _header(today: Day, geometry: TireGeometry) -> CampaignHeader:
    lab = today.lab
    return CampaignHeader(
        name=geometry.name,
        axes="iso",
        tire=geometry,
        gage_lateral=tuple(float(y) for y in LATERAL),
        rate=lab.rate,
        strain_unit="ustrain",
        tolerance=Tolerance(
            load=lab.load_error,
            pressure=lab.pressure_error,
            speed=lab.speed_error,
            gain=lab.gain_repeat,
        ),
        rig_name="simulated, mean waveforms made without files",
    )
