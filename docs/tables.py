"""Tables of the reference that are made from the code: flags, variables of the FMUs, documents."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from equations import page as equations
from sphinx.pycode import ModuleAnalyzer

from tirelib.core.flags import INVALIDATING, TurnFlag
from tirelib.fmu.strain_variables import inputs, outputs, parameters
from tirelib.fmu.variables import Variable
from tirelib.fmu.virtual import table as virtual
from tirelib.fmu.virtual.spec import friction_surface
from tirelib.fmu.virtual.surface import shared_surface

ORDER = (
    "strain_to_load",
    "missing_effect",
    "own_measurements",
    "vehicle_loop",
    "bench_transmitter",
    "extend",
)
"""Tutorials in the order of a first hour."""
SCHEMAS = Path(__file__).parent / "reference/schemas"
LATERAL = (-0.06, -0.03, 0.0, 0.03, 0.06)
"""Gages in the order of the numerical rig, from right to left."""
REMEDIES = {
    "FIRST_TURN": "Nothing: from the second turn on there are estimates.",
    "GAP": "Look at the losses of the line (`line` in the JSON of the bench), and at the rate; in"
    " an FMU at `frame_valid`, and whether the host steps longer than a frame.",
    "BRIDGED": "Nothing; if it comes often, look at the line, or at the host's step, as for a gap.",
    "SPIKE": "Nothing if rare; else look for a loose contact or interference.",
    "SATURATED": "Lower the gain of the amplifier, or zero the gage again (`tirebench zero`); in "
    "an FMU check the unit of the strain (1, not microstrain).",
    "DEAD_GAGE": "Look at the wiring of the gage (in an FMU the one whose `contact_length` is "
    "NaN); estimates go on without one outer gage.",
    "PERIOD_JUMP": "Nothing after a stop or a lock; else the contacts of this turn were misread: "
    "check `sample_rate`, and that the host does not step longer than a frame.",
    "TRIGGER_MISMATCH": "Look at the trigger's sensor; the contacts are found in the strain.",
    "OMEGA_MISMATCH": "Give the turn rate in rad/s, of this wheel, positive forward, or omit it; "
    "if it is right, check `sample_rate` and the unit of the strain.",
    "DRIFT": "Let the gages warm up, or zero them again; look at the glue.",
    "NO_SPEED": "Give the travel speed (`--speed`, input `speed`); without it there is no kappa.",
    "REVERSED": "Drive forward, or turn the sign of the speed (positive in all axes): "
    "calibrations hold forward only.",
    "OUT_OF_RANGE": "Check the unit of what a note, or the log of an FMU, names; else calibrate "
    "there.",
    "CUT_OFF": "Leave out `--cut-off`, or raise the sample rate of the gages (`sample_rate`).",
    "REDUCED_GAGES": "Repair the gage; until then intervals are those without it.",
    "TOO_FEW_GAGES": "Repair the gages: the centre gage and all but one of the others are needed.",
    "NO_CONDITION": "Give pressure, camber and speed: the calibration varied what is missing.",
    "WEAK_EDGE": "Look at the load: at very low loads the contact has no clear edges.",
    "NO_CONTACT": "The wheel stands, or the gages are dead, frozen or not connected; in an FMU "
    "also: frames are not valid, read the `status` of `VirtualTire.fmu`.",
    "FAULT": "Read the log, and report it: this is an error of the estimator.",
    "OTHER_TIRE": "Use the calibration of the tire on the wheel; check pressure, tread and the "
    "order of the gages (`lateral_m` of the calibration).",
    "ACCELERATING": "Give the turn rate of the wheel (input `omega`), from a speed sensor, the "
    "rig or the vehicle.",
}
"""What to do about a flag; `tests/chain/test_documentation.py` asks for one for each."""


def in_order(name: str) -> int:
    """Return the place of a tutorial."""
    return ORDER.index(Path(name).stem)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(
        "| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines
    )


def flags() -> str:
    """Return bit, name, meaning, consequence and remedy of every flag."""
    said = ModuleAnalyzer.for_module("tirelib.core.flags").find_attr_docs()
    rows = [
        (
            flag.value,
            f"`{name.lower()}`",
            " ".join(" ".join(said["TurnFlag", name]).split()).replace("``", "`"),
            "not valid" if flag in INVALIDATING else "still used",
            REMEDIES[name],
        )
        for name, flag in sorted(TurnFlag.__members__.items(), key=lambda item: item[1])
    ]
    return table(("bit", "flag", "what it means", "the turn is", "what to do"), rows)


def variables(every: Sequence[Variable]) -> str:
    """Return a table for each causality."""
    parts = []
    for causality in ("parameter", "input", "output"):
        rows = [
            (f"`{v.name}`", v.kind, v.unit or "", _limits(v), v.start, v.description)
            for v in every
            if v.causality == causality
        ]
        head = ("name", "type", "unit", "allowed", "start", "meaning")
        parts.append(f"### {causality.capitalize()}s\n\n{table(head, rows)}")
    return "\n\n".join(parts)


def _limits(variable: Variable) -> str:
    ends = ["" if end is None else f"{float(end):.4g}" for end in (variable.low, variable.high)]
    return " .. ".join(ends) if any(ends) else ""


def strain_variables() -> str:
    """Return the variables of ``StrainTire.fmu`` for one sample a step."""
    return variables([*parameters(1e4), *inputs(LATERAL, 1, buffered=True), *outputs(LATERAL)])


def virtual_variables() -> str:
    """Return the variables of ``VirtualTire.fmu`` for one sample a step."""
    surface = shared_surface(friction_surface())
    return variables(
        [
            *virtual.parameters(1e4),
            *virtual.inputs(surface),
            *virtual.outputs(surface, 1),
        ]
    )


def documents() -> str:
    """Return each document with its keys, from the schemas."""
    parts = []
    for path in sorted(SCHEMAS.glob("*.schema.json")):
        schema = json.loads(path.read_text(encoding="utf-8"))
        always = schema.get("required", ())
        rows = [
            (f"`{key}`", _kind(value), "always" if key in always else "where it applies")
            for key, value in schema["properties"].items()
        ]
        parts.append(
            f"## {schema['title']}\n\n{schema['description']} "
            f"{{download}}`Schema </reference/schemas/{path.name}>`\n\n"
            + table(("key", "type", "present"), rows)
        )
    return "\n\n".join(parts)


def _kind(value: dict[str, Any]) -> str:
    if "anyOf" in value:
        return ", ".join(dict.fromkeys(_kind(one) for one in value["anyOf"]))
    kinds = value.get("type", "any")
    if kinds == "array" and "items" in value:
        return f"array of {_kind(value['items'])}"
    return kinds if isinstance(kinds, str) else ", ".join(kinds)


TABLES = {
    "flags": flags,
    "strain_variables": strain_variables,
    "virtual_variables": virtual_variables,
    "documents": documents,
    "equations": equations,
    "plain_tires": lambda: (
        "![Apparent strengths of plain tires](/_generated/plots/plain_tires.png)"
    ),
}
"""Generated parts of pages, by the name of their file."""


def write_all(folder: Path) -> None:
    """Write every table, and the equations, where they have changed."""
    (folder / "plots").mkdir(parents=True, exist_ok=True)
    for name, make in TABLES.items():
        path, text = folder / f"{name}.md", make() + "\n"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
