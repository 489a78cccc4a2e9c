"""Normal equations of a fit, by the size of the misfit that each run has for itself."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.normal import Normal, blocks_of
from tirelib.inference.statistics.problem import Whitening


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Normal equations of a tire's plan at one size of the misfit that each run has for itself.

    Attributes
    ----------
    own : float
    normal : Normal
    log_volume : float
        Logarithm of the whitening's determinant: likelihoods at several sizes compare with it.
    white : shape (m, n)
        Whitened rows; empty where only the normal equations are kept.
    """

    own: float
    normal: Normal
    log_volume: float
    white: FloatArray


class Views(Sequence[View]):
    """Normal equations for several sizes of the misfit, each made once, when it is asked for.

    Parameters
    ----------
    rows : mapping of name to shape (k, ...)
    rest : shape (...)
        The residual.
    whitener : callable
        Gives the whitening for a size, `Problem.whitener`.
    sizes : sequence of float
    """

    def __init__(
        self,
        rows: Mapping[str, FloatArray],
        rest: FloatArray,
        whitener: Callable[[float], Whitening],
        sizes: Sequence[float],
    ) -> None:
        self._blocks, self._rows, self._rest = blocks_of(rows), rows, rest
        self._whitener, self._sizes = whitener, sizes
        self._made: dict[float, View] = {}

    @cached_property
    def _reduced(self) -> FloatArray:
        """The rows and the residual as no size of the misfit changes them."""
        every = np.concatenate([*self._rows.values(), self._rest[None]])
        return self._whitener(self._sizes[0]).reduced(every)

    def __len__(self) -> int:
        return len(self._sizes)

    @overload
    def __getitem__(self, place: int) -> View: ...

    @overload
    def __getitem__(self, place: slice) -> Sequence[View]: ...

    def __getitem__(self, place: int | slice) -> View | Sequence[View]:
        if isinstance(place, slice):
            return [self[k] for k in range(*place.indices(len(self)))]
        own = self._sizes[place]
        if own not in self._made:
            whitening = self._whitener(own)
            white = whitening.white(self._reduced)
            normal = Normal.stacked(self._blocks, white[:-1], white[-1])
            self._made[own] = View(own, normal, whitening.log_volume, white[:-1])
        return self._made[own]
