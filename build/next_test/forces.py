"""One case on side forces: two look-alikes, before, after a run at random and the advised one.

The tire is a Magic Formula whose constants are drawn anew (`tests.magic_sweep`), with other laws of
load, pressure and temperature than the effects have. Wear that slows down and a polish by the root
of time are planted here. Plans are such as happen: one pressure after the other, a tread that warms
with load, small slip angles only. Runs are sweeps of the slip angle at one load, pressure and
temperature, as on a flat belt; or single points, scattered.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.linalg import subspace_angles

from next_test.pair import REFERENCE, Pair, PairCase, foretold, look_alikes, open_still
from tests.magic_sweep import _force
from tirelib.core.arrays import FloatArray
from tirelib.effects import CATALOGUE
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.forces.models import plain_tires
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.brush_law import BrushModel
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_points import force_points
from tirelib.inference.planning.envelope import Envelope
from tirelib.inference.planning.force_runs import bench_ahead, force_axes, force_envelope
from tirelib.inference.planning.next_test import next_test
from tirelib.inference.planning.suspects import given_suspects
from tirelib.inference.problems.forces import ForceProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.problem import Point

NOISE = 8.0
"""Noise of a point's side force [N]."""
ANGLE_NOISE, LOAD_NOISE, PRESSURE_NOISE = 2e-4, 0.003, 0.003
"""Errors of a run, alike in all its points: slip angle [rad], load and pressure (relative)."""
SPEED, PAUSE, PACE = 11.0, 12.0, 0.8
"""[m/s], and [s] from run to run and from point to point of a sweep."""
LOADS, PRESSURES = (700.0, 1500.0, 2300.0), (0.7e5, 0.83e5, 0.96e5)
WIDE, SMALL = (-8.0, -5.0, -2.5, 2.5, 5.0, 8.0), (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
"""Slip angles [deg]."""
DRIFTS = ("stiffness_drift", "friction_drift")
PLANTED = (
    "friction_load",
    "stiffness_load",
    "friction_pressure",
    "stiffness_pressure",
    "friction_temperature",
    "stiffness_temperature",
    *DRIFTS,
)
ENVELOPE = MappingProxyType(
    {
        "load": (500.0, 2900.0),
        "pressure": (0.65e5, 1.0e5),
        "speed": (SPEED, SPEED),
        "slip_angle": (np.deg2rad(-9.0), np.deg2rad(9.0)),
        "temperature": (315.0, 350.0),
    }
)


@dataclass(frozen=True)
class Plan:
    """Points in the order of time; each set point is measured twice, one after the other.

    Attributes
    ----------
    in_order : bool
        Whether pressures follow each other; else all is in turn at random.
    heated : bool
        Whether the tread is as warm as the load makes it; else 335 K, give or take.
    scattered : bool
        Whether every point is a run of its own; else a run is a sweep, there and back, through the
        slip angles at one load and pressure.
    """

    angles: Sequence[float]
    in_order: bool
    heated: bool
    scattered: bool = False

    def points(self, seed: int) -> dict[str, FloatArray]:
        """Return the conditions as set, by name, SI, and the number of the run."""
        random = np.random.default_rng([seed, 21])
        grid = np.meshgrid(PRESSURES, LOADS, np.deg2rad(self.angles), indexing="ij")
        pressure, load, angle = (x.ravel() for x in grid)
        index = np.arange(load.size)
        if self.scattered:
            visits = np.stack([index, index], axis=1)
        else:
            each = index.reshape(-1, len(self.angles))
            visits = np.concatenate([each, each[:, ::-1]], axis=1)
        if self.in_order:
            blocks = visits.reshape(len(PRESSURES), -1, visits.shape[1])
            visits = np.concatenate([random.permutation(block) for block in blocks])
        else:
            visits = random.permutation(visits)
        chosen = visits.ravel()
        pressure, load, angle = pressure[chosen], load[chosen], angle[chosen]
        n = chosen.size
        warm = 320.0 + 25.0 * load / max(LOADS) if self.heated else np.full(n, 335.0)
        run = np.arange(n) if self.scattered else np.arange(n) // visits.shape[1]
        pace = 0.0 if self.scattered else PACE
        return {
            "load": load,
            "pressure": pressure,
            "slip_angle": angle,
            "temperature": warm + 1.5 * random.standard_normal(n),
            "time": (PAUSE - pace) * run + pace * np.arange(n),
            "run": run,
        }


SWEEPS: Mapping[str, Plan] = MappingProxyType(
    {
        "pressures_in_order": Plan(WIDE, in_order=True, heated=False),
        "warmed_by_load": Plan(WIDE, in_order=False, heated=True),
        "small_angles": Plan(SMALL, in_order=False, heated=True),
    }
)
SCATTERED = {f"scattered_{k}": replace(plan, scattered=True) for k, plan in SWEEPS.items()}
PLANS: Mapping[str, Plan] = MappingProxyType({**SWEEPS, **SCATTERED})


@dataclass(frozen=True)
class Tire:
    """A Magic Formula tire with an effect."""

    seed: int
    span: float
    truth: str
    strength: float

    def side(self, at: Mapping[str, FloatArray]) -> FloatArray:
        """Return Fy without noise; the constants are those of the seed, whatever the points."""
        order = at["time"] / self.span
        stiff = self.strength * (1.0 - np.exp(-1.6 * order)) * (self.truth == DRIFTS[0])
        slick = self.strength * np.sqrt(order) * (self.truth == DRIFTS[1])
        planted = {} if self.truth in DRIFTS else {self.truth: self.strength}
        angle = np.arctan(np.tan(at["slip_angle"]) * (1.0 + stiff) / (1.0 - slick))
        out: FloatArray = (1.0 - slick) * _force(
            np.random.default_rng([self.seed, 22]),
            planted,
            at["load"],
            at["pressure"],
            np.zeros(angle.size),
            at["temperature"],
            angle,
            at["time"],
        )
        return out

    def measured(self, at: Mapping[str, FloatArray], draw: int) -> ForceData:
        """Return points as they are measured."""
        random, n = np.random.default_rng([self.seed, 23, draw]), at["load"].size
        side = self.side(at) + NOISE * random.standard_normal(n)
        run = np.asarray(at["run"], dtype=np.int64)
        off = random.standard_normal((3, int(run.max()) + 1))[:, run]
        flat, nothing = np.zeros(n), np.full(n, np.nan)
        return ForceData(
            at["load"] * (1.0 + LOAD_NOISE * off[0]),
            at["pressure"] * (1.0 + PRESSURE_NOISE * off[1]),
            at["slip_angle"] + ANGLE_NOISE * off[2],
            flat,
            flat,
            nothing,
            nothing,
            side,
            nothing,
            run,
            np.full(n, SPEED),
            at["temperature"],
            at["time"],
        )


def case_of(data: ForceData) -> ForceCase:
    """Return a campaign with the brush that fits it."""
    fit = fit_brush(data)
    values = {k: v for k, v in fit.values.items() if k != "lateral_compliance"}
    reference = (fit.reference.load, fit.reference.pressure)
    model = ForceModel(
        "fitted", BrushModel("fitted", values, fit.reference, None), (), reference, ()
    )
    bench = model.bench(force_points(data))
    return ForceCase("steady", model, "Fy", bench, bench, NOISE, len(bench.points) // 2, ())


def hypotheses_of(case: ForceCase) -> Hypotheses:
    """Return the hypotheses about a campaign."""
    return Hypotheses(case.as_given(list(CATALOGUE.values())), plain_tires("Fy"))


def tire_of(test: PairCase) -> Tire:
    """Return the tire with the effect at the strength of the wanted visibility.

    That is the chi-square, in the metric of what plain tires show, that the effect adds to the tire
    without it.
    """
    at = PLANS[test.plan].points(test.seed)
    none = Tire(test.seed, float(at["time"].max()), test.truth, 0.0)
    among = hypotheses_of(case_of(none.measured(at, 0)))
    null = among.base.null
    whiten, metric = among.problem.whitener(null.view.own), null.likeliest
    step = 0.05
    for _ in range(2):
        change = whiten(replace(none, strength=step).side(at) - none.side(at))
        right = null.view.white @ change
        seen = float(change @ change - right @ metric.mean(right))
        step = float(np.clip(step * np.sqrt(test.visible / seen), -0.8, 0.8))
    sign = float(np.random.default_rng([test.seed, 24]).choice([-1.0, 1.0]))
    if CATALOGUE[test.truth].low > -0.3 or test.truth in DRIFTS:
        sign = 1.0
    return replace(none, strength=sign * step)


def pairs(*, scattered: bool = False) -> list[Pair]:
    """Return plans and look-alikes there, by the angles that a diagnosis tells of a plain tire."""

    def signatures(plan: str) -> tuple[list[str], FloatArray]:
        at = PLANS[plan].points(REFERENCE)
        case = case_of(Tire(REFERENCE, float(at["time"].max()), DRIFTS[0], 0.0).measured(at, 0))
        wanted = [CATALOGUE[name] for name in PLANTED]
        problem = ForceProblem(case.bench, "Fy", case.model.values, wanted, noise=NOISE)
        living, count = problem.living, len(problem.names)
        zeros = tuple(np.zeros(effect.components) for effect in living)
        point = Point(problem.start.base, living, zeros)
        slopes = problem.slopes(point, problem.solve(point))
        basis = np.linalg.qr(slopes[:count].T)[0]
        ends = count + np.cumsum([effect.components for effect in living])[:-1]
        own = [
            (rows - (rows @ basis) @ basis.T).T for rows in np.split(slopes[count:], ends - count)
        ]
        angles = [[float(subspace_angles(a, b).min()) for b in own] for a in own]
        return [effect.name for effect in living], np.array(angles)

    return look_alikes(SCATTERED if scattered else SWEEPS, signatures)


def measured(test: PairCase) -> dict[str, Any]:
    """Return what the campaign, and one further run or two tell of a pair.

    That is a run at random, the advised one, and where that leaves the pair open, the one that is
    advised then.
    """
    tire = tire_of(test)
    case = case_of(tire.measured(PLANS[test.plan].points(test.seed), 1))
    among = hypotheses_of(case)
    suspects = given_suspects(sorted((test.truth, test.rival)), [], CATALOGUE, "Fy")
    axes = force_axes(case)
    declared = {name: ends for name, ends in ENVELOPE.items() if name in axes}
    plan = next_test(among, suspects, force_envelope(case, **declared), model=case.model)
    out: dict[str, Any] = {"strength": tire.strength, "before": test.told(among)}
    if len(plan.rivals) < 2:
        return out
    for name, k in (("random", test.any_of(len(plan.points))), ("chosen", 0)):
        after = _with_run(case, plan.envelope, plan.points[k], tire, 0)
        among = hypotheses_of(after)
        out[name] = test.told(among) | foretold(plan, k)
    out["second"] = out["chosen"]
    if open_still(out["chosen"]):
        more = next_test(among, suspects, force_envelope(after, **declared), model=case.model)
        if len(more.rivals) == 2:
            both = _with_run(after, more.envelope, more.points[0], tire, 1)
            out["second"] = test.told(hypotheses_of(both)) | foretold(more, 0)
    return out


def _with_run(
    case: ForceCase, envelope: Envelope, point: FloatArray, tire: Tire, before: int
) -> ForceCase:
    """Return a campaign with one run more, after so many further ones."""
    bench = bench_ahead(case.bench, case.model, envelope, point[None])
    n, size = len(case.bench.points), envelope.points
    at = bench.conditions.take(np.arange(n, n + size))
    told = {name: getattr(at, name) for name in ("load", "pressure", "slip_angle", "temperature")}
    later = tire.span + (1 + before) * PAUSE + before * PACE * size
    told |= {"time": later + PACE * np.arange(size), "run": np.zeros(size)}
    # the model is told the set points, and the tire has others
    off = tire.measured(told, 2 + 2 * before)
    told |= {name: getattr(off, name) for name in ("load", "pressure", "slip_angle")}
    side = tire.measured(told, 3 + 2 * before).Fy
    measured = np.concatenate([case.bench.points.data.Fy, side])
    data = replace(bench.points.data, Fy=measured)
    bench = replace(bench, points=replace(bench.points, data=data))
    return replace(case, bench=bench, whole=bench)
