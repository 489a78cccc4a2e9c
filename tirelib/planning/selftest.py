"""What a diagnosis can find at the user's own plan and noise: effects planted and looked for.

Every effect of the catalogue is planted, one at a time, in tires like the user's that are not the
fitted model (`tirelib.planning.variants`), so strong that the error grows by a given ratio over
what the structure alone leaves. The base is brought near each waveform, and the first round of the
diagnosis judges what is left, by the same thresholds and without exact refits.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import Candidate
from tirelib.diagnose.ensemble import MEMBERS
from tirelib.diagnose.noise import noise_in
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import Effect
from tirelib.errors import CalibrationError, TirelibError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import coordinates, move, predict
from tirelib.planning.first_round import FirstRound
from tirelib.planning.rivals import try_suspects
from tirelib.planning.variants import Track, draw_variants
from tirelib.threads import one_thread

RATIOS = (1.05, 1.2, 1.5)
"""Error with the planted effect, over the error without."""
REPEATS = 10
SEED_APART = 7919
"""Added to the seed of the thresholds' ensemble: other draws, of another family too."""
CHORD_STEPS = 3
HALVINGS = 5
LONGEST = 0.4
ATTEMPTS = 4


@dataclass(frozen=True, slots=True)
class Planting:
    """One effect at one strength, in every variant.

    Attributes
    ----------
    effect : Effect
    ratio : float
        Asked for.
    strength : float
        In the effect's unit.
    reachable : bool
        Whether that strength lies in the plausible range; nothing is planted if not.
    reached : float
        Median error over that of the same variant without the effect; NaN if nothing was planted.
    named : tuple of str
        What the ranking puts first, per variant; empty where there is no alarm.
    fault : str
        Why nothing was computed; empty if it was.
    """

    effect: Effect
    ratio: float
    strength: float
    reachable: bool
    reached: float
    named: tuple[str, ...]
    fault: str = ""

    @property
    def right(self) -> int:
        """Variants in which the planted effect comes first."""
        return sum(name == self.effect.name for name in self.named)

    @property
    def wrong(self) -> int:
        """Variants in which another comes first."""
        return sum(name not in ("", self.effect.name) for name in self.named)


@dataclass(frozen=True, slots=True)
class SelfTest:
    """What the plan can find.

    Attributes
    ----------
    plantings : tuple of Planting
    nothing : tuple of str
        What the ranking puts first in variants without any effect.
    dead : mapping of name to reason
    twins : mapping of name to sequence of (name, angle [rad])
    largest : mapping of name to float
        Error ratio at the end of the range, to first order.
    floor : float, [-]
        Median error of variants without any effect, whitened.
    size : float, [-]
        Of the smooth misfit of the variants, from the residual of the campaign.
    noise : float, [-]
    repeats, members, seed : int
    campaign : str
    """

    plantings: tuple[Planting, ...]
    nothing: tuple[str, ...]
    dead: Mapping[str, str]
    twins: Mapping[str, Sequence[tuple[str, float]]]
    largest: Mapping[str, float]
    floor: float
    size: float
    noise: float
    repeats: int
    members: int
    seed: int
    campaign: str


@one_thread()
def selftest(
    runs: StraightRuns,
    values: Mapping[str, float | FloatArray],
    catalogue: Sequence[Effect],
    *,
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
    only: Sequence[str] = (),
    ratios: Sequence[float] = RATIOS,
    repeats: int = REPEATS,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> SelfTest:
    """Plant effects at a campaign's plan and noise and tell how often they are found.

    Parameters
    ----------
    runs : StraightRuns
    values : mapping
        Of the model's tire.
    catalogue : sequence of Effect
        Everyone that a diagnosis looks at.
    effects, strengths
        That the model has already.
    only : sequence of str
        Effects to plant; all living ones if empty.
    ratios : sequence of float
        Errors with the effect over those without, above 1.
    repeats : int
        Variants in which each effect is planted.
    members, seed : int
        Of the ensemble that the thresholds are from.
    progress : callable, optional

    Raises
    ------
    CalibrationError
        If no variant of the model has a solution at the plan.
    ConvergenceError
        If the model does not fit.
    """
    data = runs.data(with_deflection=False)
    base = refit(data, values, effects, strengths, progress=progress).on_time(data.points)
    noise = noise_in(runs)
    ranking = FirstRound.of(
        runs, data, base, catalogue, members=members, seed=seed, progress=progress
    )
    size = try_suspects(data, base, [], noise=noise).size
    track = _track(data, base, size, noise, repeats, seed)
    judge = _Judge(data, base, ranking, track)
    plain = track.measured(base.changes, data)
    named, errors = judge(plain)
    floor = float(np.median(errors))
    plantings = []
    known = {effect.name for effect in catalogue}
    # a diagnosis ranks more beside them, which it never names
    living = {
        k: candidate
        for k, candidate in enumerate(ranking.found.living)
        if candidate.effect.name in known
    }
    for candidate in living.values():
        if only and candidate.effect.name not in only:
            continue
        for ratio in ratios:
            if progress is not None:
                progress(f"{candidate.effect.name} at {ratio:g}")
            plantings.append(_planted(candidate, ratio, floor, errors, judge))
    return SelfTest(
        tuple(plantings),
        named,
        ranking.found.dead,
        {c.effect.name: ranking.found.twins(k) for k, c in living.items()},
        {c.effect.name: _ratio_at(c, _share_of_end(c), floor) for c in living.values()},
        floor,
        size,
        noise,
        repeats,
        members,
        seed,
        runs.waves.header.name,
    )


def _track(data: Data, base: Refit, size: float, noise: float, repeats: int, seed: int) -> Track:
    """Return variants that have a solution at the plan."""
    random = np.random.default_rng(seed + SEED_APART)
    failure: TirelibError | None = None
    for _ in range(ATTEMPTS):
        try:
            track = Track.of(
                draw_variants(repeats, size, random),
                base,
                data,
                data.points,
                noise=noise,
                random=random,
            )
            track.measured(base.changes, data)
        except TirelibError as error:
            failure = error
            continue
        return track
    raise CalibrationError(
        f"selftest: variants of the model have no solution at this plan ({failure}); leave out "
        "runs at the ends of the load, or identify the model from this campaign"
    ) from failure


class _Judge:
    """The first round of a diagnosis, for waveforms of many tires."""

    def __init__(self, data: Data, base: Refit, ranking: FirstRound, track: Track) -> None:
        self.data, self.base, self.ranking, self.track = data, base, ranking, track
        k = len(coordinates(base.values))
        rows = base.whiten(base.slopes[:k]).reshape(k, -1)
        self.rows = rows
        normal = rows @ rows.T + 1e-6 * np.eye(k)
        self.inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)

    def __call__(self, waves: FloatArray) -> tuple[tuple[str, ...], FloatArray]:
        """Return who comes first per tire, and the errors that the base leaves."""
        rests = waves - self._refitted(waves)
        white = self.base.beside_delay(self.base.whiten(rests))
        errors: FloatArray = np.sqrt(np.mean(white**2, axis=(1, 2)))
        return tuple(self.ranking.first(rest) for rest in rests), errors

    def _refitted(self, waves: FloatArray) -> FloatArray:
        """Return the base brought near every tire's waveforms by a few chord steps."""
        base, count = self.base, len(waves)
        z = np.zeros((count, len(coordinates(base.values))))
        fitted = np.broadcast_to(base.waveform, waves.shape)
        for _ in range(CHORD_STEPS):
            white = base.whiten(waves - fitted).reshape(count, -1)
            step = np.clip(white @ self.rows.T @ self.inverse, -LONGEST, LONGEST)
            z, fitted = self._stepped(z, step)
        return fitted

    def _stepped(self, z: FloatArray, step: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return coordinates after a step, and the waveforms there; shorter where none exist."""
        for share in 0.5 ** np.arange(HALVINGS):
            try:
                return z + share * step, self._predicted(z + share * step)
            except TirelibError:
                continue
        return z, self._predicted(z)

    def _predicted(self, z: FloatArray) -> FloatArray:
        """Return the base's waveforms at every tire's coordinates."""
        base, data, count = self.base, self.data, len(z)
        free = coordinates(base.values)
        each = [move(base.values, row, free) for row in z]
        values = dict(base.values)
        for coordinate in free:
            column = [float(np.max(moved[coordinate.name])) for moved in each]
            values[coordinate.name] = np.repeat(column, len(data.points))
        large = [base.correction.moved(row) for row in z]
        correction = replace(
            base.correction.tiled(count),
            waveform=np.concatenate([one.waveform for one in large]),
            deflection=np.concatenate([one.deflection for one in large]),
        )
        found = predict(
            values,
            data.points.tiled(count),
            base.changes,
            low_pass=data.low_pass,
            correction=correction,
        ).wave
        return found.reshape(count, len(data.points), -1)


def _planted(
    candidate: Candidate, ratio: float, floor: float, errors: FloatArray, judge: _Judge
) -> Planting:
    """Plant one effect at one strength in every variant."""
    effect, size = candidate.effect, judge.data.strain.size
    share = floor * float(np.sqrt((ratio**2 - 1.0) * size)) / _own(candidate)
    strength = share * effect.scale * float(np.sign(effect.toward))
    if share > _share_of_end(candidate):
        return Planting(effect, ratio, strength, False, float("nan"), ())
    change = effect.at(effect.along(0, strength))
    try:
        # a law may leave its domain in a tire unlike the fitted one
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            waves = judge.track.measured([*judge.base.changes, change], judge.data)
            named, with_it = judge(waves)
    except TirelibError as error:
        return Planting(effect, ratio, strength, True, float("nan"), (), str(error))
    reached = float(np.median(with_it / errors))
    return Planting(effect, ratio, strength, True, reached, named)


def _own(candidate: Candidate) -> float:
    """Return the norm of the first component's own part, for one range."""
    return float(np.linalg.norm(candidate.own[0]))


def _share_of_end(candidate: Candidate) -> float:
    effect = candidate.effect
    return abs(effect.toward) / effect.scale


def _ratio_at(candidate: Candidate, share: float, floor: float) -> float:
    """Return the error ratio at a strength, to first order."""
    square = (share * _own(candidate)) ** 2 / candidate.own.shape[1]
    return float(np.sqrt(1.0 + square / floor**2))
