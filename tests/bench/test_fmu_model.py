"""An FMU file through FMPy: any number of samples a step, fresh starts, errors with a cause."""

import gc
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.bench.campaigns import tiny_runs
from tests.bench.in_process import InProcess
from tests.fmu import live
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.errors import FmuError
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.wire.conditions import Conditions, condition
from tirebench.wire.device import Device

STEADY = Conditions.constant(18.0, 2.3e5, 0.0)


def turns(path: Path, conditions: Conditions = STEADY) -> list[tuple[float, ...]]:
    script = write_script(tiny_runs(), Device(), Faults({}))
    with FmuFile(read_fmu(path)) as file, FmuModel(file) as model:
        chain = InProcess(lambda _: model, conditions)
        found = [*chain.push(b"".join(script.frames)), *chain.finish()]
    return [(turn.segment, turn.t, turn.ready, turn.outputs["Fz"]) for turn in found]


def test_the_samples_a_step_are_those_of_the_file(toy_fmus: dict[int, Path]) -> None:
    for samples, path in toy_fmus.items():
        with FmuFile(read_fmu(path)) as file, FmuModel(file) as model:
            assert model.samples == samples


def test_estimates_are_the_same_with_any_samples_a_step(toy_fmus: dict[int, Path]) -> None:
    first = turns(toy_fmus[16])
    assert len(first) >= 15
    for samples in (1, 10):
        np.testing.assert_allclose(turns(toy_fmus[samples]), first, rtol=1e-9)


def test_a_fresh_start_forgets(toy_fmus: dict[int, Path]) -> None:
    strain = np.tile(np.linspace(0.0, 0.01, 16)[:, None], (1, 5))
    with FmuFile(read_fmu(toy_fmus[16])) as file, FmuModel(file) as model:
        seen = []
        for _ in range(2):
            model.start(1e-4)
            steps = [model.step(strain, condition(18.0, 2.3e5, 0.0), True) for _ in range(3)]
            seen.append([None if out is None else (out[0]["turn"], out[0]["age"]) for out in steps])
    assert seen[0] == seen[1]
    assert seen[0][0] is not None


def test_an_error_of_the_fmu_names_its_cause(toy_fmus: dict[int, Path]) -> None:
    with pytest.raises(
        FmuError, match=r"(?s)failed in a step .*speed is negative; it must be above"
    ):
        turns(toy_fmus[16], Conditions.constant(-1.0))


def test_after_a_fatal_error_the_process_lives(toy_fmus: dict[int, Path]) -> None:
    """FMI allows no call after `fatal`; a pythonfmu instance that is freed then breaks the heap."""
    for _ in range(5):
        with pytest.raises(FmuError):
            turns(toy_fmus[16], Conditions.constant(-1.0))
        gc.collect()


def test_the_unpacked_files_are_removed(toy_fmus: dict[int, Path]) -> None:
    file = FmuFile(read_fmu(toy_fmus[16]))
    folder = Path(file.folder)
    assert folder.is_dir()
    copy = pickle.loads(pickle.dumps(file))  # as another process gets it, which must leave them
    copy.close()
    assert folder.is_dir()
    file.close()
    file.close()
    assert not folder.exists()


def edited(source: Path, path: Path, old: str, new: str) -> Path:
    """Return a copy of an FMU with another description."""
    with zipfile.ZipFile(source) as old_file, zipfile.ZipFile(path, "w") as new_file:
        for name in old_file.namelist():
            content = old_file.read(name)
            if name == "modelDescription.xml":
                content = content.replace(old.encode(), new.encode())
            new_file.writestr(name, content)
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name="strain_3_2"', 'name="other"', r"strain_3_2 are missing; .* StrainTire.fmu"),
        ('name="age"', 'name="old"', r"age are missing"),
        ("<fmiModelDescription", "<fmiModel", r"cannot be loaded"),
        ('modelIdentifier="', 'modelIdentifier="x', r"cannot be loaded"),
    ],
)
def test_another_fmu_is_refused(
    toy_fmus: dict[int, Path], tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = edited(toy_fmus[16], tmp_path / "x.fmu", old, new)
    with pytest.raises(FmuError, match=message), FmuFile(read_fmu(path)) as file:
        FmuModel(file)


def test_each_wheel_hears_its_own_fmu_also_when_another_is_gone() -> None:
    def complains(wheel: FmuModel) -> None:
        with pytest.raises(FMICallException):
            wheel._slave.doStep(0.0, 1.5 / live.RATE)

    with FmuFile(read_fmu(live.fmu_file(10))) as file, FmuModel(file) as first:
        with FmuModel(file) as second:
            complains(first)
            assert (len(first.take_messages()), second.take_messages()) == (1, [])
        del second
        gc.collect()
        first.start(1.0 / live.RATE)
        complains(first)
        assert "a whole number of samples is needed" in first.take_messages()[-1]
