"""The FMU without Python: valid, of the sources' hash, and step by step what the library shows."""

import importlib.util
import math
import subprocess
import sys
import zipfile
from collections.abc import Callable
from ctypes import c_char_p, c_double, c_int, c_uint
from functools import partial
from pathlib import Path
from typing import Any

import native_fmu
import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CoSimulation, fmi2ModelExchange
from fmpy.validation import validate_fmu

from tests.fmu import live
from tirelib.core.held import HELD
from tirelib.estimators.core_table import flat_table
from tirelib.fmu.build import build_fmu
from tirelib.fmu.native import BINARIES, core_file, resource_file
from tirelib.fmu.run import keeping
from tirelib.fmu.wheel import Wheel

ROOT = Path(__file__).parents[2]
GATE = "gate/linux64.so"
SAMPLES = 20
STEP = SAMPLES / live.RATE


@pytest.fixture(scope="session")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("native") / "StrainTire.fmu"
    return build_fmu(live.calibration_file(), out, samples_per_step=SAMPLES, sample_rate=live.RATE)


@pytest.fixture(scope="session")
def folder(fmu: Path) -> Path:
    place = fmu.parent / "50% Prüfstand #1"
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(place)
    return place


class Host:
    """An instance, its variables by name, and what it said."""

    def __init__(self, folder: Path, **changed: Any) -> None:
        about = read_model_description(str(folder), validate=False)
        self.said: list[str] = []
        self.at = {v.name: v.valueReference for v in about.modelVariables}
        self.outputs = [v for v in about.modelVariables if v.causality == "output"]
        self.slave = FMU2Slave(
            guid=about.guid,
            unzipDirectory=str(folder),
            instanceName="w",
            modelIdentifier="StrainTire",
        )
        self.slave.callbacks = keeping(self.said)
        given = {
            "type": fmi2CoSimulation,
            "guid": about.guid,
            "place": (folder / "resources").as_uri(),
        } | changed
        texts = [None if given[k] is None else given[k].encode() for k in ("guid", "place")]
        self.slave.component = self.slave.fmi2Instantiate(
            b"w", given["type"], *texts, self.slave.callbacks, 0, 0
        )

    def start(self, **parameters: str | float) -> "Host":
        for name, value in parameters.items():
            put = self.slave.setString if isinstance(value, str) else self.slave.setReal
            put([self.at[name]], [value])
        self.slave.setupExperiment()
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        return self

    def step(self, frame: np.ndarray, conditions: np.ndarray, *, step: float = STEP) -> None:
        first = self.at["strain_1_1"]
        values = [*frame.T.ravel().tolist(), *conditions.tolist()]
        self.slave.setReal([first + i for i in range(len(values))], values)
        self.slave.doStep(0.0, step)

    def show(self) -> tuple[list[float], list[Any]]:
        """Return Real outputs and the others."""
        get = {
            "Real": self.slave.getReal,
            "Integer": self.slave.getInteger,
            "Boolean": lambda r: [bool(x) for x in self.slave.getBoolean(r)],
            "String": lambda r: [x.decode() for x in self.slave.getString(r)],
        }
        shown = [(v.type, get[v.type]([v.valueReference])[0]) for v in self.outputs]
        reals = [value for kind, value in shown if kind == "Real"]
        return reals, [value for kind, value in shown if kind != "Real"]


def frames(kind: str = "well") -> list[tuple[np.ndarray, np.ndarray]]:
    strain = live.strain_of(4e3, 0.1, turns=4.4)[0]
    if kind == "frozen":
        strain[1, 1200:] = strain[1, 1200]
    found = []
    for start in range(0, strain.shape[1] - SAMPLES, SAMPLES):
        known = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
        if start > 1600:
            known["friction"] = 0.8
        conditions = np.array([known.get(name, math.nan) for name in HELD])
        found.append((strain[:, start : start + SAMPLES], conditions))
    return found


def same(shown: tuple[Any, Any], wanted: tuple[Any, Any]) -> None:
    np.testing.assert_allclose(shown[0], wanted[0], rtol=1e-9, atol=1e-9)
    assert shown[1] == list(wanted[1])


def test_it_is_valid_and_the_same_bytes_again(fmu: Path, tmp_path: Path) -> None:
    assert validate_fmu(str(fmu)) == []
    again = build_fmu(
        live.calibration_file(),
        tmp_path / "again.fmu",
        samples_per_step=SAMPLES,
        sample_rate=live.RATE,
    )
    assert again.read_bytes() == fmu.read_bytes()
    assert fmu.stat().st_size < 1e6


def test_its_variables_are_those_of_the_python_fmu(fmu: Path) -> None:
    native, python = (
        read_model_description(str(path)) for path in (fmu, live.fmu_file(SAMPLES, python=True))
    )
    for own, other in zip(native.modelVariables, python.modelVariables, strict=True):
        for name in (
            *("name", "valueReference", "type", "causality", "variability", "description"),
            *("unit", "displayUnit", "min", "max", "nominal", "start"),
        ):
            assert getattr(own, name) == getattr(other, name), (own.name, name)


@pytest.mark.parametrize("axes", ["iso", "sae"])
def test_it_shows_what_the_library_shows(folder: Path, axes: str) -> None:
    host = Host(folder).start(axes=axes)
    wheel = Wheel(live.calibration(), live.RATE, SAMPLES, axes)
    same(host.show(), wheel.outputs())
    for frame, conditions in frames():
        host.step(frame, conditions)
        wheel.step(frame.T.ravel().tolist(), STEP, True, *conditions.tolist())
        same(host.show(), wheel.outputs())
    assert wheel.outputs()[1][2]
    assert host.said == []


def test_states_go_back_and_forth_and_instances_do_not_meet(folder: Path) -> None:
    host, other = Host(folder).start(), Host(folder).start(axes="sae")
    shown, states = [], []
    for well, frozen in zip(frames(), frames("frozen"), strict=True):
        states.append(host.slave.serializeFMUstate(host.slave.getFMUstate()))
        host.step(*well)
        other.step(*frozen)
        shown.append(repr(host.show()))
    late = Host(folder)  # another instance, not even started
    for at in (70, 5, 30):
        late.slave.setFMUState(late.slave.deSerializeFMUstate(states[at]))
        for number, frame in enumerate(frames()[at : at + 40], start=at):
            late.step(*frame)
            assert repr(late.show()) == shown[number]
    host.slave.reset()
    host.start()
    host.step(*frames()[0])
    assert repr(host.show()) == shown[0]


def test_what_is_no_state_of_this_fmu_is_refused_and_changes_nothing(
    folder: Path, tmp_path: Path
) -> None:
    host, calm = Host(folder).start(), Host(folder).start()
    for number, frame in enumerate(frames()):
        host.step(*frame)
        calm.step(*frame)
        if number == 50:
            state = host.slave.serializeFMUstate(host.slave.getFMUstate())
    other = build_fmu(
        live.calibration_file(), tmp_path / "o.fmu", samples_per_step=SAMPLES, sample_rate=8e3
    )
    with zipfile.ZipFile(other) as archive:
        archive.extractall(tmp_path / "o")
    strange = Host(tmp_path / "o").start(sample_rate=live.RATE)
    strange.step(*frames()[0])
    wrong = [b"", state[:1000], state[:-1], state + b"\0", bytes(len(state))]
    wrong.append(strange.slave.serializeFMUstate(strange.slave.getFMUstate()))
    for at in (0, 4000, 30000, len(state) // 2, len(state) - 100, len(state) - 1):
        damaged = bytearray(state)
        damaged[at] ^= 1
        wrong.append(bytes(damaged))
    for bytes_ in wrong:
        with pytest.raises(FMICallException):
            host.slave.setFMUState(host.slave.deSerializeFMUstate(bytes_))
        assert "not a saved state of this FMU" in host.said[-1]
        assert repr(host.show()) == repr(calm.show())
    for frame in frames()[:30]:
        host.step(*frame)
        calm.step(*frame)
        assert repr(host.show()) == repr(calm.show())


REFUSED = {
    "axes": ("iso8855", "allowed are adapted_sae, iso, sae"),
    "tire": ("another", "calibrate on a campaign of this tire"),
    "calibration": ("/nowhere/100%.table", "/nowhere/100%.table: cannot be read"),
    "filter_order": (30.0, "another low-pass would bias it"),
    "missing": (math.inf, "allowed are NaN and finite numbers"),
    "sample_rate": (10.0, "allowed are 100 .. 100000 Hz"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_parameter_that_cannot_be_is_refused_and_a_reset_heals(folder: Path, name: str) -> None:
    value, said = REFUSED[name]
    host = Host(folder)
    with pytest.raises(FMICallException):
        host.start(**{name: value})
    assert said in host.said[-1].replace("%%", "%")
    host.slave.reset()
    host.start()


def test_what_cannot_be_done_is_an_error_and_the_instance_lives(folder: Path) -> None:
    host, frame = Host(folder), frames()[0]
    with pytest.raises(FMICallException):
        host.step(*frame)
    assert "call exitInitializationMode first" in host.said[-1]
    assert host.show()[1][-1].startswith("step_refused: the FMU is not initialised")
    host.start(missing=0.0)
    assert set(host.show()[0]) == {0.0}
    for step in (0.0, 1.5 / live.RATE, 4.0, math.nan):
        with pytest.raises(FMICallException):
            host.step(*frame, step=step)
        assert host.show()[1][-1].startswith("step_refused: communication step = ")
    for act in (
        lambda: host.slave.setReal([host.at["Fz"]], [1.0]),
        lambda: host.slave.setReal([host.at["sample_rate"]], [1.0]),
        lambda: host.slave.getReal([host.at["turn"]]),
        lambda: host.slave.getReal([10**6]),
    ):
        with pytest.raises(FMICallException):
            act()
    told = len(host.said)
    for _ in range(200):
        with pytest.raises(FMICallException):
            host.step(*frame, step=0.0)
    assert len(host.said) - told == 2  # the 10th and the 100th time
    host.step(*frame)
    assert host.show()[1][-1] == "first_turn"
    host.slave.terminate()
    with pytest.raises(FMICallException):
        host.step(*frame)


def test_a_null_pointer_is_an_error_and_not_the_end_of_the_importer(folder: Path) -> None:
    host = Host(folder).start()
    slave, some = host.slave, (c_uint * 1)(host.at["speed"])
    state = slave.getFMUstate()
    calls: list[Callable[[], int]] = [
        lambda: slave.fmi2SerializeFMUstate(slave.component, state, None, 10**8),
        lambda: slave.fmi2GetBooleanStatus(slave.component, 3, None),
    ]
    for kind, number in (("Real", c_double), ("Integer", c_int), ("Boolean", c_int)):
        for call in (getattr(slave, f"fmi2{do}{kind}") for do in ("Get", "Set")):
            calls.append(partial(call, slave.component, None, 1, (number * 1)()))
            calls.append(partial(call, slave.component, some, 1, None))
    for call in (slave.fmi2GetString, slave.fmi2SetString):
        calls.append(partial(call, slave.component, None, 1, (c_char_p * 1)(b"")))
        calls.append(partial(call, slave.component, some, 1, None))
    for act in calls:
        with pytest.raises(FMICallException):
            act()
    assert host.said[0].startswith("a null pointer; 1 value references")
    assert len(host.said) == 2  # the 10th time as well
    host.step(*frames()[0])


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"guid": "{0}"}, "come from different builds"),
        ({"guid": None}, "fmuGUID = missing"),
        ({"type": fmi2ModelExchange}, "fmuType is model exchange"),
        ({"place": None}, "fmuResourceLocation is missing"),
        ({"place": "file:///nowhere"}, "unpack the whole FMU"),
    ],
)
def test_what_is_not_this_fmu_is_not_instantiated(
    folder: Path, changed: dict[str, Any], said: str
) -> None:
    host = Host(folder, **changed)
    assert not host.slave.component
    assert said in host.said[-1]


def test_another_calibration_of_the_tire_can_be_given(folder: Path, tmp_path: Path) -> None:
    table = tmp_path / "another.table"
    table.write_bytes(core_file(live.calibration()))
    host = Host(folder).start(calibration=str(table))
    for frame in frames():
        host.step(*frame)
    assert host.show()[1][2]


@pytest.mark.parametrize("at", [-16, -4000, 17, 40, 54, 70])
def test_another_calibration_with_one_wrong_bit_is_refused(
    folder: Path, tmp_path: Path, at: int
) -> None:
    table, written = tmp_path / "another.table", bytearray(core_file(live.calibration()))
    written[at] ^= 1
    table.write_bytes(written)
    host = Host(folder)
    with pytest.raises(FMICallException):
        host.start(calibration=str(table))
    assert "another.table: is damaged; give a file made by" in host.said[-1]


def test_another_calibration_written_before_it_held_a_hash_is_taken(
    folder: Path, tmp_path: Path
) -> None:
    known, table = live.calibration(), tmp_path / "another.table"
    table.write_bytes(resource_file(known.tire, flat_table(known)))
    Host(folder).start(calibration=str(table))
    table.write_bytes(table.read_bytes()[:-8])
    host = Host(folder)
    with pytest.raises(FMICallException):
        host.start(calibration=str(table))
    assert "is damaged" in host.said[-1]


@pytest.mark.parametrize("at", [-16, 17, 60], ids=["a number", "the hash", "a name"])
def test_data_with_one_wrong_bit_are_refused(folder: Path, tmp_path: Path, at: int) -> None:
    core = tmp_path / "StrainTire.core"
    written = bytearray((folder / "resources" / core.name).read_bytes())
    written[at] ^= 1
    core.write_bytes(written)
    host = Host(folder, place=tmp_path.as_uri())
    assert not host.slave.component
    assert "StrainTire.core is damaged; unpack the whole FMU" in host.said[-1]


def test_data_written_before_they_held_a_hash_are_taken(folder: Path, tmp_path: Path) -> None:
    core = tmp_path / "StrainTire.core"
    first, _, rest = (folder / "resources" / core.name).read_bytes().partition(b"\n")
    core.write_bytes(first.split()[0] + b"\n" + rest)
    Host(folder, place=tmp_path.as_uri()).start()


@pytest.mark.parametrize("place", [*(f"binaries/{name}" for name in BINARIES), GATE])
def test_the_binaries_were_made_from_the_sources(place: str) -> None:
    said = f"source sha256 {native_fmu.BINARIES[place].source_hash()}".encode()
    assert said in (ROOT / "fmu_src" / place).read_bytes(), "run python build/native_fmu.py"


@pytest.mark.parametrize("place", [*(f"binaries/{name}" for name in BINARIES), GATE])
def test_the_compiler_makes_the_same_binary_again(place: str) -> None:
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("ziglang is not installed: only who makes the binaries needs it")
    assert native_fmu.BINARIES[place].compiled() == (ROOT / "fmu_src" / place).read_bytes()


def test_a_process_without_python_needs_nothing(folder: Path, tmp_path: Path) -> None:
    """The library needs the C library alone; a C program loads, steps and leaves it."""
    c_host(folder, "StrainTire", tmp_path, 0.004)


def c_host(folder: Path, model: str, tmp_path: Path, step: float) -> None:
    """Load an unpacked FMU in a C program, take two steps, and leave."""
    library = folder / "binaries" / "linux64" / f"{model}.so"
    if sys.platform != "linux":
        pytest.skip("the host is for Linux")
    source = tmp_path / "host.c"
    source.write_text(_HOST)
    subprocess.run(["gcc", "-O1", str(source), "-ldl", "-o", str(tmp_path / "host")], check=True)
    guid = read_model_description(str(folder), validate=False).guid
    place = (folder / "resources").as_uri()
    command = [tmp_path / "host", library, guid, place, repr(step)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "0 0 0\n", "")


_HOST = """
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
typedef struct { void *log, *take, *give, *done, *environment; } Callbacks;
int main(int n, char **argument) {
    Callbacks none = {0};
    void *library = dlopen(argument[1], RTLD_NOW);
    if (n < 5 || !library) return fprintf(stderr, "%s", dlerror()), 1;
    void *(*make)(const char *, int, const char *, const char *, void *, int, int);
    int (*start)(void *), (*step)(void *, double, double, int);
    void (*leave)(void *);
    *(void **)&make = dlsym(library, "fmi2Instantiate");
    *(void **)&start = dlsym(library, "fmi2ExitInitializationMode");
    *(void **)&step = dlsym(library, "fmi2DoStep");
    *(void **)&leave = dlsym(library, "fmi2FreeInstance");
    void *wheel = make("w", 1, argument[2], argument[3], &none, 0, 0);
    if (!wheel) return 2;
    printf("%d ", start(wheel));
    double length = atof(argument[4]);
    printf("%d ", step(wheel, 0.0, length, 0));
    printf("%d\\n", step(wheel, length, length, 0));
    leave(wheel);
    return dlclose(library);
}
"""
