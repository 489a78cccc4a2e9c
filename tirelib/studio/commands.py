"""What each kind of job runs: one command of `tirelib`, with the files that it reads and writes.

The same table gives the command lines that repeat a journey by hand.
"""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

FIRST = "first.toml"
"""The fitted ring, which is compared while its intervals and the forces are still computed."""
Order = Mapping[str, Any]
"""What a job is about: campaign, model, quantity, effect and so on, all as texts."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of job.

    Attributes
    ----------
    title : str
        What it does, as the page says it.
    argv : callable
        (order, out) -> words after `tirelib`; `out` is the folder for results.
    results : tuple of str
        Files that it writes into `out`.
    allowed : tuple of int
        Exit codes with which the results count.
    """

    title: str
    argv: Callable[[Order, str], list[str]]
    results: tuple[str, ...] = ()
    allowed: tuple[int, ...] = field(default=(0,))


def _about(order: Order) -> list[str]:
    """Return the options that name the quantity and the user's effects."""
    words = ["--quantity", str(order["quantity"])] if order.get("quantity") else []
    return words + _effects(order)


def _effects(order: Order) -> list[str]:
    return [word for path in order.get("effect_files", ()) for word in ("--effects", str(path))]


def _traced(order: Order) -> list[str]:
    return [word for each in order.get("traces", ()) for word in ("--trace", str(each))]


def _hidden(order: Order) -> list[str]:
    return [word for each in order.get("hide", ()) for word in ("--hide", str(each))]


def _read(order: Order) -> list[str]:
    """Return the words that read foreign files, with the layout that the user has stated."""
    layout = ["--map", str(order["map"])] if order.get("map") else []
    return ["import", *order["files"], *layout]


def _compared(order: Order) -> list[str]:
    return ["compare", order["campaign"], "--model", order["model"], *_about(order)]


def _changed(order: Order, out: str, *more: str) -> list[str]:
    return [
        "add",
        order["effect"],
        *more,
        "--model",
        order["model"],
        "--data",
        order["campaign"],
        *_about(order),
        "--out",
        f"{out}/M.toml",
        "--json",
        f"{out}/fit.json",
    ]


KINDS: Mapping[str, Kind] = {
    "rig": Kind(
        "measure a virtual tire",
        lambda o, out: [
            *("rig", "--plan", o["plan"], "--seed", str(o["seed"]), *_hidden(o)),
            *("--out", f"{out}/campaign", "--json", f"{out}/rig.json"),
        ],
        ("campaign", "rig.json"),
    ),
    "columns": Kind(
        "list the columns of the files",
        lambda o, out: [*_read(o), "--list", "--json", f"{out}/columns.json"],
        ("columns.json",),
        (0, 1),  # 1: some files cannot be read; the others count
    ),
    "suggest": Kind("draft a map of the columns", lambda o, out: [*_read(o), "--suggest"]),
    "import": Kind(
        "make a campaign from the files",
        lambda o, out: [
            *("import", *o["files"], "--map", o["map"], "--out", f"{out}/campaign"),
            *("--json", f"{out}/import.json"),
        ],
        ("campaign", "import.json"),
    ),
    "check": Kind(
        "check the campaign",
        lambda o, out: ["campaign", "check", o["campaign"], "--json", f"{out}/check.json"],
        ("check.json",),
        (0, 1),
    ),
    "show": Kind(
        "read the runs",
        lambda o, out: [
            *("campaign", "show", o["campaign"], "--json", f"{out}/show.json"),
            *("--no-plot", "--data", f"{out}/measured.npz"),
        ],
        ("show.json",),
    ),
    "identify": Kind(
        "fit the base model",
        lambda o, out: [
            *("identify", o["campaign"], "--out", f"{out}/M.toml", "--json", f"{out}/fit.json"),
            *(["--first", f"{out}/{FIRST}"] if o.get("first") else []),
        ],
        ("M.toml", "fit.json"),
        (0, 1),  # 1: the runs gave no ring, or no brush; what they gave counts
    ),
    "compare": Kind(
        "compare the model with the measurements",
        lambda o, out: [
            *(*_compared(o), "--json", f"{out}/comparison.json", "--data", f"{out}/plots.npz")
        ],
        ("comparison.json", "plots.npz"),
    ),
    "diagnose": Kind(
        "find which effect is missing",
        lambda o, out: [
            *("diagnose", o["campaign"], "--model", o["model"], *_about(o)),
            *("--json", f"{out}/diagnosis.json"),
        ],
        ("diagnosis.json",),
    ),
    "traces": Kind(
        "compute the residual that each effect alone would leave",
        lambda o, out: [*_compared(o), *_traced(o), "--data", f"{out}/traces.npz"],
        ("traces.npz",),
    ),
    "plant": Kind(
        "compute what the effect would look like here",
        lambda o, out: [*_compared(o), *_traced(o), "--data", f"{out}/planted.npz"],
        ("planted.npz",),
    ),
    "next-test": Kind(
        "find the run that would separate the suspects",
        lambda o, out: [
            *("next-test", o["campaign"], "--model", o["model"], *_about(o)),
            *("--diagnosis", o["diagnosis"]),
            *("--json", f"{out}/next-test.json"),
        ],
        ("next-test.json",),
    ),
    "add": Kind("add an effect and fit again", _changed, ("M.toml", "fit.json")),
    "remove": Kind(
        "take an effect out and fit again",
        lambda o, out: _changed(o, out, "--remove"),
        ("M.toml", "fit.json"),
    ),
    "report": Kind(
        "write the report",
        lambda o, out: [*_compared(o), "--out", f"{out}/report"],
        ("report",),
    ),
    "calibrate": Kind(
        "calibrate the estimators",
        lambda o, out: ["calibrate", o["campaign"], "--out", f"{out}/CAL.toml"],
        ("CAL.toml",),
    ),
    "fmu": Kind(
        "build the FMU of the calibrated estimator",
        lambda o, out: [
            *("fmu", "build", "--calibration", o["calibration"]),
            *("--out", f"{out}/StrainTire.fmu"),
        ],
        ("StrainTire.fmu",),
    ),
    "catalogue": Kind(
        "read the catalogue of effects",
        lambda o, out: ["effects", "--json", f"{out}/effects.json"],
        ("effects.json",),
    ),
    "effects": Kind(
        "check your own effects",
        lambda o, out: ["effects", *_effects(o), "--json", f"{out}/effects.json"],
        ("effects.json",),
    ),
}
"""Every kind of job by name."""


def planted(effect: str, strength: float | Sequence[float]) -> str:
    """Return an effect of a strength as `--trace` takes it."""
    numbers = [strength] if isinstance(strength, int | float) else strength
    return f"{effect}=" + ",".join(repr(float(x)) for x in numbers)


def told(words: Sequence[str]) -> str:
    """Return a command line as a user would paste it."""
    return shlex.join(["tirelib", *map(str, words)])
