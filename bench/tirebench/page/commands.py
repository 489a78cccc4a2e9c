"""What the viewers ask the run to do: set a marker, record, take the zero or a shunt of the gages.

A command crosses from the page's process as JSON in one write of a pipe; the run asks for it
between two reads and never waits. Nothing that a viewer sends names a file.
"""

import json
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Protocol

from tirebench.errors import BenchError, DeviceError

LONGEST_MARKER = 200
"""Characters of a marker."""
KINDS = ("marker", "record", "zero", "shunt")
NOTES = 20
"""Markers that the page lists."""
ASK_EVERY = 0.05
"""Time between two looks into the pipe, [s]."""


@dataclass(frozen=True, slots=True)
class Command:
    """One wish of a viewer.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    text : str
        Text of a marker, or for a shunt the resistances of gage and shunt and the gage factor.
    on : bool
        Whether to record; whether the shunt is on.
    wheel : int
        Wheel whose zero or shunt is meant.
    """

    kind: str
    text: str = ""
    on: bool = False
    wheel: int = 0

    def pack(self) -> bytes:
        """Return the command as bytes, short enough for one write of a pipe."""
        return json.dumps([self.kind, self.text, self.on, self.wheel]).encode()

    @classmethod
    def unpack(cls, data: bytes) -> "Command":
        """Return the command of `pack`, checked again."""
        kind, text, on, wheel = json.loads(data)
        return parse_command({"command": kind, "text": text, "on": on, "wheel": wheel})


def parse_command(document: Any) -> Command:
    """Return the command that a viewer sent.

    Raises
    ------
    DeviceError
        If it is no command.
    """
    given = document.get("command") if isinstance(document, dict) else type(document).__name__
    if given not in KINDS:
        raise DeviceError(
            f"command = {str(given)[:40]!r}; known commands are {' and '.join(KINDS)}; send one of "
            "them"
        )
    text, on, wheel = (document.get(*one) for one in (("text", ""), ("on", False), ("wheel", 0)))
    printable = isinstance(text, str) and all(c.isprintable() for c in text)
    known = isinstance(wheel, int) and not isinstance(wheel, bool) and 0 <= wheel <= 255
    if not printable or len(text) > LONGEST_MARKER or not isinstance(on, bool) or not known:
        raise DeviceError(
            f"command = {given!r} with text of {len(str(text))} characters, on = {on!r}, wheel = "
            f"{str(wheel)[:9]}; a line of up to {LONGEST_MARKER} characters, true or false, and "
            "0 .. 255 are needed; correct it"
        )
    return Command(str(given), text, on, wheel)


class Target(Protocol):
    """What records: the recorder of the run."""

    @property
    def bytes(self) -> int:
        """Raw bytes so far."""

    def event(self, event: Mapping[str, Any]) -> None:
        """Write an event of this moment."""


class Switch(Protocol):
    """Recording that is turned on and off while the run goes on."""

    @property
    def recorder(self) -> Target | None:
        """What records now; None if nothing does."""

    @property
    def name(self) -> str:
        """Name of the present recording, else of the last one; empty before the first."""

    def start(self) -> str:
        """Begin a recording and return its name; the name of one that is going on."""

    def stop(self) -> None:
        """End the recording that is going on, if there is one."""


class Gages(Protocol):
    """What takes the zero of gages, and their gain; each returns what it did, in words."""

    def zero(self, wheel: int) -> str:
        """Write a device file with the zero of a standing wheel."""

    def shunt(self, wheel: int, on: bool, text: str) -> str:
        """Remember the strain without the shunt; with it, write a device file with the gains."""


class CommandDesk:
    """Take commands from the page and carry them out between two reads.

    Parameters
    ----------
    switch : Switch or None
        None when there is nothing to record, as in a replay.
    gages : Gages or None
        None where they may not be set up, as in a replay.
    """

    def __init__(self, switch: Switch | None, gages: Gages | None = None) -> None:
        self._switch = switch
        self._gages = gages
        self._pipes: list[Connection] = []
        self._next = 0.0
        self._markers = 0
        self._done: list[dict[str, Any]] = []
        self._notes: deque[dict[str, Any]] = deque(maxlen=NOTES)

    def listen(self, pipe: Connection) -> None:
        """Take commands from this pipe from now on, instead of the one before."""
        self._pipes.append(pipe)

    def poll(self) -> None:
        """Carry out what has come; costs a system call, at most every `ASK_EVERY`."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + ASK_EVERY
        while len(self._pipes) > 1:
            self._pipes.pop(0).close()
        while self._pipes:
            try:
                if not self._pipes[0].poll(0):
                    return
                data = self._pipes[0].recv_bytes(8192)
            except (EOFError, OSError):
                self._pipes.pop(0).close()
                return
            try:
                self._carry_out(Command.unpack(data))
            except (BenchError, ValueError, TypeError) as error:
                self._say(False, str(error))

    def _carry_out(self, command: Command) -> None:
        switch = self._switch
        if command.kind in ("zero", "shunt"):
            self._set_up(command)
        elif switch is None:
            self._say(False, "a replay cannot be recorded")
        elif command.kind == "marker":
            if switch.recorder is None:
                self._say(False, "nothing is being recorded: start a recording first")
                return
            self._markers += 1
            text = command.text or f"marker {self._markers}"
            switch.recorder.event({"event": "marker", "text": text})
            self._notes.append({"time": time.time(), "text": text})
            self._say(True, f"marker set: {text}")
        elif command.on:
            self._say(True, f"recording {switch.start()}")
        else:
            switch.stop()
            self._say(True, "recording stopped")

    def _set_up(self, command: Command) -> None:
        if self._gages is None:
            self._say(False, "gages cannot be set up in a replay, only while a wheel sends")
            return
        if command.kind == "zero":
            said = self._gages.zero(command.wheel)
        else:
            said = self._gages.shunt(command.wheel, command.on, command.text)
        self.note({"event": command.kind, "wheel": command.wheel, "text": said})
        self._say(True, said)

    def note(self, event: Mapping[str, Any]) -> None:
        """Write an event into the recording, where one goes on."""
        if self._switch is not None and self._switch.recorder is not None:
            self._switch.recorder.event(event)

    def _say(self, good: bool, text: str) -> None:
        number = self._done[-1]["number"] + 1 if self._done else 1
        self._done = [*self._done[-4:], {"number": number, "good": good, "text": text}]

    def state(self) -> dict[str, Any]:
        """Return what the page shows of it."""
        recorder = None if self._switch is None else self._switch.recorder
        return {
            "recording": {
                "possible": self._switch is not None,
                "on": recorder is not None,
                "bytes": 0 if recorder is None else recorder.bytes,
                "markers": self._markers,
                "name": "" if self._switch is None else self._switch.name,
            },
            "notes": list(self._notes),
            "answers": self._done,
        }
