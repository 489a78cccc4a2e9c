"""Smooth shapes of strain round the turn, for what a model leaves and no effect explains.

They are bumps, the wider the further they are from the contact. Each goes with nothing, with load,
with pressure or with speed. Groups of them are weighed by what plain tires show of each.
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects.state import Operating
from tirelib.inference.identify.discrepancy import TOP, Discrepancy, along_turn
from tirelib.inference.problems.whiten_strain import INSIDE
from tirelib.measured.waveforms import GRID

SHAPES = Discrepancy(
    inside=1.0, outside=0.15, knots=38, reach=TOP, by_load=1.0, by_pressure=1.0, by_speed=1.0
)
"""Smooth shapes over the whole turn."""
BESIDE = 5.0
"""Place along the turn up to which the contact bends the belt; beyond, the belt is nearly round.
Half and double of it: docs/theory/verdict_numbers.md."""
NEIGHBOURS = 2.0
"""Bumps over which shapes far away from the contact go together: exp(-n^2 / 2 NEIGHBOURS^2) is the
correlation of bumps that are n apart. There the belt is loaded by nothing and bends in waves that
are longer than a bump. Half and double of it: docs/theory/verdict_numbers.md."""
ALONE = 1e-3
"""Variance of each bump by itself, over that which it shares with its neighbours: it keeps the
correlations positive definite. Half and double of it: docs/theory/verdict_numbers.md."""
GOES_WITH = ("constant", "load", "pressure", "speed")


def smooth_shapes(
    waveform: FloatArray, half_angle: FloatArray, points: Operating
) -> dict[str, FloatArray]:
    """Return shapes by what they go with and where they are.

    Parameters
    ----------
    waveform : shape (n_runs, n_phi), [-]
        The model's; shapes are as large as it is.
    half_angle : shape (n_runs,), [rad]
        Half of the contact's angle.
    points : Operating

    Returns
    -------
    mapping of "load, free belt" and the like to shape (n_bumps, n_runs, n_phi)
    """
    columns = SHAPES.columns(waveform, along_turn(GRID, half_angle), points)
    end = np.arcsinh(SHAPES.reach)
    centre = np.sinh(np.linspace(-end, end, SHAPES.knots))
    place = np.digitize(np.abs(centre), (INSIDE, BESIDE))
    groups = {}
    for name, rows in zip(GOES_WITH, np.split(columns, len(GOES_WITH)), strict=True):
        groups[f"{name}, contact"] = rows[place == 0]
        groups[f"{name}, free belt"] = rows[place == 1]
        ahead, behind = (_together(rows[(place == 2) & side]) for side in (centre < 0, centre > 0))
        groups[f"{name}, far belt"] = np.concatenate([ahead, behind])
    return groups


def _together(bumps: FloatArray) -> FloatArray:
    """Return shapes whose equal and independent sizes are those of bumps that go together."""
    n = np.arange(len(bumps))
    correlation = np.exp(-0.5 * ((n[:, None] - n) / NEIGHBOURS) ** 2) + ALONE * np.eye(len(n))
    return np.tensordot(np.linalg.cholesky(correlation).T, bumps, axes=1)
