"""Numbers and containers as JSON knows them."""

import json
from pathlib import Path

import numpy as np
import pytest

from tirelib.core.documents import plain, write_json
from tirelib.core.version import __version__


@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf, float("inf"), np.float32("inf")])
def test_a_number_that_json_has_not_is_null(unknown: float, tmp_path: Path) -> None:
    document = {"one": unknown, "list": [1.5, unknown], "array": np.array([[unknown, 2.0]])}
    write_json(tmp_path / "d.json", document)
    read = json.loads((tmp_path / "d.json").read_text())
    assert read == {
        "tirelib": __version__,
        "one": None,
        "list": [1.5, None],
        "array": [[None, 2.0]],
    }


def test_numbers_of_arrays_become_those_of_python() -> None:
    told = plain({3: (np.int64(2), np.bool_(True), np.float64(0.5), "text", None)})
    assert told == {"3": [2, True, 0.5, "text", None]}
    assert [type(each) for each in told["3"][:3]] == [int, bool, float]
