"""Strain of all gages over the wheel angle, from the strips on the road.

Each gage reads its strip's bending (`tirelib.physics.strain.innerliner`), the lateral bending of
the whole belt, and, if given, what the tread's shear adds
(`tirelib.physics.strain.tread_traction`). The result is the same type that a measurement gives,
with the same conventions:

- the low-pass is the Gaussian of `tirelib.measured.signal.lowpass`; over harmonics it is a factor;
- wheel angle zero is the middle of the centre gage's pulse, found in the unfiltered strain at the
  level that `tirelib.measured.signal.contacts` uses;
- `axis_shift` is where a trigger that marks the gages at the wheel's top would see it: the model's
  angle is a place in space, and under drive or brake the gage at the road runs ahead of or behind
  the gage at the top by (v(0) - v(pi)) / R;
- a gage has an unknown zero: the strain opposite the contact, or the mean of the turn, is taken
  off.
"""

from typing import Literal

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.core.traces import StrainTrace, TraceConditions
from tirelib.measured.signal.contacts import RISE
from tirelib.measured.signal.lowpass import LowPass
from tirelib.measured.signal.turns import OFFSET_HALF_WIDTH, PHI
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.contact.layout import StripContact
from tirelib.physics.ring.ring import ComplexArray
from tirelib.physics.strain.innerliner import strain_harmonics

PULSE_POINTS = 1440
"""Points of the turn at which the pulse is searched; its edges lie between them."""
OPPOSITE_POINTS = 101

Reference = Literal["opposite", "mean"]


def gage_harmonics(
    contact: StripContact, offset: float, tread: ComplexArray | None = None
) -> ComplexArray:
    """Return harmonics of the strain at every gage, shape (n_points, n_gages, n_modes + 1).

    Parameters
    ----------
    contact : StripContact
    offset : [m]
        y of the gages from the neutral line, negative toward the inside.
    tread : shape (n_points, n_gages, n_modes + 1), optional
        Strain that the tread's shear adds.

    Raises
    ------
    ParameterError
        If the offset is not below zero.
    ShapeError
        If `tread` has another shape.
    """
    if not -contact.radius.min() < offset < 0.0:
        raise ParameterError(
            f"gages: offset = {offset:g} m; the innerliner lies inside the neutral line: a number "
            "below 0 and above minus the ring's radius is needed"
        )
    own = strain_harmonics(contact.displacement, contact.radius[:, None], offset)
    total: ComplexArray = own + contact.bending.strain(contact.layout.lateral)
    if tread is None:
        return total
    if tread.shape != total.shape:
        raise ShapeError(
            f"gages: the tread's strain has shape {tread.shape}; (n_points, n_gages, "
            f"n_modes + 1) = {total.shape} is needed"
        )
    return total + tread


def gage_trace(
    contact: StripContact,
    offset: float,
    *,
    speed: FloatArray | None = None,
    low_pass: LowPass | None = None,
    phi: FloatArray = PHI,
    tread: ComplexArray | None = None,
    reference: Reference = "opposite",
) -> StrainTrace:
    """Return the strain trace of every operating point and gage.

    Parameters
    ----------
    contact : StripContact
    offset : [m]
        y of the gages, negative.
    speed : shape (n_points,), optional, [m/s]
        For the trace's conditions; NaN otherwise.
    low_pass : LowPass, optional
        None leaves the strain unfiltered; `LowPass()` is what the measured chain uses.
    phi : shape (n_phi,), [rad]
        Even grid; that of the measured chain by default.
    tread : shape (n_points, n_gages, n_modes + 1), optional
        As for `gage_harmonics`.
    reference : "opposite" or "mean"
        What is taken off as the gage's zero: the median opposite the contact, as the measured
        chain does, or the mean of the turn.

    Raises
    ------
    ParameterError
        If the offset or the reference is not allowed, a cut-off in Hz is asked for a wheel at
        rest, or the centre strip shows no contact.
    ShapeError
        If `tread` has another shape.
    """
    harmonics = gage_harmonics(contact, offset, tread)
    centre = int(np.argmin(np.abs(contact.layout.lateral)))
    if np.isnan(contact.edges[:, centre, 0]).any():
        point = int(np.flatnonzero(np.isnan(contact.edges[:, centre, 0]))[0])
        raise ParameterError(
            f"gages: the centre strip of point {point} is off the road, so the angle has no zero; "
            "lower the camber or raise the load",
            point=point,
        )
    shift, pulse = _pulse(harmonics[:, centre])
    n = np.arange(harmonics.shape[-1])
    turned = harmonics * np.exp(1j * n * shift[:, None])[:, None, :]
    if low_pass is not None:
        sigma = _sigma(low_pass, contact.omega)
        turned = turned * np.exp(-0.5 * (n * sigma[:, None]) ** 2)[:, None, :]
    strain = evaluate(turned, phi)
    strain = strain - _zero(turned, reference)[..., None]
    unknown = np.full(len(contact), np.nan)
    return StrainTrace(
        phi=phi,
        strain=strain,
        rate=evaluate(turned, phi, 1),
        pulse=pulse,
        lateral=contact.layout.lateral,
        axis_shift=shift - _wind(contact, centre, shift),
        conditions=TraceConditions(
            omega=contact.omega,
            speed=unknown if speed is None else np.asarray(speed, dtype=float),
            pressure=contact.pressure,
            camber=contact.camber,
        ),
    )


def _pulse(harmonics: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return middle and half-width of the contact pulse, [rad], each (n_points,)."""
    phi = np.linspace(-np.pi, np.pi, PULSE_POINTS + 1)
    strain = evaluate(harmonics, phi)
    low, high = strain.min(axis=1), strain.max(axis=1)
    level = (low + RISE * (high - low))[:, None]
    above = strain > level
    first = above.argmax(axis=1)
    last = phi.size - 1 - above[:, ::-1].argmax(axis=1)
    row = np.arange(len(strain))

    def cross(low_side: FloatArray, high_side: FloatArray, at: FloatArray) -> FloatArray:
        out: FloatArray = at + (level[:, 0] - low_side) / (high_side - low_side)
        return out

    step = phi[1] - phi[0]
    rise = cross(strain[row, first - 1], strain[row, first], first - 1.0)
    fall = last + (strain[row, last] - level[:, 0]) / (strain[row, last] - strain[row, last + 1])
    middle = phi[0] + step * 0.5 * (rise + fall)
    return middle, 0.5 * step * (fall - rise)


def _wind(contact: StripContact, centre: int, shift: FloatArray) -> FloatArray:
    """Return how far the belt at the road runs ahead of the belt at the top, [rad]."""
    places = np.stack([shift, np.full_like(shift, np.pi)], axis=1)
    v = evaluate(contact.displacement[:, centre, :, 1], places)
    out: FloatArray = (v[:, 0] - v[:, 1]) / contact.radius
    return out


def _sigma(low_pass: LowPass, omega: FloatArray) -> FloatArray:
    """Return the filter's standard deviation in wheel angle, [rad], (n_points,)."""
    if low_pass.cut_off is not None and (omega == 0.0).any():
        raise ParameterError(
            "gages: a cut-off in Hz has no meaning for a wheel at rest; use an order"
        )
    turn_rate = np.where(omega == 0.0, 1.0, np.abs(omega)) / (2.0 * np.pi)
    return np.array([low_pass.sigma(float(rate)) for rate in turn_rate])


def _zero(turned: ComplexArray, reference: Reference) -> FloatArray:
    """Return what a gage takes for its zero, (n_points, n_gages)."""
    if reference == "mean":
        return turned[..., 0].real
    if reference == "opposite":
        half = np.linspace(-OFFSET_HALF_WIDTH, OFFSET_HALF_WIDTH, OPPOSITE_POINTS)
        middle: FloatArray = np.median(evaluate(turned, np.pi + half), axis=-1)
        return middle
    raise ParameterError(f"gages: reference = {reference!r}; allowed are 'opposite' and 'mean'")
