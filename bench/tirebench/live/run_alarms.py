"""Alarms of a live run as sentences, one when a fault begins and one when it ends."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tirebench.live.ports import PortState
from tirebench.live.priority import RIGHT
from tirebench.live.reader import LineState
from tirebench.live.recording_state import RecorderState
from tirebench.recording.recorder import alarm_event

RECORDED_AGAIN = "the recording continues"
TOO_BUSY = (
    "the machine is too busy to decode the incoming frames: raw bytes are still recorded, but "
    f"estimates pause; close other programs, or allow real-time priority ({RIGHT})"
)
DECODED_AGAIN = "the estimates continue"


class RunAlarms:
    """A late reader, wheels with a wrong rate, a silent bus, ports that are away, a full disk.

    Parameters
    ----------
    ports : sequence of str
        Names of the sources' ports.
    estimated : bool
        Whether there are estimators.
    write : callable
        Takes the event of an alarm for the recording.

    Attributes
    ----------
    given_up : dict of source to str
        Ports that were given up, and why; empty once they are back.
    """

    def __init__(
        self, ports: Sequence[str], *, estimated: bool, write: Callable[[Mapping[str, Any]], None]
    ) -> None:
        self.given_up: dict[int, str] = {}
        self._ports = tuple(ports)
        self._estimated = estimated
        self._write = write
        self._passing = False
        self._contradicted: set[int] = set()
        self._silent: set[tuple[str, int | None]] = set()
        self._unrecorded = ""

    def look(
        self, line: LineState, recorded: RecorderState, ports: Sequence[PortState | None]
    ) -> list[str]:
        """Return the alarms that begin or end with the present states, in words.

        `ports` holds the state of each port that a process of its own reads, None before the first.
        """
        alarms = self._busy(line) + self._rates(line) + self._bus(line) + self._away(ports)
        if recorded.error != self._unrecorded:  # there is no recording to write this into
            self._unrecorded = recorded.error
            alarms.append(recorded.error or RECORDED_AGAIN)
        return alarms

    def _busy(self, line: LineState) -> list[str]:
        if line.passing == self._passing:
            return []
        self._passing = line.passing
        said = TOO_BUSY if line.passing else DECODED_AGAIN
        self._write(alarm_event("busy", said, on=line.passing))
        return [said]

    def _rates(self, line: LineState) -> list[str]:
        alarms = []
        for wheel, said in line.wheels.contradicted.items():
            if wheel not in self._contradicted:
                self._contradicted.add(wheel)
                alarms.append(f"{said}; its turns are not reported" if self._estimated else said)
                self._write(alarm_event("sample rate", alarms[-1], on=True))
        return alarms

    def _bus(self, line: LineState) -> list[str]:
        alarms = []
        for place, silence in line.wheels.silences(time.monotonic_ns()).items():
            if bool(silence) != (place in self._silent):
                self._silent ^= {place}
                alarms.append(silence or f"{place[0]}: the bus sends it again")
                self._write(alarm_event(f"{place[0]} from the bus", alarms[-1], on=bool(silence)))
        return alarms

    def _away(self, ports: Sequence[PortState | None]) -> list[str]:
        alarms = []
        for number, state in enumerate(ports):
            gone = "" if state is None else state.gone
            why = f"{gone}; reconnecting is tried until the port is back" if gone else ""
            if why != self.given_up.get(number, ""):
                self.given_up[number] = why
                alarms.append(why or f"{self._ports[number]}: the port is back")
                self._write(alarm_event(f"source {number}", alarms[-1], on=bool(gone)))
        return alarms
