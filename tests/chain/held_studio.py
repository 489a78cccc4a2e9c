"""`tirelib studio` whose refits stop after their first steps while the file of HOLD exists.

Called with arguments this program is the server, and without any it is the process of one job. So a
test stays in the middle of a refit for as long as it likes, on a machine of any speed.
"""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tirelib.cli import main, progress
from tirelib.studio import jobs, runner

STEPS = 1
"""Steps after which a refit stops: forces say two, one for each part that is held out."""
_lines = progress._json_lines


def held_lines(what: str, total: int | None) -> Callable[[str], None]:
    """Say the steps of a job as JSON, and wait after some of a refit's."""
    say, count = _lines(what, total), 0

    def advance(label: str) -> None:
        nonlocal count
        say(label)
        count += 1
        while sys.argv[1] == "add" and count >= STEPS and Path(os.environ["HOLD"]).exists():
            time.sleep(0.02)

    return advance


if __name__ == "__main__":
    if len(sys.argv) > 1:
        jobs.Jobs.__init__.__defaults__ = ((sys.executable, __file__),)  # type: ignore[attr-defined]
        sys.argv = ["tirelib", "studio", *sys.argv[1:]]
        main()
    else:
        progress._json_lines = held_lines
        runner.main()
