"""Device file: what the counts of a wheel transmitter mean (``tirebench-device/1``).

::

    format = "tirebench-device/1"
    name   = "wheel 3, amplifier 12"

    [gages]
    lateral_m   = [0.06, 0.03, 0.0, -0.03, -0.06]   # ISO 8855, left positive, as strain_1 .. _5
    zero_counts = [0, 0, 0, 0, 0]                   # `tirebench zero` finds them
    gain        = [1, 1, 1, 1, 1]                   # of a shunt calibration, `tirebench shunt`

    [scale]                    # either: strain per count ...
    strain_per_count = 6.103515625e-7

    [bridge]                   # ... or: a quarter bridge, Eq. (20)
    gage_factor      = 2.1     # Ks
    excitation_V     = 5.0     # E
    volt_per_count   = 4e-8    # at the bridge's output, e0 per count
"""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tirebench.errors import DeviceError, cause
from tirebench.wire.frames import (
    GAGES,
    HIGHEST,
    LOWEST,
    MOST_GAGES,
    CountArray,
    FrameFlag,
    Int16Array,
    IntArray,
)
from tirelib.core.arrays import BoolArray, FloatArray

FORMAT = "tirebench-device/1"
_KNOWN = {
    "": {"format", "name", "gages", "scale", "bridge"},
    "gages": {"lateral_m", "zero_counts", "gain"},
    "scale": {"strain_per_count"},
    "bridge": {"gage_factor", "excitation_V", "volt_per_count"},
}
GAIN_RANGE = 0.2, 5.0
"""A gage beyond these gains is not the one that the file speaks of."""
_SATURATED = int(FrameFlag.SATURATED)
_GAGE_BITS = 1 << np.arange(GAGES)


@dataclass(frozen=True, slots=True)
class Device:
    """How counts become strain: ``strain = scale * gain * (counts - zero)``.

    Attributes
    ----------
    name : str
    scale : float
        Strain per count. The default is +-2 % over the range of int16.
    zero : tuple of float, one a gage
        Counts at strain zero.
    lateral : tuple of 5 float, or None, [m]
        Gage positions, ISO; None where the file does not say.
    lowest, highest : float
        Counts at the ends of the range, which mean saturation.
    gain : tuple of 5 float
        Gain of each gage, from a shunt calibration.
    """

    name: str = "default"
    scale: float = 0.02 / 32768
    zero: tuple[float, ...] = (0.0,) * GAGES
    lateral: tuple[float, ...] | None = None
    lowest: float = LOWEST
    highest: float = HIGHEST
    gain: tuple[float, ...] = (1.0,) * GAGES

    def strain(self, counts: CountArray, flags: IntArray) -> tuple[FloatArray, BoolArray]:
        """Return the strain of frames, shape (m * n, n_gages), and where a gage was saturated.

        A saturated sample is NaN. Saturation is marked in band by the ends of the range. If a
        frame's flag names a gage and none of its samples is marked, all of them are taken as
        saturated.
        """
        m, n, gages = counts.shape
        saturated = (counts == self.highest) | (counts == self.lowest)
        if (flags & _SATURATED).any():
            named = (flags[:, None] & _GAGE_BITS) != 0
            saturated |= (named & ~saturated.any(axis=1))[:, None, :]
        strain = (counts - self.zero_of(gages)) * self._scales(gages)
        if saturated.any():
            strain = np.where(saturated, np.nan, strain)
        return strain.reshape(m * n, gages), saturated.reshape(m * n, gages)

    def zero_of(self, gages: int) -> FloatArray:
        """Return the counts at strain zero of so many gages."""
        return self._of_each(self.zero, gages, 0.0)

    def gain_of(self, gages: int) -> FloatArray:
        """Return the gains of so many gages."""
        return self._of_each(self.gain, gages, 1.0)

    def _of_each(self, known: tuple[float, ...], gages: int, usual: float) -> FloatArray:
        """Return zeros or gains of so many gages."""
        if all(one == usual for one in known):
            return np.full(gages, usual)
        if len(known) != gages:
            raise DeviceError(
                f"the device {self.name!r} has zeros or gains for {len(known)} gages, but the "
                f"wheel sends {gages}; the numbers must agree; use the device file of this wheel"
            )
        return np.asarray(known)

    def counts(self, strain: FloatArray) -> tuple[Int16Array, BoolArray]:
        """Return counts of shape (n, 5) and where they are saturated; the inverse of `strain`.

        What is out of range or not finite gets the mark of saturation.
        """
        gages = strain.shape[-1]
        exact = np.rint(strain / self._scales(gages) + self.zero_of(gages))
        high, low = exact >= HIGHEST, ~(exact > LOWEST)  # NaN counts as low
        inside = np.where(high | low, 0.0, exact).astype(np.int16)
        marked = np.where(high, HIGHEST, np.where(low, LOWEST, inside)).astype(np.int16)
        return marked, high | low

    def _scales(self, gages: int) -> FloatArray | float:
        """Strain per count, of each gage where they differ: one number keeps a count exact."""
        equal = all(one == 1.0 for one in self.gain)
        return self.scale if equal else self.scale * self.gain_of(gages)

    def check_layout(self, lateral: Sequence[float], where: str, gages: int = GAGES) -> None:
        """Refuse data of another gage layout, or of another number of gages.

        Raises
        ------
        DeviceError
            Naming both.
        """
        same = self.lateral is None or (
            len(self.lateral) == len(lateral) and np.allclose(lateral, self.lateral, atol=1e-4)
        )
        if same and len(lateral) == gages:
            return
        if same:
            raise DeviceError(
                f"{where}: its calibration has {len(lateral)} gages, but this wheel sends {gages}; "
                'the numbers must agree; write "" in the map for a gage that is missing, or '
                f"calibrate with {gages} gages"
            )
        raise DeviceError(
            f"{where}: its gages are at {_millimetres(lateral)} mm (ISO), but the device "
            f"{self.name!r} has {_millimetres(self.lateral) if self.lateral else gages} of them; "
            "both must agree; use the device file of this wheel"
        )


def read_device(path: Path) -> Device:
    """Read a device file.

    Raises
    ------
    DeviceError
        With every fault of the file.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DeviceError(
            f"{path}: cannot be read ({cause(error)}); a device file is TOML in UTF-8; check the "
            "path"
        ) from None
    return parse_device(text, str(path))


def parse_device(text: str, where: str) -> Device:
    """Return the device that the text of a device file describes; errors as `read_device`."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DeviceError(
            f"{where}: not valid TOML ({error}); a device file is a TOML file; correct that line"
        ) from None
    if document.get("format") != FORMAT:
        raise DeviceError(
            f"{where}: format = {document.get('format')!r}; this program reads {FORMAT!r}; correct "
            "it, or use the version of tirelib that wrote the file"
        )
    faults = _unknown_keys(document, where)
    scale = _scale(document, where, faults)
    gages = document.get("gages", {})
    gages = gages if isinstance(gages, dict) else {}
    zero = _numbers(gages, "zero_counts", where, faults, LOWEST, HIGHEST)
    lateral = _numbers(gages, "lateral_m", where, faults, -0.5, 0.5)
    gain = _numbers(gages, "gain", where, faults, *GAIN_RANGE)
    for key, given in (("zero_counts", zero), ("gain", gain)):
        if given and lateral and len(given) != len(lateral):
            faults.append(
                f"{where}: gages.{key} has {len(given)} numbers, but lateral_m has {len(lateral)}; "
                "one number per gage is needed; correct them"
            )
    if faults:
        raise DeviceError(faults)
    name = str(document.get("name", Path(where).stem))
    gain = gain or (1.0,) * GAGES
    return Device(name, scale, zero or (0.0,) * GAGES, lateral, gain=gain)


def _unknown_keys(document: dict[str, Any], where: str) -> list[str]:
    faults = []
    for table, known in _KNOWN.items():
        content = document.get(table, {}) if table else document
        if not isinstance(content, dict):
            faults.append(
                f"{where}: {table} = {content!r}; a table [{table}] is needed; write it as a table"
            )
            continue
        for key in sorted(set(content) - known):
            faults.append(
                f"{where}: {table + '.' if table else ''}{key} is an unknown key; allowed keys are "
                f"{', '.join(sorted(known))}; correct the spelling, or delete the line"
            )
    return faults


def _scale(document: dict[str, Any], where: str, faults: list[str]) -> float:
    """Strain per count, from either table.

    Quarter bridge: ``e0 = Ks strain E / 4``, so ``strain = 4 e0 / (Ks E)``.
    Source: dissertation, Eq. (20).
    """
    given = [name for name in ("scale", "bridge") if name in document]
    if len(given) != 1:
        faults.append(
            f"{where}: {' and '.join(f'[{name}]' for name in given) or 'neither table'} is "
            "present; exactly one of [scale] and [bridge] must define the size of a count; write "
            "one of them"
        )
        return math.nan
    table = document[given[0]] if isinstance(document[given[0]], dict) else {}
    if given[0] == "scale":
        return _number(table, "scale.strain_per_count", where, faults, 1e-12, 1e-3)
    volt = _number(table, "bridge.volt_per_count", where, faults, 1e-12, 1e-1)
    factor = _number(table, "bridge.gage_factor", where, faults, 0.1, 300.0)
    excitation = _number(table, "bridge.excitation_V", where, faults, 0.01, 100.0)
    return 4.0 * volt / (factor * excitation)


def _number(
    table: dict[str, Any], key: str, where: str, faults: list[str], low: float, high: float
) -> float:
    """Return a number whose magnitude must lie between two bounds (a sign swaps the gage)."""
    value = table.get(key.split(".")[1])
    if isinstance(value, bool) or not isinstance(value, int | float):
        given = f"is {value!r}" if value is not None else "is missing"
        faults.append(f"{where}: {key} {given}; a number is needed; write it")
        return math.nan
    if not low <= abs(value) <= high:
        faults.append(
            f"{where}: {key} = {value:g}; a magnitude of {low:g} .. {high:g} is allowed; check its "
            "unit"
        )
    return float(value)


def _numbers(
    table: dict[str, Any], key: str, where: str, faults: list[str], low: float, high: float
) -> tuple[float, ...] | None:
    value = table.get(key)
    if value is None:
        return None
    good = isinstance(value, list) and 1 <= len(value) <= MOST_GAGES
    good = good and all(isinstance(x, int | float) and not isinstance(x, bool) for x in value)
    if not good:
        faults.append(
            f"{where}: gages.{key} = {value!r}; 1 to {MOST_GAGES} numbers are needed, one per "
            "gage; correct the list"
        )
        return None
    for number, x in enumerate(value, start=1):
        if not low <= x <= high:
            faults.append(
                f"{where}: gages.{key} of gage {number} = {x:g}; {low:g} .. {high:g} is allowed; "
                "check its unit"
            )
    return tuple(float(x) for x in value)


def _millimetres(lateral: Sequence[float]) -> str:
    return ", ".join(f"{1e3 * y:+.0f}" for y in lateral)
