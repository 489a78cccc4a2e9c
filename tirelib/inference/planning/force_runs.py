"""Further runs of a force: which conditions they may have, and their points behind the present."""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.compare.force_model import ForceModel, slip_of
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.identify.force_bench import ForceBench
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_points import ForcePoints
from tirelib.inference.planning.envelope import Envelope
from tirelib.inference.planning.sweep import campaign_sweep
from tirelib.inference.problems.force_plan import varies


def force_axes(case: ForceCase) -> tuple[str, ...]:
    """Return the conditions that a further point of a force may have."""
    at = case.bench.conditions
    slip = slip_of(case.quantity)
    known = [name for name in ("load", "pressure", "speed") if np.isfinite(getattr(at, name)).all()]
    other = [
        name
        for name in ("slip_angle", "slip_ratio", "camber", "temperature")
        if name != slip and varies(at, name)
    ]
    return (*known, slip, *other)


def force_envelope(case: ForceCase, sweep: bool | None = None, **declared: Any) -> Envelope:
    """Return the envelope of further runs of a force, with ranges declared as for `Envelope.of`.

    `sweep` says whether a run is a sweep of the slip; by default as the campaign's runs are.

    Raises
    ------
    ParameterError
        As `Envelope.of`; or the declared range of the slip holds none of the campaign's slips.
    """
    envelope = Envelope.of(case.bench.conditions, force_axes(case), **declared)
    found = campaign_sweep(case.bench.points, slip_of(case.quantity), sweep)
    return envelope if found is None else envelope.swept(found)


def bench_ahead(
    present: ForceBench, model: ForceModel, envelope: Envelope, wanted: FloatArray
) -> ForceBench:
    """Return the bench of the present points and, after them in time, of those of wanted runs.

    What is not planned is as in the present points, on average; rolling is steady. The points of a
    sweep follow each other and are one block, for a run's set points are off alike.
    """
    data, sweep, size = present.points.data, envelope.sweep, envelope.points
    n, rate = len(wanted) * size, np.zeros(len(wanted) * size)
    columns = dict(zip(envelope.names, np.repeat(wanted, size, axis=0).T, strict=True))
    if sweep is not None:
        columns[sweep.name] = np.tile(sweep.values, len(wanted))
        rate = np.tile(sweep.rates, len(wanted))
    more = {}
    for field in fields(ForceData):
        if field.name == "block":
            more["block"] = data.block.max() + 1 + np.repeat(np.arange(len(wanted)), size)
        elif field.name in ("Fx", "Fy", "Mz"):
            more[field.name] = np.full(n, np.nan)
        else:
            values = getattr(data, field.name)
            more[field.name] = columns.get(field.name, np.full(n, float(np.mean(values))))
    points = present.points
    every = {k: np.concatenate([getattr(data, k), v]) for k, v in more.items()}
    joint = ForcePoints(
        ForceData(**every),
        np.concatenate([points.slip_rate, rate]),
        np.concatenate([points.samples, np.ones(n, dtype=np.int64)]),
        np.concatenate([points.cell, points.cell.max() + 1 + np.arange(n)]),
        np.concatenate([points.sweep, np.full(n, bool(rate.any()))]),
    )
    bench = model.bench(joint)
    order = np.concatenate([present.conditions.order, np.ones(n)])
    return replace(bench, conditions=replace(bench.conditions, order=order))
