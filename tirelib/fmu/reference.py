"""Reference signals that an FMU carries: input and expected output, in the cross-check layout.

``X_in.csv`` and ``X_ref.csv`` have a first column ``time`` and a row per communication point;
``X_ref.opt`` names start, stop, step and tolerance. A row of the input is what is set before the
step that begins at its time; a row of the output is what is read at its time.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray

FOLDER = "reference"
TOLERANCE = 1e-9
"""Tolerance of the expected output, relative to the largest magnitude of the variable."""


@dataclass(frozen=True, slots=True)
class Reference:
    """Signals at n communication points, `step` apart.

    Attributes
    ----------
    step : float, [s]
    given : dict of arrays, shape (n,) or (n, k)
        Inputs by name; Booleans as 0 and 1.
    expected : dict of arrays, shape (n,) or (n, k)
        Outputs by name.
    tolerance : float
    """

    step: float
    given: Mapping[str, FloatArray]
    expected: Mapping[str, FloatArray]
    tolerance: float = TOLERANCE

    def joined(self, names: Sequence[str]) -> "Reference":
        """Return the signals with numbered ones (``strain_1``, ``strain_2``) joined to arrays."""

        def arrays(signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
            found: dict[str, list[FloatArray]] = {}
            for name, values in signals.items():
                stem = name.rstrip("_0123456789")
                found.setdefault(stem if stem in names else name, []).append(values)
            return {
                name: np.stack(parts, axis=1) if name in names else parts[0]
                for name, parts in found.items()
            }

        return replace(self, given=arrays(self.given), expected=arrays(self.expected))

    def files(self, model: str) -> dict[str, bytes]:
        """Return the three files by name."""
        n = len(next(iter(self.given.values())))
        times: FloatArray = np.arange(n) * np.float64(self.step)
        options = (
            f"StartTime, 0\nStopTime, {float(times[-1])!r}\nStepSize, {self.step!r}\n"
            f"RelTol, {self.tolerance!r}\n"
        )
        return {
            f"{model}_in.csv": _csv({"time": times, **self.given}),
            f"{model}_ref.csv": _csv({"time": times, **self.expected}),
            f"{model}_ref.opt": options.encode(),
        }


def _csv(columns: Mapping[str, FloatArray]) -> bytes:
    head = ",".join(f'"{name}"' for name in columns)
    rows = map(",".join, zip(*map(_texts, columns.values()), strict=True))
    return "\n".join((head, *rows, "")).encode()


def _texts(values: FloatArray) -> list[str]:
    """Return a text for each row; several numbers of a row part at spaces."""
    if values.ndim > 1:
        return list(map(" ".join, zip(*map(_texts, values.T), strict=True)))
    numbers = values.tolist()
    known = {number: _text(number) for number in set(numbers)}  # most come again and again
    return [known[number] for number in numbers]


def _text(number: float) -> str:
    """Return the shortest text that reads back as the same number."""
    return str(int(number)) if math.isfinite(number) and number == int(number) else repr(number)


def contact_strain(
    angle: FloatArray,
    half: FloatArray | float,
    lateral: Sequence[float],
    tilt: float,
    dip: float,
    tension: float,
    imbalance: float = 0.0,
) -> FloatArray:
    """Return a smooth stand-in for innerliner strain, shape (n_gages, n). It is no tire model.

    A plateau of tension over the contact with smooth edges, compressive dips beside it, longer on
    one side by `tilt`.

    Parameters
    ----------
    angle : array, shape (n,), [rad]
        Wheel angle of the gages.
    half : float or array of shape (n,), [rad]
        Half of the contact angle at the centre.
    lateral : sequence of float, [m]
    tilt : float
        Relative growth of the contact from the centre to the outermost gage.
    dip, tension : float
        Depth of the dips and height of the plateau, [-].
    imbalance : float
        By how much the dip before the contact is deeper, and that after it shallower, relative.
    """
    y = np.asarray(lateral)
    side = y / max(float(np.abs(y).max()), 1e-9)
    phi = (angle + np.pi) % (2.0 * np.pi) - np.pi
    edge = half * (1.0 + tilt * side[:, None])
    plateau = 0.5 * (np.tanh((phi + edge) / 0.05) - np.tanh((phi - edge) / 0.05))
    before = np.exp(-(((phi + edge + 0.15) / 0.12) ** 2))
    after = np.exp(-(((phi - edge - 0.15) / 0.12) ** 2))
    deep = dip * (1.0 + 2.0 * tilt * side[:, None])
    found: FloatArray = tension * plateau - deep * (
        (1.0 + imbalance) * before + (1.0 - imbalance) * after
    )
    return found
