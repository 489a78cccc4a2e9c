"""The check says the truth about good, altered, damaged, hostile and foreign FMUs."""

import json
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from pythonfmu import FmuBuilder

from tests.fmu import live
from tirelib.cli.fmu import fmu as command
from tirelib.core.errors import FormatError
from tirelib.fmu import check as checking
from tirelib.fmu.check import check_fmu

REFERENCE = "resources/reference/StrainTire_ref.csv"
_FOREIGN = """
import ctypes
from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Real


class Foreign(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.y = 0.0
        self.register_variable(
            Real("y", causality=Fmi2Causality.output, initial=Fmi2Initial.exact))

    def do_step(self, current_time, step_size):
        {body}
        return True
"""


def changed(
    path: Path,
    change: Callable[[str, bytes], bytes | None],
    more: dict[str, bytes] | None = None,
    *,
    python: bool = False,
) -> Path:
    """Write the FMU with some of its files changed, left out or added."""
    with (
        zipfile.ZipFile(live.fmu_file(10, python=python)) as old,
        zipfile.ZipFile(path, "w") as new,
    ):
        for name in old.namelist():
            data = change(name, old.read(name))
            if data is not None:
                new.writestr(name, data)
        for name, data in (more or {}).items():
            new.writestr(name, data)
    return path


def same(_: str, data: bytes) -> bytes:
    return data


def parts(document: dict[str, Any]) -> dict[str, tuple[bool, str]]:
    return {part["name"]: (part["passed"], part["detail"]) for part in document["parts"]}


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(command, ["check", *arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.output


@pytest.mark.parametrize(
    ("samples", "buffered", "python"), [(10, False, True), (10, False, False), (100, True, False)]
)
def test_what_was_built_passes_and_leaves_a_page_and_json(
    samples: int, buffered: bool, python: bool, tmp_path: Path
) -> None:
    file = live.fmu_file(samples, buffered=buffered, python=python)
    code, told = run(str(file), "--json", str(tmp_path / "c.json"), "--out", str(tmp_path / "p"))
    assert code == 0, told
    assert "Passed: the FMU is valid, runs, and reproduces its reference signals." in told
    found = json.loads((tmp_path / "c.json").read_text())
    assert (found["format"], found["passed"], found["compared"]) == (
        "tirelib-fmu-check/1",
        True,
        True,
    )
    assert {row["name"] for row in found["variables"]} > {"Fz", "alpha", "kappa", "Fy", "valid"}
    assert all(row["magnitude"] > 1e-6 for row in found["variables"])
    page = (tmp_path / "p" / "index.html").read_text()
    assert "Check of StrainTire" in page
    assert found["sha256"] in page


def test_the_reference_meets_estimates_a_bridge_a_gap_and_the_watchdog() -> None:
    from fmpy.util import read_csv

    with zipfile.ZipFile(live.fmu_file(10)) as archive:
        file = live.folder() / "ref.csv"
        file.write_bytes(archive.read(REFERENCE))
    signals = read_csv(file)
    assert signals["turn"][-1] >= 6
    assert 0.2 < signals["valid"].mean() < 0.95
    met = 0
    for value in signals["flags"]:
        met |= int(value)
    for flag in (1, 2, 4, 131072):
        assert met & flag, flag


@pytest.mark.parametrize("wanted", [lambda x: x * (1 + 1e-7), lambda x: float("nan")])
def test_a_changed_number_in_the_reference_is_found_and_named(
    tmp_path: Path, wanted: Callable[[float], float]
) -> None:
    def change(name: str, data: bytes) -> bytes:
        if name != REFERENCE:
            return data
        lines = data.decode().splitlines()
        row = next(n for n, line in enumerate(lines[1:], 1) if line.split(",")[1] != "nan")
        cells = lines[row].split(",")
        cells[1] = repr(wanted(float(cells[1])))
        lines[row] = ",".join(cells)
        return "\n".join(lines).encode()

    document = check_fmu(changed(tmp_path / "x.fmu", change))
    assert not document["passed"]
    bad = [row["name"] for row in document["variables"] if not row["passed"]]
    assert bad == ["Fz"]
    assert parts(document)["reference"] == (False, "Fz differ from the reference signals")


def test_a_validity_that_differs_for_one_step_is_found(tmp_path: Path) -> None:
    def change(name: str, data: bytes) -> bytes:
        if name != REFERENCE:
            return data
        lines = data.decode().splitlines()
        column = lines[0].split(",").index('"valid"')
        cells = lines[-40].split(",")
        cells[column] = str(1 - int(cells[column]))
        lines[-40] = ",".join(cells)
        return "\n".join(lines).encode()

    code, told = run(str(changed(tmp_path / "x.fmu", change)))
    assert code == 1
    assert "valid differ from the reference signals" in told


def test_an_fmu_of_ours_without_its_reference_fails(tmp_path: Path) -> None:
    path = changed(tmp_path / "x.fmu", lambda n, d: None if "reference" in n else d)
    document = check_fmu(path)
    assert not document["passed"]
    assert "are missing; build the FMU again" in parts(document)["reference"][1]


def test_a_broken_description_and_a_broken_slave_are_named(tmp_path: Path) -> None:
    def change(name: str, data: bytes) -> bytes:
        if name == "modelDescription.xml":
            return data.replace(b'unit="N"', b'unit="stone"')
        return data.replace(b"advance", b"advanced") if name.endswith("strain_tire.py") else data

    document = check_fmu(changed(tmp_path / "x.fmu", change, python=True))
    found = parts(document)
    assert not found["validation"][0]
    assert "stone" in found["validation"][1]
    assert not found["reference"][0]


@pytest.mark.parametrize("name", ["../outside.txt", "/etc/x", "a/../../x", "C:/x"])
def test_a_path_that_leads_outside_is_never_unpacked(tmp_path: Path, name: str) -> None:
    document = check_fmu(changed(tmp_path / "x.fmu", same, {name: b"hostile"}))
    assert not document["passed"]
    assert "outside the folder" in parts(document)["archive"][1]
    assert list(parts(document)) == ["archive"]


def test_an_archive_that_unpacks_to_too_much_is_never_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checking, "LARGEST_UNPACKED", 1_000_000)
    found = parts(check_fmu(live.fmu_file(10)))
    assert "it would unpack to" in found["archive"][1]
    assert len(found) == 1


def test_flipped_bytes_are_told(tmp_path: Path) -> None:
    data = bytearray(live.fmu_file(10).read_bytes())
    data[20_000:20_040] = bytes(40)
    (tmp_path / "x.fmu").write_bytes(data)
    code, told = run(str(tmp_path / "x.fmu"))
    assert code == 1
    assert "FAILED  archive: " in told
    assert "damaged" in told


def test_what_is_no_fmu_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("nothing")
    (tmp_path / "cut.fmu").write_bytes(live.fmu_file(10).read_bytes()[:9000])
    with zipfile.ZipFile(tmp_path / "zip.fmu", "w") as archive:
        archive.writestr("readme.txt", "a zip")
    for name, cause in (
        ("none", "cannot be read"),
        ("text", "is not an FMU"),
        ("cut", "is truncated or damaged"),
        ("zip", "without modelDescription.xml"),
    ):
        with pytest.raises(FormatError, match=cause):
            check_fmu(tmp_path / f"{name}.fmu")
    told = subprocess.run(
        [
            sys.executable,
            "-c",
            "from tirelib.cli import main; main()",
            "fmu",
            "check",
            str(tmp_path / "text.fmu"),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 2
    assert "Traceback" not in told.stderr


def foreign(folder: Path, body: str) -> Path:
    script = folder / "foreign_slave.py"
    script.write_text(_FOREIGN.format(body=body))
    path = FmuBuilder.build_FMU(script, dest=folder / "Foreign.fmu")
    sys.modules.pop("foreign_slave", None)
    return Path(path)


def test_a_foreign_fmu_is_validated_and_run_and_compared_where_it_can_be(tmp_path: Path) -> None:
    file = foreign(tmp_path, "self.y = current_time + step_size")
    code, told = run(str(file))
    assert code == 0, told
    assert "Passed without reference" in told
    signals = tmp_path / "signals"
    signals.mkdir()
    (signals / "Foreign_in.csv").write_text('"time"\n0\n0.1\n')
    (signals / "Foreign_ref.opt").write_text("StartTime, 0\nStopTime, 0.2\nStepSize, 0.1\n")
    for last, wanted in (("0.2", 0), ("0.21", 1)):
        (signals / "Foreign_ref.csv").write_text(f'"time","y"\n0,0\n0.1,0.1\n0.2,{last}\n')
        code, told = run(str(file), "--reference", str(signals))
        assert code == wanted, told
    with pytest.raises(FormatError, match="holds no reference signals"):
        check_fmu(file, reference=tmp_path)


def test_an_fmu_that_kills_its_process_is_a_result(tmp_path: Path) -> None:
    document = check_fmu(foreign(tmp_path, "ctypes.string_at(0)"))
    assert not document["passed"]
    assert parts(document)["run"] == (False, "its process died of signal 11")


def test_an_fmu_that_never_ends_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checking, "TIME_LIMIT", 6.0)
    document = check_fmu(foreign(tmp_path, "import time; time.sleep(60)"))
    assert parts(document)["run"] == (False, "the run did not end within 6 s")
