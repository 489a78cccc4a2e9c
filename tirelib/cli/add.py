"""``tirelib add``: put an effect into a model, take it out, or undo the last step."""

from pathlib import Path

import click
import numpy as np

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, FILE, output, progress_bar, write_json
from tirelib.errors import ParameterError

_EXAMPLE = """\b
Examples:
  tirelib add sidewall_damping --model M.toml --data build/out/straight --out M2.toml
  tirelib add sidewall_damping --remove --model M2.toml --data build/out/straight --out M3.toml
  tirelib add --undo --model M2.toml --out M1.toml

\b
The base model and all strengths are fitted anew. Held-out errors are on the highest load and the
highest pressure, each left out of the fit. Exit code: 0 done, 2 bad input.
"""
FORMAT = "tirelib-model/1"


@click.command(epilog=_EXAMPLE)
@click.argument("effect_name", metavar="EFFECT", required=False)
@click.option("--model", "model_name", metavar="M.toml|NAME", required=True,
              help="Model that `tirelib identify` or `tirelib add` wrote.")  # fmt: skip
@click.option("--data", "folder", metavar="CAMPAIGN", type=CAMPAIGN,
              help="Campaign to fit (not for --undo).")  # fmt: skip
@click.option("--effects", "effect_files", metavar="FILE.py", type=FILE, multiple=True,
              help="Effects of your own; may be given again.")  # fmt: skip
@click.option("--remove", is_flag=True, help="Take EFFECT out instead, and fit anew.")
@click.option("--undo", is_flag=True,
              help="Go back to before the last entry of the history, to the digit.")  # fmt: skip
@click.option("--quantity", metavar="strain", default="strain", show_default=True,
              help="Measured quantity to fit.")  # fmt: skip
@click.option("--out", "out", metavar="M2.toml", type=FILE, required=True, help="New model file.")
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write the numbers as JSON.")
def add(
    effect_name: str | None,
    model_name: str,
    folder: Path | None,
    effect_files: tuple[Path, ...],
    remove: bool,
    undo: bool,
    quantity: str,
    out: Path,
    json_file: Path | None,
) -> None:
    """Add EFFECT to a model, fit it to CAMPAIGN and show what the error does."""
    from tirelib.cli.diagnose import strain_only

    strain_only(quantity)
    if undo:
        if effect_name is not None or remove:
            raise ParameterError("--undo takes neither EFFECT nor --remove; leave them out")
        _undo(model_name, out, json_file)
        return
    if effect_name is None:
        raise ParameterError("EFFECT is missing; name an effect, or give --undo")
    if folder is None:
        raise ParameterError("--data is missing; give the campaign that the model is fitted to")
    _change(effect_name, model_name, folder, effect_files, remove, out, json_file)


def _undo(model_name: str, out: Path, json_file: Path | None) -> None:
    from tirelib.extend.document import FORMAT as EXTENSION
    from tirelib.extend.model_file import undone_file
    from tirelib.parameters import read_tire, write_tire

    file, entry = undone_file(read_tire(model_name))
    write_tire(file, out, FORMAT)
    console = output()
    console.print(f"undone: {entry.get('action', 'add')} {entry.get('effect', '?')}")
    console.print(f"written: {out}")
    if json_file is not None:
        history = [{k: v for k, v in e.items() if k != "before"} for e in file.extra["history"]]
        write_json(json_file, {
            "format": EXTENSION, "action": "undo", "effect": entry.get("effect"),
            "effects": file.extra["effects"], "history": history,
        })  # fmt: skip
        console.print(f"written: {json_file}")


def _change(
    effect_name: str,
    model_name: str,
    folder: Path,
    effect_files: tuple[Path, ...],
    remove: bool,
    out: Path,
    json_file: Path | None,
) -> None:
    from tirelib.compare.model import model_of
    from tirelib.effects.load import all_effects
    from tirelib.extend.document import extension_document
    from tirelib.extend.extension import add_effect, known_effect, remove_effect
    from tirelib.extend.model_file import extended_file
    from tirelib.identify.campaign_data import straight_runs
    from tirelib.parameters import read_tire, write_tire
    from tirelib.waveforms import measure_waveforms

    catalogue = all_effects(effect_files)
    effect = known_effect(effect_name, catalogue)
    file = read_tire(model_name)
    model = model_of(file, catalogue)
    campaign = read_campaign(folder)
    step = remove_effect if remove else add_effect
    with progress_bar("fitting") as progress:
        runs = straight_runs(measure_waveforms(campaign, progress=progress))
        done = step(runs, model, effect, progress=progress)
    new = extended_file(file, done, campaign.content_hash())
    write_tire(new, out, FORMAT)
    document = extension_document(done, new)
    console = output()
    unit = "noise" if done.unit.known else "microstrain"
    console.print(
        f"{document['campaign']}: {done.action} {effect.name}, strength "
        f"{_numbers(done.strength)} +- {_numbers(done.std)} {effect.unit}"
    )
    console.print(
        f"  error {document['error_before']:.3g} -> {document['error_after']:.3g} [{unit}], "
        f"floor {done.floor:.3g}"
    )
    for fold in document["held_out"]:
        console.print(
            f"  {fold['condition']} {fold['value']:.4g} {fold['unit']} left out ({fold['runs']} "
            f"runs): error {fold['error_before']:.3g} -> {fold['error_after']:.3g}"
        )
    for line in (*_warnings(document["flags"], effect.low, effect.high), *document["messages"]):
        console.print(f"  {line}")
    console.print(f"written: {out}")
    if json_file is not None:
        write_json(json_file, document)
        console.print(f"written: {json_file}")


def _numbers(values: np.ndarray) -> str:
    return ", ".join(f"{x:.4g}" for x in values)


def _warnings(flags: list[str], low: float, high: float) -> list[str]:
    told = {
        "out_of_range": f"out_of_range: the strength lies outside the plausible {low:g} to "
        f"{high:g}; something else may be missing",
        "not_significant": "not_significant: the strength is no different from zero",
        "no_gain": "no_gain: the error does not fall",
        "heldout_worse": "heldout_worse: the error on left-out runs grows",
    }
    return [told[flag] for flag in flags]
