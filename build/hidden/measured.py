"""Waveforms of a day on the rig, with hidden effects or without, as a campaign would give them.

The bulk of the benchmark does without files of 10 kHz: the solved trace is filtered, sampled and
disturbed as the measuring chain and the reading of a campaign would do it
(`tests/hidden/test_hidden_waveforms.py` holds both against each other).
"""

import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from zlib import crc32

import numpy as np

from hidden.plan import Day, day
from tirelib.core.arrays import FloatArray
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import CONDITIONS, N_PHI, Waveforms
from tirelib.rig.campaign import rig_header
from tirelib.rig.hidden import HIDDEN
from tirelib.rig.measure import gages
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import Trace, edges, trace
from tirelib.rig.shown import Shown
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import N_STRIPS, Condition, RigTire

CACHE = Path(__file__).parents[1] / "out" / "hidden"
MESH = (0.015, 0.15)
"""Coarser than the rig's own: the filtered waveforms differ by less than half a microstrain."""
TURNS = 4
RIG_SAMPLES = 50
"""Samples of a rig channel that a run's mean is of."""

Planted = Mapping[str, float]
"""Strength by effect."""


@dataclass(frozen=True)
class Plain:
    """A day and its solved states without any effect."""

    day: Day
    states: tuple[RigState, ...]


def plain(seed: int) -> Plain:
    """Return the day of a seed with its states, from the cache if they are there."""
    file, grid = CACHE / "plain" / f"{seed}.pkl", mesh(*MESH)
    if file.exists():
        stored: Plain = pickle.loads(file.read_bytes())
        return Plain(stored.day, tuple(replace(s, grid=grid) for s in stored.states))
    today = day(seed)
    states: dict[int, RigState] = {}
    order = sorted(range(len(today.really)), key=lambda k: today.really[k].load)
    for run in order:
        cond = today.really[run]
        near = min(states.values(), key=lambda s: _apart(s.condition, cond), default=None)
        states[run] = solve(today.tire, cond, near and _toward(near, cond), grid)
    made = Plain(today, tuple(states[k] for k in range(len(order))))
    slim = Plain(today, tuple(replace(s, grid=None) for s in made.states))
    keep(file, pickle.dumps(slim))
    return made


def _apart(a: Condition, b: Condition) -> float:
    return float(
        abs(np.log(a.load / b.load))
        + 2.0 * abs(np.log(a.pressure / b.pressure))
        + abs(a.speed - b.speed) / 40.0
    )


def _toward(state: RigState, cond: Condition) -> RigState:
    """Extrapolate a state to another load."""
    more = cond.load - state.condition.load
    return replace(
        state,
        control=state.control + more * state.by_load,
        height=state.height - more / state.stiffness,
    )


def keep(file: Path, content: bytes) -> None:
    """Write a file whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_bytes(content)
    part.rename(file)


def solved(base: Plain, planted: Planted, run: int) -> RigState:
    """Return the state of a run with effects."""
    today, start = base.day, base.states[run]
    tire: RigTire = today.tire
    for name, strength in planted.items():
        tire = HIDDEN[name].tire(tire, today.really[run], float(today.place[run]), strength)
    if tire is today.tire:
        return start
    lower = tire.free_radius - today.tire.free_radius
    return solve(tire, today.really[run], replace(start, height=start.height + lower), start.grid)


def traces(
    base: Plain, planted: Planted, progress: Callable[[str], None] | None = None
) -> tuple[list[RigState], list[Trace]]:
    """Return states and what perfect gages would show, run by run."""
    states, shown = [], []
    today = base.day
    for run in range(len(base.states)):
        state = solved(base, planted, run)
        seen = trace(state)
        for name, strength in planted.items():
            seen = HIDDEN[name].trace(
                Shown(
                    today.tire,
                    today.really[run],
                    state.omega,
                    seen,
                    edges(state)[0],
                    state.stiffness,
                    float(today.place[run]),
                    today.angle,
                ),
                strength,
            )
        states.append(state)
        shown.append(seen)
        if progress is not None:
            progress(f"run {run}")
    return states, shown


def waveforms(
    base: Plain, states: Sequence[RigState], shown: Sequence[Trace], kind: str
) -> Waveforms:
    """Return the mean waveforms of the runs; `kind` takes part in the seed of the noise."""
    today, chain, low_pass = base.day, base.day.chain, LowPass()
    rng = np.random.default_rng([today.seed, crc32(kind.encode()), 13])
    sensors, n = gages(today.tire, chain), len(states)
    strain = np.empty((n, N_STRIPS, N_PHI))
    angle_std = _angle_std(today, np.array([s.omega for s in states]))
    for run, (state, seen) in enumerate(zip(states, shown, strict=True)):
        step = state.omega / chain.gage_rate
        late = today.delay * state.omega + angle_std[run] * rng.standard_normal()
        swing = state.stiffness * chain.run_out * np.cos(seen.phi - sensors.run_out_angle)
        wave = (seen.strain + seen.by_load * swing[:, None]).T
        gain = sensors.gain * (1.0 + chain.gain_repeatability * rng.standard_normal(N_STRIPS))
        samples = TURNS * 2.0 * np.pi / step
        noise = chain.gage_noise * np.sqrt(N_PHI / samples)
        strain[run] = _filtered(wave, late, low_pass) * gain[:, None]
        strain[run] += _filtered(noise * rng.standard_normal((N_STRIPS, N_PHI)), 0.0, low_pass)
    filled = blank(today)
    return replace(
        filled, strain=strain, angle_std=angle_std, conditions=_conditions(today, states, rng)
    )


def blank(today: Day) -> Waveforms:
    """Return the campaign of a day without its numbers."""
    chain, n = today.chain, len(today.nominal)
    return Waveforms(
        header=rig_header(
            f"hidden-{today.seed}",
            today.tire,
            today.chain,
            "mean waveforms, made without files",
        ),
        strain=np.zeros((n, N_STRIPS, N_PHI)),
        run=np.arange(n),
        turns=np.full(n, TURNS),
        scatter=np.full(n, chain.gage_noise),
        angle_std=np.zeros(n),
        start=today.place * (n - 1) * chain.run_spacing,
        group=today.group,
        conditions={name: np.full(n, np.nan) for name in CONDITIONS},
        extra={},
        low_pass=LowPass(),
        left_out={},
    )


def _angle_std(today: Day, omega: FloatArray) -> FloatArray:
    """Return what the trigger's resolution leaves open of the angle zero [rad]."""
    out: FloatArray = omega / today.chain.gage_rate / np.sqrt(12.0 * (TURNS + 1))
    return out


def _filtered(wave: FloatArray, late: float, low_pass: LowPass) -> FloatArray:
    """Filter waves (n, points from -pi), move them later, and sample them without their mean."""
    spectrum = np.fft.rfft(wave, axis=1)[:, : N_PHI // 2] * (N_PHI / wave.shape[1])
    order = np.arange(N_PHI // 2)
    gain = np.exp(-0.5 * (low_pass.sigma(1.0) * order) ** 2 - 1j * order * late) * (order > 0)
    out: FloatArray = np.fft.irfft(spectrum * gain, N_PHI, axis=1)
    return out


def _conditions(
    today: Day, states: Sequence[RigState], rng: np.random.Generator
) -> dict[str, FloatArray]:
    chain, n = today.chain, len(states)

    def read(values: list[float], sigma: float) -> FloatArray:
        noise: FloatArray = sigma / np.sqrt(RIG_SAMPLES) * rng.standard_normal(n)
        return np.array(values) + noise

    found = {name: np.full(n, np.nan) for name in CONDITIONS}
    found["Fz"] = read([c.load for c in today.really], chain.force_noise)
    found["Fx"] = found["Fy"] = read([0.0] * n, chain.force_noise)
    found["Mz"] = read([0.0] * n, chain.moment_noise)
    found["pressure"] = read([c.pressure for c in today.really], chain.pressure_noise)
    found["speed"] = read([c.speed for c in today.really], chain.speed_noise)
    found["omega"] = read([s.omega for s in states], chain.omega_noise)
    found["loaded_radius"] = read([s.height for s in states], chain.radius_noise)
    for name in ("slip_angle", "camber"):
        found[name] = read([0.0] * n, chain.angle_noise)
    found["slip_ratio"] = read([0.0] * n, chain.slip_noise)
    return found
