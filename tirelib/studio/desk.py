"""What the user asks for, and what follows from a job that has ended."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tirelib.core.errors import ParameterError
from tirelib.studio import intake
from tirelib.studio.commands import FIRST, planted
from tirelib.studio.disk import move_into, read_document, write_document
from tirelib.studio.jobs import Job, Jobs
from tirelib.studio.receiving import Receiving
from tirelib.studio.session import QUANTITIES, Opened, Session, StudioModel

EXAMPLE = {"plan": "short", "seed": 1, "hide": ["sidewall_damping=0.05"]}
"""The example: 15 runs of a virtual tire whose sidewall damps more."""
OF_CAMPAIGN = ("check", "show")
OF_MODEL = ("identify", "add", "remove")
OF_QUANTITY = ("compare", "diagnose", "traces", "plant", "next-test")
GOES_ON = (*OF_CAMPAIGN, "identify", "compare", "diagnose", "traces")
"""What follows by itself from opening a campaign or from a fit: after a restart it goes on."""
TAKEN = ("report", "calibrate", "fmu")
LONGEST_LABEL = 80


class Desk:
    """Turns wishes into jobs, and results into documents of the session.

    Parameters
    ----------
    session : Session
    jobs : Jobs
    roots : sequence of Path
        Folders that the page may look into.
    """

    def __init__(self, session: Session, jobs: Jobs, roots: Sequence[Path]) -> None:
        self.session, self.jobs = session, jobs
        self._early: list[Job] = []
        self.roots = [root.expanduser().resolve() for root in roots]
        known = [*self.roots, session.folder.resolve()]
        self.receiving = Receiving(
            session, jobs, known, lambda folder: self._begin(session.open(folder)).name
        )
        self.actions: Mapping[str, Callable[[Mapping[str, Any]], Mapping[str, Any] | None]] = {
            "open": self._open,
            "example": self._example,
            "dropped": self.receiving.dropped,
            "columns": self.receiving.columns,
            "read-again": self.receiving.read_again,
            "import": self.receiving.make_campaign,
            "fit": self._fit_again,
            "look": self._look,
            "add": self._add,
            "remove": self._remove,
            "cancel": self._cancel,
            "again": self._again,
            "mark": self._mark,
            "plant": self._plant,
            "next-test": self._next_test,
            "take": self._take,
            "confirm-effect": self.receiving.confirm,
        }
        if not (session.folder / "effects.json").exists():
            jobs.add("catalogue", {}, {})
        last = {(job.kind, str(job.subject)): job for job in jobs.all.values()}
        for job in last.values():
            if job.state == "interrupted" and job.kind in GOES_ON:
                jobs.add(job.kind, job.order, job.subject)
        for opened in session:  # what a server that was killed had not recorded yet
            self._looked_at(opened)

    def do(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Do what the page asks for.

        Raises
        ------
        TirelibError
            If it cannot be done, with the reason.
        """
        name = wish.get("do")
        if not isinstance(name, str) or name not in self.actions:
            raise ParameterError(f"{name!r} is no action; allowed are {', '.join(self.actions)}")
        return self.actions[name](wish) or {}

    def start(self, folder: Path, model_file: Path | None) -> str:
        """Open a campaign that the command line names; return its address on the page."""
        opened = self.session.open(folder)
        if model_file is not None:
            from tirelib.core.parameters import read_tire

            read_tire(str(model_file))  # a file that is no model is refused here
            model = opened.new_model(None, "identify", "", "")
            model.change(label=model_file.name)
            shutil.copyfile(model_file, model.file)
            opened.change(current=model.number, quantity=None)
        return self._begin(opened).name

    def _quantity(self, opened: Opened, model: StudioModel) -> str:
        """Return what a model is looked at with: the last choice, else what it was fitted to."""
        shown = read_document(opened.place / "show.json") or {}
        gages = (shown.get("header") or {"gage_lateral_mm": [0.0]}).get("gage_lateral_mm")
        told = opened.told.get("quantity") or next(iter(model.quantities), None)
        return str(told or ("strain" if gages else "Fy"))

    def ended(self, job: Job) -> None:
        """Put results in their place, and begin what comes next."""
        if job.state != "done":
            return
        if job.kind == "identify" and self._unchecked(job):
            self._early.append(job)
            return
        out, subject = self.jobs.out(job), job.subject
        if job.kind in ("rig", "import"):
            opened = self.session.open(out / "campaign", "example" if job.kind == "rig" else "")
            self._begin(opened)
        elif job.kind in ("catalogue", "effects"):
            move_into(self.session.folder, out)
            for path in job.order.get("effect_files", ())[-1:]:
                told = read_document(Path(path).with_suffix(".json")) or {}
                write_document(Path(path).with_suffix(".json"), told | {"confirmed": True})
                self._diagnose_anew()
        elif job.kind in OF_CAMPAIGN:
            opened = self.session.campaign(subject["campaign"])
            move_into(opened.place, out)
            if job.kind == "check":
                self._checked(opened)
            else:
                shown = read_document(opened.place / "show.json") or {}
                fitted = opened.told.get("fitted_to") or shown.get("content_hash")
                opened.change(
                    title=(shown.get("header") or {}).get("name") or opened.told.get("title"),
                    fitted_to=fitted,
                    stale=fitted != shown.get("content_hash"),
                )
        elif job.kind in OF_MODEL:
            opened = self.session.campaign(subject["campaign"])
            model = opened.model(subject["model"])
            move_into(model.place, out)
            quantity = subject.get("quantity") or self._quantity(opened, model)
            opened.change(current=model.number, quantity=quantity)
            if then := job.order.get("then"):
                self._add_next(then, opened, model, quantity)
            else:
                self._computed(opened, model, quantity)
        elif job.kind in OF_QUANTITY:
            opened = self.session.campaign(subject["campaign"])
            model = opened.model(subject["model"])
            if job.kind == "diagnose":
                model.document("traces.npz", subject["quantity"]).unlink(missing_ok=True)
            move_into(model.place / subject["quantity"], out)
            self._computed(opened, model, subject["quantity"])
        elif job.kind in TAKEN:
            opened = self.session.campaign(subject["campaign"])
            place = opened.model(subject["model"]).place / "taken"
            move_into(place, out)
            if job.kind == "calibrate":
                self.jobs.add("fmu", {"calibration": str(place / "CAL.toml")}, subject)

    def released(self) -> list[Job]:
        """Return the base fits that ended before the check of their campaign, which is over now."""
        ready = [job for job in self._early if not self._unchecked(job)]
        self._early = [job for job in self._early if job not in ready]
        return ready

    def first_fits(self) -> bool:
        """Compare each ring that has just been fitted; return whether there is one."""
        found = False
        for job in list(self.jobs.all.values()):
            first = self.jobs.out(job) / FIRST
            if job.state != "running" or not first.exists() or self._unchecked(job):
                continue
            opened = self.session.campaign(job.subject["campaign"])
            model = opened.model(job.subject["model"])
            known = first.replace(model.place / FIRST)
            if (quantity := self._quantity(opened, model)) == "strain":
                opened.change(current=model.number, quantity=quantity)
                about = self._about(opened, model, quantity) | {"model": str(known)}
                self.jobs.add("compare", about, {**job.subject, "quantity": quantity})
                found = True
        return found

    def _begin(self, opened: Opened) -> Opened:
        """Check a campaign that was opened, read its runs, and fit a first base model meanwhile."""
        subject = {"campaign": opened.name}
        if not any(model.ready for model in opened.models):
            self._identify(opened)
        for kind in OF_CAMPAIGN:
            if not self._under_way(kind, subject):
                self.jobs.add(kind, {"campaign": opened.folder}, subject)
        return opened

    def _under_way(self, kind: str, subject: Mapping[str, Any]) -> list[Job]:
        every = self.jobs.all.values()
        return [j for j in every if j.kind == kind and j.subject == dict(subject) and not j.over]

    def _unchecked(self, fit: Job) -> bool:
        return bool(self._under_way("check", {"campaign": fit.subject["campaign"]}))

    def _fits(self, opened: Opened) -> list[Job]:
        """Return the base fits of a campaign that go on, or whose results wait for the check."""
        jobs = self.jobs.all.values()
        fits = [j for j in jobs if j.kind == "identify" and j.subject["campaign"] == opened.name]
        return [job for job in fits if not job.over or job in self._early]

    def _checked(self, opened: Opened) -> None:
        """End the base fit of a campaign with errors; of any other, compute what is not known."""
        told = read_document(opened.place / "check.json") or {}
        if told.get("errors"):
            for job in (fits := self._fits(opened)):
                self.jobs.cancel(job)
            self._early = [job for job in self._early if job not in fits]
            return
        self._looked_at(opened)

    def _looked_at(self, opened: Opened) -> None:
        """Compute what is not known of the model that is looked at."""
        for model in opened.models:
            if model.number == opened.told.get("current"):
                self._computed(opened, model, self._quantity(opened, model))

    def _identify(self, opened: Opened) -> None:
        if self._fits(opened):
            return
        left = [m for m in opened.models if not m.ready and m.told["action"] == "identify"]
        model = left[0] if left else opened.new_model(None, "identify", "", "")
        subject = {"campaign": opened.name, "model": model.number}
        self.jobs.add("identify", {"campaign": opened.folder, "first": True}, subject)

    def _fit_again(self, wish: Mapping[str, Any]) -> None:
        """Fit another base model: to measurements that have changed since."""
        opened = self.session.campaign(str(wish.get("campaign", "")))
        shown = read_document(opened.place / "show.json") or {}
        opened.change(fitted_to=shown.get("content_hash"), stale=False)
        self._identify(opened)

    def _diagnose_anew(self) -> None:
        """Diagnose the model that is looked at again: there is another suspect."""
        for opened in list(self.session)[:1]:
            number = opened.told.get("current")
            model = opened.model(number) if number else None
            if model is not None and model.ready:
                quantity = self._quantity(opened, model)
                about = self._about(opened, model, quantity)
                subject = {"campaign": opened.name, "model": number, "quantity": quantity}
                self.jobs.add("diagnose", about, subject)

    def _computed(self, opened: Opened, model: StudioModel, quantity: str) -> None:
        """Compute what is not known yet of a model: comparison, diagnosis, traces."""
        if not model.ready:
            return
        about = self._about(opened, model, quantity)
        subject = {"campaign": opened.name, "model": model.number, "quantity": quantity}
        if not model.document("plots.npz", quantity).exists():
            self._once("compare", about, subject)
            return
        if not model.document("diagnosis.json", quantity).exists():
            self._once("diagnose", about, subject)
            return
        told = read_document(model.document("diagnosis.json", quantity)) or {}
        wanted = [planted(e["effect"], e["strength"]) for e in told.get("candidates", [])]
        if wanted and not model.document("traces.npz", quantity).exists():
            self._once("traces", about | {"traces": wanted}, subject)

    def _about(self, opened: Opened, model: StudioModel, quantity: str) -> dict[str, Any]:
        return {
            "campaign": opened.folder,
            "model": str(model.file),
            "quantity": quantity,
            "effect_files": [str(path) for path in self.session.effect_files],
        }

    def _once(self, kind: str, order: Mapping[str, Any], subject: Mapping[str, Any]) -> Job | None:
        """Add a job unless the same one waits, runs, or was ended by the user or an error."""
        if under_way := self._under_way(kind, subject):
            return under_way[0]
        same = [j for j in self.jobs.all.values() if (j.kind, j.subject) == (kind, dict(subject))]
        if any(job.state in ("failed", "cancelled") for job in same):
            return None
        return self.jobs.add(kind, order, subject)

    def _open(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Open a folder, or look again at one that the session knows."""
        if "campaign" in wish:
            return {"campaign": self._begin(self.session.campaign(str(wish["campaign"]))).name}
        folder = intake.inside(
            str(wish.get("path", "")), [*self.roots, self.session.folder.resolve()]
        )
        return {"campaign": self._begin(self.session.open(folder)).name}

    def _example(self, _: Mapping[str, Any]) -> Mapping[str, Any]:
        for opened in self.session:
            if opened.told.get("note") == "example":
                self.session.open(Path(opened.folder), "example")
                return {"campaign": opened.name}
        under_way = self._under_way("rig", {})
        return {"job": (under_way or [self.jobs.add("rig", EXAMPLE, {})])[0].number}

    def _model(self, wish: Mapping[str, Any]) -> tuple[Opened, StudioModel, str]:
        opened = self.session.campaign(str(wish.get("campaign", "")))
        model = opened.model(str(wish.get("model", "")))
        quantity = str(wish.get("quantity") or opened.told.get("quantity") or "strain")
        if quantity not in QUANTITIES:
            raise ParameterError(f"{quantity!r}: allowed are {', '.join(QUANTITIES)}")
        return opened, model, quantity

    def _look(self, wish: Mapping[str, Any]) -> None:
        opened, model, quantity = self._model(wish)
        opened.change(current=model.number, quantity=quantity)
        self._computed(opened, model, quantity)

    def _add(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        """Add effects one after the other, each to the model that the one before has made."""
        opened, model, quantity = self._model(wish)
        known = {entry["effect"] for entry in self.catalogue()}
        names = [str(name) for name in wish.get("effects", ())]
        unknown = [name for name in names if name not in known]
        if not names or unknown:
            raise ParameterError(f"add: {unknown or 'nothing'} is not in the catalogue; tick one")
        return {"models": [self._add_next(names, opened, model, quantity)]}

    def _add_next(
        self, names: Sequence[str], opened: Opened, model: StudioModel, quantity: str
    ) -> str:
        """Add the first of some effects; the others follow when its model is there."""
        new = opened.new_model(model.number, "add", names[0], quantity)
        then = {"then": list(names[1:])} if names[1:] else {}
        self._changed("add", opened, model, new, names[0], quantity, **then)
        return new.number

    def _remove(self, wish: Mapping[str, Any]) -> Mapping[str, Any]:
        opened, model, quantity = self._model(wish)
        name = str(wish.get("effect", ""))
        new = opened.new_model(model.number, "remove", name, quantity)
        self._changed("remove", opened, model, new, name, quantity)
        return {"models": [new.number]}

    def _changed(
        self,
        kind: str,
        opened: Opened,
        model: StudioModel,
        new: StudioModel,
        effect: str,
        quantity: str,
        **more: Any,
    ) -> None:
        order = self._about(opened, model, quantity) | {"effect": effect, **more}
        subject = {"campaign": opened.name, "model": new.number, "quantity": quantity}
        self.jobs.add(kind, order, subject)

    def _job(self, wish: Mapping[str, Any]) -> Job:
        job = self.jobs.all.get(wish.get("job", 0))
        if job is None:
            raise ParameterError(f"job {wish.get('job')!r}: no job has this number")
        return job

    def _cancel(self, wish: Mapping[str, Any]) -> None:
        self.jobs.cancel(self._job(wish))

    def _again(self, wish: Mapping[str, Any]) -> None:
        job = self._job(wish)
        if job.over and job.state != "done":
            self.jobs.add(job.kind, job.order, job.subject)

    def _mark(self, wish: Mapping[str, Any]) -> None:
        """Label, pin or hide a model; nothing is deleted."""
        _, model, _ = self._model(wish)
        values: dict[str, Any] = {}
        if "label" in wish:
            values["label"] = str(wish["label"])[:LONGEST_LABEL]
        for name in ("pinned", "hidden"):
            if name in wish:
                values[name] = bool(wish[name])
        model.change(**values)

    def _plant(self, wish: Mapping[str, Any]) -> None:
        opened, model, quantity = self._model(wish)
        numbers = [float(x) for x in wish.get("strength", ())]
        about = self._about(opened, model, quantity)
        traces = [planted(str(wish.get("effect", "")), numbers)]
        subject = {"campaign": opened.name, "model": model.number, "quantity": quantity}
        self.jobs.add("plant", about | {"traces": traces}, subject)

    def _next_test(self, wish: Mapping[str, Any]) -> None:
        opened, model, quantity = self._model(wish)
        subject = {"campaign": opened.name, "model": model.number, "quantity": quantity}
        known = {"diagnosis": str(model.document("diagnosis.json", quantity))}
        self.jobs.add("next-test", self._about(opened, model, quantity) | known, subject)

    def _take(self, wish: Mapping[str, Any]) -> None:
        opened, model, quantity = self._model(wish)
        subject = {"campaign": opened.name, "model": model.number, "quantity": quantity}
        if wish.get("what") == "report":
            self.jobs.add("report", self._about(opened, model, quantity), subject)
        elif wish.get("what") == "fmu":
            self.jobs.add("calibrate", {"campaign": opened.folder}, subject)
        else:
            raise ParameterError(f"take {wish.get('what')!r}: allowed are report, fmu")

    def catalogue(self) -> list[dict[str, Any]]:
        """Return the effects as the last `tirelib effects` has listed them."""
        told = read_document(self.session.folder / "effects.json") or {}
        return list(told.get("effects", []))
