"""The live chain in processes: each may be killed, and a replay still gives what the run gave."""

import os
import pickle
import resource
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from mcap.reader import make_reader

from tests.bench.campaigns import tiny_runs
from tests.bench.clocks import Clock
from tests.bench.conftest import Spawn
from tests.bench.programs import A_TURN, PATIENCE, port_of, wait_until
from tirebench.deadline import Deadline
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.errors import DeviceError, LinkTimeoutError
from tirebench.estimator.chain import RESTARTED, SKIPPED, Jump, Outputs, Place, Turn
from tirebench.estimator.estimation import Estimation, News, WheelEstimation
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.estimator.wheels import Block, Wheels
from tirebench.links import BACK, LOST, RESUMED, Read
from tirebench.links.opening import PortPlan
from tirebench.live.chain import LiveChain
from tirebench.live.estimator import LONGEST_REST, EstimatorPlan, Report, _Estimator, on_time, rest
from tirebench.live.exchange import Address, Exchange
from tirebench.live.live_plan import LivePlan
from tirebench.live.reader import ReaderPlan, load
from tirebench.live.recorder import _Recorder
from tirebench.live.recording_state import Order, RecorderState, RecordingRule
from tirebench.live.run_alarms import RECORDED_AGAIN
from tirebench.live.supervised import CONTEXT
from tirebench.protocols.decoder import SerialDecoder
from tirebench.recording.document import flags, turn_document
from tirebench.recording.header import parts_of
from tirebench.recording.link import ReplayLink
from tirebench.recording.recording import Recorder, Recording, RecordingHeader, jump_event
from tirebench.recording.replay import ReplayChain
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.conditions import Condition, Conditions
from tirebench.wire.device import Device
from tirelib.core.arrays import FloatArray

STEADY = Conditions.constant(18.0, 2.3e5, 0.0)


def documents(turns: list[Turn]) -> list[dict[str, Any]]:
    return [turn_document(turn) for turn in turns]


def replayed(path: Path, file: FmuFile) -> tuple[list[Turn], Wheels]:
    with ReplayLink(path) as link, FmuModel(file) as model:
        wheels = Wheels.of_one(SerialDecoder(), {None: Device()})
        estimation = Estimation(lambda _: model, STEADY, link.recording.jumps())
        chain, news = ReplayChain(link, wheels, estimation), News()
        while not chain.ended:
            news.add(chain.poll(Deadline.never()))
        news.add(chain.finish("end"))
    return news.turns, wheels


def gathered(chain: LiveChain, news: News, enough: Callable[[], bool]) -> None:
    end = Deadline.after(PATIENCE)
    while not enough():
        news.add(chain.poll(Deadline.after(0.1)))
        assert not end.expired, chain.counts()


@pytest.fixture
def file(toy_fmus: dict[int, Path]) -> Iterator[FmuFile]:
    with FmuFile(read_fmu(toy_fmus[16])) as opened:
        yield opened


def plan_of(port: str, file: FmuFile | None, record: Path) -> LivePlan:
    reader = ReaderPlan((SourcePlan(PortPlan(port)),), 60.0)
    return LivePlan(reader, file, STEADY, RecordingHeader({}), record)


def test_a_port_that_is_none_is_told_before_anything_is_started(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"--port can:virtual: the channel is missing"):
        LiveChain(plan_of("can:virtual", None, tmp_path / "a.mcap"))


def test_who_stands_by_has_its_port_loaded_and_its_garbage_collected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    done: list[object] = []
    monkeypatch.setattr(PortPlan, "load", lambda port: done.append(port))
    monkeypatch.setattr("tirebench.live.reader.settled", lambda: done.append("settled"))
    plan = ReaderPlan((SourcePlan(PortPlan("p")),), 60.0)
    load(plan, Address("", 0, (), None, 0))
    assert done == [plan.sources[0].port, "settled"]


def test_each_process_may_be_killed_and_a_replay_gives_what_the_run_gave(
    spawn: Spawn, campaign: Path, file: FmuFile, tmp_path: Path
) -> None:
    spawn("emulate", "--campaign", campaign, "--all", "--loop", "--port-file", tmp_path / "port")
    news = News()
    with LiveChain(plan_of(port_of(tmp_path / "port"), file, tmp_path / "a.mcap")) as chain:
        name, processes = chain._exchange.address.name, set(chain.process_ids.values())
        gathered(chain, news, lambda: len(news.turns) > 3)
        for victim in ("estimator 0", "recorder", "reader"):
            if victim == "reader":  # until then nothing may be lost
                before = chain.wheels.counts[1]
                assert before.lost_samples == 0
                assert chain.counts()["raw"]["lost_bytes"] == 0
            os.kill(chain.process_ids[victim] or 0, signal.SIGKILL)
            seen = len(news.turns) + 8  # more than what may have been on its way
            gathered(chain, news, lambda one=victim: chain.counts()["restarts"][one] == 1)
            processes |= set(chain.process_ids.values())
            gathered(chain, news, lambda before=seen: len(news.turns) > before)
        news.add(chain.finish("stopped"))
        counts, wheels = chain.counts(), chain.wheels
    assert counts["restarts"] == {"reader": 1, "recorder": 1, "estimator 0": 1}
    assert counts["wheels"][0]["estimator_restarts"] == 1
    assert counts["wheels"][0]["queue_overruns"] == 0
    recording = Recording(tmp_path / "a.mcap")
    reads = list(recording.reads())
    recording.close()
    assert recording.complete
    assert [read.event for read in reads if read.event] == [RESUMED]
    assert sum(len(read.data) for read in reads) == wheels.line.counts.bytes
    notes = [note for turn in news.turns for note in flags(turn) if note == RESTARTED]
    assert len(notes) == 1
    assert wheels.counts[0].reconnects == 1
    turns, again = replayed(tmp_path / "a.mcap", file)
    assert documents(turns) == documents(news.turns)
    assert again.counts == wheels.counts
    with pytest.raises(FileNotFoundError):
        SharedMemory(name)
    assert not [pid for pid in processes if pid and Path(f"/proc/{pid}").exists()]


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="no limits of other processes here")
def test_a_file_that_may_not_grow_ends_nothing_and_nothing_is_lost(
    spawn: Spawn, campaign: Path, file: FmuFile, tmp_path: Path
) -> None:
    spawn("emulate", "--campaign", campaign, "--all", "--loop", "--port-file", tmp_path / "port")
    news, path = News(), tmp_path / "a.mcap"
    with LiveChain(plan_of(port_of(tmp_path / "port"), file, path)) as chain:

        def failures() -> int:
            return int(chain.counts()["recording"]["failures"])

        gathered(chain, news, lambda: len(news.turns) > 3)
        recorder = chain.process_ids["recorder"] or 0
        before = resource.prlimit(recorder, resource.RLIMIT_FSIZE)
        resource.prlimit(recorder, resource.RLIMIT_FSIZE, (path.stat().st_size + 9000, before[1]))
        gathered(chain, news, lambda: failures() > 0)
        turns = len(news.turns)
        gathered(chain, news, lambda: len(news.turns) > turns + 3)  # the run goes on
        resource.prlimit(recorder, resource.RLIMIT_FSIZE, before)
        gathered(chain, news, lambda: not chain.recorded.error)
        news.add(chain.finish("stopped"))
        counts = chain.counts()
    assert "a.mcap: cannot be written (File too large)" in news.alarms[0]
    assert news.alarms[-1] == RECORDED_AGAIN
    assert counts["restarts"] == {"reader": 0, "recorder": 0, "estimator 0": 0}
    assert counts["raw"]["lost_bytes"] == 0
    assert counts["recording"]["part"] >= 2
    turns_again, again = replayed(path, file)
    assert documents(turns_again) == documents(news.turns)
    assert again.counts == chain.wheels.counts
    for part in parts_of(path):  # each has its end and its index
        with part.open("rb") as opened:
            assert make_reader(opened, validate_crcs=True).get_summary() is not None


def test_a_run_that_is_killed_while_the_wheel_sends_leaves_no_process_behind(
    spawn: Spawn, campaign: Path, toy_fmus: dict[int, Path], tmp_path: Path
) -> None:
    spawn("emulate", "--campaign", campaign, "--all", "--loop", "--port-file", tmp_path / "port")
    run = spawn(
        "run",
        "--port",
        port_of(tmp_path / "port"),
        "--fmu",
        toy_fmus[16],
        "--no-page",
        "--record",
        tmp_path / "a.mcap",
    )
    run.says(A_TURN)
    started = [
        int(pid)
        for task in Path(f"/proc/{run.pid}/task").iterdir()
        for pid in (task / "children").read_text().split()
    ]
    assert len(started) >= 3
    run.kill()
    run.wait()
    wait_until(lambda: not [pid for pid in started if Path(f"/proc/{pid}").exists()])


def test_a_cable_in_and_out_is_told_and_every_time_it_comes_back(
    spawn: Spawn, campaign: Path, tmp_path: Path
) -> None:
    spawn(
        "emulate",
        "--campaign",
        campaign,
        "--all",
        "--loop",
        "--link",
        tmp_path / "port",
        "--unplug",
        0.5,
        "--replug",
        0.2,
    )
    wait_until((tmp_path / "port").is_symlink)
    with LiveChain(plan_of(str(tmp_path / "port"), None, tmp_path / "a.mcap")) as chain:
        lost = 0
        for _ in range(3):
            gathered(chain, News(), lambda seen=lost: chain.wheels.line.counts.reconnects > seen)
            lost = chain.wheels.line.counts.reconnects
        chain.finish("stopped")
    recording = Recording(tmp_path / "a.mcap")
    events = [read.event for read in recording.reads() if read.event]
    recording.close()
    assert events[:6] == [LOST, BACK] * 3


@pytest.mark.parametrize(
    ("since", "length", "wanted"),
    [(0.01, 0.1, 0.088), (0.099, 0.1, 0.0), (0.2, 0.1, 0.0), (0.0, 3.0, LONGEST_REST)],
)
def test_an_estimator_rests_until_a_turn_may_be_due(
    since: float, length: float, wanted: float
) -> None:
    """A turn that is a fiftieth shorter than the last one is taken at once."""
    assert rest(since, length) == pytest.approx(wanted)


def test_a_turn_whose_bytes_come_late_does_not_delay_the_next_rest() -> None:
    """Every third read is 12 ms late, the wheel's clock 100 ppm off; then the clock jumps."""
    length, came = 0.1, float("nan")
    for turn in range(60):
        true = 5.0 + turn * length * (1.0 + 1e-4)
        came = on_time(true + (0.012 if turn % 3 == 2 else 0.0), came, length)
        assert abs(came - true) < 2.5e-4
    assert on_time(50.0, came, length) == 50.0
    assert on_time(6.0, came, length) == 6.0
    assert on_time(60.0, 50.0, float("nan")) == 60.0


def test_an_estimator_that_knows_no_turn_does_not_rest() -> None:
    assert rest(0.01, float("nan")) == rest(float("nan"), 0.11) == 0.0


class Turns:
    """An estimator that ends a turn every 1000 samples and says what it was given."""

    samples = 16

    def start(self, period: float) -> None:
        self.count, self.sum = 0, 0.0

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> Outputs | None:
        before, self.count = self.count, self.count + len(strain)
        self.sum += float(strain.sum())
        if before // 1000 == self.count // 1000:
            return None
        names = ("alpha", "kappa", "Fy", "flags", "age")
        return {**dict.fromkeys(names, 0.0), "Fz": self.sum, "valid": 1.0}, {}

    def take_messages(self) -> list[str]:
        return []


def stepped(
    blocks: list[Block],
    late: slice = slice(0),
    gone: slice = slice(0),
    *,
    again: bool = False,
    every: bool = False,
) -> News:
    """Step blocks in the estimator's process, but here; some come late, some not at all."""
    exchange = Exchange.create(CONTEXT, 1)
    now = time.monotonic_ns()
    old = set(range(len(blocks))[late])
    for number, block in enumerate(blocks):
        if number not in set(range(len(blocks))[gone]):
            age = 10**10 if number in old else -(10**10)
            assert exchange.samples[0].put(replace(block, arrival=now - age + number).pack())
    plan = EstimatorPlan(None, STEADY, 0, laps=False, again=again, every=every)
    worker = _Estimator(plan, exchange)
    model: Any = Turns()
    end = exchange.is_set
    exchange.is_set = lambda flag: end(flag) or exchange.samples[0].waiting == 0
    worker.run(model)
    news = News()
    while (message := exchange.news[0].read()) is not None:
        report: Report = pickle.loads(message)
        news.add(report.news)
    assert report.done
    exchange.close()
    return news


@pytest.fixture(scope="module")
def blocks() -> list[Block]:
    wire = write_script(tiny_runs()[:2], Device(), Faults({})).frames
    wheels = Wheels.of_one(SerialDecoder(), {None: Device()})
    return [b for i in range(0, len(wire), 3) for b in wheels.push(b"".join(wire[i : i + 3]))]


@pytest.mark.parametrize(
    "case",
    [
        {},
        {"late": slice(60, 90)},
        {"gone": slice(60, 90)},
        {"gone": slice(120, 170)},
        {"again": True},
        {"late": slice(0, 30)},
        {"late": slice(60, 90), "every": True},
    ],
)
def test_what_an_estimator_leaves_out_is_flagged_and_a_replay_leaves_it_out_too(
    blocks: list[Block], case: dict[str, Any]
) -> None:
    news = stepped(blocks, **case)
    done = Estimation(lambda _: Turns(), STEADY, news.jumps)
    again = [*done.take(blocks).turns, *done.finish().turns]
    assert documents(again) == documents(news.turns)
    notes = [note for turn in news.turns for note in flags(turn)]
    why = RESTARTED if "again" in case else SKIPPED
    catches_up = case == {"late": slice(0, 30)}  # at the start it may
    jumped = bool(case) and not catches_up and "every" not in case
    assert notes == [why] * jumped
    assert [jump.why for jump in news.jumps] == [why] * jumped
    if why == SKIPPED and jumped:
        (jump,) = news.jumps
        assert jump.samples > 900
        assert jump.turns >= 1
    whole = Estimation(lambda _: Turns(), STEADY).take(blocks).turns
    assert (len(news.turns) < len(whole)) == (why == SKIPPED and jumped)


def test_samples_that_wait_are_taken_together_and_each_turn_keeps_its_arrival(
    blocks: list[Block], monkeypatch: pytest.MonkeyPatch
) -> None:
    together: list[int] = []
    taken = WheelEstimation.take

    def take(self: WheelEstimation, block: Block, *, live: bool = False) -> News:
        together.append(len(block.parts))
        return taken(self, block, live=live)

    monkeypatch.setattr(WheelEstimation, "take", take)
    news = stepped(blocks)
    assert max(together) > 10
    assert len(together) < len(blocks) / 10
    monkeypatch.undo()
    numbered = [replace(block, arrival=number) for number, block in enumerate(blocks)]
    alone = Estimation(lambda _: Turns(), STEADY).take(numbered).turns
    first = news.turns[0].arrival - alone[0].arrival
    assert [turn.arrival - first for turn in news.turns] == [turn.arrival for turn in alone]


def test_a_recorder_that_starts_again_cuts_off_what_was_left_half_done(tmp_path: Path) -> None:
    path, header = tmp_path / "a.mcap", RecordingHeader({"port": "p"})
    first = Recorder(path, header, STEADY)
    for number in range(3):
        first.read(Read(number + 1, bytes([number]) * 100))
    first.flush()
    whole = first.length
    first.read(Read(9, b"x" * 9000))
    first.flush()
    with path.open("r+b") as file:
        file.truncate(whole + 8000)  # killed in the middle
    with Recorder(path, header, STEADY, whole) as second:
        second.read(Read(4, b"y" * 100))
    first.abandon()
    recording = Recording(path)
    reads = [data for _, data in recording.raw()]
    recording.close()
    assert [data[:1] for data in reads] == [b"\0", b"\1", b"\2", b"y"]
    assert recording.complete
    assert recording.header.settings == {"port": "p"}
    with path.open("rb") as file:  # and for other programs, which begin at the end
        found = [m.data[:1] for _, c, m in make_reader(file).iter_messages() if c.topic == "/raw/0"]
    assert found == [data[:1] for data in reads]


def test_a_read_that_is_on_disk_is_not_written_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recorder that is killed when it has noted what it did, before it gave back the room."""
    monkeypatch.setattr("tirebench.live.recorder.settled", lambda: None)
    exchange, header = Exchange.create(CONTEXT, 1), RecordingHeader({})
    first = Recorder(tmp_path / "a.mcap", header, STEADY)
    for number in range(2):
        exchange.raw.put(pickle.dumps(Read(number + 1, bytes([number]) * 9)))
    first.read(pickle.loads(exchange.raw.read() or b""))
    first.flush()
    state = RecorderState(tmp_path / "a.mcap", first.length, 9, raw=exchange.raw.cursor)
    exchange.orders.put(pickle.dumps(Order("close", "stopped", 0)))
    other = Exchange(exchange.address)
    _Recorder(header, STEADY, RecordingRule(), other, state).run()
    other.close()
    exchange.close()
    first.abandon()
    recording = Recording(tmp_path / "a.mcap")
    assert [data for _, data in recording.raw()] == [b"\0" * 9, b"\1" * 9]
    recording.close()


def test_an_estimator_goes_on_behind_what_it_has_reported(tmp_path: Path) -> None:
    chain = LiveChain(plan_of("p", None, tmp_path / "a.mcap"))
    jump = Jump(0, Place(0, 0), Place(0, 16), SKIPPED, 16, 1)
    chain._exchange.news[0].put(pickle.dumps(Report(News(jumps=[jump]), cursor=4711)))
    news = News()
    chain._estimators._drain(0, news)
    assert chain._estimators._cursors[0] == 4711
    assert news.jumps == chain.jumps == [jump]
    order: Order = pickle.loads(chain._exchange.orders.read() or b"")
    assert order.what == jump_event(jump)
    chain._recorded = RecorderState(tmp_path / "a-2.mcap")  # begun later: other places
    chain._exchange.news[0].put(pickle.dumps(Report(News(jumps=[jump]))))
    chain._estimators._drain(0, news)
    order = pickle.loads(chain._exchange.orders.read() or b"")
    assert order.what["event"] == "jump of the run"
    chain._close()


def test_a_recorder_is_waited_for_as_long_as_its_file_grows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Minutes before a trigger take minutes to write; one that hangs is given up."""
    clock, said = Clock(), []
    for module in ("tirebench.live.chain", "tirebench.deadline"):
        monkeypatch.setattr(f"{module}.time", clock)
    chain = LiveChain(plan_of("p", None, tmp_path / "a.mcap"), said.append)
    state = RecorderState(tmp_path / "a.mcap")

    def sleep(seconds: float) -> None:
        clock.now += 50.0
        state.length += 1000 * (clock.now < 1000.0)
        chain._exchange.recorded.put(pickle.dumps(state))

    monkeypatch.setattr(clock, "sleep", sleep)
    recorder: Any = SimpleNamespace(alive=True, wait=lambda _: said.append("ended"))
    chain._let_write(recorder)
    assert 1000.0 < clock.now < 1200.0
    assert "waiting for: the recorder to write" in said[0]
    assert said[-1] == "ended"
    chain._close()


def test_a_start_that_takes_long_says_what_is_awaited(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing was started, so nothing gets ready."""
    monkeypatch.setattr("tirebench.live.chain.FIRST_REPORT_AFTER", 0.0)
    monkeypatch.setattr("tirebench.live.chain.START_TIME_LIMIT", 0.0)
    said: list[str] = []
    chain = LiveChain(plan_of("p", None, tmp_path / "a.mcap"), said.append)
    chain._estimators.kept = dict.fromkeys(range(3), cast(Any, SimpleNamespace(starts=1, look=int)))
    chain._estimators.ready = {1}
    loading = chain._estimators.awaited
    for awaited, text in (
        (chain._opening, "the reader to open p"),
        (loading, "estimator 0, estimator 2 to load "),
    ):
        with pytest.raises(LinkTimeoutError, match=f"waited 0 s in vain for: {text}"):
            chain._wait(lambda: False, awaited)
        assert said.pop().startswith(f"waiting for: {text}")
    chain._estimators.kept = {}
    chain._close()
