"""What tests share is made where a program of ``build`` asks for it, too."""

import os
import subprocess
import sys
from pathlib import Path
from threading import Barrier, Event, Thread

import pytest

from tests.once import PLACE, first_alone

PROGRAM = """
from tests.once import once
made = once("number", lambda folder: (folder / "n").write_text("1"))
print(made, (made / "n").read_text())
"""


def test_without_a_test_run_there_is_a_folder_until_the_end() -> None:
    environment = {name: text for name, text in os.environ.items() if name != PLACE}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        check=True,
        capture_output=True,
        text=True,
        env=environment,
        cwd=Path(__file__).parents[2],
    )
    made, held = done.stdout.split()
    assert held == "1"
    assert not Path(made).exists()


def test_the_first_goes_through_alone_and_all_others_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(PLACE, str(tmp_path))
    gone, inside, together = Event(), [], Barrier(2)

    def follow() -> None:
        with first_alone("door"):
            inside.append(gone.is_set())
            together.wait(600.0)

    others = [Thread(target=follow) for _ in range(2)]
    with first_alone("door"):
        for other in others:
            other.start()
            other.join(0.2)
        gone.set()
    for other in others:
        other.join()
    assert inside == [True, True]
