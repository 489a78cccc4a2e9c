"""How much one tire shows over what its family shows.

A tire that is near its model leaves little of everything, and one that is far from it leaves more
of everything: what tires of a family show has a size of its own for each tire, with a log-normal
prior. Sizes are learned with the table of plain tires, and chosen for a user's tire.
"""

from collections.abc import Container, Iterable
from typing import NamedTuple

import numpy as np

SIZES = 2.0 ** np.arange(-2, 2)
"""Sizes of what one tire shows over what its family shows, among which its likelihood chooses. A
tire that leaves little shows a weak effect; one that leaves far more than its family has something
unknown, so that twice as much is the most that is excused."""
APART = (0.5, 1.0, 2.0)
"""How many times as large a tire's size may be beside the contact as in the contact. A tire that
leaves little in the contact may leave as much as others beside it, which is no fault."""
SIZE_STD = 1.5
"""Standard deviation of the logarithm of this size. Half and double of it:
docs/theory/verdict_numbers.md."""
LARGEST = 2.0
"""Most by which one tire shows more of everything than its family."""

FREE, FAR = ", free belt", ", far belt"
"""Ends of the names of groups of shapes: beside the contact, and far away from it."""


class Size(NamedTuple):
    """How much one tire shows over what its family shows, in general and beside the contact."""

    whole: float
    free: float

    def of(self, block: str, gage: Container[str] = ()) -> float:
        """Return the size of a block: of an effect it is at most `LARGEST`.

        What a tire shows far away from the contact says nothing of what it shows elsewhere, and a
        tire that is near its model has gages and a rig like any other.
        """
        if "," not in block:
            return min(max(self.whole, 1.0) if block in gage else self.whole, LARGEST)
        if block.endswith(FAR):
            return max(self.whole, 1.0)
        return self.free if block.endswith(FREE) else self.whole

    @property
    def log_prior(self) -> float:
        """Log density, up to a constant."""
        return float(-0.125 * (np.log(self.whole * self.free) / SIZE_STD) ** 2)


def sizes(largest: float, blocks: Iterable[str]) -> list[Size]:
    """Return `SIZES`, and further ones up to the largest of a family's tires."""
    whole: list[float] = SIZES.tolist()
    while whole[-1] < largest:
        whole.append(2.0 * whole[-1])
    apart = APART if any(FREE in name for name in blocks) else (1.0,)
    each = [Size(size, size * share) for size in whole for share in apart]
    return [size for size in each if whole[0] <= size.free <= whole[-1]]
