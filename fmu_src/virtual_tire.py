"""``VirtualTire.fmu``: load, slip, camber, speed and pressure of one wheel to frames of strain.

All work is in `tirelib.fmu.virtual`, all care in `tirelib.fmu.slave`. The build copies both into
the FMU beside this file, under a name of its own, so that FMUs of several versions can live in one
process.
"""

import pythonfmu
from pythonfmu import Fmi2Slave

from tirelib.fmu.slave import GuardedSlave
from tirelib.fmu.variables import Variable
from tirelib.fmu.virtual.faults import Faults
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.remarks import text
from tirelib.fmu.virtual.surface import shared_surface
from tirelib.fmu.virtual.table import inputs, outputs, parameters
from tirelib.fmu.virtual.wheel import VirtualWheel


class VirtualTire(GuardedSlave, Fmi2Slave):
    """One wheel: conditions in, strain frames out."""

    fmi = pythonfmu

    def table(self) -> list[Variable]:
        """Return the variables; note where the conditions stand."""
        self._surface = shared_surface(self.folder / "surface.npz")
        self._samples = int(self.settings["samples_per_step"])
        fixed = parameters(float(self.settings["sample_rate"]))
        given = inputs(self._surface)
        self._conditions = slice(len(fixed), len(fixed) + len(given))
        return [*fixed, *given, *outputs(self._surface, self._samples)]

    def _parameter(self, name: str) -> float:
        return float(self.real[self.reference[name]])

    def started(self) -> VirtualWheel:
        """Return a wheel with the parameters as they are set now, at rest in its inputs."""
        get = self._parameter
        faults = Faults(
            start=get("fault_start"),
            dead_gage=int(self.other["dead_gage"]),
            saturation=get("saturation"),
            drift=get("drift"),
            dropped=get("dropped_frames"),
        )
        options = Options(
            rate=get("sample_rate"),
            relaxation=(get("relaxation_length"), get("relaxation_length_kappa")),
            noise=get("noise_std"),
            seed=int(self.other["seed"]),
            start_angle=get("start_angle"),
            faults=faults,
        )
        wheel = VirtualWheel(self._surface, options, self._samples)
        wheel.begin(self.real[self._conditions])
        return wheel

    def advance(self, step: float) -> bool:
        """Fill the next frame; tell which inputs are out of range."""
        given, surface = self.real[self._conditions], self._surface
        changed: bool = self.model.step(step, given)
        for name in self.model.outside:
            at = surface.inputs.index(name)
            ends = float(surface.low[at]), float(surface.high[at])
            self.remark(name, text(name, given[at], *ends))
        return changed
