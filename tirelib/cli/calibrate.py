"""``tirelib calibrate``: fit the regressions on campaigns of one tire."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from tirelib.campaign import Campaign, read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FILE,
    NEW_FOLDER,
    new_table,
    output,
    write_json,
)
from tirelib.cli.features import make_low_pass
from tirelib.cli.limits import not_checked, not_given
from tirelib.cli.options import json_option, low_pass_options
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import CalibrationError
from tirelib.core.version import __version__
from tirelib.estimators.calibration_file import write_calibration
from tirelib.estimators.costs import costs_of
from tirelib.estimators.crossval import (
    FACTOR,
    REPORT_UNIT,
    TRUTH_NAME,
    HeldOut,
    leave_levels_out,
)
from tirelib.estimators.dissertation import SMALL_ANGLE, Regression
from tirelib.estimators.edge import VARIED
from tirelib.estimators.estimate import QUANTITIES
from tirelib.estimators.mixed import strangers
from tirelib.estimators.result import cost_rows
from tirelib.estimators.train import Trained, train
from tirelib.estimators.typical import typical_turn
from tirelib.measured.observations import Observations, observe

FORMAT = "tirelib-calibrate/1"

_EXAMPLE = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib calibrate day1 --out cal.toml
  tirelib rig --plan brake_drive --out braking
  tirelib calibrate day1 braking --out cal.toml --report calibration

\b
Several campaigns must have the same tire and gages. More conditions in the data (pressure, speed,
camber, slip ratio) make the calibration hold for them.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folders", metavar="DIR...", type=CAMPAIGN, nargs=-1, required=True)
@click.option(
    "--out",
    "target",
    metavar="CAL.toml",
    type=NEW_FILE,
    required=True,
    help="Calibration file to write.",
)
@click.option(
    "--report",
    metavar="FOLDER",
    type=NEW_FOLDER,
    help="Write statistics and residual plots as HTML.",
)
@click.option("--quick", is_flag=True, help="Skip the cross-validation by level.")
@low_pass_options
@json_option("statistics")
@progress_options
def calibrate(
    folders: tuple[Path, ...],
    target: Path,
    report: Path | None,
    quick: bool,
    order: float | None,
    cut_off: float | None,
    json_file: Path | None,
) -> None:
    """Fit the estimators of Fz, alpha, kappa and Fy on the campaigns in DIR..."""
    campaigns = [read_campaign(folder) for folder in folders]
    repeated = [str(f) for f in folders if [p.resolve() for p in folders].count(f.resolve()) > 1]
    if repeated:
        raise CalibrationError(
            f"{repeated[0]}: the campaign is given twice; give every campaign once"
        )
    low_pass = make_low_pass(order, cut_off)
    runs = sum(len(campaign.plans) for campaign in campaigns)
    with progress_bar("reading", runs) as progress:
        observations = observe(campaigns, low_pass=low_pass, progress=progress)
    with progress_bar("fitting") as progress:  # how many fits depends on the data
        trained = train(observations, low_pass=low_pass, progress=progress)
    held_out: tuple[HeldOut, ...] = ()
    if not quick:
        with progress_bar("cross-validating") as progress:
            held_out = leave_levels_out(observations, trained, progress)
    document = statistics(campaigns, observations, trained, held_out)
    turn = typical_turn(campaigns, observations, trained.calibration)
    write_calibration(replace(trained.calibration, reference=turn), target, _provenance(document))
    console = output()
    _print(console, trained, document)
    for odd in document["other_tire"]:
        console.print(
            f"another tire? {odd['unlike']} of {odd['judged']} runs of {odd['name']} have a strain "
            f"pattern that the tire of {odd['of']} does not show (by chance one run in a thousand "
            "would); check that both campaigns are of the same tire in the same state, otherwise "
            "calibrate them separately"
        )
    for sentence in (not_given(document["not_given"]), *not_checked(trained.calibration)):
        if sentence:
            console.print(sentence)
    console.print(f"written: {target}")
    if json_file is not None:
        write_json(json_file, document)
    if report is not None:
        from tirelib.report.calibration import write_calibration_report

        rows = [vars_of(row) for row in held_out]
        page = write_calibration_report(trained, report, held_out=rows)
        console.print(f"written: {page}")
    console.print(
        f"next: tirelib estimate ANOTHER_DAY --calibration {target} --json estimates.json"
    )


def vars_of(row: HeldOut) -> dict[str, Any]:
    """Return a held-out row as a plain table."""
    return {
        "held_out": row.condition,
        "level": row.level,
        "quantity": row.quantity,
        "unit": row.unit,
        "inside": row.inside,
        "n": row.n,
        "dissertation": row.dissertation,
        "in_use": row.in_use,
        "in_range": row.in_range,
        "in_use_in_range": row.in_use_in_range,
    }


def statistics(
    campaigns: list[Campaign],
    observations: Observations,
    trained: Trained,
    held_out: tuple[HeldOut, ...],
) -> dict[str, Any]:
    """Return everything a reader may want to know of a calibration."""
    links, features = trained.links, observations.features
    costs = costs_of(trained.calibration, features, trained.calibration.estimate(features))
    in_use: dict[str, Any] = {}
    for quantity in QUANTITIES:
        if quantity not in links.held_out:
            in_use[quantity] = None
            continue
        factor = FACTOR[REPORT_UNIT[quantity]]
        truth = links.truth[TRUTH_NAME[quantity]]
        error = (links.held_out[quantity] - truth) * factor
        moved = float(np.ptp(truth)) * factor > VARIED[quantity]
        entry = {
            "unit": REPORT_UNIT[quantity],
            "n": int(error.size),
            "conditions": int(np.unique(links.groups).size),
            "cross_validated_rmse": float(np.sqrt(np.mean(error**2))),
            "r2": float(1.0 - np.sum(error**2) / np.sum(((truth - truth.mean()) * factor) ** 2))
            if moved
            else None,
            "candidates": [
                {"terms": terms, "score": score * factor}
                for terms, score in links.candidates[quantity]
            ],
        }
        if quantity == "alpha":
            small = np.abs(truth) <= np.deg2rad(SMALL_ANGLE)
            entry["cross_validated_rmse_small_angles"] = float(np.sqrt(np.mean(error[small] ** 2)))
        in_use[quantity] = entry
    return {
        "format": FORMAT,
        "axes": "iso",
        "tirelib": __version__,
        "tire": trained.calibration.tire,
        "data": [
            {"name": c.header.name, "runs": len(c.plans), "sha256": c.content_hash()}
            for c in campaigns
        ],
        "other_tire": [asdict(odd) for odd in strangers(observations)],
        "checks_other_tire": trained.calibration.knows_tire,
        "not_given": cost_rows(costs),
        "turns": len(observations),
        "usable_turns": int(observations.usable.sum()),
        "in_use": in_use,
        "refused": dict(links.refused),
        "skipped": dict(trained.skipped),
        "regressions": [_regression(regression) for regression in trained.regressions],
        "held_out": [vars_of(row) for row in held_out],
        "cornering": _cornering(trained),
    }


def _regression(regression: Regression) -> dict[str, Any]:
    return {
        "name": regression.name,
        "source": regression.source,
        "quantity": regression.quantity,
        "unit": regression.unit,
        "n": int(regression.measured.size),
        "r2": regression.r2,
        "rmse": regression.rmse,
        "cross_validated_rmse": regression.cross_validated,
        "terms": [
            {
                "name": term.name,
                "coefficient": term.coefficient,
                "std_error": term.std_error,
                "p_value": term.p_value,
            }
            for term in regression.terms
        ],
    }


def _cornering(trained: Trained) -> dict[str, Any] | None:
    trend = trained.cornering
    if trend is None:
        return None
    return {
        "load_N": trend.load.tolist(),
        "contact_length_mm": trend.contact_length.tolist(),
        "cornering_stiffness_N_per_deg": trend.stiffness.tolist(),
        "cornering_stiffness_std": trend.stiffness_std.tolist(),
        "peak_force_N": trend.peak.tolist(),
        "peak_force_std": trend.peak_std.tolist(),
        "stiffness_over_length": trend.stiffness_fit.tolist(),
        "peak_over_length": trend.peak_fit.tolist(),
    }


def _provenance(document: dict[str, Any]) -> dict[str, Any]:
    """Return the statistics for the calibration file, without null values (TOML has none)."""

    def without_null(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: without_null(v) for k, v in value.items() if v is not None}
        if isinstance(value, list):
            return [without_null(item) for item in value if item is not None]
        return value

    names = ("tirelib", "data", "in_use", "refused", "regressions", "held_out", "cornering")
    return {
        ("statistics" if name == "in_use" else name): without_null(document[name])
        for name in names
        if document[name]
    }


def _print(console: Console, trained: Trained, document: dict[str, Any]) -> None:
    """Print the estimators in use first, then the dissertation's regressions for comparison."""
    console.print(_in_use_table(trained, document["in_use"]))
    if document["held_out"]:
        console.print(_held_out_table(document["held_out"]))
    if trained.regressions:
        console.print(_regression_table(trained.regressions))
    for name, reason in trained.skipped.items():
        console.print(f"not fitted: {name}: {reason}")


def _regression_table(regressions: Sequence[Regression]) -> Table:
    """Every regression of the dissertation with its coefficients."""
    table = new_table(
        *("regression", "R2", "held out", "term", "coefficient", "std error", "p value"),
        words=("regression", "term"),
        title="For comparison: the dissertation's regressions on the same runs (not used by "
        "estimate)",
        title_justify="left",
    )
    for regression in regressions:
        error = f"{regression.cross_validated:.4g} {regression.unit}"
        first = (regression.name, f"{regression.r2:.4f}", error)
        second = (f"  {regression.source}", "", "")
        for number, term in enumerate(regression.terms):
            table.add_row(
                *((first, second)[number] if number < 2 else ("", "", "")),
                term.name,
                f"{term.coefficient:.5g}",
                f"{term.std_error:.3g}",
                f"{term.p_value:.3f}",
                end_section=number == len(regression.terms) - 1,
            )
    return table


def _in_use_table(trained: Trained, in_use: dict[str, Any]) -> Table:
    """Error of each estimator on conditions that were held out."""
    table = new_table(
        *("quantity", "rmse", "unit", "R2", "runs", "terms"),
        words=("quantity", "unit"),
        title="Error of the estimators (rms, with conditions held out)",
        title_justify="left",
    )
    models = trained.calibration.chains[-1].polynomials
    for quantity in QUANTITIES:
        entry, model = in_use[quantity], models.get(quantity)
        if entry is None or model is None:
            why = trained.links.refused.get(quantity, "")
            table.add_row(quantity, "not calibrated", "", "", "", why)
            continue
        r2 = "-" if entry["r2"] is None else f"{entry['r2']:.5f}"
        table.add_row(
            quantity,
            f"{entry['cross_validated_rmse']:.4g}",
            entry["unit"],
            r2,
            str(entry["n"]),
            str(len(model.terms)),
        )
    return table


def _held_out_table(rows: list[dict[str, Any]]) -> Table:
    """Worst rmse over the levels of each condition: the dissertation's and ours."""
    table = new_table(
        *("held out", "quantity", "dissertation", "in use", "flagged", "with these", "unit"),
        "levels",
        words=("held out", "quantity", "unit"),
        title="Worst held-out level inside the range of the others (rms error of the run means)",
        title_justify="left",
        caption="in use: turns within the calibrated range; flagged: the largest share of a "
        "level's turns outside it; with these: rms error of all turns",
        caption_justify="left",
    )
    keys = dict.fromkeys((r["held_out"], r["quantity"]) for r in rows if r["inside"])
    for condition, quantity in keys:
        part = [r for r in rows if (r["held_out"], r["quantity"]) == (condition, quantity)]
        part = [r for r in part if r["inside"]]
        old = [r["dissertation"] for r in part if r["dissertation"] is not None]
        seen = [r["in_use_in_range"] for r in part if r["in_use_in_range"] is not None]
        flagged = 1.0 - min(r["in_range"] for r in part)
        table.add_row(
            condition,
            quantity,
            f"{max(old):.4g}" if old else "-",
            f"{max(seen):.4g}" if seen else "-",
            f"{flagged:.0%}",
            f"{max(r['in_use'] for r in part):.4g}",
            part[0]["unit"],
            str(len(part)),
        )
    return table
