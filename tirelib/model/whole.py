"""The model with large displacements, solved at operating points, and its slopes.

The waveform is that of the exact ring, plus what damping and effects change in the linear one:

    m = m_exact + m_linear(damping, effects) - m_linear(neither).

Without either the linear ring is not computed at all. The slopes of the exact part come from its
own equations (`tirelib.contact.exact_slopes`), those of the rest from differences.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.contact.exact import ExactContact, load_exact
from tirelib.contact.exact_slopes import ExactSlopes, exact_slopes
from tirelib.errors import ParameterError
from tirelib.model.base import Coordinate, Correction, CorrectionSlopes, predict, smoothed
from tirelib.model.chain import Changes
from tirelib.model.state import Operating, State
from tirelib.signal import LowPass
from tirelib.waveforms import GRID

Values = Mapping[str, float | FloatArray]
STEP = 1e-4
"""Of differences of the linear ring."""
FINE = 1e-6
"""Of differences of the constants, which are smooth in everything."""
HELD = ("radius", "free_radius", "thickness", "hardening")
"""Constants that the slopes of the exact ring take as given."""


@dataclass(frozen=True, slots=True)
class Whole:
    """The solved model.

    Attributes
    ----------
    waveform : shape (n_points, n_phi), [-]
    deflection : shape (n_points,), [m]
    contact : ExactContact or None
        None for the linear ring alone.
    """

    waveform: FloatArray
    deflection: FloatArray
    contact: ExactContact | None


@dataclass(frozen=True, slots=True)
class WholeSlopes:
    """Slopes of the solved model; the last two directions are relative load and pressure.

    Attributes
    ----------
    waveform : shape (n_free + 2, n_points, n_phi)
    deflection : shape (n_free + 2, n_points)
    contact : ExactSlopes or None
    """

    waveform: FloatArray
    deflection: FloatArray
    contact: ExactSlopes | None

    def start(self, found: Whole, dz: FloatArray) -> ExactContact | None:
        """Return a first guess of the contact after a move (n_free,) of the free coordinates."""
        if found.contact is None or self.contact is None:
            return None
        return self.contact.moved(found.contact, np.append(dz, [0.0, 0.0]))


def solve_whole(
    values: Values,
    points: Operating,
    changes: Changes = (),
    *,
    low_pass: LowPass | None = None,
    start: ExactContact | None = None,
    exact: bool = True,
) -> Whole:
    """Return the solved model at operating points.

    Parameters
    ----------
    values : mapping
        Of a tire.
    points : Operating
    changes : sequence of (stage, change)
        Effects.
    low_pass : LowPass
    start : ExactContact, optional
        A solution nearby.
    exact : bool
        False leaves large displacements out.

    Raises
    ------
    ParameterError, ConvergenceError
        From ring and contact.
    """
    low_pass = low_pass or LowPass()
    if not exact:
        state = predict(values, points, changes, low_pass=low_pass)
        return Whole(state.wave, state.deflection, None)
    state = State.of(values, points, GRID)
    ring = replace(state.ring, shear_stiffness=np.inf)
    solved = load_exact(ring, state.tread, points.load, start=start)
    wave = smoothed(solved.strain(state.offset, GRID), points, low_pass)
    depth = solved.deflection
    if _lively(values, changes):
        more, deeper = _beside(values, points, changes, low_pass)
        wave, depth = wave + more, depth + deeper
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

    Raises
    ------
    ParameterError
        If a coordinate moves what the slopes of the exact ring take as given (`HELD`).
    """
    low_pass = low_pass or LowPass()
    if found.contact is None:
        return _differences(values, points, free, changes, low_pass)
    slopes = _exact(found.contact, values, points, free, low_pass)
    if not _lively(values, changes):
        return slopes
    full = _differences(values, points, free, changes, low_pass)
    still = _differences(_still(values), points, free, (), low_pass)
    return WholeSlopes(
        slopes.waveform + full.waveform - still.waveform,
        slopes.deflection + full.deflection - still.deflection,
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
    """Return what large displacements add with its slopes by the free coordinates.

    Parameters
    ----------
    found : Correction
        `large_displacements` of the same values and points.
    free : tuple of Coordinate

    Raises
    ------
    ParameterError
        If a coordinate moves what the slopes of the exact ring take as given (`HELD`), or the
        correction is without its contact.
    """
    if found.contact is None:
        raise ParameterError("model: a correction without its contact has no slopes; compute it")
    low_pass, k = low_pass or LowPass(), len(free)
    exact = _exact(found.contact, values, points, free, low_pass)
    still = _differences(_still(values), points, free, (), low_pass)
    assert exact.contact is not None  # noqa: S101 - of the exact ring
    slopes = CorrectionSlopes(
        exact.waveform[:k] - still.waveform[:k],
        exact.deflection[:k] - still.deflection[:k],
        exact.contact,
    )
    return replace(found, slopes=slopes)


def _exact(
    solved: ExactContact,
    values: Values,
    points: Operating,
    free: tuple[Coordinate, ...],
    low_pass: LowPass,
) -> WholeSlopes:
    """Return the slopes of the static exact ring, from its own equations."""
    n, k = len(points), len(free) + 2
    columns, several = _shifted(values, points, free, FINE)
    state = State.of(columns, several, GRID)
    _check_held(state, free, k, n)
    constants = [
        state.EA, state.EI, state.tension_pressure * state.width, state.k_u, state.k_v, state.k_t,
        several.load, state.offset,
    ]  # fmt: skip
    rows = np.stack([np.asarray(c).reshape(k + 1, n) for c in constants], axis=2)
    finite = np.where(np.isinf(rows), 0.0, rows)  # an infinite EA does not move
    moves = (finite[1:] - finite[0]) / FINE
    by = exact_slopes(solved, moves[..., :-1])
    wave = smoothed(by.strain(solved, rows[0, :, -1], moves[..., -1], GRID), points, low_pass)
    return WholeSlopes(wave, by.deflection, by)


def _lively(values: Values, changes: Changes) -> bool:
    """Return whether damping or effects make the model differ from the static exact ring."""
    return bool(changes) or bool(np.any(values["damping"]))


def _still(values: Values) -> dict[str, float | FloatArray]:
    return {**values, "damping": 0.0}


def _beside(
    values: Values, points: Operating, changes: Changes, low_pass: LowPass
) -> tuple[FloatArray, FloatArray]:
    """Return what damping and effects change in waveform and deflection of the linear ring."""
    full = predict(values, points, changes, low_pass=low_pass)
    still = predict(_still(values), points, low_pass=low_pass)
    return full.wave - still.wave, full.deflection - still.deflection


def _shifted(
    values: Values, points: Operating, free: tuple[Coordinate, ...], step: float
) -> tuple[dict[str, float | FloatArray], Operating]:
    """Return values and points of copies: plain, each coordinate moved, load, pressure."""
    n, k = len(points), len(free) + 2
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


def _differences(
    values: Values,
    points: Operating,
    free: tuple[Coordinate, ...],
    changes: Changes,
    low_pass: LowPass,
) -> WholeSlopes:
    """Return slopes of the linear ring: shifted copies, all in one batch."""
    columns, several = _shifted(values, points, free, STEP)
    state = predict(columns, several, changes, low_pass=low_pass)
    rows = len(free) + 3
    waves, depth = state.wave.reshape(rows, len(points), -1), state.deflection.reshape(rows, -1)
    return WholeSlopes((waves[1:] - waves[0]) / STEP, (depth[1:] - depth[0]) / STEP, None)


def _check_held(state: State, free: tuple[Coordinate, ...], k: int, n: int) -> None:
    for name in HELD:
        rows = np.asarray(getattr(state, name)).reshape(k + 1, n)
        moved = np.flatnonzero((rows != rows[0]).any(axis=1))
        if moved.size:
            raise ParameterError(
                f"model: {free[moved[0] - 1].name} moves the ring's {name}, by which the exact "
                "ring has no slopes; fit belt, sidewall, tread stiffness and offset only"
            )
