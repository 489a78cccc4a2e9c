"""What an importer reads before the first step: what will be there at the start, or nothing."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu import live
from tests.fmu.player import held
from tests.fmu.virtual_host import QUIET, TYPICAL, Host, file
from tirelib.fmu.run import LoadedFmu
from tirelib.fmu.strain_variables import outputs

NAMES = [v.name for v in outputs(live.HEADER.gage_lateral)]


@pytest.fixture(scope="module")
def virtual() -> Iterator[Host]:
    host = Host(file(10))
    yield host
    host.close()


@pytest.fixture(scope="module")
def strain_tire() -> Iterator[LoadedFmu]:
    with LoadedFmu(live.fmu_file(10)) as fmu:
        yield fmu


def seen(host: Host) -> dict[str, Any]:
    names = [
        "omega",
        "wheel_angle",
        "alpha_relaxed",
        "kappa_relaxed",
        "Fx_rig",
        "Fy_rig",
        "Mz_rig",
        "loaded_radius",
        "rolling_radius",
        "samples",
        "frame_valid",
        "moving",
        "status",
    ]
    return {**{name: host.get(name) for name in names}, "frame": host.frame().tolist()}


def test_a_virtual_tire_that_is_being_initialised_shows_what_it_will_start_with(
    virtual: Host,
) -> None:
    virtual.slave.reset()
    virtual.slave.setupExperiment(startTime=0.0)
    virtual.put(**QUIET, start_angle=0.1)
    early = seen(virtual)
    virtual.slave.enterInitializationMode()
    assert seen(virtual) == early
    assert early["frame_valid"]
    assert early["loaded_radius"] == pytest.approx(0.3, abs=0.03)
    virtual.put(**TYPICAL)
    foreseen = seen(virtual)
    assert foreseen["Fy_rig"] != early["Fy_rig"]
    assert not any(math.isnan(x) for x in foreseen.values() if isinstance(x, float))
    virtual.slave.exitInitializationMode()
    assert seen(virtual) == foreseen
    with pytest.raises(FMICallException, match="status 3"):
        virtual.slave.doStep(0.0, 0.0)


def test_parameters_that_cannot_be_leave_the_start_values_until_the_start_says_why(
    virtual: Host,
) -> None:
    virtual.slave.reset()
    virtual.slave.setupExperiment(startTime=0.0)
    assert virtual.get("status") == "ok"
    virtual.put(noise_std=-1.0)
    assert (virtual.get("status"), virtual.get("frame_valid")) == ("not_started", False)
    assert math.isnan(virtual.get("Fy_rig"))
    virtual.slave.enterInitializationMode()
    with pytest.raises(FMICallException):
        virtual.slave.exitInitializationMode()


def started(fmu: LoadedFmu, missing: float) -> None:
    fmu.slave.reset()
    fmu.slave.setupExperiment(startTime=0.0)
    at = fmu.references
    fmu.slave.setReal([at["sample_rate"], at["missing"]], [live.RATE, missing])
    fmu.slave.enterInitializationMode()
    fmu.rate, fmu.count = live.RATE, 0


def course(fmu: LoadedFmu, missing: float, strain: np.ndarray) -> list[dict[str, Any]]:
    """All outputs, from the initialisation on."""
    started(fmu, missing)
    found = [fmu.read()]
    fmu.slave.exitInitializationMode()
    found.append(fmu.read())
    for first in range(0, strain.shape[1] - 9, 10):
        fmu.step(strain[:, first : first + 10], held(speed=math.nan))
        found.append(fmu.read())
    return found


def test_without_a_value_an_output_shows_what_the_importer_asked_for_and_is_as_invalid(
    strain_tire: LoadedFmu,
) -> None:
    strain = live.strain_of(4e3, 0.05, turns=2.4)[0]
    strain[1, 300:] = np.nan
    plain = course(strain_tire, math.nan, strain)
    other = course(strain_tire, -7.0, strain)
    assert all(math.isnan(plain[0][name]) for name in ("Fz", "Fz_std", "age", "contact_time"))
    assert not plain[0]["valid"]
    assert plain[-1]["Fz"] > 3e3
    assert math.isnan(plain[-1]["kappa"])  # there is no speed
    assert math.isnan(plain[-1]["contact_length_2"])
    assert set(NAMES) == set(plain[0])
    for one, two in zip(plain, other, strict=True):
        for name, value in one.items():
            gone = isinstance(value, float) and math.isnan(value)
            assert two[name] == (-7.0 if gone else value), name


def test_an_infinite_stand_in_is_refused(strain_tire: LoadedFmu) -> None:
    started(strain_tire, math.inf)
    strain_tire.messages.clear()
    with pytest.raises(FMICallException):
        strain_tire.slave.exitInitializationMode()
    assert any("missing = inf; allowed are NaN and finite" in m for m in strain_tire.messages)
