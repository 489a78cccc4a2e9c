"""The page of ``tirelib fmu check``: what was tried, what came out, where it differs."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from tirelib.report.page import Part, Picture, Table, draw_all, number, write_page
from tirelib.report.style import BLUE, ORANGE, new_figure, styled

Document = Mapping[str, Any]
_TITLES = {
    "archive": "archive",
    "validation": "validation",
    "description": "description",
    "run": "run",
    "reference": "reference signals",
    "end": "end of the process",
}


def verdict(document: Document) -> str:
    """Return the result as a sentence."""
    failed = [
        _TITLES.get(part["name"], part["name"]) for part in document["parts"] if not part["passed"]
    ]
    if failed:
        return f"Failed: {', '.join(failed)}."
    if document["compared"]:
        return "Passed: the FMU is valid, runs, and reproduces its reference signals."
    return "Passed without reference: the FMU is valid and runs, but holds no reference signals."


def write_check(document: Document, folder: Path) -> Path:
    """Write ``index.html`` and its figures."""
    facts = document["facts"]
    name = facts.get("modelName") or document["file"]
    drawings = []
    curves = document.get("curves")
    if curves:
        drawings.append(
            Picture(
                "outputs",
                "Outputs and their reference signals",
                "Broad line: reference signal in the FMU; thin line: output of this FMU here. SI "
                "units.",
                partial(_draw, curves, document["units"]),
            )
        )
    pictures = draw_all(folder, drawings)
    sections = [
        Part("What was tried", "parts", tables=[_parts(document)]),
        Part("The FMU", "facts", tables=[_facts(document)]),
    ]
    if document["variables"]:
        sections.insert(
            1,
            Part(
                "Against the reference",
                "reference",
                tables=[_variables(document)],
                pictures=pictures,
            ),
        )
    if document["messages"]:
        rows = [[message] for message in document["messages"]]
        sections.append(
            Part("What the FMU logged", "log", tables=[Table("Log", ["message"], rows)])
        )
    return write_page(
        folder,
        "base.html",
        title=f"Check of {name}",
        summary=Markup("<strong>{}</strong> File {}, {} kB.").format(
            verdict(document), document["file"], f"{document['size'] / 1e3:.0f}"
        ),
        sections=sections,
    )


def _parts(document: Document) -> Table:
    rows = [
        [_TITLES.get(p["name"], p["name"]), "passed" if p["passed"] else "FAILED", p["detail"]]
        for p in document["parts"]
    ]
    return Table("Parts of the check", ["part", "result", "detail"], rows, texts=3)


def _facts(document: Document) -> Table:
    facts, known = document["facts"], document["environment"]
    rows = [
        ["model", str(facts.get("modelName") or "unknown")],
        ["description", str(facts.get("description") or "")],
        ["FMI version", str(facts.get("fmiVersion") or "unknown")],
        ["version", str(facts.get("version") or "")],
        ["made with", str(facts.get("generationTool") or "unknown")],
        ["platforms", ", ".join(facts.get("platforms", [])) or "unknown"],
        ["GUID", str(facts.get("guid") or "")],
        ["SHA-256 of the file", document["sha256"]],
        ["checked with", ", ".join(f"{name} {version}" for name, version in known.items())],
    ]
    return Table("File and environment", ["", ""], rows, texts=2)


def _variables(document: Document) -> Table:
    return Table.of(
        "Largest difference of every output",
        document["variables"],
        {
            "output": lambda row: row["name"],
            "unit": lambda row: row["unit"],
            "result": lambda row: "as expected" if row["passed"] else "DIFFERS",
            "difference": lambda row: number(row["largest_difference"], 2),
            "allowed": lambda row: number(row["allowed"], 2),
            "magnitude": lambda row: number(row["magnitude"]),
            "at [s]": lambda row: number(row["time"]),
        },
        texts=3,
        note=f"Allowed: {document['tolerance']:g} of the largest magnitude of the output. A dash: "
        "the output has a number where the reference has none, or the reverse.",
    )


@styled
def _draw(curves: Mapping[str, Any], units: Mapping[str, str]) -> Figure:
    names: Sequence[str] = list(curves["expected"])
    figure = new_figure(8.0, 1.7 * len(names) + 0.6)
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    times = np.asarray(curves["time"])
    for panel, name in zip(panels, names, strict=True):
        panel.plot(times, curves["expected"][name], color=ORANGE, lw=4.5, label="expected")
        panel.plot(times, curves["seen"][name], color=BLUE, lw=1.2, label="this FMU")
        panel.ticklabel_format(useOffset=False)
        unit = units.get(name, "")
        panel.set_ylabel(f"{name} [{unit}]" if unit not in ("", "1") else name)
    panels[-1].set_xlabel("time [s]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure
