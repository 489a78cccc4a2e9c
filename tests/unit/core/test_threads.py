"""The array libraries have one thread wherever this project computes, and theirs elsewhere."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

from tests.fmu import live, virtual_host
from tirelib.campaign import read_campaign
from tirelib.core.threads import VARIABLES, one_thread
from tirelib.estimators.chain import Chain
from tirelib.estimators.train import train
from tirelib.inference.compare.forces import compare_forces
from tirelib.inference.compare.strain import compare_strain
from tirelib.inference.diagnose.diagnose import diagnose
from tirelib.inference.diagnose.forces.diagnose import diagnose_force
from tirelib.inference.extend.extension import extended, without_effect
from tirelib.inference.identify.forces import identify_forces
from tirelib.inference.identify.identify import identify
from tirelib.inference.identify.whole import identify_whole
from tirelib.inference.planning.next_test import next_test
from tirelib.inference.planning.selftest import selftest
from tirelib.measured.observations import observe
from tirelib.report.simulation import simulate
from tirelib.rig.solve import solve

ROOT = Path(__file__).parents[3]
assert scipy.linalg  # its library is loaded


def pools() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info()}


@pytest.fixture(autouse=True)
def two_threads() -> Iterator[None]:
    """Let the user's program have two, whatever the machine and the environment say."""
    with threadpool_limits(2):
        assert 2 in pools()
        yield


class AskedError(Exception):
    """Says what the pools had when something was asked."""


def test_threads_are_bound_inside_and_as_before_afterwards() -> None:
    before = pools()
    with one_thread():
        assert pools() == {1}
        with one_thread():
            assert pools() == {1}
        assert pools() == {1}
    assert pools() == before


@one_thread()
def broken() -> None:
    raise AskedError(pools())


def test_threads_are_as_before_after_an_error() -> None:
    before = pools()
    with pytest.raises(AskedError, match=r"^\{1\}$"):
        broken()
    assert pools() == before


class Asked:
    """Stands in for any argument: the first question to it ends the call."""

    def __getattr__(self, name: str) -> Any:
        raise AskedError(pools())

    __iter__ = __len__ = __getitem__ = __float__ = __bool__ = lambda self, *_: self.any


@pytest.mark.parametrize(
    ("function", "count", "named"),
    [
        (identify, 1, ()),
        (identify_whole, 1, ()),
        (identify_forces, 1, ()),
        (compare_forces, 2, ()),
        (compare_strain, 2, ()),
        (diagnose, 3, ()),
        (diagnose_force, 2, ()),
        (extended, 3, ()),
        (without_effect, 2, ()),
        (next_test, 3, ()),
        (selftest, 3, ()),
        (train, 1, ()),
        (simulate, 1, ("load",)),
        (solve, 2, ()),
    ],
)
def test_heavy_work_of_the_library_has_one_thread(
    function: Callable[..., Any], count: int, named: tuple[str, ...]
) -> None:
    before = pools()
    with pytest.raises(AskedError, match=r"^\{1\}$"):
        function(*[Asked()] * count, **dict.fromkeys(named, Asked()))
    assert pools() == before


def test_an_estimate_has_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    features = observe([read_campaign(live.campaign_folder())]).features
    monkeypatch.setattr(Chain, "predict", lambda *_: Asked().any)
    with pytest.raises(AskedError, match=r"^\{1\}$"):  # the compiled core has one anyway
        live.calibration().reference_estimate(features)


def test_a_virtual_tire_in_an_importer_has_one_thread_and_leaves_the_importer_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    host = virtual_host.Host(virtual_host.file(10, python=True))
    seen = []
    inside = ".fmu.virtual.surface"
    name = next(n for n in sys.modules if n.endswith(inside) and n != f"tirelib{inside}")
    surface = sys.modules[name]
    asked = surface.RBFInterpolator.__call__

    def spy(self: Any, places: Any) -> Any:
        seen.append((len(places), pools()))
        return asked(self, places)

    monkeypatch.setattr(surface.RBFInterpolator, "__call__", spy)
    host.start()
    host.put(alpha=0.05)
    host.step()
    host.step()
    assert [had for n, had in seen if n > 1][:1] == [{1}]
    assert 2 in pools()
    host.close()


TELL = """
import atexit, json, sys
def tell():
    import scipy.linalg, threadpoolctl
    print(json.dumps([pool["num_threads"] for pool in threadpoolctl.threadpool_info()]))
atexit.register(tell)
sys.argv = ["x", "--version"]
"""


@pytest.mark.parametrize(
    "start",
    [
        "from tirelib.cli import main; main()",
        "from tirebench.cli import main; main()",
        "import runpy; runpy.run_module('tirebench', run_name='__main__')",
    ],
)
def test_a_program_has_one_thread_whatever_the_environment_says(start: str) -> None:
    others = {name: text for name, text in os.environ.items() if name not in VARIABLES}
    done = subprocess.run(
        [sys.executable, "-c", TELL + start],
        env=others | {"OPENBLAS_NUM_THREADS": "2"},
        check=True,
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert set(json.loads(done.stdout.splitlines()[-1])) == {1}


def test_every_build_program_has_one_thread() -> None:
    programs = [
        path
        for path in (ROOT / "build").rglob("*.py")
        if "out" not in path.parts and "__main__" in path.read_text()
    ]
    assert len(programs) > 20
    bound = {path.name for path in programs if "with one_thread():" in path.read_text()}
    # these start other programs and use no arrays
    programs_of_others = {
        "native_fmu.py",
        "package.py",
        "measure_again.py",
        "release.py",
        "studio.py",
        "studio_speed.py",
    }
    assert {path.name for path in programs} - bound == programs_of_others
