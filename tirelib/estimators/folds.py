"""Which rows are held out together."""

from collections.abc import Iterator

import numpy as np

from tirelib.core.arrays import BoolArray, IntArray


def held_out_folds(groups: IntArray, most: int | None = None) -> Iterator[BoolArray]:
    """Yield the rows of each fold: the rows of a group are held out together.

    Parameters
    ----------
    groups : array of int, shape (n,)
    most : int, optional
        Largest number of folds. More groups than that share folds: the largest group goes first,
        each into the fold that has the fewest rows so far.

    Yields
    ------
    array of bool, shape (n,)

    Examples
    --------
    >>> [rows.nonzero()[0].tolist() for rows in held_out_folds(np.array([5, 5, 3, 8]), most=2)]
    [[0, 1], [2, 3]]
    """
    names, group, size = np.unique(groups, return_inverse=True, return_counts=True)
    if most is None or names.size <= most:
        for number in range(names.size):
            yield np.asarray(group == number)
        return
    fold = np.empty(names.size, dtype=np.int64)
    rows = np.zeros(most, dtype=np.int64)
    for number in np.argsort(size)[::-1]:
        fold[number] = np.argmin(rows)
        rows[fold[number]] += size[number]
    for number in range(most):
        yield np.asarray(fold[group] == number)
