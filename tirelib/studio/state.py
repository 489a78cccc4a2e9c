"""What the page knows of a session: lists for all views, without the documents themselves."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tirelib.studio.commands import KINDS, told
from tirelib.studio.desk import Desk
from tirelib.studio.disk import read_document, safe_name
from tirelib.studio.jobs import Job
from tirelib.studio.parts import part_of
from tirelib.studio.session import DOCUMENTS, QUANTITIES, Opened, StudioModel

SHOWN_JOBS = 40


def home(desk: Desk) -> dict[str, Any]:
    """Return the campaigns of the session, the user's effects, and the jobs of no campaign."""
    return {
        "campaigns": [
            {
                "campaign": opened.name,
                "title": opened.told.get("title"),
                "folder": opened.folder,
                "there": Path(opened.folder).is_dir(),
                "opened": opened.told.get("opened"),
                "busy": _busy(desk, opened),
                "models": sum(model.ready for model in opened.models),
            }
            for opened in desk.session
        ],
        "effects": [
            {**entry, "part": part_of(entry["effect"], entry["stage"])}
            for entry in desk.catalogue()
        ],
        "own_effects": [path.name for path in desk.session.effect_files],
        "jobs": [_job(desk, job) for job in _last(desk) if "campaign" not in job.subject],
    }


def _busy(desk: Desk, opened: Opened) -> str:
    """Return what is being done for a campaign."""
    mine = (j for j in desk.jobs.all.values() if j.subject.get("campaign") == opened.name)
    return ", ".join(KINDS[job.kind].title for job in mine if not job.over)


def campaign(desk: Desk, opened: Opened) -> dict[str, Any]:
    """Return a campaign: findings, models, jobs."""
    told_of = opened.told
    models = opened.models
    steps: dict[str | None, int] = {None: 0}
    for model in models:  # each after its parent
        steps[model.number] = 1 + steps[model.told["parent"]]
    quantities = next((m.quantities for m in models if m.told["parent"] is None and m.ready), [])
    quantity = told_of.get("quantity") or next(iter(quantities), "strain")
    return {
        "campaign": opened.name,
        "title": told_of.get("title"),
        "folder": opened.folder,
        "current": told_of.get("current"),
        "quantity": quantity,
        "quantities": quantities,
        "check": read_document(opened.place / "check.json"),
        "stale": bool(told_of.get("stale")),
        "shown": _stamp(opened.place / "show.json"),
        "measured": _stamp(opened.place / "measured.npz"),
        "models": [_model(m, quantity) | _files(m, steps[m.number]) for m in models],
        "jobs": [
            _job(desk, job) for job in _last(desk) if job.subject.get("campaign") == opened.name
        ],
    }


def commands(desk: Desk, opened: Opened, number: str) -> list[str]:
    """Return the command lines that repeat the way to a model, with plain file names."""
    folder, lines = opened.folder, []
    for job in desk.jobs.all.values():
        if job.kind == "import" and str(desk.jobs.out(job) / "campaign") == folder:
            folder = safe_name(str(opened.told.get("title")))
            read = ["import", *job.order["files"], "--map", job.order["map"], "--out", folder]
            lines.append(told(read))
    lines.append(told(["campaign", "check", folder]))
    names: dict[str, str] = {}
    for step, model in enumerate(opened.path_to(number), start=1):
        names[model.number] = name = _file_name(step)
        action = str(model.told["action"])
        order: dict[str, Any] = {"campaign": folder, "effect": model.told["effect"]}
        order["effect_files"] = [str(path) for path in desk.session.effect_files]
        order["quantity"] = model.told["quantity"]
        if model.told["parent"] is not None:
            order["model"] = names[model.told["parent"]]
        words = KINDS[action].argv(order, ".")
        words[words.index("--out") + 1] = name
        words[words.index("--json") + 1] = f"{Path(name).stem}.json"
        lines.append(told(words))
    quantity = str(opened.told.get("quantity") or "strain")
    last = {"campaign": folder, "model": names[number], "quantity": quantity}
    for kind, out in (("compare", "C.json"), ("diagnose", "D.json")):
        words = KINDS[kind].argv(last, ".")
        words = words[: words.index("--json")]
        lines.append(told([*words, "--json", out]))
    return lines


def _file_name(step: int) -> str:
    """Return how the model of a step of the way is called where the way is repeated by hand."""
    return "M.toml" if step == 1 else f"M{step}.toml"


def _files(model: StudioModel, step: int) -> dict[str, str]:
    """Return a model's file in the session, and its and the next one's names by hand."""
    own, following = _file_name(step), _file_name(step + 1)
    return {"file": str(model.file), "saved_as": own, "next_as": following}


def _last(desk: Desk) -> list[Job]:
    """Return the last jobs; of those that do the same, the one that came last."""
    found = {(job.kind, str(job.subject)): job for job in desk.jobs.all.values()}
    return sorted(found.values(), key=lambda job: job.number)[-SHOWN_JOBS:]


def _job(desk: Desk, job: Job) -> dict[str, Any]:
    return {
        "job": job.number,
        "kind": job.kind,
        "title": KINDS[job.kind].title,
        "effect": job.order.get("effect"),
        "then": job.order.get("then", []),
        "subject": job.subject,
        "state": job.state,
        "begun": job.begun,
        "ended": job.ended,
        "message": job.message,
        "command": told(job.argv),
    }


def progress(desk: Desk) -> list[dict[str, Any]]:
    """Return how far each running job is."""
    return [
        {
            "job": job.number,
            "what": p.what,
            "done": p.done,
            "total": p.total,
            "label": p.label,
            "costs": p.costs,
        }
        for job in desk.jobs.all.values()
        if job.state == "running" and (p := desk.jobs.progress.get(job.number)) is not None
    ]


def advice(fit: Mapping[str, Any]) -> list[str]:
    """Return what a fit says of itself, and what would help with each number left open."""
    brush = fit.get("brush") or {}
    said = [*(fit.get("messages") or ()), *(brush.get("notes") or ()), *fit.get("reasons", ())]
    helps: dict[str, list[str]] = {}
    for one in [*(fit.get("parameters") or ()), *(brush.get("parameters") or ())]:
        if "not_identifiable" in (one.get("flags") or ()) and one.get("helps"):
            run = str(one["helps"]).partition(" (standard deviation")[0]  # differs by number
            helps.setdefault(run, []).append(str(one["name"]))
    return said + [f"{', '.join(names)}: not determined; {run}" for run, names in helps.items()]


def _model(model: StudioModel, quantity: str) -> dict[str, Any]:
    fit = _part(model.place / "fit.json", _FIT)
    compared = _part(model.document("comparison.json", quantity), _COMPARED)
    diagnosis = _part(model.document("diagnosis.json", quantity), _DIAGNOSED)
    return {
        **model.told,
        "ready": model.ready,
        "fit": fit,
        "advice": _part(model.place / "fit.json", _ADVISES, advice),
        **_error(compared, fit, model.told["quantity"], quantity),
        "effects": compared.get("effects", []),
        "verdict": diagnosis.get("verdict"),
        "named": diagnosis.get("named", []),
        "floor": diagnosis.get("floor"),
        "refitted": diagnosis.get("error_refitted"),
        "lines": list(diagnosis.get("explanation", {}).items()),
        "documents": {
            f"{q}/{name}": stamp
            for q in QUANTITIES
            for name in (*DOCUMENTS, "planted.npz")
            if (stamp := _stamp(model.document(name, q))) is not None
        },
        "taken": [p.name for p in sorted((model.place / "taken").glob("*"))],
    }


def _error(
    compared: Mapping[str, Any], fit: Mapping[str, Any], fitted: str, quantity: str
) -> dict[str, Any]:
    """Return the error of a quantity: as the model was compared with it, else as a fit tells it."""
    other = (fit.get("others") or fit.get("force_errors") or {}).get(quantity) or {}
    told = compared or (fit if fitted == quantity else other)
    error = told.get("error", told.get("error_after"))
    return {"error": error, "error_unit": told.get("error_unit")}


_FIT = (
    *("effect", "action", "title", "strength", "std", "unit", "range", "in_range", "flags"),
    *("error_before", "error_after", "error_unit", "error_refitted", "floor"),
    *("heldout_error_before", "heldout_error_after", "held_out", "messages", "quantity"),
    *("error", "force_errors", "others"),
    *("residual_rms_before", "residual_rms_after", "residual_rms_unit"),
)
_ADVISES = ("messages", "reasons", "parameters", "brush")
_COMPARED = ("error", "error_unit", "effects")
_DIAGNOSED = ("verdict", "named", "floor", "error_refitted", "explanation")
_known: dict[tuple[Path, Sequence[str]], tuple[float, Any]] = {}


def _part(path: Path, keys: Sequence[str], of: Callable[[dict[str, Any]], Any] = dict) -> Any:
    """Return what follows from keys of a document, which is read again only if it has changed."""
    stamp = _stamp(path)
    if stamp is None:
        return of({})
    part = path, keys
    if part not in _known or _known[part][0] != stamp:
        told = read_document(path) or {}
        _known[part] = stamp, of({key: told[key] for key in keys if key in told})
    return _known[part][1]


def _stamp(path: Path) -> float | None:
    try:
        return path.stat().st_mtime
    except OSError:
        return None
