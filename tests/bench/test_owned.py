"""Nothing that a killed run leaves in shared memory or the temporary folder stays."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from tirebench.live.exchange import Exchange
from tirebench.live.supervised import CONTEXT
from tirebench.owned import SHARED, prefix, sweep

pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason="no /dev/shm on this system")
OWNER = """
import tempfile, time
from tirebench.live.exchange import Exchange
from tirebench.live.supervised import CONTEXT
from tirebench.owned import prefix
exchange, folder = Exchange.create(CONTEXT, 1), tempfile.mkdtemp(prefix=prefix())
print(prefix(), flush=True)
time.sleep(600)
"""


def belongings(name: str) -> list[str]:
    """Return what begins with a name, semaphores included."""
    places = (SHARED, Path(tempfile.gettempdir()))
    found = [entry.name for place in places for entry in place.iterdir()]
    return sorted(entry for entry in found if entry.removeprefix("sem.").startswith(name))


def test_the_next_run_removes_what_a_killed_one_left_and_nothing_of_a_living_one() -> None:
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", OWNER], stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        for _ in range(2)
    ]
    names = [run.stdout.readline().strip() for run in runs if run.stdout is not None]
    try:
        os.killpg(runs[0].pid, signal.SIGKILL)  # with what would tidy up after it
        runs[0].wait()
        assert len(belongings(names[0])) >= 4  # memory, two semaphores, a folder
        mine = Exchange.create(CONTEXT, 1)  # as a run that begins
        assert belongings(names[0]) == []
        assert len(belongings(names[1])) >= 4
        assert sweep() == []
        mine.close()
    finally:
        os.killpg(runs[1].pid, signal.SIGKILL)
        for run in runs:
            run.wait()
            if run.stdout is not None:
                run.stdout.close()
    assert len(sweep()) >= 4
    assert belongings(names[1]) == []


def test_a_name_of_another_namespace_or_program_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    namespace = prefix().split("-")[1]
    gone = [f"tirebench-{namespace}-{2**22 + 1}-5-x", f"tirebench-{namespace}-{os.getpid()}-5-x"]
    kept = ["tirebench-1-4194305-5-x", "tirebench-x", f"{prefix()}x", "other"]
    for name in (*gone, *kept):
        (tmp_path / name).touch()
    removed = {path.name for path in sweep()}
    assert set(gone) <= removed
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(kept)
