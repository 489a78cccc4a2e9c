"""``tirelib rig``: measure a virtual tire on the numerical flat-belt rig."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tirelib.cli.common import NEW_FOLDER, Real, Whole, output, write_json
from tirelib.cli.options import json_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import ParameterError

if TYPE_CHECKING:
    from tirelib.rig.campaign import Truth

RIG_FORMAT = "tirelib-rig/1"

_EXAMPLE = """\b
Examples:
  tirelib rig --list
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib rig --plan short --hide sidewall_load=0.3 --out straight

\b
The folder is a campaign (campaign.toml, runs.csv, runs/NNN.mf4). Its truth.csv holds the noise-free
forces, slip, contact lengths and edges of each run (of each solved state of a ramp),
in SI and ISO signs.
"""


@click.command(epilog=_EXAMPLE)
@click.option("--plan", "plan_name", metavar="NAME", help="Test plan; --list shows all.")
@click.option("--out", metavar="DIR", type=NEW_FOLDER, help="Campaign folder.")
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=Whole(min=0),
    help="Seed of one test day: it changes noise and set-point errors, not the tire and the gages.",
)
@click.option(
    "--repeats",
    type=Whole(min=0),
    metavar="K",
    help="Number of runs that are repeated at the end. [default: as in the plan]",
)
@click.option(
    "--tire",
    "tire_name",
    default="reference",
    show_default=True,
    metavar="NAME",
    help="Virtual tire; --list shows all.",
)
@click.option(
    "--friction",
    type=Real(),
    metavar="MU",
    help="Friction coefficient of the road in every run. [default: that of the tire]",
)
@click.option(
    "--tread-depth",
    "tread_depth_mm",
    type=Real(),
    metavar="MM",
    help="Depth of the tread grooves; a new tread has 8 mm. [default: 8]",
)
@click.option(
    "--hide",
    "hidden_effects",
    metavar="EFFECT=STRENGTH",
    multiple=True,
    help="Physical effect that the virtual tire or its gages have and the base model lacks; "
    "--list shows all. May be given several times.",
)
@click.option(
    "--axes",
    default="iso",
    show_default=True,
    metavar="NAME",
    help="Axis system of the files: iso, sae or adapted_sae.",
)
@click.option(
    "--jobs", default=2, show_default=True, type=Whole(min=1), help="Number of processes."
)
@click.option("--force", is_flag=True, help="Write into a folder that is not empty.")
@click.option("--list", "show_list", is_flag=True, help="List plans and tires, and stop.")
@json_option("a summary")
@progress_options
def rig(
    plan_name: str | None,
    out: Path | None,
    seed: int,
    repeats: int | None,
    tire_name: str,
    friction: float | None,
    tread_depth_mm: float | None,
    hidden_effects: tuple[str, ...],
    axes: str,
    jobs: int,
    force: bool,
    show_list: bool,
    json_file: Path | None,
) -> None:
    """Measure a virtual tire on the numerical rig and write a campaign."""
    if show_list:
        _list(json_file)
        return
    if plan_name is None or out is None:
        raise click.UsageError("--plan and --out are needed; --list shows the plans")
    from tirelib.rig.campaign import run_plan
    from tirelib.rig.plans import on_one_road, plan, with_repeats
    from tirelib.rig.tire import tire

    planted = dict(_hidden(given) for given in hidden_effects)
    depth = None if tread_depth_mm is None else 1e-3 * tread_depth_mm
    chosen = on_one_road(plan(plan_name), friction, depth)
    count = len(with_repeats(chosen, chosen.repeats if repeats is None else repeats))
    with progress_bar(f"rig {plan_name}", count) as advance:
        truths = run_plan(
            chosen,
            tire(tire_name),
            out,
            seed=seed,
            repeats=repeats,
            jobs=jobs,
            axes=axes,
            overwrite=force,
            planted=planted,
            progress=lambda done, total: advance(f"run {done} of {total}"),
        )
    click.echo(f"{count} runs of {plan_name} in {out} (axes {axes}, seed {seed})")
    if json_file is not None:
        write_json(json_file, _document(plan_name, out, seed, tire_name, axes, truths))


def _hidden(given: str) -> tuple[str, float]:
    """Return name and strength of an effect to hide."""
    from tirelib.rig.hidden import hidden

    name, _, number = given.partition("=")
    effect = hidden(name)
    try:
        strength = float(number)
    except ValueError:
        raise ParameterError(
            f"--hide {given}: EFFECT=STRENGTH is needed, for instance {name}="
            f"{effect.as_stated(effect.visible):g}; correct the strength"
        ) from None
    return name, effect.from_stated(strength)


def _list(json_file: Path | None) -> None:
    from tirelib.rig.hidden import HIDDEN
    from tirelib.rig.plans import PLANS, with_repeats
    from tirelib.rig.tire import TIRES

    table = Table("plan", "runs", "about", box=SIMPLE_HEAD)
    rows = []
    for make in PLANS.values():
        p = make()
        count = len(with_repeats(p, p.repeats))
        table.add_row(p.name, str(count), p.about)
        rows.append({"plan": p.name, "runs": count, "about": p.about})
    console = output()
    console.print(table)
    console.print(f"tires: {', '.join(TIRES)}")
    laws: list[dict[str, Any]] = []
    effects = Table("effect to hide", "visible at", "unit", "law", box=SIMPLE_HEAD)
    for one in HIDDEN.values():
        visible = one.as_stated(one.visible)
        effects.add_row(one.name, f"{visible:g}", one.stated_unit, one.law)
        laws.append(
            {"effect": one.name, "visible": visible, "unit": one.stated_unit, "law": one.law}
        )
    console.print(effects)
    console.print(
        "--hide takes strengths in these units, those of `tirelib effects`; the laws are others "
        "than\nthe catalogue's, so that a strength found is not the one hidden"
    )
    if json_file is not None:
        document = {"format": RIG_FORMAT, "plans": rows, "tires": list(TIRES), "effects": laws}
        write_json(json_file, document)


def _document(
    plan_name: str, out: Path, seed: int, tire_name: str, axes: str, truths: "list[Truth]"
) -> dict[str, Any]:
    return {
        "format": RIG_FORMAT,
        "plan": plan_name,
        "folder": str(out),
        "seed": seed,
        "tire": tire_name,
        "axes": axes,
        "runs": len({t.run for t in truths}),
        "Fz_N": [min(t.force.fz for t in truths), max(t.force.fz for t in truths)],
        "Fy_N": [min(t.force.fy for t in truths), max(t.force.fy for t in truths)],
        "Fx_N": [min(t.force.fx for t in truths), max(t.force.fx for t in truths)],
    }
