"""One case on strain: two look-alikes, before, after a run at random and after the advised ones."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from hidden.cases import base_fit

from next_test.pair import REFERENCE, Pair, PairCase, foretold, look_alikes, open_still
from next_test.rig import ENVELOPE, PLANS, bare, campaign
from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import candidates
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE, Effect
from tirelib.identify.campaign_data import straight_runs
from tirelib.identify.waveform_fit import Data
from tirelib.planning.criterion import NextTest
from tirelib.planning.envelope import Envelope
from tirelib.planning.next_test import next_test
from tirelib.planning.rivals import Trial, repeated_noise, try_suspects
from tirelib.planning.structure import Shapes
from tirelib.rig.hidden import HIDDEN
from tirelib.waveforms import Waveforms

LEVELS = {"load": 3, "pressure": 2, "speed": 3}
"""Of the envelope's grid: coarser than usual, for the best run lies at an end or near it."""


def pairs() -> list[Pair]:
    """Return plans and look-alikes there, by the angles that a diagnosis tells of a plain tire."""

    def signatures(plan: str) -> tuple[list[str], FloatArray]:
        none = bare(REFERENCE, plan)
        data = straight_runs(none.waves).data(with_deflection=False)
        able = [e for e in CATALOGUE.values() if e.name in HIDDEN]
        found = candidates(data, none.fit, able)
        return [candidate.effect.name for candidate in found.living], found.angles

    return look_alikes(PLANS, signatures)


def measured(case: PairCase) -> dict[str, Any]:
    """Return what the campaign, and one further run or two tell of a pair.

    That is a run at random, the advised one, and where that leaves the pair open, the one that is
    advised then.
    """
    made = campaign(case.seed, case.plan, case.truth, case.visible)
    case.check(made.visible)
    none = bare(case.seed, case.plan).fit
    base = base_fit(made.waves, np.zeros(len(made.waves), dtype=bool), none)
    runs = straight_runs(made.waves)
    data = runs.data(with_deflection=False)
    noise = repeated_noise(runs, data, base)
    suspects = [
        (CATALOGUE[k], np.full(CATALOGUE[k].components, 0.1 * CATALOGUE[k].toward))
        for k in sorted((case.truth, case.rival))
    ]
    test = _advice(data, base, suspects, noise)
    out: dict[str, Any] = {
        "strength": made.strength,
        "reached": made.visible,
        "ratio": made.ratio,
        "before": case.gap(test.trial),
    }
    if len(test.trial.rivals) < 2:
        return out
    for name, k in (("chosen", 0), ("random", case.any_of(len(test.points)))):
        trial = _tried(made.with_runs(test.points[[k]]), base, test.trial, _ahead(test, k))
        out[name] = case.gap(trial) | foretold(test, k)
    out["second"] = out["chosen"]
    if open_still(out["chosen"]["gap"]):
        runs = straight_runs(made.with_runs(test.points[:1]))
        data = runs.data(with_deflection=False)
        base = refit(data, base.values)
        more = _advice(data, base, suspects, repeated_noise(runs, data, base))
        if len(more.trial.rivals) == 2:
            both = made.with_runs(np.stack([test.points[0], more.points[0]]))
            trial = _tried(both, base, more.trial, _ahead(more, 0))
            out["second"] = case.gap(trial) | foretold(more, 0)
    return out


def _advice(
    data: Data, base: Refit, suspects: Sequence[tuple[Effect, FloatArray]], noise: float
) -> NextTest:
    return next_test(data, base.on_time(data.points), suspects, _envelope(data), noise=noise)


def _envelope(data: Data) -> Envelope:
    return replace(Envelope.of(data.points, **ENVELOPE), levels=LEVELS)


def _ahead(test: NextTest, rank: int) -> int:
    """Return the place in the envelope's grid of a run of a rank."""
    grid = np.lexsort(test.points.T[::-1])
    return int(np.flatnonzero(grid == rank)[0])


def _tried(waves: Waveforms, near: Refit, before: Trial, point: int) -> Trial:
    """Return the rivals on a campaign and one run at a point, structure as it was foretold."""
    runs = straight_runs(waves)
    data = runs.data(with_deflection=False)
    base = refit(data, near.values)
    suspects = [(CATALOGUE[rival.name], rival.strength) for rival in before.rivals]
    there = before.shapes.ahead[:, point : point + 1]
    every = np.concatenate([before.shapes.present, there], axis=1) / max(before.size, 1.0)
    shapes = Shapes(every, every[:, :0])
    noise = repeated_noise(runs, data, base)
    return try_suspects(data, base.on_time(data.points), suspects, noise=noise, shapes=shapes)
