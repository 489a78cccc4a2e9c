"""Up to which difference two headers may speak of one tire."""

import pytest

from tirelib.core.sizes import differing


@pytest.mark.parametrize(
    ("name", "share"),
    [("free_radius", 0.03), ("ring_radius", 0.01), ("belt_width", 0.1), ("innerliner_offset", 0.2)],
)
@pytest.mark.parametrize("size", [0.3, -0.003])
def test_a_dimension_differs_beyond_its_share_of_the_other_one(
    name: str, share: float, size: float
) -> None:
    for side in (-1.0, 1.0):
        within, beyond = ({name: size * (1.0 + side * k * share)} for k in (0.95, 1.05))
        assert list(differing(within, {name: size})) == []
        assert list(differing(beyond, {name: size})) == [(name, beyond[name], size)]
