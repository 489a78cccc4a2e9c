"""Recordings that are turned on and off while the run goes on."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tirebench.deadline import Deadline
from tirebench.errors import RecordingError
from tirebench.live.chain import LiveChain
from tirebench.recording.header import numbered
from tirebench.recording.recorder import alarm_event

ANSWER_TIME = 5.0
"""How long the recorder may take to answer, [s]."""


class RecordingSwitch:
    """Recordings one after another, in files that the run names; see `page.commands.Switch`.

    Parameters
    ----------
    chain : LiveChain
        The run whose recorder is switched.
    first : Path
        File of the first recording; those after it get a number, see `numbered`.
    started : bool
        Whether it goes on already.

    Attributes
    ----------
    files : list of Path
        Recordings so far.
    """

    def __init__(self, chain: LiveChain, first: Path, *, started: bool) -> None:
        self.files: list[Path] = [first] if started else []
        self._chain = chain
        self._first = first
        self._on = started

    @property
    def recorder(self) -> "RecordingSwitch | None":
        """What records now; None if nothing does."""
        return self if self._on else None

    @property
    def bytes(self) -> int:
        """Raw bytes of the recording that goes on."""
        return self._chain.recorded.bytes

    @property
    def name(self) -> str:
        """Name of the present recording, else of the last one; empty before the first."""
        return self.files[-1].name if self.files else ""

    def event(self, event: Mapping[str, Any]) -> None:
        """Write an event of this moment."""
        self._chain.order("event", dict(event))

    def alarm(self, name: str, text: str, *, on: bool) -> None:
        """Write an alarm of the run that begins or ends at this moment."""
        self._chain.order("event", alarm_event(name, text, on=on))

    def start(self) -> str:
        """Begin a recording, unless one is going on; return the name of its file.

        Raises
        ------
        RecordingError
            If it cannot be written.
        """
        if not self._on:
            file = numbered(self._first)
            self._chain.order("start", str(file))
            if not self._chain.obeyed(Deadline.after(ANSWER_TIME)):
                raise RecordingError(f"{file}: the recorder does not answer; wait, then try again")
            if self._chain.recorded.answer:
                raise RecordingError(self._chain.recorded.answer)
            self._on = True
            self.files.append(file)
        return self.files[-1].name

    def stop(self) -> None:
        """End the recording that is going on, if there is one."""
        if self._on:
            self._on = False
            self._chain.order("stop", "stopped by a viewer")
            self._chain.obeyed(Deadline.after(ANSWER_TIME))
