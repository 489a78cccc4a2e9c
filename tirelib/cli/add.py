"""``tirelib add``: put an effect into a model, take it out, or undo the last step."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FILE,
    NEW_FOLDER,
    output,
    say_written,
    write_document,
)
from tirelib.cli.options import effects_option, json_option, model_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import ParameterError
from tirelib.journey import check_quantity

if TYPE_CHECKING:
    from tirelib.core.parameters import TireFile

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib identify straight --out M.toml
  tirelib add sidewall_damping --model M.toml --data straight --out M2.toml --report added
  tirelib add sidewall_damping --remove --model M2.toml --data straight --out M3.toml
  tirelib add --undo --model M2.toml --out M1.toml

\b
The base model and all strengths are fitted again. Several effects are fitted together; each is a
step of the model's history, and the files are those of the last one. Held-out errors are on the
highest load and the highest pressure, each left out of the fit; of a sweep of forces, on blocks of
time. An effect of the brush is fitted to --quantity, else to the force of the model's last such
step, else to the one whose error it lowers most. Exit code: 0 done, 2 bad input.
"""
FORMAT = "tirelib-model/1"


@click.command(epilog=_EXAMPLE)
@click.argument("effect_names", metavar="[EFFECT]...", nargs=-1)
@model_option
@click.option(
    "--data", "folder", metavar="CAMPAIGN", type=CAMPAIGN, help="Campaign to fit (not for --undo)."
)
@effects_option
@click.option("--remove", is_flag=True, help="Remove EFFECT from the model instead, and fit again.")
@click.option(
    "--undo",
    is_flag=True,
    help="Restore the model exactly as it was before the last entry of its history.",
)
@click.option(
    "--quantity",
    metavar="strain|Fy|Fx|Mz",
    help="Measured quantity to fit. Default: strain; for a brush effect the force of the model's "
    "last step, else the force whose error the effect lowers most.",
)
@click.option(
    "--out", "out", metavar="M2.toml", type=NEW_FILE, required=True, help="New model file."
)
@click.option(
    "--report",
    "report",
    metavar="DIR",
    type=NEW_FOLDER,
    help="Folder for extension.html and extension.md: a waterfall of the error, each run, and the "
    "held-out errors.",
)
@json_option()
@progress_options
def add(
    effect_names: tuple[str, ...],
    model_name: str,
    folder: Path | None,
    effect_files: tuple[Path, ...],
    remove: bool,
    undo: bool,
    quantity: str | None,
    out: Path,
    report: Path | None,
    json_file: Path | None,
) -> None:
    """Add effects to a model, fit it to CAMPAIGN and show how the error changes."""
    check_quantity(quantity)
    if undo:
        if effect_names or remove:
            raise ParameterError("--undo takes neither EFFECT nor --remove; leave them out")
        _undo(model_name, out, json_file)
        return
    if not effect_names:
        raise ParameterError("EFFECT is missing; name an effect, or give --undo")
    if folder is None:
        raise ParameterError("--data is missing; give the campaign that the model is fitted to")
    if remove and len(effect_names) > 1:
        raise ParameterError("--remove takes one EFFECT; remove them one after the other")
    _change(
        effect_names, model_name, folder, effect_files, remove, quantity, out, report, json_file
    )


def _undo(model_name: str, out: Path, json_file: Path | None) -> None:
    from tirelib.core.parameters import read_tire, write_tire
    from tirelib.inference.extend.document import FORMAT as EXTENSION
    from tirelib.inference.extend.document import told_history
    from tirelib.inference.extend.model_file import undone_file

    file, entry = undone_file(read_tire(model_name))
    write_tire(file, out, FORMAT)
    output().print(f"undone: {entry.get('action', 'add')} {entry.get('effect', '?')}")
    say_written(out)
    document = {
        "format": EXTENSION,
        "action": "undo",
        "effect": entry.get("effect"),
        "effects": file.extra["effects"],
        "history": told_history(file),
    }
    write_document(document, json_file)


def _change(
    effect_names: tuple[str, ...],
    model_name: str,
    folder: Path,
    effect_files: tuple[Path, ...],
    remove: bool,
    quantity: str | None,
    out: Path,
    report: Path | None,
    json_file: Path | None,
) -> None:
    from tirelib.core.parameters import read_tire
    from tirelib.inference.extend.additions import additions, removal
    from tirelib.inference.extend.extension import known_effect
    from tirelib.model.registration import registered_effects

    catalogue = registered_effects(effect_files)
    effects = [known_effect(name, catalogue) for name in effect_names]
    file = read_tire(model_name)
    campaign = read_campaign(folder)
    about = file, campaign, quantity, catalogue
    with progress_bar("fitting") as progress:
        if remove:
            steps = [removal(effects[0], *about, progress=progress)]
        else:
            steps = list(additions(effects, *about, progress=progress))
    for _, document in steps:
        _say(document)
    new, document = steps[-1]
    write_step(new, document, out, report, json_file)


def write_step(
    new: "TireFile",
    document: dict[str, Any],
    out: Path,
    report: Path | None,
    json_file: Path | None,
) -> None:
    """Write the model after a step, the step's page and its numbers; say where they are."""
    from tirelib.core.parameters import write_tire
    from tirelib.report.journey import write_extension

    write_tire(new, out, FORMAT)
    say_written(out)
    if report is not None:
        say_written(*write_extension(document, report))
    write_document(document, json_file)


def _say(document: dict[str, Any]) -> None:
    from tirelib.report.error_sentences import fold_name, unmoved
    from tirelib.report.page import unit_name

    console = output()
    unit = unit_name(document["error_unit"])
    where = "" if document["quantity"] == "strain" else f", {document['quantity']}"
    console.print(
        f"{document['campaign']}{where}: {document['action']} {document['effect']}, strength "
        f"{_numbers(document['strength'])} +- {_numbers(document['std'])} {document['unit']}"
    )
    console.print(
        f"  error {document['error_before']:.3g} -> {document['error_after']:.3g} [{unit}], "
        f"floor {document['floor']:.3g}"
    )
    for name, errors in document.get("others", {}).items():
        before, after = errors["error_before"], errors["error_after"]
        worse = "; it rises, because the same brush was fitted to another force"
        console.print(
            f"  error of {name} {before:.3g} -> {after:.3g} [{unit_name(errors['error_unit'])}]"
            f"{worse if after > before else ''}"
        )
    for fold in document["held_out"]:
        console.print(
            f"  {fold_name(fold)} left out: error {fold['error_before']:.3g} -> "
            f"{fold['error_after']:.3g}"
        )
    for line in unmoved(document):
        console.print(f"  {line}")
    for line in (*_warnings(document["flags"], *document["range"]), *document["messages"]):
        console.print(f"  {line}")


def _numbers(values: float | list[float]) -> str:
    return ", ".join(f"{x:.4g}" for x in (values if isinstance(values, list) else [values]))


def _warnings(flags: list[str], low: float, high: float) -> list[str]:
    meanings = {
        "out_of_range": "out_of_range: the fitted strength lies outside the plausible range "
        f"{low:g} to {high:g}; another effect may be missing",
        "not_significant": "not_significant: the fitted strength does not differ significantly "
        "from zero",
        "no_gain": "no_gain: the effect does not lower the error",
        "heldout_worse": "heldout_worse: the effect raises the error on the held-out runs",
    }
    return [meanings[flag] for flag in flags]
