"""An FMU step of ten samples beside an empty pythonfmu slave with the same variables, in one run.

Goal: a ratio of at most 3, with turn ends included. Nothing here fails on time.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pythonfmu import FmuBuilder

from tests.fmu import live
from tests.synthetic import record
from tirelib.fmu.run import LoadedFmu
from tirelib.fmu.variables import Variable, inputs, outputs

pytestmark = pytest.mark.speed
RATE = 1e4
SAMPLES = 10
_EMPTY = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String


class Empty(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        kinds = {{"Real": Real, "Integer": Integer, "Boolean": Boolean, "String": String}}
        for name, kind, causality, start in {table!r}:
            setattr(self, name, start)
            self.register_variable(kinds[kind](
                name, causality=Fmi2Causality[causality], variability=Fmi2Variability.discrete
            ))

    def do_step(self, current_time, step_size):
        return True
"""


def empty_slave(folder: Path, table: list[Variable]) -> Any:
    """Build and instantiate a slave that has the variables and does nothing."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    rows = [(v.name, v.kind, v.causality, 0.0 if v.start != v.start else v.start) for v in table]
    script = folder / "empty_slave.py"
    script.write_text(_EMPTY.format(table=rows))
    path = FmuBuilder.build_FMU(script, dest=folder / "Empty.fmu")
    description = read_model_description(str(path))
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract(str(path), unzipdir=str(folder / "empty")),
        modelIdentifier="Empty",
        instanceName="empty",
    )
    slave.instantiate()
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave, {v.name: v.valueReference for v in description.modelVariables}


def stepper(slave: Any, at: dict[str, int], lateral: tuple[float, ...]) -> Callable[..., None]:
    """Return set, step and get of one frame, the same calls for both slaves."""
    given = [v.name for v in inputs(lateral, SAMPLES) if v.kind == "Real" and v.name != "omega"]
    taken = [v.name for v in outputs(lateral) if v.kind == "Real"]
    set_at, get_at = [at[name] for name in given], [at[name] for name in taken]
    flags = [at["turn"], at["flags"]]

    def step(now: float, values: list[float]) -> None:
        slave.setReal(set_at, values)
        slave.doStep(now, SAMPLES / RATE)
        slave.getReal(get_at)
        slave.getInteger(flags)

    return step


def test_a_step_against_an_empty_slave(benchmark: Any, tmp_path: Path) -> None:
    lateral = live.calibration().lateral
    table = [*inputs(lateral, SAMPLES), *outputs(lateral)]
    empty = stepper(*empty_slave(tmp_path, table), lateral)
    strain, _, _ = record(turns=40, speed=live.SPEED, noise=4e-6, rate=RATE)
    n = strain.shape[1] // SAMPLES
    frames = [
        [*strain[:, i * SAMPLES : (i + 1) * SAMPLES].T.ravel(), live.SPEED, live.PRESSURE, 0.0]
        for i in range(n)
    ]
    with LoadedFmu(live.fmu_file(SAMPLES)) as fmu:
        fmu.start(RATE)
        full = stepper(fmu.slave, fmu.references, lateral)
        taken: dict[str, list[float]] = {"empty": [], "full": []}
        waiting = iter(range(n))

        def both() -> None:
            number = next(waiting)
            for name, step in (("empty", empty), ("full", full)):
                start = time.perf_counter()
                step(number * SAMPLES / RATE, frames[number])
                taken[name].append(time.perf_counter() - start)

        benchmark.pedantic(both, rounds=n)
    us = {name: np.array(times) * 1e6 for name, times in taken.items()}
    told = {
        "median_us": [round(float(np.median(us[name])), 1) for name in ("empty", "full")],
        "mean_us": [round(float(np.mean(us[name])), 1) for name in ("empty", "full")],
        "ratio_of_medians": round(float(np.median(us["full"]) / np.median(us["empty"])), 2),
        "ratio_of_means": round(float(np.mean(us["full"]) / np.mean(us["empty"])), 2),
    }
    benchmark.extra_info.update(told)
    print(f"\nFMU step of {SAMPLES} samples, [empty, full]: {told}")  # noqa: T201 - what the run is for
