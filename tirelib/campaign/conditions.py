"""Conditions while a run's samples were taken: one rule for batch, stream, FMU and bench.

A condition is what the rig measured, held from one measurement to the next; where the rig did not
measure it at all, it is the set point; where neither is there, it is unknown. A measurement that
begins late or ends early says nothing of the other samples, and its set point does not stand in
for it: the two may differ.
"""

import numpy as np

from tirelib.campaign.model import Run
from tirelib.core.arrays import FloatArray
from tirelib.core.held import HELD

LONGEST_HOLD = 3.0
"""Rig samples after which the last one is no longer held: itself, one that is lost and one of
jitter. With half of it the end of a run is unknown where a sample is lost; with double an
unmeasured value is held for 60 ms at 100 Hz."""


def conditions_of(run: Run, times: FloatArray) -> dict[str, FloatArray]:
    """Return the conditions of `HELD` at some times of a run.

    Parameters
    ----------
    run : Run
    times : array, shape (n,), [s]
        On the recording's clock, for instance those of the strain samples, ``run.time()``.

    Returns
    -------
    dict of arrays, shape (n,), SI, ISO
        By the names of `HELD`, all of them; NaN where unknown.
    """
    held = run.hold_all(HELD, times)
    if held and run.rig_time is not None:
        after = times > _end(run.rig_time)
        for values in held.values():
            values[after] = np.nan
    for name in (name for name in HELD if name not in held):
        held[name] = np.full(times.shape, float(getattr(run.plan, name, np.nan)))
    return {name: held[name] for name in HELD}


def changes_of(run: Run) -> FloatArray:
    """Return the start of a run and the times at which conditions may change, shape (k,), [s]."""
    if run.rig_time is None or not run.rig_time.size:
        return np.array([run.start_time])
    end = np.nextafter(_end(run.rig_time), np.inf)
    times = np.array([run.start_time, *run.rig_time, end])
    return np.unique(np.maximum(times[np.isfinite(times)], run.start_time))


def _end(rig_time: FloatArray) -> float:
    """Return the time until which the last measurement is held; infinite for a single one."""
    step = float(np.median(np.diff(rig_time))) if rig_time.size > 1 else np.inf
    return float(rig_time[-1]) + LONGEST_HOLD * step
