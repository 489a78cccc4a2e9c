"""A plan of straight runs, measured on a tire and written as a campaign, with its truth."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from continuum.effects import EFFECTS, Run
from continuum.grid import grid
from continuum.measure import Laboratory, laboratory, record, settled
from continuum.observe import Trace, trace
from continuum.polar import Array
from continuum.sidewall import at, law
from continuum.solve import Model, State, model, solve
from continuum.tire import LATERAL, Condition, Tire, draw
from tirelib.campaign import (
    CampaignHeader,
    RunPlan,
    TireGeometry,
    Tolerance,
    write_campaign,
)
from tirelib.campaign import Run as Written
from tirelib.core.errors import ParameterError

KMH, BAR = 1.0 / 3.6, 1e5
LOADS = (2400.0, 3600.0, 4800.0, 6000.0, 7200.0)
PRESSURES = (1.8 * BAR, 2.2 * BAR, 2.6 * BAR)
SPEEDS = (30.0 * KMH, 60.0 * KMH, 95.0 * KMH, 125.0 * KMH)
SPACING = 12.0
"""Time between the starts of two runs [s]."""


@dataclass(frozen=True)
class Campaign:
    """A tire, a laboratory, nominal conditions in order of time, and what is hidden."""

    tire: Tire
    lab: Laboratory
    plan: tuple[Condition, ...]
    hidden: Mapping[str, float]


def plan(runs: int, seed: int) -> tuple[Condition, ...]:
    """Return a plan in random order: 66 runs (60 conditions) or 15 (12), the rest repeats."""
    rng = np.random.default_rng([seed, 4105])
    every = [Condition(f, p, v) for p in PRESSURES for v in SPEEDS for f in LOADS]
    if runs == 15:
        speed = ((0, 2, 1, 3), (3, 1, 2, 0), (1, 3, 0, 2))
        every = [
            Condition(LOADS[i], p, SPEEDS[speed[j][i]])
            for j, p in enumerate(PRESSURES)
            for i in range(4)
        ]
    elif runs != 66:
        raise ParameterError(f"plan, runs = {runs}; allowed are 66 and 15; choose one")
    again = rng.choice(len(every), runs - len(every), replace=False)
    order = rng.permutation(len(every))
    return tuple(every[i] for i in (*order, *again))


def states(
    campaign: Campaign, progress: Callable[[int, int], None] | None = None
) -> Iterator[tuple[State, Trace]]:
    """Solve the runs of a campaign, each from a state of its load that all runs share."""
    base = model(campaign.tire)
    rng = np.random.default_rng([campaign.lab.seed, 4106])
    angle, count = float(rng.uniform(-np.pi, np.pi)), len(campaign.plan)
    starts: dict[float, State] = {}
    last: State | None = None
    for load in sorted({c.load for c in campaign.plan}):
        middle = Condition(load, PRESSURES[1], SPEEDS[1])
        there = _changed(base, Run(middle, 0.5, angle), campaign.hidden)
        last = starts[load] = solve(there, middle, last)
    for number, nominal in enumerate(campaign.plan):
        cond = settled(campaign.lab, nominal, number)
        run = Run(cond, number / (count - 1), angle)
        state = solve(_changed(base, run, campaign.hidden), cond, starts[nominal.load])
        run = replace(run, omega=state.omega, stiffness=state.stiffness)
        seen = trace(state)
        for name, strength in campaign.hidden.items():
            seen = EFFECTS[name].shown(seen, campaign.tire, run, strength)
        if progress is not None:
            progress(number + 1, count)
        yield state, seen


def _changed(base: Model, run: Run, hidden: Mapping[str, float]) -> Model:
    tire, law = base.tire, base.law
    for name, strength in hidden.items():
        tire, law = EFFECTS[name].tire(tire, run, strength), EFFECTS[name].law(law, run, strength)
    same = all(np.array_equal(tire.radii(i), base.tire.radii(i)) for i in range(3))
    return replace(base, tire=tire, mesh=base.mesh if same else grid(tire, base.fine), law=law)


def make(
    out: Path,
    seed: int,
    runs: int = 66,
    hidden: Mapping[str, float] | None = None,
    tire: Tire | None = None,
    progress: Callable[[int, int], None] | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Make the campaign of a seed in a folder, its truth (`truth.json`) beside it.

    Parameters
    ----------
    hidden : mapping of effect to strength, optional
    tire : Tire, optional
        Instead of the one that the seed draws.

    Raises
    ------
    ParameterError
        If there is no such effect or plan, or a strength is out of its range.
    ArithmeticError
        If a run finds no balance.
    """
    _check(seed, hidden or {})
    campaign = Campaign(tire or draw(seed), laboratory(seed), plan(runs, seed), dict(hidden or {}))
    truth: list[dict[str, float]] = []

    def written() -> Iterator[Written]:
        for number, (state, seen) in enumerate(states(campaign, progress)):
            start = number * SPACING
            seen_by = record(campaign.lab, state, seen, number, start)
            truth.append(_truth(number, state, seen))
            yield Written(
                plan=_row(number, campaign.plan[number]),
                strain=seen_by.strain,
                rate=campaign.lab.rate,
                trigger=seen_by.trigger,
                rig=seen_by.rig,
                rig_time=seen_by.rig_time,
            )

    write_campaign(out, _header(campaign), written(), overwrite=overwrite)
    document = {
        "format": "continuum-truth/1",
        "seed": seed,
        "hidden": dict(campaign.hidden),
        "ring": ring_numbers(campaign.tire),
        "tire": asdict(campaign.tire),
        "runs": truth,
    }
    (out / "truth.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _check(seed: int, hidden: Mapping[str, float]) -> None:
    if seed < 0:
        raise ParameterError(f"seed = {seed}; allowed are 0 and above; give another one")
    for name, strength in hidden.items():
        if name not in EFFECTS:
            raise ParameterError(
                f"effect {name!r} is unknown; allowed are {', '.join(EFFECTS)}; choose one"
            )
        largest, unit = EFFECTS[name].largest, EFFECTS[name].unit
        if not 0.0 <= strength <= largest:
            raise ParameterError(
                f"effect {name}, strength = {strength:g} {unit}; allowed are 0 to {largest:g} "
                f"{unit}; give another one"
            )


def ring_numbers(tire: Tire) -> dict[str, float]:
    """Return what a ring model would call the tire's constants, SI; k_u, k_v at 2 bar, slopes."""
    walls = law(tire.arch)
    return tire.section | {
        "k_u": at(walls.radial, 2.0 * BAR),
        "k_u_slope": float(walls.radial[1]),
        "k_v": at(walls.tangential, 2.0 * BAR),
        "k_v_slope": float(walls.tangential[1]),
        "pull_over_pressure_and_width": -at(walls.pull, 2.0 * BAR) / (2.0 * BAR * tire.belt_width),
    }


def _truth(run: int, state: State, seen: Trace) -> dict[str, float]:
    cond, road = state.balance.cond, state.balance.road
    edge: Array = seen.edges[2]
    return {
        "run": run,
        "Fz_N": road.load,
        "Fx_N": road.forward,
        "pressure_Pa": cond.pressure,
        "speed_m_per_s": cond.speed,
        "omega_rad_per_s": state.omega,
        "axle_height_m": state.height,
        "vertical_stiffness_N_per_m": state.stiffness,
        "edge_lead_rad": float(edge[0]),
        "edge_trail_rad": float(edge[1]),
    }


def _row(number: int, nominal: Condition) -> RunPlan:
    return RunPlan(
        run=number,
        file=f"runs/{number:03d}.mf4",
        kind="free",
        load=nominal.load,
        pressure=nominal.pressure,
        speed=nominal.speed,
        slip_angle=0.0,
        camber=0.0,
        slip_ratio=0.0,
        start=number * SPACING,
    )


def _header(campaign: Campaign) -> CampaignHeader:
    tire, lab = campaign.tire, campaign.lab
    return CampaignHeader(
        name=tire.name,
        axes="iso",
        tire=TireGeometry(
            name=tire.name,
            free_radius=tire.free_radius,
            ring_radius=tire.ring_radius,
            tread_thickness=tire.tread_thickness,
            belt_width=tire.belt_width,
            innerliner_offset=tire.innerliner_offset,
        ),
        gage_lateral=tuple(float(y) for y in LATERAL),
        rate=lab.rate,
        strain_unit="ustrain",
        tolerance=Tolerance(
            load=lab.load_error,
            pressure=lab.pressure_error,
            speed=lab.speed_error,
            gain=lab.gain_repeat,
        ),
        rig_name="rolling continuum of finite elements",
        rig_note=f"{len(campaign.plan)} straight runs; the truth is in truth.json",
    )
