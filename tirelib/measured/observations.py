"""Observations of a campaign: the features of every turn, with the values that the rig measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from tirelib.campaign import Campaign, CampaignHeader, Run, conditions_of
from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.core.flags import INVALIDATING
from tirelib.core.sizes import differing
from tirelib.measured.features import Features, RecordReader
from tirelib.measured.signal import LowPass

TRUTH = ("Fx", "Fy", "Fz", "Mz", "slip_angle", "slip_ratio")
"""Rig quantities that an estimate is held against."""
ROAD = ("friction", "tread_depth", "tread_temperature")
"""Conditions of road and tread that a plan may state."""
SET_POINTS = ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio")
"""Nominal conditions of a run."""
BLOCK = 10
"""Turns of a sweep that are held out together in a cross-validation."""


@dataclass(frozen=True, slots=True)
class Observations:
    """Turns of one or several campaigns of one tire and gage layout.

    Attributes
    ----------
    features : Features
        Features of all turns, run after run.
    run : array of int, shape (n,)
        Run number of each turn.
    campaign : array of int, shape (n,)
        Index of the campaign that a turn comes from.
    group : array of int, shape (n,)
        Turns measured at the same nominal condition, or in the same block of a sweep.
    sweep : array of bool, shape (n,)
        True where the conditions change within the run.
    truth : dict of arrays, shape (n,), SI, ISO
        What the rig measured: mean of the run, in a sweep of a turn about the contact; NaN where
        absent.
    nominal : dict of arrays, shape (n,), SI, ISO
        Set points, NaN in a sweep; friction, tread depth and tread temperature where given.
    headers : tuple of CampaignHeader
    """

    features: Features
    run: IntArray
    campaign: IntArray
    group: IntArray
    sweep: BoolArray
    truth: dict[str, FloatArray]
    nominal: dict[str, FloatArray]
    headers: tuple[CampaignHeader, ...]

    def __len__(self) -> int:
        return int(self.run.shape[0])

    @property
    def usable(self) -> BoolArray:
        """Turns without a flag that forbids any estimate, shape (n,)."""
        return np.asarray((self.features.flags & int(INVALIDATING)) == 0, dtype=np.bool_)

    @property
    def unit(self) -> IntArray:
        """Number of the independent measurement of each turn: its run, or itself in a sweep."""
        key = np.stack((self.campaign, self.run, np.where(self.sweep, np.arange(len(self)), -1)))
        return np.asarray(np.unique(key, axis=1, return_inverse=True)[1], dtype=np.int64).ravel()


def measure_run(
    run: Run, header: CampaignHeader, low_pass: LowPass | None = None
) -> tuple[Features, dict[str, FloatArray]]:
    """Return the features of a run's turns and the rig's measurements for each of them."""
    reader = RecordReader(header.gage_lateral, low_pass)
    truth = _read(reader, run, header)
    return reader.features(), truth


def _read(reader: RecordReader, run: Run, header: CampaignHeader) -> dict[str, FloatArray]:
    """Let the reader take a run; return the rig's measurements for each of its turns."""
    if run.strain is None:
        raise CalibrationError(
            f"{header.name}, run {run.plan.run}: the file holds no strain; "
            "strain_1 .. strain_N are needed"
        )
    held: Any = conditions_of(run, run.time())
    time, omega = reader.add(
        run.strain, run.rate, trigger=run.trigger, start=run.start_time, **held
    )
    return {name: truth_of(run, name, time, omega) for name in TRUTH}


def truth_of(run: Run, name: str, time: FloatArray, omega: FloatArray) -> FloatArray:
    """Rig quantity for each turn: mean over the run; in a sweep, over a turn about the contact."""
    n = time.size
    samples, clock = run.rig.get(name), run.rig_time
    if samples is None or clock is None or samples.size == 0:
        return np.full(n, np.nan)
    known = np.isfinite(samples)
    if not known.any():
        return np.full(n, np.nan)
    if run.plan.kind != "sweep":
        return np.full(n, float(samples[known].mean()))
    total = np.concatenate(([0.0], np.cumsum(np.where(known, samples, 0.0))))
    count = np.concatenate(([0], np.cumsum(known)))
    half = np.pi / np.where(omega > 0.0, omega, np.inf)
    start = np.searchsorted(clock, time - half)
    stop = np.searchsorted(clock, time + half)
    held = count[stop] - count[start]
    mean = (total[stop] - total[start]) / np.maximum(held, 1)
    return np.asarray(np.where(held > 0, mean, np.nan), dtype=np.float64)


def observe(
    campaigns: Sequence[Campaign],
    *,
    low_pass: LowPass | None = None,
    progress: Callable[[str], None] | None = None,
) -> Observations:
    """Read campaigns of one tire and gage layout into observations.

    Parameters
    ----------
    campaigns : sequence of Campaign
    low_pass : LowPass, optional
    progress : callable, optional
        Called with a label after each run.

    Raises
    ------
    CalibrationError
        If the campaigns are of different tires or gage layouts, or hold no complete turn.
    """
    same_tire([campaign.header for campaign in campaigns])
    reader = RecordReader(campaigns[0].header.gage_lateral, low_pass)
    columns: dict[str, list[FloatArray]] = {name: [] for name in TRUTH}
    points = (*SET_POINTS, *ROAD)
    plans: dict[str, list[FloatArray]] = {name: [] for name in points}
    numbers: list[FloatArray] = []
    for index, campaign in enumerate(campaigns):
        for run in campaign.runs():
            truth = _read(reader, run, campaign.header)
            n = len(truth["Fz"])
            for name in TRUTH:
                columns[name].append(truth[name])
            for name in points:
                plans[name].append(np.full(n, getattr(run.plan, name)))
            sweep = run.plan.kind == "sweep"
            block = np.arange(n) // BLOCK if sweep else np.zeros(n)
            numbers.append(
                np.stack((np.full(n, run.plan.run), np.full(n, index), np.full(n, sweep), block))
            )
            if progress is not None:
                progress(f"{campaign.header.name} run {run.plan.run}")
    if not any(part.size for part in columns["Fz"]):
        raise CalibrationError(
            f"{', '.join(c.header.name for c in campaigns)}: no contact was found in any run; "
            "look at the strain with `tirelib campaign show`"
        )
    number = np.concatenate(numbers, axis=1)
    nominal = {name: np.concatenate(values) for name, values in plans.items()}
    sweep_mask = number[2] > 0
    key = np.stack([np.nan_to_num(nominal[name], nan=-9e9) for name in points])
    own = np.where(sweep_mask, 1 + number[0] * 1e6 + number[1] * 1e4 + number[3], 0.0)
    group = np.unique(np.vstack((key, own)), axis=1, return_inverse=True)[1].ravel()
    return Observations(
        features=reader.features(),
        run=number[0].astype(np.int64),
        campaign=number[1].astype(np.int64),
        group=np.asarray(group, dtype=np.int64),
        sweep=sweep_mask,
        truth={name: np.concatenate(values) for name, values in columns.items()},
        nominal=nominal,
        headers=tuple(campaign.header for campaign in campaigns),
    )


def same_tire(headers: Sequence[CampaignHeader]) -> None:
    """Refuse campaigns that one calibration cannot serve.

    Raises
    ------
    CalibrationError
        Naming the first difference in tire or gage layout.
    """
    first = headers[0]
    for other in headers[1:]:
        if other.tire.name != first.tire.name:
            raise CalibrationError(
                f"{other.name}: tire {other.tire.name!r} is not {first.tire.name!r} of "
                f"{first.name}; a calibration holds for one tire; calibrate them separately"
            )
        for name, given, known in differing(geometry_of(other), geometry_of(first)):
            raise CalibrationError(
                f"{other.name}: {name} of the tire is {1e3 * given:g} mm, of that of {first.name} "
                f"{1e3 * known:g} mm; a calibration holds for one tire; calibrate them separately, "
                "or mend campaign.toml"
            )
        if not same_layout(other.gage_lateral, first.gage_lateral):
            raise CalibrationError(
                f"{other.name}: gages at {other.gage_lateral} m, {first.name} has them at "
                f"{first.gage_lateral} m; one calibration needs one layout"
            )


def geometry_of(header: CampaignHeader) -> dict[str, float]:
    """Return the dimensions of the tire that a header gives, [m]."""
    size = {f.name: getattr(header.tire, f.name) for f in fields(header.tire) if f.name != "name"}
    return {name: float(x) for name, x in size.items() if x is not None}


def same_layout(a: Sequence[float], b: Sequence[float]) -> bool:
    """Tell whether two gage layouts are equal within a tenth of a millimetre."""
    return len(a) == len(b) and bool(np.allclose(a, b, atol=1e-4))


def mean_by(unit: IntArray, values: FloatArray, rows: BoolArray) -> FloatArray:
    """Return the mean of `values` over the chosen rows of each unit, in the order of the units."""
    chosen = unit[rows]
    count = np.bincount(chosen)
    total = np.bincount(chosen, weights=values[rows])
    return np.asarray(total[count > 0] / count[count > 0], dtype=np.float64)
