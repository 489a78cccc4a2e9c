"""A ``.ssp`` of a vehicle with four virtual tires and four strain tires, and its parameter sets.

    python -m cosim.ssp --vehicle V.fmu --virtual T.fmu --strain S.fmu --out car.ssp

System Structure and Parameterization 1.0: one system, nine components, one parameter set for each.
The same content has the same bytes.
"""

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

from fmpy import read_model_description

from cosim.vehicle14.parameters import WHEELS
from tirelib.core.errors import ParameterError
from tirelib.core.threads import one_thread
from tirelib.fmu.describe import UNITS, repack
from tirelib.fmu.virtual.coordinates import INPUTS

SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SET = "initialValues"
"""Name of every parameter set: ecos takes the sets of a name, libcosim this one."""
FMU_TYPE = "application/x-fmu-sharedlibrary"
START_ANGLES = (-3.1, -1.6, 0.6, 2.2)
TURN_BRAKING = {
    "start_speed": 25.0,
    "steer_front": 0.015,
    "brake_FL": 500.0,
    "brake_FR": 500.0,
    "brake_RL": 200.0,
    "brake_RR": 200.0,
}
"""Parameters and held inputs of the vehicle: a slight turn under slight braking."""
_STRAIN = re.compile(r"strain_(\d+_)?\d+")
Value = float | int | bool | str


@dataclass(frozen=True)
class Component:
    """An FMU of a system: its file in the archive's resources, and its parameter set."""

    name: str
    fmu: Path
    parameters: Mapping[str, Value]


@dataclass(frozen=True)
class Link:
    """An output that goes to an input, both as (component, variable)."""

    source: tuple[str, str]
    target: tuple[str, str]


@dataclass(frozen=True)
class System:
    """Components and links.

    Attributes
    ----------
    name : str
    components : sequence of Component
    links : sequence of Link
    step, stop : float, [s]
        Step and end of the default experiment.
    """

    name: str
    components: Sequence[Component]
    links: Sequence[Link]
    step: float
    stop: float


def four_wheels(
    vehicle: Path,
    virtual: Path,
    strain: Path,
    *,
    stop: float = 1.0,
    driving: Mapping[str, Value] | None = None,
    wheels: Sequence[Mapping[str, Value]] | None = None,
) -> System:
    """Return the car: wheel quantities to the virtual tires, frames to the strain tires.

    Parameters
    ----------
    vehicle, virtual, strain : path
        The FMUs; both tires with the same samples per step and sample rate.
    stop : float, [s]
    driving : mapping, optional
        Parameters and held inputs of the vehicle; by default `TURN_BRAKING`.
    wheels : sequence of 4 mappings, optional
        Parameters of the virtual tires; by default a seed and a start angle of their own.

    Raises
    ------
    ParameterError
        If the tires do not fit together.
    """
    frame = [n for n in _variables(virtual) if _STRAIN.fullmatch(n)]
    taken = [n for n in _variables(strain) if _STRAIN.fullmatch(n)]
    if frame != taken:
        raise ParameterError(
            f"{virtual} gives {len(frame)} strains a step, {strain} takes {len(taken)}; build both "
            "with the same samples per step"
        )
    own = wheels or [{"seed": 11 + i, "start_angle": at} for i, at in enumerate(START_ANGLES)]
    components = [Component("vehicle", vehicle, driving or TURN_BRAKING)]
    links = []
    for wheel, options in zip(WHEELS, own, strict=True):
        tire, gages = f"tire_{wheel}", f"strain_{wheel}"
        held: dict[str, Value] = {"axes": "iso", "pressure": _pressure(virtual)}
        components += [Component(tire, virtual, options), Component(gages, strain, held)]
        pairs = [(("vehicle", f"{q}_{wheel}"), (tire, q)) for q in INPUTS if q != "pressure"]
        pairs += [((tire, name), (gages, name)) for name in (*frame, "frame_valid")]
        pairs += [(("vehicle", f"{q}_{wheel}"), (gages, q)) for q in ("speed", "camber", "omega")]
        links += [Link(*pair) for pair in pairs]
    described = read_model_description(str(virtual))
    step = float(described.defaultExperiment.stepSize)
    return System("four_strain_tires", components, links, step, stop)


def _variables(fmu: Path) -> dict[str, Any]:
    return {v.name: v for v in read_model_description(str(fmu)).modelVariables}


def _pressure(virtual: Path) -> float:
    """Return the pressure that a virtual tire has as long as nobody sets one [Pa]."""
    return float(_variables(virtual)["pressure"].start)


def write_ssp(system: System, out: Path) -> Path:
    """Write the archive: structure, parameter sets, FMUs.

    Raises
    ------
    ParameterError
        If a link or a parameter names a variable that an FMU has not.
    """
    _check(system)
    files = {"SystemStructure.ssd": structure(system)}
    for component in system.components:
        files[f"resources/{component.name}.ssv"] = parameter_set(component)
        files[f"resources/{component.fmu.name}"] = component.fmu.read_bytes()
    repack(files, out)
    return out


def _check(system: System) -> None:
    known = {c.name: _variables(c.fmu) for c in system.components}
    wrong = [
        f"{where}.{name}"
        for link in system.links
        for where, name in (link.source, link.target)
        if name not in known.get(where, {})
    ]
    wrong += [
        f"{c.name}.{n}" for c in system.components for n in c.parameters if n not in known[c.name]
    ]
    if wrong:
        raise ParameterError(
            f"{system.name}: no FMU has {', '.join(wrong)}; name variables of its components"
        )


def structure(system: System) -> bytes:
    """Return ``SystemStructure.ssd``."""
    root = Xml.Element(
        f"{{{SSD}}}SystemStructureDescription", {"version": "1.0", "name": system.name}
    )
    body = Xml.SubElement(root, f"{{{SSD}}}System", {"name": system.name})
    elements = Xml.SubElement(body, f"{{{SSD}}}Elements")
    for component in system.components:
        _component(elements, component, system.links)
    links = Xml.SubElement(body, f"{{{SSD}}}Connections")
    for link in system.links:
        Xml.SubElement(
            links,
            f"{{{SSD}}}Connection",
            {
                "startElement": link.source[0],
                "startConnector": link.source[1],
                "endElement": link.target[0],
                "endConnector": link.target[1],
            },
        )
    units = Xml.SubElement(root, f"{{{SSD}}}Units")
    for name, (base, _) in UNITS.items():
        unit = Xml.SubElement(units, f"{{{SSC}}}Unit", {"name": name})
        Xml.SubElement(unit, f"{{{SSC}}}BaseUnit", base)
    Xml.SubElement(
        root, f"{{{SSD}}}DefaultExperiment", {"startTime": "0.0", "stopTime": repr(system.stop)}
    )
    return _text(root)


def _component(elements: Xml.Element, component: Component, links: Sequence[Link]) -> None:
    """Describe a component with the connectors that are in use, and with those it may set."""
    element = Xml.SubElement(
        elements,
        f"{{{SSD}}}Component",
        {
            "name": component.name,
            "type": FMU_TYPE,
            "source": f"resources/{component.fmu.name}",
            "implementation": "CoSimulation",
        },
    )
    used = {
        end[1] for link in links for end in (link.source, link.target) if end[0] == component.name
    }
    connectors = Xml.SubElement(element, f"{{{SSD}}}Connectors")
    for name, variable in _variables(component.fmu).items():
        if name not in used and name not in component.parameters:
            continue
        entry = Xml.SubElement(
            connectors, f"{{{SSD}}}Connector", {"name": name, "kind": variable.causality}
        )
        kind = Xml.SubElement(entry, f"{{{SSC}}}{variable.type}")
        if variable.type == "Real" and variable.unit is not None:
            kind.set("unit", variable.unit)
    bindings = Xml.SubElement(element, f"{{{SSD}}}ParameterBindings")
    Xml.SubElement(
        bindings, f"{{{SSD}}}ParameterBinding", {"source": f"resources/{component.name}.ssv"}
    )


def parameter_set(component: Component) -> bytes:
    """Return the ``.ssv`` of a component."""
    root = Xml.Element(f"{{{SSV}}}ParameterSet", {"version": "1.0", "name": SET})
    entries = Xml.SubElement(root, f"{{{SSV}}}Parameters")
    kinds = {name: v.type for name, v in _variables(component.fmu).items()}
    for name, value in component.parameters.items():
        entry = Xml.SubElement(entries, f"{{{SSV}}}Parameter", {"name": name})
        text = str(value).lower() if isinstance(value, bool) else str(value)
        Xml.SubElement(entry, f"{{{SSV}}}{kinds[name]}", {"value": text})
    return _text(root)


def _text(root: Xml.Element) -> bytes:
    for prefix, space in (("ssc", SSC), ("ssd", SSD), ("ssv", SSV)):
        Xml.register_namespace(prefix, space)
    Xml.indent(root)
    text: bytes = Xml.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def main(arguments: list[str] | None = None) -> int:
    """Write an archive by the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("vehicle", "virtual", "strain", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--stop", type=float, default=1.0, help="end of the experiment [s]")
    told = parser.parse_args(arguments)
    system = four_wheels(told.vehicle, told.virtual, told.strain, stop=told.stop)
    out = write_ssp(system, told.out)
    sys.stdout.write(f"{out}: {len(system.components)} components, {len(system.links)} links\n")
    return 0


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
