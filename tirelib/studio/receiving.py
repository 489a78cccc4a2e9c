"""What is dropped on the page: a campaign, files of another format, an effect of the user's own."""

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import tomli_w

from tirelib.campaign.check_gages import PLAUSIBLE_STRAIN
from tirelib.campaign.check_rig import LOADED, PLAUSIBLE
from tirelib.campaign.importing.mapreader import FORMAT as MAP_FORMAT
from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.units import QUANTITIES, dimension_of, from_si, units_of
from tirelib.studio import intake
from tirelib.studio.disk import read_document, safe_name, write_atomic
from tirelib.studio.jobs import Job, Jobs
from tirelib.studio.session import Session


class Receiving:
    """Takes in what is dropped or chosen; nothing of it is run before the user has allowed it.

    Parameters
    ----------
    session : Session
    jobs : Jobs
    roots : sequence of Path
        Folders from which files may be chosen.
    open_campaign : callable
        (folder) -> address of the campaign on the page.
    """

    def __init__(
        self,
        session: Session,
        jobs: Jobs,
        roots: Sequence[Path],
        open_campaign: Callable[[Path], str],
    ) -> None:
        self.session, self.jobs = session, jobs
        self._roots, self._open = roots, open_campaign

    def files(self, number: str) -> Path:
        """Return a folder of dropped files.

        Raises
        ------
        FormatError
            If there is none of this number.
        """
        place = self.session.folder / "files" / str(number)
        if not str(number).isdecimal() or not place.is_dir():
            raise FormatError(f"files {number!r}: nothing was dropped under this number")
        return place

    def unpack(self, number: str) -> None:
        """Unpack the archives among dropped files; it takes a while, and touches no job."""
        for archive in self.files(number).rglob("*.zip"):
            if not archive.with_suffix("").exists():
                intake.unpack(archive, archive.with_suffix(""))

    def dropped(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Tell what was dropped: a campaign, a user's effect, or files of another format."""
        place = self.files(wish.get("files", ""))
        campaign = intake.campaign_in(place)
        if campaign is not None:
            return {"campaign": self._open(campaign)}
        if plans := sorted(place.rglob("runs.csv")):
            raise FormatError(
                f"{plans[0].relative_to(place)}: a campaign without its campaign.toml; send the "
                "folder that holds both"
            )
        effects = sorted(place.rglob("*.py"))
        if effects:
            return {"effect": self._received(effects[0])}
        return self._foreign(place.name, intake.foreign_in(place))

    def columns(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Begin the import of a file on disk."""
        file = intake.inside(str(wish.get("path", "")), self._roots)
        place = self.session.new_files()
        return self._foreign(place.name, [file])

    def read_again(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Read dropped files again, as the form states their layout."""
        number, stated = str(wish.get("files", "")), wish.get("map")
        place, listed = self.files(number), self._last(number).get("columns")
        if not isinstance(stated, dict) or listed is None:
            raise ParameterError("import: a layout and files are needed; drop the files again")
        self._list(number, listed.order["files"], self._written(place / "layout.toml", stated))
        return {"files": number}

    def _foreign(self, number: str, files: Sequence[Path]) -> Mapping[str, Any]:
        if not files:
            raise FormatError(
                "nothing that can be opened was dropped; a campaign folder (or its zip archive), "
                f"measured files ({', '.join(intake.FOREIGN)}) or an effect file (.py) is needed"
            )
        self._list(number, [str(path) for path in files])
        return {"files": number}

    def _list(self, number: str, files: Sequence[str], layout: str = "") -> None:
        """Begin to list the columns, and to draft a map."""
        order = {"files": list(files), "place": number, "map": layout}
        for kind in ("columns", "suggest"):
            self.jobs.add(kind, order, {"files": number})

    def _last(self, number: str) -> dict[str, Job]:
        """Return the last job of each kind on dropped files."""
        every = self.jobs.all.values()
        return {job.kind: job for job in every if job.subject.get("files") == number}

    def _read(self, number: str) -> list[str] | None:
        """Return the paths of dropped files, without those that cannot be read."""
        listed = self._last(number).get("columns")
        if listed is None:
            return None
        told = read_document(self.jobs.out(listed) / "columns.json") or {}
        unreadable = {each["file"] for each in told.get("unreadable", ())}
        return [path for path in listed.order["files"] if path not in unreadable]

    def import_form(self, number: str) -> dict[str, Any]:
        """Return what is known of dropped files: columns, a draft of the map, faults."""
        self.files(number)
        found: dict[str, Any] = {"files": number, "map": None, "columns": None, "message": ""}
        found["plausible"] = _plausible()
        kinds = {**QUANTITIES, "strain": "strain", "temperature": "temperature"}
        found["units"] = {name: units_of(kind) for name, kind in kinds.items()}
        last = self._last(number)
        for kind in ("columns", "suggest"):
            job = last.get(kind)
            if job is not None and job.state == "failed":
                found["message"] = found["message"] or job.message
                found["count"] = len(job.order["files"])
            if job is None or job.state != "done":
                continue
            if kind == "columns":
                found["columns"] = read_document(self.jobs.out(job) / "columns.json")
                found["names"] = [Path(path).name for path in self._read(number) or ()]
            else:
                text = (self.jobs.place(job) / "stdout.txt").read_text(encoding="utf-8")
                try:
                    found["map"] = tomllib.loads(text)
                except ValueError:  # a draft that leaves too much open: the form is empty
                    found["map"] = {}
        return found

    def make_campaign(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Begin to make a campaign of dropped files with the map of the form."""
        number = str(wish.get("files", ""))
        place, drawn, files = self.files(number), wish.get("map"), self._read(number)
        if not isinstance(drawn, dict) or files is None:
            raise ParameterError("import: a map and files are needed; drop the files again")
        files = [path for path in files if path not in wish.get("without", ())]
        path = self._written(place / "map.toml", drawn)
        job = self.jobs.add("import", {"files": files, "map": path}, {"files": number})
        return {"job": job.number, "map": path, "text": Path(path).read_text(encoding="utf-8")}

    def _written(self, path: Path, drawn: Mapping[str, Any]) -> str:
        """Write a map as the form has drawn it; return its path."""
        try:
            text = tomli_w.dumps({"format": MAP_FORMAT, **drawn})
        except (TypeError, ValueError) as error:
            raise ParameterError(f"import: the map cannot be written ({error})") from None
        write_atomic(path, text)
        return str(path)

    def _received(self, file: Path) -> dict[str, Any]:
        """Keep a user's effect file; it is not run, and the page shows what is in it."""
        target = self.session.folder / "effects" / f"{safe_name(file.stem)}.py"
        data = file.read_bytes()
        write_atomic(target, data)
        write_atomic(target.with_suffix(".json"), json.dumps({"confirmed": False}))
        text = data.decode("utf-8", "replace")
        return {"name": target.name, "code": text, "sha256": sha256(data).hexdigest()}

    def confirm(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Check an effect file that the user has read and allowed to be run."""
        target = self.session.folder / "effects" / safe_name(str(wish.get("name", "")))
        if target.suffix != ".py" or not target.is_file():
            raise FormatError(f"{target.name}: there is no such effect file; drop it again")
        if sha256(target.read_bytes()).hexdigest() != wish.get("sha256"):
            raise FormatError(f"{target.name}: it is not the file that was shown; drop it again")
        files = [str(p) for p in self.session.effect_files if p != target]
        job = self.jobs.add("effects", {"effect_files": [*files, str(target)]}, {"effect": 1})
        return {"job": job.number}


def _plausible() -> dict[str, dict[str, list[float]]]:
    """Return the ranges of the campaign check by quantity and unit.

    That of a loaded radius is one for a free radius of 1 m, that of a strain is one of its span.
    """
    ranges = PLAUSIBLE | {"loaded_radius": LOADED, "strain": PLAUSIBLE_STRAIN}
    named = {name: (dimension_of(name) or name, ends) for name, ends in ranges.items()}
    return {
        name: {unit: [from_si(end, unit, kind) for end in ends] for unit in units_of(kind)}
        for name, (kind, ends) in named.items()
    }
