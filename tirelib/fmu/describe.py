"""What pythonfmu leaves out of ``modelDescription.xml``: units, types, limits, unknowns at start.

Also a zip whose bytes depend on its content alone.
"""

import math
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as Xml

from tirelib.fmu.variables import Variable

UNITS: Mapping[str, tuple[dict[str, str], dict[str, float]]] = {
    "1": ({}, {"ustrain": 1e6, "%": 1e2}),
    "N": ({"kg": "1", "m": "1", "s": "-2"}, {"kN": 1e-3}),
    "N m": ({"kg": "1", "m": "2", "s": "-2"}, {"kN m": 1e-3}),
    "rad": ({"rad": "1"}, {"deg": 180.0 / math.pi}),
    "m": ({"m": "1"}, {"mm": 1e3}),
    "m/s": ({"m": "1", "s": "-1"}, {"km/h": 3.6}),
    "Pa": ({"kg": "1", "m": "-1", "s": "-2"}, {"bar": 1e-5}),
    "rad/s": ({"rad": "1", "s": "-1"}, {"rpm": 30.0 / math.pi}),
    "s": ({"s": "1"}, {"ms": 1e3}),
    "Hz": ({"s": "-1"}, {"kHz": 1e-3}),
    "1/s": ({"s": "-1"}, {"ustrain/s": 1e6}),
    "kg": ({"kg": "1"}, {}),
    "K": ({"K": "1"}, {}),
    "m/s2": ({"m": "1", "s": "-2"}, {}),
}
"""Exponents of the base units, and factors of the display units, of every unit in use."""
TYPES: Mapping[str, tuple[str, str | None, str]] = {
    "Strain": ("1", "ustrain", "strain, positive in tension"),
    "StrainRate": ("1/s", "ustrain/s", "strain rate"),
    "Force": ("N", "kN", "force"),
    "Moment": ("N m", "kN m", "moment"),
    "Angle": ("rad", "deg", "angle"),
    "Ratio": ("1", None, "dimensionless number"),
    "Length": ("m", "mm", "length"),
    "Speed": ("m/s", "km/h", "travel speed"),
    "Pressure": ("Pa", "bar", "gauge pressure"),
    "TurnRate": ("rad/s", "rpm", "turn rate"),
    "Time": ("s", "ms", "time"),
    "Frequency": ("Hz", "kHz", "frequency"),
    "Temperature": ("K", None, "temperature"),
    "Mass": ("kg", None, "mass"),
    "Acceleration": ("m/s2", None, "acceleration"),
}
"""Unit, display unit and meaning of every declared type."""
EPOCH = (2000, 1, 1, 0, 0, 0)
"""Time of every file in the zip, so that the same content has the same bytes."""


def described(
    source: bytes, table: Sequence[Variable], known: Sequence[str] | None = None
) -> bytes:
    """Return a model description with units, limits and unknowns added.

    Parameters
    ----------
    source : bytes
        What pythonfmu wrote.
    table : sequence of Variable
        In the order of the scalar variables.
    known : sequence of str, optional
        Names of the variables that the outputs at the start depend on; by default they may depend
        on all parameters and inputs.
    """
    root = Xml.fromstring(source)
    root.attrib.pop("generationDateAndTime", None)
    simulation = root.find("CoSimulation")
    scalars = root.find("ModelVariables")
    structure = root.find("ModelStructure")
    if simulation is None or scalars is None or structure is None:
        raise ValueError("pythonfmu wrote no CoSimulation, ModelVariables or ModelStructure")
    place = list(root).index(simulation) + 1
    root[place:place] = [_unit_definitions(), _type_definitions()]
    for output in structure.iter("Unknown"):
        output.set("dependencies", "")  # a step takes the inputs; between steps outputs stand still
    unknown = Xml.SubElement(structure, "InitialUnknowns")
    numbers = {variable.name: str(number) for number, variable in enumerate(table, start=1)}
    given = {} if known is None else {"dependencies": " ".join(numbers[name] for name in known)}
    for number, (scalar, variable) in enumerate(zip(scalars, table, strict=True), start=1):
        _describe(scalar, variable)
        if variable.causality == "output":
            Xml.SubElement(unknown, "Unknown", {"index": str(number), **given})
    Xml.indent(root)
    text: bytes = Xml.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def _describe(scalar: Xml.Element, variable: Variable) -> None:
    if scalar.get("name") != variable.name:
        raise ValueError(f"variable {scalar.get('name')!r} stands where {variable.name!r} should")
    kind = scalar.find(variable.kind)
    if kind is None:
        raise ValueError(f"{variable.name} is not of type {variable.kind}")
    if kind.get("start") == "nan":
        kind.set("start", "NaN")
    if variable.causality == "output":
        kind.attrib.pop("start", None)
    if variable.type is not None and TYPES[variable.type][0] != variable.unit:
        raise ValueError(f"{variable.name}: type {variable.type} is not in {variable.unit}")
    optional = {
        "declaredType": variable.type,
        "unit": variable.unit,
        "displayUnit": variable.display,
        "min": variable.low,
        "max": variable.high,
        "nominal": variable.nominal,
    }
    for name, value in optional.items():
        if value is not None:
            kind.set(name, value if isinstance(value, str) else f"{value:.16g}")


def _unit_definitions() -> Xml.Element:
    definitions = Xml.Element("UnitDefinitions")
    for name, (base, displays) in UNITS.items():
        unit = Xml.SubElement(definitions, "Unit", {"name": name})
        Xml.SubElement(unit, "BaseUnit", base)
        for display, factor in displays.items():
            Xml.SubElement(unit, "DisplayUnit", {"name": display, "factor": f"{factor:.16g}"})
    return definitions


def _type_definitions() -> Xml.Element:
    definitions = Xml.Element("TypeDefinitions")
    for name, (unit, display, meaning) in TYPES.items():
        kind = Xml.SubElement(definitions, "SimpleType", {"name": name, "description": meaning})
        real = Xml.SubElement(kind, "Real", {"quantity": name, "unit": unit})
        if display is not None:
            real.set("displayUnit", display)
    return definitions


def repack(files: Mapping[str, bytes], target: Path) -> None:
    """Write a zip: sorted, compressed, without times, so that the same content has the same bytes.

    The model description comes first, where importers look for it.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda name: (name != "modelDescription.xml", name)):
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name])
