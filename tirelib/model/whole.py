"""The model of a tire, solved at operating points, and its slopes.

The waveform is that of the rolling ring (`tirelib.rolling`), plus what damping and effects change
in the linear one:

    m = m_rolling + m_linear(damping, effects) - m_linear(neither).

Without either the linear ring is not computed at all. The slopes of the rolling ring come from its
own equations, those of the rest from differences.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.errors import ParameterError
from tirelib.model.base import Coordinate, Correction, CorrectionSlopes, predict, smoothed
from tirelib.model.chain import Changes
from tirelib.model.rolled import STEP, Made, RolledSlopes, made_of, rolled_slopes
from tirelib.model.state import Operating
from tirelib.rolling.assemble import Unknowns
from tirelib.rolling.solve import Rolling, Start, solve
from tirelib.signal import LowPass
from tirelib.waveforms import GRID

Values = Mapping[str, float | FloatArray]
LINEAR_STEP = 1e-4
"""Relative step of the finite differences of the linear ring."""


@dataclass(frozen=True, slots=True)
class Whole:
    """The solved model.

    Attributes
    ----------
    waveform : shape (n_points, n_phi), [-]
    deflection : shape (n_points,), [m]
    contact : Rolling or None
        None for the linear ring alone.
    """

    waveform: FloatArray
    deflection: FloatArray
    contact: Rolling | None


@dataclass(frozen=True, slots=True)
class WholeSlopes:
    """Slopes of the solved model; the last two directions are relative load and pressure.

    Attributes
    ----------
    waveform : shape (n_free + 2, n_points, n_phi)
    deflection : shape (n_free + 2, n_points)
    contact : RolledSlopes or None
    """

    waveform: FloatArray
    deflection: FloatArray
    contact: RolledSlopes | None

    def start(self, found: Whole, dz: FloatArray) -> Unknowns | None:
        """Return a first guess of the contact after a move (n_free,) of the free coordinates."""
        if found.contact is None or self.contact is None:
            return None
        return self.contact.start(found.contact, dz)


def solve_whole(
    values: Values,
    points: Operating,
    changes: Changes = (),
    *,
    low_pass: LowPass | None = None,
    start: Start | None = None,
    exact: bool = True,
) -> Whole:
    """Return the solved model at operating points.

    Parameters
    ----------
    values : mapping
        Parameters of a tire.
    points : Operating
    changes : sequence of (stage, change)
        Effects.
    low_pass : LowPass
    start : Rolling or Unknowns, optional
        A solution nearby.
    exact : bool
        False takes the linear ring alone.

    Raises
    ------
    ParameterError, ConvergenceError
        From ring and contact.
    """
    low_pass = low_pass or LowPass()
    if not exact:
        state = predict(values, points, changes, low_pass=low_pass)
        return Whole(state.wave, state.deflection, None)
    made = made_of(values, points)
    solved = solve(made.constants, start=start)
    wave = smoothed(solved.strain(made.gage, GRID.size), points, low_pass)
    depth = solved.deflection
    if _lively(values, changes):
        full = predict(values, points, changes, low_pass=low_pass)
        plain = predict(_still(values), points, low_pass=low_pass)
        wave = wave + full.wave - plain.wave
        depth = depth + full.deflection - plain.deflection
    return Whole(wave, depth, solved)


def whole_slopes(
    found: Whole,
    values: Values,
    points: Operating,
    free: tuple[Coordinate, ...],
    changes: Changes = (),
    *,
    low_pass: LowPass | None = None,
) -> WholeSlopes:
    """Return the slopes of a solved model by the free coordinates, relative load and pressure.

    Parameters
    ----------
    found : Whole
        `solve_whole` of the same values, points and changes.
    free : tuple of Coordinate
    """
    low_pass = low_pass or LowPass()
    if found.contact is None:
        return _differences(values, points, free, changes, low_pass)
    slopes = _rolling(found.contact, values, points, free, low_pass)
    if not _lively(values, changes):
        return slopes
    full = _differences(values, points, free, changes, low_pass)
    plain = _differences(_still(values), points, free, (), low_pass)
    return WholeSlopes(
        slopes.waveform + full.waveform - plain.waveform,
        slopes.deflection + full.deflection - plain.deflection,
        slopes.contact,
    )


def with_slopes(
    found: Correction,
    values: Values,
    points: Operating,
    free: tuple[Coordinate, ...],
    *,
    low_pass: LowPass | None = None,
) -> Correction:
    """Return a correction of the linear ring with its slopes by the free coordinates.

    Parameters
    ----------
    found : Correction
        `large_displacements` of the same values and points.
    free : tuple of Coordinate

    Raises
    ------
    ParameterError
        If the correction is without its contact.
    """
    if found.contact is None:
        raise ParameterError("model: a correction without its contact has no slopes; compute it")
    low_pass, k = low_pass or LowPass(), len(free)
    whole = _rolling(found.contact, values, points, free, low_pass)
    plain = _differences(_still(values), points, free, (), low_pass)
    assert whole.contact is not None  # noqa: S101 - of the rolling ring
    slopes = CorrectionSlopes(
        whole.waveform[:k] - plain.waveform[:k],
        whole.deflection[:k] - plain.deflection[:k],
        whole.contact,
    )
    return replace(found, slopes=slopes)


def _lively(values: Values, changes: Changes) -> bool:
    """Return whether damping or effects make the model differ from the rolling ring."""
    return bool(changes) or bool(np.any(values["damping"]))


def _still(values: Values) -> dict[str, float | FloatArray]:
    return {**values, "damping": 0.0}


def _rolling(
    solved: Rolling,
    values: Values,
    points: Operating,
    free: tuple[Coordinate, ...],
    low_pass: LowPass,
) -> WholeSlopes:
    """Return the slopes of the rolling ring, from its own equations."""
    there: list[Made] = []
    for coordinate in free:
        moved = coordinate.moved(np.asarray(values[coordinate.name], dtype=float), STEP)
        there.append(made_of({**values, coordinate.name: moved}, points))
    there.append(made_of(values, replace(points, load=points.load * (1.0 + STEP))))
    there.append(made_of(values, replace(points, pressure=points.pressure * (1.0 + STEP))))
    by = rolled_slopes(solved, made_of(values, points), there, STEP, GRID.size)
    return WholeSlopes(smoothed(by.strain, points, low_pass), by.deflection, by)


def _differences(
    values: Values,
    points: Operating,
    free: tuple[Coordinate, ...],
    changes: Changes,
    low_pass: LowPass,
) -> WholeSlopes:
    """Return slopes of the linear ring: shifted copies, all in one batch."""
    columns, several = _shifted(values, points, free)
    state = predict(columns, several, changes, low_pass=low_pass)
    rows = len(free) + 3
    waves, depth = state.wave.reshape(rows, len(points), -1), state.deflection.reshape(rows, -1)
    return WholeSlopes(
        (waves[1:] - waves[0]) / LINEAR_STEP, (depth[1:] - depth[0]) / LINEAR_STEP, None
    )


def _shifted(
    values: Values, points: Operating, free: tuple[Coordinate, ...]
) -> tuple[dict[str, float | FloatArray], Operating]:
    """Return values and points of copies: plain, each coordinate moved, load, pressure."""
    n, k, step = len(points), len(free) + 2, LINEAR_STEP
    columns = dict(values)
    for j, coordinate in enumerate(free):
        z = np.zeros((k + 1, 1))
        z[j + 1] = step
        value = np.broadcast_to(np.asarray(values[coordinate.name], dtype=float), (n,))
        moved = np.broadcast_to(coordinate.moved(value, z), (k + 1, n))
        columns[coordinate.name] = np.ascontiguousarray(moved).ravel()
    several = points.tiled(k + 1)
    load, pressure = several.load.copy(), several.pressure.copy()
    load[(k - 1) * n : k * n] *= 1.0 + step
    pressure[k * n :] *= 1.0 + step
    return columns, replace(several, load=load, pressure=pressure)
