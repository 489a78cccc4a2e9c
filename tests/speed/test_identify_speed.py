"""Cost of an identification. Goals on two cores: 19 runs under 5 s, 60 runs under 30 s.

Run by `make bench`. Runs are made by the model; reading a campaign is not part of it. Times are of
the processor, so that other work on the machine does not count. A fit of 60 runs takes some 2.5 s,
one of 66 runs of the rig 3 s; advice on what to measure next is in it.
"""

from time import process_time

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import TIRE, made_waves
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.inference.identify.discrepancy import Discrepancy
from tirelib.inference.identify.identify import estimates_of, fitted
from tirelib.inference.identify.waveform_fit import fit_waveforms
from tirelib.measured.signal import LowPass
from tirelib.model.base import BARE, FREE, values_of
from tirelib.model.solution import solved

pytestmark = [pytest.mark.speed, pytest.mark.usefixtures("copies")]
GOALS = {19: 3.0, 60: 10.0}
"""A third of what is allowed: a slower fit is a regression."""


def campaign(count: int) -> StraightRuns:
    loads = tuple(np.linspace(2000.0, 7500.0, (count - 1) // 3))
    waves = made_waves(loads=loads, repeats=count - 3 * len(loads))
    assert len(waves) == count
    return straight_runs(waves)


def least(work: object, rounds: int = 2) -> float:
    times = []
    for _ in range(rounds):
        start = process_time()
        work()
        times.append(process_time() - start)
    return min(times)


def test_identification_time_and_its_growth_with_runs(capsys: pytest.CaptureFixture[str]) -> None:
    times = {}
    for count in (7, 19, 60):
        runs = campaign(count)
        times[count] = least(lambda runs=runs: estimates_of(*fitted(runs)))
    power = np.log(times[60] / times[19]) / np.log(60.0 / 19.0)
    with capsys.disabled():
        print({n: f"{t:.2f} s" for n, t in times.items()}, f"grows with runs^{power:.2f}")
    for count, goal in GOALS.items():
        assert times[count] < goal
    assert power < 1.5, "the cost per run must not grow"


def test_growth_with_free_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    runs = campaign(19)
    times = {}
    for free in (FREE[:1], FREE[:4], BARE):
        prior = np.full(len(free), 0.5)
        data = runs.data()

        def work(free=free, prior=prior, data=data) -> None:
            fit_waveforms(data, values_of(TIRE), prior, free=free, discrepancy=Discrepancy())

        times[len(free)] = least(work)
    with capsys.disabled():
        print({n: f"{t:.2f} s" for n, t in times.items()}, "by free parameters")
    assert times[8] < 12.0 * times[1]


def test_a_model_from_a_solution_nearby(capsys: pytest.CaptureFixture[str]) -> None:
    """What a refit of a diagnosis pays for the model, anew and from the last solution."""
    points = campaign(60).data().points
    values = values_of(TIRE)
    before = solved(values, points, low_pass=LowPass())
    near = {**values, "tangential_stiffness": 1.02 * TIRE.tangential_stiffness}
    anew = least(lambda: solved(near, points, low_pass=LowPass()))
    again = least(lambda: solved(near, points, low_pass=LowPass(), start=before.rolling))
    with capsys.disabled():
        print(f"model of 60 runs: {anew:.3f} s anew, {again:.3f} s from one nearby")
    assert again < 0.8 * anew
