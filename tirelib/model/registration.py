"""Tests that an effect must pass before it may take part in a diagnosis.

On a plan that varies everything: strength zero is the base model bit for bit, the argument is left
alone, the derivative at zero is finite, alive and linear, the whole range can be computed, no other
effect looks the same, and a planted strength is found again beside the base model's parameters.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from scipy.linalg import subspace_angles

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import FormatError, TirelibError
from tirelib.core.parameters import Tire, read_tire
from tirelib.effects import CATALOGUE, Effect
from tirelib.effects.effect import Strength
from tirelib.effects.load import all_effects
from tirelib.model.brush_bench import BrushBench
from tirelib.model.strain_bench import Plan, StrainBench, reference_plan

TWIN = 30.0
"""Angle below which two effects are twins, [deg]."""
LINEAR = 0.02
"""Allowed deviation from exact halving when a trial step is halved."""
RECOVERY = 0.2
"""Relative error of a planted strength that is found again."""
_STEPS = 8


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
        Effects that look nearly the same, nearest first; a diagnosis may not be able to separate
        them.
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
        Effect of the strain chain or the brush; `others` may hold it.
    others : mapping
        Effects to compare it with.
    tire : Tire
        Table 6-1 of the dissertation if none is given.
    plan : Plan
        `reference_plan` if none is given. Effects of the brush have their own
        (`tirelib.model.brush_bench`).
    """
    bench: Bench
    if effect.hook == "brush":
        bench = BrushBench()
    else:
        tire = tire or read_tire("table-6-1").tire
        bench = StrainBench(tire, plan or reference_plan(tire))
    return _registered(effect, others, bench)


def _registered(effect: Effect, others: Mapping[str, Effect], bench: "Bench") -> Registration:
    where = f"effect {effect.name!r}, {effect.origin}"
    try:
        faults = [f"{where}: {fault}" for fault in _law_faults(effect, bench)]
        tangents = _tangents(effect, bench)
    except TirelibError as error:
        text = str(error)
        return _refused(effect, text if effect.name in text else f"{where}: {text}")
    signature = float(np.sqrt(np.mean(tangents**2)))
    if effect.untestable:
        return Registration(effect, tuple(faults), signature, 0.0, (), np.nan, np.nan)
    if signature < bench.dead:
        return _refused(
            effect,
            f"{where}: has no influence on {bench.words(signature)} at {effect.toward:g} "
            f"{effect.unit}); correct the law, its stage or its range",
        )
    rest = _beyond_base(tangents, bench)
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


class Bench(Protocol):
    """A base model on a plan that varies everything, and what changes to it do.

    Attributes
    ----------
    base : shape (...)
        What it predicts without any change.
    basis : shape (n, n_free)
        Orthonormal, spans what the base model's parameters can do.
    dead : float
        Rms change at the end of its range below which an effect is dead.
    """

    base: FloatArray
    basis: FloatArray
    dead: float

    def acts(self, effect: Effect) -> bool:
        """Whether an effect is one of this chain."""

    def waveform(self, *changes: Any) -> FloatArray:
        """Return what the model predicts with changes, shaped as `base`."""

    def slopes(self, z: FloatArray, *changes: Any) -> tuple[FloatArray, FloatArray]:
        """Return the prediction with parameters moved by z, and its slopes by them."""

    def moved(self, z: FloatArray, *changes: Any) -> FloatArray:
        """Return the prediction with parameters moved by z and changes."""

    def words(self, size: float) -> str:
        """Return a sentence on the quantities that an effect hardly changes, with the change."""


def _tangents(effect: Effect, bench: Bench) -> FloatArray:
    """Return derivatives at zero times the end of the range, (components, n)."""
    rows = [
        (bench.waveform(effect.at(trial)) - bench.base).ravel() * (effect.toward / effect.step)
        for trial in effect.trials
    ]
    return np.stack(rows)


def _beyond_base(rows: FloatArray, bench: Bench) -> FloatArray:
    """Return what the base model's parameters cannot imitate."""
    out: FloatArray = rows - (rows @ bench.basis) @ bench.basis.T
    return out


def _law_faults(effect: Effect, bench: Bench) -> list[str]:
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
        if size > bench.dead * effect.step / effect.toward:
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
                    faults.append(f"what is predicted is not finite at {end:g} {effect.unit}")
    return list(dict.fromkeys(faults))


def _altered(effect: Effect, trial: Strength, bench: Bench) -> list[str]:
    """Return fields of its argument that a law changes in place."""
    names: list[str] = []

    def watched(state: Any) -> Any:
        before = {
            field.name: value.copy()
            for field in fields(type(state))
            if isinstance(value := getattr(state, field.name), np.ndarray)
        }
        after = effect.at(trial)[1](state)
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
    effect: Effect, rest: FloatArray, others: Mapping[str, Effect], bench: Bench
) -> tuple[tuple[str, float], ...]:
    found = []
    for other in others.values():
        if other.name == effect.name or not bench.acts(other) or other.untestable:
            continue
        rows = _beyond_base(_tangents(other, bench), bench)
        if not np.any(rows):
            continue
        angle = float(np.rad2deg(subspace_angles(rest.T, rows.T).min()))
        if angle < TWIN:
            found.append((other.name, angle))
    return tuple(sorted(found, key=lambda pair: pair[1]))


def _plant(effect: Effect, bench: Bench) -> tuple[float, float]:
    """Return a planted strength, and the one found by Gauss-Newton with the base parameters."""
    trials = []
    for k in range(effect.components):
        planted = effect.toward / 3.0
        data = bench.waveform(effect.at(effect.along(k, planted)))
        try:
            trials.append((planted, _recover(effect, k, data, bench)))
        except TirelibError:
            trials.append((planted, np.nan))
    return max(trials, key=lambda pair: np.nan_to_num(abs(pair[1] - pair[0]), nan=np.inf))


def _recover(effect: Effect, component: int, data: FloatArray, bench: Bench) -> float:
    strength, z = 0.0, np.zeros(bench.basis.shape[1])
    for _ in range(_STEPS):
        here, slopes = bench.slopes(z, effect.at(effect.along(component, strength)))
        trial = effect.at(effect.along(component, strength + effect.step))
        slope = (bench.moved(z, trial) - here).ravel() / effect.step
        columns = np.concatenate([slopes, slope[None]])
        norm = np.linalg.norm(columns, axis=1)
        rest = (data - here).ravel()
        step = np.linalg.lstsq((columns / norm[:, None]).T, rest, rcond=1e-10)[0] / norm
        z = z + np.clip(step[:-1], -0.5, 0.5)
        new = float(np.clip(strength + step[-1], effect.low, effect.high))
        done = abs(new - strength) < 1e-3 * effect.scale
        strength = new
        if done:
            break
    return strength


def registered_effects(
    files: Iterable[Path | str] = (), *, installed: bool = True
) -> Mapping[str, Effect]:
    """Return the catalogue with users' effects, each of which has been registered.

    Parameters and errors as for `tirelib.effects.load.all_effects`; also

    Raises
    ------
    FormatError
        If an effect may not take part, with every fault of all.
    """
    found = all_effects(files, installed=installed)
    faults = [
        fault
        for name, effect in found.items()
        if name not in CATALOGUE
        for fault in register(effect, found).faults
    ]
    if faults:
        raise FormatError(faults)
    return found
