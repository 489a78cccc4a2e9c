"""What an effect must show before it may take part in a diagnosis.

On a plan that varies everything: strength zero is the base model bit for bit, the argument is left
alone, the derivative at zero is finite, alive and linear, the whole range can be computed, no other
effect looks the same, and a planted strength is found again beside the base model's parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from scipy.linalg import subspace_angles

from tirelib.arrays import FloatArray
from tirelib.effects import CATALOGUE, Effect
from tirelib.effects.effect import Strength
from tirelib.errors import ParameterError, TirelibError
from tirelib.model.base import FREE, linearised, move, predict, values_of
from tirelib.model.chain import Change, Changes
from tirelib.model.state import Operating, State
from tirelib.parameters import Tire, read_tire

DEAD = 1e-7
"""Rms strain below which an effect at the end of its range is dead, [-]."""
TWIN = 30.0
"""Angle below which two effects are twins, [deg]."""
LINEAR = 0.02
"""What halving a trial step may leave of exact halving."""
RECOVERY = 0.2
"""Relative error of a planted strength that is found again."""
_STEPS = 8
_SIDE = 0.06


@dataclass(frozen=True, slots=True)
class Plan:
    """Operating points on which effects are compared.

    Attributes
    ----------
    points : Operating
    lateral : shape (n_points,), [m]
        Gage of each point, left positive.
    """

    points: Operating
    lateral: FloatArray

    def changes(self, *more: tuple[str, Change]) -> Changes:
        """Return changes that put the gages in place, then others; points may be repeated."""

        def place(state: State) -> State:
            return state.but(lateral=np.resize(self.lateral, len(state.conditions)))

        return [("constants", place), *more]


def reference_plan(tire: Tire) -> Plan:
    """Return 5 loads x 3 pressures x 4 speeds of free rolling, and slip and camber at the sides."""
    grid = np.meshgrid(
        [1500.0, 2750.0, 4000.0, 5250.0, 6500.0], [1.6e5, 2.1e5, 2.6e5], [5.0, 15.0, 25.0, 35.0],
        indexing="ij",
    )  # fmt: skip
    # six runs with slip angle, camber or slip ratio, each seen by the left and the right gage
    slip = np.deg2rad([3.0, -3.0, 0.0, 0.0, 0.0, 0.0])
    camber = np.deg2rad([0.0, 0.0, 4.0, -4.0, 0.0, 0.0])
    ratio = np.array([0.0, 0.0, 0.0, 0.0, 0.03, -0.03])
    twice = [np.repeat(column, 2) for column in (slip, camber, ratio)]
    loads = np.tile([3000.0, 3000.0, 5000.0, 5000.0], 3)
    load = np.concatenate([grid[0].ravel(), loads])
    speed = np.concatenate([grid[2].ravel(), np.full(12, 15.0)])
    alpha, gamma, kappa = (np.concatenate([np.zeros(60), column]) for column in twice)
    n = load.size
    points = Operating(
        load=load,
        pressure=np.concatenate([grid[1].ravel(), np.full(12, 2.1e5)]),
        omega=speed / tire.ring_radius,
        speed=speed,
        camber=gamma,
        slip_angle=alpha,
        slip_ratio=kappa,
        side_force=-load * (10.0 * alpha - 0.5 * gamma),
        drive_force=load * 15.0 * kappa,
        order=(np.arange(n) * 29 % n) / (n - 1.0),
        temperature=np.full(n, np.nan),
    )
    return Plan(points, np.concatenate([np.zeros(60), np.tile([-_SIDE, _SIDE], 6)]))


@dataclass(frozen=True, slots=True)
class Registration:
    """Report on one effect.

    Attributes
    ----------
    effect : Effect
    faults : tuple of str
        Why it may not take part; empty if it may.
    signature : float, [-]
        Rms strain at the end of its range, from the tangent.
    survives : float, [-]
        Share of the signature that the base model's parameters cannot imitate.
    twins : tuple of (name, degrees)
        Effects that look nearly the same, nearest first; a diagnosis may not tell them apart.
    planted, recovered : float
        Strength of the trial and what was found, in the effect's unit; the component that is
        worst if there are several. NaN where no trial was made.
    """

    effect: Effect
    faults: tuple[str, ...]
    signature: float
    survives: float
    twins: tuple[tuple[str, float], ...]
    planted: float
    recovered: float

    @property
    def accepted(self) -> bool:
        """Whether the effect may take part."""
        return not self.faults


def register(
    effect: Effect,
    others: Mapping[str, Effect] = CATALOGUE,
    *,
    tire: Tire | None = None,
    plan: Plan | None = None,
) -> Registration:
    """Check an effect against the base model and the other effects.

    Parameters
    ----------
    effect : Effect
        Of the strain chain; `others` may hold it.
    others : mapping
        Effects to compare it with.
    tire : Tire
        Table 6-1 of the dissertation if none is given.
    plan : Plan
        `reference_plan` if none is given.

    Raises
    ------
    ParameterError
        If the effect belongs to the brush.
    """
    if effect.hook == "brush":
        raise ParameterError(
            f"effect {effect.name!r}: stage brush does not act on strain; check it with the brush"
        )
    tire = tire or read_tire("table-6-1").tire
    bench = _Bench(tire, plan or reference_plan(tire))
    where = f"effect {effect.name!r}, {effect.origin}"
    try:
        faults = [f"{where}: {fault}" for fault in _law_faults(effect, bench)]
        tangents = bench.tangents(effect)
    except TirelibError as error:
        text = str(error)
        return _refused(effect, text if effect.name in text else f"{where}: {text}")
    signature = float(np.sqrt(np.mean(tangents**2)))
    if effect.untestable:
        return Registration(effect, tuple(faults), signature, 0.0, (), np.nan, np.nan)
    if signature < DEAD:
        return _refused(
            effect,
            f"{where}: has no influence on the strain (rms {1e6 * signature:.2g} ustrain at "
            f"{effect.toward:g} {effect.unit}); correct the law, its stage or its range",
        )
    rest = bench.beyond_base(tangents)
    survives = float(np.linalg.norm(rest) / np.linalg.norm(tangents))
    planted, recovered = (np.nan, np.nan) if faults else _plant(effect, bench)
    if not faults and not abs(recovered - planted) <= RECOVERY * abs(planted):
        faults.append(
            f"{where}: {planted:.4g} {effect.unit} planted, {recovered:.4g} found; the base "
            f"model's parameters imitate all but {survives:.1%} of it"
        )
    twins = _twins(effect, rest, others, bench)
    return Registration(effect, tuple(faults), signature, survives, twins, planted, recovered)


def _refused(effect: Effect, fault: str) -> Registration:
    return Registration(effect, (fault,), np.nan, np.nan, (), np.nan, np.nan)


class _Bench:
    """The base model on a plan, and what changes to it do."""

    def __init__(self, tire: Tire, plan: Plan) -> None:
        self.values = values_of(tire)
        self.plan = plan
        linear = linearised(self.values, plan.points, FREE, plan.changes())
        self.base = linear.waveform
        slopes = linear.waveform_slopes.reshape(len(FREE), -1)
        self.basis = np.linalg.qr((slopes / np.linalg.norm(slopes, axis=1)[:, None]).T)[0]

    def waveform(self, *changes: tuple[str, Change]) -> FloatArray:
        """Return the waveform with changes."""
        state = predict(self.values, self.plan.points, self.plan.changes(*changes))
        return state.wave

    def tangents(self, effect: Effect) -> FloatArray:
        """Return derivatives at zero times the end of the range, (components, points x angles)."""
        rows = [
            (self.waveform(effect.at(trial)) - self.base).ravel() * (effect.toward / effect.step)
            for trial in effect.trials
        ]
        return np.stack(rows)

    def beyond_base(self, rows: FloatArray) -> FloatArray:
        """Return what the base model's parameters cannot imitate."""
        out: FloatArray = rows - (rows @ self.basis) @ self.basis.T
        return out


def _law_faults(effect: Effect, bench: _Bench) -> list[str]:
    """Return which laws of an effect are broken, in words."""
    faults = []
    for k, trial in enumerate(effect.trials):
        if not np.array_equal(bench.waveform(effect.at(effect.along(k, 0.0))), bench.base):
            faults.append("strength zero is not the base model bit for bit; correct the law")
        altered = _altered(effect, trial, bench)
        if altered:
            faults.append(
                f"its law alters {', '.join(altered)} of its argument; make a new array and "
                "return state.but(...)"
            )
            continue
        whole = bench.waveform(effect.at(trial)) - bench.base
        half = bench.waveform(effect.at(effect.along(k, 0.5 * effect.step))) - bench.base
        size = float(np.sqrt(np.mean(whole**2)))
        if size > DEAD * effect.step / effect.toward:
            off = float(np.sqrt(np.mean((2.0 * half - whole) ** 2))) / size
            if off > LINEAR:
                faults.append(
                    f"no derivative at zero: half a step of {effect.step:g} {effect.unit} leaves "
                    f"{off:.0%} of exact halving; choose the strength so that small ones act in "
                    "proportion (a width squared, not a width)"
                )
        for end in (effect.low, effect.high):
            try:
                wave = bench.waveform(effect.at(effect.along(k, end)))
            except TirelibError as error:
                faults.append(f"cannot be computed at {end:g} {effect.unit}: {error}")
            else:
                if not np.isfinite(wave).all():
                    faults.append(f"the strain is not finite at {end:g} {effect.unit}")
    return list(dict.fromkeys(faults))


def _altered(effect: Effect, trial: Strength, bench: _Bench) -> list[str]:
    """Return fields of its argument that a law changes in place."""
    names: list[str] = []

    def watched(state: State) -> State:
        before = {
            field.name: value.copy()
            for field in fields(State)
            if isinstance(value := getattr(state, field.name), np.ndarray)
        }
        after: State = effect.at(trial)[1](state)
        names.extend(
            name
            for name, value in before.items()
            if not np.array_equal(value, getattr(state, name), equal_nan=True)
        )
        return after

    try:
        bench.waveform((effect.hook, watched))
    except ValueError as error:
        if "read-only" not in str(error):
            raise
        names.append("a read-only array")
    return list(dict.fromkeys(names))


def _twins(
    effect: Effect, rest: FloatArray, others: Mapping[str, Effect], bench: _Bench
) -> tuple[tuple[str, float], ...]:
    found = []
    for other in others.values():
        if other.name == effect.name or other.hook == "brush" or other.untestable:
            continue
        rows = bench.beyond_base(bench.tangents(other))
        if not np.any(rows):
            continue
        angle = float(np.rad2deg(subspace_angles(rest.T, rows.T).min()))
        if angle < TWIN:
            found.append((other.name, angle))
    return tuple(sorted(found, key=lambda pair: pair[1]))


def _plant(effect: Effect, bench: _Bench) -> tuple[float, float]:
    """Return a planted strength and what Gauss-Newton finds beside the base parameters."""
    trials = []
    for k in range(effect.components):
        planted = effect.toward / 3.0
        data = bench.waveform(effect.at(effect.along(k, planted)))
        try:
            trials.append((planted, _recover(effect, k, data, bench)))
        except TirelibError:
            trials.append((planted, np.nan))
    return max(trials, key=lambda pair: np.nan_to_num(abs(pair[1] - pair[0]), nan=np.inf))


def _recover(effect: Effect, component: int, data: FloatArray, bench: _Bench) -> float:
    strength, z = 0.0, np.zeros(len(FREE))
    for _ in range(_STEPS):
        values = move(bench.values, z)
        change = effect.at(effect.along(component, strength))
        linear = linearised(values, bench.plan.points, FREE, bench.plan.changes(change))
        trial = effect.at(effect.along(component, strength + effect.step))
        moved = predict(values, bench.plan.points, bench.plan.changes(trial)).wave
        slope = (moved - linear.waveform) / effect.step
        columns = np.stack([*linear.waveform_slopes, slope]).reshape(len(FREE) + 1, -1)
        norm = np.linalg.norm(columns, axis=1)
        rest = (data - linear.waveform).ravel()
        step = np.linalg.lstsq((columns / norm[:, None]).T, rest, rcond=1e-10)[0] / norm
        z = z + np.clip(step[:-1], -0.5, 0.5)
        new = float(np.clip(strength + step[-1], effect.low, effect.high))
        done = abs(new - strength) < 1e-3 * effect.scale
        strength = new
        if done:
            break
    return strength
