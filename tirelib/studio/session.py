"""The session on disk: campaigns, the models of each, and what is known of every model.

    SESSION/
      studio.json                       address and token of the server (only the user may read it)
      campaigns/ID/campaign.json        folder, name, which model is looked at
      campaigns/ID/check.json show.json
      campaigns/ID/models/NNN/          model.json (label, parent, what was done), M.toml, fit.json
      campaigns/ID/models/NNN/QUANTITY/ comparison.json plots.npz diagnosis.json traces.npz ...
      jobs/NNNN/                        job.json, what the command said, its results
      effects/NAME.py NAME.json         effects of the user; run only after they were confirmed
      files/NNN/                        files that were dropped on the page

Nothing is deleted. A model that is no longer wanted is hidden.
"""

import hashlib
import json
import re
import time
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tirelib.core.errors import FormatError
from tirelib.studio.disk import read_document, safe_name, write_atomic

FORMAT = "tirelib-studio/1"
QUANTITIES = ("strain", "Fy", "Fx", "Mz")
DOCUMENTS = ("comparison.json", "diagnosis.json", "next-test.json", "traces.npz", "plots.npz")
_CAMPAIGN = re.compile(r"[a-z0-9][a-z0-9-]{0,60}-[0-9a-f]{8}")
_MODEL = re.compile(r"\d{3,6}")


def _stated_name(folder: Path) -> str:
    """Return how a campaign calls itself, else the name of its folder."""
    try:
        return str(tomllib.loads((folder / "campaign.toml").read_text("utf-8"))["name"])
    except (OSError, ValueError, KeyError):
        return folder.name


@dataclass(frozen=True, slots=True)
class StudioModel:
    """A model of a campaign: a folder, and what `model.json` says of it.

    Attributes
    ----------
    place : Path
    told : mapping
        number, parent (None of the base model), action, effect, quantity, label, pinned, hidden,
        made (seconds since 1970).
    """

    place: Path
    told: Mapping[str, Any]

    @property
    def number(self) -> str:
        """Its number, as its folder is called."""
        return self.place.name

    @property
    def file(self) -> Path:
        """The model file."""
        return self.place / "M.toml"

    @property
    def ready(self) -> bool:
        """Whether it has been fitted."""
        return self.file.is_file()

    def document(self, name: str, quantity: str = "") -> Path:
        """Return the path of a document of it."""
        return self.place / quantity / name if quantity else self.place / name

    def change(self, **values: Any) -> None:
        """Write what has changed of it."""
        told = {**self.told, **values}
        write_atomic(self.place / "model.json", json.dumps(told, indent=1))

    @property
    def quantities(self) -> list[str]:
        """What it can be compared with, best known first: strain, then the worst force."""
        fit = read_document(self.place / "fit.json") or {}
        out = ["strain"] if fit.get("parameters") or fit.get("quantity") == "strain" else []
        forces = fit.get("force_errors") or {}
        told = sorted(forces, key=lambda name: -(forces[name].get("error") or 0.0))
        return out + [name for name in told if name in QUANTITIES]


@dataclass(frozen=True, slots=True)
class Opened:
    """A campaign that was opened: its folder in the session."""

    place: Path

    @property
    def name(self) -> str:
        """The name of its folder, which is its address."""
        return self.place.name

    @property
    def told(self) -> dict[str, Any]:
        """What `campaign.json` says: folder, name, current model, quantity, opened."""
        return read_document(self.place / "campaign.json") or {}

    @property
    def folder(self) -> str:
        """The folder of measurements."""
        return str(self.told.get("folder", ""))

    def change(self, **values: Any) -> None:
        """Write what has changed of it."""
        write_atomic(self.place / "campaign.json", json.dumps({**self.told, **values}, indent=1))

    @property
    def models(self) -> list[StudioModel]:
        """Every model in the order in which they were made."""
        found = []
        for place in sorted((self.place / "models").glob("*")):
            told = read_document(place / "model.json")
            if told is not None:
                found.append(StudioModel(place, told))
        return found

    def model(self, number: str) -> StudioModel:
        """Return a model by number.

        Raises
        ------
        FormatError
            If there is none.
        """
        place = self.place / "models" / number
        told = read_document(place / "model.json") if _MODEL.fullmatch(number) else None
        if told is None:
            raise FormatError(f"model {number!r}: no model has this number; choose another")
        return StudioModel(place, told)

    def new_model(self, parent: str | None, action: str, effect: str, quantity: str) -> StudioModel:
        """Return a new model, which is still to be fitted."""
        number = f"{len(self.models) + 1:03d}"
        place = self.place / "models" / number
        told = {
            "number": number,
            "parent": parent,
            "action": action,
            "effect": effect,
            "quantity": quantity,
            "label": "",
            "pinned": False,
            "hidden": False,
            "made": time.time(),
        }
        model = StudioModel(place, told)
        model.change()
        return model

    def path_to(self, number: str) -> list[StudioModel]:
        """Return the models from the base to one."""
        out: list[StudioModel] = []
        at: str | None = number
        while at is not None and len(out) < 1000:
            out.insert(0, self.model(at))
            at = out[0].told.get("parent")
        return out


class Session:
    """A session folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    FormatError
        If the folder holds something that this version does not know.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        known = read_document(folder / "studio.json")
        if known is not None and known.get("format") != FORMAT:
            raise FormatError(
                f"{folder}: format {known.get('format')!r}; this program reads {FORMAT!r}; give "
                "another folder with --session"
            )

    @property
    def address(self) -> dict[str, Any]:
        """Port and token of the last server; empty at first."""
        return read_document(self.folder / "studio.json") or {}

    def keep_address(self, port: int, token: str) -> None:
        """Keep the address, so that open pages find the server again after a restart."""
        path = self.folder / "studio.json"
        path.touch(mode=0o600)
        path.chmod(0o600)
        new = self.folder / ".studio.json.new"
        new.touch(mode=0o600)
        new.write_text(json.dumps({"format": FORMAT, "port": port, "token": token}))
        new.replace(path)

    def __iter__(self) -> Iterator[Opened]:
        """Yield the campaigns, the one opened last first."""
        found = [Opened(file.parent) for file in self.folder.glob("campaigns/*/campaign.json")]
        return iter(sorted(found, key=lambda one: -float(one.told.get("opened", 0.0))))

    def campaign(self, name: str) -> Opened:
        """Return a campaign by the name of its folder.

        Raises
        ------
        FormatError
            If there is none.
        """
        place = self.folder / "campaigns" / name
        if not _CAMPAIGN.fullmatch(name) or not (place / "campaign.json").is_file():
            raise FormatError(f"campaign {name!r}: it is not open; choose one of the list")
        return Opened(place)

    def open(self, folder: Path, note: str = "") -> Opened:
        """Return a campaign of the session for a folder of measurements.

        Raises
        ------
        FormatError
            If the folder has no campaign.toml.
        """
        folder = folder.expanduser().resolve()
        if not (folder / "campaign.toml").is_file():
            raise FormatError(
                f"{folder}: it holds no campaign.toml, so it is no campaign; choose a folder that "
                "has one, or import the files"
            )
        mark = hashlib.sha256(str(folder).encode()).hexdigest()[:8]
        name = f"{safe_name(folder.name).lower().replace('_', '-').replace('.', '-')}-{mark}"
        opened = Opened(self.folder / "campaigns" / name)
        known = opened.told
        opened.change(
            format=FORMAT,
            folder=str(folder),
            title=known.get("title") or _stated_name(folder),
            note=known.get("note") or note,
            opened=time.time(),
            current=known.get("current"),
            quantity=known.get("quantity"),
        )
        return opened

    def new_files(self) -> Path:
        """Return a new folder for files that are dropped on the page."""
        place = self.folder / "files"
        place.mkdir(parents=True, exist_ok=True)
        number = 1 + max((int(p.name) for p in place.iterdir() if p.name.isdecimal()), default=0)
        made = place / f"{number:03d}"
        made.mkdir()
        return made

    @property
    def effect_files(self) -> list[Path]:
        """The user's effects that were confirmed and passed the check."""
        told = ((p, read_document(p.with_suffix(".json"))) for p in self._effects())
        return [path for path, known in told if known and known.get("confirmed")]

    def _effects(self) -> list[Path]:
        return sorted((self.folder / "effects").glob("*.py"))
