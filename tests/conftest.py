"""Shared by all tests: data outside the repository, one random seed per test."""

import gc
import os
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import nullcontext
from itertools import chain, groupby
from operator import itemgetter
from pathlib import Path

import pytest
from _pytest.doctest import DoctestModule
from hypothesis import HealthCheck, settings

from tests import once
from tests.schema_check import wrong_documents
from tirelib.core import forked

settings.register_profile(
    "same",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    max_examples=40,
    derandomize=True,
    database=None,
)
settings.register_profile("new", settings.get_profile("same"), derandomize=False)
settings.load_profile(os.environ.get("TIRELIB_EXAMPLES", "same"))
ROOT = Path(__file__).parents[1]
PROCESSORS = forked._processors
YOUNG = 20_000
"""New objects after which a process looks for garbage: tests leave little, and soon end."""
WAITS, LAST = {"bench", "fleet"}, 0.7
"""Folders whose tests wait, and the share of all other files among which they are spread."""
os.environ["PYTHONPATH"] = os.pathsep.join(  # what tests start imports this checkout as well
    [str(ROOT), str(ROOT / "bench"), *filter(None, [os.environ.get("PYTHONPATH")])]
)
# Programs that tests start, Dask's workers among them, would compile every module each time.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_configure(config: pytest.Config) -> None:
    """Give the processes of a run a folder in common."""
    once.share_a_folder(config.add_cleanup)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Keep modules and tests, half a million objects that stay, out of the search for garbage.

    A copy of this process (fork) would copy their memory, too, as soon as it searched them. The
    first process of a run compiles all modules, half of the work, and the others wait to read them.
    """
    several = hasattr(session.config, "workerinput")
    gc.disable()
    try:
        with once.first_alone("collection") if several else nullcontext():
            return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(YOUNG)
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Spread the files whose tests wait among those that compute, and end with none of them.

    Side by side, processes that wait for a line, a cluster or a browser leave processors idle.
    """
    files = [list(tests) for _, tests in groupby(items, key=lambda item: item.path)]
    waits = [tests for tests in files if WAITS & {*tests[0].path.parts}]
    others = [tests for tests in files if not WAITS & {*tests[0].path.parts}]
    places = [(LAST * k / len(waits), tests) for k, tests in enumerate(waits)]
    places += [(k / len(others), tests) for k, tests in enumerate(others)]
    items[:] = chain.from_iterable(tests for _, tests in sorted(places, key=itemgetter(0)))


@pytest.hookimpl(wrapper=True)
def pytest_collect_file() -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
    """Look for examples in the library and the bench only: the docstrings of tests have none."""
    return [found for found in (yield) if not isinstance(found, DoctestModule)]


@pytest.fixture(scope="session", autouse=True)
def documents_are_as_their_schemas_say(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Check every JSON document that the tests of this process left in their folders."""
    yield
    folders = (tmp_path_factory.getbasetemp(), *once.MADE)
    wrong = [document for folder in folders for document in wrong_documents(folder)]
    assert not wrong, "\n".join(wrong)


@pytest.fixture(scope="session", autouse=True)
def one_process() -> Iterator[None]:
    """Let tests not copy their process: a copy costs more than small problems do.

    It forgets in the end what it has kept for the next call, and its memory is copied page by page
    while the other processes of the run have the processors. Modules with `copies` compute in them.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(forked, "_processors", lambda: 1)
        yield


@pytest.fixture(scope="module")
def copies() -> Iterator[None]:
    """Let the tests of a module compute in copies of their process, as users do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(forked, "_processors", PROCESSORS)
        yield


@pytest.fixture(scope="module")
def rough_figures() -> Iterator[None]:
    """Let figures of a module be drawn without a search for the places of their axes.

    It takes half of the time; tests/unit/report looks at places.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("matplotlib.figure.Figure.set_layout_engine", lambda *_, **__: None)
        yield


NOT_HERE = (
    "no {0}: these measurements are not part of the repository, so the tests on them are checks "
    "beside the others, which need nothing; TIRELIB_SHARED_DATA names the folder that holds them"
)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Measurement campaigns beside the repository, where there are any."""
    folder = Path(os.environ.get("TIRELIB_SHARED_DATA", Path(__file__).parents[2] / "shared/data"))
    if not folder.is_dir():
        pytest.skip(NOT_HERE.format(folder))
    return folder


@pytest.fixture(scope="session")
def shared(shared_data: Path) -> Callable[[str], Path]:
    """Give one of them by its name; skip without it."""

    def one(name: str) -> Path:
        if not (shared_data / name).exists():
            pytest.skip(NOT_HERE.format(shared_data / name))
        return shared_data / name

    return one
