"""What an import map says: which column is which quantity, in which unit and axes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.importing.defects import Defects
from tirelib.campaign.importing.delimited import CsvOptions
from tirelib.campaign.importing.mapheader import GAGE_TIME
from tirelib.campaign.model import CampaignHeader
from tirelib.core.units import dimension_of


@dataclass(frozen=True, slots=True)
class ChannelRule:
    """How a column becomes a quantity: ``sign * factor * column + offset``, in `unit`.

    Attributes
    ----------
    quantity : str
        Its name as campaign files have it. ``time`` and ``gage_time`` are the two clocks.
    column : str
        Empty for a clock that has a `rate` instead.
    unit : str
        Empty when the file itself states it.
    factor, offset : float
        `factor` includes the sign.
    rate : float, [Hz]
        Sample rate of a clock without a column, else NaN.
    override : bool
        `unit` holds even where the file states another one.
    """

    quantity: str
    column: str
    unit: str
    factor: float = 1.0
    offset: float = 0.0
    rate: float = math.nan
    override: bool = False

    @property
    def converts(self) -> bool:
        """Whether the unit is not that of the column as it stands in the file."""
        return self.override or abs(self.factor) != 1.0 or self.offset != 0.0

    @property
    def dimension(self) -> str:
        """Dimension of the quantity."""
        if self.quantity == GAGE_TIME:
            return "time"
        return dimension_of(self.quantity) or ""


@dataclass(frozen=True, slots=True)
class SetPointRule:
    """Where a set point comes from, in the unit of its column in ``runs.csv``.

    Attributes
    ----------
    value : float
        The same for all runs; NaN when it comes from elsewhere.
    column, unit : str
        A column of the file that is constant within a run.
    mean_to : float
        The run's mean, rounded to a multiple of this; NaN when not used.
    """

    value: float = math.nan
    column: str = ""
    unit: str = ""
    mean_to: float = math.nan


@dataclass(frozen=True, slots=True)
class RunEntry:
    """What the map says of one run: a kind, set points, start, further conditions."""

    kind: str
    points: Mapping[str, float]
    start: float | None
    extra: Mapping[str, float | str]
    skip: bool


@dataclass(frozen=True, slots=True)
class ImportMap:
    """An import map.

    Attributes
    ----------
    file : str
        The map's own file, for messages.
    header : CampaignHeader
        With NaN for a rate that the map leaves to the time column.
    kind : str
        Kind of the runs that have no entry of their own.
    run_column : str
        Empty: each file is a run.
    channels : mapping of quantity to ChannelRule
    set_points : mapping of column of ``runs.csv`` to SetPointRule
    runs : mapping of run number to RunEntry
    csv : CsvOptions
    defects : Defects
        What is done with defects of the recordings.
    warnings : tuple of CampaignFault
    sound : bool
        False when the map has a fault; then axes and set points mean nothing.
    """

    file: str
    header: CampaignHeader
    kind: str
    run_column: str
    channels: Mapping[str, ChannelRule]
    set_points: Mapping[str, SetPointRule]
    runs: Mapping[int, RunEntry]
    csv: CsvOptions
    defects: Defects
    warnings: tuple[CampaignFault, ...] = ()
    sound: bool = True
