"""A model file as something that predicts the waveforms of runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, FormatError, ParameterError, TirelibError
from tirelib.core.parameters import TireFile
from tirelib.effects import CATALOGUE, Effect
from tirelib.effects.state import Operating
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import N_PHI
from tirelib.model.base import predict, values_of
from tirelib.model.chain import Change, Changes
from tirelib.model.slopes import slopes_of
from tirelib.model.solution import solved
from tirelib.physics.rolling.solve import Start

TRIAL = 1e-3
"""Relative step by which slopes of the linear ring by load and pressure are taken."""
RINGS = ("large displacements", "linear")


@dataclass(frozen=True, slots=True)
class UsedEffect:
    """An effect that a model has, with its strength in the effect's unit."""

    effect: Effect
    strength: float | tuple[float, ...]

    @property
    def components(self) -> FloatArray:
        """The strength as an array, shape (components,)."""
        return np.atleast_1d(np.asarray(self.strength, dtype=float))


@dataclass(frozen=True, slots=True)
class TireModel:
    """A tire with its effects.

    Attributes
    ----------
    values : mapping
        Numbers of `Tire`, SI.
    large : bool
        Whether the correction for large displacements belongs to it.
    history : tuple of mapping
        What was added to the model and what the error did.
    sources : mapping of str to str
        Where each number of the tire comes from.
    """

    name: str
    values: Mapping[str, float | FloatArray]
    used: tuple[UsedEffect, ...]
    large: bool
    history: tuple[Mapping[str, Any], ...]
    sources: Mapping[str, str]

    @classmethod
    def fitted(
        cls,
        values: Mapping[str, float | FloatArray],
        effects: Sequence[Effect],
        strengths: Sequence[FloatArray],
    ) -> "TireModel":
        """Return the model of a fit: values of a tire, and effects with arrays of components."""
        used = tuple(
            UsedEffect(
                effect, float(s[0]) if effect.components == 1 else tuple(float(x) for x in s)
            )
            for effect, s in zip(effects, strengths, strict=True)
        )
        return cls("fitted", values, used, True, (), {})

    @property
    def changes(self) -> Changes:
        """What the effects change in the chain from tire to waveform."""
        pairs = [used.effect.at(used.strength) for used in self.used]
        return [(stage, change) for stage, change in pairs if stage != "brush"]

    @property
    def of_strain(self) -> tuple[list[Effect], list[FloatArray]]:
        """Effects that strain shows, and their strengths, one array of components each."""
        used = [each for each in self.used if each.effect.hook != "brush"]
        return [each.effect for each in used], [each.components for each in used]

    @property
    def across(self) -> bool:
        """Whether the gages differ by their lateral position."""
        return any("lateral" in used.effect.varies_with for used in self.used)


def model_of(file: TireFile, effects: Mapping[str, Effect] = CATALOGUE) -> TireModel:
    """Return the model of a file; a plain tire file is a model without effects.

    Raises
    ------
    FormatError
        If an effect is unknown, without strength, or the kind of ring is; with every fault.
    """
    used, faults = effects_of(file, effects)
    kind = file.extra.get("model", {}).get("ring", RINGS[0])
    if kind not in RINGS:
        faults.append(f"{file.name}, model.ring = {kind!r}; allowed are {', '.join(RINGS)}")
    if faults:
        raise FormatError(faults)
    return TireModel(
        file.name,
        values_of(file.tire),
        used,
        kind == RINGS[0],
        tuple(item for item in file.extra.get("history", []) if isinstance(item, dict)),
        {name: f"{number.kind}: {number.source}" for name, number in file.numbers.items()},
    )


def effects_of(
    file: TireFile, effects: Mapping[str, Effect]
) -> tuple[tuple[UsedEffect, ...], list[str]]:
    """Return the effects of a file, of strain and of the brush, and every fault in them.

    Raises
    ------
    FormatError
        If the file's effects are no list.
    """
    used, faults = [], []
    entries = file.extra.get("effects", [])
    if not isinstance(entries, list):
        raise FormatError(f"{file.name}: effects is no list; write [[effects]] tables")
    for i, entry in enumerate(entries):
        try:
            used.append(_used(entry, effects))
        except ParameterError as error:
            faults.append(f"{file.name}, effects[{i}]: {error}")
    return tuple(used), faults


def _used(entry: object, effects: Mapping[str, Effect]) -> UsedEffect:
    if not isinstance(entry, dict) or "effect" not in entry or "strength" not in entry:
        raise ParameterError(f"{entry!r}; a table with effect and strength is needed")
    name = str(entry["effect"])
    if name not in effects:
        raise ParameterError(
            f"effect {name!r} is not known; known are {', '.join(effects)}; load the file that "
            "defines it, or correct the name"
        )
    effect = effects[name]
    given = entry["strength"]
    numbers = given if isinstance(given, list) else [given]
    if not all(isinstance(x, int | float) and np.isfinite(x) for x in numbers):
        raise ParameterError(f"strength {given!r} of {name}; a finite number is needed")
    if len(numbers) != effect.components:
        raise ParameterError(
            f"strength {given!r} of {name}; {effect.components} number(s) are needed"
        )
    strength = tuple(float(x) for x in numbers)
    return UsedEffect(effect, strength if isinstance(given, list) else strength[0])


@dataclass(frozen=True, slots=True)
class Prediction:
    """What a model says of runs.

    Attributes
    ----------
    strain : shape (n_runs, n_phi), [-]
        Mean over the gages, filtered as the measurement is.
    gages : shape (n_runs, n_gages, n_phi), [-]
        Waveform of each gage; equal for all gages where no effect distinguishes them.
    by_load, by_pressure : shape (n_runs, n_phi), [-]
        Slopes of `strain` by relative load and relative pressure.
    deflection, deflection_by_load : shape (n_runs,), [m]
    edges : shape (n_runs, 2), [rad]
        Edges of the contact, entry < 0 < exit.
    """

    strain: FloatArray
    gages: FloatArray
    by_load: FloatArray
    by_pressure: FloatArray
    deflection: FloatArray
    deflection_by_load: FloatArray
    edges: FloatArray


def predict_runs(
    model: TireModel,
    points: Operating,
    lateral: Sequence[float],
    low_pass: LowPass,
    *,
    start: Start | None = None,
) -> Prediction:
    """Return what the model says at operating points, with slopes by load and pressure.

    Parameters
    ----------
    lateral : sequence of float, [m]
        Positions of the gages that are averaged (left positive).
    low_pass : LowPass
        Filter of the measured waveforms.
    start : Rolling or Unknowns, optional
        Solution of the same points by a model nearby; saves time, the result is the same.

    Raises
    ------
    CalibrationError
        If the model cannot be computed there; with the model's own message.
    """
    places = np.asarray(lateral, dtype=float)
    one = _rolling if model.large else _linear
    found: list[Prediction] = []
    try:
        for place in places if model.across else np.zeros(1):
            at: Changes = [("constants", _at(place))] if model.across else []
            changes = [*at, *model.changes]
            found.append(one(model.values, points, changes, low_pass, start))
    except TirelibError as error:
        raise CalibrationError(
            f"model {model.name}: it has no solution at the campaign's conditions ({error}); "
            "identify it from this campaign, or correct its numbers"
        ) from error
    gages = np.concatenate([each.gages for each in found], axis=1)
    return replace(
        found[0],
        strain=np.mean([each.strain for each in found], axis=0),
        gages=np.broadcast_to(gages, (len(points), places.size, N_PHI)),
        by_load=np.mean([each.by_load for each in found], axis=0),
        by_pressure=np.mean([each.by_pressure for each in found], axis=0),
    )


def _at(lateral: float) -> Change:
    """Return the change that puts the gage at a lateral position [m]."""
    return lambda state: state.but(lateral=lateral)


def _rolling(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    changes: Changes,
    low_pass: LowPass,
    start: Start | None,
) -> Prediction:
    """Return what the rolling ring says of one gage."""
    found = solved(values, points, changes, low_pass=low_pass, start=start)
    by = slopes_of(found)
    return Prediction(
        found.waveform,
        found.waveform[:, None],
        by.waveform[0],
        by.waveform[1],
        found.deflection,
        by.deflection[0],
        found.rolling.on_turn(N_PHI).edges,
    )


def _linear(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    changes: Changes,
    low_pass: LowPass,
    start: Start | None,
) -> Prediction:
    """Return what the linear ring alone says of one gage."""
    n = len(points)
    three = points.tiled(3)
    load, pressure = three.load.copy(), three.pressure.copy()
    load[n : 2 * n] *= 1.0 + TRIAL
    pressure[2 * n :] *= 1.0 + TRIAL
    three = replace(three, load=load, pressure=pressure)
    state = predict(values, three, changes, low_pass=low_pass)
    wave, depth = state.wave.reshape(3, n, N_PHI), state.deflection.reshape(3, n)
    assert state.contact is not None  # noqa: S101 - the chain sets it
    return Prediction(
        wave[0],
        wave[0][:, None],
        (wave[1] - wave[0]) / TRIAL,
        (wave[2] - wave[0]) / TRIAL,
        depth[0],
        (depth[1] - depth[0]) / TRIAL,
        state.contact.edges[:n],
    )
