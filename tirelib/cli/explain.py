"""``tirelib explain``: the whole journey in one command, with one page."""

import io
import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli import compare as cli_compare
from tirelib.cli import diagnose as cli_diagnose
from tirelib.cli.add import write_step
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FOLDER,
    output,
    plain,
    say_written,
    write_document,
)
from tirelib.cli.options import effects_option, json_option, quantity_option
from tirelib.cli.progress import chosen_words, progress_bar, progress_options
from tirelib.core.errors import CalibrationError, TirelibError
from tirelib.journey import check_quantity, explains_forces

if TYPE_CHECKING:
    from tirelib.core.parameters import TireFile
    from tirelib.effects import Effect
    from tirelib.inference.diagnose.assess import Assessment, ForceAssessment
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

    check_quantity(quantity)
    steps = Steps(folder, out, effect_files)  # faults of the campaign are said before files
    out.mkdir(parents=True, exist_ok=True)
    journey = steps.walk(model_name, quantity)
    document = journey.document
    console = output()
    console.print(f"{document['campaign']}, {document['quantity']}: {document['verdict']}")
    for what, said in titled(document["explanation"]):
        console.print(f"  {what}: {said}")
    for line in document["messages"]:
        console.print(f"  {line}")
    say_written(*write_journey(journey, out))
    write_document(dict(document), json_file, out / "explanation.json")


class Steps:
    """The verbs one after the other, as a user would call them, with what each wrote.

    Parameters
    ----------
    folder : Path
        Folder of the campaign.
    out : Path
        Where models and pages go.
    effect_files : tuple of Path
    """

    def __init__(self, folder: Path, out: Path, effect_files: tuple[Path, ...]) -> None:
        from tirelib.model.registration import registered_effects

        self.folder, self.out, self.effect_files = folder, out, effect_files
        self.campaign, self.catalogue = read_campaign(folder), registered_effects(effect_files)
        self.commands: list[str] = []
        self.messages: list[str] = []

    @property
    def effects(self) -> list[str]:
        """The options that name the files of effects."""
        return [word for path in self.effect_files for word in ("--effects", str(path))]

    def walk(self, model_name: str | None, quantity: str | None) -> "Journey":
        """Run the journey and return it.

        Raises
        ------
        TirelibError
            If any verb but `add` fails; a failure of `add` becomes a message.
        """
        from tirelib.core.parameters import read_tire
        from tirelib.journey import compare
        from tirelib.report.journey import Journey

        model = model_name or self._identified()
        file = read_tire(model)
        quantity = self._settled(file, quantity)
        about = () if quantity is None else ("--quantity", quantity)

        def compared(model: str, name: str) -> tuple[Any, dict[str, Any]]:
            page = self.out / name
            words = (str(self.folder), "--model", model, *about, *self.effects)
            with self._step("compare", *words, "--out", str(page), json_name=name):
                with progress_bar("comparing") as progress:
                    found = compare(
                        self.campaign,
                        read_tire(model),
                        quantity,
                        effects=self.catalogue,
                        progress=progress,
                    )
                document = cli_compare.write_told(found, page, self.out / f"{name}.json")
            return found, dict(plain(document))

        first, before = compared(model, "compared-before")
        told, diagnosis = self._diagnosed(file, model, quantity, about)
        named = diagnosis["verdict"] in ("named", "form_inadequate")
        added = list(self._added(told, file, model, about)) if named else []
        last = added[-1]["model"] if added else model
        second, after = compared(last, "compared-after") if added else (first, before)
        document = self._document(diagnosis, before, after, added, model)
        history = list(read_tire(last).extra.get("history", []))
        return Journey(first, second, document, added, history)

    def _diagnosed(
        self, file: "TireFile", model: str, quantity: str | None, about: tuple[str, ...]
    ) -> tuple["Assessment | ForceAssessment", dict[str, Any]]:
        from tirelib.inference.diagnose.diagnose import FALSE_ALARM

        page = self.out / "diagnosed"
        words = (str(self.folder), "--model", model, *about, *self.effects)
        with self._step("diagnose", *words, "--out", str(page), json_name="diagnosis"):
            with progress_bar("diagnosing") as progress:
                told, document = cli_diagnose.diagnosed(
                    self.campaign, file, self.catalogue, quantity, FALSE_ALARM, progress
                )
            target = self.out / "diagnosis.json"
            cli_diagnose.write_told(
                told, document, model, self.folder, file, page, target, self.effect_files
            )
        return told, dict(plain(document))

    def _identified(self) -> str:
        """Identify the model as the verb does, and return its file's name.

        Raises
        ------
        CalibrationError
            If that ends without success, with what it said.
        """
        from tirelib.cli import program

        model = str(self.out / "M.toml")
        words = ["identify", str(self.folder), "--out", model]
        target = self.out / "identification.json"
        with self._step(*words, json_name="identification") as said:
            code = program.main(
                [*words, "--json", str(target), *chosen_words()],
                prog_name="tirelib",
                standalone_mode=False,
            )
        if code:
            raise CalibrationError(
                f"{shlex.join(['tirelib', *words])}: it ended with exit code {code}: "
                f"{said.getvalue().strip()}"
            )
        return model

    def _settled(self, file: "TireFile", quantity: str | None) -> str | None:
        """Return the quantity; of forces it is settled once for all steps."""
        from tirelib.inference.diagnose.forces.case import force_case

        if not explains_forces(quantity, self.campaign, file):
            return quantity
        return force_case(self.campaign, file, self.catalogue, quantity).quantity

    def _added(
        self,
        told: "Assessment | ForceAssessment",
        file: "TireFile",
        model: str,
        about: tuple[str, ...],
    ) -> Iterator[dict[str, Any]]:
        """Yield the step to the model with each named effect more, by the diagnosis' fits.

        An effect that cannot be added is left out, with a message.
        """
        from tirelib.inference.extend.additions import additions

        def failed(effect: "Effect", error: TirelibError) -> None:
            self.messages.append(f"{effect.name} is named but could not be added: {error}")

        steps = additions(
            [self.catalogue[name] for name in told.named],
            file,
            self.campaign,
            None,
            self.catalogue,
            diagnosis=told,
            failed=failed,
        )
        names: list[str] = []
        for new, document in steps:
            name = document["effect"]
            names.append(name)
            target, page = self.out / f"M{len(names) + 1}.toml", self.out / f"added-{name}"
            words = (*names, "--model", model, "--data", str(self.folder), *about, *self.effects)
            files = ("--out", str(target), "--report", str(page))
            with self._step("add", *words, *files, json_name=page.name):
                write_step(new, document, target, page, self.out / f"{page.name}.json")
            yield dict(plain(document)) | {"model": str(target)}

    @contextmanager
    def _step(self, *words: str, json_name: str) -> Iterator[io.StringIO]:
        """Note the command of a step that is done here, and catch what it says."""
        target = self.out / f"{json_name}.json"
        self.commands.append(shlex.join(["tirelib", *words, "--json", str(target)]))
        if "--quiet" not in chosen_words():
            click.echo(f"step {len(self.commands)}: {STEPS[words[0]]}", err=True)
        with redirect_stdout(io.StringIO()) as said:
            yield said

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
    from tirelib.report.error_sentences import unmoved

    return [f"{step['effect']}: {said}" for step in added for said in unmoved(step)]
