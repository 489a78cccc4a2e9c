"""What a supplier hands over: sealed FMUs, and sources that any compiler takes."""

import ctypes
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pytest
from click.testing import CliRunner
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from tests.fmu import live
from tests.fmu.player import play, strain
from tirelib.cli.fmu import fmu as command
from tirelib.core.errors import FormatError
from tirelib.estimators.calibration_file import write_calibration
from tirelib.fmu.build import embedded_calibration
from tirelib.fmu.check import check_fmu
from tirelib.fmu.run import LoadedFmu

CAMPAIGN = "secret proving ground"


def built(out: Path, *options: str) -> tuple[int, str]:
    found = CliRunner().invoke(
        command,
        ["build", "--calibration", str(calibration(out.parent)), "--out", str(out), *options],
    )
    return found.exit_code, found.output


def calibration(folder: Path) -> Path:
    """A calibration that names the campaign it was made on."""
    path = folder / "cal.toml"
    told = {"unit": "N", "n": 15, "conditions": 15, "cross_validated_rmse": 12.3, "r2": 0.99}
    write_calibration(
        live.calibration(), path, {"statistics": {"Fz": told}, "data": [{"name": CAMPAIGN}]}
    )
    return path


def contents(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


RATE = ("--sample-rate", "5000")


@pytest.fixture(scope="module")
def unsealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU that a build gives without an option of what it holds."""
    path = tmp_path_factory.mktemp("unsealed") / "open.fmu"
    code, output = built(path, *RATE)
    assert code == 0, output
    return path


def test_a_sealed_fmu_holds_no_campaign_and_no_measured_strain(
    unsealed: Path, tmp_path: Path
) -> None:
    for name in ("sealed", "again"):
        code, output = built(tmp_path / f"{name}.fmu", *RATE, "--sealed")
        assert code == 0, output
    plain, sealed = contents(unsealed), contents(tmp_path / "sealed.fmu")
    signals = {f"resources/reference/StrainTire_{n}" for n in ("in.csv", "ref.csv", "ref.opt")}
    assert set(plain) - set(sealed) == {"resources/calibration.toml", *signals}
    assert CAMPAIGN in plain["documentation/index.html"].decode()
    assert not [name for name, data in sealed.items() if CAMPAIGN.encode() in data]
    assert "12.3 N" in sealed["documentation/index.html"].decode()
    assert (tmp_path / "again.fmu").read_bytes() == (tmp_path / "sealed.fmu").read_bytes()
    document = check_fmu(tmp_path / "sealed.fmu")
    assert document["passed"], document["parts"]
    assert not document["compared"]
    for name in signals:  # a supplier may hand these over in a separate folder
        (tmp_path / Path(name).name).write_bytes(plain[name])
    document = check_fmu(tmp_path / "sealed.fmu", reference=tmp_path)
    assert document["passed"], document["parts"]
    assert document["compared"]
    with pytest.raises(FormatError, match=r"^[^(]*sealed.fmu: is sealed, so it holds no"):
        embedded_calibration(tmp_path / "sealed.fmu")


def test_the_python_fmu_cannot_be_sealed_and_an_old_option_does_nothing(
    unsealed: Path, tmp_path: Path
) -> None:
    out = tmp_path / "x.fmu"
    words = f"build --calibration {live.calibration_file()} --out {out} --python --sealed"
    runner = CliRunner().invoke(command, words.split())
    assert "--python and --sealed; only one of them is allowed" in str(runner.exception)
    assert not out.exists()
    assert built(tmp_path / "old.fmu", *RATE, "--native")[0] == 0
    assert (tmp_path / "old.fmu").read_bytes() == unsealed.read_bytes()
    assert built(tmp_path / "python.fmu", *RATE, "--python")[0] == 0
    assert "resources/slavemodule.txt" in contents(tmp_path / "python.fmu")


def compiled(fmu: Path, folder: Path, *flags: str) -> Path:
    """Compile the sources that the model description lists, as an importer would."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    root = Xml.parse(folder / "modelDescription.xml").getroot()
    files = [str(file.get("name")) for file in root.iter("File")]
    assert "fmi2/strain_tire.c" in files
    library = folder / "binaries" / "linux64" / "StrainTire.so"
    library.unlink()
    subprocess.run(
        ["gcc", "-O2", "-shared", "-fPIC", *flags, *files, "-lm", "-o", library],
        check=True,
        cwd=folder / "sources",
    )
    return library


def test_an_importer_that_compiles_the_sources_inside_gets_the_same(tmp_path: Path) -> None:
    assert validate_fmu(str(live.fmu_file(10))) == []
    compiled(live.fmu_file(10), tmp_path / "x")
    packed = tmp_path / "compiled.fmu"
    with zipfile.ZipFile(packed, "w") as archive:
        for file in sorted((tmp_path / "x").rglob("*")):
            archive.write(file, file.relative_to(tmp_path / "x"))
    seen = []
    for path in (live.fmu_file(10), packed):
        with LoadedFmu(path) as one:
            one.start(live.RATE)
            seen.append(play(one, strain()))
    for wanted, given in zip(*seen, strict=True):
        for name, value in wanted.items():
            if isinstance(value, float):
                np.testing.assert_allclose(given[name], value, rtol=1e-9, err_msg=name)
            else:
                assert given[name] == value, name
    assert seen[0][-1]["valid"]


def test_functions_take_a_prefix_where_fmus_are_linked_into_one_program(tmp_path: Path) -> None:
    fmu = live.fmu_file(10)
    library = ctypes.CDLL(str(compiled(fmu, tmp_path, "-O0", "-DFMI2_FUNCTION_PREFIX=StrainTire_")))
    wanted = {f"StrainTire_{name}" for name in _exported(fmu, tmp_path)}
    assert len(wanted) == 34
    for name in wanted:
        assert hasattr(library, name), name
    assert not hasattr(library, "fmi2DoStep")


def _exported(fmu: Path, folder: Path) -> set[str]:
    """Return the functions of FMI that the packed library has."""
    library = folder / "packed.so"
    library.write_bytes(contents(fmu)["binaries/linux64/StrainTire.so"])
    said = subprocess.run(
        ["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True
    ).stdout
    return {line.split()[-1] for line in said.splitlines() if "fmi2" in line}


def test_the_model_description_lists_all_sources_that_are_inside() -> None:
    inside = {n[8:] for n in contents(live.fmu_file(10)) if n.startswith("sources/")}
    with zipfile.ZipFile(live.fmu_file(10)) as archive:
        root = Xml.fromstring(archive.read("modelDescription.xml"))
    listed = {file.get("name") for file in root.iter("File")}
    assert listed == {name for name in inside if name.endswith(".c")}
    description = read_model_description(str(live.fmu_file(10)))
    files = description.buildConfigurations[0].sourceFileSets[0].sourceFiles
    assert set(files) == listed
