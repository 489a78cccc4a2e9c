"""What a run says and waits for before its first frame."""

import io
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner
from rich.console import Console

from tests.bench.clocks import Clock
from tests.bench.conftest import Spawn
from tests.bench.programs import A_TURN, PATIENCE
from tests.bench.sources import serial, vehicle
from tests.bench.test_user_line import THREE, plan_of
from tirebench.cli import program
from tirebench.cli.run_inputs import (
    RunInputs,
    conditions_of,
    port_of_file,
    say_missing,
    wait_for_file,
)
from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, LinkError, UnpluggedError
from tirebench.estimator.chain import Outputs
from tirebench.estimator.estimation import Estimation
from tirebench.links import BACK, Link, Read
from tirebench.links.opening import PortPlan
from tirebench.links.reconnecting import ReconnectingLink
from tirebench.setup.source_plan import SourcePlan, wheels_of
from tirebench.wire.conditions import TELLABLE, UNITS, Condition, Conditions
from tirelib.core.arrays import FloatArray
from tirelib.core.held import HELD
from tirelib.core.units import to_si

ROAD = {"friction": 0.9, "tread_depth": 0.008, "tread_temperature": 313.15}


def said(given: RunInputs, *needed: str, knows_tire: bool = True) -> str:
    calibration: Any = SimpleNamespace(needed=needed, knows_tire=knows_tire)
    console = Console(record=True, width=400, quiet=False, file=None)
    with console.capture() as captured:
        say_missing(given, calibration, console)
    return captured.get()


def test_a_condition_that_the_calibration_needs_is_missed_before_the_first_turn() -> None:
    sources: tuple[SourcePlan, ...] = (serial("a", 0),)
    text = said(RunInputs(sources, Conditions.constant(18.0), ()), "pressure", "camber")
    assert "WARNING: no camber: the calibration needs it, so NO TURN WILL BE VALID" in text
    assert "give --camber DEG, --conditions FILE, or a map with [camber]" in text
    assert "WARNING: no pressure" in text
    assert "speed" not in text


def test_what_only_makes_it_worse_is_a_note() -> None:
    text = said(
        RunInputs((serial("a", 0),), Conditions.constant(pressure=2e5, camber=0.0, **ROAD), ())
    )
    assert text.startswith(
        "note: no speed: the slip ratio cannot be estimated, so no turn is valid"
    )
    assert (
        "Fz, alpha and Fy are estimated, and --json has the validity of each; give --speed" in text
    )
    assert text.count("\n") == 1


def test_a_camber_that_nobody_gives_is_said_with_what_it_costs() -> None:
    text = said(RunInputs((serial("a", 0),), Conditions.constant(18.0, pressure=2e5, **ROAD), ()))
    assert text.startswith("note: no camber: standard deviations of Fy and alpha grow by the")
    assert "turns where camber dominates carry the flag camber_unknown; give --camber DEG" in text
    assert text.count("\n") == 1


@pytest.mark.parametrize("name", ROAD)
def test_an_unknown_road_or_tread_is_said_with_its_option(name: str) -> None:
    known = {other: value for other, value in ROAD.items() if other != name}
    given = Conditions.constant(18.0, pressure=2e5, camber=0.0, **known)
    text = said(RunInputs((serial("a", 0),), given, ()))
    assert text.startswith(f"note: no {name}: standard deviations")
    assert f"give --condition {name}=" in text
    assert text.count("\n") == 1


def test_a_calibration_that_cannot_notice_another_tire_is_said() -> None:
    everything = Conditions.constant(18.0, pressure=2e5, camber=0.0, **ROAD)
    given = RunInputs((serial("a", 0),), everything, ())
    assert said(given) == ""
    text = said(given, knows_tire=False)
    assert text.startswith("note: this calibration cannot detect that another tire is on the wheel")


def test_what_a_bus_tells_is_not_missed_but_for_the_wheels_it_leaves_out() -> None:
    sources = (serial("a", 0), serial("b", 3), vehicle("c"))  # pressure of wheel 3, speed of all
    text = said(RunInputs(sources, Conditions.constant(camber=0.0), ()), "pressure")
    assert "WARNING: no pressure of wheel 0: the calibration" in text
    assert "speed" not in text
    assert (
        said(RunInputs(sources[1:], Conditions.constant(camber=0.0, **ROAD), ()), "pressure") == ""
    )


def test_a_port_file_is_waited_for_and_so_is_its_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, file, port = Clock(), tmp_path / "port", tmp_path / "pts"
    steps = iter([lambda: None, lambda: file.write_text(str(port)), lambda: port.write_text("")])

    def sleep(seconds: float) -> None:
        clock.now += seconds
        next(steps, lambda: None)()

    with monkeypatch.context() as patch:
        for module in ("tirebench.cli.run_inputs", "tirebench.deadline"):
            patch.setattr(f"{module}.time", clock)
        patch.setattr(clock, "sleep", sleep)
        quiet = Console(quiet=True)
        assert port_of_file(file, 60.0, quiet) == str(port)
        port.unlink()  # one that is left of another day
        with pytest.raises(DeviceError, match=r"its port .*pts is not there; .* --wait"):
            port_of_file(file, 60.0, quiet)
        assert clock.now > 60.0


def test_a_file_of_conditions_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, file = Clock(), tmp_path / "c.json"
    steps = iter([lambda: None, lambda: file.write_text("{}")])

    def sleep(seconds: float) -> None:
        clock.now += seconds
        next(steps, lambda: None)()

    with monkeypatch.context() as patch:
        for module in ("tirebench.cli.run_inputs", "tirebench.deadline"):
            patch.setattr(f"{module}.time", clock)
        patch.setattr(clock, "sleep", sleep)
        console = Console(record=True, file=io.StringIO(), width=200)
        begun = clock.now
        wait_for_file(file, 60.0, console)
        assert file.exists()
        assert clock.now < begun + 1.0
        assert "waiting for" in console.export_text()
        file.unlink()
        begun = clock.now
        wait_for_file(file, 0.0, console)  # none without --wait
        assert clock.now == begun
        wait_for_file(file, 60.0, console)
        assert clock.now > begun + 60.0


class Absent:
    """A port that opens at the fourth attempt."""

    name, encoding, live = "port", "serial-v1", True

    def __init__(self) -> None:
        self.tries = 0

    def open(self) -> Link:
        self.tries += 1
        if self.tries < 4:
            raise LinkError("port: it cannot be opened; plug it in")
        return self

    def receive(self, deadline: Deadline) -> Read:
        raise UnpluggedError("port: it went away")

    def close(self) -> None:
        self.tries = 0

    def overruns(self) -> int:
        return 0


def test_a_port_that_is_not_there_yet_is_waited_for_and_its_coming_is_no_return(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = Clock()
    for module in ("tirebench.links.reconnecting", "tirebench.deadline"):
        monkeypatch.setattr(f"{module}.time", clock)
    port = Absent()
    link = ReconnectingLink(port.open, 5.0, "port", wait=60.0)
    assert link.name == "port"
    first = link.receive(Deadline.after(30.0))
    assert (first and first.event, port.tries) == ("", 4)
    assert (lost := link.receive(Deadline.after(1.0)))
    assert lost.event == "lost"
    again = link.receive(Deadline.after(4.0))
    assert again
    assert again.event == BACK


def test_a_port_that_does_not_come_is_told_with_what_was_wrong(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = Clock()
    for module in ("tirebench.links.reconnecting", "tirebench.deadline"):
        monkeypatch.setattr(f"{module}.time", clock)

    def nothing() -> Link:
        raise LinkError("port: it cannot be opened; plug it in")

    link = ReconnectingLink(nothing, 5.0, "port", wait=60.0)
    with pytest.raises(LinkError, match="it cannot be opened; plug it in") as raised:
        link.receive(Deadline.after(100.0))
    assert not isinstance(raised.value, UnpluggedError)
    assert clock.now == pytest.approx(60.0, abs=3.0)


def test_a_run_may_begin_before_its_port_is_there(
    spawn: Spawn, campaign: Path, toy_fmus: dict[int, Path], tmp_path: Path
) -> None:
    run = spawn(
        "run",
        "--port",
        tmp_path / "wheel",
        "--wait",
        PATIENCE,
        "--fmu",
        toy_fmus[16],
        "--record",
        tmp_path / "a.mcap",
        "--no-page",
    )
    run.says("samples a step")  # all is loaded, and nothing to read
    wheel = spawn(
        "emulate",
        "--campaign",
        campaign,
        "--all",
        "--loop",
        "--link",
        tmp_path / "wheel",
        "--port-file",
        tmp_path / "port",
    )
    run.says(A_TURN)
    run.send_signal(signal.SIGINT)
    code, text, _ = run.finish()
    assert (code, "reconnects" in text) == (0, False)
    assert (tmp_path / "port").exists()
    wheel.send_signal(signal.SIGINT)
    wheel.finish()
    assert not (tmp_path / "port").exists()  # it names no port that is gone


def test_without_a_wait_a_port_that_is_not_there_is_refused(
    toy_fmus: dict[int, Path], tmp_path: Path
) -> None:
    arguments = ("run", "--port-file", tmp_path / "port", "--fmu", toy_fmus[16], "--no-page")
    outcome = CliRunner().invoke(program, [str(argument) for argument in arguments])
    assert "no port; it must be the file that `tirebench emulate --port-file` writes" in (
        str(outcome.exception) + outcome.output
    )


class Heard:
    """An estimator that remembers the conditions that it was given."""

    samples = 16

    def __init__(self) -> None:
        self.seen: set[tuple[float, ...]] = set()

    def start(self, period: float) -> None:
        self.seen.clear()

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> Outputs | None:
        self.seen.add(conditions)
        return None


@pytest.mark.parametrize("name", TELLABLE)
def test_every_condition_reaches_the_estimator_by_its_name(name: str) -> None:
    """From a line of text, and from the command line; those of another wheel do not."""
    condition, dimension = TELLABLE[name]
    unit = UNITS[condition][0]
    text = (
        THREE
        + f"""
[[message]]
name = "C"
starts = "C"
columns = ["x"]
[[{name}]]
wheel = 1
message = "C"
signal = "x"
unit = "{unit}"
"""
    )
    source = SourcePlan(PortPlan("p"), plan_of(text))
    heard, wheels = Heard(), wheels_of([source])
    estimation = Estimation(lambda _: heard, Conditions.constant())
    lines = [f"{number},1,2,3\n" for number in range(64)]
    estimation.take(wheels.push("".join(["C,2.5\n", *lines]).encode()))
    (held,) = heard.seen
    wanted = to_si(2.5, unit, dimension)
    place = HELD.index(condition)
    assert held[place] == pytest.approx(wanted)
    assert sum(value == value for value in held) == 1
    given = conditions_of({}, [f"{condition}=2.5"], None)
    assert given is not None
    assert given.values[0][place] == pytest.approx(wanted)
    assert [place for place, _ in source.conditions_sent] == [condition]


@pytest.mark.parametrize("text", ["grip=1", "speed=fast", "speed", "friction=nan", "speed=70"])
def test_a_wrong_condition_says_which_there_are(text: str) -> None:
    with pytest.raises(
        DeviceError, match=r"NAME=VALUE is needed.*speed \[km/h\], .*friction \[1\]"
    ):
        conditions_of({"speed": 65.0}, [text], None)
    known = conditions_of({"speed": 65.0, "camber": None}, ["friction=0.8"], None)
    assert known is not None
    assert known.known == ("speed", "friction")
