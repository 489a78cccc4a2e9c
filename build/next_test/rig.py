"""Small campaigns on the numerical rig that leave two effects alike, and further runs of them.

The rig shares no code with the ring and plants every effect by another law (`tirelib.rig.hidden`).
Its structural constants, noise, set-point errors and trigger delay are drawn anew for every seed.
Plain states, campaigns and further runs are kept in build/out/next_test.
"""

import hashlib
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from hidden.cases import base_fit
from hidden.measured import MESH, Plain, _toward, keep, waveforms
from hidden.plan import Day, day

from tirelib.arrays import FloatArray
from tirelib.diagnose.fitter import WIDTH
from tirelib.diagnose.refit import Refit
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import straight_runs
from tirelib.identify.random_effects import whitening
from tirelib.planning.rivals import Trial, repeated_noise, try_suspects
from tirelib.rig.hidden import HIDDEN
from tirelib.rig.measure import settle
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import Trace, edges, trace
from tirelib.rig.plans import BAR, KMH
from tirelib.rig.shown import Shown
from tirelib.rig.solve import State, solve
from tirelib.rig.tire import Condition
from tirelib.waveforms import Waveforms

CACHE = Path(__file__).parents[1] / "out" / "next_test"
VERSION = 7
"""Of what decides a campaign's numbers beside its day."""
REPEATS = 2
"""Runs of a campaign that are made twice."""
CORRECTIONS = 3
REACHED = 0.25
"""Of the visibility, relative."""
LEAST_STEP = 1e-3
_GRID = mesh(*MESH)


def _plan(*conditions: tuple[float, float, float]) -> tuple[Condition, ...]:
    """Return conditions of loads [N], pressures [bar] and speeds [km/h]."""
    return tuple(Condition(load, bar * BAR, kmh * KMH) for load, bar, kmh in conditions)


PLANS: Mapping[str, tuple[Condition, ...]] = MappingProxyType(
    {
        "one_speed": _plan(
            (3000.0, 1.8, 65.0),
            (4500.0, 1.8, 65.0),
            (6000.0, 1.8, 65.0),
            (3000.0, 2.4, 65.0),
            (4500.0, 2.4, 65.0),
            (6000.0, 2.4, 65.0),
        ),
        "one_pressure": _plan(
            (3000.0, 2.1, 40.0),
            (6000.0, 2.1, 40.0),
            (4500.0, 2.1, 60.0),
            (4500.0, 2.1, 80.0),
            (3000.0, 2.1, 100.0),
            (6000.0, 2.1, 100.0),
        ),
        "pressure_by_load": _plan(
            (3000.0, 1.8, 40.0),
            (3000.0, 1.8, 100.0),
            (4500.0, 2.1, 60.0),
            (4500.0, 2.1, 80.0),
            (6000.0, 2.4, 40.0),
            (6000.0, 2.4, 100.0),
        ),
        "ever_faster": _plan(
            (3000.0, 2.4, 40.0),
            (6000.0, 1.8, 52.0),
            (4500.0, 2.1, 64.0),
            (3000.0, 1.8, 76.0),
            (6000.0, 2.4, 88.0),
            (4500.0, 2.1, 100.0),
        ),
    }
)
"""Six conditions each, in the order in which a hurried tester would choose them."""
IN_ORDER = ("ever_faster",)
"""Plans that are driven in that order; the others in one at random."""
ENVELOPE = MappingProxyType(
    {
        "load": (2000.0, 7500.0),
        "pressure": (1.6 * BAR, 2.7 * BAR),
        "speed": (20.0 * KMH, 130.0 * KMH),
    }
)
"""What the rig allows, SI."""


@dataclass(frozen=True)
class SmallDay(Day):
    """A day whose runs may be later than a campaign's."""

    when: tuple[float, ...] = ()

    @property
    def place(self) -> FloatArray:
        """Place of each run in the campaign, beyond 1 for further runs."""
        return np.array(self.when)

    @property
    def key(self) -> str:
        """Digest of everything that is drawn: what is kept of another day serves none."""
        return _digest((VERSION, self))


@dataclass(frozen=True)
class Made:
    """A campaign with a planted effect.

    Attributes
    ----------
    seed : int
    plan, truth : str
    strength : float
        In the rig's unit.
    visible : float
        Chi-square by which the campaign shows the effect, in a diagnosis' metric.
    ratio : float
        Error of the refitted base model over that without the effect.
    waves : Waveforms
    """

    seed: int
    plan: str
    truth: str
    strength: float
    visible: float
    ratio: float
    waves: Waveforms

    def with_runs(self, points: FloatArray) -> Waveforms:
        """Return the campaign with further runs at loads, pressures and speeds (n, 3), SI."""
        waves = self.waves
        for before, point in enumerate(np.asarray(points, dtype=float)):
            waves = join(waves, self._further(point, before))
        return waves

    def _further(self, point: FloatArray, before: int) -> Waveforms:
        told = (
            campaign_day(self.seed, self.plan).key,
            self.truth,
            f"{self.strength:.6e}",
            np.round(point, 2).tolist(),
            before,
        )
        file = CACHE / "further" / f"{_digest(told)}.pkl"

        def make() -> Waveforms:
            n = len(self.waves)
            number = 100 + int(_digest(told[3:])[:6], 16) % 9000
            later = [(n + before) / (n - 1.0)]
            today = small_day(self.seed, [Condition(*point)], [0], later, number)
            states, shown = traces(today, self.truth, self.strength, None)
            return waveforms(Plain(today, tuple(states)), states, shown, f"{told}")

        return _kept(file, make)


def _digest(value: object) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()[:16]


def _kept(file: Path, make: Callable[[], Any]) -> Any:
    if not file.exists():
        keep(file, pickle.dumps(make()))
    return pickle.loads(file.read_bytes())


def small_day(
    seed: int,
    conditions: Sequence[Condition],
    group: Sequence[int],
    when: Sequence[float],
    first: int = 0,
) -> SmallDay:
    """Return a day of a seed's tire with other conditions."""
    whole = day(seed)
    return SmallDay(
        seed,
        whole.tire,
        whole.chain,
        tuple(conditions),
        tuple(
            replace(settle(c, whole.chain, seed, first + k), slip_angle=0.0, camber=0.0)
            for k, c in enumerate(conditions)
        ),
        np.array(group),
        np.zeros(len(conditions), dtype=bool),
        whole.delay,
        whole.angle,
        tuple(when),
    )


def traces(
    today: SmallDay, name: str, strength: float, starts: Sequence[State] | None
) -> tuple[list[State], list[Trace]]:
    """Return states and what perfect gages show, run by run, with an effect of a strength."""
    states, shown, near = [], [], None
    for run, condition in enumerate(today.really):
        plain = starts[run] if starts else _solved(today, condition, near)
        near = plain
        state, place = plain, float(today.place[run])
        if strength:
            tire = HIDDEN[name].tire(today.tire, condition, place, strength)
            if tire is not today.tire:
                lower = tire.free_radius - today.tire.free_radius
                state = solve(tire, condition, replace(plain, height=plain.height + lower), _GRID)
        seen = trace(state)
        if strength:
            there = Shown(
                today.tire,
                condition,
                state.omega,
                seen,
                edges(state)[0],
                state.stiffness,
                place,
                today.angle,
            )
            seen = HIDDEN[name].trace(there, strength)
        states.append(state)
        shown.append(seen)
    return states, shown


def _solved(today: SmallDay, condition: Condition, near: State | None) -> State:
    try:
        return solve(today.tire, condition, near and _toward(near, condition), _GRID)
    except TirelibError:
        return solve(today.tire, condition, None, _GRID)


def campaign_day(seed: int, plan: str) -> SmallDay:
    """Return the day of a plan: its conditions in their order, two of them once more at the end."""
    random = np.random.default_rng([seed, 77, list(PLANS).index(plan)])
    n = len(PLANS[plan])
    first = np.arange(n) if plan in IN_ORDER else random.permutation(n)
    again = random.choice(n, REPEATS, replace=False)
    number = np.concatenate([first, np.sort(again)])
    conditions = [PLANS[plan][k] for k in number]
    return small_day(
        seed, conditions, number.tolist(), np.arange(number.size) / (number.size - 1.0)
    )


@dataclass(frozen=True)
class Bare:
    """A campaign without any effect, with the fit of the base model.

    Attributes
    ----------
    states, shown, waves, fit
    trial : Trial
        Of nobody: noise and structural misfit.
    """

    states: tuple[State, ...]
    shown: tuple[Trace, ...]
    waves: Waveforms
    fit: Refit
    trial: Trial


def bare(seed: int, plan: str) -> Bare:
    """Return a plan's campaign without any effect, from the cache if it is there."""
    today = campaign_day(seed, plan)

    def make() -> Bare:
        states, shown = traces(today, "", 0.0, None)
        waves = waveforms(Plain(today, tuple(states)), states, shown, plan)
        fit = base_fit(waves, today.held_out)
        slim = tuple(replace(state, grid=None) for state in states)
        runs = straight_runs(waves)
        data = runs.data(with_deflection=False)
        trial = try_suspects(
            data, fit.on_time(data.points), (), noise=repeated_noise(runs, data, fit)
        )
        return Bare(slim, tuple(shown), waves, fit, trial)

    found: Bare = _kept(CACHE / "bare" / f"{seed}-{plan}-{today.key}.pkl", make)
    return replace(found, states=tuple(replace(s, grid=_GRID) for s in found.states))


class Visible:
    """How clearly a campaign shows that something changed it: chi-square in a diagnosis' metric."""

    def __init__(self, none: Bare) -> None:
        data, trial = straight_runs(none.waves).data(with_deflection=False), none.trial
        white = whitening(
            none.fit.waveform,
            none.fit.values,
            data.points,
            data.tolerance,
            data.angle_std,
            trial.noise,
            data.low_pass,
        )
        free = none.fit.own_slopes * WIDTH[:, None, None]
        self.whiten = white
        self.rows = white(np.concatenate([trial.shapes.present, free])).reshape(
            len(trial.shapes.present) + len(free), -1
        )
        self.inner = np.linalg.inv(self.rows @ self.rows.T + np.eye(len(self.rows)))

    def __call__(self, change: FloatArray) -> float:
        """Return it for changed waveforms (n_runs, n_phi)."""
        flat = self.whiten(change).ravel()
        project = self.rows @ flat
        return float(flat @ flat - project @ self.inner @ project)


def campaign(seed: int, plan: str, truth: str, visible: float) -> Made:
    """Return a campaign with an effect of a visibility, from the cache if it is there."""
    key = campaign_day(seed, plan).key
    file = CACHE / "campaigns" / f"{seed}-{plan}-{truth}-{visible:g}-{key}.pkl"
    found: Made = _kept(file, lambda: _campaign(seed, plan, truth, visible))
    return found


def _campaign(seed: int, plan: str, truth: str, visible: float) -> Made:
    today, none, effect = campaign_day(seed, plan), bare(seed, plan), HIDDEN[truth]
    sign = float(np.random.default_rng([seed, 78]).choice([-1.0, 1.0])) if effect.signed else 1.0
    strength, seen = sign * effect.visible, Visible(none)
    gages, base = straight_runs(none.waves).gages, Plain(today, none.states)
    power, before = 2.0, (0.0, 0.0)
    for attempt in range(CORRECTIONS + 1):
        states, shown = traces(today, truth, strength, none.states)
        waves = waveforms(base, states, shown, plan)
        change = (waves.strain - none.waves.strain)[:, gages].mean(axis=1)
        reached = seen(change)
        if abs(reached / visible - 1.0) < REACHED or attempt == CORRECTIONS:
            break
        here = (float(np.log(abs(strength))), float(np.log(reached)))
        if attempt and abs(here[0] - before[0]) > LEAST_STEP:
            power = float(np.clip((here[1] - before[1]) / (here[0] - before[0]), 1.0, 4.0))
        before = here
        share = (visible / reached) ** (1.0 / power)
        strength = float(np.clip(share * strength, -effect.largest, effect.largest))
    fit = base_fit(waves, today.held_out, none.fit)
    ratio = fit.error / none.fit.error
    return Made(seed, plan, truth, strength, reached, ratio, waves)


def join(one: Waveforms, more: Waveforms) -> Waveforms:
    """Return the runs of a campaign and further ones, which come after."""
    count = len(one) + len(more)
    step = float(one.start[1] - one.start[0])
    both = {
        name: np.concatenate([getattr(one, name), getattr(more, name)])
        for name in ("strain", "turns", "scatter", "angle_std")
    }
    return replace(
        one,
        run=np.arange(count),
        start=step * np.arange(count),
        group=np.concatenate([one.group, one.group.max() + 1 + more.group]),
        conditions={k: np.concatenate([v, more.conditions[k]]) for k, v in one.conditions.items()},
        **both,
    )
