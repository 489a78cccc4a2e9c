"""``tirelib explain``: the whole journey in one command, with one page."""

import io
import json
import shlex
from collections.abc import Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FOLDER,
    output,
    write_json,
)
from tirelib.cli.options import effects_option, json_option, quantity_option
from tirelib.cli.progress import chosen_words, progress_options
from tirelib.errors import CalibrationError, ParameterError, TirelibError
from tirelib.journey import QUANTITIES, explains_forces

if TYPE_CHECKING:
    from tirelib.report.journey import Journey

FORMAT = "tirelib-explanation/1"
STEPS = {
    "identify": "identify the base model",
    "compare": "compare the model with the measurements",
    "diagnose": "diagnose which effect is missing",
    "add": "add an effect that is named",
}
"""What each verb does on the way, as it is said while it runs."""
_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib explain straight --out explained
  tirelib rig --plan set1 --out cornering
  tirelib explain cornering --quantity Fy --out explained-Fy --json E.json

\b
It runs identify, compare, diagnose, add for each effect that is named, and compare again.
FOLDER/index.html has before and after, links to the page of each step, and the commands, which can
be run one by one. Exit code: 0 whatever the verdict, 2 bad input or no model could be identified.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="CAMPAIGN", type=CAMPAIGN)
@click.option(
    "--model",
    "model_name",
    metavar="M.toml|NAME",
    help="Start from this model instead of identifying one.",
)
@quantity_option
@effects_option
@click.option(
    "--out",
    "out",
    metavar="FOLDER",
    type=NEW_FOLDER,
    required=True,
    help="Write the page, the models and the page of each step.",
)
@json_option()
@progress_options
def explain(
    folder: Path,
    model_name: str | None,
    quantity: str | None,
    effect_files: tuple[Path, ...],
    out: Path,
    json_file: Path | None,
) -> None:
    """Find what a model of CAMPAIGN lacks, add it, and show before and after."""
    from tirelib.report.explanation import titled
    from tirelib.report.journey import write_journey

    if quantity is not None and quantity not in QUANTITIES:
        raise ParameterError(
            f"--quantity {quantity}: allowed are {', '.join(QUANTITIES)}; correct the name"
        )
    read_campaign(folder)  # what is wrong with it is said before anything is written
    out.mkdir(parents=True, exist_ok=True)
    steps = Steps(folder, out, tuple(str(path) for path in effect_files))
    journey = steps.walk(model_name, quantity)
    document = journey.document
    console = output()
    console.print(f"{document['campaign']}, {document['quantity']}: {document['verdict']}")
    for what, said in titled(document["explanation"]):
        console.print(f"  {what}: {said}")
    for line in document["messages"]:
        console.print(f"  {line}")
    for path in write_journey(journey, out):
        console.print(f"written: {path}")
    for target in (json_file, out / "explanation.json"):
        if target is not None:
            write_json(target, dict(document))
            console.print(f"written: {target}")


class Steps:
    """The verbs one after the other, as a user would call them, with what each wrote.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    out : Path
        Where models and pages go.
    effect_files : tuple of str
    """

    def __init__(self, folder: Path, out: Path, effect_files: tuple[str, ...]) -> None:
        self.folder, self.out = folder, out
        self.effects = [word for path in effect_files for word in ("--effects", path)]
        self.commands: list[str] = []
        self.messages: list[str] = []

    def walk(self, model_name: str | None, quantity: str | None) -> "Journey":
        """Run the journey and return it.

        Raises
        ------
        TirelibError
            Of any verb but `add`, whose reason becomes a message.
        """
        from tirelib.report.journey import Journey

        model = model_name or self._identified()
        about = self._about(model, quantity)
        before = self._compared(model, about, "compared-before")
        told = self._run(
            "diagnose",
            str(self.folder),
            "--model",
            model,
            *about,
            *self.effects,
            "--out",
            str(self.out / "diagnosed"),
            json_name="diagnosis",
        )
        added: list[dict[str, Any]] = []
        last = model
        if told["verdict"] in ("named", "form_inadequate"):
            for effect in told["named"]:
                last, step = self._added(effect, last, about, len(added) + 2)
                added += [step] if step is not None else []
        after = self._compared(last, about, "compared-after") if added else before
        document = self._document(told, before, after, added, model)
        first = self._comparison(model, document["quantity"])
        second = self._comparison(last, document["quantity"]) if added else first
        return Journey(first, second, document, added, _history(last))

    def _identified(self) -> str:
        model = str(self.out / "M.toml")
        self._run("identify", str(self.folder), "--out", model, json_name="identification")
        return model

    def _about(self, model: str, quantity: str | None) -> tuple[str, ...]:
        """Return the option that names the quantity; of forces it is settled once for all steps."""
        from tirelib.diagnose.forces.assess import force_case
        from tirelib.model.registration import registered_effects
        from tirelib.parameters import read_tire

        campaign, file = read_campaign(self.folder), read_tire(model)
        if not explains_forces(quantity, campaign, file):
            return ("--quantity", "strain") if quantity is not None else ()
        paths = tuple(Path(word) for word in self.effects[1::2])
        case = force_case(campaign, file, registered_effects(paths), quantity)
        return ("--quantity", case.quantity)

    def _compared(self, model: str, about: tuple[str, ...], name: str) -> dict[str, Any]:
        return self._run(
            "compare",
            str(self.folder),
            "--model",
            model,
            *about,
            *self.effects,
            "--out",
            str(self.out / name),
            json_name=name,
        )

    def _added(
        self, effect: str, model: str, about: tuple[str, ...], number: int
    ) -> tuple[str, dict[str, Any] | None]:
        """Return the model with one effect more; as it was, with a message, if that fails."""
        target = str(self.out / f"M{number}.toml")
        try:
            step = self._run(
                "add",
                effect,
                "--model",
                model,
                "--data",
                str(self.folder),
                *about,
                *self.effects,
                "--out",
                target,
                "--report",
                str(self.out / f"added-{effect}"),
                json_name=f"added-{effect}",
            )
        except TirelibError as error:
            self.messages.append(f"{effect} is named but could not be added: {error}")
            return model, None
        return target, step | {"model": target}

    def _run(self, *words: str, json_name: str) -> dict[str, Any]:
        """Run a verb as the command line would, and return the document that it wrote.

        Raises
        ------
        CalibrationError
            If it ends without success for another reason than bad input, with what it said.
        """
        from tirelib.cli import program

        target = self.out / f"{json_name}.json"
        arguments = [*words, "--json", str(target)]
        self.commands.append(shlex.join(["tirelib", *arguments]))
        progress = chosen_words()
        if "--quiet" not in progress:
            click.echo(f"step {len(self.commands)}: {STEPS[words[0]]}", err=True)
        said = io.StringIO()
        with redirect_stdout(said):
            code = program.main([*arguments, *progress], prog_name="tirelib", standalone_mode=False)
        if code:
            raise CalibrationError(
                f"{shlex.join(['tirelib', *words])}: it ended with exit code {code}: "
                f"{said.getvalue().strip()}"
            )
        document = json.loads(target.read_text(encoding="utf-8"))
        return dict(document)

    def _comparison(self, model: str, quantity: str) -> Any:
        from tirelib.compare import compare
        from tirelib.model.registration import registered_effects
        from tirelib.parameters import read_tire

        paths = tuple(Path(word) for word in self.effects[1::2])
        return compare(
            read_campaign(self.folder),
            read_tire(model),
            quantity,
            effects=registered_effects(paths),
        )

    def _document(
        self,
        told: Mapping[str, Any],
        before: Mapping[str, Any],
        after: Mapping[str, Any],
        added: list[dict[str, Any]],
        model: str,
    ) -> dict[str, Any]:
        """Return the journey as ``tirelib-explanation/1``."""
        from tirelib.report.explanation import journey_explained

        raw = told["residual_rms_unit"]
        steps = [
            {
                "model": model,
                "what": "the base" + _has(told),
                "error": before["error"],
                "heldout_error": added[0]["heldout_error_before"] if added else None,
                "residual_rms_raw": before["residual_rms_raw"],
            }
        ]
        steps += [
            {
                "model": step["model"],
                "what": f"with {step['effect']}",
                "error": step["error_after"],
                "heldout_error": step["heldout_error_after"],
                "residual_rms_raw": step["residual_rms_after"],
            }
            for step in added
        ]
        document: dict[str, Any] = {
            "format": FORMAT,
            "campaign": told["campaign"],
            "quantity": told["quantity"],
            "verdict": told["verdict"],
            "named": told["named"],
            "added": [step["effect"] for step in added],
            "error_unit": before["error_unit"],
            "noise": before["noise"],
            "error_before": before["error"],
            "error_after": after["error"],
            "floor": added[-1]["floor"] if added else told["floor"],
            "heldout_error_before": steps[0]["heldout_error"],
            "heldout_error_after": steps[-1]["heldout_error"] if added else None,
            "held_out": _held_out(added),
            "residual_rms_before": before["residual_rms_raw"],
            "residual_rms_after": after["residual_rms_raw"],
            "residual_rms_unit": raw,
            "steps": steps,
            "pages": self._pages(added),
            "commands": self.commands,
            "messages": [*self.messages, *_unmoved(added)],
        }
        document["explanation"] = journey_explained(told, document, self.folder, self.out)
        return document

    def _pages(self, added: list[dict[str, Any]]) -> list[dict[str, str]]:
        pages = [
            ("compare: where the model fails, before", "compared-before/index.html"),
            ("diagnose: which effect is missing", "diagnosed/diagnosis.html"),
            *(
                (f"add {s['effect']}: how the error falls", f"added-{s['effect']}/extension.html")
                for s in added
            ),
        ]
        if added:
            pages.append(("compare again: where it fails, after", "compared-after/index.html"))
        return [{"title": title, "path": path} for title, path in pages]


def _has(told: Mapping[str, Any]) -> str:
    return "".join(f", {name}" for name in told["has"])


def _held_out(added: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return what was held out, with its errors of the first model and of the last."""
    if not added:
        return []
    return [
        {**last, "error_before": first["error_before"]}
        for first, last in zip(added[0]["held_out"], added[-1]["held_out"], strict=True)
    ]


def _unmoved(added: list[dict[str, Any]]) -> list[str]:
    """Say of each step what did not fall on what was held out."""
    from tirelib.report.explanation import unmoved

    return [f"{step['effect']}: {said}" for step in added for said in unmoved(step)]


def _history(model: str) -> list[Mapping[str, Any]]:
    from tirelib.parameters import read_tire

    return list(read_tire(model).extra.get("history", []))
