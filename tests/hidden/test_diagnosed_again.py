"""With all added that a diagnosis named, the next one names nothing more."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hidden.cases import load_case

from tirelib.campaign import read_campaign
from tirelib.effects import CATALOGUE
from tirelib.inference.diagnose.diagnose import Diagnosis, diagnose
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.inference.identify.identify import fitted
from tirelib.measured.waveforms import measure_waveforms

DATA = Path(__file__).parent / "data"


def twice(runs: StraightRuns) -> tuple[Diagnosis, Diagnosis]:
    """Return the diagnosis of the base, and that of the model which it ends with."""
    catalogue = list(CATALOGUE.values())
    first = diagnose(runs, fitted(runs)[1].values, catalogue)
    model = first.final
    second = diagnose(
        runs,
        model.values,
        catalogue,
        effects=model.effects,
        strengths=model.strengths,
    )
    return first, second


def test_nothing_more_is_named_on_the_rig() -> None:
    case = load_case(DATA / "1000-temperature-1.20.npz")
    seen = case.waves.take(~case.held_out)
    first, second = twice(straight_runs(seen.take(np.arange(0, len(seen), 2))))
    assert first.named == ("temperature",)
    assert (second.verdict.kind, second.named) == ("none", ())
    # in units of the noise; the second fit's priors lie about the first one's numbers
    assert second.base.error == pytest.approx(first.final.error, rel=0.05)


def test_nothing_more_is_named_on_a_tire_of_finite_elements(
    shared: Callable[[str], Path],
) -> None:
    """What such a tire shows by itself, shear, section inertia and a tread that sticks, is base.

    Every fifth of its 66 runs is taken: they are in random order and span its conditions.
    """
    waves = measure_waveforms(read_campaign(shared("puzzle-b")))
    first, second = twice(straight_runs(waves.take(np.arange(0, len(waves), 5))))
    assert first.named == ("sidewall_damping",)
    assert (second.verdict.kind, second.named) == ("none", ())
