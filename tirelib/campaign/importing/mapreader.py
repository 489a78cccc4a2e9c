"""Typed values out of an import map; every fault is kept."""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.importing.columns import did_you_mean
from tirelib.campaign.importing.delimited import CsvOptions
from tirelib.core.errors import FormatError

FORMAT = "tirelib-map/1"


class MapReader:
    """Takes a map apart and keeps every fault."""

    def __init__(self, file: str, document: Mapping[str, Any]) -> None:
        self.file = file
        self.document = document
        self.problems: list[CampaignFault] = []

    def fault(self, key: str, given: str, allowed: str, remedy: str) -> None:
        """Note a fault at a key."""
        self.problems.append(CampaignFault(f"{self.file}, {key}", given, allowed, remedy))

    def table(self, key: str) -> Mapping[str, Any]:
        """Return a table of the document, empty when it is missing or none."""
        value = self.document.get(key, {})
        if isinstance(value, dict):
            return value
        self.fault(f"[{key}]", f"{value!r} is not a table", "a table is needed", f"write [{key}]")
        return {}

    def known(self, where: str, keys: Mapping[str, Any], allowed: tuple[str, ...]) -> None:
        """Note every unknown key."""
        for key in keys:
            if key not in allowed:
                place = f"{where} {key}".strip()
                self.fault(
                    place,
                    "the key is unknown",
                    f"{', '.join(allowed)} are allowed",
                    did_you_mean(key, allowed),
                )

    def text(self, where: str, values: Mapping[str, Any], key: str) -> str:
        """Return a text, empty when it is missing."""
        value = values.get(key, "")
        if isinstance(value, str):
            return value
        self.fault(
            f"{where} {key}".strip(),
            f"{value!r} is given",
            "a text is needed",
            "write it in quotes",
        )
        return ""

    def number(self, where: str, values: Mapping[str, Any], key: str, default: float) -> float:
        """Return a finite number."""
        value = values.get(key, default)
        if (
            isinstance(value, int | float)
            and not isinstance(value, bool)
            and (math.isfinite(value) or key not in values)
        ):
            return float(value)
        self.fault(
            f"{where} {key}".strip(),
            f"{value!r} is given",
            "a finite number is needed",
            "write it without quotes",
        )
        return default


def read_document(file: str, path: Path) -> dict[str, Any]:
    """Return a map as TOML has it.

    Raises
    ------
    FormatError
        If it cannot be read or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        given, remedy = f"the map cannot be read ({error.strerror})", "check the path"
    except UnicodeDecodeError as error:
        given, remedy = f"byte {error.start} is not UTF-8", "save it as UTF-8"
    except tomllib.TOMLDecodeError as error:
        given, remedy = f"not TOML: {error}", "correct it there"
    raise FormatError(f"{file}: {given}; a TOML file with format = {FORMAT!r} is needed; {remedy}")


def read_csv_options(reader: MapReader) -> CsvOptions:
    """Return the table ``[csv]``, empty when it has a fault."""
    before = len(reader.problems)
    given = reader.table("csv")
    reader.known("[csv]", given, ("separator", "decimal", "names_line", "units_line"))
    separator = reader.text("[csv]", given, "separator") or None
    decimal = reader.text("[csv]", given, "decimal") or None
    if separator is not None and (len(separator) != 1 or separator in ".\"'\r\n"):
        reader.fault(
            "[csv] separator",
            f"{separator!r} is given",
            "one character, such as ';'",
            "write it as the file has it",
        )
    if decimal not in (None, ".", ",") or (decimal is not None and decimal == separator):
        reader.fault(
            "[csv] decimal",
            f"{decimal!r} is given",
            "'.' and ',' are allowed, other than the separator",
            "correct it",
        )
    lines = []
    for key in ("names_line", "units_line"):
        value = given.get(key)
        if value is not None and (
            not isinstance(value, int) or isinstance(value, bool) or value < 1
        ):
            reader.fault(
                f"[csv] {key}",
                f"{value!r} is given",
                "a line number from 1 on",
                "count the lines of the file",
            )
            value = None
        lines.append(value)
    if lines[1] is not None and lines[0] is None:
        reader.fault(
            "[csv] units_line",
            "it is given without names_line",
            "both are needed",
            "add names_line",
        )
    if len(reader.problems) > before:
        return CsvOptions()
    return CsvOptions(separator, decimal, lines[0], lines[1])
