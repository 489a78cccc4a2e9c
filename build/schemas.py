"""JSON Schemas of the documents that verbs write with ``--json``, learned from real documents.

    python build/schemas.py FOLDER...    writes docs/reference/schemas

Every document below the folders is read: the output of any work with ``--json``, or a session of
the studio. A schema holds for what was seen: keys and types; any number may be null. What each
document is, and which objects are tables by names, is said below.
"""

import argparse
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from genson import SchemaBuilder

from tirelib.core.threads import one_thread

OUT = Path(__file__).resolve().parent.parent / "docs/reference/schemas"
ABOUT = {
    "tirelib-calibrate/1": "`tirelib calibrate`: statistics of all estimators.",
    "tirelib-campaign-check/1": "`tirelib campaign check`: every finding of a folder.",
    "tirelib-campaign-show/1": "`tirelib campaign show`: header and runs of a campaign.",
    "tirelib-comparison/1": "`tirelib compare`: where a model fails, and under which conditions.",
    "tirelib-diagnosis/1": "`tirelib diagnose`: the verdict, and every effect with its strength.",
    "tirelib-effects/1": "`tirelib effects`: what each effect is.",
    "tirelib-estimate/1": "`tirelib estimate`, `tirelib fmu run`, `tirebench run`, "
    "`tirebench replay`: every turn, a summary.",
    "tirelib-explanation/1": "`tirelib explain`: all steps from the model to the added effect.",
    "tirelib-export/1": "`tirelib export`: coefficients, errors and range of a Magic Formula.",
    "tirelib-extension/1": "`tirelib add`: the errors before and after an effect.",
    "tirelib-features/1": "`tirelib features`: what was extracted.",
    "tirelib-fleet-run/1": "`tirelib fleet`: what became of each campaign.",
    "tirelib-fmu-check/1": "`tirelib fmu check`: every check of an FMU.",
    "tirelib-identification/1": "`tirelib identify`: constants with intervals; what narrows them.",
    "tirelib-import/1": "`tirelib import`: what was imported.",
    "tirelib-import-list/1": "`tirelib import --list`: the columns of each file.",
    "tirelib-next-test/1": "`tirelib next-test`: the runs that separate the suspects.",
    "tirelib-rig/1": "`tirelib rig`: what was measured, or the plans and tires.",
    "tirelib-selftest/1": "`tirelib selftest`: the chance of finding each effect.",
    "tirelib-simulation/1": "`tirelib simulate`: each condition with its results.",
    "tirebench-emulation/1": "`tirebench emulate`: what was sent.",
    "tirebench-export/1": "`tirebench export`: what was written.",
    "tirebench-load/1": "`tirebench load`: bus load of a plan, and plans that fit.",
    "tirebench-ports/1": "`tirebench ports`: the serial ports.",
    "tirebench-record/1": "`tirebench record`: what was recorded.",
}
"""Documents that verbs write, and what each holds."""
BY_NAME = {
    *("wheels", "processes", "cpu_s", "restarts", "faults", "flags", "coefficients", "given_up"),
    *("dead", "dead_reasons", "would_revive", "separation", "bands", "powers", "forces"),
    *("widened_percent", "levels", "force_errors", "errors", "left_out"),
}
"""Keys that hold a table by names: of wheels, processes, flags, effects, conditions, quantities."""
BY_GAGE = {"^contact_length_[1-9][0-9]*(_std)?_mm$": {"type": ["number", "null"]}}
"""Keys with the number of a gage in them."""


INSTEAD = {"slip_angle_deg": "slip_ratio", "slip_angles_deg": "slip_ratios"}
"""Keys that a longitudinal force has in the place of others."""


COUNTED = ("frames", "runs", "samples")
"""What an export has written, by its format; one of them is a key of its document."""


def learned(documents: list[Any]) -> dict[str, Any]:
    """Return the schema that all documents fulfil."""
    builder = SchemaBuilder("https://json-schema.org/draft/2020-12/schema")
    for document in documents:
        builder.add_object(document)
    return dict(general(builder.to_schema()))


def merged(schemas: Iterable[Any]) -> Any:
    """Return one schema for what each of several holds for."""
    builder = SchemaBuilder(None)
    for schema in schemas:
        builder.add_schema(schema)
    return builder.to_schema()


def general(schema: Any, key: str = "") -> Any:
    """Return the schema with tables by names, gages of any number, and numbers that may be null."""
    if isinstance(schema, list):
        return [general(part, key) for part in schema]
    if not isinstance(schema, dict):
        return schema
    if schema == {"type": "null"}:  # nothing else was seen, and anything may come
        return {}
    if schema.get("type") in ("number", "integer") and len(schema) == 1:
        return {"type": [schema["type"], "null"]} if schema["type"] == "number" else schema
    properties = schema.get("properties")
    out = {
        name: general(value, "" if name == "items" and key in BY_NAME else key)
        for name, value in schema.items()
        if name != "properties"
    }
    if isinstance(properties, dict):
        if key in BY_NAME:
            out["additionalProperties"] = general(merged(properties.values()))
            out.pop("required", None)
        else:
            values = {name: general(value, name) for name, value in properties.items()}
            own = {n: v for n, v in values.items() if not any(re.match(p, n) for p in BY_GAGE)}
            if key in ("best", "candidates", "envelope"):
                own |= {INSTEAD[name]: value for name, value in own.items() if name in INSTEAD}
            out["properties"] = own
            if len(own) < len(values):
                out["patternProperties"] = BY_GAGE
                out["required"] = [name for name in out.get("required", ()) if name in own]
    return out


def main() -> None:
    """Write a schema for each format that was seen."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("folder", type=Path, nargs="+")
    given = parser.parse_args()
    seen: dict[str, list[Any]] = {}
    for path in sorted(path for folder in given.folder for path in folder.rglob("*.json")):
        document = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(document, dict) and "format" in document:
            seen.setdefault(document["format"], []).append(document)
    OUT.mkdir(parents=True, exist_ok=True)
    for name, documents in seen.items():
        if name not in ABOUT:
            continue
        schema = learned(documents)
        schema["properties"]["format"] = {"const": name, "type": "string"}
        if name == "tirebench-export/1":
            schema["properties"] |= {key: {"type": "integer"} for key in COUNTED}
            schema["required"] = [key for key in schema["required"] if key not in COUNTED]
        head = {"title": name, "description": ABOUT[name]}
        path = OUT / f"{name.replace('/', '-')}.schema.json"
        path.write_text(json.dumps({**head, **schema}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    with one_thread():
        main()
