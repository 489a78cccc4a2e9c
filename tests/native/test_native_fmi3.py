"""The FMU of FMI 3.0: valid, and number for number what that of FMI 2.0 shows."""

import itertools
import math
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from ctypes import c_bool, c_char_p, c_double, c_int32, c_uint
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
import pytest
from click.testing import CliRunner
from fmpy import read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave, fmi3IntermediateUpdateCallback, fmi3LogMessageCallback
from fmpy.util import read_csv
from fmpy.validation import validate_fmu

from tests.fmu import live
from tests.fmu.player import strain
from tests.native.test_native_fmu import REFUSED, SAMPLES, STEP, Host, frames
from tirebench.errors import FmuError
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile
from tirelib.cli.fmu import fmu as command
from tirelib.core.errors import FormatError
from tirelib.fmu.build import build_fmu
from tirelib.fmu.check import check_fmu
from tirelib.fmu.native import PLATFORMS, core_file
from tirelib.fmu.run import LoadedFmu

GAGES = 5
NO_UPDATE = fmi3IntermediateUpdateCallback(0)
FAULTS = ("well", "frozen", "gap", "spike", "saturated", "lost frame", "no speed", "standstill")


def built(out: Path, samples: int, fmi: int, **options: Any) -> Path:
    return build_fmu(
        live.calibration_file(),
        out,
        samples_per_step=samples,
        sample_rate=live.RATE,
        fmi=fmi,
        **options,
    )


@pytest.fixture(scope="session")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """Packed and unpacked FMUs of both versions."""
    place = tmp_path_factory.mktemp("fmi 3 & 2 ü")
    for fmi in (2, 3):
        built(place / f"{fmi}.fmu", SAMPLES, fmi)
        with zipfile.ZipFile(place / f"{fmi}.fmu") as archive:
            archive.extractall(place / f"{fmi}")
    return {fmi: place / f"{fmi}" for fmi in (2, 3)}


class Host3:
    """An instance of FMI 3.0, its variables by name, and what it said."""

    def __init__(self, folder: Path, *, events: bool = False, **changed: Any) -> None:
        about = read_model_description(str(folder), validate=False)
        self.said: list[str] = []
        self.variables = {v.name: v for v in about.modelVariables}
        self.outputs = [v for v in about.modelVariables if v.causality == "output"]
        self.slave = FMU3Slave(
            guid=about.guid,
            unzipDirectory=str(folder),
            instanceName="w",
            modelIdentifier="StrainTire",
        )
        self.log = fmi3LogMessageCallback(lambda *said: self.said.append(said[-1].decode()))
        given = {"token": about.guid, "place": f"{folder / 'resources'}/"} | changed
        texts = [None if given[k] is None else given[k].encode() for k in ("token", "place")]
        self.slave.component = self.slave.fmi3InstantiateCoSimulation(
            b"w", *texts, False, False, events, False, None, 0, None, self.log, NO_UPDATE
        )

    def at(self, name: str) -> list[int]:
        return [self.variables[name].valueReference]

    def start(self, **parameters: str | float) -> "Host3":
        for name, value in parameters.items():
            put = self.slave.setString if isinstance(value, str) else self.slave.setFloat64
            put(self.at(name), [value])
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        return self

    def step(
        self,
        frame: np.ndarray,
        conditions: np.ndarray,
        *,
        valid: bool = True,
        step: float = STEP,
        now: float = 0.0,
    ) -> tuple[Any, ...]:
        self.slave.setFloat64(self.at("strain"), frame.T.ravel().tolist())
        first = self.at("speed")[0]
        references = [first + i for i in range(conditions.size)]
        self.slave.setFloat64(references, conditions.tolist())
        self.slave.setBoolean(self.at("frame_valid"), [valid])
        found: tuple[Any, ...] = self.slave.doStep(now, step)
        return found

    def get(self, name: str) -> list[Any]:
        variable = self.variables[name]
        getter = getattr(self.slave, f"get{variable.type}")
        size = math.prod(variable.shape or (1,))
        found: list[Any] = getter([variable.valueReference], nValues=size)
        return found

    def show(self) -> tuple[list[float], list[Any]]:
        """Return Real outputs and the others, arrays flattened, as `Host` does."""
        shown = [(v.type, self.get(v.name)) for v in self.outputs if v.type != "Clock"]
        reals = [x for kind, values in shown if kind == "Float64" for x in values]
        return reals, [x for kind, values in shown if kind != "Float64" for x in values]


def played(kind: str) -> Iterator[tuple[np.ndarray, np.ndarray, bool]]:
    """Frames of a wheel with a fault: samples, conditions, whether the frame came."""
    for at, (frame, conditions) in enumerate(frames("frozen" if kind == "frozen" else "well")):
        seen, held, late = frame.copy(), conditions.copy(), at > 60
        if kind == "gap" and at in (70, 110, 111, 112):
            seen[:, 3:7] = math.nan
        elif kind == "spike" and at in (65, 108):
            seen[2, 9] += 0.02
        elif kind == "saturated" and late:
            seen = np.clip(seen, -1e-3, 1.5e-3)
        elif kind == "no speed" and late:
            held[0] = math.nan
        elif kind == "standstill" and late:
            seen = np.repeat(seen[:, :1], SAMPLES, axis=1)
        yield seen, held, not (kind == "lost frame" and at in (70, 105))


def test_it_is_valid_checks_itself_and_is_the_same_bytes_again(
    fmus: dict[int, Path], tmp_path: Path
) -> None:
    packed = fmus[3].parent / "3.fmu"
    assert validate_fmu(str(packed)) == []
    document = check_fmu(packed)
    assert document["passed"], document["parts"]
    assert document["compared"]
    assert "contact_length[5]" in {row["name"] for row in document["variables"]}
    assert built(tmp_path / "again.fmu", SAMPLES, 3).read_bytes() == packed.read_bytes()
    folders = {path.name for path in (fmus[3] / "binaries").iterdir()}
    assert folders == {folder for named in PLATFORMS[3].values() for folder in named}


@pytest.mark.parametrize("kind", FAULTS)
def test_it_shows_what_the_fmu_of_fmi_2_shows(fmus: dict[int, Path], kind: str) -> None:
    old, new = Host(fmus[2]).start(), Host3(fmus[3]).start()
    valid = 0
    for frame, conditions, came in played(kind):
        old.slave.setBoolean([old.at["frame_valid"]], [came])
        old.step(frame, conditions)
        new.step(frame, conditions, valid=came)
        shown, wanted = new.show(), old.show()
        np.testing.assert_allclose(shown[0], wanted[0], rtol=1e-12, atol=0.0)
        assert shown[1] == wanted[1]
        valid += bool(wanted[1][2])
    assert valid
    assert new.said == old.said


@pytest.mark.parametrize("samples", [1, 10])
def test_a_recorded_run_is_the_same_in_both(tmp_path: Path, samples: int) -> None:
    """The reference signals inside, a measured turn again and again, in FMPy's `simulate_fmu`."""
    results = {}
    given = None
    for fmi in (3, 2):
        path = built(tmp_path / f"{fmi}.fmu", samples, fmi)
        with zipfile.ZipFile(path) as archive:
            archive.extract("resources/reference/StrainTire_in.csv", tmp_path)
        if given is None:
            given = read_csv(tmp_path / "resources/reference/StrainTire_in.csv")
        results[fmi] = simulate_fmu(
            str(path),
            stop_time=given["time"][-1],
            output_interval=samples / live.RATE,
            input=given if fmi == 3 else flat(given, samples),
        )
    old, new = results[2], results[3]
    assert len(new) == len(old)
    for name in new.dtype.names:
        numbered = [old[f"{name}_{gage}"] for gage in range(1, 6) if f"{name}_1" in old.dtype.names]
        wanted = np.stack(numbered, axis=1) if numbered else old[name]
        np.testing.assert_allclose(new[name], wanted, rtol=1e-12, atol=0.0, err_msg=name)
    assert new["valid"].any()


def flat(given: np.ndarray, samples: int) -> np.ndarray:
    """Return the input of FMI 2.0: a column for each element of the array."""
    columns: dict[str, np.ndarray] = {}
    for name in given.dtype.names:
        if name == "strain":
            for at in range(samples * GAGES):
                sample, gage = divmod(at, GAGES)
                number = f"{gage + 1}" if samples == 1 else f"{sample + 1}_{gage + 1}"
                columns[f"strain_{number}"] = given["strain"][:, at]
        else:
            columns[name] = given[name]
    found = np.empty(len(given), dtype=[(name, np.float64) for name in columns])
    for name, values in columns.items():
        found[name] = values
    return found


def test_the_buffer_is_the_same_in_both(tmp_path: Path) -> None:
    shown = []
    counts = [10, 0, 7, 10, 3]
    samples = strain()
    for fmi in (2, 3):
        path = built(tmp_path / f"{fmi}.fmu", 10, fmi, buffered=True)
        with zipfile.ZipFile(path) as archive:
            archive.extractall(tmp_path / f"{fmi}")
        host: Any = Host(tmp_path / "2") if fmi == 2 else Host3(tmp_path / "3")
        host.start()
        first, seen = 0, []
        for count in itertools.cycle(counts):
            if first + count > samples.shape[1]:
                break
            frame = np.zeros((GAGES, 10))
            frame[:, :count] = samples[:, first : first + count]
            conditions = frames()[0][1]
            if fmi == 2:
                host.slave.setInteger([host.at["samples"]], [count])
            else:
                host.slave.setInt32(host.at("samples"), [count])
            host.step(frame, conditions, step=0.00123)
            first += count
            seen.append(repr(host.show()))
        shown.append(seen)
    assert shown[0] == shown[1]


def test_the_clock_ticks_once_where_a_turn_has_ended(fmus: dict[int, Path]) -> None:
    host = Host3(fmus[3], events=True).start()
    clock = host.at("turn_ended")
    assert host.slave.getClock(clock) == [False]
    with pytest.raises(FMICallException):  # Event Mode comes first
        host.step(*frames()[0])
    host.slave.updateDiscreteStates()
    host.slave.enterStepMode()
    turns = ticks = 0
    for at, frame in enumerate(frames()):
        event, end, early, reached = host.step(*frame, now=at * STEP)
        assert not end
        assert not early
        assert reached == at * STEP + STEP
        assert host.get("time") == [reached]
        now = host.get("turn")[0]
        assert event == (now != turns)
        assert host.slave.getClock(clock) == [False]  # in Step Mode
        if event:
            state = host.slave.getFMUState()
            host.slave.setFMUState(state)  # an event that was not handled stays one
            host.slave.freeFMUState(state)
            host.slave.enterEventMode()
            assert host.slave.getClock(clock) == [True]
            assert host.slave.updateDiscreteStates()[0] is False
            assert host.slave.getClock(clock) == [False]
            host.slave.enterStepMode()
            ticks += 1
        turns = now
    assert ticks == turns >= 3
    late = Host3(fmus[3], events=True)  # an event that was handled is none in another instance
    state = host.slave.serializeFMUState(host.slave.getFMUState())
    late.slave.setFMUState(late.slave.deserializeFMUState(state))
    assert late.step(*frames()[-1], now=len(frames()) * STEP)[0] is False


def test_without_event_mode_there_are_no_events(fmus: dict[int, Path]) -> None:
    host = Host3(fmus[3]).start()
    assert not any(host.step(*frame)[0] for frame in frames())
    assert host.get("turn")[0] >= 3
    with pytest.raises(FMICallException):
        host.slave.enterEventMode()
    assert "read `turn` after each step instead" in host.said[-1]


def test_fmpy_handles_the_events(tmp_path: Path) -> None:
    """`simulate_fmu` with event mode takes another sample at each event, and ends the same."""
    path = built(tmp_path / "x.fmu", 10, 3)
    with zipfile.ZipFile(path) as archive:
        archive.extract("resources/reference/StrainTire_in.csv", tmp_path)
    given = read_csv(tmp_path / "resources/reference/StrainTire_in.csv")
    known = [n for n in given.dtype.names if not np.isnan(given[n]).any()]  # NaN is always new
    common: dict[str, Any] = {
        "stop_time": given["time"][-1],
        "output_interval": 10 / live.RATE,
        "input": given[known],
    }
    plain = simulate_fmu(str(path), **common)
    events = simulate_fmu(str(path), use_event_mode=True, **common)
    assert len(events) > len(plain)
    assert repr(events[-1].tolist()) == repr(plain[-1].tolist())


def test_states_go_back_and_forth(fmus: dict[int, Path]) -> None:
    host = Host3(fmus[3]).start()
    shown, states = [], []
    for number, frame in enumerate(frames()):
        states.append(host.slave.serializeFMUState(host.slave.getFMUState()))
        host.step(*frame, now=number * STEP)
        shown.append(repr(host.show()))
    late = Host3(fmus[3])
    for at in (70, 5):
        late.slave.setFMUState(late.slave.deserializeFMUState(states[at]))
        assert late.get("time") == [(at - 1) * STEP + STEP]
        for number, frame in enumerate(frames()[at : at + 40], start=at):
            late.step(*frame)
            assert repr(late.show()) == shown[number]
    damaged = bytearray(states[50])
    damaged[-100] ^= 1
    with pytest.raises(FMICallException):
        late.slave.setFMUState(late.slave.deserializeFMUState(bytes(damaged)))
    assert "not a saved state of this FMU" in late.said[-1]
    host.slave.reset()
    host.start().step(*frames()[0])
    assert repr(host.show()) == shown[0]


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_are_those_of_fmi_2(fmus: dict[int, Path], name: str) -> None:
    value, said = REFUSED[name]
    old, new = Host(fmus[2]), Host3(fmus[3])
    for host in (old, new):
        with pytest.raises(FMICallException):
            host.start(**{name: value})
    assert said in new.said[-1]
    assert new.said == old.said
    new.slave.reset()
    new.start()


def test_what_cannot_be_done_is_an_error_and_the_instance_lives(fmus: dict[int, Path]) -> None:
    host, frame = Host3(fmus[3]), frames()[0]
    with pytest.raises(FMICallException):
        host.step(*frame)
    assert "call exitInitializationMode first" in host.said[-1]
    host.start(missing=0.0)
    assert set(host.show()[0]) == {0.0}
    slave, first = host.slave, host.at("strain")[0]
    for act, said in (
        (lambda: slave.setFloat64([first + 1], [0.0]), "this is an element of an array"),
        (lambda: slave.setFloat64([first], [0.0]), f"have {SAMPLES * GAGES} values"),
        (lambda: slave.setFloat64(host.at("Fz"), [1.0]), "outputs never"),
        (lambda: slave.setFloat64(host.at("missing"), [1.0]), "before initialisation only"),
        (lambda: slave.getFloat64(host.at("turn")), "is not of type Float64"),
        (lambda: slave.getInt32(host.at("strain"), nValues=SAMPLES * GAGES), "strain is not of"),
        (lambda: slave.getFloat64([10**6]), "value reference = 1000000"),
        (lambda: slave.getClock(host.at("turn")), "is no clock"),
        (lambda: host.step(*frame, step=1.5 / live.RATE), "a whole number of samples"),
    ):
        with pytest.raises(FMICallException):
            act()
        assert said in host.said[-1]
    for name in ("Float32", "Int64", "UInt8"):
        with pytest.raises(FMICallException):
            getattr(slave, f"get{name}")(host.at("turn"))
    host.step(*frame)
    slave.terminate()
    with pytest.raises(FMICallException):
        host.step(*frame)


def test_a_null_pointer_is_an_error_and_not_the_end_of_the_importer(fmus: dict[int, Path]) -> None:
    host = Host3(fmus[3], events=True).start()
    slave, some = host.slave, (c_uint * 1)(*host.at("speed"))
    state = slave.getFMUState()
    no = (None,) * 5
    calls: list[Callable[[], int]] = [
        lambda: slave.fmi3SerializeFMUState(slave.component, state, None, 10**8),
        lambda: slave.fmi3UpdateDiscreteStates(slave.component, *no, None),
        lambda: slave.fmi3GetClock(slave.component, None, 1, (c_bool * 1)()),
        lambda: slave.fmi3GetClock(slave.component, some, 1, None),
    ]
    for kind, number in (("Float64", c_double), ("Int32", c_int32), ("Boolean", c_bool)):
        for call in (getattr(slave, f"fmi3{do}{kind}") for do in ("Get", "Set")):
            calls.append(partial(call, slave.component, None, 1, (number * 1)(), 1))
            calls.append(partial(call, slave.component, some, 1, None, 1))
    for call in (slave.fmi3GetString, slave.fmi3SetString):
        calls.append(partial(call, slave.component, None, 1, (c_char_p * 1)(b""), 1))
        calls.append(partial(call, slave.component, some, 1, None, 1))
    for act in calls:
        with pytest.raises(FMICallException):
            act()
    assert host.said[0].startswith("a null pointer; 1 value references")
    slave.enterStepMode()
    with pytest.raises(FMICallException):
        slave.fmi3DoStep(slave.component, 0.0, STEP, True, None, None, None, None)
    host.step(*frames()[0])


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"token": "{0}"}, "instantiationToken = {0}; that of this FMU is"),
        ({"token": None}, "instantiationToken = missing"),
        ({"place": None}, "resourcePath is missing"),
        ({"place": "/nowhere/"}, "unpack the whole FMU"),
    ],
)
def test_what_is_not_this_fmu_is_not_instantiated(
    fmus: dict[int, Path], changed: dict[str, Any], said: str
) -> None:
    host = Host3(fmus[3], **changed)
    assert not host.slave.component
    assert said in host.said[-1]


def test_another_calibration_and_other_axes_can_be_given(
    fmus: dict[int, Path], tmp_path: Path
) -> None:
    table = tmp_path / "another.table"
    table.write_bytes(core_file(live.calibration()))
    hosts = [
        Host(fmus[2]).start(calibration=str(table), axes="sae"),
        Host3(fmus[3]).start(calibration=str(table), axes="sae"),
    ]
    for frame in frames():
        for host in hosts:
            host.step(*frame)
    assert repr(hosts[0].show()) == repr(hosts[1].show())
    assert hosts[1].show()[1][2]


def test_an_importer_that_compiles_the_sources_finds_all_of_them(
    fmus: dict[int, Path], tmp_path: Path
) -> None:
    root = Xml.parse(fmus[3] / "sources" / "buildDescription.xml").getroot()
    files = [str(file.get("name")) for file in root.iter("SourceFile")]
    inside = {p.relative_to(fmus[3] / "sources").as_posix() for p in fmus[3].rglob("*.c")}
    assert set(files) == inside
    library = tmp_path / "StrainTire.so"
    flags = ["gcc", "-O0", "-shared", "-fPIC", "-ffp-contract=off"]
    subprocess.run([*flags, *files, "-lm", "-o", library], check=True, cwd=fmus[3] / "sources")
    symbols = subprocess.run(
        ["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True
    ).stdout
    assert sum("fmi3" in line for line in symbols.splitlines()) == 75
    assert "fmi2" not in symbols


def test_the_command_builds_it_and_what_steps_fmi_2_only_says_so(tmp_path: Path) -> None:
    out = tmp_path / "x.fmu"
    words = f"build --calibration {live.calibration_file()} --out {out} --fmi 3"
    found = CliRunner().invoke(command, words.split())
    assert found.exit_code == 0, found.output
    assert read_model_description(str(out)).fmiVersion == "3.0"
    with pytest.raises(FormatError, match="this command steps FMI"):
        LoadedFmu(out)
    with pytest.raises(FmuError, match="an FMU of FMI"):
        FmuFile(read_fmu(out))
    both = CliRunner().invoke(command, [*words.split(), "--python"])
    assert "allowed are 2, and 3 without --python" in str(both.exception)
