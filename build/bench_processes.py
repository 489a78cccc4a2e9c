"""Processes of a run as the system sees them: which is which, what they use, how to kill one."""

import json
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

TICKS = os.sysconf("SC_CLK_TCK")
PAGE_SIZE = os.sysconf("SC_PAGE_SIZE")


def children(root: int) -> list[int]:
    """Return a process and all that it and its children have started, as far as they live."""
    parent = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            fields = _stat(int(entry.name))
            if fields:
                parent[int(entry.name)] = int(fields[1])
    found = [root]
    for pid in found:
        found += [child for child, of in parent.items() if of == pid]
    return found


def cpu_time(pid: int) -> float:
    """Return what a process has used, user and system [s]; 0 when it is gone."""
    fields = _stat(pid)
    return (int(fields[11]) + int(fields[12])) / TICKS if fields else 0.0


def memory(pid: int) -> int:
    """Return the memory of a process that is in use, [bytes]; 0 when it is gone."""
    fields = _stat(pid)
    return int(fields[21]) * PAGE_SIZE if fields else 0


def alive(pid: int) -> bool:
    """Tell whether a process still runs; one that nobody has asked for its end does not."""
    fields = _stat(pid)
    return bool(fields) and fields[0] not in "ZX"


def _stat(pid: int) -> list[str]:
    """Return the fields of /proc/PID/stat after the name: the state first."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return []
    return text.rpartition(")")[2].split()


def roles(run: int) -> dict[str, int]:
    """Return the processes of a run by what they do, as far as they can be told apart.

    Told by what a process holds open: the port, the recording, the FMU's library, a TCP socket.
    """
    found = {"run": run}
    for pid in children(run)[1:]:
        try:
            command = Path(f"/proc/{pid}/cmdline").read_bytes()
            held = [str(entry.readlink()) for entry in Path(f"/proc/{pid}/fd").iterdir()]
            maps = Path(f"/proc/{pid}/maps").read_text()
        except OSError:
            continue
        if b"resource_tracker" in command or b"forkserver" in command:
            continue
        if any(name.endswith(".mcap") for name in held):
            found["recorder"] = pid
        elif "/binaries/linux64/" in maps:
            found["estimator"] = pid
        elif any(name.startswith("/dev/pts/") for name in held):
            found["reader"] = pid
        elif _listens(held):
            found["page"] = pid
    return found


def _listens(held: Sequence[str]) -> bool:
    """Tell whether one of these files is a listening TCP socket."""
    mine = {name[8:-1] for name in held if name.startswith("socket:[")}
    lines = Path("/proc/net/tcp").read_text().splitlines()[1:]
    return any(line.split()[3] == "0A" and line.split()[9] in mine for line in lines)


@dataclass
class Meter:
    """CPU and memory of a run, all its processes together; those that have ended are kept."""

    run: int
    started: float = field(default_factory=time.monotonic)
    used: dict[int, float] = field(default_factory=dict)
    memory: list[int] = field(default_factory=list)
    loads: list[float] = field(default_factory=list)

    def look(self) -> None:
        """Take a sample; once a second is enough."""
        alive = children(self.run)
        for pid in alive:
            self.used[pid] = max(self.used.get(pid, 0.0), cpu_time(pid))
        self.memory.append(sum(memory(pid) for pid in alive))
        self.loads.append(os.getloadavg()[0])

    @property
    def cpu(self) -> float:
        """CPU time so far, [s]."""
        return sum(self.used.values())


class Listener:
    """Estimates as they come out of a run over UDP, with the moment at which they came.

    Attributes
    ----------
    turns : list of (float, int, float)
        Moment on `time.monotonic` [s], wheel, device time at which the turn was ready [s].
    """

    def __init__(self) -> None:
        self.turns: list[tuple[float, int, float]] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**20)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.2)
        self.port = self._socket.getsockname()[1]
        self._stop = False
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        while not self._stop:
            try:
                data = self._socket.recv(65536)
            except TimeoutError:
                continue
            moment, said = time.monotonic(), json.loads(data)
            self.turns += [(moment, int(wheel), said["t"]) for wheel in said["tirebench"]]

    def wait_after(self, moment: float, patience: float) -> float | None:
        """Return when the first turn after a moment came; None if none did."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            late = [when for when, _, _ in self.turns[-50:] if when > moment]
            if late:
                return min(late)
            time.sleep(0.01)
        return None

    def close(self) -> None:
        """Stop listening."""
        self._stop = True
        self._thread.join()
        self._socket.close()


def end(process: "subprocess.Popen[bytes]", patience: float = 20.0) -> int:
    """Ask a program to end in good order, and make it end if it does not; return its code."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
    return process.wait()
