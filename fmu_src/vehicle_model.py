"""``VehicleModel.fmu``: controls and road in, states of four wheels and the body out.

The equations are in ``build/cosim/vehicle14``; the build puts them among the resources, under a
name of their own, and copies what they need of tirelib. All care is in `tirelib.fmu.slave`.
"""

import importlib
import tomllib

import pythonfmu
from pythonfmu import Fmi2Slave

from tirelib.core.errors import ParameterError
from tirelib.fmu.guarded import Model
from tirelib.fmu.refusals import StepError
from tirelib.fmu.slave import GuardedSlave
from tirelib.fmu.variables import Variable
from tirelib.physics.brush import predict


class VehicleModel(GuardedSlave, Fmi2Slave):
    """A car."""

    fmi = pythonfmu

    def table(self) -> list[Variable]:
        """Return the variables; note where parameters and inputs stand."""
        library = str(self.settings["library"])
        self._port = importlib.import_module(f"{library}.port")
        tire = importlib.import_module(f"{library}.tire")
        document = tomllib.loads((self.folder / "tire.toml").read_text(encoding="utf-8"))
        self._tires = tire.tires_of(document, predict)
        fixed, given = self._port.parameters(Variable), self._port.inputs(Variable)
        self._fixed_place = slice(0, len(fixed))
        self._given_place = slice(len(fixed), len(fixed) + len(given))
        return [*fixed, *given, *self._port.outputs(Variable)]

    def started(self) -> Model:
        """Return a vehicle with the parameters as they are set now."""
        values = self.real[self._fixed_place]
        if problems := self._port.settings_problems(values):
            raise ParameterError(f"{'; '.join(problems)}; set them before the FMU is initialised")
        vehicle: Model = self._port.Port(self._tires, values, self.real[self._given_place])
        return vehicle

    def advance(self, step: float) -> bool:
        """Go on by a step with the inputs as they are."""
        given = self.real[self._given_place]
        cause = self._port.Port.refusal(step, given)
        if cause is not None:
            raise StepError(cause)
        changed: bool = self.model.step(step, given)
        return changed
