"""``tirelib effects``: the catalogue, and the check of effects of your own."""

import inspect
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tirelib.cli.common import output, write_json
from tirelib.cli.options import effects_option, json_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import FormatError

if TYPE_CHECKING:
    from tirelib.effects import Effect
    from tirelib.model.registration import Registration

FORMAT = "tirelib-effects/1"
_EXAMPLE = """\b
Examples:
  tirelib effects
  tirelib effects --effects mine.py

\b
Each effect of your own is tested: strength zero must give the base model, the derivative at zero
must exist and not vanish, the whole range must be computable, and a planted strength must be found
again. Exit code: 0 all passed, 2 one did not.
"""


@click.command(epilog=_EXAMPLE)
@effects_option
@json_option("what each effect is: title, stage, unit, range, source, law")
@progress_options
def effects(effect_files: tuple[Path, ...], json_file: Path | None) -> None:
    """List the effects of the catalogue, or register effects of your own."""
    from tirelib.effects import CATALOGUE
    from tirelib.effects.load import all_effects
    from tirelib.model.registration import register

    found = all_effects(effect_files)
    own = [effect for name, effect in found.items() if name not in CATALOGUE]
    if not own:
        table = Table("stage", "effect", "unit", "range", "what it is", box=SIMPLE_HEAD)
        for effect in found.values():
            ends = f"{effect.low:g} .. {effect.high:g}"
            table.add_row(effect.stage, effect.name, effect.unit, ends, effect.title)
        output().print(table)
        _write(json_file, found.values(), ())
        return
    faults: list[str] = []
    with progress_bar("registering") as progress:
        reports = []
        for effect in own:
            progress(effect.name)
            reports.append(register(effect, found))
    for report in reports:
        faults += report.faults
        if not report.accepted:
            continue
        effect, console = report.effect, output()
        console.print(f"{effect.name}: {effect.title}")
        if effect.untestable:
            console.print(f"  no campaign can show this effect: {effect.untestable}")
            continue
        console.print(
            f"  {report.planted:.4g} {effect.unit} planted, {report.recovered:.4g} found; the base "
            f"imitates {100.0 * (1.0 - report.survives):.0f} % of its trace"
        )
        twins = ", ".join(f"{name} ({np.round(angle):.0f} deg)" for name, angle in report.twins)
        console.print(f"  effects with a similar trace: {twins or 'none'}")
    if faults:
        raise FormatError(faults)
    _write(json_file, found.values(), reports)


def _write(
    json_file: Path | None, every: "Iterable[Effect]", reports: "Iterable[Registration]"
) -> None:
    if json_file is None:
        return
    tested = {
        report.effect.name: {
            "planted": report.planted,
            "recovered": report.recovered,
            "imitated_by_base": 1.0 - report.survives,
            "twins": [{"effect": name, "angle_deg": float(angle)} for name, angle in report.twins],
        }
        for report in reports
        if not report.effect.untestable
    }
    listed = [_entry(effect) | {"tested": tested.get(effect.name)} for effect in every]
    write_json(json_file, {"format": FORMAT, "effects": listed})


def _entry(effect: "Effect") -> dict[str, Any]:
    from tirelib.effects import CATALOGUE

    try:
        law = inspect.getsource(effect.law)
    except (OSError, TypeError):
        law = ""
    return {
        "effect": effect.name,
        "title": effect.title,
        "stage": effect.stage,
        "unit": effect.unit,
        "range": [effect.low, effect.high],
        "components": effect.components,
        "varies_with": list(effect.varies_with),
        "needs": list(effect.needs),
        "source": effect.source,
        "untestable": effect.untestable,
        "own": effect.name not in CATALOGUE,
        "equation": (inspect.getdoc(effect.law) or "").partition("\n")[2].strip(),
        "law": law,
    }
