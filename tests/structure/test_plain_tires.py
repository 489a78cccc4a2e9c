"""The stored table of plain tires, and how each family fares by what the two others show."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from tirelib.inference.diagnose.diagnose import TABLE, plain_tires

GOLDEN = Path(__file__).parents[1] / "golden" / "plain_tires.json"
STORED = json.loads(GOLDEN.read_text())


def test_the_p_values_are_those_of_the_table_that_is_shipped() -> None:
    assert STORED["sha256"] == hashlib.sha256(TABLE.read_bytes()).hexdigest()
    assert {family.name for family in plain_tires()} == set(STORED["families"])
    assert all(len(family) >= 40 for family in plain_tires())


@pytest.mark.parametrize("level", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("name", ["rig", "continuum", "ring"])
def test_plain_tires_of_a_family_left_out_are_rejected_no_more_often_than_the_level(
    name: str, level: float
) -> None:
    p = np.array(list(STORED["families"][name].values()))
    # two standard deviations of a binomial
    assert np.mean(p <= level) <= level + 2.0 * np.sqrt(level * (1.0 - level) / p.size)
