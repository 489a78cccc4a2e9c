"""``tirelib selftest``: what a diagnosis can find at this plan and noise."""

from pathlib import Path
from typing import Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, Real, Whole, new_table, output, say_written, write_document
from tirelib.cli.options import (
    effects_option,
    false_alarm_option,
    json_option,
    model_option,
    report_option,
    seed_option,
)
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import ParameterError

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib identify straight --out M.toml
  tirelib selftest straight --model M.toml --effects-of sidewall_load,temperature
  tirelib selftest straight --model M.toml --repeats 20 --out selftested
  tirelib selftest straight --model M.toml --effects mine.py --ratio 1.1 --ratio 1.3

\b
The error ratio is the rms residual of the fitted model with the effect planted, over that without.
The tires are plain ones of the library's three simulators; effects follow the catalogue's laws
exactly and no exact fit is made, so the chances are optimistic.
Exit code: 0 done, 2 bad input.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="CAMPAIGN", type=CAMPAIGN)
@model_option
@effects_option
@click.option("--effects-of", "names", metavar="A,B", help="Plant these only.")
@click.option(
    "--ratio",
    "ratios",
    metavar="X",
    type=Real(min=1.0, min_open=True),
    multiple=True,
    default=(1.05, 1.2, 1.5),
    show_default=True,
    help="Error with the effect over that without; may be given again.",
)
@click.option(
    "--repeats",
    metavar="N",
    type=Whole(min=1),
    default=30,
    show_default=True,
    help="Tires in which each effect is planted.",
)
@false_alarm_option
@seed_option
@report_option("selftest")
@json_option()
@progress_options
def selftest(
    folder: Path,
    model_name: str,
    effect_files: tuple[Path, ...],
    names: str | None,
    ratios: tuple[float, ...],
    repeats: int,
    false_alarm: float,
    seed: int,
    out: Path | None,
    json_file: Path | None,
) -> None:
    """Plant each effect at the plan and noise of CAMPAIGN and count how often it is found."""
    from tirelib.core.parameters import read_tire
    from tirelib.inference.compare.error import error_of
    from tirelib.inference.compare.model import model_of
    from tirelib.inference.identify.campaign_data import straight_runs
    from tirelib.inference.planning.selftest import selftest as test_plan
    from tirelib.inference.planning.selftest import selftest_document
    from tirelib.measured.waveforms import measure_waveforms
    from tirelib.model.registration import registered_effects

    catalogue = registered_effects(effect_files)
    model = model_of(read_tire(model_name), catalogue)
    has, strengths = model.of_strain
    only = _only(names, [effect.name for effect in has], catalogue)
    campaign = read_campaign(folder)
    with progress_bar("planting") as progress:
        runs = straight_runs(measure_waveforms(campaign, progress=progress))
        found = test_plan(
            runs,
            model.values,
            list(catalogue.values()),
            effects=has,
            strengths=strengths,
            only=only,
            ratios=tuple(dict.fromkeys(ratios)),
            repeats=repeats,
            false_alarm=false_alarm,
            seed=seed,
            progress=progress,
        )
    document = selftest_document(found) | error_of(runs, model).told
    _say(document)
    if out is not None:
        from tirelib.report.selftest import write_selftest

        say_written(*write_selftest(document, out))
    write_document(document, json_file, out and out / "selftest.json")


def _only(names: str | None, has: list[str], catalogue: Any) -> list[str]:
    """Return the effects to plant, none for all.

    Raises
    ------
    ParameterError
        If a name is unknown, or the model has the effect; with every fault.
    """
    if names is None:
        return []
    chosen = [name.strip() for name in names.split(",")]
    faults = [f"{name!r} is not known" for name in chosen if name not in catalogue]
    faults += [f"the model has {name} already" for name in chosen if name in has]
    if faults:
        raise ParameterError(
            f"--effects-of: {'; '.join(faults)}; give other names, known are {', '.join(catalogue)}"
        )
    return chosen


def _say(document: dict[str, Any]) -> None:
    console = output()
    alarms = document["false_alarms"]
    console.print(
        f"{document['campaign']}, strain: chance of finding a planted effect, "
        f"{document['repeats']} tires each"
    )
    for entry in document["summary"]:
        if entry["n"]:
            console.print(
                f"  error ratio {entry['ratio']:g}: named exactly {100 * entry['found']:.0f} %, in "
                f"the set {100 * entry['in_set']:.0f} %, only others in it "
                f"{100 * entry['wrong']:.0f} % ({entry['n']} plantings of {entry['effects']} "
                "effects)"
            )
    console.print(
        f"  nothing planted: false alarm in {100 * alarms['share']:.0f} % of {alarms['n']} tires"
    )
    chances = [heading for x in document["ratios"] for heading in (f"at {x:g}", "in a set")]
    table = new_table("effect", *chances, "end of range", "twins", words=("effect", "twins"))
    for entry in document["effects"]:
        cells: list[str] = []
        for result in entry["results"]:
            cells += _cells(result)
        table.add_row(
            entry["effect"],
            *cells,
            f"{entry['largest_ratio']:.3g}",
            ", ".join(f"{t['effect']} {t['angle_deg']:.0f} deg" for t in entry["twins"]),
        )
    console.print(table)
    for name, why in document["dead"].items():
        console.print(f"  dead: {name}: {why}")
    console.print(f"  {document['note']}")


def _cells(result: dict[str, Any]) -> list[str]:
    if not result["reachable"]:
        return ["beyond range", "-"]
    return [f"{100 * result['found']:.0f} %", f"{100 * result['in_set']:.0f} %"]
