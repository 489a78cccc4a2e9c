"""One measured turn that a calibration carries, so that whatever is made of it can be tried."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError

POINTS = 1024
"""Wheel angles of a stored turn."""
STRAIN_UNIT = 1e-7
"""Strain is stored in whole numbers of this."""
CONDITIONS = ("speed", "pressure", "camber", "omega")


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceTurn:
    """Raw strain of a turn that was measured near the middle of the calibrated conditions.

    Attributes
    ----------
    strain : array, shape (n_gages, m), [-]
        Over an even grid of wheel angle from -pi on; 0 is the middle of the contact.
    speed, pressure, camber, omega : float, [m/s], [Pa], [rad], [rad/s]
        What was measured with it, ISO; NaN where it was not. The turn rate is that of the contacts.
    run : str
        Where it was measured.
    """

    strain: FloatArray
    speed: float
    pressure: float
    camber: float
    omega: float
    run: str

    def at(self, angle: FloatArray) -> FloatArray:
        """Return the strain at wheel angles [rad] of any turn, shape (n_gages, n).

        Examples
        --------
        >>> turn = ReferenceTurn(np.array([[0.0, 1.0, 2.0, 1.0]]), 20.0, 2e5, 0.0, 65.0, "1")
        >>> turn.at(np.array([-np.pi, 0.0, 0.25 * np.pi, 2.0 * np.pi])).tolist()
        [[0.0, 2.0, 1.5, 2.0]]
        """
        grid = np.linspace(-np.pi, np.pi, self.strain.shape[1], endpoint=False)
        return np.stack([np.interp(angle, grid, row, period=2.0 * np.pi) for row in self.strain])

    def table(self) -> dict[str, Any]:
        """Return the turn as plain values, for a file."""
        whole = np.rint(self.strain / STRAIN_UNIT).astype(np.int64)
        held = {name: float(getattr(self, name)) for name in CONDITIONS}
        return {"run": self.run, **held, "strain_unit": STRAIN_UNIT, "strain": whole.tolist()}

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> "ReferenceTurn":
        """Return the turn of a table that `faults` found nothing wrong with."""
        strain = np.array(table["strain"], dtype=np.float64) * float(table["strain_unit"])
        held = {name: float(table[name]) for name in CONDITIONS}
        return cls(strain, run=str(table["run"]), **held)


def folded(
    strain: FloatArray, middle: float, period: float, points: int = POINTS
) -> FloatArray | None:
    """Return the turn round a contact over an even grid of wheel angle; None if samples lack.

    What a gage's zero drifts over the turn is taken off evenly, so that the end meets the start.

    Parameters
    ----------
    strain : array, shape (n_gages, n), [-]
        Raw samples at a uniform rate.
    middle, period : float, [samples]
        Middle of the contact; length of the turn.
    points : int

    Returns
    -------
    array, shape (n_gages, points), or None

    Raises
    ------
    ParameterError
        If the period is not above 0.

    Examples
    --------
    >>> folded(np.arange(12.0)[None], 6.0, 4.0, 4).round(9).tolist()
    [[4.0, 4.0, 4.0, 4.0]]
    """
    if not period > 0.0:
        raise ParameterError(f"period = {period} samples; must be above 0")
    place = middle + period * (np.arange(points + 1) / points - 0.5)
    first, last = int(np.floor(place[0])), int(np.ceil(place[-1]))
    if first < 0 or last >= strain.shape[1] or not np.isfinite(strain[:, first : last + 1]).all():
        return None
    index = np.arange(first, last + 1)
    turn = np.stack([np.interp(place, index, row[first : last + 1]) for row in strain])
    drift = (turn[:, -1] - turn[:, 0])[:, None]
    return np.asarray(turn[:, :-1] - drift * (np.arange(points) / points), dtype=np.float64)
