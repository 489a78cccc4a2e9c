"""Tires and estimators, all compiled, in programs of others that hold no Python: as in FMPy."""

import csv
import importlib.util
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from cosim import ssp, ssp_run
from cosim.vehicle14.parameters import WHEELS
from fmpy import simulate_fmu

from tests.cosim import fmus
from tests.fmu import live

STEPS = 100
"""200 ms at 90 km/h: every wheel's second contact."""
HELD = {"speed": 25.0, "camber": 0.01}
WHEEL = {"Fz": 4200.0, "alpha": 0.02, "kappa": 0.01}
WATCHED = [name for name in ssp_run.WATCHED if not name.startswith("vehicle.")]


@cache
def system() -> ssp.System:
    """Return four tires and estimators whose conditions are held; `omega` is left unknown."""
    car = ssp.four_wheels(fmus.vehicle(), fmus.virtual(), fmus.strain())
    components = []
    for component in car.components[1:]:
        held = {**HELD, **(WHEEL if component.name.startswith("tire") else {})}
        components.append(replace(component, parameters={**component.parameters, **held}))
    links = [link for link in car.links if link.source[0] != "vehicle"]
    return replace(car, components=components, links=links)


@cache
def archive() -> Path:
    return ssp.write_ssp(system(), live.folder() / "tires.ssp")


@cache
def truth() -> ssp_run.Result:
    return ssp_run.run_fmpy(archive(), fmus.TIME_STEP, STEPS, WATCHED)


def compare(found: ssp_run.Result, apart: float) -> None:
    """Hold what a program found against FMPy, where every wheel has an estimate."""
    for wheel in WHEELS:
        assert truth()[f"strain_{wheel}.Fz"][-1] == pytest.approx(WHEEL["Fz"], rel=0.05)
    for name, values in truth().items():
        np.testing.assert_allclose(found[name], values, rtol=0, atol=apart, err_msg=name)


def test_the_command_of_ecos_in_an_empty_environment(tmp_path: Path) -> None:
    """Nothing is preloaded, and it ends cleanly; it writes six decimals."""
    if (reason := ssp_run.missing("ecos")) is not None:
        pytest.skip(reason)
    spec = importlib.util.find_spec("ecospy")
    assert spec is not None
    assert spec.origin is not None
    command = tmp_path / "ecos"
    shutil.copy(Path(spec.origin).parent / "binaries" / "ecos", command)
    command.chmod(0o755)  # that of the wheel lacks the bit
    stop = str(fmus.TIME_STEP * (STEPS + 0.5))
    options = ["--stepSize", str(fmus.TIME_STEP), "--stopTime", stop, "--parameterSet", ssp.SET]
    done = subprocess.run(
        [command, "simulate", "--path", archive(), *options],
        cwd=tmp_path,
        env={},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (written,) = tmp_path.rglob("*.csv")
    with written.open(newline="") as stream:
        names, *rows = csv.reader(stream, skipinitialspace=True)
    at = {name.split("[")[0].replace("::", "."): i for i, name in enumerate(names)}
    found = np.array([[float(row[at[name]]) for name in WATCHED] for row in rows])
    after = found[1 : STEPS + 1]  # the first row is of the start
    compare(dict(zip(WATCHED, after.T, strict=True)), 0.51e-6)


@pytest.mark.parametrize("threads", [False, True])
def test_one_fmu_of_all(tmp_path: Path, *, threads: bool) -> None:
    """Eight instances behind the functions of one FMU, as ``fmucontainer`` puts them together."""
    pytest.importorskip("fmu_manipulation_toolbox")
    components = system().components
    told = {
        "name": "tires.fmu",
        "step_size": fmus.TIME_STEP,
        "mt": threads,
        "auto_link": False,  # it would also join estimates to the tires' inputs of the same name
        "auto_input": False,
        "auto_output": False,
        "fmu": [f"{c.name}.fmu" for c in components],
        "path": {f"{c.name}.fmu": str(c.fmu) for c in components},
        "link": [
            [f"{link.source[0]}.fmu", link.source[1], f"{link.target[0]}.fmu", link.target[1]]
            for link in system().links
        ],
        "start": [
            [f"{c.name}.fmu", name, str(value)]
            for c in components
            for name, value in c.parameters.items()
        ],
        "output": [
            [f"{component}.fmu", variable, name]
            for name in WATCHED
            for component, variable in [name.split(".")]
        ],
    }
    (tmp_path / "tires.json").write_text(json.dumps(told))
    command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmucontainer"]
    subprocess.run([*command, "-container", "tires.json"], cwd=tmp_path, check=True, timeout=600)
    seen = simulate_fmu(
        str(tmp_path / "tires.fmu"),
        stop_time=STEPS * fmus.TIME_STEP,
        step_size=fmus.TIME_STEP,
        output_interval=fmus.TIME_STEP,
        output=WATCHED,
    )
    compare({name: seen[name][1:] for name in WATCHED}, 0.0)
