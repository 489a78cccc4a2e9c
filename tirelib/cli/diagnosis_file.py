"""The document that ``tirelib diagnose --json`` wrote, read again and checked."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tirelib.core.errors import FormatError, ParameterError

if TYPE_CHECKING:
    from tirelib.campaign import Campaign


DIAGNOSIS = "tirelib-diagnosis/1"


def read_diagnosis(path: Path, quantity: str | None) -> dict[str, Any]:
    """Return a diagnosis file.

    Raises
    ------
    FormatError
        If it cannot be read.
    ParameterError
        If it is one of another quantity.
    """
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise FormatError(
            f"{path}: cannot be read as JSON ({error}); give the file that `tirelib diagnose "
            "--json` wrote"
        ) from error
    kind = told.get("format") if isinstance(told, dict) else None
    if kind != DIAGNOSIS:
        raise FormatError(
            f"{path}: format is {kind!r}; {DIAGNOSIS!r} is needed; give the file that `tirelib "
            "diagnose --json` wrote"
        )
    missing = [key for key in ("verdict", "named", "candidates", "quantity") if key not in told]
    if missing:
        raise FormatError(f"{path}: {', '.join(missing)} is missing; diagnose again")
    if quantity is not None and told["quantity"] != quantity:
        raise ParameterError(
            f"{path}: is a diagnosis of {told['quantity']}, and {quantity} is planned; give "
            f"--quantity {told['quantity']}, or the other diagnosis"
        )
    if quantity is None and told["quantity"] == "strain":
        raise ParameterError(f"{path}: is a diagnosis of strain; give --quantity strain")
    return dict(told)


def belongs(told: dict[str, Any], campaign: "Campaign", has: list[str], path: Path | None) -> None:
    """Refuse a diagnosis of another campaign, or of a model with other effects."""
    if told.get("campaign", campaign.header.name) != campaign.header.name:
        raise ParameterError(
            f"{path}: is of the campaign {told['campaign']!r}, and {campaign.header.name!r} is "
            "planned; give that campaign, or its diagnosis"
        )
    if "has" in told and sorted(told["has"]) != sorted(has):
        raise ParameterError(
            f"{path}: is of a model with the effects {', '.join(told['has']) or 'none'}, this one "
            f"has {', '.join(has) or 'none'}; diagnose this model, or give the other"
        )
