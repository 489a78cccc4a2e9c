"""Effects planted at wanted error ratios.

Faults of gages are laws that are evaluated at any strength. Effects that act on the tire are solved
at a strength that shows and near the largest ratio; between these and none the waveforms are
interpolated in the strength. A case's ratio is that of its own waveforms.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from structure.cases import Case
from structure.day import Day, day, measured
from structure.family import Array, Family, Frame
from structure.ratio import Yard
from tirelib.core.errors import ParameterError
from tirelib.measured.waveforms import Waveforms

ROUNDS = 14
ACCEPTED = 0.05
"""Error that ratio - 1 may have, relative."""
WITHIN = 2.0
"""Factor between two solved strengths from which a third is solved."""

Strength = Mapping[str, float]


def planted_cases(
    family: Family, seed: int, kind: str, ratios: Sequence[float]
) -> dict[float, Case]:
    """Return a case for every ratio; one tire, day and noise.

    Raises
    ------
    ParameterError
        If a ratio is not reached within an effect's largest strength.
    """
    began = time.process_time()
    names = kind.split("+")
    for name in names:
        if name not in family.hidden:
            raise ParameterError(
                f"family {family.name} has no effect {name!r}; it has {', '.join(family.hidden)}"
            )
    tire, today = family.draw(seed, kind), day(family.number, seed)
    frames = family.frames(tire, today.settings, {}, today.angle)
    plant = _Plant(family, tire, today, frames)
    sign = np.random.default_rng([seed, 23])
    signs = {n: float(sign.choice([-1, 1])) if family.hidden[n].signed else 1.0 for n in names}
    ways = {n: _Way(plant, n, signs[n], max(ratios)) for n in names}
    made = {}
    for ratio in ratios:
        strength = {n: ways[n].strength(ratio) for n in names}
        waves = ways[kind].waves(strength[kind]) if len(names) == 1 else plant.waves(strength)
        plain, white = plant.yard.ratios(plant.yard.change(waves))
        made[ratio] = Case(
            family.name,
            seed,
            kind,
            ratio,
            waves,
            plant.floor_waves,
            strength,
            all(family.hidden[n].known for n in names),
            plain,
            white,
            plant.yard.floor,
            {
                "numbers": family.numbers(tire),
                "vertical_stiffness": [f.stiffness for f in frames],
                "height": [f.height for f in frames],
                "tire": asdict(tire),
                "seconds": time.process_time() - began,
            },
        )
    return made


@dataclass
class _Plant:
    """A plain tire and its day."""

    family: Family
    tire: Any
    today: Day
    frames: list[Frame]
    floor_waves: Waveforms = field(init=False)
    yard: Yard = field(init=False)

    def __post_init__(self) -> None:
        self.floor_waves = self.read(self.frames)
        self.yard = Yard.of(self.floor_waves)

    def read(self, frames: Sequence[Frame]) -> Waveforms:
        """Return frames as measured."""
        return measured(self.today, frames, self.family.geometry(self.tire))

    def waves(self, strength: Strength) -> Waveforms:
        """Return the campaign with effects, solved and shown."""
        hidden = self.family.hidden
        on_tire = {n: s for n, s in strength.items() if hidden[n].shown is None}
        frames = self.frames
        if on_tire:
            settings = self.today.settings
            frames = self.family.frames(self.tire, settings, on_tire, self.today.angle)
        for name, s in strength.items():
            law = hidden[name].shown
            if law is not None:
                frames = [law(frame, self.tire, self.today.angle, s) for frame in frames]
        return self.read(frames)


class _Way:
    """Waveforms of one effect over its strength."""

    def __init__(self, plant: _Plant, name: str, sign: float, largest_ratio: float) -> None:
        self.plant, self.name, self.effect = plant, name, plant.family.hidden[name]
        self.nodes: dict[float, Waveforms] = {0.0: plant.floor_waves}
        if self.effect.shown is None:  # solved at one that shows, then near the largest wanted
            first = sign * self.effect.visible
            self.nodes[first] = plant.waves({name: first})
            change = plant.yard.change(self.nodes[first])
            share = self._clipped(plant.yard.share(change, largest_ratio) * first) / first
            if not 1.0 / WITHIN < share < 1.1:
                self.nodes[share * first] = plant.waves({name: share * first})
                if share < 1.0 / WITHIN:  # the first is too far off to help
                    del self.nodes[first]
        self.first = max(self.nodes, key=abs) or sign * self.effect.visible

    def strength(self, ratio: float) -> float:
        """Return the strength at which the ratio is reached."""
        strength, yard, low, high = self.first, self.plant.yard, 0.0, np.inf
        for _ in range(ROUNDS):
            change = yard.change(self.waves(strength))
            reached = min(yard.ratios(change))
            if abs(reached - ratio) <= ACCEPTED * (ratio - 1.0):
                return strength
            if reached < ratio:
                low = max(low, abs(strength))
            else:
                high = min(high, abs(strength))
            following = abs(strength) * float(np.clip(yard.share(change, ratio), 0.2, 5.0))
            if not 1.001 * low < following < 0.999 * high:
                following = _between(low, high)
            strength = self._clipped(float(np.copysign(following, strength)))
        raise ParameterError(
            f"effect {self.name}: ratio {reached:.3f} at strength {strength:.3g}, {ratio} is "
            f"wanted; the largest strength is {self.effect.largest:g}; leave the case out"
        )

    def waves(self, strength: float) -> Waveforms:
        """Return the campaign at a strength: shown, or between solved ones (Lagrange)."""
        if self.effect.shown is not None:
            return self.plant.waves({self.name: strength})
        known = np.array(list(self.nodes))
        weights = []
        for k, own in enumerate(known):
            others = np.delete(known, k)
            weights.append(float(np.prod((strength - others) / (own - others))))
        every = list(self.nodes.values())

        def mixed(parts: list[Array]) -> Array:
            return np.asarray(
                np.sum([w * part for w, part in zip(weights, parts, strict=True)], axis=0)
            )

        return replace(
            every[0],
            strain=mixed([w.strain for w in every]),
            conditions={n: mixed([w.conditions[n] for w in every]) for n in every[0].conditions},
        )

    def _clipped(self, strength: float) -> float:
        return float(np.clip(strength, -self.effect.largest, self.effect.largest))


def _between(low: float, high: float) -> float:
    """Return a strength between two of which either may be missing (0, infinite)."""
    if not np.isfinite(high):
        return 2.0 * low
    return 0.3 * high if low == 0.0 else float(np.sqrt(low * high))
