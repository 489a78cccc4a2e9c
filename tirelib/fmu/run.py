"""Play a campaign to an FMU with FMPy, and collect its outputs in the form of the batch."""

import math
import shutil
from collections.abc import Callable, Iterator, Mapping
from ctypes import Array, c_double, c_uint32
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.campaign import Campaign, Run, conditions_of
from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError, FormatError
from tirelib.core.flags import INVALIDATING, flag_names
from tirelib.core.held import HELD
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.fmu.build import embedded_calibration
from tirelib.measured.features.extract import Features
from tirelib.measured.observations import SET_POINTS, TRUTH, Observations, geometry_of, truth_of


def keeping(messages: list[str]) -> Any:
    """Return callbacks for ``FMU2Slave.instantiate`` that keep what the FMU logs.

    A message is a printf format without arguments here, so that two percent signs mean one. FMPy's
    ``addLoggerProxy`` would print it, but knows one logger in a process: that of the last instance.
    """
    from fmpy import calloc, free
    from fmpy.fmi2 import (
        fmi2CallbackAllocateMemoryTYPE,
        fmi2CallbackFreeMemoryTYPE,
        fmi2CallbackFunctions,
        fmi2CallbackLoggerTYPE,
    )

    def keep(_: Any, __: Any, ___: Any, ____: Any, message: bytes) -> None:
        messages.append(message.decode("utf-8", "replace").replace("%%", "%"))

    found = fmi2CallbackFunctions()
    found.logger = fmi2CallbackLoggerTYPE(keep)
    found.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    found.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    return found


def runs_with(name: str) -> bool:
    """Return whether an FMU runs with a file of its archive; it does without sources and pages."""
    return name.split("/")[0] in ("modelDescription.xml", "binaries", "resources")


class LoadedFmu:
    """One instance of a ``StrainTire.fmu`` in FMPy; use it in a ``with`` block.

    `messages` are those since the last start, `told` the first of each kind in a campaign that was
    played, with its run.

    Raises
    ------
    FormatError
        If the file is no such FMU.
    """

    def __init__(self, path: str | Path, *, name: str = "wheel") -> None:
        try:
            from fmpy import extract, read_model_description
            from fmpy.fmi2 import FMU2Slave
        except ModuleNotFoundError as error:
            raise FormatError(
                f"fmu run: the package {error.name}, which steps the FMU, is not installed; "
                "install it with pip install 'tirelib[fmu]'"
            ) from None
        self.path = Path(path)
        self.calibration = embedded_calibration(path)
        self.messages: list[str] = []
        self.told: dict[str, str] = {}
        try:
            description = read_model_description(str(path))
        except Exception as error:  # FMPy raises bare exceptions
            raise FormatError(f"{path}: is not an FMU ({error}); build it again") from None
        if not description.fmiVersion.startswith("2"):
            raise FormatError(
                f"{path}: is an FMU of FMI {description.fmiVersion}; this command steps FMI 2.0; "
                "build it without --fmi 3, or check it with `tirelib fmu check`"
            )
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        strains = [name for name in self.references if name.startswith("strain_")]
        self.samples = len(strains) // len(self.calibration.lateral)
        try:
            self._folder = extract(str(path), include=runs_with)
        except Exception as error:  # of zipfile, and FMPy's bare ones
            raise FormatError(
                f"{path}: cannot be unpacked ({error}); the file is damaged: copy or build it again"
            ) from None
        self.slave: Any = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self._folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        try:
            self.slave.instantiate(loggingOn=True, callbacks=keeping(self.messages))
        except Exception as error:  # FMPy raises bare exceptions
            shutil.rmtree(self._folder, ignore_errors=True)
            raise FormatError(
                f"{path}: cannot be instantiated: {'; '.join(self.messages) or error}"
            ) from None
        self._frame = self._buffer(*strains, *HELD)
        self.buffered = "samples" in self.references

    def __enter__(self) -> "LoadedFmu":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the instance and the files that were unpacked."""
        self.slave.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _buffer(self, *names: str) -> tuple[Array[c_uint32], int, Array[c_double]]:
        references = (c_uint32 * len(names))(*(self.references[name] for name in names))
        return references, len(names), (c_double * len(names))()

    def start(self, rate: float, **texts: str) -> None:
        """Reset, set the parameters and initialise; `texts` are the String parameters.

        Raises
        ------
        FormatError
            With what the FMU says, if it refuses.
        """
        self.slave.reset()
        self.messages.clear()
        try:
            self.slave.setupExperiment(startTime=0.0)
            self.slave.setReal([self.references["sample_rate"]], [rate])
            for name, text in texts.items():
                self.slave.setString([self.references[name]], [text])
            self.slave.enterInitializationMode()
            self.slave.exitInitializationMode()
        except Exception as error:
            causes = [text for text in self.messages if not text.startswith("Fatal py")]
            raise FormatError(
                f"{self.path}: refuses its parameters: {'; '.join(causes) or error}"
            ) from None
        self.rate = rate
        self.count = 0

    def step(self, frame: FloatArray, conditions: FloatArray) -> None:
        """Set a frame, shape (n_gages, n), n up to `samples`, with what `HELD` names, and step."""
        references, size, values = self._frame
        view = np.ctypeslib.as_array(values)
        view[: frame.size] = frame.T.ravel()
        view[-len(HELD) :] = conditions
        self.slave.fmi2SetReal(self.slave.component, references, size, values)
        n = frame.shape[1]
        if self.buffered:
            self.slave.setInteger([self.references["samples"]], [n])
        self.slave.doStep(self.count / self.rate, n / self.rate)
        self.count += n

    def reals(self, *names: str) -> list[float]:
        """Return Real variables."""
        return list(self.slave.getReal([self.references[name] for name in names]))

    def read(self) -> dict[str, Any]:
        """Return all outputs by name."""
        gages = range(1, len(self.calibration.lateral) + 1)
        reals = (
            *QUANTITIES,
            *(f"{quantity}_std" for quantity in QUANTITIES),
            *(f"contact_length_{gage}" for gage in gages),
            *(f"contact_length_std_{gage}" for gage in gages),
            "rolling_radius",
            "turn_rate",
            "contact_time",
            "age",
        )
        booleans = ("valid", *(f"{quantity}_valid" for quantity in QUANTITIES))
        values: dict[str, Any] = dict(zip(reals, self.reals(*reals), strict=True))
        slave, at = self.slave, self.references
        values |= zip(booleans, map(bool, slave.getBoolean([at[n] for n in booleans])), strict=True)
        values |= zip(("turn", "flags"), slave.getInteger([at["turn"], at["flags"]]), strict=True)
        texts = slave.getString([at["rolling"], at["status"]])
        values |= zip(("rolling", "status"), (text.decode() for text in texts), strict=True)
        return values


def play_run(fmu: LoadedFmu, run: Run) -> Iterator[dict[str, Any]]:
    """Yield the outputs at every turn of a run, with ``ready``, the time it was ready at, [s].

    A frame ends early where a condition changes within it, so that each sample meets the
    conditions that it meets in the batch.

    Raises
    ------
    FormatError
        If two turns end within one frame.
    """
    if run.strain is None:
        raise CalibrationError(
            f"run {run.plan.run}: the file holds no strain; strain_1 .. strain_N are needed"
        )
    times = run.time()
    table = np.stack(list(conditions_of(run, times).values()))
    fmu.start(run.rate)
    turns = 0
    turn = [fmu.references["turn"]]
    for part in _frames(table, fmu.samples):
        fmu.step(run.strain[:, part], table[:, part.start])
        now = fmu.slave.getInteger(turn)[0]
        if now == turns:
            continue
        if now > turns + 1:
            raise FormatError(
                f"run {run.plan.run}: {now - turns} turns end within one frame of {fmu.samples} "
                f"samples at {run.rate:g} Hz; build the FMU with fewer samples per step"
            )
        turns = now
        values = fmu.read()
        yield values | {"ready": fmu.count / run.rate - values["age"]}


def _frames(conditions: FloatArray, samples: int) -> Iterator[slice]:
    """Cut samples into frames within which the conditions, shape (k, n), are constant."""
    before, after = conditions[:, :-1], conditions[:, 1:]
    changed = ((before != after) & ~(np.isnan(before) & np.isnan(after))).any(axis=0)
    borders = [0, *(np.flatnonzero(changed) + 1).tolist(), conditions.shape[1]]
    for start, stop in pairwise(borders):
        for first in range(start, stop, samples):
            yield slice(first, min(first + samples, stop))


def play_campaign(
    fmu: LoadedFmu, campaign: Campaign, progress: Callable[[str], None] | None = None
) -> tuple[Observations, Estimates]:
    """Play every run and return turns and estimates as `observe` and `Calibration.estimate` do.

    Features that an FMU does not put out are NaN.

    Raises
    ------
    CalibrationError
        If tire or gage layout are not those of the FMU, or no contact is found.
    """
    header = campaign.header
    fmu.calibration.check_layout(
        header.tire.name, header.gage_lateral, str(fmu.path), geometry_of(header)
    )
    rows: list[dict[str, Any]] = []
    truth: dict[str, list[FloatArray]] = {name: [] for name in TRUTH}
    for run in campaign.runs():
        found = list(play_run(fmu, run))
        for text in fmu.messages:
            fmu.told.setdefault(text.split(":")[0], f"run {run.plan.run}: {text}")
        for values in found:
            values["contact_time"] += run.start_time
            values["ready"] += run.start_time
            values["plan"] = run.plan
        features = _features(found, fmu.calibration)
        for name in TRUTH:
            truth[name].append(truth_of(run, name, features.time, features.omega))
        rows += found
        if progress is not None:
            progress(f"{header.name} run {run.plan.run}")
    if not rows:
        raise CalibrationError(
            f"{header.name}: no contact was found in any run; view the strain with `tirelib "
            "campaign show`"
        )
    plans = [row["plan"] for row in rows]
    observations = Observations(
        features=_features(rows, fmu.calibration),
        run=np.array([plan.run for plan in plans], dtype=np.int64),
        campaign=np.zeros(len(rows), dtype=np.int64),
        group=np.arange(len(rows)),
        sweep=np.array([plan.kind == "sweep" for plan in plans]),
        truth={name: np.concatenate(values) for name, values in truth.items()},
        nominal={name: np.array([getattr(plan, name) for plan in plans]) for name in SET_POINTS},
        headers=(header,),
    )
    return observations, _estimates(rows, fmu.calibration)


def _column(rows: list[dict[str, Any]], name: str) -> FloatArray:
    return np.array([row[name] for row in rows], dtype=np.float64)


def _features(rows: list[dict[str, Any]], calibration: Calibration) -> Features:
    """Return features of which only times, turn rate and flags are known."""
    per_gage = np.full((len(rows), len(calibration.lateral)), np.nan)
    values: dict[str, Any] = {field.name: per_gage for field in fields(Features)}
    per_turn = np.full(len(rows), np.nan)
    unknown = (
        "speed",
        "pressure",
        "camber",
        "axis_shift",
        "friction",
        "tread_depth",
        "tread_temperature",
        "angle_std",
        "slip_std",
    )
    values |= dict.fromkeys(unknown, per_turn)
    omega = _column(rows, "turn_rate")
    values |= {
        "time": _column(rows, "contact_time"),
        "ready": _column(rows, "ready"),
        "omega": omega,
        "period": 2.0 * math.pi / omega,
        "flags": _column(rows, "flags").astype(np.int64),
        "gage_flags": np.zeros(per_gage.shape, dtype=np.int64),
        "lateral": np.array(calibration.lateral),
    }
    return Features(**values)


def _estimates(rows: list[dict[str, Any]], calibration: Calibration) -> Estimates:
    def is_valid(name: str) -> BoolArray:
        return np.array([row[name] for row in rows], dtype=np.bool_)

    gages = range(1, len(calibration.lateral) + 1)
    return Estimates(
        value={quantity: _column(rows, quantity) for quantity in QUANTITIES},
        std={quantity: _column(rows, f"{quantity}_std") for quantity in QUANTITIES},
        valid={quantity: is_valid(f"{quantity}_valid") for quantity in QUANTITIES},
        turn_valid=np.array([_turn_valid(row) for row in rows], dtype=np.bool_),
        flags=_column(rows, "flags").astype(np.int64),
        notes=tuple(_notes(row) for row in rows),
        rolling=tuple(row["rolling"] for row in rows),
        radius=_column(rows, "rolling_radius"),
        contact_length=np.stack([_column(rows, f"contact_length_{g}") for g in gages], axis=1),
        contact_length_std=np.stack(
            [_column(rows, f"contact_length_std_{g}") for g in gages], axis=1
        ),
    )


def _turn_valid(row: Mapping[str, Any]) -> bool:
    """Return the validity as in the batch, where one gage or the speed may be missing."""
    in_range = not any(note.endswith("_out_of_range") for note in _notes(row))
    return not row["flags"] & int(INVALIDATING) and in_range


def _notes(row: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the notes in the status beyond the flags."""
    names = set(flag_names(row["flags"]))
    return tuple(word for word in row["status"].split(";") if word and word not in names)
