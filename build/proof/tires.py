"""Random tires of the numerical rig, and a campaign of straight runs with each."""

import pickle
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tirelib.campaign import read_campaign
from tirelib.measured.waveforms import Waveforms, measure_waveforms
from tirelib.rig.campaign import run_plan
from tirelib.rig.plans import KMH, REFERENCE_LOAD, Plan
from tirelib.rig.tire import Condition, RigTire

CACHE = Path(__file__).parents[1] / "out" / "proof"
_CONDITIONS = (
    (1.7e5, 65.0, (50.0, 100.0, 150.0)),
    (2.1e5, 65.0, (50.0, 75.0, 100.0, 125.0, 150.0)),
    (2.5e5, 65.0, (50.0, 100.0, 150.0)),
    (2.1e5, 20.0, (50.0, 100.0, 150.0)),
    (2.1e5, 120.0, (50.0, 100.0, 150.0)),
)
"""Pressure [Pa], speed [km/h], loads [% of the reference]."""


@dataclass(frozen=True)
class Measured:
    """A tire and what a campaign with it gave."""

    tire: RigTire
    waves: Waveforms


def tire(seed: int) -> RigTire:
    """Draw a tire about the reference tire of the rig, every constant widely.

    The road of every second tire is without friction: its tread does not hold on to it.
    """
    rng = np.random.default_rng([seed, 77])
    base = RigTire()

    def factor(spread: float) -> float:
        return float(np.exp(spread * rng.standard_normal()))

    # the order of the draws is part of a seed's meaning
    return replace(
        base,
        name=f"tire {seed}",
        extension=base.extension * factor(0.4),
        shear=base.shear * factor(0.4),
        bending=base.bending * factor(0.3),
        mass=base.mass * factor(0.2),
        sidewall_radial=base.sidewall_radial * factor(0.25),
        sidewall_radial_offset=base.sidewall_radial_offset * factor(0.25),
        sidewall_tangential=base.sidewall_tangential * factor(0.3),
        sidewall_tangential_offset=base.sidewall_tangential_offset * factor(0.3),
        tread_normal=base.tread_normal * factor(0.3),
        tread_hardening=float(rng.uniform(0.0, 2.0)),
        crown_curvature=float(rng.uniform(0.0, 1.5)),
        sidewall_damping=float(rng.uniform(0.0, 0.08)),
        innerliner_offset=base.innerliner_offset * factor(0.2),
        friction=float(rng.uniform(0.5, 1.1)) * (seed % 2 == 0),
        tread_shear_x=base.tread_shear_x * factor(0.4),
    )


def plan() -> Plan:
    """Return 17 straight conditions over loads, pressures and speeds, and two repeats."""
    runs = tuple(
        Condition(REFERENCE_LOAD * percent / 100.0, pressure, speed * KMH)
        for pressure, speed, loads in _CONDITIONS
        for percent in loads
    )
    return Plan("identification", "17 straight conditions and 2 repeats", runs, repeats=2)


def measured(seed: int) -> Measured:
    """Return a tire and its campaign, from the cache if it is there."""
    file = CACHE / f"rig{seed}.pkl"
    if not file.exists():
        CACHE.mkdir(parents=True, exist_ok=True)
        drawn = tire(seed)
        with TemporaryDirectory() as folder:
            run_plan(plan(), drawn, folder, seed=seed, jobs=1, overwrite=True)
            waves = measure_waveforms(read_campaign(folder))
        part = file.with_suffix(".part")
        part.write_bytes(pickle.dumps((drawn, waves)))
        part.rename(file)
    drawn, waves = pickle.loads(file.read_bytes())
    return Measured(drawn, waves)
