"""The estimate of one turn of a live signal."""

from dataclasses import dataclass

from tirelib.estimators.estimate import Estimates
from tirelib.measured.features.extract import Features


@dataclass(frozen=True, slots=True)
class TurnEstimate:
    """Result of one turn: one row of `Features` and of `Estimates`, SI, ISO 8855.

    Attributes
    ----------
    turn : int
        Number of the turn since the start, from 1.
    features : Features
        Features of one row; ``time`` and ``ready`` are in s since the first sample.
    estimates : Estimates
        Estimates of one row: value, std and valid of Fz, alpha, kappa, Fy; flags, notes, contact
        lengths.
    """

    turn: int
    features: Features
    estimates: Estimates

    @property
    def valid(self) -> bool:
        """Whether the turn was measured well and every calibrated quantity is in range."""
        return bool(self.estimates.turn_valid[0])

    @property
    def flags(self) -> int:
        """`TurnFlag` bits of the turn."""
        return int(self.estimates.flags[0])

    @property
    def time(self) -> float:
        """Middle of the contact, [s since the first sample]."""
        return float(self.features.time[0])

    @property
    def ready(self) -> float:
        """When the last sample that the turn needs was taken, [s since the first sample]."""
        return float(self.features.ready[0])

    def value(self, quantity: str) -> float:
        """Return Fz [N], alpha [rad], kappa [1] or Fy [N]; NaN where it is not to be had."""
        return float(self.estimates.value[quantity][0])

    def std(self, quantity: str) -> float:
        """Return the standard deviation of a quantity, in its unit."""
        return float(self.estimates.std[quantity][0])

    def is_valid(self, quantity: str) -> bool:
        """Return whether a quantity may be used."""
        return bool(self.estimates.valid[quantity][0])
