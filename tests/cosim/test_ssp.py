"""The ``.ssp`` of vehicle, tires and estimators: valid, and the same in every engine."""

import os
import subprocess
import sys
import zipfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from cosim import ssp, ssp_run
from cosim.vehicle14.parameters import WHEELS
from fmpy.ssp.ssd import read_ssd, read_ssv

from tests.cosim import fmus
from tests.fmu import live
from tirelib.core.errors import ParameterError

STEPS = 85
"""170 ms at 90 km/h: every wheel's second contact."""
BUILD = Path(ssp.__file__).parents[1]


@cache
def system() -> ssp.System:
    return ssp.four_wheels(fmus.vehicle(), fmus.virtual(), fmus.strain(), stop=0.17)


@cache
def archive() -> Path:
    return ssp.write_ssp(system(), live.folder() / "car.ssp")


@cache
def truth() -> ssp_run.Result:
    return ssp_run.run_fmpy(archive(), fmus.TIME_STEP, STEPS)


def test_the_archive_is_valid_by_its_schemas_and_has_a_parameter_set_per_component() -> None:
    found = read_ssd(str(archive()), validate=True)
    names = [component.name for component in found.system.elements]
    assert names[0] == "vehicle"
    assert sorted(names[1:]) == sorted(f"{p}_{w}" for p in ("tire", "strain") for w in WHEELS)
    sets = {
        name: read_ssv(str(archive()), resource=f"resources/{name}.ssv", validate=True)
        for name in names
    }
    seeds = {p.value for w in WHEELS for p in sets[f"tire_{w}"].parameters if p.name == "seed"}
    assert len(seeds) == 4
    # 20 samples of 5 gages, validity, 5 conditions to the tire and 3 to the estimator, each wheel
    assert len(found.system.connections) == 4 * (100 + 1 + 5 + 3)


def test_the_same_system_has_the_same_bytes() -> None:
    again = ssp.write_ssp(system(), live.folder() / "again.ssp")
    assert again.read_bytes() == archive().read_bytes()
    with zipfile.ZipFile(again) as content:
        assert len([n for n in content.namelist() if n.endswith(".fmu")]) == 3


def test_links_and_parameters_that_no_fmu_has_are_named() -> None:
    bad = ssp.Link(("vehicle", "Fz_FL"), ("tire_FL", "load"))
    with pytest.raises(ParameterError, match=r"tire_FL\.load"):
        ssp.write_ssp(replace(system(), links=[bad]), live.folder() / "bad.ssp")
    first = replace(system().components[0], parameters={"sped": 1.0})
    with pytest.raises(ParameterError, match=r"vehicle\.sped"):
        ssp.write_ssp(replace(system(), components=[first]), live.folder() / "bad.ssp")


def test_frames_of_different_length_are_refused() -> None:
    with pytest.raises(ParameterError, match="takes 0"):
        ssp.four_wheels(fmus.vehicle(), fmus.virtual(), fmus.vehicle())


def test_estimates_follow_the_wheels_and_the_parameter_sets_are_used() -> None:
    last = {name: float(values[-1]) for name, values in truth().items()}
    loads = np.array([last[f"vehicle.Fz_{w}"] for w in WHEELS])
    told = np.array([last[f"strain_{w}.Fz"] for w in WHEELS])
    # estimates are up to a turn old while load still moves to the front right: 12 %
    np.testing.assert_allclose(told, loads, rtol=0.12)
    assert last["vehicle.vx"] < ssp.TURN_BRAKING["start_speed"] - 0.5  # the brakes are on
    assert last["vehicle.yaw_rate"] > 0.05  # and it steers
    first = [float(truth()[f"tire_{w}.wheel_angle"][0]) for w in WHEELS]
    omega = ssp.TURN_BRAKING["start_speed"] / 0.308
    expected = np.array(ssp.START_ANGLES) + omega * fmus.TIME_STEP
    np.testing.assert_allclose(first, expected, atol=5e-3)


@pytest.mark.parametrize("engine", ["ecos", "libcosim"])
def test_another_engine_gives_the_same(engine: str) -> None:
    """Fixed step, Jacobi: the same sums in the same order, but for the rounding of time.

    The engine runs in a process of its own, as a crash of its library must not end the tests.
    It is skipped where its binary does not load: there is none for every system.
    """
    if (reason := ssp_run.missing(engine)) is not None:
        pytest.skip(reason)
    out = live.folder() / f"{engine}.npz"
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "cosim.ssp_run",
            str(archive()),
            "--engine",
            engine,
            "--step",
            str(fmus.TIME_STEP),
            "--stop",
            str(fmus.TIME_STEP * STEPS),
            "--out",
            str(out),
        ],
        capture_output=True,
        text=True,
        cwd=BUILD,
        timeout=1200,
        env={**os.environ, "PYTHONPATH": str(BUILD)},
        check=False,
    )
    assert out.is_file(), done.stderr[-2000:]
    with np.load(out) as found:
        gaps = ssp_run.differences(truth(), dict(found))
    worst = max(gaps, key=lambda name: gaps[name])
    assert gaps[worst] < 1e-9, (worst, gaps[worst])


def test_an_engine_that_nobody_knows_is_refused() -> None:
    with pytest.raises(ParameterError, match="allowed are fmpy, ecos, libcosim"):
        ssp_run.missing("cosimulator")
