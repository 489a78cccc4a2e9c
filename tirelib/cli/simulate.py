"""``tirelib simulate``: the ring model of a tire on the road."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from tirelib.cli.common import NEW_FOLDER, Real, new_table, output, say_written, write_json
from tirelib.cli.options import effects_option, json_option
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import Tire, TireFile, read_tire
from tirelib.core.units import from_si, to_si
from tirelib.inference.compare.model import TireModel, model_of
from tirelib.model.registration import registered_effects
from tirelib.report.simulation import (
    CONTACTS,
    LARGEST_BELT_SPEED,
    Simulation,
)
from tirelib.report.simulation import simulate as simulate_tire
from tirelib.report.simulation_document import FORMAT, point_document, write_curves
from tirelib.report.simulation_model import simulate_file
from tirelib.report.simulation_notes import acting_effects, effects_left_out, notes_on

RINGS = {"large": "large displacements", "linear": "linear"}

_EXAMPLE = """\b
Examples:
  tirelib simulate --model table-6-1 --load 4000
  tirelib simulate --model table-6-1 --deflection 25 --omega 59 --damping 0.04 --json s.json
  tirelib simulate --model table-6-2-195-65r15 --load 1500,3000,4500 --pressure 2.3 --speed 65 \\
                   --out simulated
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib identify straight --out M.toml
  tirelib simulate --model M.toml --load 1500,4500,7500 --speed 80 --out mine

\b
A model file of `identify` or `add` is simulated as it was fitted, with large displacements and its
effects. A tire file is simulated as the dissertation's linear ring unless --ring large is given.
Values with commas are operating points, drawn together; an option with one value holds for all.
Wheel angle 0 is below the axle, entry < 0 < exit; strain is positive in tension.
"""


def _numbers(
    context: click.Context, option: click.Parameter, text: str | None
) -> tuple[float, ...] | None:
    """Return one number, or several with commas between them."""
    if text is None:
        return None
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise click.BadParameter(
            f"{text!r} is neither a number nor a list like 1500,3000,4500; separate numbers with "
            "commas and no spaces",
            context,
            option,
        ) from None


@click.command(epilog=_EXAMPLE)
@click.option(
    "--model",
    metavar="M.toml|NAME",
    required=True,
    help="Tire file, model file, or the name of a tire that tirelib ships.",
)
@click.option(
    "--load", metavar="N", callback=_numbers, help="Vertical load Fz; give this or --deflection."
)
@click.option(
    "--deflection",
    metavar="MM",
    callback=_numbers,
    help="Deflection: free radius minus loaded radius.",
)
@click.option(
    "--pressure",
    metavar="BAR",
    callback=_numbers,
    help="Inflation pressure (gauge). Default: that of the tire.",
)
@click.option(
    "--speed",
    metavar="KMH",
    callback=_numbers,
    help="Speed in free rolling. The turn rate is the speed divided by the ring radius, because "
    "the belt keeps its length. Default: 0.",
)
@click.option(
    "--omega", metavar="RAD_S", callback=_numbers, help="Turn rate, to be given instead of --speed."
)
@click.option(
    "--contact",
    type=click.Choice(CONTACTS),
    default=CONTACTS[0],
    show_default=True,
    help="Tread springs: compressed along the radius only, or compressed and sheared.",
)
@click.option(
    "--ring",
    type=click.Choice(tuple(RINGS)),
    help="Ring theory. Default: that of the model file; linear for a tire file.",
)
@click.option(
    "--camber",
    metavar="DEG",
    callback=_numbers,
    help="Camber angle, used by effects that depend on it. Default: 0.",
)
@click.option(
    "--temperature",
    metavar="DEGC",
    callback=_numbers,
    help="Tread temperature, used by effects that depend on it. Default: unknown.",
)
@effects_option
@click.option(
    "--damping",
    metavar="LAMBDA",
    type=Real(),
    help="Damping ratio lambda in c_n = 2 lambda sqrt(m_n k_n). Default: that of the tire.",
)
@json_option("the results")
@click.option(
    "--out",
    "folder",
    metavar="DIR",
    type=NEW_FOLDER,
    help="Write simulation.png, .svg, .csv (curves) and .json.",
)
def simulate(
    model: str,
    load: tuple[float, ...] | None,
    deflection: tuple[float, ...] | None,
    pressure: tuple[float, ...] | None,
    speed: tuple[float, ...] | None,
    omega: tuple[float, ...] | None,
    contact: str,
    ring: str | None,
    camber: tuple[float, ...] | None,
    temperature: tuple[float, ...] | None,
    effect_files: tuple[Path, ...],
    damping: float | None,
    json_file: Path | None,
    folder: Path | None,
) -> None:
    """Simulate the rolling ring on the road: shape, pressure, shear, strain and strain rate."""
    file = read_tire(model)
    chosen = _model(file, ring, contact, effect_files)
    tire = file.tire if damping is None else file.tire.changed(damping=damping)
    if speed is not None and omega is not None:
        raise ParameterError("simulate: both --speed and --omega are given; give one of them")
    if (load is None) == (deflection is None):
        given = (
            "neither --load nor --deflection" if load is None else "both --load and --deflection"
        )
        raise ParameterError(
            f"simulate: {given}; give exactly one, because the other one is a result"
        )
    turn_rate = np.zeros(1) if omega is None else np.array(omega)
    if speed is not None:
        turn_rate = _turn_rate(_si(speed, "km/h", "speed"), tire)
    pressed = {
        "load": None if load is None else np.array(load),
        "deflection": None if deflection is None else _si(deflection, "mm", "length"),
    }
    inflation = None if pressure is None else _si(pressure, "bar", "pressure")
    if chosen is not None:
        done = simulate_file(
            chosen,
            tire,
            inflation=inflation,
            turn_rate=turn_rate,
            camber=None if camber is None else _si(camber, "deg", "angle"),
            temperature=None if temperature is None else _si(temperature, "degC", "temperature"),
            **pressed,
        )
    elif camber is None and temperature is None:
        done = simulate_tire(
            tire, inflation=inflation, turn_rate=turn_rate, contact=contact, **pressed
        )
    else:
        raise ParameterError(
            "simulate: --camber and --temperature act on effects only, and this simulation has "
            "none; leave them out"
        )
    notes = notes_on(file, done, chosen)
    _print(file, done, notes)
    written = [] if json_file is None else [json_file]
    if folder is not None:
        written += _write(done, file.name, folder)
    targets = [path for path in (json_file, folder and folder / "simulation.json") if path]
    document = _document(file, model, done, notes, chosen) if targets else {}
    for target in targets:
        write_json(target, document)
    say_written(*written)


def _model(
    file: TireFile, ring: str | None, contact: str, effect_files: Sequence[Path]
) -> TireModel | None:
    """Return the model of a file with its effects; None for the linear ring of a bare tire.

    The contact with tread shear knows the linear ring only.
    """
    if contact == "shear":
        if ring == "large":
            raise ParameterError(
                "simulate: --ring large has no tread shear; leave out --contact shear or --ring"
            )
        return None
    if ring is None and not ("model" in file.extra or file.extra.get("effects")):
        return None
    model = model_of(file, registered_effects(tuple(effect_files)))
    return model if ring is None else replace(model, large=ring == "large")


def _si(values: Sequence[float], unit: str, dimension: str) -> FloatArray:
    return to_si(np.array(values, dtype=float), unit, dimension)


def _turn_rate(speed: FloatArray, tire: Tire) -> FloatArray:
    """Return the turn rate of a belt of constant length in free rolling."""
    good = (speed >= 0.0) & (speed <= LARGEST_BELT_SPEED)
    if not good.all():
        given, most = (
            from_si(x, "km/h", "speed") for x in (float(speed[~good][0]), LARGEST_BELT_SPEED)
        )
        raise ParameterError(
            f"simulate: --speed {given:g} km/h; the model holds for forward rolling from 0 to "
            f"{most:.0f} km/h, faster than any tire's belt; check value and unit"
        )
    rate: FloatArray = speed / tire.ring_radius
    return rate


def _document(
    file: TireFile, model: str, done: Simulation, notes: Sequence[str], chosen: TireModel | None
) -> dict[str, Any]:
    points = [point_document(done, point) for point in range(len(done))]
    document = {
        "format": FORMAT,
        "model": model,
        "tire": file.name,
        "contact": done.contact,
        "damping": done.tire.damping,
        "signs": "wheel angle 0 below the axle, entry < 0 < exit; u outward, shear toward "
        "the exit, pressure inward, tension positive",
        "ring": RINGS["large" if chosen is not None and chosen.large else "linear"],
        "effects": [] if chosen is None else [used.effect.name for used in acting_effects(chosen)],
        "effects_left_out": effects_left_out(file, chosen),
        "notes": list(notes),
        **points[0],
    }
    if len(points) > 1:
        document["points"] = points
    return document


def _write(done: Simulation, name: str, folder: Path) -> list[Path]:
    from tirelib.report.figures.ring_panels import figure_simulation
    from tirelib.report.style import save

    curves = folder / "simulation.csv"
    write_curves(done, curves)
    save(figure_simulation(done, name), folder, "simulation")
    return [folder / f"simulation.{end}" for end in ("png", "svg")] + [
        curves,
        folder / "simulation.json",
    ]


def _print(file: TireFile, done: Simulation, notes: Sequence[str]) -> None:
    """Print a row for each operating point, in tables that fit a terminal."""
    console = output()
    damping = f"lambda {done.tire.damping:g}"
    ring = "" if done.gage is None else ", the model's own ring and effects"
    console.print(f"{file.name}{ring}, {done.contact} contact, {damping}; entry < 0 < exit")
    for note in notes:
        console.print(f"note: {note}")
    points = [point_document(done, point) for point in range(len(done))]
    for columns in _TABLES:
        headings = (title.replace(" [", "\n[") for title in columns)
        table = new_table("point", *headings, words=())
        for number, point in enumerate(points):
            table.add_row(str(number), *(read(point) for read in columns.values()))
        console.print(table)


def _peak(kind: str, name: str, key: str) -> Any:
    return lambda point: (
        f"{point[kind][name][key]:.0f} at {np.rad2deg(point[kind][name]['angle_rad']):+.2f} deg"
    )


_TABLES: tuple[dict[str, Any], ...] = (
    {
        "vertical load [N]": lambda p: f"{p['Fz_N']:.1f}",
        "deflection [mm]": lambda p: f"{p['deflection_mm']:.3f}",
        "inflation [bar]": lambda p: f"{p['pressure_bar']:g}",
        "turn rate [rad/s]": lambda p: f"{p['omega_rad_s']:.4g}",
        "speed [km/h]": lambda p: f"{p['speed_kmh']:.4g}",
    },
    {
        "entry [rad]": lambda p: f"{p['edges_rad'][0]:+.4f}",
        "exit [rad]": lambda p: f"{p['edges_rad'][1]:+.4f}",
        "length [mm]": lambda p: f"{p['contact_length_mm']:.2f}",
        "q middle [N/m]": lambda p: f"{p['q_center_N_per_m']:.0f}",
        "q largest [N/m]": lambda p: f"{p['q_max_N_per_m']:.0f}",
        "q centre [mm]": lambda p: f"{p['pressure_center_mm']:+.2f}",
    },
    {
        "CP1 [microstrain]": _peak("strain_peaks", "cp1", "ustrain"),
        "TP [microstrain]": _peak("strain_peaks", "tp", "ustrain"),
        "CP2 [microstrain]": _peak("strain_peaks", "cp2", "ustrain"),
    },
    {
        "rate, entry [microstrain/rad]": _peak("strain_rate_peaks", "lead", "ustrain_per_rad"),
        "rate, exit [microstrain/rad]": _peak("strain_rate_peaks", "trail", "ustrain_per_rad"),
    },
)
