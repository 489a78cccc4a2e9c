"""Which condition holds at a sample: measured, else the set point, else unknown."""

from dataclasses import replace

import numpy as np
import pytest

from tests.synthetic import synthetic_run
from tirebench.emulator.emulator import record_tape
from tirebench.emulator.faults import Faults
from tirebench.wire.device import Device
from tirelib.campaign import conditions_of
from tirelib.campaign.conditions import changes_of
from tirelib.core.held import HELD

RUN = synthetic_run(1, camber=0.02)


def test_a_measurement_wins_over_the_set_point() -> None:
    held = conditions_of(RUN, RUN.time())
    assert tuple(held) == HELD
    newest = (RUN.time() * 100.0 + 1e-6).astype(int)
    for name in ("speed", "pressure", "camber"):
        last = len(RUN.rig[name]) - 1
        np.testing.assert_array_equal(held[name], RUN.rig[name][np.minimum(newest, last)])


@pytest.mark.parametrize("name", ["speed", "pressure", "camber"])
def test_a_set_point_stands_in_for_a_channel_that_is_not_there(name: str) -> None:
    rig = {key: values for key, values in RUN.rig.items() if key != name}
    held = conditions_of(replace(RUN, rig=rig), RUN.time())
    assert set(held[name].tolist()) == {getattr(RUN.plan, name)}
    sweep = replace(RUN, rig=rig, plan=replace(RUN.plan, **{name: np.nan}))
    assert np.isnan(conditions_of(sweep, RUN.time())[name]).all()


def test_a_set_point_does_not_stand_in_for_a_measurement_that_begins_late_or_ends() -> None:
    part = replace(RUN, rig={"speed": RUN.rig["speed"][5:10]}, rig_time=RUN.rig_time[5:10])
    times = RUN.time() + 5e-5  # between two samples, as borders are
    held = conditions_of(part, times)["speed"]
    known = (times >= 0.05) & (times <= 0.09 + 3 * 0.01)
    np.testing.assert_array_equal(np.isfinite(held), known)


@pytest.mark.parametrize("lacking", ["speed", "pressure", "camber", "all", "late"])
def test_the_emulator_tells_at_each_sample_what_the_batch_holds(lacking: str) -> None:
    rig = {} if lacking == "all" else {k: v for k, v in RUN.rig.items() if k != lacking}
    run = replace(RUN, rig=rig, rig_time=RUN.rig_time if rig else None)
    if lacking == "late":
        run = replace(run, rig={"speed": RUN.rig["speed"][5:10]}, rig_time=RUN.rig_time[5:10])
    told = record_tape([run], Device(), Faults({})).conditions
    held = np.stack(list(conditions_of(run, run.time()).values()), axis=1)
    for time, values in list(zip(run.time(), held, strict=True))[::7]:
        np.testing.assert_array_equal(told.at(1e6 * time), values)


def test_conditions_change_nowhere_else() -> None:
    times = changes_of(RUN)
    fine = np.linspace(0.0, RUN.time()[-1], 5001)
    before = times[np.searchsorted(times, fine, side="right") - 1]
    for name, values in conditions_of(RUN, fine).items():
        np.testing.assert_array_equal(values, conditions_of(RUN, before)[name])
