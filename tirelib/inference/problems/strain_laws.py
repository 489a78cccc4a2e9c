"""How what an effect does to the strain would look if its law were only roughly right."""

from collections.abc import Sequence

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import FIELDS
from tirelib.effects.state import Operating, State
from tirelib.inference.identify.discrepancy import (
    REFERENCE_LOAD,
    REFERENCE_OMEGA,
    REFERENCE_PRESSURE,
    along_turn,
    bumps,
)
from tirelib.inference.problems.strain_shapes import SHAPES
from tirelib.measured.waveforms import GRID
from tirelib.model.base import Coordinate

ANYWHERE = 0.1
"""What the tire does where the law does nothing lies, with this share of its power, anywhere on the
turn; the rest lies where the effect acts. Half and double of it: docs/theory/verdict_numbers.md."""
SHARED = 5.0
"""Size of an error by which another constant of the same part of the tire goes with the effect."""
PARTS = {"k_u": "sidewall", "k_v": "sidewall", "k_t": "tread"}
"""Stiffnesses of a state, and the part of the tire (`FIELDS`) that they belong to."""
LARGER, BY_SPEED, PLACED = 1.7, 0.5, 0.4
"""Sizes of an error's parts over that of the law (`tirelib.inference.statistics.law_errors.LAWS`):
the effect goes otherwise with conditions, is larger or smaller in a place, or is there where the
law does nothing; goes with speed in a place; is displaced in a place. Half and double of each:
docs/theory/verdict_numbers.md."""
LEAST = 0.05
"""Root mean square of what an effect does in a place, over that of all of it; places below it are
left out. Other values: docs/theory/verdict_numbers.md."""

LOOKALIKE_SHARE = 0.075
"""How much of what a law does may be an error that looks like any one other effect, beyond these
parts: a relative standard deviation. Half and double of it: docs/theory/verdict_numbers.md."""


def law_errors(
    rows: FloatArray, half_angle: FloatArray, points: Operating, present: int
) -> FloatArray:
    """Return errors of a law; together they are as large as what the effect does.

    The effect goes otherwise with load, pressure, speed and time, by a slope and by a curvature.
    From place to place on the turn it is larger or smaller, always or with load or with speed, and
    acts a little further ahead or behind. What it does where the law does nothing is a smooth
    shape, as large as the rows are nearby in that run.

    Parameters
    ----------
    rows : shape (components, n_runs, n_phi), [-]
        What the effect does to the waveforms.
    half_angle : shape (n_runs,), [rad]
        Half of the contact's angle.
    points : Operating
    present : int
        Runs that are measured, the first ones: conditions count from their mean.

    Returns
    -------
    shape (n_errors, n_runs, n_phi)
    """
    conditions = np.stack(
        [
            np.log(points.load / REFERENCE_LOAD),
            (points.omega / REFERENCE_OMEGA) ** 2,
            4.0 * (points.pressure / REFERENCE_PRESSURE - 1.0),
            2.0 * points.order - 1.0,
        ]
    )
    conditions = conditions - conditions[:, :present].mean(axis=1, keepdims=True)
    goes = np.concatenate([conditions, _bent(conditions, present)])
    otherwise = (goes[:, None, :, None] * rows).reshape(-1, *rows.shape[1:])
    place = bumps(along_turn(GRID, half_angle), SHAPES.knots, SHAPES.reach)
    local = _in_places(rows, place, present)
    shape = _level(place * _nearby(np.sum(rows**2, axis=0), half_angle))
    load, speed = conditions[:2, :, None]
    return np.concatenate(
        [
            LARGER * np.concatenate([otherwise, local, local * load, shape]),
            BY_SPEED * local * speed,
            PLACED * _in_places(_displaced(rows, half_angle), place, present),
        ]
    )


def stiffened(before: State, after: State) -> dict[str, FloatArray]:
    """Return by how much the stiffness of each part of a tire changes, (n_runs,), log ratio.

    The change of a sidewall is that of k_v where k_u and k_v both change.
    """
    out: dict[str, FloatArray] = {}
    for name, part in PARTS.items():
        old, new = getattr(before, name), getattr(after, name)
        if np.any(new != old):
            # a stiffness of zero that stays has not changed
            out[part] = np.log(np.divide(new, old, out=np.ones_like(old), where=new != old))
    return out


def beside(
    slopes: FloatArray,
    free: Sequence[Coordinate],
    part: str,
    change: FloatArray,
    rows: FloatArray,
    present: int,
) -> FloatArray:
    """Return errors of a law that leaves the other constants of a part as they are.

    What makes rubber softer, or a part stiffer, changes all that the part is made of: how the tread
    is sheared, how much it thickens, what the sidewall holds along the belt. Each constant changes
    by as much as the stiffness does. What looks like the effect itself is its strength, and no
    error.

    Parameters
    ----------
    slopes : shape (n_free, n_runs, n_phi)
        By the coordinates.
    free : sequence of Coordinate
    part : str
        Part of the tire, as `FIELDS` has it.
    change : shape (n_runs,)
        Log ratio of the stiffness after the effect to the one before.
    rows : shape (1, n_runs, n_phi)
        What the effect does.
    present : int
        Runs that are measured, the first ones: what looks like the effect does so in them.

    Returns
    -------
    shape (n_constants, n_runs, n_phi)
    """
    own = [k for k, coordinate in enumerate(free) if FIELDS[coordinate.name].group == part]
    errors = SHARED * change[:, None] * slopes[own]
    here = rows[0, :present]
    share = np.tensordot(errors[:, :present], here, axes=2) / np.sum(here**2)
    return np.asarray(errors - share[:, None, None] * rows)


def as_large(rows: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return rows (components, ...), each as large as what all do together at these strengths.

    Components may oppose each other: what is left of them is what a law can be off by.
    """
    together = float(np.sqrt(np.mean(np.tensordot(ranges, rows, axes=1) ** 2)))
    own = np.sqrt(np.mean(rows**2, axis=tuple(range(1, rows.ndim)), keepdims=True))
    return np.asarray(rows * (together / own))


def _bent(conditions: FloatArray, present: int) -> FloatArray:
    """Return the squares of conditions (n, n_runs), with the spread that each condition has.

    A law that levels off, where the effect's law goes on, differs by a curvature. Its size is that
    of the slopes, `LARGER`: raised or halved, it has not been measured by itself.
    """
    here = conditions[:, :present]
    spread = here.std(axis=1, keepdims=True)
    square = np.divide(conditions**2, spread, out=np.zeros_like(conditions), where=spread > 0.0)
    return np.asarray(0.5 * (square - spread))


def _displaced(rows: FloatArray, half_angle: FloatArray) -> FloatArray:
    """Return how rows change as they move by half a contact, to first order."""
    order = np.fft.rfftfreq(GRID.size, 1.0 / GRID.size)
    slope = 1j * half_angle[:, None] * order
    return np.asarray(np.fft.irfft(slope * np.fft.rfft(rows), n=GRID.size))


def _in_places(rows: FloatArray, place: FloatArray, present: int) -> FloatArray:
    """Return what rows (components, n_runs, n_phi) do in each place, (n, n_runs, n_phi).

    Places where they do next to nothing in the runs that are measured are left out.
    """
    every = (rows[:, None] * place).reshape(-1, *place.shape[1:])
    size = np.sqrt(np.mean(every[:, :present] ** 2, axis=(1, 2)))
    return _level(every[size > LEAST * np.sqrt(np.mean(rows[:, :present] ** 2))])


def _level(rows: FloatArray) -> FloatArray:
    """Return rows without their mean round the turn, which no gage measures."""
    return np.asarray(rows - rows.mean(axis=2, keepdims=True))


def _nearby(square: FloatArray, half_angle: FloatArray) -> FloatArray:
    """Return the size of what squares (n_runs, n_phi) are nearby, and a share of it anywhere.

    Nearby is within about half a contact's length.
    """
    order = np.fft.rfftfreq(GRID.size, 1.0 / GRID.size)
    gain = np.exp(-0.5 * (half_angle[:, None] * order) ** 2)
    here = np.maximum(np.fft.irfft(np.fft.rfft(square) * gain, n=GRID.size), 0.0)
    mean = np.mean(square, axis=1, keepdims=True)
    return np.asarray(np.sqrt(ANYWHERE * mean + (1.0 - ANYWHERE) * here))
