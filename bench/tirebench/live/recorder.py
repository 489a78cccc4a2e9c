"""The process that records: it writes what comes through the queues into files that the run names.

The recorder notes in one step how long the file is and up to where the queues are in it. One that
is started again cuts off what its predecessor left half written, and goes on from there. Where
nothing can be written, as on a full disk, the queues wait; a new part begins when there is room.
"""

import pickle
import time
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Any
from uuid import uuid4

from tirebench.errors import RecordingError
from tirebench.estimator.wheels import Block
from tirebench.links import LOST
from tirebench.live.exchange import Address, Exchange
from tirebench.live.pre_trigger import PreTrigger
from tirebench.live.recording_state import Order, RecorderState, RecordingRule, triggers
from tirebench.live.space import Space
from tirebench.live.supervised import orphaned, settled
from tirebench.live.unfinished import Unfinished
from tirebench.recording.document import line_document, wheel_document
from tirebench.recording.header import RecordingHeader, numbered, part_path
from tirebench.recording.recorder import Recorder
from tirebench.wire.conditions import Conditions

LOOK = 0.05
"""Time between two looks into the queue, [s]; until then the bytes are safe in shared memory."""
CHUNK, CHUNK_BYTES = 0.25, 2**20
"""A chunk is closed after this time [s] or this length [bytes], whichever comes first."""
RETRY = 1.0
"""Time between two attempts where nothing can be written, [s]."""
LINK_EVERY = 1.0
"""Time between two messages of the counters, [s]."""
NO_ROOM = "it could no longer be written"
MOST_EVENTS = 1000
"""So many events are kept while nothing can be written."""
LEFT = 0.5
"""When the run was killed, the recorder waits so long for its last bytes, [s]."""


def record(
    header: RecordingHeader, conditions: Conditions, rule: RecordingRule, address: Address
) -> None:
    """Record until the run ends; the target of the process."""
    exchange = Exchange(address)
    saved = exchange.recorded.get()
    state = RecorderState() if saved is None else pickle.loads(saved)
    _Recorder(header, conditions, rule, exchange, state).run()
    exchange.close()


class _Recorder:
    def __init__(
        self,
        header: RecordingHeader,
        conditions: Conditions,
        rule: RecordingRule,
        exchange: Exchange,
        state: RecorderState,
    ) -> None:
        self._header = header
        self._conditions = conditions
        self._rule = rule
        self._exchange = exchange
        self._state = state
        self._recorder: Recorder | None = None
        self._before = state.bytes
        self._space = Space()
        self._unfinished = Unfinished()
        self._events: deque[tuple[dict[str, Any], int]] = deque(maxlen=MOST_EVENTS)
        self._last = ""  # why the run ends, once it does
        self._kept = None if rule.around is None else PreTrigger(rule.around[0])
        self._part_began = self._published = time.monotonic()
        self._next_trial = self._next_link = 0.0
        self._go_back()
        exchange.orders.go_to(state.orders)
        if state.path is not None:
            self._go_on(state.path)
        self._publish()

    def run(self) -> None:
        """Go on until the order to close, or until the run is gone."""
        settled()
        gone: float | None = None
        while not self._last:
            obeyed = self._obey()
            busy = self._write()
            self._publish(obeyed=obeyed)
            if gone is None and orphaned():
                gone = time.monotonic()
            if gone is not None and time.monotonic() - gone > LEFT:
                self._last = "the run was killed"
            elif not busy and not self._last:
                time.sleep(LOOK)
        self._next_trial = 0.0  # once more, where it could not be written
        while self._write():
            self._publish()
        self._link()
        self._end(self._last)
        self._publish(obeyed=True)

    def _obey(self) -> bool:
        queue, before = self._exchange.orders, self._state.done
        while (message := queue.read()) is not None:
            order: Order = pickle.loads(message)
            if order.kind == "start":
                self._start(Path(order.what))
            elif order.kind == "stop":
                while self._write() and self._kept:
                    continue  # what was before the trigger
                self._write()
                self._end(order.what)
                self._state.waits = None
            elif order.kind == "event":
                self._event(order)
            elif order.kind == "close":
                self._last = order.what
            self._state.done += 1
        return self._state.done > before

    def _event(self, order: Order) -> None:
        """Write an event; it is kept until it is on disk."""
        if triggers(order.what):
            self._trigger(order.moment)
        if self._state.path is None:
            return
        self._events.append((order.what, order.moment))
        if self._recorder is not None:
            self._recorder.event(order.what, order.moment)

    def _start(self, path: Path) -> None:
        """Begin a recording, or wait for what triggers one."""
        if self._kept is None:
            self._state.answer = self._begin(path)
        elif path.exists():
            self._state.answer = f"{path}: already exists; a recording is never overwritten"
        else:
            self._state.answer, self._state.waits = "", path

    def _trigger(self, moment: int) -> None:
        """Begin the recording around a moment [ns, monotonic], or go on with one for longer."""
        state, around = self._state, self._rule.around
        if state.waits is None or around is None:
            return
        state.until = max(state.until, moment + round(1e9 * around[1]))
        if state.path is None:
            path = numbered(state.waits)
            error = self._begin(path)
            if error:
                state.path, state.error = path, error

    def _begin(self, path: Path) -> str:
        """Begin a recording; return why that is not possible, or nothing."""
        state = self._state
        self._before = state.bytes = state.written = state.length = 0
        state.part, state.error, state.since = 1, "", time.monotonic()
        state.began = uuid4().hex, time.time_ns(), time.monotonic_ns()
        self._events.clear()
        if self._kept is None:
            self._drop()
        second = part_path(path, 2)
        if second.exists():
            return f"{second}: already exists and belongs to another recording; name another file"
        error = self._open(path, None)
        state.recordings += not error
        return error

    def _go_on(self, path: Path) -> None:
        """Go on in the file of a recorder that ended."""
        state = self._state
        error = state.error or self._open(path, state.length)
        if error:
            state.path, state.error = path, error
            self._unfinished.add(path, state.length, NO_ROOM)

    def _write(self) -> bool:
        """Write what has come; return whether there was anything."""
        if self._state.path is None and self._state.waits is not None and self._kept is not None:
            busy, lost = self._kept.take(self._exchange)
            if lost:
                self._trigger(lost)
            return busy
        if self._state.path is None:
            self._drop()
            return False
        if self._recorder is None and not self._try_again():
            return False
        try:
            return self._write_queues()
        except RecordingError as error:
            self._fail(error)
            return False

    def _write_queues(self) -> bool:
        exchange, busy = self._exchange, False
        recorder = self._recorder
        if recorder is not None and self._kept:
            self._write_kept(recorder, self._kept)
            return True
        while recorder is not None and (message := exchange.raw.read()) is not None:
            busy = True
            read = pickle.loads(message)
            recorder.read(read)
            if read.event == LOST:
                self._trigger(read.arrival)
            if recorder.waiting > CHUNK_BYTES:
                self._flush()
        while recorder is not None and (message := exchange.strain.read()) is not None:
            busy = True
            recorder.block(Block.unpack(message))
            if recorder.waiting > CHUNK_BYTES:
                self._flush()
        while recorder is not None and (message := exchange.results.read()) is not None:
            busy = True
            recorder.estimate(*pickle.loads(message))
        if time.monotonic() >= self._next_link:
            self._link()
        return busy

    def _write_kept(self, recorder: Recorder, kept: PreTrigger) -> None:
        """Write a piece of what was before the trigger, and take in what comes meanwhile."""
        _, lost = kept.take(self._exchange, forget=False)
        if lost:
            self._trigger(lost)
        kept.write(recorder, CHUNK_BYTES)
        if recorder.waiting > CHUNK_BYTES:
            self._flush()

    def _link(self) -> None:
        """Write the counters of all wheels."""
        self._next_link = time.monotonic() + LINK_EVERY
        line = self._exchange.line.get()
        if line is None or self._recorder is None:
            return
        wheels = pickle.loads(line).wheels
        self._recorder.link(None, line_document(*wheels.counts))
        for number in wheels.heard:
            self._recorder.link(number, wheel_document(wheels, number))

    def _drop(self) -> None:
        """Nothing is recorded: what has come is done with."""
        exchange = self._exchange
        for queue in (exchange.raw, exchange.strain, exchange.results):
            queue.go_to(queue.written)

    def _open(self, path: Path, length: int | None) -> str:
        """Begin a file, or go on in it; return why that is not possible, or nothing."""
        state = self._state
        recording, wall, monotonic = state.began
        header = replace(
            self._header, recording=recording, part=state.part, wall_ns=wall, monotonic_ns=monotonic
        )
        self._part_began = time.monotonic()
        try:
            self._recorder = Recorder(path, header, self._conditions, length)
        except RecordingError as error:
            self._recorder = state.path = None
            return str(error)
        state.path = path
        for event, moment in self._events:
            self._recorder.event(event, moment)
        return ""

    def _try_again(self) -> bool:
        """Begin a new part if there is room for it by now."""
        now, path = time.monotonic(), self._state.path
        if path is None or now < self._next_trial:
            return False
        self._next_trial = now + RETRY
        if not self._begin_part(path):
            return False
        try:
            self._write_queues()
            self._flush()
        except RecordingError as error:
            self._fail(error)
            return False
        self._unfinished.finish()
        self._state.error = ""
        return True

    def _begin_part(self, path: Path) -> bool:
        """Begin the part that follows; the one before stays the current one where that fails."""
        state = self._state
        before = state.part, state.written
        if state.length:
            state.part, state.written = state.part + 1, state.written + state.length
        error = self._open(part_path(path, state.part), None)
        if error:
            state.path, (state.part, state.written) = path, before
            state.error = state.error or error
            return False
        state.length = 0
        return True

    def _split(self) -> None:
        """Begin a new part where the rule wants one."""
        rule, state, recorder = self._rule, self._state, self._recorder
        age = time.monotonic() - self._part_began
        if (
            recorder is None
            or state.path is None
            or (age < rule.split_time and recorder.length < rule.split_size)
        ):
            return
        path = state.path
        recorder.close("the next part follows")
        state.length = recorder.length
        self._before, self._recorder = state.bytes, None
        if not self._begin_part(path):
            self._failed()

    @property
    def _after_trigger(self) -> bool:
        """Whether a recording around a trigger goes on and holds what was before it."""
        return self._kept is not None and not self._kept and self._state.path is not None

    def _end(self, reason: str) -> None:
        recorder, self._recorder = self._recorder, None
        path, self._state.path = self._state.path, None
        if recorder is not None and path is not None:
            try:
                recorder.close(reason)
            except RecordingError as error:
                self._state.error = str(error)
                self._unfinished.add(path, recorder.abandon(), reason)
        self._unfinished.finish()

    def _fail(self, error: RecordingError) -> None:
        """Note that nothing can be written, and go back to what is on disk."""
        state, recorder = self._state, self._recorder
        state.error = state.error or str(error)
        if recorder is not None and state.path is not None:
            state.length = recorder.abandon()
            self._unfinished.add(state.path, state.length, NO_ROOM)
            self._before, self._recorder = state.bytes, None
        self._failed()

    def _failed(self) -> None:
        self._state.failures += 1
        self._next_trial = time.monotonic() + RETRY
        self._go_back()

    def _go_back(self) -> None:
        """Read and write again what is not on disk."""
        if self._kept is not None:
            self._kept.write_again()
        state, exchange = self._state, self._exchange
        for queue, cursor in (
            (exchange.raw, state.raw),
            (exchange.strain, state.strain),
            (exchange.results, state.results),
        ):
            queue.go_to(cursor)

    def _flush(self) -> None:
        """Close the chunk, and note what is safe on disk.

        Raises
        ------
        RecordingError
        """
        state, exchange, recorder = self._state, self._exchange, self._recorder
        if recorder is not None:
            recorder.flush()
            state.length = recorder.length
            state.bytes = self._before + recorder.bytes
            self._events.clear()
            if self._kept is not None:
                self._kept.forget_written()
        state.raw, state.strain = exchange.raw.cursor, exchange.strain.cursor
        state.results = exchange.results.cursor

    def _publish(self, *, obeyed: bool = False) -> None:
        """Note what is safe on disk, and give back its room."""
        state, exchange, recorder = self._state, self._exchange, self._recorder
        due = recorder is None or time.monotonic() - self._published > CHUNK
        if not (obeyed or due):
            return
        self._published = time.monotonic()
        going = recorder is not None or (state.path is None and state.waits is None)
        if going:
            try:
                self._flush()
                self._split()
                if self._after_trigger and time.monotonic_ns() > state.until:
                    self._end("the time after the trigger is over")
            except RecordingError as error:
                self._fail(error)
        state.free, state.rate = self._space.look(state.path, state.written + state.length)
        state.orders, state.cpu = exchange.orders.cursor, time.process_time()
        exchange.recorded.put(pickle.dumps(state, 5))
        for queue in (exchange.raw, exchange.strain, exchange.results):
            queue.take()
        exchange.orders.take()
