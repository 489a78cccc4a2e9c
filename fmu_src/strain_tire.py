"""``StrainTire.fmu``: strain of one wheel to load, slip angle, slip ratio and lateral force.

All work is in `tirelib.fmu.wheel`, all care in `tirelib.fmu.slave`. The build copies both into the
FMU beside this file, under a name of its own, so that FMUs of several versions can live in one
process.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import pythonfmu
from pythonfmu import Fmi2Slave

from tirelib.core.held import HELD
from tirelib.fmu.remarks import Remark, step_remark, strain_remark
from tirelib.fmu.slave import GuardedSlave
from tirelib.fmu.strain_variables import MISSING, inputs, outputs, parameters
from tirelib.fmu.variables import Variable
from tirelib.fmu.wheel import (
    Wheel,
    check_missing,
    embedded_calibration,
    load_wheel,
    read_other,
)


class StrainTire(GuardedSlave, Fmi2Slave):
    """One wheel: strain frames and conditions in, estimates out."""

    fmi = pythonfmu

    def table(self) -> list[Variable]:
        """Return the variables; note where the frame, the conditions and the age stand."""
        self._read_once = lru_cache(maxsize=1)(read_other)
        self._samples = int(self.settings["samples_per_step"])
        self._buffered = bool(self.settings["buffered"])
        lateral = embedded_calibration(self.folder / "calibration.toml").lateral
        fixed = parameters(self.settings["sample_rate"], float(self.settings["missing"]))
        given = inputs(lateral, self._samples, buffered=self._buffered)
        taken = outputs(lateral)
        self._missing = [v.name for v in fixed].index(MISSING)
        self._gages = len(lateral)
        first, strains = len(fixed), self._samples * self._gages
        self._frame = slice(first, first + strains)
        self._conditions = slice(first + strains, first + strains + len(HELD))
        self._omega = first + strains + HELD.index("omega")
        self._age = first + len(given) + [v.name for v in taken].index("age")
        return [*fixed, *given, *taken]

    def started(self) -> Wheel:
        """Return a wheel with the parameters as they are set now."""
        check_missing(self.real[self.reference[MISSING]])
        return load_wheel(
            self.folder / "calibration.toml",
            str(self.other["calibration"]),
            self.real[self.reference["sample_rate"]],
            self._samples,
            str(self.other["axes"]),
            tire=str(self.other["tire"]),
            order=self.real[self.reference["filter_order"]],
            read=self._read_once,
        )

    def advance(self, step: float) -> bool:
        """Push the frame; tell what is out of range; between estimates only the age changes."""
        real, wheel = self.real, self.model
        count = self.other["samples"] if self._buffered else None
        frame, valid = real[self._frame], self.other["frame_valid"]
        changed: bool = wheel.step(frame, step, valid, *real[self._conditions], count=count)
        self.tell(step_remark(wheel.taken, self._samples))
        self.tell(strain_remark(frame[: self._gages] if valid else ()))
        if wheel.ended:
            self.tell(wheel.remarks(real[self._omega]))
        if not changed:
            age = wheel.age
            real[self._age] = age if age == age else real[self._missing]
        return changed

    def tell(self, found: Mapping[str, Remark]) -> None:
        """Log remarks, once of each kind."""
        for kind, remark in found.items():
            self.remark(kind, remark.text(kind))

    def shown(self, values: Sequence[float]) -> Sequence[float]:
        """Return the Real outputs; what is missing as the parameter says."""
        missing = self.real[self._missing]
        if missing != missing:
            return values
        return [value if value == value else missing for value in values]
