"""Zero and shunt of the gages from the page, written into a device file.

The run goes on with the device file that it began with, so that its recording stays of one piece;
the new file is for the next run. Its name is the run's choice, never a viewer's.
"""

import math
import time
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tirebench.errors import DeviceError
from tirebench.estimator.session import Source
from tirebench.estimator.standing import EVERY, Level, standing_mean
from tirebench.wire.device import Device
from tirebench.wire.gage_setup import apparent_strain, shunted, write_device, zeroed
from tirelib.core.arrays import FloatArray

MEAN_SECONDS = 3.0
"""The mean is taken over the last so many seconds, [s]."""
OLDEST = 2.0
"""A wheel that was silent for longer has no present value, [s]."""


class GageSetup:
    """See `tirebench.page.commands.Gages`.

    Parameters
    ----------
    source : Source
    folder : Path
        Where device files are written.
    """

    def __init__(self, source: Source, folder: Path) -> None:
        self._source = source
        self._folder = folder
        self._levels: dict[int, deque[tuple[float, Level]]] = {}
        self._without: dict[int, FloatArray] = {}

    def watch(self, levels: Iterable[Level]) -> None:
        """Take what the gages show."""
        now = time.monotonic()
        for level in levels:
            kept = self._levels.setdefault(level.wheel, deque(maxlen=round(MEAN_SECONDS / EVERY)))
            kept.append((now, level))

    def state(self) -> dict[str, Any]:
        """Return what the page shows of each wheel: mean and range, microstrain."""
        return {
            str(wheel): {
                "mean": [_microstrain(x) for x in kept[-1][1].mean],
                "range": [_microstrain(x) for x in kept[-1][1].high - kept[-1][1].low],
            }
            for wheel, kept in self._levels.items()
        }

    def zero(self, wheel: int) -> str:
        """Write a device file with the zero of a standing wheel; return what was done.

        Raises
        ------
        DeviceError
            If the wheel turns, or shows nothing.
        """
        device, mean = self._now(wheel)
        return self._written(wheel, zeroed(device, mean), "zero")

    def shunt(self, wheel: int, on: bool, text: str) -> str:
        """Remember the strain without the shunt; with it, write a device file with the gains.

        Parameters
        ----------
        wheel : int
        on : bool
            Whether the shunt is on.
        text : str
            Resistance of the gage [ohm], of the shunt [ohm] and gage factor; the shunt's is
            negative where it looks like tension.

        Raises
        ------
        DeviceError
            If the wheel turns, shows nothing, or no such step.
        """
        device, mean = self._now(wheel)
        if not on:
            self._without[wheel] = mean
            return (
                f"wheel {wheel}: the mean without the shunt is taken; connect the shunt and "
                f"wait {MEAN_SECONDS:.0f} s"
            )
        if wheel not in self._without:
            raise DeviceError(
                f"wheel {wheel}: no mean without the shunt was taken; take that first"
            )
        try:
            gage, resistor, factor = map(float, text.split())
        except ValueError:
            gage = resistor = factor = math.nan
        if not (1.0 <= gage <= 1e5 and 10.0 <= abs(resistor) <= 1e8 and 0.1 <= factor <= 300.0):
            raise DeviceError(
                f"shunt {text[:60]!r}; the gage's resistance (1 .. 1e5 ohm), the shunt's (10 .. "
                "1e8 ohm) and the gage factor (0.1 .. 300) are needed; give three numbers"
            )
        apparent = math.copysign(1.0, resistor) * apparent_strain(gage, abs(resistor), factor)
        new = shunted(device, self._without[wheel], mean, apparent)
        return self._written(wheel, new, "shunt")

    def _now(self, wheel: int) -> tuple[Device, FloatArray]:
        """Return the device of a wheel and what its gages show at this moment."""
        kept, heard = self._levels.get(wheel), self._source.wheels.heard.get(wheel)
        if not kept or heard is None or time.monotonic() - kept[-1][0] > OLDEST:
            raise DeviceError(f"wheel {wheel}: no data come at this moment; check the link")
        return heard.timeline.device, standing_mean([level for _, level in kept])

    def _written(self, wheel: int, device: Device, what: str) -> str:
        path = self._folder / f"wheel-{wheel}-{what}-{time.strftime('%Y%m%d-%H%M%S')}.toml"
        write_device(path, device, f"{what} of wheel {wheel}, from the live page")
        return (
            f"wheel {wheel}: {what} written to {path.name}; for the next run: --device "
            f"{wheel}={path.name}"
        )


def _microstrain(value: float) -> float | None:
    return round(1e6 * float(value), 1) if math.isfinite(value) else None
