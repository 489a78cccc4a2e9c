"""Forces and their conditions from campaigns: run means of steady runs, samples of sweeps."""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from tirelib.campaign import Campaign, Run
from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError, ParameterError, ShapeError

FORCES = ("Fy", "Fx", "Mz")
CONDITIONS = ("load", "pressure", "slip_angle", "slip_ratio", "camber", "omega")
FREE_ROLLING = ("free", "corner", "camber")
"""Kinds of runs without drive or brake: their slip ratio is zero by definition."""
_MEASURED_AS = {"load": "Fz"}
TEMPERATURES = ("tread_temperature", "temperature", "tire_temperature")
"""Channels that tell the tread's temperature; the first that was recorded counts."""
BLOCK = 10.0
"""Stretch of a sweep over which errors are taken to go together, [s]."""
_ABSENT: FloatArray = np.empty(0)
"""Stands for a field that is not given."""


def _absent() -> Any:
    return _ABSENT


@dataclass(frozen=True, slots=True, eq=False)
class ForceData:
    """Points with forces; arrays of shape (n,), SI, ISO; what is not given is zero or unknown.

    Attributes
    ----------
    load, pressure, slip_angle, slip_ratio, camber, omega : [N], [Pa], [rad], [-], [rad], [rad/s]
        As measured, else the set point. Pressure and omega are NaN where unknown. The slip ratio
        is that of the speed in the wheel's plane.
    Fx, Fy, Mz : [N], [N], [N m]
        NaN where not recorded.
    block : array of int
        Points of one run, or of one stretch of a sweep: their errors may go together. By default
        each point has a block of its own.
    speed, temperature, time : [m/s], [K], [s]
        Speed of the road, temperature of the tread, time since the campaign began; NaN if unknown.
    """

    load: FloatArray
    pressure: FloatArray
    slip_angle: FloatArray
    slip_ratio: FloatArray = field(default_factory=_absent)
    camber: FloatArray = field(default_factory=_absent)
    omega: FloatArray = field(default_factory=_absent)
    Fx: FloatArray = field(default_factory=_absent)
    Fy: FloatArray = field(default_factory=_absent)
    Mz: FloatArray = field(default_factory=_absent)
    block: IntArray = field(default_factory=_absent)
    speed: FloatArray = field(default_factory=_absent)
    temperature: FloatArray = field(default_factory=_absent)
    time: FloatArray = field(default_factory=_absent)

    def __post_init__(self) -> None:
        for name in (f.name for f in fields(self) if getattr(self, f.name) is _ABSENT):
            size = np.shape(self.load)
            blank = np.full(size, 0.0 if name in ("slip_ratio", "camber") else np.nan)
            object.__setattr__(self, name, np.arange(*size) if name == "block" else blank)
        shapes = {np.shape(getattr(self, f.name)) for f in fields(self)}
        if len(shapes) != 1 or len(shapes.pop()) != 1:
            raise ShapeError(
                "force data: the fields differ in shape or have several dimensions; give each "
                "one value per point, shape (n,)"
            )
        for name in ("load", "slip_angle", "slip_ratio", "camber"):
            value = getattr(self, name)
            good = np.isfinite(value) & ((value > 0.0) if name == "load" else True)
            if not good.all():
                at = int(np.flatnonzero(~good)[0])
                raise ParameterError(
                    f"force data: {name} = {value[at]:.6g} at point {at}, {int((~good).sum())} "
                    f"such points; allowed are finite numbers{', > 0' * (name == 'load')}; "
                    "leave these points out"
                )

    def __len__(self) -> int:
        return int(self.load.size)

    def take(self, index: IntArray | BoolArray) -> "ForceData":
        """Return some of the points."""
        return ForceData(*(getattr(self, f.name)[index] for f in fields(self)))


def force_data(campaign: Campaign, *, travel_speed: bool = False) -> ForceData:
    """Read the forces of a campaign.

    Steady runs give one point each, the mean of their samples; a sweep gives its samples. Points
    without slip angle or with a load that is not positive are left out, a missing slip ratio or
    camber counts as zero.

    Parameters
    ----------
    travel_speed : bool
        True if the recorded slip ratio is by the speed of travel, v, and not by v cos(alpha): a
        freely rolling wheel then reads cos(alpha) - 1. Runs of freely rolling kinds read zero
        either way.

    Raises
    ------
    CalibrationError
        If there is no point at all.
    """
    parts: list[ForceData] = []
    count = 0
    for run in campaign.runs():
        part = _read(run)
        if part is None:
            continue
        if run.plan.kind in FREE_ROLLING:
            part["slip_ratio"] = np.zeros_like(part["load"])
        elif travel_speed:
            part["slip_ratio"] = (1.0 + part["slip_ratio"]) / np.cos(part["slip_angle"]) - 1.0
        block = (part["block"] - part["block"].min() + count).astype(np.int64)
        count = int(block.max()) + 1
        parts.append(ForceData(**(part | {"block": block})))
    if not parts:
        raise CalibrationError(
            f"{campaign.header.name}: no run holds a slip angle with a vertical load; forces over "
            "slip are needed; record Fz and slip_angle"
        )
    return ForceData(
        **{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(ForceData)}
    )


def _read(run: Run) -> dict[str, FloatArray] | None:
    """Return the means of a steady run or the samples of a sweep, None without load or slip angle.

    What was not recorded is the set point.
    """
    swept = run.plan.kind == "sweep"
    time = run.rig_time if swept else np.zeros(1)
    if time is None or time.size == 0:
        return None

    def told(channel: str, given: float) -> FloatArray:
        samples = run.rig.get(channel)
        if samples is None or samples.size == 0:
            return np.full(time.size, given)
        return samples if swept else np.array([samples.mean()])

    out = {
        name: told(_MEASURED_AS.get(name, name), getattr(run.plan, name, np.nan))
        for name in CONDITIONS + FORCES
    }
    out["speed"] = told("speed", run.plan.speed)
    known = [name for name in TEMPERATURES if name in run.rig]
    out["temperature"] = told(next(iter(known), ""), np.nan)
    start = run.plan.start
    out["time"] = (start or 0.0) + time - time[0]
    if not swept and start is None:
        out["time"] = np.full(1, np.nan)
    for name in ("slip_ratio", "camber"):
        out[name] = np.nan_to_num(out[name])
    out["block"] = np.floor((time - time[0]) / BLOCK)
    keep = np.isfinite(out["slip_angle"]) & np.isfinite(out["load"]) & (out["load"] > 0.0)
    return {name: values[keep] for name, values in out.items()} if keep.any() else None
