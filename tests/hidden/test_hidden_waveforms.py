"""Waveforms of the benchmark are those that files of a campaign would give."""

from pathlib import Path

import numpy as np
import pytest
from hidden.measured import Plain, traces, waveforms
from hidden.plan import LOADS, PRESSURES, SPEEDS, Day, day, tire

from tirelib.campaign import read_campaign
from tirelib.measured.waveforms import measure_waveforms
from tirelib.rig.campaign import run_plan
from tirelib.rig.measure import MeasuringChain
from tirelib.rig.plans import Plan
from tirelib.rig.solve import solve
from tirelib.rig.tire import Condition, RigTire

EXACT = MeasuringChain(
    load_setting=0.0,
    pressure_setting=0.0,
    speed_setting=0.0,
    angle_setting=0.0,
    slip_setting=0.0,
    gain_repeatability=0.0,
    gage_noise=1e-7,
    gage_bits=20,
)
COND = Condition(5000.0, 2.1e5, 20.0)
PLANTED = {"gage_saturation": 0.05, "sidewall_pressure": 0.5}


def test_files_and_shortcut_give_the_same_waveform(tmp_path: Path) -> None:
    made = tire(1)
    plan = Plan("one", "one run", (COND,))
    run_plan(plan, made, tmp_path / "c", jobs=1, chain=EXACT, planted=PLANTED)
    by_files = measure_waveforms(read_campaign(tmp_path / "c"))
    one = np.zeros(1, dtype=np.int64)
    today = Day(1, made, EXACT, (COND,), (COND,), one, one > 0, 0.0, 0.0)
    base = Plain(today, (solve(made, COND),))
    states, shown = traces(base, PLANTED)
    direct = waveforms(base, states, shown, "x")
    plain = waveforms(base, *traces(base, {}), "x")
    change = np.sqrt(np.mean((direct.strain - plain.strain) ** 2))
    rest = by_files.strain - direct.strain
    slope = np.gradient(direct.strain[0], axis=1)
    late = np.sum(rest[0] * slope) / np.sum(slope**2)  # the trigger's resolution, in grid steps
    assert abs(late) < 0.5
    rest = rest - late * slope
    assert change > 2e-5
    assert np.sqrt(np.mean(rest**2)) < 0.03 * change
    for name in ("Fz", "pressure", "omega", "loaded_radius"):
        assert by_files.conditions[name] == pytest.approx(direct.conditions[name], rel=3e-3)


def test_a_seed_is_a_day_of_twelve_conditions_repeats_and_runs_held_out() -> None:
    today = day(1001)
    fitted = {
        (c.load, c.pressure, c.speed)
        for c, out in zip(today.nominal, today.held_out, strict=True)
        if not out
    }
    assert len(fitted) == 12
    assert [sorted({f[k] for f in fitted}) for k in range(3)] == [
        sorted(LOADS),
        sorted(PRESSURES),
        sorted(SPEEDS),
    ]
    assert len(today.nominal) == 18
    assert today.held_out.sum() == 3
    again = day(1001)
    assert again.really == today.really
    assert day(1002).tire != today.tire


def test_a_tire_of_the_benchmark_hides_nothing() -> None:
    drawn, base = tire(1003), RigTire()
    for name in (
        "sidewall_damping",
        "friction",
        "sidewall_softening",
        "tread_cubic",
        "tread_roughness",
        "road_curvature",
    ):
        assert getattr(drawn, name) == 0.0
    assert drawn.belt_laws == drawn.road_laws == ()
    for name in ("extension", "shear", "bending", "mass", "tread_normal", "ring_radius"):
        assert 0.3 < getattr(drawn, name) / getattr(base, name) < 3.0
        assert getattr(drawn, name) != getattr(base, name)
