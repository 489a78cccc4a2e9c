"""Ranges together say what each says alone."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tirelib.estimators.polynomial import Range, all_inside

NUMBERS = st.floats(-10.0, 10.0)
RANGES = st.builds(
    lambda low, width, slack, needed: Range("x", low, low + width, slack, needed),
    NUMBERS,
    st.floats(0.0, 5.0),
    st.floats(0.0, 2.0),
    st.booleans(),
)


@given(ranges=st.lists(RANGES, min_size=1, max_size=4), data=st.data())
def test_a_row_is_inside_where_each_range_has_it(ranges: list[Range], data: st.DataObject) -> None:
    values = st.lists(st.one_of(NUMBERS, st.just(np.nan)), min_size=3, max_size=3)
    columns = [np.array(data.draw(values)) for _ in ranges]

    def has(known: Range, x: float) -> bool:
        if np.isnan(x):
            return not known.needed
        return bool(known.low - known.slack <= x <= known.high + known.slack)

    expected = [
        all(has(known, float(column[row])) for known, column in zip(ranges, columns, strict=True))
        for row in range(3)
    ]
    assert all_inside(tuple(ranges), columns).tolist() == expected
