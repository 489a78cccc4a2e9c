"""``tirelib export``: the forces of a model or of a campaign as a Magic Formula file."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tirelib.cli.common import NEW_FILE, Real, output, say_written, write_document
from tirelib.cli.options import effects_option, json_option
from tirelib.core.documents import new_file
from tirelib.core.errors import CalibrationError
from tirelib.core.units import to_si

if TYPE_CHECKING:
    from tirelib.core.parameters import TireFile
    from tirelib.inference.magic.fit import MagicFit

FORMAT = "tirelib-export/1"

_EXAMPLE = """\b
Examples:
  tirelib rig --plan set1 --out cornering
  tirelib export cornering --tir tire.tir --json tire.json
  tirelib identify cornering --out M.toml
  tirelib export M.toml --tir brush.tir

\b
SOURCE is a model file, whose brush is evaluated over loads, pressures and slips, or the folder of a
campaign with measured forces. The comments of the file name the error of the fit and the range of
the points. The file has SI units and axes ISO 8855 (TYDEX W).
"""


@click.command(epilog=_EXAMPLE)
@click.argument("source", metavar="SOURCE")
@click.option(
    "--tir", "tir_file", metavar="F.tir", type=NEW_FILE, required=True, help="File to be written."
)
@click.option(
    "--slip-angle",
    metavar="DEG",
    type=Real(),
    default=12.0,
    show_default=True,
    help="Largest slip angle at which the brush of a model is evaluated.",
)
@click.option(
    "--slip-ratio",
    metavar="KAPPA",
    type=Real(),
    default=0.2,
    show_default=True,
    help="Largest slip ratio at which the brush of a model is evaluated.",
)
@click.option(
    "--speed",
    metavar="KMH",
    type=Real(min=0, min_open=True),
    default=60.0,
    show_default=True,
    help="Speed at which the brush of a model is evaluated, for effects that depend on it.",
)
@click.option(
    "--radius",
    metavar="MM",
    type=Real(min=0, min_open=True),
    help="Unloaded radius of the tire. Default: free_radius of the model or campaign.",
)
@effects_option
@json_option("the errors, the range and the coefficients")
def export(
    source: str,
    tir_file: Path,
    slip_angle: float,
    slip_ratio: float,
    speed: float,
    radius: float | None,
    effect_files: tuple[Path, ...],
    json_file: Path | None,
) -> None:
    """Fit a Magic Formula 6.1 to a model's brush or to a force campaign, and write it as .tir."""
    from tirelib.campaign import read_campaign
    from tirelib.core.parameters import read_tire
    from tirelib.core.parameters.tir import write_tir
    from tirelib.inference.compare.force_model import force_model_of
    from tirelib.inference.compare.magic_points import model_points
    from tirelib.inference.identify.force_data import force_data
    from tirelib.inference.identify.force_points import force_points
    from tirelib.inference.magic.file import tir_of, words
    from tirelib.inference.magic.fit import fit_magic
    from tirelib.model.registration import registered_effects

    given = None if radius is None else to_si(radius, "mm", "length")
    if Path(source).is_dir():
        campaign = read_campaign(source)
        what = f"the forces of the campaign {campaign.header.name!r}"
        measured = force_points(force_data(campaign)).data
        fit = fit_magic(measured, radius=given or campaign.header.tire.free_radius)
    else:
        file = read_tire(source)
        unloaded = given or _free_radius(file)
        model = force_model_of(file, registered_effects(effect_files))
        points = model_points(
            model,
            slip_angle=to_si(slip_angle, "deg", "angle"),
            slip_ratio=slip_ratio,
            speed=to_si(speed, "km/h", "speed"),
            radius=unloaded,
        )
        what = f"the brush of the model {file.name!r}"
        fit = fit_magic(points, radius=unloaded, nominal_load=model.reference[0])
    with new_file(tir_file):
        write_tir(tir_of(fit, what), tir_file)
    output().print("\n".join(words(fit, what)))
    say_written(tir_file)
    write_document(_document(fit, what), json_file)


def _free_radius(file: "TireFile") -> float:
    if "free_radius" not in file.numbers:
        raise CalibrationError(
            f"model {file.name} states no free_radius, which a .tir file needs as UNLOADED_RADIUS; "
            "give --radius, or add [geometry.free_radius] to the model"
        )
    return file.numbers["free_radius"].value


def _document(fit: "MagicFit", what: str) -> dict[str, object]:
    return {
        "format": FORMAT,
        "source": what,
        "errors": {
            name: asdict(error) | {"unit": "N m" if name == "Mz" else "N"}
            for name, error in fit.errors.items()
        },
        "range_SI": {name: list(ends) for name, ends in fit.tire.limits.items()},
        "coefficients": dict(fit.tire.coefficients.values),
        "fitted": list(fit.fitted),
        "assumed": dict(fit.assumed),
        "at_limit": list(fit.at_limit),
    }
