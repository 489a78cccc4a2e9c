"""An unknown FMU does not run; ours and those that the user trusts do."""

import shutil
import zipfile
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from tests.bench.conftest import build_toy
from tirebench.cli import program
from tirebench.errors import FmuError
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.trust import check_trust, how_known, trust_list
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import write_calibration
from tirelib.fmu.build import build_fmu


@pytest.fixture(scope="module")
def ours(calibration: Calibration, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ours")
    write_calibration(calibration, folder / "cal.toml")
    return build_fmu(folder / "cal.toml", folder / "x.fmu", samples_per_step=4)


def test_what_this_tirelib_builds_is_known(ours: Path) -> None:
    assert how_known(read_fmu(ours)) == "identical to what this version of tirelib builds"


@pytest.mark.parametrize("options", [{"missing": 0.0, "buffered": True}, {"python": True}])
def test_whatever_options_it_was_built_with(
    ours: Path, tmp_path: Path, options: dict[str, Any]
) -> None:
    fmu = build_fmu(ours.parent / "cal.toml", tmp_path / "x.fmu", samples_per_step=4, **options)
    assert how_known(read_fmu(fmu)) == "identical to what this version of tirelib builds"


def test_a_sealed_one_must_be_trusted_by_name(ours: Path, tmp_path: Path) -> None:
    fmu = build_fmu(ours.parent / "cal.toml", tmp_path / "x.fmu", sealed=True)
    with pytest.raises(FmuError, match="add --trust once"):
        check_trust(read_fmu(fmu), trust=False)


def altered(fmu: Path, out: Path, name: str, data: bytes) -> Path:
    """Return a copy with one file changed or added."""
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(out, "w") as target:
        for entry in source.infolist():
            if entry.filename != name:
                target.writestr(entry, source.read(entry))
        target.writestr(name, data)
    return out


@pytest.mark.parametrize(
    "name",
    [
        "binaries/linux64/StrainTire.so",
        "resources/StrainTire.core",
        "resources/evil.so",
        "sources/core/wheel.c",
        "resources/settings.json",
        "resources/calibration.toml",
        "modelDescription.xml",
    ],
)
def test_a_changed_copy_of_ours_is_unknown(ours: Path, tmp_path: Path, name: str) -> None:
    copy = altered(ours, tmp_path / "y.fmu", name, b"{}")
    with pytest.raises(FmuError, match=r"sha256 [0-9a-f]{64} is unknown, .*--trust once"):
        check_trust(read_fmu(copy), trust=False)


def test_a_foreign_fmu_runs_only_when_trusted_and_is_then_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    toy = build_toy(tmp_path, 3)
    words = ["run", "--replay", str(tmp_path / "none.mcap"), "--fmu", str(toy)]
    refused = CliRunner().invoke(program, words)
    assert isinstance(refused.exception, FmuError)
    assert "is unknown" in str(refused.exception)
    archive = read_fmu(toy)
    assert check_trust(archive, trust=True) == "added to the list of trusted FMUs by --trust"
    assert how_known(read_fmu(shutil.copy(toy, tmp_path / "z.fmu"))) is not None
    assert archive.sha256 in trust_list().read_text()
