"""The own page of a campaign or recording in a fleet: what a verb said of it, and its channels."""

from collections.abc import Mapping, Sequence
from typing import Any

from tirelib.report.page import DASH, INTERVAL, Part, Table, filled, number

REPORT_PAGES = {
    "calibrate": "index.html",
    "estimate": "index.html",
    "compare": "index.html",
    "diagnose": "diagnosis.html",
}
"""First page of the whole report of each verb that has one."""


def container_page(
    task: str,
    container: Mapping[str, Any],
    results: Sequence[Mapping[str, Any]],
    channels: Sequence[Mapping[str, Any]],
    said: str,
    report: str,
) -> str:
    """Return the page.

    Parameters
    ----------
    container : mapping
        Its row of ``container_metrics``.
    results, channels : sequences of mappings
        Its rows of ``results`` and ``channel_metrics``.
    said : str
        What the verb printed.
    report : str
        Folder of the whole report beside the page; empty if there is none.
    """
    began = container["start_dt"]
    when = "" if began is None else f", recorded {began:%Y-%m-%d %H:%M} UTC"
    sections = [
        Part("Results", "results", tables=[_results(results)]),
        Part("Channels", "channels", tables=[_channels(channels)] if channels else []),
        Part(
            "What the command said",
            "said",
            tables=[
                Table("Output", ("line",), [[line] for line in said.splitlines()], folded=True)
            ],
        ),
    ]
    return filled(
        "fleet_container.html",
        title=f"{container['name']}: {task}",
        summary=f"Tire {container['tire'] or DASH}{when}. {container['file_path']}",
        sections=[each for each in sections if each.tables],
        report=f"{report}/{REPORT_PAGES[task]}" if report else "",
        document=container["document"],
    )


def _results(results: Sequence[Mapping[str, Any]]) -> Table:
    return Table.of(
        "Results",
        results,
        {
            "kind": lambda row: row["kind"],
            "name": lambda row: row["name"],
            "text": lambda row: row.get("text") or "",
            "flags": lambda row: (row.get("flags") or "").replace(";", ", "),
            "unit": lambda row: row.get("unit") or "",
            "value": lambda row: number(row["value"]),
            **INTERVAL,
        },
        texts=5,
    )


def _channels(channels: Sequence[Mapping[str, Any]]) -> Table:
    keys = ("mean", "std", "min", "max")
    rows = [
        [row["channel_name"], row["unit"], str(row["sample_count"])]
        + [number(row[key]) for key in keys]
        for row in channels
    ]
    return Table("Channels", ("channel", "unit", "turns", *keys), rows, texts=2)
