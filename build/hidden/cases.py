"""Cases of the benchmark: a campaign with effects planted at a wanted error ratio, and its truth.

The error ratio is the rms residual of the base model, fitted to the campaign, over that of the
same campaign without the effects: same tire, set points, noise and delay. It is taken of the plain
residual and of that with set-point errors discounted, and the smaller one counts: an effect that
looks like a delay or like gains from run to run is not called visible for that. The rig
is solved at a visible strength and, by the linear estimate from there, near ratio 1.5; between
these and none the waveforms of effects that act on the tire are interpolated in the strength.
"""

import json
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hidden.measured import CACHE, Plain, Planted, blank, keep, plain, traces, waveforms
from hidden.plan import day
from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import TirelibError
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import fitted
from tirelib.inference.identify.waveform_fit import WaveformFit
from tirelib.measured.waveforms import Waveforms
from tirelib.model.slopes import slopes_of
from tirelib.rig.hidden import HIDDEN
from tirelib.rig.observe import Trace

NONE = "none"
VERSION = 7
"""Version of all that decides a case's numbers; raised when a law or the plan changes."""
NODES = 1
"""The same of solved states with one effect."""
TOLERANCE = 0.1
"""Error that ratio - 1 may have, relative."""
ACCEPTED = 0.25
"""The same after the last correction; the reached ratio stands in the case."""
CORRECTIONS = 10
STRONGEST = 1.5
"""Error ratio near which effects of the tire are solved; weaker ones lie between it and none."""


@dataclass(frozen=True)
class Case:
    """A campaign of the benchmark.

    Attributes
    ----------
    seed : int
    kind : str
        none, an effect's name, or two joined by +.
    wanted : float
        Error ratio that was asked for.
    waves, floor_waves : Waveforms
        All runs, with the effects and without them.
    held_out : shape (n_runs,)
        Runs that take no part in any fit.
    strength : mapping of effect to float
    ratio, white_ratio : float
        Reached error ratio of the plain residual, and with set-point errors discounted.
    floor : float
        Rms residual of the fitted base model without the effects [1].
    """

    seed: int
    kind: str
    wanted: float
    waves: Waveforms
    floor_waves: Waveforms
    held_out: BoolArray
    strength: Mapping[str, float]
    ratio: float
    white_ratio: float
    floor: float

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that are planted."""
        return () if self.kind == NONE else tuple(self.kind.split("+"))

    @property
    def known(self) -> bool:
        """Whether the catalogue has them all."""
        return all(HIDDEN[name].known for name in self.names)


def base_fit(waves: Waveforms, held_out: BoolArray) -> WaveformFit:
    """Identify the base model from the runs that are fitted."""
    return fitted(straight_runs(waves.take(~held_out)))[1]


def make_case(
    seed: int, kind: str, ratio: float, progress: Callable[[str], None] | None = None
) -> Case:
    """Return a case, from the cache if it has been made before.

    Parameters
    ----------
    seed : int
    kind : str
        none, a name of `tirelib.rig.hidden.HIDDEN`, or two of them joined by +.
    ratio : float
        Wanted error ratio, above 1; without meaning for none.

    Raises
    ------
    TirelibError
        If the ratio cannot be reached within the effect's largest strength.
    """
    file = case_file(seed, kind, ratio)
    if file.exists():
        return load_case(file)
    base = plain(seed)
    states, shown = traces(base, {})
    floor_waves = waveforms(base, states, shown, kind)
    held_out = base.day.held_out
    if kind == NONE:
        made = Case(seed, kind, 1.0, floor_waves, floor_waves, held_out, {}, 1.0, 1.0, np.nan)
    else:
        made = _Search(base, kind, floor_waves, progress).case(ratio)
    save_case(made, file)
    return made


class _Search:
    """Strengths of one kind on one tire."""

    def __init__(
        self,
        base: Plain,
        kind: str,
        floor_waves: Waveforms,
        progress: Callable[[str], None] | None,
    ) -> None:
        self.base, self.kind, self.floor_waves = base, kind, floor_waves
        self.progress, self.held_out = progress, base.day.held_out
        self.plain_fit = base_fit(floor_waves, self.held_out)
        self.floor = self.plain_fit.rms
        self.nodes: dict[str, dict[float, Waveforms]] = {}

    def case(self, ratio: float) -> Case:
        """Return the case at an error ratio."""
        names = self.kind.split("+")
        rng = np.random.default_rng([self.base.day.seed, len(names), 17])
        sign = {n: float(rng.choice([-1, 1])) if HIDDEN[n].signed else 1.0 for n in names}
        if len(names) == 1:
            strength = self._single(names[0], sign[names[0]], ratio)
            planted: Planted = {names[0]: strength}
        else:  # each alone would reach the ratio
            planted = {n: self._single(n, sign[n], ratio) for n in names}
        waves = self._waves(planted)
        model = base_fit(waves, self.held_out)
        return Case(
            self.base.day.seed,
            self.kind,
            ratio,
            waves,
            self.floor_waves,
            self.held_out,
            dict(planted),
            model.rms / self.floor,
            model.error / self.plain_fit.error,
            self.floor,
        )

    def _waves(self, planted: Planted) -> Waveforms:
        """Return waveforms at strengths; of one effect of the tire, between solved ones."""
        names = list(planted)
        if len(names) == 1 and HIDDEN[names[0]].on_tire is not None:
            return self._between(names[0], planted[names[0]])
        return self._solved(planted)

    def _solved(self, planted: Planted) -> Waveforms:
        states, shown = traces(self.base, planted, self.progress)
        return waveforms(self.base, states, shown, self.kind)

    def _node(self, name: str, strength: float) -> Waveforms:
        """Return waveforms at a strength, solved or from the cache, with this kind's noise."""
        file = CACHE / "nodes" / f"{self.base.day.seed}-{name}-{NODES}-{strength:.9e}.pkl"
        if file.exists():
            states, shown = pickle.loads(file.read_bytes())
        else:
            states, shown = traces(self.base, {name: strength}, self.progress)
            shown = [_thinned(seen) for seen in shown]
            slim = [replace(s, grid=None, control=None, by_load=None) for s in states]
            keep(file, pickle.dumps((slim, shown)))
        return waveforms(self.base, states, shown, self.kind)

    def _between(self, name: str, strength: float) -> Waveforms:
        """Interpolate the waveforms in the strength: Lagrange's polynomial through the nodes."""
        nodes = self.nodes.setdefault(name, {0.0: self.floor_waves})
        if len(nodes) == 1 or not 0.0 <= strength / max(nodes, key=abs) <= 1.1:
            nodes[strength] = self._node(name, strength)
        if strength in nodes:
            return nodes[strength]
        known = np.array(list(nodes))
        parts = []
        for k, own in enumerate(known):
            others = np.delete(known, k)
            parts.append(float(np.prod((strength - others) / (own - others))))
        every = list(nodes.values())

        def mixed(pick: Callable[[Waveforms], FloatArray]) -> FloatArray:
            total: FloatArray = np.sum(
                [part * pick(w) for part, w in zip(parts, every, strict=True)], axis=0
            )
            return total

        return replace(
            self.floor_waves,
            strain=mixed(lambda w: w.strain),
            conditions={n: mixed(lambda w, n=n: w.conditions[n]) for n in every[0].conditions},
        )

    def _ratio(self, planted: Planted) -> float:
        waves = self._waves(planted)
        model = base_fit(waves, self.held_out)
        return min(model.rms / self.floor, model.error / self.plain_fit.error)

    def _single(self, name: str, sign: float, ratio: float) -> float:
        """Return the strength of one effect at which the ratio is reached."""
        effect = HIDDEN[name]
        strong = sign * effect.visible
        share = self._estimate(name, strong, max(ratio, STRONGEST))
        if effect.on_tire is not None:  # a second solution, near the strongest that is wanted
            strong = float(np.clip(share * strong, -effect.largest, effect.largest))
            self.nodes[name][strong] = self._node(name, strong)
        share = self._estimate(name, strong, ratio)
        tried: list[tuple[float, float]] = []
        for _ in range(CORRECTIONS):
            strength = float(np.clip(share * strong, -effect.largest, effect.largest))
            share = strength / strong
            reached = self._ratio({name: strength})
            if abs(reached - ratio) <= TOLERANCE * (ratio - 1.0):
                return strength
            tried.append((share, reached**2 - 1.0))
            share = float(np.clip(_next(tried, ratio), 0.4 * share, 2.5 * share))
        if abs(reached - ratio) <= ACCEPTED * (ratio - 1.0):
            return strength
        raise TirelibError(
            f"hidden effect {name}, tire {self.base.day.seed}: ratio {reached:.3f} at strength "
            f"{strength:.3g} {effect.unit}, {ratio} is wanted; the effect is too weak at its "
            "largest, or not smooth; leave the case out"
        )

    def _estimate(self, name: str, strength: float, ratio: float) -> float:
        """Return the share of a strength at which both residuals reach a ratio, to first order."""
        waves, fit = self._waves({name: strength}), self.plain_fit
        used = straight_runs(self.floor_waves.take(~self.held_out)).gages
        change = (waves.strain - self.floor_waves.strain)[~self.held_out][:, used].mean(axis=1)
        whiten, slopes = fit.whiten.strain, slopes_of(fit.model, fit.free).waveform[:-2]
        white = whiten(slopes).reshape(len(slopes), -1)
        moved = np.linalg.lstsq(white.T, whiten(change).ravel(), rcond=None)[0]
        own = change - np.tensordot(moved, slopes, axes=1)
        return max(
            _root(own, fit.rest, self.floor, ratio),
            _root(whiten(own), whiten(fit.rest), fit.error, ratio),
        )


def _thinned(seen: Trace) -> Trace:
    """Return every fifth point of a trace: still eight times what the waveform's filter passes."""
    return Trace(seen.phi[::5], seen.strain[::5], seen.slope[::5], seen.by_load[::5])


def _root(own: FloatArray, rest: FloatArray, floor: float, ratio: float) -> float:
    """Return the positive x at which rest + x own is as large as a ratio times the floor."""
    linear, square = 2.0 * float(np.mean(own * rest)), float(np.mean(own**2))
    need = (ratio**2 - 1.0) * floor**2
    return float((-linear + np.sqrt(linear**2 + 4.0 * square * need)) / (2.0 * square))


def _next(tried: Sequence[tuple[float, float]], ratio: float) -> float:
    """Return the next share from those tried, each with its ratio^2 - 1."""
    need = ratio**2 - 1.0
    if len(tried) == 1:
        share, reached = tried[0]
        return share * float(np.sqrt(need / max(reached, 0.1 * need)))
    low = [pair for pair in tried if pair[1] < need]
    high = [pair for pair in tried if pair[1] >= need]
    if not low or not high:
        best = max(tried, key=lambda p: p[1]) if low else min(tried, key=lambda p: p[1])
        return best[0] * (1.6 if low else 0.7)
    (a, fa), (b, fb) = max(low), min(high)
    return a + (b - a) * (need - fa) / (fb - fa)


def case_file(seed: int, kind: str, ratio: float) -> Path:
    """Return where a case is kept."""
    ending = "" if kind == NONE else f"-{ratio:.2f}"
    return CACHE / f"cases-{VERSION}" / f"{seed}-{kind}{ending}.npz"


def save_case(case: Case, file: Path) -> None:
    """Write a case; the waveforms in single precision."""
    file.parent.mkdir(parents=True, exist_ok=True)
    w = case.waves
    truth = {
        "seed": case.seed,
        "kind": case.kind,
        "wanted": case.wanted,
        "ratio": case.ratio,
        "white_ratio": case.white_ratio,
        "floor": case.floor,
        "strength": dict(case.strength),
    }
    conditions: dict[str, Any] = {f"c_{k}": v for k, v in w.conditions.items()}
    conditions |= {f"f_{k}": v for k, v in case.floor_waves.conditions.items()}
    part = file.with_suffix(".part.npz")
    np.savez_compressed(
        part,
        truth=json.dumps(truth),
        strain=w.strain.astype(np.float32),
        floor=(case.floor_waves.strain - w.strain).astype(np.float32),
        held_out=case.held_out,
        **conditions,
    )
    part.rename(file)


def load_case(file: Path) -> Case:
    """Read a case; header and the like follow from its seed."""
    with np.load(file) as stored:
        truth = json.loads(str(stored["truth"]))
        empty = blank(day(truth["seed"]))
        strain = stored["strain"].astype(np.float64)
        floor = strain + stored["floor"]
        c = {name: stored[f"c_{name}"] for name in empty.conditions}
        f = {name: stored[f"f_{name}"] for name in empty.conditions}
        held = stored["held_out"]
    step = c["omega"] / empty.header.rate
    angle_std = step / np.sqrt(12.0 * (empty.turns + 1))
    waves = replace(empty, strain=strain, conditions=c, angle_std=angle_std)
    return Case(
        truth["seed"],
        truth["kind"],
        truth["wanted"],
        waves,
        replace(empty, strain=floor, conditions=f, angle_std=angle_std),
        held,
        truth["strength"],
        truth["ratio"],
        truth["white_ratio"],
        truth["floor"],
    )


def kinds(known: bool) -> Sequence[str]:
    """Return the names of effects that the catalogue has, or has not."""
    return [name for name, effect in HIDDEN.items() if effect.known is known]
