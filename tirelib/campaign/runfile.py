"""One run file to a Run: channels found by name, units by channel, signs to ISO."""

import math
import re
from pathlib import Path

import numpy as np

from tirelib.campaign.campaign_fault import CampaignFault, raise_errors
from tirelib.campaign.mdf import Channel, Group, read_mdf
from tirelib.campaign.model import CampaignHeader, FloatArray, Run, RunPlan
from tirelib.campaign.timebase import gage_time_problems, rig_time_problems
from tirelib.core.axes import sign
from tirelib.core.errors import FormatError, UnitError
from tirelib.core.units import dimension_of, dimensions_of_unit, to_si

_STRAIN = re.compile(r"strain_([1-9]\d*)")
_TRIGGER = "trigger"


def load_run(folder: Path, plan: RunPlan, header: CampaignHeader) -> Run:
    """Read the file of one run.

    Raises
    ------
    FormatError
        With every fault of the file: illegible, channels that are missing or too many, a channel
        without a unit or with a wrong one, a time base that is not the declared one.
    """
    run, problems = inspect_run(folder, plan, header)
    raise_errors(problems, prefix=f"{folder}/")
    if run is None:  # inspect_run gives an error whenever it gives no run
        raise FormatError(f"{folder}/{plan.file}: no run; a run file is needed; check the folder")
    return run


def inspect_run(
    folder: Path, plan: RunPlan, header: CampaignHeader
) -> tuple[Run | None, list[CampaignFault]]:
    """Read the file of one run and keep every fault instead of raising.

    Returns
    -------
    run : Run or None
        What could be read, without the channels that have a fault; None when nothing could.
    problems : list of CampaignFault
    """
    try:
        groups = read_mdf(folder / plan.file)
    except FormatError as error:
        return None, [CampaignFault.at(plan.file, fault) for fault in error.faults]
    file = _RunFile(plan, header)
    strain_group, rig_group = file.split(groups)
    strain = file.strain(strain_group) if strain_group else None
    start = file.gage_start(strain_group) if strain_group else 0.0
    trigger = file.trigger(strain_group) if strain_group else None
    rig_time = file.rig_times(rig_group) if rig_group else None
    rig, dimensions = file.rig(rig_group) if rig_group else ({}, {})
    run = Run(
        plan,
        strain,
        math.nan if strain is None else header.rate,
        start,
        None if trigger is None else trigger > 0.5,
        rig,
        rig_time,
        dimensions,
    )
    return run, file.problems


class _RunFile:
    """Converts the parts of one run file and keeps every fault."""

    def __init__(self, plan: RunPlan, header: CampaignHeader) -> None:
        self.plan = plan
        self.header = header
        self.problems: list[CampaignFault] = []

    def split(self, groups: list[Group]) -> tuple[Group | None, Group | None]:
        """Return the group at gage rate, if any, and the one at rig rate, if any."""
        groups = [group for group in groups if group.channels]
        gage = [g for g in groups if any(_STRAIN.fullmatch(c.name) for c in g.channels)]
        others = [g for g in groups if g not in gage]
        for several, what in ((gage, "strain"), (others, "rig quantities")):
            if len(several) > 1:
                self.fault(
                    "",
                    f"{what} are in {len(several)} groups",
                    "one group, one clock is allowed",
                    "bring them into one group with `tirelib import`",
                )
        if not groups:
            self.fault(
                "",
                "no channel with samples",
                "strain or rig quantities are needed",
                "export the recording again",
            )
        for group in (*gage[:1], *others[:1]):
            names = [channel.name for channel in group.channels]
            for name in sorted({n for n in names if names.count(n) > 1}):
                self.fault(
                    name, "the channel occurs twice", "each name may occur once", "rename one"
                )
        if gage and others:
            self.unread_at_gage_rate(gage[0])
        if not gage or others:
            return (gage[0] if gage else None), (others[0] if others else None)
        rest = tuple(c for c in gage[0].channels if not _is_gage(c))  # all at one rate
        return gage[0], Group(gage[0].index, gage[0].time, rest) if rest else None

    def unread_at_gage_rate(self, group: Group) -> None:
        """Warn of channels beside the strain that have no place in a Run."""
        self.problems += [
            CampaignFault(
                f"{self.plan.file}, channel {channel.name}",
                "it is recorded at the rate of the gages, so it is left out",
                "only strain_N and trigger belong there; rig quantities need their own group",
                "move it to the rig's group or drop it",
                "warning",
            )
            for channel in group.channels
            if not _is_gage(channel)
        ]

    def strain(self, group: Group) -> FloatArray | None:
        """Return the strain, shape (n_gages, n_samples), in the order of the gages' numbers."""
        numbered = {
            int(match[1]): channel
            for channel in group.channels
            if (match := _STRAIN.fullmatch(channel.name))
        }
        count = len(self.header.gage_lateral)
        if sorted(numbered) != list(range(1, count + 1)):
            given = ", ".join(f"strain_{n}" for n in sorted(numbered))
            self.fault(
                "",
                f"{len(numbered)} strain channels ({given})",
                f"[gages] lateral_m declares {count}, strain_1 to strain_{count}",
                "correct lateral_m in campaign.toml or the recording",
            )
        rows = [self.strain_row(numbered[number]) for number in sorted(numbered)]
        whole = [row for row in rows if row is not None]
        return np.stack(whole) if whole and len(whole) == len(rows) else None

    def strain_row(self, channel: Channel) -> FloatArray | None:
        """Return one gage's strain; its unit must be the declared one."""
        row = self.si(channel, "strain")
        if row is None:
            return None
        declared = self.header.strain_unit
        if to_si(1.0, channel.unit, "strain") != to_si(1.0, declared, "strain"):
            self.fault(
                channel.name,
                f"its unit is {channel.unit!r}",
                f"campaign.toml declares {declared!r}",
                "correct the one that is wrong",
            )
        return row

    def gage_start(self, group: Group) -> float:
        """Check the clock of the gages and return its first reading."""
        if group.time is None:
            self.fault(
                "",
                "the strain has no time channel",
                "a time channel in s is needed",
                "export it with its master channel",
            )
            return 0.0
        times = self.si(group.time, "time")
        if times is None or not self.header.gage_lateral:
            return 0.0
        self.problems += gage_time_problems(self.plan.file, times, self.header.rate)
        return float(times[0]) if times.size else 0.0

    def trigger(self, group: Group) -> FloatArray | None:
        """Return the trigger as numbers, or None when the recording has none."""
        for channel in group.channels:
            if channel.name == _TRIGGER:
                return self.si(channel, "ratio")
        return None

    def rig_times(self, group: Group) -> FloatArray | None:
        """Return the times of the rig's samples, strictly growing."""
        if group.time is None:
            self.fault(
                "",
                "the rig quantities have no time channel",
                "a time channel in s is needed",
                "export it with its master channel",
            )
            return None
        times = self.si(group.time, "time")
        if times is not None and not any(_is_gage(channel) for channel in group.channels):
            self.problems += rig_time_problems(self.plan.file, times)
        return times

    def rig(self, group: Group) -> tuple[dict[str, FloatArray], dict[str, str]]:
        """Return the rig quantities in SI and ISO, and the dimensions of the unknown names."""
        values: dict[str, FloatArray] = {}
        dimensions: dict[str, str] = {}
        for channel in group.channels:
            dimension = dimension_of(channel.name)
            if dimension is None:
                found = dimensions_of_unit(channel.unit)
                if not found or channel.samples.dtype.kind not in "biuf":
                    self.unread(channel)
                    continue
                dimension = dimensions[channel.name] = found[0]
            samples = self.si(channel, dimension)
            if samples is not None:
                values[channel.name] = sign(channel.name, self.header.axes) * samples
        return values, dimensions

    def unread(self, channel: Channel) -> None:
        """Note a channel that is neither known by name nor by unit."""
        if not channel.unit.strip() and channel.samples.dtype.kind in "biuf":
            self.fault(
                channel.name,
                "the channel has no unit",
                "each channel carries its own",
                "add it in the recording",
            )
            return
        self.problems.append(
            CampaignFault(
                f"{self.plan.file}, channel {channel.name}",
                f"its unit {channel.unit!r} is unknown, so the channel is left out",
                "a unit of tirelib.core.units is needed",
                "convert it or drop the channel",
                "warning",
            )
        )

    def si(self, channel: Channel, dimension: str) -> FloatArray | None:
        """Return a channel's samples in SI, or None after noting what is wrong."""
        if channel.samples.dtype.kind not in "biuf" or channel.samples.ndim != 1:
            self.fault(
                channel.name,
                f"its samples are of type {channel.samples.dtype}",
                "one number a sample is needed",
                "export it as a number",
            )
            return None
        if not channel.unit.strip():
            self.fault(
                channel.name,
                "the channel has no unit",
                "each channel carries its own",
                "add it in the recording",
            )
            return None
        try:
            return to_si(channel.samples.astype(np.float64), channel.unit, dimension)
        except UnitError as error:
            for fault in error.faults:
                self.fault(channel.name, fault.given, fault.allowed, fault.remedy)
            return None

    def fault(self, channel: str, given: str, allowed: str, remedy: str) -> None:
        where = f"{self.plan.file}, channel {channel}" if channel else self.plan.file
        self.problems.append(CampaignFault(where, given, allowed, remedy))


def _is_gage(channel: Channel) -> bool:
    return channel.name == _TRIGGER or _STRAIN.fullmatch(channel.name) is not None
