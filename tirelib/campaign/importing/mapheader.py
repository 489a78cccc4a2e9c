"""The part of an import map that becomes ``campaign.toml``, and the names of gage channels."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import tomli_w

from tirelib.campaign import header as header_file
from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.model import CampaignHeader

GAGE_TIME = "gage_time"
"""Quantity of a map: the clock of the gages, where they have one of their own."""

_STRAIN = re.compile(r"strain_([1-9]\d*)")
_COPIED = ("tire", "gages", "tolerance", "rig")


class _Rule(Protocol):
    @property
    def unit(self) -> str: ...


def strain_number(quantity: str) -> int | None:
    """Return the number of a gage's channel, None for any other quantity."""
    match = _STRAIN.fullmatch(quantity)
    return int(match[1]) if match else None


def is_gage(quantity: str) -> bool:
    """Return whether a quantity is recorded at the rate of the gages."""
    return quantity == "trigger" or strain_number(quantity) is not None


def header_of(
    file: str, document: Mapping[str, Any], channels: Mapping[str, _Rule], name: str
) -> tuple[CampaignHeader | None, list[CampaignFault]]:
    """Read name, axes, tire, gages, tolerance and rig of a map as ``campaign.toml`` has them.

    A tire without a name gets that of the campaign, gages without a unit that of strain_1; a rate
    that is missing is NaN and comes from the time column later.

    Returns
    -------
    header : CampaignHeader or None
    problems : list of CampaignFault
    """
    given = {key: document[key] for key in ("name", "axes", *_COPIED) if key in document}
    given = {"format": header_file.FORMAT, "name": name, **given}
    if isinstance(given.get("tire"), dict):
        given["tire"] = {"name": given["name"], **given["tire"]}
    open_rate = False
    if isinstance(given.get("gages"), dict):
        unit = getattr(channels.get("strain_1"), "unit", "") or "ustrain"
        open_rate = "rate_hz" not in given["gages"]
        given["gages"] = {"unit": unit, "rate_hz": 1e4, **given["gages"]}
    with TemporaryDirectory() as folder:
        text = tomli_w.dumps(given)
        (Path(folder) / header_file.FILE).write_text(text, encoding="utf-8")
        header, problems = header_file.parse_header(Path(folder))
    problems = [
        replace(problem, where=problem.where.replace(header_file.FILE, file, 1))
        for problem in problems
    ]
    problems += _gage_problems(file, document, channels, header)
    if header is not None and open_rate:
        header = replace(header, rate=math.nan)
    return header, problems


def _gage_problems(
    file: str,
    document: Mapping[str, Any],
    channels: Mapping[str, _Rule],
    header: CampaignHeader | None,
) -> list[CampaignFault]:
    """Compare the strain channels with the positions of the gages."""
    numbers = sorted(n for quantity in channels if (n := strain_number(quantity)) is not None)
    mapped = ", ".join(f"strain_{number}" for number in numbers)
    if "gages" not in document:
        alone = [quantity for quantity in ("trigger", GAGE_TIME) if quantity in channels]
        if not numbers and not alone:
            return []
        given = f"{mapped or alone[0]} is mapped, but the table is missing"
        allowed = "strain_1, ... and lateral_m with a position for each belong together"
        return [
            CampaignFault(f"{file}, [gages]", given, allowed, "add lateral_m, or drop the channel")
        ]
    count = len(header.gage_lateral) if header is not None else None
    if count is None or numbers == list(range(1, count + 1)):
        return []
    return [
        CampaignFault(
            f"{file}, [channels]",
            f"{len(numbers)} strain channels are mapped ({mapped or 'none'})",
            f"[gages] lateral_m declares {count}, strain_1 to strain_{count}",
            "map each of them, or correct lateral_m",
        )
    ]
