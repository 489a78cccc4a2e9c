"""Dimensions of a tire, and whether two sets of them may be of one tire."""

from collections.abc import Iterator, Mapping

SAME_SIZE = {"free_radius": 0.03, "ring_radius": 0.01, "belt_width": 0.1, "innerliner_offset": 0.2}
"""Relative difference in a dimension up to which two headers may speak of one tire. The belt's
radius is known to a millimetre or two (1 %: 3 mm); the free radius also loses the tread, 6 mm of
some 315 (2 %). A belt's width and the innerliner's depth (a few millimetres) are read off a cut by
hand, to some 10 mm of 165 and half a millimetre of 3. The tread's thickness is none of them: it
wears. Half of these refuses a tire with 5 mm of tread gone and widths of 165 and 175 mm; double
takes 205/55R16 (free radius 316 mm) for 215/60R16 (332 mm)."""


def differing(
    one: Mapping[str, float], other: Mapping[str, float]
) -> Iterator[tuple[str, float, float]]:
    """Yield the dimensions in which two tires differ, with both values.

    Examples
    --------
    >>> list(differing({"free_radius": 0.3, "belt_width": 0.17}, {"free_radius": 0.33}))
    [('free_radius', 0.3, 0.33)]
    >>> list(differing({"tread_thickness": 0.004}, {"tread_thickness": 0.008}))
    []
    """
    for name in sorted(set(one) & set(other) & set(SAME_SIZE)):
        if abs(one[name] - other[name]) > SAME_SIZE[name] * abs(other[name]):
            yield name, one[name], other[name]
