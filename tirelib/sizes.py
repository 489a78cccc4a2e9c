"""Dimensions of a tire, and whether two sets of them may be of one tire."""

from collections.abc import Iterator, Mapping

SAME_SIZE = 0.01
"""Relative difference in a dimension up to which two headers may speak of one tire."""


def differing(
    one: Mapping[str, float], other: Mapping[str, float]
) -> Iterator[tuple[str, float, float]]:
    """Yield the dimensions in which two tires differ, with both values.

    Examples
    --------
    >>> list(differing({"free_radius": 0.3, "belt_width": 0.17}, {"free_radius": 0.33}))
    [('free_radius', 0.3, 0.33)]
    """
    for name in sorted(set(one) & set(other)):
        if abs(one[name] - other[name]) > SAME_SIZE * abs(other[name]):
            yield name, one[name], other[name]
