"""The stored ensemble: the same numbers, made once, and never a fault."""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.diagnose.planted import runs
from tests.unit.identify.model_waves import TIRE
from tirelib.arrays import FloatArray
from tirelib.diagnose import stored
from tirelib.diagnose.refit import Refit, refit
from tirelib.diagnose.stored import cache_folder, ensemble_of
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import values_of


@pytest.fixture(scope="module")
def fitted() -> tuple[Data, Refit]:
    data = runs().data(with_deflection=False)
    return data, refit(data, values_of(TIRE))


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that grows with every ensemble that is made."""
    made: list[int] = []

    def make(data: Data, model: Refit, *, members: int, seed: int, **_: object) -> FloatArray:
        made.append(seed)
        return np.full((members, data.strain.size), 0.1 + seed)

    monkeypatch.setattr(stored, "variants", make)
    return made


def test_a_second_call_reads_the_same_numbers(
    fitted: tuple[Data, Refit], calls: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TIRELIB_CACHE", str(tmp_path))
    first = ensemble_of(*fitted, noise=1e-6, members=4)
    second = ensemble_of(*fitted, noise=1e-6, members=4)
    louder = ensemble_of(*fitted, noise=2e-6, members=4)
    assert calls == [0]
    assert np.array_equal(first.rests, second.rests)
    assert np.array_equal(first.rests, louder.rests)
    assert (first.noise, louder.noise) == (1e-6, 2e-6)
    # whatever it depends on makes another
    ensemble_of(*fitted, noise=1e-6, members=4, seed=1)
    data, model = fitted
    stiffer = Refit(
        **{name: getattr(model, name) for name in model.__slots__}
        | {"values": dict(model.values) | {"bending_stiffness": 2.5}}
    )
    ensemble_of(data, stiffer, noise=1e-6, members=4)
    assert len(calls) == 3


def test_a_spoiled_file_is_made_again(
    fitted: tuple[Data, Refit], calls: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TIRELIB_CACHE", str(tmp_path))
    first = ensemble_of(*fitted, noise=1e-6, members=4)
    (file,) = tmp_path.glob("*.npy")
    file.write_bytes(b"spoiled")
    assert np.array_equal(ensemble_of(*fitted, noise=1e-6, members=4).rests, first.rests)
    assert len(calls) == 2


def test_it_can_be_switched_off_and_no_folder_is_no_fault(
    fitted: tuple[Data, Refit], calls: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TIRELIB_CACHE", "off")
    assert cache_folder() is None
    ensemble_of(*fitted, noise=1e-6, members=4)
    taken = tmp_path / "file"
    taken.write_text("no folder")
    monkeypatch.setenv("TIRELIB_CACHE", str(taken))
    ensemble_of(*fitted, noise=1e-6, members=4)
    assert len(calls) == 2
