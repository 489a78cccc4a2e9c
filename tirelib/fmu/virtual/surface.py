"""The response surface: strain over the wheel angle as a smooth function of the condition.

A waveform is moved to a common contact, written in principal components, and its scores are
interpolated over the rig's solutions and their mirror images by radial basis functions.
"""

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.ndimage import spline_filter1d

from tirelib.arrays import FloatArray
from tirelib.errors import FormatError
from tirelib.fmu.virtual.coordinates import (
    INPUTS,
    LOAD,
    MIRRORED,
    PRESSURE,
    SPEED,
    coordinates,
    half_angle,
    warped,
)  # fmt: skip

FORMAT = "tirelib-virtual-tire/2"
FORCES = ("Fx", "Fy", "Mz", "loaded_radius")
"""What is interpolated beside the strain."""
_FORCE_MIRROR = np.array([1.0, -1.0, -1.0, 1.0])
KERNEL: Final = "quintic"
DEGREE: Final = 2
"""Of `scipy.interpolate.RBFInterpolator`."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Everything that a virtual tire knows, as it stands in a file.

    Attributes
    ----------
    lateral : array, shape (g,), [m]
        Lateral positions of the gages, y to the left; symmetric.
    low, high : array, shape (6,)
        Range of the inputs `INPUTS`, SI.
    slip, scales : array, shapes (4,) and (8,)
        Of `coordinates`.
    points : array, shape (n, 6)
        Conditions of the rig's solutions, SI.
    even, odd : array, shapes (n, a) and (n, b)
        Scores of the components that are alike in the mirror image, and of those that turn sign.
    edges : array, shape (n, 2, g)
        Squared half contact angle and middle of the contact [rad^2], [rad].
    forces : array, shape (n, 4)
        `FORCES` at the points, SI.
    mean : array, shape (m, g)
        Mean waveform over an even grid of angles that starts at -pi.
    basis : array, shape (a + b, m, g)
        The components.
    rolling : array, shape (20,)
        Coefficients of R_e [m]; see `rolling_radius`.
    about : mapping
        Where it comes from, and its errors.
    """

    lateral: FloatArray
    low: FloatArray
    high: FloatArray
    slip: FloatArray
    scales: FloatArray
    points: FloatArray
    even: FloatArray
    odd: FloatArray
    edges: FloatArray
    forces: FloatArray
    mean: FloatArray
    basis: FloatArray
    rolling: FloatArray
    about: Mapping[str, Any]

    @cached_property
    def _interpolator(self) -> RBFInterpolator:
        n = len(self.points)
        mirror = self.edges[:, :, ::-1]
        values = np.concatenate((
            np.hstack((self.even, self.odd, self.edges.reshape(n, -1), self.forces)),
            np.hstack((self.even, -self.odd, mirror.reshape(n, -1), self.forces * _FORCE_MIRROR)),
        ))  # fmt: skip
        places = coordinates(
            np.concatenate((self.points, self.points * MIRRORED)), self.slip.tolist(), self.scales
        )
        return RBFInterpolator(places, values, kernel=KERNEL, degree=DEGREE)

    @cached_property
    def _spline(self) -> FloatArray:
        """Coefficients of cubic B-splines of the components, the mean last, shape (m, g, k + 1)."""
        both = np.concatenate((self.basis, self.mean[None]))
        found = spline_filter1d(np.moveaxis(both, 0, 2), axis=0, mode="grid-wrap")
        return np.ascontiguousarray(found)

    def warm(self) -> "Surface":
        """Do now what would be done at the first use."""
        _ = self._interpolator, self._spline
        return self

    def outside(self, inputs: FloatArray) -> tuple[str, ...]:
        """Return the names of the inputs that are out of range, or no numbers."""
        good = (inputs >= self.low) & (inputs <= self.high)
        return tuple(name for name, fine in zip(INPUTS, good, strict=True) if not fine)

    def answers(self, inputs: FloatArray) -> FloatArray:
        """Return scores, edges and forces of conditions, shape (n, 6), in one table with n rows.

        Nothing is checked: ask `outside` first.
        """
        found: FloatArray = self._interpolator(coordinates(inputs, self.slip.tolist(), self.scales))
        return found

    def forces_of(self, answers: FloatArray) -> FloatArray:
        """Return Fx, Fy [N], Mz [N m] and the loaded radius [m], shape (n, 4)."""
        return answers[:, -len(FORCES) :]

    def waveform(self, answers: FloatArray) -> FloatArray:
        """Return spline coefficients of one condition, shape (m, g), for `strain` at many angles.

        Parameters
        ----------
        answers : array, shape (1, ...)
            Of `answers`.
        """
        scores = answers[0, : len(self.basis)]
        return np.asarray(self._spline[:, :, :-1] @ scores + self._spline[:, :, -1])

    def strain(
        self, answers: FloatArray, angle: FloatArray, waveform: FloatArray | None = None
    ) -> FloatArray:
        """Return the strain of every gage, shape (n, g).

        Parameters
        ----------
        answers : array, shape (n, ...) or (1, ...)
            Of `answers`; one row serves all angles.
        angle : array, shape (n,), [rad]
            Wheel angle of the gages: 0 over the road, negative before.
        waveform : array, optional
            Of `waveform`, where there is one row: spares the sum over the components.
        """
        k, g = len(self.basis), self.lateral.size
        edges = answers[:, k : k + 2 * g]
        turned = warped(angle[:, None], edges[:, g:], half_angle(edges[:, :g]))
        place = (turned + np.pi) * (len(self.mean) / (2.0 * np.pi))
        first = np.floor(place)
        rows = (first.astype(np.intp)[..., None] + np.arange(-1, 3)) % len(self.mean)
        weights = _weights(place - first)
        gage = np.arange(g)[:, None]
        if waveform is not None:
            return np.asarray((waveform[rows, gage] * weights).sum(axis=2))
        scores = np.ones((len(answers), 1, k + 1))
        scores[:, 0, :k] = answers[:, :k]
        values = np.matmul(weights[..., None, :], self._spline[rows, gage])[..., 0, :]
        return np.asarray((values * scores).sum(axis=2))

    @cached_property
    def _rolling(self) -> list[tuple[float, int, int, int]]:
        return [
            (value, *powers) for value, powers in zip(self.rolling.tolist(), POWERS, strict=True)
        ]

    def rolling_radius(self, load: float, speed: float, pressure: float) -> float:
        """Return R_e [m]: a polynomial of third degree, see `radius_terms`."""
        x, y, z = (load / LOAD) ** 0.5, 0.5 * (speed / SPEED) ** 2, pressure / PRESSURE
        return float(sum(value * x**a * y**b * z**c for value, a, b, c in self._rolling))


POWERS = tuple((a, b, c) for a in range(4) for b in range(4 - a) for c in range(4 - a - b))
"""Powers of the terms of R_e."""


def radius_terms(inputs: FloatArray) -> FloatArray:
    """Return the terms of R_e, shape (n, 20).

    x^a y^b z^c with x = sqrt(Fz / 4 kN), y = (speed / 20 m/s)^2 / 2, z = pressure / 2.4 bar.
    """
    x = np.sqrt(inputs[:, 0] / LOAD)
    y, z = 0.5 * (inputs[:, 4] / SPEED) ** 2, inputs[:, 5] / PRESSURE
    return np.stack([x**a * y**b * z**c for a, b, c in POWERS], axis=1)


def _weights(t: FloatArray) -> FloatArray:
    """Return the four weights of a cubic B-spline, in a new last axis."""
    s = 1.0 - t
    return np.stack((
        s**3, 3.0 * t**3 - 6.0 * t**2 + 4.0, 3.0 * s**3 - 6.0 * s**2 + 4.0, t**3
    ), axis=-1) / 6.0  # fmt: skip


_ARRAYS = tuple(name for name in Surface.__dataclass_fields__ if name != "about")
_SINGLE = ("mean", "basis")


def write_surface(surface: Surface, path: Path) -> None:
    """Write a surface; waveforms in single precision."""
    parts = {name: getattr(surface, name) for name in _ARRAYS}
    parts |= {name: parts[name].astype(np.float32) for name in _SINGLE}
    about = json.dumps({"format": FORMAT, **surface.about})
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, about=np.array(about), **parts)


def read_surface(source: Path | bytes) -> Surface:
    """Read a surface from a file or from its bytes.

    Raises
    ------
    FormatError
        If it cannot be read, is of another kind, or is damaged.
    """
    where = "the surface" if isinstance(source, bytes) else str(source)
    try:
        data = source if isinstance(source, bytes) else source.read_bytes()
        with np.load(io.BytesIO(data), allow_pickle=False) as content:
            about = json.loads(str(content["about"]))
            parts = {name: np.asarray(content[name], dtype=np.float64) for name in _ARRAYS}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise _damaged(where, str(error)) from None
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise _damaged(where, f"its format is not {FORMAT}")
    for name, part in parts.items():
        if not np.all(np.isfinite(part)):
            raise _damaged(where, f"{name} holds values that are no numbers")
    return Surface(**parts, about=about)


def _damaged(where: str, cause: str) -> FormatError:
    return FormatError(
        f"{where}: is no surface of a virtual tire ({cause}); allowed is a file like "
        "models/virtual_tire/reference.npz; make it with build/virtual_tire/surface.py"
    )


@lru_cache(maxsize=4)
def _kept(content: bytes) -> Surface:
    return read_surface(content).warm()


def shared_surface(path: Path) -> Surface:
    """Return the surface of a file; wheels of the same surface share one in memory.

    Raises
    ------
    FormatError
        If it cannot be read.
    """
    try:
        return _kept(path.read_bytes())
    except OSError as error:
        raise _damaged(str(path), str(error.strerror)) from None
