"""A small campaign of a tire with an effect that its plan hardly tells from another."""

from dataclasses import replace
from functools import cache

import numpy as np

from tests.synthetic import LATERAL
from tests.unit.inference.identify.model_waves import TIRE, made_waves, operating
from tirelib.effects import CATALOGUE
from tirelib.effects.state import Operating
from tirelib.inference.diagnose.diagnose import plain_tires
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.inference.planning.envelope import Envelope
from tirelib.inference.planning.next_test import NextTest, next_test
from tirelib.inference.planning.suspects import Suspects, given_suspects
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.model import solution
from tirelib.model.base import operating_points, values_of

NOISE = 2e-6
PLANTED, TWIN = "temperature", "dynamic_stiffening"
STRENGTH = 0.035
FEW = (PLANTED, TWIN, "sidewall_damping", "camber")
"""Effects of the problem: the look-alikes, another, and one that no run can show."""
CONDITIONS = (
    (3000.0, 1.8e5, 11.0),
    (6000.0, 2.4e5, 11.0),
    (4500.0, 2.1e5, 17.0),
    (4500.0, 2.1e5, 22.0),
    (3000.0, 2.4e5, 28.0),
    (6000.0, 1.8e5, 28.0),
)
"""Speed rises in the order of the runs, so softening with time looks like softening with speed."""
LEVELS = {"load": 2, "pressure": 2, "speed": 2}
"""Levels of the grid of possible runs."""
AGAIN = (4, 5)
"""Runs that are made twice, at the end."""


def points_at(conditions: tuple[tuple[float, float, float], ...]) -> Operating:
    load, pressure, speed = np.array(conditions).T
    return replace(operating(load, pressure), speed=speed, omega=speed / TIRE.ring_radius)


@cache
def runs(further: tuple[float, float, float] | None = None) -> StraightRuns:
    """Return the runs, and one at a further load, pressure and speed."""
    conditions = [*CONDITIONS, *(CONDITIONS[k] for k in AGAIN)]
    group = [*range(len(CONDITIONS)), *AGAIN]
    if further is not None:
        conditions, group = [*conditions, further], [*group, len(CONDITIONS)]
    n = len(conditions)
    plain = made_waves(loads=tuple(range(3000, 3000 + n)), pressures=(2e5,), repeats=0)
    load, pressure, speed = np.array(conditions).T
    given = {
        "Fz": load,
        "pressure": pressure,
        "speed": speed,
        "omega": speed / TIRE.ring_radius,
        "loaded_radius": np.full(n, np.nan),
    }
    waves = replace(plain, conditions=plain.conditions | given, group=np.array(group))
    wave = solution.solved(
        values_of(TIRE),
        operating_points(waves),
        [CATALOGUE[PLANTED].at(STRENGTH)],
        low_pass=waves.low_pass,
    ).waveform
    random = np.random.default_rng(3)
    noise = NOISE * random.standard_normal((n, len(LATERAL), wave.shape[1]))
    return straight_runs(replace(waves, strain=wave[:, None] + noise))


def hypotheses(measured: StraightRuns) -> Hypotheses:
    problem = StrainProblem(measured, values_of(TIRE), [CATALOGUE[name] for name in FEW])
    return Hypotheses(problem, plain_tires())


@cache
def made() -> Hypotheses:
    return hypotheses(runs())


def suspects(*names: str) -> Suspects:
    return given_suspects(names or (TWIN, PLANTED), [], CATALOGUE)


def envelope(**declared: tuple[float, float]) -> Envelope:
    points = runs().data(with_deflection=False).points
    return replace(Envelope.of(points, **declared), levels=LEVELS)


@cache
def planned() -> NextTest:
    return next_test(made(), suspects(), envelope())
