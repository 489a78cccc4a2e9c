"""Tires, set points and measuring days of the benchmark: everything that a seed decides."""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.rig.measure import MeasuringChain, settle
from tirelib.rig.plans import KMH
from tirelib.rig.tire import Condition, RigTire

LOADS = (2400.0, 3900.0, 5400.0, 6900.0)
PRESSURES = (1.7e5, 2.1e5, 2.5e5)
SPEEDS = (30.0 * KMH, 60.0 * KMH, 95.0 * KMH, 130.0 * KMH)
_SPEED_OF = ((0, 2, 1, 3), (3, 1, 2, 0), (1, 3, 0, 2))
"""Speed of each load at each pressure: every load meets three speeds, every speed three loads."""
HELD_OUT = (
    Condition(7700.0, 2.1e5, 60.0 * KMH),
    Condition(4600.0, 1.9e5, 60.0 * KMH),
    Condition(4600.0, 2.1e5, 80.0 * KMH),
)
"""A load, a pressure and a speed that no fitted run has."""
REPEATS = 3


@dataclass(frozen=True)
class Day:
    """A tire, its measuring chain, and the runs of a campaign in order of time.

    Attributes
    ----------
    nominal, really : tuple of Condition
        Set points, and what the rig held.
    group : shape (n_runs,)
        Equal for equal set points.
    held_out : shape (n_runs,)
    delay : float
        Between trigger and gages [s].
    angle : float
        Place of an effect that is fixed to the tire [rad].
    """

    seed: int
    tire: RigTire
    chain: MeasuringChain
    nominal: tuple[Condition, ...]
    really: tuple[Condition, ...]
    group: IntArray
    held_out: BoolArray
    delay: float
    angle: float

    @property
    def place(self) -> FloatArray:
        """Place of each run in the campaign, 0 to 1."""
        n = len(self.nominal)
        return np.arange(n, dtype=np.float64) / max(n - 1, 1)


def tire(seed: int) -> RigTire:
    """Draw a tire that hides nothing: no damping, a road without friction, plain rubber."""
    rng = np.random.default_rng([seed, 11])
    base = RigTire()

    def factor(spread: float) -> float:
        return float(np.exp(spread * rng.standard_normal()))

    # the order of the draws is part of a seed's meaning
    return replace(
        base,
        name=f"tire {seed}",
        ring_radius=base.ring_radius * factor(0.02),
        tread_thickness=base.tread_thickness * factor(0.1),
        extension=base.extension * factor(0.2),
        shear=base.shear * factor(0.25),
        bending=base.bending * factor(0.2),
        mass=base.mass * factor(0.08),
        sidewall_radial=base.sidewall_radial * factor(0.12),
        sidewall_radial_offset=base.sidewall_radial_offset * factor(0.12),
        sidewall_tangential=base.sidewall_tangential * factor(0.12),
        sidewall_tangential_offset=base.sidewall_tangential_offset * factor(0.12),
        tread_normal=base.tread_normal * factor(0.15),
        tread_hardening=float(rng.uniform(0.0, 2.0)),
        crown_curvature=float(rng.uniform(0.3, 1.1)),
        transverse_bending=base.transverse_bending * factor(0.2),
        belt_shear_coupling=base.belt_shear_coupling * factor(0.2),
        innerliner_offset=base.innerliner_offset * factor(0.03),
        sidewall_damping=0.0,
        friction=0.0,
    )


def day(seed: int) -> Day:
    """Return the campaign of a seed: 12 conditions, three of them twice, three held out."""
    rng = np.random.default_rng([seed, 12])
    plain = MeasuringChain()
    noise, setting = rng.uniform(0.7, 1.5), rng.uniform(0.6, 1.2)
    chain = replace(
        plain,
        gage_noise=plain.gage_noise * noise,
        gain_repeatability=plain.gain_repeatability * setting,
        load_setting=plain.load_setting * setting,
        pressure_setting=plain.pressure_setting * setting,
    )
    fitted = [
        Condition(load, pressure, SPEEDS[_SPEED_OF[j][i]])
        for j, pressure in enumerate(PRESSURES)
        for i, load in enumerate(LOADS)
    ]
    again = rng.choice(len(fitted), REPEATS, replace=False)
    number = np.array([*range(len(fitted)), *again, *range(len(fitted), len(fitted) + 3)])
    every = [*fitted, *HELD_OUT]
    late = np.concatenate([np.zeros(len(fitted)), np.full(REPEATS, 0.6), np.zeros(3)])
    order = np.argsort(rng.uniform(size=number.size) + late, kind="stable")
    number = number[order]
    nominal = tuple(every[k] for k in number)
    return Day(
        seed=seed,
        tire=tire(seed),
        chain=chain,
        nominal=nominal,
        really=tuple(
            replace(settle(c, chain, seed, run), slip_angle=0.0, camber=0.0)
            for run, c in enumerate(nominal)
        ),
        group=number.astype(np.int64),
        held_out=number >= len(fitted),
        delay=float(rng.uniform(-5e-5, 5e-5)),
        angle=float(rng.uniform(-np.pi, np.pi)),
    )
