"""JSON documents that tests leave behind, checked against the published schemas.

The published schemas allow further keys, so that readers live with a newer version. Here they do
not: a key that a schema does not name is a document that has left its schema behind.
"""

import json
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import fastjsonschema

SCHEMAS = Path(__file__).parents[1] / "docs/reference/schemas"


def closed(schema: Any) -> Any:
    """Return the schema with no other keys allowed than those that it names."""
    if isinstance(schema, list):
        return [closed(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    out = {key: closed(value) for key, value in schema.items()}
    if isinstance(schema.get("properties"), dict) and schema.get("type") == "object":
        out.setdefault("additionalProperties", False)
    return out


@cache
def check_of(name: str) -> Callable[[Any], Any]:
    """Return the function that raises where a document of this format is not as its schema says.

    Raises
    ------
    FileNotFoundError
        If the format has no schema.
    """
    path = SCHEMAS / f"{name.replace('/', '-')}.schema.json"
    schema = json.loads(path.read_text(encoding="utf-8"))
    check: Callable[[Any], Any] = fastjsonschema.compile(closed(schema))
    return check


def wrong_documents(folder: Path) -> Iterator[str]:
    """Yield what is wrong with each document below the folder that has a schema.

    A document that a test has made by hand (`made_by_hand`) need not be whole.
    """
    formats = {path.name.removesuffix(".schema.json") for path in SCHEMAS.glob("*.schema.json")}
    for path in sorted(folder.rglob("*.json")):
        document = _read(path)
        name = document.get("format") if isinstance(document, dict) else None
        if not isinstance(name, str) or "made_by_hand" in document:
            continue
        if name.replace("/", "-") in formats:
            try:
                check_of(name)(document)
            except fastjsonschema.JsonSchemaValueException as error:
                yield f"{path}: {error.message[:500]}"


def _read(path: Path) -> Any:
    """Return what a file holds; nothing for a file that a test cut off or never finished."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return None
