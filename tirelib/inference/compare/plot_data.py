"""What the plots of a comparison are drawn from, and the traces of effects, as arrays.

What was measured is known before any model: it has the same arrays without those of a model.

A trace is the difference (model less measured) that an effect would leave if the measured tire had
it and the model did not: what it changes at its strength, less what the base model's numbers, the
delay of the gages and the set points could take up, with the sign turned. It is of first order in
these, so it shows the shape; how much an effect really takes away only an exact refit shows.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.campaign import Campaign, Run
from tirelib.core.arrays import FloatArray
from tirelib.core.documents import new_file
from tirelib.core.errors import CalibrationError, ParameterError, TirelibError
from tirelib.core.parameters import TireFile
from tirelib.core.quantities import QUANTITIES
from tirelib.effects import Effect
from tirelib.effects.state import Operating
from tirelib.inference.compare.force_curves import set_point_levels
from tirelib.inference.compare.force_model import force_model_of, usable_points
from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.model import TireModel
from tirelib.inference.compare.runs import Chosen, choose
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.identify.delay import by_delay
from tirelib.inference.identify.force_data import FORCES, ForceData, force_data
from tirelib.inference.identify.force_points import force_points, set_points
from tirelib.inference.identify.random_effects import scales, whitening_of
from tirelib.inference.identify.span import span
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID, measure_waveforms
from tirelib.model.base import coordinates, linearised, operating_points, predict
from tirelib.model.chain import Changes
from tirelib.model.slopes import by_values
from tirelib.model.solution import solved

FORMAT = "tirelib-plot-data/1"
CONDITIONS = ("pressure", "speed", "slip_angle", "camber", "slip_ratio")
NUMBER_STEP = 1e-3
"""Relative step of a brush's numbers."""
Planted = Sequence[tuple[str, tuple[float, ...]]]


def plot_data(
    found: Comparison | ForceComparison,
    campaign: Campaign,
    file: TireFile,
    planted: Planted,
    effects: Mapping[str, Effect],
    *,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Return arrays by name, in the units of the plots, axes ISO 8855.

    Parameters
    ----------
    file : TireFile
        The model that was compared.
    planted : sequence of (name, strength)
        Effects whose traces are wanted.
    effects : mapping
        The catalogue.
    progress : callable, optional
        Called with a label after each trace.

    Returns
    -------
    For strain, over runs and `GRID` [deg]: measured, model, difference [ustrain], white (whitened
    residual, in noise), by_gage and measured_by_gage (runs, gages, angles); of forces, over points.
    `level_CONDITION` numbers the set points, so that points within the rig's scatter have one
    number. `trace_NAME` has the shape of the difference; `fault_NAME` tells why there is none.

    Raises
    ------
    ParameterError
        If an effect is unknown.
    """
    unknown = [name for name, _ in planted if name not in effects]
    if unknown:
        raise ParameterError(
            f"--trace {unknown[0]}: the effect is not known; known are {', '.join(effects)}; "
            "correct the name, or load the file that defines it with --effects"
        )
    data = _forces(found) if isinstance(found, ForceComparison) else _strain(found)
    if not planted:
        return data
    if isinstance(found, ForceComparison):
        trace = _force_traces(found, campaign, file, effects)
    else:
        trace = _strain_traces(found)
    for name, strength in planted:
        if progress is not None:
            progress(f"trace of {name}")
        try:
            data[f"trace_{name}"] = trace(effects[name], strength)
        except TirelibError as error:
            data[f"fault_{name}"] = np.array(_no_trace(effects[name], strength) or str(error))
    return data


def _no_trace(effect: Effect, strength: tuple[float, ...]) -> str:
    """Return why an effect that cannot be negative is not drawn below zero; else nothing."""
    if not min(strength) < effect.low == 0.0:
        return ""
    unit = "" if effect.unit == "1" else f" {effect.unit}"
    return (
        f"its strength of {min(strength):.3g}{unit} is below zero, where the effect has no "
        f"meaning (0 to {effect.high:g}{unit} is plausible); there is nothing to draw"
    )


def measured_data(campaign: Campaign, runs: Iterable[Run] | None = None) -> dict[str, Any]:
    """Return what was measured, as `plot_data` does without a model's arrays.

    Parameters
    ----------
    runs : iterable of Run, optional
        The campaign's, where somebody else looks at each of them too; forces are read by
        themselves.

    Returns
    -------
    The waveforms of strain where the campaign declares gages, else the first force that was
    measured.

    Raises
    ------
    CalibrationError
        If no run holds a waveform of strain, or of a campaign without gages a force over slip.
    """
    if campaign.header.gage_lateral:
        return _runs(choose(measure_waveforms(campaign, runs=runs)))
    points = force_points(force_data(campaign)).data
    for name in FORCES:
        known = points.take(np.isfinite(getattr(points, name)))
        if len(known):
            return _points(known, name) | {"measured": getattr(known, name)}
    raise CalibrationError(
        f"{campaign.header.name}: no run holds {', '.join(FORCES)} with slip angle and load; "
        "record a force"
    )


def write_plot_data(path: Path, data: Mapping[str, Any]) -> None:
    """Write the arrays as one .npz file.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    with new_file(path), path.open("wb") as stream:
        np.savez(stream, **data)


def _runs(chosen: Chosen) -> dict[str, Any]:
    """Return the runs, their conditions and their strain as measured."""
    waves, c = chosen.waves, chosen.waves.conditions
    lateral = [1e3 * waves.header.gage_lateral[g] for g in chosen.gages]
    return {
        "format": np.array(FORMAT),
        "quantity": np.array("strain"),
        "angle": np.rad2deg(GRID),
        "run": waves.run,
        "counted": chosen.straight,
        "order": waves.start,
        "load": c["Fz"],
        **{name: QUANTITIES[name].told(c[name]) for name in CONDITIONS},
        "level_load": set_points(c["Fz"]),
        "level_pressure": set_points(c["pressure"]),
        "level_speed": set_points(np.abs(c["speed"])),
        "gages": np.array(lateral),
        "measured": 1e6 * chosen.strain,
        "measured_by_gage": 1e6 * waves.strain[:, chosen.gages],
    }


def _strain(found: Comparison) -> dict[str, Any]:
    counted = found.chosen.straight
    white = np.full(found.difference.shape, np.nan)
    if found.error.whiten is not None:
        white[counted] = -found.error.whiten(found.error.rest)
    return _runs(found.chosen) | {
        "edges": np.rad2deg(found.prediction.edges),
        "model": 1e6 * found.prediction.strain,
        "difference": 1e6 * found.difference,
        "white": white,
        "noise": np.array(1e6 * found.noise.std),
        "by_gage": 1e6 * found.by_gage,
    }


def _strain_traces(found: Comparison) -> Callable[[Effect, tuple[float, ...]], FloatArray]:
    model, waves = found.model, found.chosen.waves
    at = operating_points(waves)
    here, by, planted_on = _solved(model, at, waves.low_pass)
    scale, spread = scales(found.chosen.tolerance, waves.angle_std), float(np.std(found.difference))
    tangent = found.points.tangent
    noise = found.noise.std if found.noise.known else spread
    shifts = tangent[..., :4] * scale[:, None, :]
    inside = shifts.swapaxes(1, 2) @ shifts + noise**2 * np.eye(4)
    whiten = whitening_of(tangent, scale, noise)
    slopes = np.concatenate([by, by_delay(here, at.omega)[None]])
    rows = whiten(slopes)
    columns = rows.reshape(len(rows), -1).T

    def trace(effect: Effect, strength: tuple[float, ...]) -> FloatArray:
        planted = effect.at(strength[0] if effect.components == 1 else strength)
        raw = planted_on([*model.changes, planted]) - here
        share = np.linalg.lstsq(columns, whiten(raw).ravel(), rcond=1e-9)[0]
        own = raw - np.tensordot(share, slopes, axes=1)
        moved = np.linalg.solve(inside, shifts.swapaxes(1, 2) @ own[:, :, None])
        return np.asarray(1e6 * ((shifts @ moved)[:, :, 0] - own))

    return trace


def _solved(
    model: TireModel, at: Operating, low_pass: LowPass
) -> tuple[FloatArray, FloatArray, Callable[[Changes], FloatArray]]:
    """Return waveforms, their slopes by the tire's numbers, and those that other effects give."""
    values, free = model.values, coordinates(model.values)
    if not model.large:
        linear = linearised(values, at, free, model.changes, low_pass=low_pass)
        return (
            linear.waveform,
            linear.waveform_slopes,
            lambda changes: predict(values, at, changes, low_pass=low_pass).wave,
        )
    found = solved(values, at, model.changes, low_pass=low_pass)
    return (
        found.waveform,
        by_values(found, free).waveform[: len(free)],
        lambda changes: (
            solved(values, at, changes, low_pass=low_pass, start=found.rolling).waveform
        ),
    )


def _points(data: ForceData, quantity: str) -> dict[str, Any]:
    """Return points of a force and their conditions."""
    return {
        "format": np.array(FORMAT),
        "quantity": np.array(quantity),
        "run": data.block,
        "order": data.time,
        **{
            name: QUANTITIES[name].told(getattr(data, name))
            for name in ("load", "temperature", *CONDITIONS)
        },
        **{f"level_{name}": number for name, number in set_point_levels(data).items()},
    }


def _forces(found: ForceComparison) -> dict[str, Any]:
    return _points(found.data, found.quantity) | {
        "measured": found.measured,
        "model": found.predicted,
        "difference": found.difference,
        "white": found.difference / found.noise,
        "noise": np.array(found.noise),
    }


def _force_traces(
    found: ForceComparison, campaign: Campaign, file: TireFile, effects: Mapping[str, Effect]
) -> Callable[[Effect, tuple[float, ...]], FloatArray]:
    model = force_model_of(file, effects)
    points = usable_points(campaign, model, force_points(force_data(campaign)))
    points = points.take(np.isfinite(getattr(points.data, found.quantity)))
    bench, values, name = model.bench(points), model.values, found.quantity

    def force(numbers: Mapping[str, float], *more: Any) -> FloatArray:
        forces = bench.forces(numbers, [*model.changes, *more])
        return np.asarray(getattr(forces, name), dtype=np.float64)

    base = force(values)
    columns = [np.ones_like(base)]
    for key, value in values.items():
        if np.isfinite(value) and value != 0.0:
            columns.append(
                (force({**values, key: value * (1.0 + NUMBER_STEP)}) - base) / NUMBER_STEP
            )
    basis = span(np.stack(columns, axis=1))

    def trace(effect: Effect, strength: tuple[float, ...]) -> FloatArray:
        raw = force(values, effect.at(strength[0] if effect.components == 1 else strength)) - base
        return np.asarray(-(raw - basis @ (basis.T @ raw)), dtype=np.float64)

    return trace
