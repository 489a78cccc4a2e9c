"""Zero and shunt calibration of the gages, and the device file that holds them.

Zero: the mean counts of the standing, unloaded wheel become the zero of each gage.

Shunt: a known resistor beside the gage changes its resistance by ``x = dR / R = - Rg / (Rg + Rs)``.
A quarter bridge then gives ``e0 = E x / (4 + 2 x)``, which Eq. (20) of the dissertation,
``e0 = Ks strain E / 4``, takes for the strain ``4 x / (Ks (4 + 2 x))``. What the line shows instead
of that gives the gain of each gage.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tirebench.errors import DeviceError, cause
from tirebench.wire.device import FORMAT, GAIN_RANGE, Device
from tirebench.wire.frames import HIGHEST, LOWEST
from tirelib.core.arrays import FloatArray


def zeroed(device: Device, mean: FloatArray) -> Device:
    """Return a device whose zero makes this strain nothing; a gage that is NaN keeps its own.

    Raises
    ------
    DeviceError
        If a zero lies beyond the range of counts.
    """
    gages = len(mean)
    shift = np.where(np.isfinite(mean), mean, 0.0) / (device.scale * device.gain_of(gages))
    zero = device.zero_of(gages) + shift
    for gage in np.flatnonzero((zero <= LOWEST) | (zero >= HIGHEST)).tolist():
        raise DeviceError(
            f"gage {gage + 1}: its zero is {zero[gage]:.0f} counts; {LOWEST} .. {HIGHEST} is the "
            "range of counts; balance the bridge"
        )
    return replace(device, zero=tuple(round(float(x), 3) for x in zero))


def apparent_strain(gage: float, shunt: float, factor: float) -> float:
    """Return the strain that a shunt beside the gage is taken for; negative: compression.

    Parameters
    ----------
    gage, shunt : float, [ohm]
        Resistance of the gage, and of the resistor beside it.
    factor : float
        Gage factor Ks.

    Examples
    --------
    >>> round(1e6 * apparent_strain(350.0, 100e3, 2.1), 1)
    -1663.8
    """
    x = -gage / (gage + shunt)
    return 4.0 * x / (factor * (4.0 + 2.0 * x))


def shunted(
    device: Device,
    before: FloatArray,
    after: FloatArray,
    apparent: float,
    gages: Sequence[int] = (),
) -> Device:
    """Return a device whose gains make the step of each gage the apparent strain.

    Parameters
    ----------
    before, after : array, shape (n_gages,)
        Strain without and with the shunt, as this device gives it.
    gages : sequence of int
        Numbers, from 1, of those that were shunted; empty: all that show a number.

    Raises
    ------
    DeviceError
        If a gage shows no such step.
    """
    step = after - before
    if beyond := [number for number in gages if number > len(step)]:
        raise DeviceError(
            f"gage {beyond[0]} does not exist; the wheel has gages 1 .. {len(step)}; name the "
            "shunted gages with --gage"
        )
    chosen = [n - 1 for n in gages] or np.flatnonzero(np.isfinite(step)).tolist()
    gain, faults = device.gain_of(len(step)).tolist(), []
    low, high = GAIN_RANGE
    for gage in chosen:
        ratio = apparent / step[gage] if step[gage] else np.inf
        if not low <= ratio * gain[gage] <= high:
            faults.append(
                f"gage {gage + 1}: a step of {1e6 * step[gage]:.0f} microstrain where the shunt "
                f"should give {1e6 * apparent:.0f}; a gain of {low:g} .. {high:g} is allowed; "
                "check resistors, gage factor and sign, or name the shunted gages with --gage"
            )
        else:
            gain[gage] = round(float(ratio * gain[gage]), 6)
    if faults:
        raise DeviceError(faults)
    return replace(device, gain=tuple(gain))


def device_text(device: Device, said: str = "") -> str:
    """Return the text of a device file; `said` is a comment on its origin."""
    lateral = [] if device.lateral is None else [f"lateral_m   = {list(device.lateral)}"]
    return "\n".join(
        [
            *([f"# {said}"] if said else []),
            f'format = "{FORMAT}"',
            f"name   = {_quoted(device.name)}",
            "",
            "[gages]",
            *lateral,
            f"zero_counts = {list(device.zero)}",
            f"gain        = {list(device.gain)}",
            "",
            "[scale]",
            f"strain_per_count = {device.scale!r}",
            "",
        ]
    )


def write_device(path: Path, device: Device, said: str = "") -> None:
    """Write a new device file.

    Raises
    ------
    DeviceError
        If it exists or cannot be written.
    """
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(device_text(device, said))
    except OSError as error:
        raise DeviceError(
            f"{path}: cannot be written ({cause(error)}); a new file in a writable folder is "
            "needed; name another file"
        ) from None


def _quoted(text: str) -> str:
    """Return a text as a basic string of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04X}" for c in escaped) + '"'
