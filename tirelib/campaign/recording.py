"""A continuous recording: hours of driving, one or several wheels, read in blocks.

A recording is a folder with MDF 4 files and a ``recording.toml`` (``tirelib-recording/1``) that
says which channels belong to which wheel. Strain, trigger and every condition may stand in groups
with clocks of their own; no table of all of them is ever made, and a block of each is all that is
in memory.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tirelib.campaign.campaign_fault import CampaignFault, raise_errors
from tirelib.core.axes import FLIPPED, sign
from tirelib.core.errors import FormatError
from tirelib.core.held import HELD

FORMAT = "tirelib-recording/1"
FILE = "recording.toml"
_KEYS = frozenset({"format", "name", "axes", "files", "wheels"})
_WHEEL_KEYS = frozenset({"tire", "lateral_m", "strain", "trigger", "conditions"})


@dataclass(frozen=True, slots=True)
class Held:
    """The channel of a condition, and how long a value is held, [s]; None: three samples."""

    channel: str
    hold: float | None = None


@dataclass(frozen=True, slots=True)
class Wheel:
    """One wheel of a recording.

    Attributes
    ----------
    name, tire : str
    lateral : tuple of float, [m]
        Gage positions, ISO, in the order of the gages' numbers.
    strain : str
        Name of a gage's channel, with ``{}`` in the place of its number from 1.
    trigger : str
        Name of the trigger's channel; empty if there is none.
    conditions : mapping of name to Held
        By the names of `tirelib.core.held.HELD`.
    """

    name: str
    tire: str
    lateral: tuple[float, ...]
    strain: str
    trigger: str = ""
    conditions: Mapping[str, Held] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording: its wheels, and its files in the order of their start.

    Attributes
    ----------
    path : Path
    name, axes : str
        `axes` are those of the files.
    wheels : tuple of Wheel
    files : tuple of Path
    """

    path: Path
    name: str
    axes: str
    wheels: tuple[Wheel, ...]
    files: tuple[Path, ...]


def read_recording(path: str | Path) -> Recording:
    """Read ``recording.toml`` of a folder; the samples are read block by block.

    Raises
    ------
    FormatError
        With every fault of the description.
    """
    folder = Path(path)
    document = _document(folder)
    problems: list[CampaignFault] = []

    def fault(key: str, given: str, allowed: str, remedy: str) -> None:
        problems.append(CampaignFault(f"{folder / FILE}, {key}", given, allowed, remedy))

    if document.get("format") != FORMAT:
        given = repr(document["format"]) if "format" in document else "the key is missing"
        fault("format", given, f"{FORMAT!r} is read", "correct it")
    axes = document.get("axes")
    if axes not in FLIPPED:
        fault("axes", f"{axes!r}", f"{', '.join(FLIPPED)} are allowed", "name the axis system")
        axes = "iso"
    for key in sorted(set(document) - _KEYS):
        fault(key, "the key is unknown", f"known are {', '.join(sorted(_KEYS))}", "correct it")
    wheels = document.get("wheels")
    if not isinstance(wheels, dict) or not wheels:
        fault("[wheels]", "no wheel is described", "one table a wheel is needed", "add it")
        wheels = {}
    described = tuple(_wheel(name, each, str(axes), fault) for name, each in wheels.items())
    patterns = document.get("files", ["*.mf4"])
    files = sorted({file for pattern in patterns for file in folder.glob(str(pattern))})
    if not files:
        fault("files", f"no file is named by {patterns!r}", "MDF 4 files are needed", "correct it")
    raise_errors(problems)
    return Recording(
        folder, str(document.get("name", folder.name)), str(axes), described, tuple(files)
    )


def _document(folder: Path) -> dict[str, Any]:
    try:
        return tomllib.loads((folder / FILE).read_text(encoding="utf-8"))
    except OSError as error:
        raise FormatError(
            f"{folder / FILE}: it cannot be read ({error.strerror}); a recording is a folder with "
            "this file; write it"
        ) from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise FormatError(
            f"{folder / FILE}: not TOML ({error}); valid TOML is needed; correct it there"
        ) from None


def _wheel(name: str, given: Any, axes: str, fault: Any) -> Wheel:
    where = f"[wheels.{name}]"
    table: dict[str, Any] = given if isinstance(given, dict) else {}
    for key in sorted(set(table) - _WHEEL_KEYS):
        fault(
            f"{where} {key}",
            "the key is unknown",
            f"known are {', '.join(sorted(_WHEEL_KEYS))}",
            "correct it",
        )
    tire, strain = table.get("tire"), table.get("strain")
    if not isinstance(tire, str):
        fault(f"{where} tire", f"{tire!r}", "the name of the tire is needed", "add it")
    if not isinstance(strain, str) or strain.count("{}") != 1:
        fault(
            f"{where} strain",
            f"{strain!r}",
            "the name of a gage's channel with {} in the place of its number is needed",
            'write for instance strain = "FL_strain_{}"',
        )
        strain = "{}"
    lateral = table.get("lateral_m")
    numbers = isinstance(lateral, list) and all(isinstance(y, int | float) for y in lateral)
    if not numbers or not lateral:
        fault(f"{where} lateral_m", f"{lateral!r}", "a list of metres is needed", "add it")
        lateral = []
    conditions = {}
    for condition, said in dict(table.get("conditions", {})).items():
        held = {"channel": said} if isinstance(said, str) else dict(said)
        hold = held.get("hold_s")
        known = condition in HELD and isinstance(held.get("channel"), str)
        if not known or set(held) - {"channel", "hold_s"}:
            fault(
                f"{where} conditions.{condition}",
                f"{said!r}",
                f"a channel's name, or {{channel, hold_s}}, for one of {', '.join(HELD)} is needed",
                "correct it",
            )
            continue
        conditions[condition] = Held(held["channel"], None if hold is None else float(hold))
    flip = sign("lateral", axes)
    return Wheel(
        name,
        str(tire),
        tuple(flip * float(y) + 0.0 for y in lateral or []),
        str(strain),
        str(table.get("trigger", "")),
        conditions,
    )
