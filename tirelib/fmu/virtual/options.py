"""Parameters that a host sets before a virtual tire starts."""

import math
from dataclasses import dataclass, field

from tirelib.core.rates import RATES
from tirelib.fmu.virtual.faults import Faults, check


@dataclass(frozen=True, slots=True)
class Options:
    """The parameters of a wheel.

    Attributes
    ----------
    rate : float, [Hz]
        Sample rate.
    relaxation : tuple of two floats, [m]
        Relaxation length of slip angle and slip ratio; 0: none.
    noise : float
        Standard deviation of the gages' noise, as strain.
    seed : int
        Seed of noise and dropped frames; the wheels of a car need different ones.
    start_angle : float, [rad]
        Wheel angle at the start.
    faults : Faults

    Raises
    ------
    ParameterError
        If one is out of range.
    """

    rate: float = 10_000.0
    relaxation: tuple[float, float] = (0.3, 0.1)
    noise: float = 4e-6
    seed: int = 0
    start_angle: float = -math.pi
    faults: Faults = field(default_factory=Faults)

    def __post_init__(self) -> None:
        check("sample_rate", self.rate, *RATES)
        check("relaxation_length", self.relaxation[0], 0.0, 100.0)
        check("relaxation_length_kappa", self.relaxation[1], 0.0, 100.0)
        check("noise_std", self.noise, 0.0, 1.0)
        check("seed", self.seed, 0, 2**31 - 1)
        check("start_angle", self.start_angle, -math.pi, math.pi)
