"""Runs to a campaign folder, one run in memory at a time."""

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import tomli_w

from tirelib.campaign import header as header_file
from tirelib.campaign import plan as plan_file
from tirelib.campaign.mdf import Channel, Group, write_mdf
from tirelib.campaign.model import CampaignHeader, FloatArray, Run, RunPlan
from tirelib.core.axes import sign
from tirelib.core.documents import stamped
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.core.units import dimension_of, from_si

FIELD_UNITS = {
    "force": "N",
    "moment": "Nm",
    "angle": "deg",
    "ratio": "1",
    "speed": "km/h",
    "angular_speed": "rad/s",
    "pressure": "bar",
    "length": "mm",
    "temperature": "degC",
    "time": "s",
    "frequency": "Hz",
    "acceleration": "m/s2",
    "voltage": "V",
}
"""The unit that each dimension is written in."""


def write_campaign(
    path: str | Path,
    header: CampaignHeader,
    runs: Iterable[Run],
    *,
    axes: str | None = None,
    overwrite: bool = False,
) -> None:
    """Write ``campaign.toml``, ``runs.csv`` and one MDF 4.10 file a run.

    Everything that comes in is SI and ISO; the files get the signs of their axis system, the
    declared strain unit and `FIELD_UNITS`. Run files are named ``runs/NNN.mf4`` by run number,
    whatever ``plan.file`` says.

    Parameters
    ----------
    path : str or Path
        The folder; it is made.
    header : CampaignHeader
    runs : iterable of Run
        In order of measurement; taken one at a time.
    axes : str, optional
        Axis system of the files, default ``header.axes``.
    overwrite : bool
        Replace a campaign that is already there, its runs included.

    Raises
    ------
    ParameterError
        If a campaign is already there, a run number comes twice, or the axes are unknown.
    ShapeError
        If the arrays of a run do not match each other or the header.
    """
    folder = Path(path)
    header = header if axes is None else replace(header, axes=axes)
    sign("Fz", header.axes)  # an unknown axis system is refused before anything is written
    _make_room(folder, overwrite)
    plans: list[RunPlan] = []
    for run in runs:
        _check_run(run, header, plans)
        plan = replace(run.plan, file=f"runs/{run.plan.run:03d}.mf4")
        write_mdf(folder / plan.file, _groups(run, header))
        plans.append(plan)
    plan_file.write_plans(folder / plan_file.FILE, plans, header.axes)
    text = tomli_w.dumps(stamped(header_file.header_document(header)))
    (folder / header_file.FILE).write_text(text, encoding="utf-8")


def _make_room(folder: Path, overwrite: bool) -> None:
    """Make the folder; an old campaign in it goes only when that was asked for."""
    old = [folder / header_file.FILE, folder / plan_file.FILE, *folder.glob("runs/*.mf4")]
    old = [file for file in old if file.exists()]
    if old and not overwrite:
        raise ParameterError(
            f"{folder}: a campaign is already there ({old[0].name}); a new or empty folder is "
            "needed; name another one, remove it, or ask for overwrite"
        )
    for file in old:
        file.unlink()
    (folder / "runs").mkdir(parents=True, exist_ok=True)


def _check_run(run: Run, header: CampaignHeader, before: list[RunPlan]) -> None:
    where = f"run {run.plan.run}"
    if any(plan.run == run.plan.run for plan in before):
        raise ParameterError(f"{where} occurs twice; each run needs its own number; renumber one")
    if run.strain is not None:
        _check_strain(where, run, run.strain, header)
    elif run.trigger is not None:
        raise ShapeError(
            f"{where} has a trigger but no strain; a trigger needs strain; remove the trigger"
        )
    if run.rig and run.rig_time is None:
        raise ShapeError(
            f"{where} has rig quantities without rig_time; rig quantities need their "
            "times; add rig_time"
        )
    for name, samples in run.rig.items():
        if run.rig_time is not None and samples.shape != run.rig_time.shape:
            raise ShapeError(
                f"{where}: {name} has shape {samples.shape} but rig_time has {run.rig_time.shape}; "
                "both need the same; give each sample its time"
            )


def _check_strain(where: str, run: Run, strain: FloatArray, header: CampaignHeader) -> None:
    shape = strain.shape
    count = len(header.gage_lateral)
    if len(shape) != 2 or shape[0] != count:
        raise ShapeError(
            f"{where}: strain has shape {shape}; ({count}, n_samples) is needed, a row for each "
            "position of gage_lateral; correct one of them"
        )
    if run.trigger is not None and run.trigger.shape != shape[1:]:
        raise ShapeError(
            f"{where}: trigger has shape {run.trigger.shape}; {shape[1:]} is needed, as the "
            "strain has; give every sample its trigger"
        )
    if not math.isclose(run.rate, header.rate, rel_tol=1e-9):
        raise ParameterError(
            f"{where}: rate = {run.rate:g} Hz but the header has {header.rate:g} Hz; one campaign "
            "has one rate; resample or split the campaign"
        )


def _groups(run: Run, header: CampaignHeader) -> list[Group]:
    groups: list[Group] = []
    if run.strain is not None:
        rows = from_si(np.asarray(run.strain, np.float64), header.strain_unit, "strain")
        channels = [
            Channel(f"strain_{number}", header.strain_unit, row)
            for number, row in enumerate(rows, start=1)
        ]
        if run.trigger is not None:
            channels.append(Channel("trigger", "1", run.trigger.astype(np.uint8)))
        groups.append(Group(0, Channel("time", "s", run.time()), tuple(channels)))
    if run.rig and run.rig_time is not None:
        channels = [_rig_channel(run, name, header.axes) for name in run.rig]
        groups.append(Group(len(groups), Channel("time", "s", run.rig_time), tuple(channels)))
    return groups


def _rig_channel(run: Run, name: str, axes: str) -> Channel:
    dimension = dimension_of(name) or run.dimensions.get(name, "ratio")
    unit = FIELD_UNITS.get(dimension, "1")
    samples = np.asarray(run.rig[name], np.float64)
    return Channel(name, unit, from_si(sign(name, axes) * samples, unit, dimension))
