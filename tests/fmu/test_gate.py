"""What stands before pythonfmu's library: places, texts, identity, and what a refusal ends."""

import os
import subprocess
import sys
import zipfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CoSimulation, fmi2ModelExchange, fmi2Terminated
from fmpy.validation import validate_fmu

from tests.fmu import live, virtual_host
from tirelib.fmu.run import LoadedFmu, keeping

HOST = """
import sys
from pathlib import Path
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave


def instance(folder, logging=False):
    d = read_model_description(str(folder), validate=False)
    slave = FMU2Slave(guid=d.guid, unzipDirectory=str(folder), instanceName="w",
                      modelIdentifier=d.coSimulation.modelIdentifier)
    slave.instantiate(loggingOn=logging)  # FMPy prints texts through printf
    return slave, {v.name: v.valueReference for v in d.modelVariables}

"""


def hosted(code: str, *arguments: object) -> str:
    """Run a program of its own, in which a broken importer is no end of the tests."""
    done = subprocess.run(
        [sys.executable, "-c", HOST + code, *map(str, arguments)], capture_output=True, text=True
    )
    assert done.returncode == 0, (done.returncode, done.stdout, done.stderr)
    return done.stdout


KINDS = pytest.mark.parametrize("python", [False, True], ids=["native", "python"])


def unpacked(fmu: Path, folder: Path) -> Path:
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return folder


@KINDS
def test_an_fmu_runs_from_a_folder_of_any_name(tmp_path: Path, python: bool) -> None:
    names = ["Prüfstand", "50%", "a+b", "a#b", "a b", "100%41 (x)", "轮胎", "%s%n"]
    names += [] if python else ["a%20b", "file:__x"]
    fmu = live.fmu_file(10, python=python)
    folders = [unpacked(fmu, tmp_path / name) for name in names]
    said = hosted(
        """
for folder in sys.argv[1:]:
    slave, at = instance(folder)
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 10 / 5000.0)
    print(slave.getInteger([at["turn"]]), Path(folder).name.encode())
    slave.freeInstance()
""",
        *folders,
    )
    assert said.splitlines() == [f"[0] {name.encode()}" for name in names]


@KINDS
def test_a_percent_sign_in_a_text_is_shown_and_nothing_else(tmp_path: Path, python: bool) -> None:
    text = "%s%n%s%n%d 100%.toml"
    said = hosted(
        """
slave, at = instance(sys.argv[1])
slave.setupExperiment()
slave.setString([at["calibration"]], [sys.argv[2]])
slave.enterInitializationMode()
try:
    slave.exitInitializationMode()
except Exception as error:
    print(error)
slave.reset()
slave.freeInstance()
""",
        unpacked(live.fmu_file(10, python=python), tmp_path / "x"),
        text,
    )
    assert text in said
    assert "%%" not in said
    assert "status 3" in said


def test_a_missing_package_is_told_without_debug_logging(tmp_path: Path) -> None:
    said = hosted(
        """
sys.modules["scipy"] = None
try:
    instance(sys.argv[1])
except Exception as error:
    print(error)
""",
        unpacked(virtual_host.file(10, python=True), tmp_path / "x"),
    )
    assert "ModuleNotFoundError" in said
    assert "scipy" in said


def instantiated(folder: Path, **changed: Any) -> tuple[FMU2Slave, list[str]]:
    """Call fmi2Instantiate with one argument changed; return what it gave and what it said."""
    description = read_model_description(str(folder))
    messages: list[str] = []
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=str(folder),
        instanceName="w",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    slave.callbacks = keeping(messages)
    given = {
        "type": fmi2CoSimulation,
        "guid": description.guid,
        "place": (folder / "resources").as_uri(),
    } | changed
    texts = [None if given[k] is None else given[k].encode() for k in ("guid", "place")]
    slave.component = slave.fmi2Instantiate(b"w", given["type"], *texts, slave.callbacks, 0, 0)
    return slave, messages


@pytest.fixture(scope="module", params=[False, True], ids=["native", "python"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    fmu = live.fmu_file(10, python=request.param)
    return unpacked(fmu, tmp_path_factory.mktemp("gate") / "x")


def test_a_place_that_is_a_plain_path_or_has_a_host_will_do(folder: Path) -> None:
    plain = str(folder / "resources")
    for place in (plain, f"file:{plain}", f"file://localhost{plain}", f"file://{plain}/"):
        slave, messages = instantiated(folder, place=place)
        assert slave.component, messages
        slave.freeInstance()


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"guid": "{00000000-0000-0000-0000-000000000000}"}, "come from different builds"),
        ({"guid": None}, "fmuGUID = missing"),
        ({"type": fmi2ModelExchange}, "fmuType is model exchange; this FMU is for co-simulation"),
        ({"place": "file:///no/such/50%25"}, "unpack the whole FMU and give the "),
        ({"place": None}, "fmuResourceLocation is missing"),
    ],
)
def test_what_is_not_this_fmu_is_refused(folder: Path, changed: dict[str, Any], said: str) -> None:
    slave, messages = instantiated(folder, **changed)
    assert not slave.component
    assert len(messages) == 1
    assert said in messages[0]


def test_a_folder_that_pythonfmu_cannot_read_is_refused(tmp_path: Path) -> None:
    fmu = live.fmu_file(10, python=True)
    slave, messages = instantiated(unpacked(fmu, tmp_path / "a%20b"))
    assert not slave.component
    assert "a%2520b/resources; pythonfmu 0.7.0 cannot read a folder with %20" in messages[0]


@KINDS
def test_a_refused_step_is_loud_and_no_wish_to_end(python: bool) -> None:
    file = live.fmu_file(10, python=python)
    with pytest.raises(FMICallException, match=r"fmi2DoStep failed with status 3 \(error\)"):
        simulate_fmu(str(file), stop_time=0.1, output_interval=1.5e-4)
    with LoadedFmu(file) as fmu:
        fmu.start(live.RATE)
        with pytest.raises(FMICallException, match="status 3"):
            fmu.slave.doStep(0.0, 1.5 / live.RATE)
        assert not fmu.slave.getBooleanStatus(fmi2Terminated)
        assert len(fmu.messages) == 1
        assert "a whole number of samples is needed" in fmu.messages[0]
        fmu.slave.doStep(0.0, 10 / live.RATE)


@KINDS
def test_each_instance_tells_its_own_importer(python: bool) -> None:
    file = live.fmu_file(10, python=python)
    with LoadedFmu(file) as first:
        first.start(live.RATE)
        with LoadedFmu(file) as second:
            second.start(live.RATE)
            with pytest.raises(FMICallException):
                first.slave.doStep(0.0, 1.5 / live.RATE)
            assert (len(first.messages), len(second.messages)) == (1, 0)
        with pytest.raises(FMICallException):
            first.slave.doStep(0.0, 2.5 / live.RATE)
        assert len(first.messages) == 2


FILES = pytest.mark.parametrize(
    "file",
    [live.fmu_file, partial(live.fmu_file, python=True), virtual_host.file],
    ids=["native", "python", "virtual"],
)


@FILES
def test_outputs_say_that_no_input_reaches_them_within_a_step(file: Any) -> None:
    assert validate_fmu(str(file(10))) == []
    outputs = read_model_description(str(file(10))).outputs
    assert len(outputs) > 10
    assert all(unknown.dependencies == [] for unknown in outputs)


@FILES
def test_outputs_stand_still_while_inputs_are_set(file: Any, tmp_path: Path) -> None:
    slave, _ = instantiated(unpacked(file(10), tmp_path / "x"))
    variables = read_model_description(str(file(10))).modelVariables
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    step = 10 / (virtual_host.RATE if file is virtual_host.file else live.RATE)
    reals = [v for v in variables if v.type == "Real"]
    taken = [v.valueReference for v in reals if v.causality == "output"]
    given = [v for v in reals if v.causality == "input"]
    for time in range(3):
        slave.doStep(time * step, step)
        before = slave.getReal(taken)
        middle = [0.5 * (float(v.min or 0.0) + float(v.max or 1.0)) for v in given]
        slave.setReal([v.valueReference for v in given], middle)
        np.testing.assert_array_equal(slave.getReal(taken), before)
    slave.freeInstance()


REUSED = """
#include <stdlib.h>
/* Takes over what exit handlers freed and fills it with shared pointers that have one owner and no
   table of functions. Registered before all libraries' handlers, so it is called after them. */
static void take(void) {
    for (int n = 0; n < 64; n++)
        for (size_t size = 24; size <= 4096; size += 16) {
            long *block = malloc(size);
            for (size_t i = 0; i < size / 8; i++) block[i] = i % 2 ? 0x100000001L : 0;
        }
}
__attribute__((constructor)) static void early(void) { atexit(take); }
"""


def test_an_importer_ends_in_order_whatever_becomes_of_freed_memory(tmp_path: Path) -> None:
    source, library = tmp_path / "reused.c", tmp_path / "reused.so"
    source.write_text(REUSED)
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, source], check=True)
    folder = unpacked(live.fmu_file(10, python=True), tmp_path / "fmu")
    code = HOST + "slave, _ = instance(Path(sys.argv[1])); slave.freeInstance(); print('freed')"
    done = subprocess.run(
        [sys.executable, "-c", code, folder],
        capture_output=True,
        text=True,
        env=os.environ | {"LD_PRELOAD": str(library)},
    )
    assert (done.returncode, done.stdout) == (0, "freed\n"), done.stderr
