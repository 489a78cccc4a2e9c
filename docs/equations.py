"""The page of equations, from the list in `theory/equations.toml`."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

LIST = Path(__file__).parent / "theory/equations.toml"


def parts() -> list[dict[str, Any]]:
    """Return the parts of the list, each with its equations."""
    found: list[dict[str, Any]] = tomllib.loads(LIST.read_text(encoding="utf-8"))["part"]
    return found


def plots() -> list[str]:
    """Return the names of the plots, each once."""
    return sorted({e["plot"] for part in parts() for e in part["equation"]})


def numbered(numbers: str) -> str:
    """Return "41-46,53" as it is read: (41) to (46), (53)."""
    return ", ".join(
        " to ".join(f"({n})" for n in group.split("-")) for group in numbers.split(",")
    )


def page() -> str:
    """Return the table and the sections in Markdown."""
    head = "| equation | what it is | print | code | test |\n|---|---|---|---|---|"
    rows = "\n".join(f"| {' | '.join(_row(e))} |" for part in parts() for e in part["equation"])
    return "\n".join([head, rows, "", *(line for part in parts() for line in _section(part))])


def _row(e: dict[str, Any]) -> Iterator[str]:
    yield numbered(e["numbers"])
    yield e["name"]
    yield "corrected" if "correction" in e else "right"
    yield (
        "`"
        + ".".join(e["code"][0].replace(":<module>", "").replace(":", ".").split(".")[-2:])
        + "`"
    )
    yield _test(e["tests"][0]).partition(": ")[2]


def _section(part: dict[str, Any]) -> Iterator[str]:
    yield f"## {part['name']}\n"
    for e in part["equation"]:
        yield f"### {e['name']}: {numbered(e['numbers'])}\n"
        lines = e["law"].replace(r"\qquad", r"\\").strip()
        yield f"$$\n\\begin{{gathered}}\n{lines}\n\\end{{gathered}}\n$$\n"
        yield f"**Symbols:** {_set(e['symbols'])}.\n"
        if "correction" in e:
            yield f"**Correction:** {_set(e['correction'])}\n"
        yield f"**Valid:** {_set(e['valid'])}\n"
        yield f"**Code:** {', '.join(_code(name) for name in e['code'])}\n"
        yield "**Tests:**\n"
        yield "\n".join(f"- {_test(name)}" for name in e["tests"]) + "\n"
        yield f"![{e['name']}](/_generated/plots/{e['plot']}.png)\n"


def _set(text: str) -> str:
    """Return the text with indices as indices: R_eff has one, `half_length` has none."""
    parts = re.split(r"(`[^`]*`)", text)
    parts[::2] = [re.sub(r"\b([^\W\d_]+'?)_(\w+)", r"\1<sub>\2</sub>", part) for part in parts[::2]]
    return "".join(parts)


def _code(name: str) -> str:
    module, _, thing = name.partition(":")
    return f"`{module}`" if thing == "<module>" else f"`{module}.{thing}`"


def _test(name: str) -> str:
    file, _, test = name.partition("::")
    return f"`{Path(file).name}`: {test.removeprefix('test_').replace('_', ' ')}"
