"""A record is read alike whenever it begins, and records of their own are each other's sequel."""

from dataclasses import fields

import numpy as np
import pytest

from tests.synthetic import LATERAL, RATE, record
from tirelib.measured.features import Features, RecordReader, features_of_record

SHIFTED = {"time", "ready"}


@pytest.fixture(params=["compiled", "numpy"])
def reader(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> RecordReader:
    if request.param == "numpy":
        monkeypatch.setattr("tirelib.measured.features.records.loaded_core", lambda: None)
    return RecordReader(LATERAL)


def test_a_record_that_begins_later_has_its_turns_later(reader: RecordReader) -> None:
    """And nothing of the record before is left over in it."""
    strain, trigger, _ = record(noise=4e-6)
    for start in (0.0, 250.0):
        time, _ = reader.add(strain, RATE, trigger=trigger, start=start)
        assert (time > start).all()
    both = reader.features()
    first = len(both) // 2
    assert len(both) == 2 * first
    for field in fields(Features):
        if field.name == "lateral":
            continue
        values = getattr(both, field.name)
        later = values[first:] - values[:first] if field.name in SHIFTED else values[first:]
        expected = np.full(first, 250.0) if field.name in SHIFTED else values[:first]
        np.testing.assert_allclose(later, expected, rtol=1e-9, err_msg=field.name)


def test_a_reader_of_one_record_is_the_function_of_it(reader: RecordReader) -> None:
    strain, trigger, _ = record(noise=4e-6)
    reader.add(strain, RATE, trigger=trigger, pressure=2.3e5)
    alone = features_of_record(strain, RATE, LATERAL, trigger=trigger, pressure=2.3e5)
    found = reader.features()
    for name in ("time", "ready", "omega", "lead", "trail", "pressure", "flags"):
        np.testing.assert_allclose(
            getattr(found, name), getattr(alone, name), rtol=1e-9, atol=1e-12
        )
