"""The runs that are compared, and what a reader has to know of them."""

from dataclasses import dataclass

import numpy as np

from tirelib.campaign import Tolerance
from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.inference.identify.campaign_data import TYPICAL_TOLERANCE, usable, working_gages
from tirelib.inference.identify.error_bands import levels
from tirelib.measured.waveforms import Waveforms

STEP = {"load": 50.0, "pressure": 5e3, "speed": 1.0 / 3.6}
"""To what levels are rounded: 50 N, 0.05 bar, 1 km/h."""
_SLIP_STEP = {
    "slip_angle": float(np.deg2rad(0.5)),
    "camber": float(np.deg2rad(0.5)),
    "slip_ratio": 0.01,
}


@dataclass(frozen=True, slots=True)
class Factor:
    """A condition that varies, and the level of every run.

    Attributes
    ----------
    name : str
        load, pressure, speed; slip_angle, camber, slip_ratio.
    level : shape (n_runs,)
        Number of the level; -1 where the condition is unknown.
    values : shape (n_levels,)
        Value of each level, SI, rounded as set points are.
    """

    name: str
    level: IntArray
    values: FloatArray


@dataclass(frozen=True, slots=True)
class Chosen:
    """Runs that take part.

    Attributes
    ----------
    straight : shape (n_runs,)
        Runs that the error counts: straight and freely rolling, or all if there is none.
    gages : tuple of int
        Gages that are averaged.
    strain : shape (n_runs, n_phi), [-]
    factors : tuple of Factor
        load, pressure and speed first; only those with more than one level.
    """

    waves: Waveforms
    straight: BoolArray
    gages: tuple[int, ...]
    strain: FloatArray
    tolerance: Tolerance
    factors: tuple[Factor, ...]
    notes: tuple[str, ...]


def choose(waves: Waveforms) -> Chosen:
    """Return the runs of a campaign that a model can be held against.

    Raises
    ------
    CalibrationError
        If no run has strain, load, pressure and turn rate, or no gage works.
    """
    name = waves.header.name
    c = waves.conditions
    known = usable(waves)
    if not known.any():
        lacking = [q for q in ("Fz", "pressure") if not np.isfinite(c[q]).any()]
        raise CalibrationError(
            f"{name}: {len(waves)} runs with strain, none with load, pressure and a gage that "
            f"works ({', '.join(lacking) or 'never all of them'} is missing); record them"
        )
    notes = [f"run {run} is left out: it {why}" for run, why in list(waves.left_out.items())[:5]]
    if not known.all():
        notes.append(
            f"{int((~known).sum())} runs are left out: load or pressure is unknown, or no gage "
            "gives a whole waveform"
        )
    chosen = waves.take(known)
    straight = chosen.straight
    gages = working_gages(chosen.take(straight) if straight.any() else chosen)
    whole = np.asarray(np.isfinite(chosen.strain[:, gages]).all(axis=(1, 2)))
    if not whole.all():
        lost_runs = ", ".join(str(run) for run in chosen.run[~whole])
        notes.append(f"run {lost_runs} left out: a gage that works in straight runs fails there")
        chosen, straight = chosen.take(whole), straight[whole]
    if len(gages) < len(chosen.header.gage_lateral):
        lost = sorted(set(range(len(chosen.header.gage_lateral))) - set(gages))
        notes.append(f"gage {', '.join(str(g + 1) for g in lost)} does not take part")
    if not straight.any():
        straight = np.ones(len(chosen), dtype=np.bool_)
        notes.append(
            "no run is straight and freely rolling: the error counts runs with slip or camber"
        )
    tolerance = chosen.header.tolerance
    if tolerance is None:
        tolerance = TYPICAL_TOLERANCE
        notes.append(
            "campaign.toml has no [tolerance]: set points are taken to repeat to 0.5 % in load, "
            "0.2 % in pressure and 0.3 % in gain"
        )
    strain = chosen.strain[:, gages].mean(axis=1)
    return Chosen(
        chosen, straight, gages, strain, tolerance, _factors(chosen, straight), tuple(notes)
    )


def _factors(waves: Waveforms, straight: BoolArray) -> tuple[Factor, ...]:
    c = waves.conditions
    out = []
    for name, measured in (("load", "Fz"), ("pressure", "pressure"), ("speed", "speed")):
        level = levels(np.where(straight, c[measured], np.nan))
        if level.max() > 0:
            values = np.array([c[measured][level == k].mean() for k in range(level.max() + 1)])
            out.append(Factor(name, level, np.round(values / STEP[name]) * STEP[name]))
    for name, step in _SLIP_STEP.items():
        rounded = np.round(np.nan_to_num(c[name]) / step)
        found, level = np.unique(rounded, return_inverse=True)
        if found.size > 1:
            out.append(Factor(name, np.asarray(level, dtype=np.int64).ravel(), found * step + 0.0))
    return tuple(out)
