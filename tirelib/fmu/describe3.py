"""``modelDescription.xml`` of FMI 3.0: the variables of FMI 2.0, numbered ones joined to arrays.

``strain_2_3`` of FMI 2.0 is an element of ``strain`` here, shape (samples, gages). An array's value
reference is that of its first element. Behind the variables come the clock `CLOCK`, which ticks
where a turn has ended, and the time (FMI 3.0.2, sections 2.2.8 and 2.4.7).
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from xml.etree import ElementTree as Xml

from tirelib.core.version import __version__
from tirelib.fmu.describe import TYPES, UNITS
from tirelib.fmu.variables import Variable

CLOCK = "turn_ended"
"""Name of the clock."""
JOINED = ("strain", "contact_length", "contact_length_std")
"""Names of the arrays."""
_NUMBERED = re.compile(rf"({'|'.join(JOINED)})_(\d+)(?:_(\d+))?")
_KINDS = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}


@dataclass(frozen=True, slots=True)
class Placed:
    """A variable of FMI 3.0.

    Attributes
    ----------
    variable : Variable
        With the name of FMI 3.0.
    reference : int
        Its value reference.
    shape : tuple of int
        Empty for a scalar.
    """

    variable: Variable
    reference: int
    shape: tuple[int, ...] = ()


def joined(table: Sequence[Variable]) -> list[Placed]:
    """Return the variables of FMI 3.0.

    Parameters
    ----------
    table : sequence of Variable
        Those of FMI 2.0; value references follow its order.
    """
    found: dict[str, Placed] = {}
    for reference, variable in enumerate(table):
        match = _NUMBERED.fullmatch(variable.name)
        if match is None:
            found[variable.name] = Placed(variable, reference)
            continue
        name, *numbers = match.groups()
        shape = tuple(int(number) for number in numbers if number)
        first = found.get(name) or Placed(_array(variable, name), reference)
        found[name] = replace(first, shape=shape)  # the last element's numbers are the sizes
    return list(found.values())


def _array(first: Variable, name: str) -> Variable:
    """Return an array from its first element: where gages lie is said of all of them."""
    about = re.sub(
        r"at lateral position \S+ mm of the chosen axes(, sample 1 of (\d+), oldest first)?",
        lambda m: (
            "of all gages in the order of their lateral positions"
            + (f"; {m[2]} samples, oldest first" if m[2] else "")
        ),
        first.description,
    )
    about = about.replace("contact_length_1", "contact_length")
    return replace(first, name=name, description=about)


def flat_names(table: Sequence[Variable]) -> list[Variable]:
    """Return the table with every element named as its array, for messages."""
    names = [_NUMBERED.fullmatch(variable.name) for variable in table]
    return [
        variable if match is None else replace(variable, name=match[1])
        for variable, match in zip(table, names, strict=True)
    ]


def model_description(
    table: Sequence[Variable],
    *,
    model: str,
    description: str,
    token: str,
    version: str,
    step_size: float,
    known: Sequence[str],
) -> bytes:
    """Return the model description.

    Parameters
    ----------
    table : sequence of Variable
        In the order of the value references.
    model, description, token, version : str
    step_size : float, [s]
        Communication step of the default experiment.
    known : sequence of str
        Names of the variables that the outputs at the start depend on.
    """
    root = Xml.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": model,
            "instantiationToken": token,
            "description": description,
            "author": "The tirelib developers",
            "version": version,
            "license": "MIT",
            "generationTool": f"tirelib {__version__}",
            "variableNamingConvention": "flat",
        },
    )
    Xml.SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": model,
            "canHandleVariableCommunicationStepSize": "true",
            "canGetAndSetFMUState": "true",
            "canSerializeFMUState": "true",
            "hasEventMode": "true",
        },
    )
    _units(Xml.SubElement(root, "UnitDefinitions"))
    _types(Xml.SubElement(root, "TypeDefinitions"))
    Xml.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0.0", "stopTime": "1.0", "stepSize": f"{step_size!r}"},
    )
    placed = joined(table)
    variables = Xml.SubElement(root, "ModelVariables")
    for one in placed:
        variables.append(_variable(one))
    clock, time = str(len(table)), str(len(table) + 1)
    Xml.SubElement(
        variables,
        "Clock",
        {
            "name": CLOCK,
            "valueReference": clock,
            "description": "ticks at the end of the step in which `turn` counts on",
            "causality": "output",
            "intervalVariability": "triggered",
        },
    )
    Xml.SubElement(
        variables,
        "Float64",
        {
            "name": "time",
            "valueReference": time,
            "causality": "independent",
            "variability": "continuous",
            "unit": "s",
        },
    )
    _structure(Xml.SubElement(root, "ModelStructure"), placed, clock, known)
    Xml.indent(root)
    text: bytes = Xml.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def build_description(model: str, sources: Sequence[str]) -> bytes:
    """Return ``sources/buildDescription.xml``: the C files, for importers that compile."""
    root = Xml.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = Xml.SubElement(root, "BuildConfiguration", {"modelIdentifier": model})
    files = Xml.SubElement(
        configuration,
        "SourceFileSet",
        {"language": "C99", "compiler": "gcc", "compilerOptions": "-O2 -ffp-contract=off"},
    )
    for name in sources:
        if name.endswith(".c"):
            Xml.SubElement(files, "SourceFile", {"name": name})
    Xml.SubElement(configuration, "Library", {"name": "m", "external": "true"})
    Xml.indent(root)
    text: bytes = Xml.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def _variable(one: Placed) -> Xml.Element:
    variable = one.variable
    about = {
        "name": variable.name,
        "valueReference": str(one.reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": _variability(one),
    }
    element = Xml.Element(_KINDS[variable.kind], about)
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
            element.set(name, value if isinstance(value, str) else f"{value:.16g}")
    for size in one.shape:
        Xml.SubElement(element, "Dimension", {"start": str(size)})
    if variable.causality == "output":
        element.set("initial", "calculated")
    elif variable.kind == "String":
        Xml.SubElement(element, "Start", {"value": str(variable.start)})
    else:
        element.set("start", " ".join([_start(variable)] * math.prod(one.shape)))
    return element


def _variability(one: Placed) -> str:
    """Return how a variable changes: strain is sampled from a course, conditions are held."""
    if one.variable.causality == "parameter":
        return "fixed"
    return "continuous" if one.variable.causality == "input" and one.shape else "discrete"


def _start(variable: Variable) -> str:
    if isinstance(variable.start, bool):
        return "true" if variable.start else "false"
    if isinstance(variable.start, float):
        return "NaN" if math.isnan(variable.start) else f"{variable.start:.16g}"
    return str(variable.start)


def _units(definitions: Xml.Element) -> None:
    for name, (base, displays) in UNITS.items():
        unit = Xml.SubElement(definitions, "Unit", {"name": name})
        Xml.SubElement(unit, "BaseUnit", base)
        for display, factor in displays.items():
            Xml.SubElement(unit, "DisplayUnit", {"name": display, "factor": f"{factor:.16g}"})


def _types(definitions: Xml.Element) -> None:
    for name, (unit, display, meaning) in TYPES.items():
        about = {"name": name, "description": meaning, "quantity": name, "unit": unit}
        if display is not None:
            about["displayUnit"] = display
        Xml.SubElement(definitions, "Float64Type", about)


def _structure(
    structure: Xml.Element, placed: Sequence[Placed], clock: str, known: Sequence[str]
) -> None:
    """Write the outputs: between steps they stand still, at the start they follow parameters."""
    outputs = [str(p.reference) for p in placed if p.variable.causality == "output"]
    before = [str(p.reference) for p in placed if p.variable.name in known]
    for reference in (*outputs, clock):
        Xml.SubElement(structure, "Output", {"valueReference": reference, "dependencies": ""})
    for reference in (*outputs, clock):
        about = {"valueReference": reference, "dependencies": " ".join(before)}
        if reference == clock:
            about["dependencies"] = ""
        Xml.SubElement(structure, "InitialUnknown", about)
