"""Run a ``.ssp`` by an engine: FMPy's instances in a loop of our own, ecos, or libcosim.

    python -m cosim.ssp_run car.ssp --engine ecos --stop 0.3 --step 1e-3 --out ecos.npz

All are masters of the Jacobi kind with a fixed step: outputs go to inputs, then every FMU steps.
FMPy's own ``simulate_ssp`` is not used: it fails on a system without inputs.
"""

import argparse
import importlib.util
import sys
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from ctypes import CDLL
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.ssp.ssd import read_ssd, read_ssv

from cosim.ssp import SET, SSD
from cosim.vehicle14.parameters import WHEELS
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.threads import one_thread

WATCHED = (
    *(f"vehicle.{q}_{w}" for q in ("Fz", "alpha", "kappa", "Fx", "Fy") for w in WHEELS),
    *(f"tire_{w}.{q}" for q in ("wheel_angle", "Fx_rig", "Fy_rig") for w in WHEELS),
    *(f"strain_{w}.{q}" for q in ("Fz", "alpha", "kappa", "Fy", "Fz_std") for w in WHEELS),
    "vehicle.x",
    "vehicle.y",
    "vehicle.yaw_rate",
    "vehicle.vx",
    "vehicle.roll",
)
"""Real variables that are recorded."""
Result = dict[str, FloatArray]


def _split(name: str) -> tuple[str, str]:
    component, _, variable = name.partition(".")
    return component, variable


def missing(engine: str) -> str | None:
    """Return why an engine cannot run here, if so."""
    if engine not in ENGINES:
        raise ParameterError(f"engine = {engine!r}; allowed are {', '.join(ENGINES)}")
    package = {"fmpy": "fmpy", "ecos": "ecospy", "libcosim": "libcosimpy"}[engine]
    found = importlib.util.find_spec(package)
    if found is None or found.origin is None:
        return f"{package} is not installed; `pip install {package}`"
    if engine == "ecos":
        library = Path(found.origin).parent / "binaries" / "libecosc.so"
        try:
            CDLL(str(library))
        except OSError as error:
            return f"ecospy cannot load its library ({error}); Debian has it in libtbb12"
    return None


class _Instance:
    """One component in FMPy."""

    def __init__(self, component: Any, folder: Path, sources: Sequence[str]) -> None:
        path = str(folder / component.source)
        description = read_model_description(path)
        self.variables = {v.name: v for v in description.modelVariables}
        self.slave: Any = FMU2Slave(
            guid=description.guid,
            unzipDirectory=extract(path, str(folder / component.name)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=component.name,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        for source in sources:
            for entry in read_ssv(str(folder / source)).parameters:
                self.put(entry.name, _value(entry.value, entry.type))

    def put(self, name: str, value: Any) -> None:
        variable = self.variables[name]
        getattr(self.slave, f"set{variable.type}")([variable.valueReference], [value])

    def get(self, name: str) -> Any:
        variable = self.variables[name]
        return getattr(self.slave, f"get{variable.type}")([variable.valueReference])[0]


def _value(text: str, kind: str) -> Any:
    if kind == "Boolean":
        return text == "true"
    return text if kind == "String" else float(text) if kind == "Real" else int(text)


def _bindings(structure: Path) -> dict[str, list[str]]:
    """Return the parameter sets of every component: FMPy 0.3.32 does not read them."""
    root = Xml.parse(structure).getroot()
    return {
        str(component.get("name")): [
            str(binding.get("source")) for binding in component.iter(f"{{{SSD}}}ParameterBinding")
        ]
        for component in root.iter(f"{{{SSD}}}Component")
    }


def run_fmpy(path: Path, step: float, steps: int, watched: Sequence[str] = WATCHED) -> Result:
    """Run by instances of FMPy; only its record can be of other variables."""
    system = read_ssd(str(path)).system
    with tempfile.TemporaryDirectory() as name, zipfile.ZipFile(path) as archive:
        archive.extractall(name)
        bound = _bindings(Path(name) / "SystemStructure.ssd")
        made = {c.name: _Instance(c, Path(name), bound[c.name]) for c in system.elements}
        groups = _groups(system.connections, made)

        def transfer() -> None:
            for source, target, kind, out, into in groups:
                values = getattr(made[source].slave, f"get{kind}")(out)
                getattr(made[target].slave, f"set{kind}")(into, values)

        for instance in made.values():
            instance.slave.enterInitializationMode()
        transfer()
        for instance in made.values():
            instance.slave.exitInitializationMode()

        def advance(index: int) -> None:
            transfer()
            for instance in made.values():
                instance.slave.doStep(index * step, step)

        result = _record(steps, advance, lambda n: made[_split(n)[0]].get(_split(n)[1]), watched)
        for instance in made.values():
            instance.slave.freeInstance()
    return result


def _groups(connections: Any, made: dict[str, _Instance]) -> list[tuple[Any, ...]]:
    """Gather connections between the same two components and of the same type."""
    found: dict[tuple[str, str, str], tuple[list[int], list[int]]] = {}
    for link in connections:
        source = made[link.startElement].variables[link.startConnector]
        target = made[link.endElement].variables[link.endConnector]
        out, into = found.setdefault((link.startElement, link.endElement, source.type), ([], []))
        out.append(source.valueReference)
        into.append(target.valueReference)
    return [(*key, *lists) for key, lists in found.items()]


def run_ecos(path: Path, step: float, steps: int) -> Result:
    """Run by ecos."""
    from ecospy import EcosSimulation

    with EcosSimulation(ssp_path=str(path), step_size=step) as simulation:
        simulation.init(parameter_set=SET)
        result = _record(
            steps, lambda _: simulation.step(), lambda n: simulation.get_real("::".join(_split(n)))
        )
        simulation.terminate()
    return result


def run_libcosim(path: Path, step: float, steps: int) -> Result:
    """Run by libcosim, whose time counts in whole nanoseconds."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_ssp_file(ssp_path=str(path), step_size=round(step * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    at = {
        f"{slave.name.decode()}.{variable.name.decode()}": (slave.index, variable.reference)
        for slave in execution.slave_infos()
        for variable in execution.slave_variables(slave.index)
    }

    def read(name: str) -> float:
        index, reference = at[name]
        return float(next(iter(observer.last_real_values(index, [reference]))))

    def advance(_: int) -> None:
        if not execution.step():
            raise FormatError(f"{path}: libcosim refused a step; look at its log")

    return _record(steps, advance, read)


def _record(
    steps: int,
    advance: Callable[[int], Any],
    read: Callable[[str], float],
    watched: Sequence[str] = WATCHED,
) -> Result:
    rows = np.empty((steps, len(watched)))
    for index in range(steps):
        advance(index)
        rows[index] = [read(name) for name in watched]
    return {name: rows[:, i] for i, name in enumerate(watched)}


ENGINES: dict[str, Callable[[Path, float, int], Result]] = {
    "fmpy": run_fmpy,
    "ecos": run_ecos,
    "libcosim": run_libcosim,
}


def differences(one: Result, other: Result) -> dict[str, float]:
    """Return the largest difference of each variable, over its largest magnitude.

    Where one has a number and the other none, the difference is infinite.
    """
    found = {}
    for name, values in one.items():
        lost = np.isnan(values) != np.isnan(other[name])
        both = ~np.isnan(values) & ~np.isnan(other[name])
        size = max(float(np.abs(values[both]).max(initial=0.0)), 1e-12)
        gap = float(np.abs(values[both] - other[name][both]).max(initial=0.0)) / size
        found[name] = float("inf") if lost.any() else gap
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run by the command line, and write the recorded variables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ssp", type=Path)
    parser.add_argument("--engine", choices=sorted(ENGINES), default="fmpy")
    parser.add_argument("--step", type=float, default=1e-3, help="communication step [s]")
    parser.add_argument("--stop", type=float, default=0.5, help="end [s]")
    parser.add_argument("--out", type=Path, required=True, help="variables over the steps, .npz")
    told = parser.parse_args(arguments)
    if (reason := missing(told.engine)) is not None:
        sys.stderr.write(f"{told.engine}: {reason}\n")
        return 2
    result = ENGINES[told.engine](told.ssp, told.step, round(told.stop / told.step))
    named: dict[str, Any] = dict(result)
    np.savez(told.out, **named)
    return 0


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
