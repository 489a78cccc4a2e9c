"""Laws of the build: a valid, described, reproducible FMU that brings all it needs."""

import json
import subprocess
import sys
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.validation import validate_fmu

from tests.fmu import live, virtual_host
from tests.fmu.player import CONDITIONS
from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.flags import TurnFlag
from tirelib.core.rates import RATES
from tirelib.core.units import TABLE
from tirelib.fmu.build import build_fmu, embedded_calibration
from tirelib.fmu.bundle import collect, content_hash, renamed
from tirelib.fmu.native import core_file
from tirelib.fmu.parts import source_file
from tirelib.fmu.run import LoadedFmu

GIVEN = {
    "1": "ratio",
    "N": "force",
    "rad": "angle",
    "m": "length",
    "m/s": "speed",
    "Pa": "pressure",
    "rad/s": "angular_speed",
    "s": "time",
    "Hz": "frequency",
    "N m": "moment",
    "1/s": "strain_rate",
    "kg": "mass",
    "m/s2": "acceleration",
}


KINDS = pytest.mark.parametrize("python", [False, True], ids=["native", "python"])


@KINDS
def test_fmpy_finds_no_problem(python: bool) -> None:
    assert validate_fmu(str(live.fmu_file(10, python=python))) == []


@KINDS
@pytest.mark.parametrize("samples", [1, 10])
def test_inputs_and_outputs_are_those_of_the_contract(samples: int, python: bool) -> None:
    description = read_model_description(str(live.fmu_file(samples, python=python)))
    names = {v.name: v.causality for v in description.modelVariables}
    strains = (
        [f"strain_{g}" for g in range(1, 6)]
        if samples == 1
        else [f"strain_{s}_{g}" for s in range(1, samples + 1) for g in range(1, 6)]
    )
    road = ("friction", "tread_depth", "tread_temperature")
    inputs = [*strains, "speed", "pressure", "camber", "omega", *road, "frame_valid"]
    assert [name for name, causality in names.items() if causality == "input"] == inputs
    for name in ("Fz", "alpha", "kappa", "Fy"):
        assert names[name] == names[f"{name}_std"] == "output"
    for name in (*(f"contact_length_{g}" for g in range(1, 6)), "turn", "age", "valid", "flags"):
        assert names[name] == "output"
    for name in ("sample_rate", "axes", "calibration"):
        assert names[name] == "parameter"
    assert float(description.defaultExperiment.stepSize) == samples / live.RATE


def test_friction_and_tread_end_where_the_library_ends_them() -> None:
    file = live.fmu_file(1)
    ends = embedded_calibration(file).chains[-1].road.ends
    found = {v.name: (v.min, v.max) for v in read_model_description(str(file)).modelVariables}
    assert set(ends) == {"friction", "tread_depth", "tread_temperature"}
    for name, pair in ends.items():
        assert tuple(map(float, found[name])) == pytest.approx(pair, rel=1e-12), name


@pytest.mark.parametrize(
    "file", [live.fmu_file, partial(live.fmu_file, python=True), virtual_host.file]
)
def test_every_real_has_a_unit_and_display_units_convert_as_the_library_does(
    file: Callable[[int], Path],
) -> None:
    description = read_model_description(str(file(10)))
    units = {unit.name: unit for unit in description.unitDefinitions}
    reals = [v for v in description.modelVariables if v.type == "Real"]
    assert all(v.unit in units for v in reals)
    factors = {(row.unit, row.dimension): row.factor for row in TABLE}
    checked = 0
    for name, unit in units.items():
        for display in unit.displayUnits:
            known = factors.get((display.name, GIVEN[name]))
            if known is not None:
                assert display.factor * known == pytest.approx(1.0, rel=1e-12)
                checked += 1
    assert checked >= 8
    shown = {v.name: v.displayUnit for v in reals}
    assert (shown["alpha"], shown["speed"], shown["pressure"]) == ("deg", "km/h", "bar")
    assert shown["strain_1_1"] == "ustrain"
    newton, metre, second = (units["N m"].baseUnit, units["m"].baseUnit, units["1/s"].baseUnit)
    assert (newton.kg, newton.m, newton.s) == (metre.kg + 1, metre.m + 1, 2 * second.s)
    assert {v.unit for v in reals if v.name in ("Mz_rig", "drift")} <= {"N m", "1/s"}


@pytest.mark.parametrize(
    ("file", "known"),
    [
        (live.fmu_file, ["missing"]),
        (partial(live.fmu_file, python=True), ["missing"]),
        (virtual_host.file, None),
    ],
)
def test_all_outputs_are_unknown_at_the_start_and_say_what_they_depend_on_then(
    file: Callable[[int], Path], known: list[str] | None
) -> None:
    with zipfile.ZipFile(file(1)) as archive:
        root = Xml.fromstring(archive.read("modelDescription.xml"))
    variables = list(root.iterfind("ModelVariables/ScalarVariable"))
    outputs = [n for n, v in enumerate(variables, 1) if v.get("causality") == "output"]
    unknowns = list(root.iterfind("ModelStructure/InitialUnknowns/Unknown"))
    assert [int(unknown.get("index", "0")) for unknown in unknowns] == outputs
    told = {unknown.get("dependencies") for unknown in unknowns}
    numbers = {v.get("name"): str(n) for n, v in enumerate(variables, 1)}
    assert told == {None if known is None else " ".join(numbers[name] for name in known)}


def test_every_real_has_a_type_a_nominal_and_limits_that_hold_the_start() -> None:
    description = read_model_description(str(live.fmu_file(10)))
    types = {kind.name: kind for kind in description.typeDefinitions}
    for v in description.modelVariables:
        if v.type != "Real":
            continue
        assert v.declaredType is not None, v.name
        assert types[v.declaredType.name].unit == v.unit
        assert float(v.nominal) > 0.0
        if v.name != "kappa":
            assert v.min is not None, v.name
        for limit, sign in ((v.min, 1.0), (v.max, -1.0)):
            start = float(v.start) if v.start is not None else float("nan")
            assert limit is None or not sign * start < sign * float(limit), v.name
        assert v.description
    limits = {v.name: (v.min, v.max) for v in description.modelVariables}
    assert limits["flags"] == ("0", str(2 * max(TurnFlag) - 1))
    assert [float(x) for x in limits["sample_rate"]] == list(RATES)


@KINDS
def test_it_brings_icon_page_licences_and_default_experiment(python: bool) -> None:
    with zipfile.ZipFile(live.fmu_file(10, python=python)) as archive:
        names = set(archive.namelist())
        assert archive.read("model.png")[:8] == b"\x89PNG\r\n\x1a\n"
        page = archive.read("documentation/index.html").decode()
        licenses = [
            archive.read(f"documentation/licenses/{n}.txt").decode()
            for n in ("license", *(["pythonfmu"] if python else []))
        ]
        description = Xml.fromstring(archive.read("modelDescription.xml"))
    assert {"resources/settings.json", "resources/calibration.toml"} <= names
    for text in (
        "<svg",
        "Accuracy",
        "cross-validated",
        "12.3 N",
        "Limits",
        "alpha_std",
        "live tire",
        "Calibrated range",
        description.get("version"),
    ):
        assert text in page, text
    assert "{version}" not in page
    Xml.fromstring(page.split("\n", 1)[1].replace('<meta charset="utf-8">', ""))
    assert all("MIT License" in text or "Permission is hereby granted" in text for text in licenses)
    assert description.get("description")
    assert description.get("license") == "MIT"
    experiment = description.find("DefaultExperiment")
    assert experiment is not None
    assert float(experiment.get("stepSize", "0")) == 10 / live.RATE


def test_a_fmu_loaded_in_this_process_does_not_disturb_its_own_rebuild(tmp_path: Path) -> None:
    with LoadedFmu(live.fmu_file(10, python=True)) as fmu:
        fmu.start(live.RATE)
        twin = build_fmu(
            live.calibration_file(),
            tmp_path / "twin.fmu",
            samples_per_step=10,
            sample_rate=live.RATE,
            python=True,
        )
        assert twin.read_bytes() == live.fmu_file(10, python=True).read_bytes()
        fmu.step(np.zeros((5, 10)), CONDITIONS)


def test_a_place_that_cannot_be_written_is_told_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done: list[str] = []
    for place in (tmp_path / "file" / "x.fmu", tmp_path):
        with pytest.raises(FormatError, match="cannot be written"):
            build_fmu(live.calibration_file(), place, progress=done.append)
    with pytest.raises(FormatError, match=r"x\.txt: ends in '\.txt'; allowed is \.fmu"):
        build_fmu(live.calibration_file(), tmp_path / "x.txt", progress=done.append)
    assert done == []


def test_same_calibration_same_bytes(tmp_path: Path) -> None:
    twin = build_fmu(
        live.calibration_file(), tmp_path / "twin.fmu", samples_per_step=10, sample_rate=live.RATE
    )
    assert twin.read_bytes() == live.fmu_file(10).read_bytes()
    assert live.fmu_file(1).read_bytes() != twin.read_bytes()
    with zipfile.ZipFile(twin) as archive:
        first, *others = archive.namelist()
    assert first == "modelDescription.xml"  # where importers look for it
    assert others == sorted(others)


def test_the_build_leaves_no_trace_in_the_process(tmp_path: Path) -> None:
    path, modules = list(sys.path), set(sys.modules)
    build_fmu(live.calibration_file(), tmp_path / "x.fmu", samples_per_step=3, python=True)
    assert sys.path == path
    assert not [n for n in set(sys.modules) - modules if n.startswith(("tirelib", "strain_tire"))]


def test_the_embedded_calibration_is_the_one_given() -> None:
    assert embedded_calibration(live.fmu_file(1)).lateral == live.calibration().lateral


def test_the_bundle_is_named_by_its_content_and_holds_the_core_only() -> None:
    sources = collect(source_file("strain_tire.py"))
    assert "measured/signal/turns.py" in sources
    assert "stream/estimator.py" in sources
    for absent in (
        "measured/features/table.py",
        "measured/observations.py",
        "estimators/fit.py",
        "cli/fmu.py",
    ):
        assert absent not in sources
    changed = {**sources, "core/flags.py": sources["core/flags.py"] + "\n"}
    assert content_hash(changed) != content_hash(sources)
    with zipfile.ZipFile(live.fmu_file(10, python=True)) as archive:
        names = archive.namelist()
    assert not any(name.startswith("resources/tirelib/") for name in names)


def test_a_module_that_needs_more_than_numpy_and_scipy_is_refused(tmp_path: Path) -> None:
    slave = tmp_path / "slave.py"
    slave.write_text("import pandas\n")
    with pytest.raises(
        FormatError, match=r"slave\.py: imports pandas; an FMU may import numpy and scipy"
    ):
        collect(slave)


def test_only_imports_of_the_library_are_renamed() -> None:
    source = "from tirelib.core import x\nimport tirelib.core.axes\nname = 'tirelib.core.axes'\n"
    assert renamed(source, "t_1") == (
        "from t_1.core import x\nimport t_1.core.axes\nname = 'tirelib.core.axes'\n"
    )


_ALONE = """
import json, sys
from importlib.abc import MetaPathFinder

class Blocked(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {blocked!r}:
            raise ModuleNotFoundError(name + " is blocked")

sys.meta_path.insert(0, Blocked())
sys.path.insert(0, {resources!r})
from importlib import import_module
module = import_module(open({resources!r} + "/slavemodule.txt").read())
slave = module.StrainTire(instance_name="alone", resources={resources!r})
slave.exit_initialization_mode()
for step in range(5):
    slave.set_real([slave.reference[f'strain_1_{{g}}'] for g in range(1, 6)], [1e-3] * 5)
    done = slave.do_step(step * 2e-3, 2e-3)
print(json.dumps([done, sorted({{name.split(".")[0] for name in sys.modules}})]))
"""


def test_it_runs_without_the_repository_and_with_numpy_and_scipy_only(tmp_path: Path) -> None:
    folder = extract(str(live.fmu_file(10, python=True)), unzipdir=str(tmp_path))
    resources = str(Path(folder) / "resources")
    blocked = [
        "tirelib",
        "pandas",
        "sklearn",
        "statsmodels",
        "asammdf",
        "matplotlib",
        "click",
        "rich",
        "tomli_w",
        "fmpy",
        "pyarrow",
    ]
    script = _ALONE.format(blocked=blocked, resources=resources)
    told = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd="/", check=False
    )
    assert told.returncode == 0, told.stderr
    done, modules = json.loads(told.stdout)
    assert done
    assert not set(blocked) & set(modules)
    assert "numpy" in modules


@pytest.mark.parametrize("samples", [0, 257])
def test_a_frame_length_out_of_range_is_refused(tmp_path: Path, samples: int) -> None:
    with pytest.raises(ParameterError, match="samples per step"):
        build_fmu(live.calibration_file(), tmp_path / "x.fmu", samples_per_step=samples)


def test_bad_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="cannot be read"):
        build_fmu(tmp_path / "none.toml", tmp_path / "x.fmu")
    (tmp_path / "no.fmu").write_text("nothing")
    with pytest.raises(FormatError, match="is not an FMU made by"):
        embedded_calibration(tmp_path / "no.fmu")
    with zipfile.ZipFile(tmp_path / "virtual.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", "<a/>")
    with pytest.raises(FormatError, match="because it holds no calibration; a strain tire"):
        embedded_calibration(tmp_path / "virtual.fmu")
    table = live.folder() / "cal.table"
    table.write_bytes(core_file(live.calibration()))
    with pytest.raises(FormatError, match="not the table of `tirelib fmu table`"):
        build_fmu(table, tmp_path / "x.fmu")
