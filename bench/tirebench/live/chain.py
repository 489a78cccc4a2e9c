"""The run's side of the live chain: starts the processes, keeps them going, gathers their news."""

import gc
import json
import pickle
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any

from tirebench import errors
from tirebench.deadline import Deadline
from tirebench.errors import LinkTimeoutError, RecordingError
from tirebench.estimator.chain import Jump
from tirebench.estimator.checked_turns import CheckedTurns
from tirebench.estimator.estimation import News, skipped
from tirebench.estimator.wheels import MOST_WHEELS, Wheels
from tirebench.live.board import SIZE
from tirebench.live.estimators import Estimators
from tirebench.live.exchange import FINISH, STOP, Exchange, woken
from tirebench.live.live_plan import LivePlan
from tirebench.live.ports import PortState, read_source
from tirebench.live.reader import LineState, load, read_port
from tirebench.live.recorder import record
from tirebench.live.recording_state import Order, RecorderState
from tirebench.live.run_alarms import TOO_BUSY, RunAlarms
from tirebench.live.supervised import CONTEXT, Supervised
from tirebench.recording.document import turn_document
from tirebench.recording.header import part_path
from tirebench.recording.recorder import jump_event

START_TIME_LIMIT = 300.0
"""Processes that are not ready after so long do not start, even on a busy machine, [s]."""
FIRST_REPORT_AFTER = 5.0
"""After so long the run says what it waits for, then again after twice the time, and so on, [s]."""
LOOK = 0.05
"""Time between two looks after the processes and the line, [s]."""
END_TIME_LIMIT = 60.0
"""At the end, estimators and recorder may be silent for so long before they are given up, [s]."""
LEAVE, AT_ONCE = 60.0, 5.0
"""Time that a process may take to end on request before it is killed, [s]: one that still has
something to save, and one that has not."""


class LiveChain:
    """The processes of a run, a `session.Source`. A context manager that ends them.

    Parameters
    ----------
    plan : LivePlan
    say : callable, optional
        Takes a sentence on what is awaited while the start takes long.

    Raises
    ------
    BenchError
        If the port cannot be opened, or the FMU not be loaded.
    """

    live = True

    def __init__(self, plan: LivePlan, say: Callable[[str], None] = lambda _: None) -> None:
        for source in plan.reader.sources:
            source.port.check()  # before all that takes time
        self.ended = self.message = ""
        self.jumps: list[Jump] = []
        self._plan, self._say = plan, say
        self._slots = len(plan.reader.wheels) or MOST_WHEELS
        beside = SIZE if plan.laps else 0
        self._exchange = Exchange.create(CONTEXT, self._slots, beside, plan.reader.ports)
        self._state = LineState(plan.reader.fresh())
        self._recorded = RecorderState()
        self._orders = 0
        self._pending = News()
        self._next_look = 0.0
        self._ports: list[Supervised] = []
        self._reader: Supervised | None = None
        self._recorder: Supervised | None = None
        self._estimators = Estimators(
            plan.file,
            plan.conditions,
            self._exchange,
            self._jumped,
            laps=plan.laps,
            every=plan.reader.every_turn,
        )
        self._finished = False
        self._judged = CheckedTurns()
        self._alarms = RunAlarms(
            [source.port.port for source in plan.reader.sources],
            estimated=plan.file is not None,
            write=lambda event: self.order("event", event),
        )

    def __enter__(self) -> "LiveChain":
        try:
            if self._plan.record is not None:
                self.order("start", str(self._plan.record))
            if self._plan.reader.recorded:
                plan, address = self._plan, self._exchange.address
                self._recorder = Supervised(
                    record, lambda _: (plan.header, plan.conditions, plan.rule, address)
                )
            if self._plan.file is not None:
                known = self._plan.reader.expected
                self._estimators.start(known)  # those of other wheels start when they are heard
                self._wait(lambda: len(self._estimators.ready) >= known, self._estimators.awaited)
            self._wait(
                lambda: self.obeyed(Deadline.after(0.0)),
                lambda: f"the recorder to begin {self._plan.record}",
            )
            # ports are opened last: from then on bytes come
            for number in range(self._plan.reader.ports):
                self._start_port(number)
            self._reader = Supervised(
                read_port, lambda _: (self._plan.reader, self._exchange.address), stand_by=load
            )
            self._wait(lambda: bool(self._state.name), self._opening)
            gc.collect()
            gc.freeze()
        except BaseException as error:
            self._close(error)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._close(error)

    @property
    def name(self) -> str:
        """Name of the port."""
        return self._state.name

    @property
    def wheels(self) -> Wheels:
        """The line as it was a moment ago: counters and clocks."""
        return self._state.wheels

    @property
    def heard(self) -> float | None:
        """When bytes came last, on `time.time`."""
        return self._state.heard

    @property
    def lost(self) -> float | None:
        """When the port went away, on `time.time`; None while it is there."""
        return self._state.lost

    @property
    def last_byte(self) -> float | None:
        """When bytes came last, on `time.monotonic`."""
        return self._state.last_byte

    @property
    def recorded(self) -> RecorderState:
        """How far the recorder is."""
        return self._recorded

    @property
    def process_ids(self) -> dict[str, int | None]:
        """Processes by what they do: ``reader``, ``recorder``, ``estimator 0`` ..."""
        return {name: kept.process_id for name, kept in self._processes().items()}

    def counts(self) -> dict[str, Any]:
        """Return what was started again, skipped and not recorded."""
        exchange = self._exchange
        refused, refused_bytes = exchange.raw.refused
        return {
            "processes": self.process_ids,
            "cpu_s": {
                "reader": self._state.cpu,
                "recorder": self._recorded.cpu,
                **self._port_cpu(),
                **{f"estimator {slot}": cpu for slot, cpu in self._estimators.cpu.items()},
            },
            "restarts": {name: kept.starts - 1 for name, kept in self._processes().items()},
            "raw": {
                "lost_reads": refused,
                "lost_bytes": refused_bytes,
                "most_waiting_bytes": exchange.raw.high,
                "not_decoded_bytes": self._state.passed,
                "alarm": TOO_BUSY if self._state.passing else "",
            },
            "recording": self._recorded.as_document(refused_bytes),
            "given_up": dict(self._alarms.given_up),
            "wheels": {wheel: self.wheel_counts(wheel) for wheel in self.wheels.heard},
        }

    def _port_cpu(self) -> dict[str, float]:
        return {f"port {n}": state.cpu for n, state in enumerate(self._port_states()) if state}

    def _port_states(self) -> list[PortState | None]:
        """Return how the ports are that a process of their own reads; None before it says."""
        found = [cell.get() for cell in self._exchange.ports]
        return [None if one is None else pickle.loads(one) for one in found]

    def cpu_time(self) -> float:
        """Return what reader, recorder and estimators have used so far, [s]."""
        return float(sum(self.counts()["cpu_s"].values()))

    def wheel_counts(self, wheel: int) -> dict[str, int]:
        """Return what was skipped of a wheel."""
        slot = list(self.wheels.heard).index(wheel)
        return {
            **skipped(self.jumps, wheel),
            "queue_overruns": self._exchange.samples[slot].refused[0],
            "most_waiting_bytes": self._exchange.samples[slot].high,
        }

    def poll(self, deadline: Deadline) -> News:
        """Return what has come by the deadline, at once when there is something.

        Raises
        ------
        BenchError
            That ended a process on purpose.
        """
        while True:
            woken(self._exchange.address.news, min(deadline.remaining, LOOK))
            news = self._judge(self._gather())
            if time.monotonic() >= self._next_look:
                self._look()
            if news or deadline.expired or self.ended:
                return news

    def order(self, kind: str, what: object) -> None:
        """Tell the recorder what to do; see `tirebench.live.recorder.Order`."""
        order = Order(kind, what, time.monotonic_ns())
        if self._exchange.orders.put(pickle.dumps(order, 5)):
            self._orders += 1

    def obeyed(self, deadline: Deadline) -> bool:
        """Wait until the recorder has carried out its commands; return False at the deadline."""
        while self._recorder is not None and self._recorded.done < self._orders:
            if deadline.expired:
                return False
            self._recorder.look()
            time.sleep(0.005)
            self._see()
        return True

    def finish(self, reason: str) -> News:
        """End the processes in order, so that nothing that came is left undone."""
        self._finished = True
        news = News()
        self._exchange.set(STOP)
        for kept in (*self._ports, self._reader):
            if kept is not None:
                kept.wait(LEAVE)
        self._see()
        self._exchange.set(FINISH)
        end = Deadline.after(END_TIME_LIMIT)
        while len(self._estimators.done) < len(self._estimators.kept) and not end.expired:
            woken(self._exchange.address.news, LOOK)
            if came := self._gather():
                end = Deadline.after(END_TIME_LIMIT)
                news.add(self._judge(came))
            self._estimators.look()
        news.add(self._judge(self._gather(), end=True))
        self.order("close", reason)
        if self._recorder is not None:
            self.obeyed(Deadline.after(END_TIME_LIMIT))
            self._let_write(self._recorder)
        return news

    def _let_write(self, recorder: Supervised) -> None:
        """Wait for the recorder as long as its file grows, and say so where that takes long."""
        end, due, before = Deadline.after(LEAVE), Deadline.after(FIRST_REPORT_AFTER), -1
        while recorder.alive and not end.expired:
            time.sleep(LOOK)
            self._see()
            length = self._recorded.written + self._recorded.length
            if length != before:
                end, before = Deadline.after(LEAVE), length
            if due.expired:
                self._say(f"waiting for: the recorder to write {self._recorded.path}")
                due = Deadline.after(LEAVE)
        recorder.wait(AT_ONCE)
        self._see()

    def _processes(self) -> dict[str, Supervised]:
        named = {"reader": self._reader, "recorder": self._recorder}
        named |= {f"port {number}": kept for number, kept in enumerate(self._ports)}
        named |= {f"estimator {slot}": kept for slot, kept in self._estimators.kept.items()}
        return {name: kept for name, kept in named.items() if kept is not None}

    def _start_port(self, number: int) -> None:
        reader, address = self._plan.reader, self._exchange.address
        plan = (number, reader.sources[number].port, reader.patience, reader.wait, address)
        self._ports.append(Supervised(read_source, lambda _: plan))

    def _opening(self) -> str:
        """Say which ports are awaited."""
        opened = {n for n, state in enumerate(self._port_states()) if state and state.name}
        sources = enumerate(self._plan.reader.sources)
        ports = [source.port.port for n, source in sources if n not in opened]
        return f"the reader to open {', '.join(ports)}" if ports else "the reader"

    def _wait(self, ready: Callable[[], bool], awaited: Callable[[], str]) -> None:
        """Wait until `ready` says yes; `awaited` names what is missing."""
        end, pause = Deadline.after(START_TIME_LIMIT), FIRST_REPORT_AFTER
        due = Deadline.after(pause)
        while not ready():
            woken(self._exchange.address.news, LOOK)
            news = self._gather()  # first: it begins the pending news afresh
            self._pending.add(news)
            self._look()
            self._estimators.check()
            if self._recorded.answer:
                raise RecordingError(self._recorded.answer)
            if due.expired:
                self._say(f"waiting for: {awaited()}; Ctrl-C ends")
                pause *= 2.0
                due = Deadline.after(pause)
            if end.expired:
                raise LinkTimeoutError(
                    f"waited {START_TIME_LIMIT:.0f} s in vain for: {awaited()}; the machine is too "
                    "busy; close other programs, then try again"
                )

    def _gather(self) -> News:
        """Return the news of the estimators, and alarms, since the last time."""
        news, self._pending = self._pending, News()
        news.add(self._estimators.gather())
        return news

    def _judge(self, news: News, *, end: bool = False) -> News:
        """Report and record turns once the sample rate of their wheel has been checked."""
        news.turns = self._judged.take(news.turns, self.wheels, end=end)
        now = time.monotonic_ns()
        news.latency = [1e-9 * (now - turn.arrival) for turn in news.turns]
        for turn in news.turns if self._recorder is not None else ():
            document = json.dumps(turn_document(turn)).encode()
            self._exchange.results.put(pickle.dumps((turn.wheel, turn.arrival, document), 5))
        return news

    def _jumped(self, jump: Jump) -> None:
        """Keep a jump, and write it into the recording."""
        self.jumps.append(jump)
        path = self._recorded.path
        whole = path is None or part_path(path, 1) == self._plan.record
        self.order("event", jump_event(jump, whole=whole))

    def _look(self) -> None:
        """Look after the processes, and at the line."""
        self._next_look = time.monotonic() + LOOK
        self._see()
        for kept in () if self._finished else self._processes().values():
            if self._state.ended and (kept is self._reader or kept in self._ports):
                continue
            kept.look()
        if not self._finished:
            self._estimators.start(min(len(self.wheels.heard), self._slots))

    def _see(self) -> None:
        line, recorded = self._exchange.line.get(), self._exchange.recorded.get()
        if line is not None:
            self._state = pickle.loads(line)
        if recorded is not None:
            self._recorded = pickle.loads(recorded)
        state = self._state
        self._pending.alarms += self._alarms.look(state, self._recorded, self._port_states())
        if state.error and not self._finished:
            kind, text = state.error
            raise getattr(errors, kind)(text)
        self.ended, self.message = state.ended, state.message

    def _close(self, error: BaseException | None = None) -> None:
        """End what still runs and give the memory back; `error` is what ends the run, if any."""
        self._exchange.set(STOP)
        self._exchange.set(FINISH)
        if not self._finished:
            interrupted = isinstance(error, KeyboardInterrupt)
            self.order("close", "stopped" if interrupted else "the run ended with an error")
        estimators = self._estimators
        loading = [estimators.kept[slot] for slot in estimators.kept.keys() - estimators.ready]
        for kept in self._processes().values():
            patience = LEAVE if kept is self._recorder else AT_ONCE
            kept.wait(0.0 if kept in loading else patience)  # one that loads hears nothing
        if not self._finished:
            self._remove_empty()
        self._exchange.close()

    def _remove_empty(self) -> None:
        """Remove the recording of a run that did not begin, so that its name is free again."""
        recorded = self._exchange.recorded.get()
        state = self._recorded if recorded is None else pickle.loads(recorded)
        file, begun = self._plan.record, self._orders and not state.answer
        if file is not None and begun and state.done and not state.bytes:
            file.unlink(missing_ok=True)
