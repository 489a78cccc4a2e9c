"""Jobs: commands that run as processes, with progress, an end on request, and a record on disk."""

import json
import os
import re
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tirelib.studio.commands import KINDS
from tirelib.studio.disk import write_atomic
from tirelib.studio.starter import RUNNER, Starter

AT_ONCE = max(1, min(2, (os.cpu_count() or 1)))
"""Jobs that run side by side, of those that the user waits for and of the others."""
FIRST_VIEW = ("check", "show", "identify", "compare")
READING = ("rig", "columns", "suggest", "import", "effects")
ASKED = ("add", "remove", "plant", "next-test", *FIRST_VIEW, *READING)
"""Kinds that the user waits for: they wait for none of the others, which take long, and have more
of the processors than these."""
NICE = 5
"""By how much the others give way (`os.nice`): one of them beside a job that the user waits for on
one processor has a quarter of it; with 2 it would have 0.4, with 10 a tenth."""
TAIL = 4000
"""Characters of a failed command's last words that are kept."""
_COST = re.compile(r"\bstep (\d+), cost (\d+(?:\.\d+)?(?:e[+-]?\d+)?)")


@dataclass(slots=True)
class Job:
    """One command and what became of it; all but the process is in `job.json`.

    Attributes
    ----------
    number : int
    kind : str
        Key of `KINDS`.
    order : dict
        What it is about, with the places that it reads from.
    subject : dict
        Whose it is: campaign, model, quantity.
    state : str
        waiting, running, done, failed, cancelled or interrupted (the server ended before it).
    argv : list of str
        Words after `tirelib`.
    begun, ended : float or None
        Seconds since 1970.
    message : str
        Why it failed.
    """

    number: int
    kind: str
    order: dict[str, Any]
    subject: dict[str, Any]
    state: str = "waiting"
    argv: list[str] = field(default_factory=list)
    begun: float | None = None
    ended: float | None = None
    message: str = ""

    @property
    def over(self) -> bool:
        """Whether nothing more happens to it."""
        return self.state not in ("waiting", "running")


@dataclass(slots=True)
class Progress:
    """What a running job does, steps so far and in all, their label, and the costs of its fit."""

    what: str = ""
    done: int = 0
    total: int | None = None
    label: str = ""
    costs: list[float] = field(default_factory=list)
    rest: bytes = b""
    at: int = 0

    def read(self, file: Path) -> bool:
        """Take what a command has said since the last look; return whether there is news."""
        try:
            with file.open("rb") as stream:
                stream.seek(self.at)
                new = stream.read(1 << 20)
        except OSError:
            return False
        self.at += len(new)
        *lines, self.rest = (self.rest + new).split(b"\n")
        return sum(map(self._take, lines)) > 0

    def _take(self, line: bytes) -> bool:
        try:
            told = json.loads(line)
            self.what, self.done, self.total = told["progress"], told["done"], told["total"]
            self.label = str(told["label"])
        except (ValueError, TypeError, KeyError):
            return False
        if found := _COST.search(self.label):
            self.costs = [*self.costs[: int(found[1]) - 1], float(found[2])]  # of this fit
        return True


class Jobs:
    """Every job of a session, and the processes of those that run.

    Parameters
    ----------
    folder : Path
        One folder for each job: job.json, stdout.txt, stderr.txt, out.
    runner : sequence of str
        Command of the process that starts jobs.
    """

    def __init__(self, folder: Path, runner: Sequence[str] = RUNNER) -> None:
        self.folder, self._starter = folder, Starter(runner)
        folder.mkdir(parents=True, exist_ok=True)
        self.all: dict[int, Job] = {}
        self.progress: dict[int, Progress] = {}
        for file in sorted(folder.glob("*/job.json")):
            with suppress(OSError, ValueError, TypeError):
                job = Job(**json.loads(file.read_text()))
                if not job.over:
                    job.state = "interrupted"
                    self._save(job)
                self.all[job.number] = job

    def place(self, job: Job) -> Path:
        """Return the folder of a job."""
        return self.folder / f"{job.number:04d}"

    def out(self, job: Job) -> Path:
        """Return the folder of a job's results."""
        return self.place(job) / "out"

    def add(self, kind: str, order: Mapping[str, Any], subject: Mapping[str, Any]) -> Job:
        """Put a job at the end of those that wait."""
        job = Job(max(self.all, default=0) + 1, kind, dict(order), dict(subject))
        # a server that was killed just here has left the folder, and no record of the job
        self.out(job).mkdir(parents=True, exist_ok=True)
        job.argv = KINDS[kind].argv(job.order, str(self.out(job)))
        self.all[job.number] = job
        self._save(job)
        return job

    def look(self) -> tuple[list[Job], bool, bool]:
        """Start what may start.

        Return the jobs that have just ended, whether any has begun, and whether any tells news.
        """
        ended, begun, news = [], False, False
        codes = self._starter.ended()
        for number in [*codes, *self._starter.running]:
            job, progress = self.all[number], self.progress[number]
            news |= progress.read(self.place(job) / "stderr.txt")
            if number in codes:
                self._finish(job, codes[number])
                del self.progress[number]
                ended.append(job)
        for asked in (True, False):
            alike = [job for job in self.all.values() if (job.kind in ASKED) == asked]
            waiting = [job for job in alike if job.state == "waiting"]
            room = AT_ONCE - sum(job.state == "running" for job in alike)
            for job in waiting[: max(0, room)]:
                self._start(job)
                begun = True
        return ended, begun, news

    def cancel(self, job: Job) -> None:
        """End a job at once."""
        if job.over:
            return
        job.state, job.ended = "cancelled", time.time()
        self._starter.end(job.number)
        self.progress.pop(job.number, None)
        self._save(job)

    def close(self) -> None:
        """End every process."""
        for job in list(self.all.values()):
            if job.state == "running":
                self.cancel(job)
                job.state = "interrupted"
                self._save(job)
        self._starter.close()

    def warm(self) -> None:
        """Have a process ready, so that the next job starts at once."""
        self._starter.warm()

    def _start(self, job: Job) -> None:
        place = self.place(job)
        files = {name: str(place / f"{name}.txt") for name in ("stdout", "stderr")}
        nice = 0 if job.kind in ASKED else NICE
        self._starter.start(job.number, {"argv": job.argv, "nice": nice, **files})
        self.progress[job.number] = Progress()
        job.state, job.begun = "running", time.time()
        self._save(job)

    def _finish(self, job: Job, code: int) -> None:
        job.ended = time.time()
        kind = KINDS[job.kind]
        made = all((self.out(job) / name).exists() for name in kind.results)
        job.state = "done" if code in kind.allowed and made else "failed"
        if job.state == "failed":
            job.message = self._last_words(job, code)
        self._save(job)

    def _last_words(self, job: Job, code: int) -> str:
        said = ""
        for name in ("stderr.txt", "stdout.txt"):
            with suppress(OSError):
                lines = (self.place(job) / name).read_text(errors="replace").splitlines()
                lines = [line for line in lines if not line.startswith('{"progress"')]
                said = said or "\n".join(lines).strip()[-TAIL:]
        if "Traceback (most recent call last)" in said:
            return (
                f"tirelib has a fault of its own here ({said.splitlines()[-1]}). Nothing else is "
                f"affected. Please report it with {self.place(job) / 'stderr.txt'}"
            )
        return said.removeprefix("Error: ") or f"the command ended with exit code {code}"

    def _save(self, job: Job) -> None:
        write_atomic(self.place(job) / "job.json", json.dumps(asdict(job), indent=1))
