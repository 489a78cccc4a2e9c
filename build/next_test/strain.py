"""One case on strain: two look-alikes, before, after a run at random and after the advised run."""

from dataclasses import replace
from typing import Any

import numpy as np
from hidden.cases import base_fit

from bench.rig.hidden import HIDDEN
from next_test.pair import REFERENCE, Pair, PairCase, look_alikes
from next_test.rig import ENVELOPE, PLANS, bare, campaign
from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import candidates
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE
from tirelib.identify.campaign_data import straight_runs
from tirelib.identify.waveform_fit import Data
from tirelib.planning.criterion import NextTest
from tirelib.planning.envelope import Envelope
from tirelib.planning.next_test import next_test
from tirelib.planning.rivals import Trial, repeated_noise, try_suspects
from tirelib.planning.structure import Shapes
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
    """Return what the campaign, a further run at random, and the advised one tell of a pair."""
    made = campaign(case.seed, case.plan, case.truth, case.visible)
    case.check(made.visible)
    none = bare(case.seed, case.plan).fit
    base = base_fit(made.waves, np.zeros(len(made.waves), dtype=bool), none)
    runs = straight_runs(made.waves)
    data = runs.data(with_deflection=False)
    noise = repeated_noise(runs, data, base)
    suspects = [(CATALOGUE[k], np.full(CATALOGUE[k].components, 0.1 * CATALOGUE[k].toward))
                for k in sorted((case.truth, case.rival))]  # fmt: skip
    test = next_test(data, base.on_time(data.points), suspects, _envelope(data), noise=noise)
    out: dict[str, Any] = {
        "strength": made.strength, "reached": made.visible, "ratio": made.ratio,
        "before": case.gap(test.trial),
    }  # fmt: skip
    if len(test.trial.rivals) < 2:
        return out
    for name, k in (("chosen", 0), ("random", case.any_of(len(test.points)))):
        trial = _tried(made.with_run(test.points[k]), base, test.trial, _ahead(test, k))
        out[name] = case.gap(trial) | {
            "at": test.envelope.text(test.points[k]), "predicted": float(test.score[k]),
            "chance": float(test.probability[k]),
        }  # fmt: skip
    return out


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
