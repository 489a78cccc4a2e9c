"""Measured strain over the whole wheel turn, one mean waveform per run.

This is what a model is held against. Every run of constant conditions gives the mean of its turns,
filtered as everywhere (`LowPass`), over the wheel angle from the trigger, free of its mean over the
turn (which holds the gage's zero and the hoop strain of inflation and speed).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from tirelib.campaign import Campaign, CampaignHeader, Run
from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.core.flags import INVALIDATING
from tirelib.measured.signal import LowPass, Turns, cut_turns
from tirelib.measured.signal.lowpass import smooth_to_angle

N_PHI = 360
GRID = np.linspace(-np.pi, np.pi, N_PHI, endpoint=False)
"""Wheel angles of a waveform, [rad]; zero is the road's normal through the axle."""

CONDITIONS = (
    "Fz",
    "Fx",
    "Fy",
    "Mz",
    "pressure",
    "omega",
    "speed",
    "slip_angle",
    "camber",
    "slip_ratio",
    "loaded_radius",
)
"""Rig quantities of a run; the set point stands in where one was not recorded and has one."""
_SET_POINT = {
    "Fz": "load",
    "pressure": "pressure",
    "speed": "speed",
    "slip_angle": "slip_angle",
    "camber": "camber",
    "slip_ratio": "slip_ratio",
}


@dataclass(frozen=True, slots=True)
class Waveforms:
    """Mean waveforms of the runs of a campaign; arrays over runs, SI, ISO.

    Attributes
    ----------
    header : CampaignHeader
    strain : shape (n_runs, n_gages, n_phi), [-]
        Over `GRID`, mean over the turn removed. NaN where a gage is unusable.
    run : shape (n_runs,)
        Run numbers.
    turns : shape (n_runs,)
        Turns that were averaged.
    scatter : shape (n_runs,), [-]
        Rms scatter of single turns about the run's mean; NaN for one turn.
    angle_std : shape (n_runs,), [rad]
        Standard deviation of the angle's zero, from the trigger's resolution; infinite without.
    start : shape (n_runs,), [s]
        Start on the campaign's clock; run order where unknown.
    group : shape (n_runs,)
        Runs with equal set points have equal numbers.
    conditions : mapping of name to array (n_runs,)
        `CONDITIONS`; NaN where neither recorded nor set.
    extra : mapping of name to array (n_runs,)
        Further rig channels and numeric columns, as run means (temperatures and the like).
    low_pass : LowPass
    left_out : mapping of run number to str
        Runs without a waveform, and why.
    """

    header: CampaignHeader
    strain: FloatArray
    run: IntArray
    turns: IntArray
    scatter: FloatArray
    angle_std: FloatArray
    start: FloatArray
    group: IntArray
    conditions: Mapping[str, FloatArray]
    extra: Mapping[str, FloatArray]
    low_pass: LowPass
    left_out: Mapping[int, str]

    def __len__(self) -> int:
        return int(self.run.shape[0])

    def take(self, index: IntArray | BoolArray) -> "Waveforms":
        """Return some of the runs."""
        values: dict[str, object] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                values[field.name] = value[index]
            elif field.name in {"conditions", "extra"}:
                values[field.name] = {name: array[index] for name, array in value.items()}
        return replace(self, **values)  # type: ignore[arg-type]

    @property
    def straight(self) -> BoolArray:
        """Runs without slip angle, camber and slip ratio (set points), shape (n_runs,)."""
        c = self.conditions
        out: BoolArray = (
            (np.abs(np.nan_to_num(c["slip_angle"])) < np.deg2rad(0.25))
            & (np.abs(np.nan_to_num(c["camber"])) < np.deg2rad(0.25))
            & (np.abs(np.nan_to_num(c["slip_ratio"])) < 0.005)
        )
        return out


def measure_waveforms(
    campaign: Campaign,
    *,
    low_pass: LowPass | None = None,
    runs: Iterable[Run] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Waveforms:
    """Read the waveforms of a campaign.

    Parameters
    ----------
    campaign : Campaign
    low_pass : LowPass, optional
    runs : iterable of Run, optional
        The campaign's, where somebody else looks at each of them too; so they are read once.
    progress : callable, optional
        Called with a label after each run.

    Raises
    ------
    CalibrationError
        If no run of constant conditions holds two whole turns of strain.
    """
    chosen = low_pass or LowPass()
    rows: list[_Row] = []
    left_out: dict[int, str] = {}
    for run in campaign.runs() if runs is None else runs:
        row = _measure(run, campaign.header, chosen)
        if isinstance(row, str):
            left_out[run.plan.run] = row
        else:
            rows.append(row)
        if progress is not None:
            progress(f"{campaign.header.name} run {run.plan.run}")
    if not rows:
        reasons = "; ".join(f"run {k}: {v}" for k, v in list(left_out.items())[:3])
        raise CalibrationError(
            f"{campaign.header.name}: no run gives a strain waveform ({reasons}); strain at "
            "constant conditions over at least three turns is needed"
        )
    names = sorted({name for row in rows for name in row.extra})
    return Waveforms(
        header=campaign.header,
        strain=np.stack([row.strain for row in rows]),
        run=np.array([row.run.plan.run for row in rows]),
        turns=np.array([row.turns for row in rows]),
        scatter=np.array([row.scatter for row in rows]),
        angle_std=np.array([row.angle_std for row in rows]),
        start=_starts([row.run for row in rows]),
        group=_groups([row.run for row in rows]),
        conditions={name: np.array([row.conditions[name] for row in rows]) for name in CONDITIONS},
        extra={name: np.array([row.extra.get(name, np.nan) for row in rows]) for name in names},
        low_pass=chosen,
        left_out=left_out,
    )


@dataclass(frozen=True, slots=True)
class _Row:
    run: Run
    strain: FloatArray
    turns: int
    scatter: float
    angle_std: float
    conditions: dict[str, float]
    extra: dict[str, float]


def _measure(run: Run, header: CampaignHeader, low_pass: LowPass) -> _Row | str:
    """Return a run's mean waveform, or the reason why it has none."""
    if run.strain is None:
        return "holds no strain"
    if run.plan.kind == "sweep":
        return (
            "is a sweep: its conditions change within the turns; if they do not, state another "
            "kind and its set points in runs.csv, or in the map of the import"
        )
    turns = cut_turns(
        run.strain, run.rate, header.gage_lateral, trigger=run.trigger, low_pass=low_pass
    )
    waves, steps = _whole_turns(run, turns, low_pass)
    if len(waves) < 1:
        finder = int(np.argmin(np.abs(header.gage_lateral)))
        lost = np.mean(~np.isfinite(run.strain[finder]))
        because = (
            f", and {lost:.0%} of the samples of gage {finder + 1}, which finds the contacts, are "
            "no numbers (NaN)"
        )
        return f"holds no whole turn between contacts ({len(turns)} contacts{because * bool(lost)})"
    stack = np.stack(waves)
    stack = stack - stack.mean(axis=2, keepdims=True)
    mean = stack.mean(axis=0)
    count = stack.shape[0]
    scatter = float(np.sqrt(np.nanmean((stack - mean) ** 2) * count / max(count - 1, 1)))
    known = np.isfinite(turns.trace.axis_shift).sum()
    angle_std = float(np.mean(steps) / np.sqrt(12.0 * known)) if known else np.inf
    conditions = {name: _condition(run, name) for name in CONDITIONS}
    if not np.isfinite(conditions["omega"]):
        conditions["omega"] = float(np.mean(steps)) * run.rate  # as the contacts follow each other
    return _Row(
        run, mean, count, scatter if count > 1 else np.nan, angle_std, conditions, _extra(run)
    )


def _whole_turns(run: Run, turns: Turns, low_pass: LowPass) -> tuple[list[FloatArray], list[float]]:
    """Return every usable turn's waveform over `GRID`, and its angle steps."""
    assert run.strain is not None  # noqa: S101 - the caller has looked
    middles = turns.time * run.rate
    shift = turns.trace.axis_shift
    zero = float(np.nanmean(shift)) if np.isfinite(shift).any() else 0.0
    waves: list[FloatArray] = []
    steps: list[float] = []
    for k in range(1, len(turns) - 1):
        if turns.flags[k] & int(INVALIDATING) and not np.isfinite(turns.period[k]):
            continue
        step = 4.0 * np.pi / (middles[k + 1] - middles[k - 1])
        sigma = low_pass.sigma(step * run.rate / (2.0 * np.pi))
        reach = 4.0 * sigma / step + 2
        first, last = (middles[k] + (GRID[[0, -1]] - zero) / step).tolist()
        if first - reach < 0 or last + reach >= run.strain.shape[1]:
            continue
        angle = (np.arange(run.strain.shape[1]) - middles[k]) * step
        waves.append(smooth_to_angle(run.strain, angle, GRID - zero, sigma)[0])
        steps.append(step)
    return waves, steps


def _condition(run: Run, name: str) -> float:
    samples = run.rig.get(name)
    if samples is not None and np.isfinite(samples).any():
        return float(np.nanmean(samples))
    point = _SET_POINT.get(name)
    value = getattr(run.plan, point) if point else np.nan
    return float(value)


def _extra(run: Run) -> dict[str, float]:
    values = {
        name: float(np.nanmean(samples))
        for name, samples in run.rig.items()
        if name not in CONDITIONS and np.isfinite(samples).any()
    }
    for name, value in run.plan.extra.items():
        if isinstance(value, float | int):
            values.setdefault(name, float(value))
    return values


def _starts(runs: list[Run]) -> FloatArray:
    starts = [run.plan.start for run in runs]
    if any(start is None for start in starts):
        return np.arange(len(runs), dtype=float)
    return np.array(starts, dtype=float)


def _groups(runs: list[Run]) -> IntArray:
    keys = [
        tuple(np.round(getattr(run.plan, name), 9) for name in _SET_POINT.values()) for run in runs
    ]
    order = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    return np.array([order[key] for key in keys])
