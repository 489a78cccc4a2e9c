r"""Contact angles of runs from strain-rate peaks, with the bias of that reading taken off.

The rate of the innerliner's strain peaks where the bending moment of the belt changes fastest. That
is near the contact's edge and not on it: for a contact through tread springs the peaks lie inside
the edges by some hundredths of a radian (dissertation, Fig. 6-12), nearly independent of the load,
so that a short contact is read short by a fifth. The same model that gives the rate also knows its
edges; the difference at the same condition is the bias,

.. math:: b = \varphi_{peak} - \varphi_{edge}, \qquad \varphi_{edge} = \varphi_{read} - b.

The filter of the signal chain is part of the model. The zero of the wheel angle shifts both edges
alike: it belongs to the middle's deviation, never to that of the length.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from routes.correction import Correction, predict_with
from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError, ShapeError
from tirelib.effects.state import Operating
from tirelib.measured.features.peaks import peak
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import predict, smoothed
from tirelib.physics.contact.exact import load_exact

FINER = 4
"""Grid refinement (by Fourier series, exact for the filtered strain) before peaks are read."""
REACH = 1.0
"""How far from the road's normal an edge is looked for, [rad]."""
PEAK_REACH = 0.7
"""How far outside an edge its compressive peak is looked for, [rad]."""
SMALLEST_SWING = 2e-5
"""Strain swing of a waveform below which the gage shows no contact."""
STRUCTURE = 0.15
"""Share of the bias that a ring does not know (shear, crown, strips), as a standard deviation."""

PLAUSIBLE: Mapping[str, float] = {
    "bending_stiffness": 0.3,
    "tread_stiffness": 0.3,
    "radial_stiffness": 0.2,
    "tangential_stiffness": 0.4,
}
"""Relative standard deviations over which the spread of the bias is taken, unless given."""


@dataclass(frozen=True, slots=True)
class EdgeReading:
    """What is read from waveforms; arrays of shape (n_runs,), [rad].

    Attributes
    ----------
    lead, trail : largest and smallest strain rate
    first_peak, second_peak : compressive peaks before and after the contact
    noise : standard deviation of one edge's reading by the waveform's noise; NaN where unknown
    """

    lead: FloatArray
    trail: FloatArray
    first_peak: FloatArray
    second_peak: FloatArray
    noise: FloatArray

    @property
    def half(self) -> FloatArray:
        """Half the contact angle as read."""
        return 0.5 * (self.trail - self.lead)

    @property
    def middle(self) -> FloatArray:
        """Middle of the two rate peaks."""
        return 0.5 * (self.trail + self.lead)

    @property
    def peak_distance(self) -> FloatArray:
        """Mean distance of the compressive peaks from the rate peaks beside them."""
        return 0.5 * (self.second_peak - self.first_peak) - self.half

    @property
    def lag(self) -> FloatArray:
        """Middle of the rate peaks less that of the compressive peaks; free of the angle's zero."""
        return self.middle - 0.5 * (self.first_peak + self.second_peak)


@dataclass(frozen=True, slots=True)
class ModelEdges:
    """True edges of the model and their reading from its strain.

    Attributes
    ----------
    edges : shape (n_points, 2), [rad]
    reading : EdgeReading
    deflection : shape (n_points,), [m]
    """

    edges: FloatArray
    reading: EdgeReading
    deflection: FloatArray

    @property
    def bias(self) -> FloatArray:
        """Reading less true edge, shape (n_points, 2), [rad]."""
        return np.stack([self.reading.lead, self.reading.trail], axis=1) - self.edges


@dataclass(frozen=True, slots=True)
class EdgeBias:
    """Bias of the reading, one row per run.

    Attributes
    ----------
    bias : shape (n_runs, 2), [rad]
        Reading less true edge; positive at the leading edge: read inside.
    spread : shape (n_parameters, n_runs, 2), [rad]
        Its change by one standard deviation of each parameter; common to all runs.
    parameters : tuple of str
    structure : shape (n_runs,), [rad]
        What no ring knows of it, per edge.
    """

    bias: FloatArray
    spread: FloatArray
    parameters: tuple[str, ...]
    structure: FloatArray

    @property
    def half(self) -> FloatArray:
        """Bias of half the contact angle, shape (n_runs,), [rad]; negative: read too short."""
        return 0.5 * (self.bias[:, 1] - self.bias[:, 0])

    @property
    def half_std(self) -> FloatArray:
        """Standard deviation of the half angle's bias, shape (n_runs,), [rad]."""
        spread = 0.5 * (self.spread[..., 1] - self.spread[..., 0])
        out: FloatArray = np.sqrt(np.sum(spread**2, axis=0) + self.structure**2)
        return out


@dataclass(frozen=True, slots=True)
class Edges:
    """Contact angles of runs, as read and corrected; arrays of shape (n_runs,), [rad].

    Attributes
    ----------
    run : run numbers
    reading : EdgeReading
    bias : EdgeBias
    half, half_std : corrected half contact angle
    middle, middle_std : corrected middle; the deviation holds the angle's zero
    """

    run: FloatArray
    reading: EdgeReading
    bias: EdgeBias
    half: FloatArray
    half_std: FloatArray
    middle: FloatArray
    middle_std: FloatArray

    @property
    def edges(self) -> FloatArray:
        """Leading and trailing edge, shape (n_runs, 2)."""
        return np.stack([self.middle - self.half, self.middle + self.half], axis=1)


def read_edges(
    strain: FloatArray,
    *,
    low_pass: LowPass | None = None,
    noise: FloatArray | None = None,
    labels: Sequence[object] = (),
) -> EdgeReading:
    """Read edges and compressive peaks from waveforms over `GRID`.

    Parameters
    ----------
    strain : shape (n_runs, n_phi), [-]
    low_pass : LowPass, optional
        The filter that the waveforms went through; its width turns noise into angle.
    noise : shape (n_runs,), optional
        Standard deviation of a sample of each mean waveform, [-].
    labels : sequence
        Run numbers, for messages.

    Raises
    ------
    ShapeError
        If the waveforms do not lie on the grid.
    CalibrationError
        If a waveform shows no contact, or its peaks stand at the border of the search.
    """
    if strain.ndim != 2 or strain.shape[1] != GRID.size:
        raise ShapeError(
            f"edges: waveforms of shape {strain.shape}; (n_runs, {GRID.size}) over the whole turn "
            "are needed"
        )
    _refuse_flat(strain, labels)
    count = FINER * GRID.size
    phi = GRID[0] + 2.0 * np.pi / count * np.arange(count)
    spacing = 2.0 * np.pi / count
    fine, rate, jerk = (_derivative(strain, k, count) for k in (0, 1, 3))

    def highest(y: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, BoolArray]:
        allowed = (phi > np.reshape(low, (-1, 1))) & (phi < np.reshape(high, (-1, 1)))
        at, _, border = peak(y, np.broadcast_to(allowed, y.shape), float(phi[0]), spacing)
        return at, border

    zero = np.zeros(len(strain))
    lead, weak = highest(rate, zero - REACH, zero)
    trail, weak2 = highest(-rate, zero, zero + REACH)
    first, weak3 = highest(-fine, lead - PEAK_REACH, lead)
    second, weak4 = highest(-fine, trail, trail + PEAK_REACH)
    bad = np.flatnonzero(weak | weak2 | weak3 | weak4)
    if bad.size:
        raise CalibrationError(
            f"run {_label(labels, int(bad[0]))}: no distinct strain-rate or compressive peak "
            f"within {REACH:g} rad of the road's normal; look at its waveform, leave out the "
            "run or mend the gage"
        )
    index = np.clip(np.round((lead - phi[0]) / spacing).astype(int), 0, count - 1)
    steep = np.abs(jerk[np.arange(len(strain)), index])
    given = np.full(len(strain), np.nan) if noise is None else noise
    # second derivative of noise that the Gaussian has smoothed: sqrt(3)/2 / sigma^2
    sigma = (low_pass or LowPass()).sigma(1.0)
    return EdgeReading(lead, trail, first, second, given * 0.866 / sigma**2 / steep)


def model_edges(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    *,
    low_pass: LowPass | None = None,
    correction: Correction | None = None,
) -> ModelEdges:
    """Return the model's edges and their reading from its strain at operating points.

    With a correction for large displacements the strain is that of the exact ring, while the edges
    stay those of the linear one: the bias then leads from a reading to the edges that the linear
    contact needs.
    """
    state = predict_with(correction, values, points, low_pass=low_pass)
    assert state.contact is not None  # noqa: S101
    reading = read_edges(state.wave, low_pass=low_pass)
    return ModelEdges(state.contact.edges, reading, state.deflection)


def edge_bias(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    *,
    plausible: Mapping[str, float] | None = None,
    low_pass: LowPass | None = None,
    correction: Correction | None = None,
) -> EdgeBias:
    """Return the bias of the reading at operating points and what is unsure about it.

    Parameters
    ----------
    values : mapping
        Numbers of a tire.
    points : Operating
    plausible : mapping of str to float
        Relative standard deviation by parameter; the default is `PLAUSIBLE`.
    low_pass, correction
        As for `model_edges`.
    """
    spread = dict(PLAUSIBLE if plausible is None else plausible)
    names = tuple(spread)
    n, copies = len(points), len(names) + 1
    many = dict(values)
    for k, name in enumerate(names):
        scale = np.ones((copies, 1))
        scale[k + 1] = np.exp(spread[name])
        column = np.broadcast_to(np.asarray(values[name], dtype=float), (n,))
        many[name] = (scale * column).ravel()
    tiled = correction.tiled(copies) if correction is not None else None
    found = model_edges(many, points.tiled(copies), low_pass=low_pass, correction=tiled)
    bias = found.bias.reshape(copies, n, 2)
    structure = STRUCTURE * np.abs(bias[0]).mean(axis=1)
    return EdgeBias(bias[0], bias[1:] - bias[0], names, structure)


def bias_curve(
    values: Mapping[str, float | FloatArray],
    point: Operating,
    loads: FloatArray,
    *,
    low_pass: LowPass | None = None,
    exact: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Return true half angles and the half angle's bias over loads at one condition (Fig. 6-12).

    Parameters
    ----------
    point : Operating
        One operating point; its load is replaced.
    loads : shape (n,), [N]
    exact : bool
        Take both from the ring with large displacements (without damping), else the linear one.

    Returns
    -------
    half, bias : shape (n,), [rad]
    """
    points = replace(point.tiled(loads.size), load=np.asarray(loads, dtype=float))
    if not exact:
        found = model_edges(values, points, low_pass=low_pass)
        half = 0.5 * (found.edges[:, 1] - found.edges[:, 0])
        return half, found.reading.half - half
    still = {**values, "damping": 0.0, "shear_stiffness": np.inf}
    state = predict(still, points, low_pass=low_pass)
    solved = load_exact(state.ring, state.tread, points.load)
    strain = smoothed(solved.strain(state.offset, GRID), points, low_pass or LowPass())
    return solved.half_angle, read_edges(strain).half - solved.half_angle


def corrected(
    run: FloatArray, reading: EdgeReading, bias: EdgeBias, angle_std: FloatArray
) -> Edges:
    """Return contact angles with the bias taken off.

    Parameters
    ----------
    run : shape (n_runs,)
    reading : EdgeReading
    bias : EdgeBias
    angle_std : shape (n_runs,), [rad]
        Standard deviation of the angle's zero; infinite without a trigger.
    """
    noise = np.nan_to_num(reading.noise)
    shift = 0.5 * bias.bias.sum(axis=1)
    middle_spread = np.sum((0.5 * bias.spread.sum(axis=2)) ** 2, axis=0)
    return Edges(
        run,
        reading,
        bias,
        reading.half - bias.half,
        np.sqrt(0.5 * noise**2 + bias.half_std**2),
        reading.middle - shift,
        np.sqrt(0.5 * noise**2 + middle_spread + angle_std**2),
    )


def _refuse_flat(strain: FloatArray, labels: Sequence[object]) -> None:
    swing = np.ptp(strain, axis=1)
    bad = np.flatnonzero(~(swing > SMALLEST_SWING))
    if bad.size:
        first = int(bad[0])
        raise CalibrationError(
            f"run {_label(labels, first)}: the strain waveform swings by "
            f"{1e6 * swing[first]:.1f} microstrain over the turn; a contact gives thousands, more "
            f"than {1e6 * SMALLEST_SWING:.0f} is needed; the gage is off or its channel is wrong"
        )


def _derivative(strain: FloatArray, order: int, count: int) -> FloatArray:
    """Return a derivative of periodic waveforms by Fourier series, on a finer grid."""
    n = strain.shape[1]
    spectrum = np.fft.rfft(strain, axis=1)
    wave = np.fft.rfftfreq(n, 1.0 / n)
    spectrum[:, -1] = 0.0
    out: FloatArray = np.fft.irfft(spectrum * (1j * wave) ** order, n=count, axis=1) * (count / n)
    return out


def _label(labels: Sequence[object], index: int) -> object:
    return labels[index] if len(labels) > index else index
