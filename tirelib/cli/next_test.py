"""``tirelib next-test``: the run that would tell suspects apart."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, FILE, output, progress_bar, write_json
from tirelib.cli.diagnose import explains_forces, of_forces
from tirelib.errors import FormatError, ParameterError

if TYPE_CHECKING:
    from tirelib.diagnose.refit import Refit
    from tirelib.planning.document import Plan
    from tirelib.planning.envelope import Range

_EXAMPLE = """\b
Examples:
  tirelib next-test build/out/straight --model build/out/M.toml --json N.json --out build/out/next
  tirelib next-test build/out/straight --model M.toml --diagnosis build/out/diagnosed/diagnosis.json
  tirelib next-test build/out/straight --model M.toml --suspects sidewall_load,temperature \\
      --load-range 2000 7000 --pressure-range 1.6 2.6 --speed-range 20 130

\b
Without --diagnosis or --suspects the campaign is diagnosed first (a minute or so). Ranges that are
not declared are the campaign's own, loads and speeds widened by 25 %, pressures by 15 %. The
separation is the chi-square that one run is expected to add against the wrong suspect; 10 rules it
out. Exit code: 0 done, also when nothing is in doubt; 2 bad input.
"""
SHOWN = 8
DIAGNOSIS = "tirelib-diagnosis/1"


@click.command("next-test", epilog=_EXAMPLE)
@click.argument("folder", metavar="CAMPAIGN", type=CAMPAIGN)
@click.option("--model", "model_name", metavar="M.toml|NAME", required=True,
              help="Model that `tirelib identify` or `tirelib add` wrote.")  # fmt: skip
@click.option("--quantity", metavar="strain|Fy|Fx|Mz",
              help="Default: strain where the campaign has it, else the force that fits worst. For "
                   "forces the advice is in words, without a table of runs.")  # fmt: skip
@click.option("--diagnosis", "diagnosis_file", metavar="D.json", type=FILE,
              help="Of `tirelib diagnose` on this campaign and model.")  # fmt: skip
@click.option("--suspects", "names", metavar="A,B",
              help="Effects to tell apart; one alone stands against nothing.")  # fmt: skip
@click.option("--load-range", metavar="LOW HIGH", type=float, nargs=2,
              help="Loads that the rig allows [N].")  # fmt: skip
@click.option("--pressure-range", metavar="LOW HIGH", type=float, nargs=2,
              help="Pressures, gauge [bar].")  # fmt: skip
@click.option("--speed-range", metavar="LOW HIGH", type=float, nargs=2, help="Speeds [km/h].")
@click.option("--separation", "wanted", metavar="X", type=click.FloatRange(min=0, min_open=True),
              default=20.0, show_default=True,
              help="Separation for which repeats are counted.")  # fmt: skip
@click.option("--effects", "effect_files", metavar="FILE.py", type=FILE, multiple=True,
              help="Effects of your own; may be given again.")  # fmt: skip
@click.option("--members", metavar="N", type=click.IntRange(min=4), default=100,
              show_default=True, help="Variants of the model, if diagnosed here.")  # fmt: skip
@click.option("--seed", metavar="N", type=int, default=0, show_default=True,
              help="Of the variants.")  # fmt: skip
@click.option("--out", "out", metavar="DIR", type=click.Path(path_type=Path, file_okay=False),
              help="Write next_test.html, next_test.md and next_test.json.")  # fmt: skip
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write the numbers as JSON.")
def next_test(
    folder: Path,
    model_name: str,
    quantity: str | None,
    diagnosis_file: Path | None,
    names: str | None,
    load_range: tuple[float, float] | None,
    pressure_range: tuple[float, float] | None,
    speed_range: tuple[float, float] | None,
    wanted: float,
    effect_files: tuple[Path, ...],
    members: int,
    seed: int,
    out: Path | None,
    json_file: Path | None,
) -> None:
    """Tell which further run would separate the suspects of CAMPAIGN best."""
    from tirelib.compare.model import model_of
    from tirelib.diagnose.diagnose import diagnose
    from tirelib.diagnose.document import assess, diagnosis_document
    from tirelib.diagnose.refit import refit
    from tirelib.effects.load import all_effects
    from tirelib.identify.campaign_data import straight_runs
    from tirelib.parameters import read_tire
    from tirelib.planning.document import force_plan_document, plan_document, plan_test
    from tirelib.planning.envelope import Envelope
    from tirelib.planning.suspects import given_suspects, suspects_of
    from tirelib.waveforms import measure_waveforms

    if diagnosis_file is not None and names is not None:
        raise ParameterError("--diagnosis and --suspects are both given; give one of them")
    catalogue = all_effects(effect_files)
    file = read_tire(model_name)
    campaign = read_campaign(folder)
    if explains_forces(quantity, campaign.header, file):
        if diagnosis_file is not None or names is not None:
            raise ParameterError(
                "--diagnosis, --suspects: runs are planned for strain only; for forces leave both "
                "out, the campaign is diagnosed"
            )
        with progress_bar("diagnosing") as progress:
            _, forces = of_forces(campaign, file, catalogue, quantity, members, seed, progress)
        _give(force_plan_document(forces), None, out, json_file)
        return
    model = model_of(file, catalogue)
    used = [each for each in model.used if each.effect.hook != "brush"]
    effects = [each.effect for each in used]
    strengths = [np.atleast_1d(np.asarray(each.strength, dtype=float)) for each in used]
    told = _read_diagnosis(diagnosis_file) if diagnosis_file is not None else None
    suspects = None
    if names is not None:
        suspects = given_suspects(
            [name.strip() for name in names.split(",")], [e.name for e in effects], catalogue
        )
    elif told is not None:
        _belongs(told, [e.name for e in effects], diagnosis_file)
        suspects = suspects_of(told, catalogue)
    with progress_bar("planning") as progress:
        runs = straight_runs(measure_waveforms(campaign, progress=progress))
        data = runs.data(with_deflection=False)
        envelope = Envelope.of(
            data.points, load=_si(load_range, 1.0), pressure=_si(pressure_range, 1e5),
            speed=_si(speed_range, 1.0 / 3.6),
        )  # fmt: skip
        base: Refit | None = None
        if suspects is None:
            found = diagnose(
                runs, model.values, list(catalogue.values()), effects=effects,
                strengths=strengths, members=members, seed=seed, progress=progress,
            )  # fmt: skip
            told = diagnosis_document(assess(found, seed=seed, progress=progress))
            suspects, base = suspects_of(told, catalogue), found.base
        elif suspects.effects:
            base = refit(data, model.values, effects, strengths, progress=progress)
        plan = plan_test(
            data, base, suspects, envelope, noise=runs.noise.std, campaign=campaign.header.name,
            wanted=wanted, progress=progress,
        )  # fmt: skip
    document = plan_document(plan)
    if told is not None:
        document["verdict"] = told["verdict"]
    _give(document, plan, out, json_file)


def _give(
    document: dict[str, Any], plan: "Plan | None", out: Path | None, json_file: Path | None
) -> None:
    """Print and write an answer; a page where there is a plan."""
    _say(document)
    console = output()
    targets = [path for path in (json_file, out and out / "next_test.json") if path]
    if out is not None and plan is not None:
        from tirelib.report.next_test import write_next_test

        for path in write_next_test(plan, out):
            console.print(f"written: {path}")
    for path in targets:
        write_json(path, document)
        console.print(f"written: {path}")


def _strain_only(quantity: str) -> None:
    if quantity != "strain":
        raise ParameterError(
            f"--diagnosis of {quantity}: runs are planned for strain only; for forces leave the "
            f"option out: --quantity {quantity}"
        )


def _si(given: tuple[float, float] | None, unit: float) -> "Range | None":
    return None if given is None else (given[0] * unit, given[1] * unit)


def _read_diagnosis(path: Path) -> dict[str, Any]:
    """Return a diagnosis file.

    Raises
    ------
    FormatError
        If it cannot be read, or is no diagnosis of strain.
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
    _strain_only(str(told["quantity"]))
    return dict(told)


def _belongs(told: dict[str, Any], has: list[str], path: Path | None) -> None:
    """Refuse a diagnosis of a model with other effects."""
    if "has" in told and sorted(told["has"]) != sorted(has):
        raise ParameterError(
            f"{path}: is of a model with the effects {', '.join(told['has']) or 'none'}, this one "
            f"has {', '.join(has) or 'none'}; diagnose this model, or give the other"
        )


def _say(document: dict[str, Any]) -> None:
    console = output()
    console.print(f"{document['campaign']}, {document['quantity']}: {document['why']}")
    console.print(f"  {document['message']}")
    if not document["candidates"]:
        return
    table = Table(box=SIMPLE_HEAD)
    for column in ("load [N]", "pressure [bar]", "speed [km/h]", "separation", "chance to resolve"):
        table.add_column(column, justify="right")
    table.add_column("hardest pair")
    for entry in document["candidates"][:SHOWN]:
        table.add_row(
            f"{entry['load_N']:.0f}", f"{entry['pressure_bar']:.2f}", f"{entry['speed_kmh']:.0f}",
            f"{entry['separation']:.1f} +- {entry['separation_std']:.1f}",
            f"{100 * entry['resolves_probability']:.0f} %", " / ".join(entry["pair"]),
        )  # fmt: skip
    console.print(table)
    median = document["random_median"]
    console.print(
        f"  {len(document['candidates'])} runs looked at, {document['dropped']} dropped (beyond "
        f"the tire's validity); any one of them: separation {median['separation']:.1f} (median), "
        f"chance {100 * median['resolves_probability']:.0f} %"
    )
    for name, why in document["left_out"].items():
        console.print(f"  left out: {name}: {why}")
