"""What tests share is made where a program of ``build`` asks for it, too."""

import os
import subprocess
import sys
from pathlib import Path

from tests.once import PLACE

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
