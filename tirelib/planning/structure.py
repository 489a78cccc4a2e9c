"""What a ring's structure may do to waveforms, as unknowns with a prior.

The variants of a diagnosis (`tirelib.diagnose.ensemble`) are measured at the present runs and at
the possible ones alike, without noise and set-point errors. What the base model leaves of each is
one way in which structure may show; M of them, each with a prior of size / sqrt(M), have the
covariance in whose metric a diagnosis ranks effects. One draw holds for all runs, so what the
present runs tell of a tire's structure is known at the possible ones too.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.campaign import Tolerance
from tirelib.diagnose.ensemble import structural_ensemble
from tirelib.diagnose.refit import Refit
from tirelib.identify.identify import FITTED
from tirelib.identify.random_effects import Whitening
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import large_displacements, linearised
from tirelib.model.state import Operating
from tirelib.waveforms import GRID

MEMBERS = 60
"""Variants; more of them change a separation by a few percent."""


@dataclass(frozen=True, slots=True)
class Shapes:
    """Ways in which structure may show.

    Attributes
    ----------
    present : shape (n_members, n_runs, n_phi)
        In the present runs.
    ahead : shape (n_members, n_points, n_phi)
        In the possible ones.
    """

    present: FloatArray
    ahead: FloatArray

    def sizes(self, size: float) -> FloatArray:
        """Return the prior standard deviations of the unknowns."""
        return np.full(len(self.present), size / np.sqrt(max(len(self.present), 1)))


def structure_shapes(
    data: Data,
    base: Refit,
    points: Operating | None = None,
    *,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Shapes:
    """Return what variants of a model leave to it, at the present runs and at possible ones.

    Parameters
    ----------
    data : Data
        The present runs.
    base : Refit
    points : Operating, optional
        Possible runs, at which the base model has a solution.
    members, seed : int
        Of the variants.
    progress : callable, optional

    Raises
    ------
    TirelibError
        If the base model has no solution at a point.
    """
    n = len(data.points)
    every = data.points if points is None else joined(data.points, points)
    empty = np.zeros((len(every), GRID.size))
    quiet = replace(
        data, strain=empty, points=every, tolerance=Tolerance(0.0, 0.0, 0.0, 0.0),
        angle_std=np.zeros(len(every)), deflection=np.full(len(every), np.nan),
    )  # fmt: skip
    rows = structural_ensemble(
        quiet, _at(base, data, every), noise=0.0, members=members, seed=seed, progress=progress
    ).reshape(-1, *empty.shape)
    return Shapes(rows[:, :n], rows[:, n:])


def joined(one: Operating, other: Operating) -> Operating:
    """Return the points of both, one after the other."""
    names = [field.name for field in fields(Operating)]
    return Operating(*[np.concatenate([getattr(one, k), getattr(other, k)]) for k in names])


def _at(base: Refit, data: Data, points: Operating) -> Refit:
    """Return a fitted model at other points, with residuals left as they are."""
    correction = large_displacements(base.values, points, low_pass=data.low_pass)
    found = linearised(
        base.values, points, FITTED, base.changes, low_pass=data.low_pass, correction=correction
    )
    none = Whitening(np.zeros((len(points), GRID.size, 4)), np.zeros((len(points), 4, 4)), 1.0)
    return replace(
        base, waveform=found.waveform, deflection=found.deflection, slopes=found.waveform_slopes,
        correction=correction, whiten=none,
    )  # fmt: skip
