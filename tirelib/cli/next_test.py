"""``tirelib next-test``: the run that would tell suspects apart."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, FILE, Real, new_table, output, say_written, write_document
from tirelib.cli.diagnose import diagnosed
from tirelib.cli.diagnosis_file import belongs, read_diagnosis
from tirelib.cli.options import (
    effects_option,
    false_alarm_option,
    json_option,
    model_option,
    quantity_option,
    report_option,
)
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import ParameterError
from tirelib.journey import explains_forces

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tirelib.campaign import Campaign
    from tirelib.core.parameters import TireFile
    from tirelib.effects import Effect
    from tirelib.inference.planning.document import Plan
    from tirelib.inference.planning.envelope import Axis, Range

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib identify straight --out M.toml
  tirelib diagnose straight --model M.toml --out diagnosed
  tirelib next-test straight --model M.toml --diagnosis diagnosed/diagnosis.json
  tirelib next-test straight --model M.toml --suspects sidewall_load,temperature \\
      --load-range 2000 7000 --pressure-range 1.6 2.6 --speed-range 20 130 --out next

\b
Without --diagnosis or --suspects the campaign is diagnosed first (a minute or so). Ranges that are
not declared are the campaign's own, loads and speeds widened by 25 %, pressures by 15 %. The
separation is the chi-square that one run is expected to add against the wrong suspect. The chance
to resolve is that of putting a suspect out of the confidence set of `tirelib diagnose`.
Exit code: 0 done, also when nothing is in doubt; 2 bad input.
"""
SHOWN = 8
RANGES = {
    "load": "Loads that the rig allows [N].",
    "pressure": "Pressures, gauge [bar].",
    "speed": "Speeds [km/h].",
    "slip_angle": "Slip angles, for forces [deg].",
    "slip_ratio": "Slip ratios, for forces.",
    "camber": "Cambers, for forces [deg].",
    "temperature": "Tread temperatures, for forces [degC].",
}


def range_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add an option for the range of every condition that may be planned."""
    for name, text in reversed(RANGES.items()):
        command = click.option(
            f"--{name.replace('_', '-')}-range", metavar="LOW HIGH", type=Real(), nargs=2, help=text
        )(command)
    return command


@click.command("next-test", epilog=_EXAMPLE)
@click.argument("folder", metavar="CAMPAIGN", type=CAMPAIGN)
@model_option
@quantity_option
@click.option(
    "--diagnosis",
    "diagnosis_file",
    metavar="D.json",
    type=FILE,
    help="Document that `tirelib diagnose --json` wrote for this campaign and model.",
)
@click.option(
    "--suspects",
    "names",
    metavar="A,B",
    help="Effects to distinguish; a single one is distinguished from no effect at all.",
)
@range_options
@click.option(
    "--sweep/--no-sweep",
    "sweep",
    default=None,
    help="Forces: whether a further run is a sweep of the slip, or one point; by default "
    "as the campaign's runs are.",
)
@click.option(
    "--separation",
    "wanted",
    metavar="X",
    type=Real(min=0, min_open=True),
    default=20.0,
    show_default=True,
    help="Separation for which repeats are counted.",
)
@effects_option
@false_alarm_option
@report_option("next_test")
@json_option()
@progress_options
def next_test(
    folder: Path,
    model_name: str,
    quantity: str | None,
    diagnosis_file: Path | None,
    names: str | None,
    sweep: bool | None,
    wanted: float,
    effect_files: tuple[Path, ...],
    false_alarm: float,
    out: Path | None,
    json_file: Path | None,
    **ranges: tuple[float, float] | None,
) -> None:
    """Tell which further run would separate the suspects of CAMPAIGN best."""
    from tirelib.core.parameters import read_tire
    from tirelib.inference.compare.error import error_of
    from tirelib.inference.compare.model import model_of
    from tirelib.inference.diagnose.assess import assess
    from tirelib.inference.diagnose.diagnose import diagnose, plain_tires
    from tirelib.inference.diagnose.document import diagnosis_document
    from tirelib.inference.identify.campaign_data import straight_runs
    from tirelib.inference.planning.document import plan_document, plan_test
    from tirelib.inference.planning.envelope import Envelope
    from tirelib.inference.planning.suspects import given_suspects, suspects_of
    from tirelib.inference.problems.strain import StrainProblem
    from tirelib.inference.problems.strain_living import in_base
    from tirelib.inference.statistics.hypotheses import Hypotheses
    from tirelib.measured.waveforms import measure_waveforms
    from tirelib.model.registration import registered_effects

    if diagnosis_file is not None and names is not None:
        raise ParameterError("--diagnosis and --suspects are both given; give one of them")
    catalogue = registered_effects(effect_files)
    file = read_tire(model_name)
    campaign = read_campaign(folder)
    declared: dict[str, Any] = {name: _si(name, ranges[f"{name}_range"]) for name in RANGES}
    if explains_forces(quantity, campaign, file):
        answer, force_plan = _for_force(
            campaign,
            file,
            catalogue,
            quantity,
            diagnosis_file,
            names,
            declared,
            false_alarm,
            wanted,
            sweep,
        )
        _give(answer, force_plan, out, json_file)
        return
    if sweep is not None:
        raise ParameterError(
            "--sweep and --no-sweep are for forces, and strain is planned; leave them out, or give "
            "--quantity Fy"
        )
    model = model_of(file, catalogue)
    effects, strengths = model.of_strain
    told = read_diagnosis(diagnosis_file, "strain") if diagnosis_file is not None else None
    suspects = None
    if names is not None:
        suspects = given_suspects(
            [name.strip() for name in names.split(",")],
            [e.name for e in effects],
            catalogue,
            in_base=in_base(model.values),
        )
    elif told is not None:
        belongs(told, campaign, [e.name for e in effects], diagnosis_file)
        suspects = suspects_of(told, catalogue)
    with progress_bar("planning") as progress:
        runs = straight_runs(measure_waveforms(campaign, progress=progress))
        data = runs.data(with_deflection=False)
        envelope = Envelope.of(data.points, **declared)
        hypotheses: Hypotheses | None = None
        if suspects is None:
            found = diagnose(
                runs,
                model.values,
                list(catalogue.values()),
                effects=effects,
                strengths=strengths,
                false_alarm=false_alarm,
                progress=progress,
            )
            told = diagnosis_document(assess(found, model))
            suspects, hypotheses = suspects_of(told, catalogue), found.verdict.hypotheses
        elif suspects.names:
            problem = StrainProblem(
                runs, model.values, list(catalogue.values()), effects, strengths
            )
            hypotheses = Hypotheses(problem, plain_tires(), false_alarm, progress)
        plan = plan_test(
            hypotheses,
            suspects,
            envelope,
            campaign=campaign.header.name,
            wanted=wanted,
            progress=progress,
        )
    document = plan_document(plan) | error_of(runs, model).told
    if told is not None:
        document["verdict"] = told["verdict"]
    _give(document, plan, out, json_file)


def _for_force(
    campaign: "Campaign",
    file: "TireFile",
    catalogue: "Mapping[str, Effect]",
    quantity: str | None,
    diagnosis_file: Path | None,
    names: str | None,
    declared: dict[str, Any],
    false_alarm: float,
    wanted: float,
    sweep: bool | None,
) -> tuple[dict[str, Any], "Plan"]:
    """Return the next test of a force, as a document and as a plan."""
    from tirelib.inference.diagnose.forces.case import force_case
    from tirelib.inference.planning.document import plan_document, plan_force_test
    from tirelib.inference.planning.force_runs import force_envelope
    from tirelib.inference.planning.suspects import given_suspects, suspects_of

    told: dict[str, Any] | None = None
    with progress_bar("planning") as progress:
        if diagnosis_file is not None:
            told = read_diagnosis(diagnosis_file, quantity)
            quantity = str(told["quantity"])
        elif names is None:
            _, told = diagnosed(campaign, file, catalogue, quantity, false_alarm, progress)
            quantity = told["quantity"]
        case = force_case(campaign, file, catalogue, quantity)
        has = [effect.name for effect in case.effects]
        if told is not None:
            belongs(told, campaign, has, diagnosis_file)
            suspects = suspects_of(told, catalogue)
        else:
            given = [name.strip() for name in str(names).split(",")]
            suspects = given_suspects(given, has, catalogue, case.quantity)
        envelope = force_envelope(case, sweep, **declared) if suspects.names else None
        plan = plan_force_test(
            case,
            suspects,
            envelope,
            list(catalogue.values()),
            false_alarm=false_alarm,
            wanted=wanted,
            progress=progress,
        )
    document = plan_document(plan) | {"error": case.given, "error_unit": case.unit}
    if told is not None:
        document |= {"verdict": told["verdict"], "would_revive": told["next_test"]["would_revive"]}
        other = told["next_test"]["what"]
        if plan.test is None:
            document |= dict.fromkeys(("what", "message"), other)
        elif plan.test.hopeless:
            document |= dict.fromkeys(("what", "message"), f"{document['message']}; {other}")
    return document, plan


def _give(document: dict[str, Any], plan: "Plan", out: Path | None, json_file: Path | None) -> None:
    """Print an answer, and write it and its page."""
    _say(document)
    if out is not None:
        from tirelib.report.next_test import write_next_test

        say_written(*write_next_test(plan, out))
    write_document(document, json_file, out and out / "next_test.json")


def _si(name: str, given: tuple[float, float] | None) -> "Range | None":
    from tirelib.core.quantities import QUANTITIES

    if given is None:
        return None
    low, high = (float(QUANTITIES[name].measured(x)) for x in given)
    return low, high


def _condition(entry: dict[str, Any], axis: "Axis") -> str:
    """Return a condition in its unit, the ends of it where the run is a sweep."""
    if entry[axis.key] is not None:
        return f"{entry[axis.key]:.4g}"
    told = entry[axis.series]
    return f"{min(told):.3g} to {max(told):.3g}"


def _percent(chance: float | None) -> str:
    return "-" if chance is None else f"{100 * chance:.0f} %"


def _idle(candidates: "Sequence[Mapping[str, Any]]", keys: list[str]) -> set[str]:
    """Return the conditions on which neither separation nor chance of any run depends."""
    told = ("separation", "separation_std", "resolves_probability")
    out = set()
    for key in keys:
        others = [name for name in keys if name != key]
        by: dict[str, set[str]] = {}
        for entry in candidates:
            same = by.setdefault(repr([entry[name] for name in others]), set())
            same.add(" ".join(f"{entry[name] or 0.0:.3g}" for name in told))
        values = {repr(entry[key]) for entry in candidates}
        if len(values) > 1 and all(len(same) == 1 for same in by.values()):
            out.add(key)
    return out


def _say(document: dict[str, Any]) -> None:
    from tirelib.inference.planning.envelope import AXES
    from tirelib.inference.planning.next_test import LEAST_SEPARATION

    console = output()
    console.print(f"{document['campaign']}, {document['quantity']}: {document['why']}")
    console.print(f"  {document['message']}")
    candidates = document["candidates"]
    if max((entry["separation"] for entry in candidates), default=0.0) < LEAST_SEPARATION:
        return
    axes = [axis for axis in AXES.values() if axis.key in candidates[0]]
    idle = _idle(candidates, [axis.key for axis in axes])
    table = new_table(
        *(axis.quantity.heading for axis in axes),
        *("separation (chi-square)", "chance to resolve", "hardest pair"),
        words=("hardest pair",),
    )
    rows = [
        (
            *["any" if axis.key in idle else _condition(entry, axis) for axis in axes],
            f"{entry['separation']:.1f} +- {entry['separation_std']:.1f}",
            _percent(entry["resolves_probability"]),
            " / ".join(entry["pair"]),
        )
        for entry in candidates
    ]
    for row in list(dict.fromkeys(rows))[:SHOWN]:
        table.add_row(*row)
    console.print(table)
    median = document["random_median"]
    console.print(
        f"  {len(candidates)} runs looked at, {document['dropped']} dropped (beyond the tire's "
        f"validity); any one of them: separation {median['separation']:.1f} (median), chance "
        f"{_percent(median['resolves_probability'])}"
    )
    for name, why in document["left_out"].items():
        console.print(f"  left out: {name}: {why}")
