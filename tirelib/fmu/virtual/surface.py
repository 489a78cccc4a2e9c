"""The response surface: strain over the wheel angle as a smooth function of the condition.

A waveform is moved to a common contact, written in principal components, and its scores are
interpolated over the rig's solutions and their mirror images by radial basis functions.
"""

import io
import json
import math
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.interpolate import RBFInterpolator

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import FormatError
from tirelib.core.threads import one_thread
from tirelib.fmu.virtual.coordinates import (
    FRICTION,
    INPUTS,
    LOAD,
    MIRRORED,
    PRESSURE,
    SPEED,
    coordinates,
)
from tirelib.fmu.virtual.waveform import Waveforms

FORMAT = "tirelib-virtual-tire/2"
FORCES = ("Fx", "Fy", "Mz", "loaded_radius")
"""Quantities that are interpolated besides the strain."""
_FORCE_MIRROR = np.array([1.0, -1.0, -1.0, 1.0])
KERNEL: Final = "quintic"
DEGREE: Final = 2
"""Degree of the polynomial of `scipy.interpolate.RBFInterpolator`."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Data of a virtual tire, as stored in a file.

    Attributes
    ----------
    lateral : array, shape (g,), [m]
        Lateral positions of the gages, y to the left; symmetric.
    low, high : array, shape (i,)
        Range of the `inputs`, SI; i is 6, or 7 with friction.
    slip, scales : array, shapes (4,) and (i + 2,)
        Results of `coordinates`.
    points : array, shape (n, i)
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
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs: `INPUTS`, and `FRICTION` where the surface knows it."""
        return INPUTS if self.low.size == len(INPUTS) else (*INPUTS, FRICTION)

    @cached_property
    def interpolator(self) -> RBFInterpolator:
        """What `answers` asks; also the data of the compiled virtual tire."""
        n = len(self.points)
        mirror = self.edges[:, :, ::-1]
        values = np.concatenate(
            (
                np.hstack((self.even, self.odd, self.edges.reshape(n, -1), self.forces)),
                np.hstack(
                    (self.even, -self.odd, mirror.reshape(n, -1), self.forces * _FORCE_MIRROR)
                ),
            )
        )
        places = self._places(np.concatenate((self.points, mirrored(self.points))))
        return RBFInterpolator(places, values, kernel=KERNEL, degree=DEGREE)

    def _places(self, inputs: FloatArray) -> FloatArray:
        found = coordinates(list(inputs.T), *self._shape)
        return np.stack(found, axis=1)

    @cached_property
    def _shape(self) -> tuple[list[float], list[float]]:
        return self.slip.tolist(), self.scales.tolist()

    @cached_property
    def waveforms(self) -> Waveforms:
        """Mean and components as splines."""
        return Waveforms(self.mean, self.basis)

    @cached_property
    def _limits(self) -> list[tuple[str, float, float]]:
        return list(zip(self.inputs, self.low.tolist(), self.high.tolist(), strict=True))

    @one_thread()
    def warm(self) -> "Surface":
        """Compute now what the first use would compute."""
        _ = self.interpolator, self.waveforms
        return self

    def outside(self, inputs: Sequence[float] | FloatArray) -> tuple[str, ...]:
        """Return the names of the inputs that are out of range, or no numbers."""
        return tuple(
            [
                name
                for (name, low, high), value in zip(self._limits, inputs, strict=True)
                if not low <= value <= high
            ]
        )

    def answers(self, inputs: FloatArray) -> FloatArray:
        """Return scores, edges and forces of conditions, shape (n, i), in one table with n rows.

        Nothing is checked: ask `outside` first.
        """
        found: FloatArray
        if len(inputs) == 1:  # one row is too little for two threads
            found = self.interpolator(
                np.array([coordinates(inputs[0].tolist(), *self._shape, math)])
            )
            return found
        with one_thread():
            found = self.interpolator(self._places(inputs))
        return found

    def forces_of(self, answers: FloatArray) -> FloatArray:
        """Return Fx, Fy [N], Mz [N m] and the loaded radius [m], shape (n, 4)."""
        return answers[:, -len(FORCES) :]

    def waveform(self, answers: FloatArray) -> FloatArray:
        """Return spline coefficients of one condition, shape (m, g), for `strain` at many angles.

        Parameters
        ----------
        answers : array, shape (1, ...)
            Result of `answers`.
        """
        return self.waveforms.mixed(answers[0, : len(self.basis)])

    def strain(
        self,
        answers: FloatArray,
        angle: FloatArray | list[float],
        waveform: FloatArray | None = None,
    ) -> FloatArray:
        """Return the strain of every gage, shape (n, g).

        Parameters
        ----------
        answers : array, shape (n, ...) or (1, ...)
            Result of `answers`; one row serves all angles.
        angle : array or list, shape (n,), [rad]
            Wheel angle of the gages: 0 over the road, negative before.
        waveform : array, optional
            Result of `waveform`, where there is one row: spares the sum over the components.
        """
        k, g = len(self.basis), self.lateral.size
        if waveform is None and len(angle) == 1:
            row = answers[0]
            edges = row[k : k + 2 * g].tolist()
            seen = self.waveforms.one(row[:k], edges[:g], edges[g:], float(angle[0]))
            return np.array([seen])
        parts = answers[:, :k], answers[:, k : k + g], answers[:, k + g : k + 2 * g]
        return self.waveforms.many(*parts, np.asarray(angle), waveform)

    @cached_property
    def _rolling(self) -> list[tuple[float, int, int, int]]:
        return [
            (value, *powers) for value, powers in zip(self.rolling.tolist(), POWERS, strict=True)
        ]

    def rolling_radius(self, load: float, speed: float, pressure: float) -> float:
        """Return R_e [m]: a polynomial of third degree, see `radius_terms`."""
        x, y, z = (load / LOAD) ** 0.5, 0.5 * (speed / SPEED) ** 2, pressure / PRESSURE
        xs, ys, zs = (1.0, x, x * x, x**3), (1.0, y, y * y, y**3), (1.0, z, z * z, z**3)
        return sum([value * xs[a] * ys[b] * zs[c] for value, a, b, c in self._rolling])


POWERS = tuple((a, b, c) for a in range(4) for b in range(4 - a) for c in range(4 - a - b))
"""Powers of the terms of R_e."""


def radius_terms(inputs: FloatArray) -> FloatArray:
    """Return the terms of R_e, shape (n, 20).

    x^a y^b z^c with x = sqrt(Fz / 4 kN), y = (speed / 20 m/s)^2 / 2, z = pressure / 2.4 bar.
    """
    x = np.sqrt(inputs[:, 0] / LOAD)
    y, z = 0.5 * (inputs[:, 4] / SPEED) ** 2, inputs[:, 5] / PRESSURE
    return np.stack([x**a * y**b * z**c for a, b, c in POWERS], axis=1)


def mirrored(inputs: FloatArray) -> FloatArray:
    """Return the mirror images of conditions, shape (n, i), left for right."""
    return np.asarray(inputs * MIRRORED[: inputs.shape[1]])


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
            raise _damaged(where, f"{name} holds values that are not numbers")
    return Surface(**parts, about=about)


def _damaged(where: str, cause: str) -> FormatError:
    return FormatError(
        f"{where}: is not the response surface of a virtual tire ({cause}); a file like "
        "models/virtual_tire/reference.npz is needed; make it with build/virtual_tire/surface.py"
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
