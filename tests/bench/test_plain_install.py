"""Without the bench's packages its program still says what it can do and what to install."""

import subprocess
import sys
from pathlib import Path

import pytest

BLOCKED = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"can", "cantools", "cobs", "fmpy", "mcap", "serial",
                                      "pythonfmu", "starlette", "uvicorn", "websockets"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Absent())
sys.argv = ["tirebench", *sys.argv[1:]]
from {module} import main
main()
"""


def program(module: str, *words: str) -> subprocess.CompletedProcess[str]:
    code = BLOCKED.replace("{module}", module)
    return subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False
    )


def tirebench(*words: str) -> subprocess.CompletedProcess[str]:
    return program("tirebench.cli", *words)


def test_an_export_without_its_package_says_what_to_install(tmp_path: Path) -> None:
    done = program(
        "tirelib.cli", "fmu", "virtual", "--python", "-q", "--out", str(tmp_path / "V.fmu")
    )
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "Error: this command needs the package 'pythonfmu', which is not installed; install it "
        "with pip install 'tirelib[fmu]'"
    ]


def test_the_help_lists_every_verb() -> None:
    done = tirebench("--help")
    assert done.returncode == 0, done.stderr
    for verb in ("ports", "emulate", "run", "record", "replay", "export", "load"):
        assert f"  {verb}" in done.stdout


@pytest.mark.parametrize("words", [("run", "--port", "/dev/null"), ("export", "a.mcap")])
def test_a_verb_says_what_to_install(words: tuple[str, ...]) -> None:
    done = tirebench(*words)
    assert done.returncode == 2
    assert "pip install 'tirelib[bench]'" in done.stderr
    assert "Traceback" not in done.stderr
