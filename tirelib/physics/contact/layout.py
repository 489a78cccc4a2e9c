"""Strips across the tire's width, the forces on them, and what their contact shows."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.ring.lateral import LateralDeflection
from tirelib.physics.ring.ring import ComplexArray

GAGES = (-0.06, -0.03, 0.0, 0.03, 0.06)
"""Lateral positions of the strips if none are given, [m], left positive."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How the tire is cut into strips; all arrays have shape (n_strips,).

    Attributes
    ----------
    lateral : [m]
        Strip and gage positions, left positive.
    width_share, sidewall_share : [-]
        Shares of belt and tread, and of the sidewalls; each adds up to one.
    """

    lateral: FloatArray
    width_share: FloatArray
    sidewall_share: FloatArray

    def __post_init__(self) -> None:
        n = self.lateral.shape
        for name in ("width_share", "sidewall_share"):
            share = getattr(self, name)
            if share.shape != n or not (share > 0).all() or abs(share.sum() - 1.0) > 1e-9:
                raise ParameterError(
                    f"strips: {name} = {share} for {n[0]} strips; positive numbers that add up "
                    "to 1 are needed, one a strip"
                )
        if not np.isfinite(self.lateral).all() or (np.diff(self.lateral) <= 0).any():
            raise ParameterError(
                f"strips: lateral = {self.lateral} m; finite positions that grow to the left "
                "(ISO 8855) are needed"
            )

    @classmethod
    def even(cls, lateral: tuple[float, ...] = GAGES) -> "Layout":
        """Return strips with equal shares."""
        share = np.full(len(lateral), 1.0 / len(lateral))
        return cls(np.array(lateral, dtype=float), share, share)

    def __len__(self) -> int:
        return int(self.lateral.size)

    @property
    def arm(self) -> FloatArray:
        """Lateral position over the sum of squares: a unit roll moment as loads, [1/m]."""
        square = float(self.lateral @ self.lateral)
        return self.lateral / square if square > 0.0 else np.zeros_like(self.lateral)


@dataclass(frozen=True, slots=True)
class RoadForces:
    """Forces in the road's plane, road on tire, ISO 8855.

    Attributes
    ----------
    longitudinal, lateral : shape (n_points,), [N]
        Fx (drive positive), Fy (left positive), whole tire.
    longitudinal_shape, lateral_shape : shape (n_x,) or (n_points, n_x), optional
        Distribution over the patch on an even grid from its leading to its trailing edge, in any
        unit; None is the shape of the pressure.
    """

    longitudinal: FloatArray
    lateral: FloatArray
    longitudinal_shape: FloatArray | None = None
    lateral_shape: FloatArray | None = None

    def __post_init__(self) -> None:
        for name in ("longitudinal", "lateral"):
            if not np.isfinite(getattr(self, name)).all():
                raise ParameterError(f"strips: a {name} force is not a finite number; give it in N")
        for name in ("longitudinal_shape", "lateral_shape"):
            shape = getattr(self, name)
            if shape is not None and (shape.shape[-1] < 2 or (shape.mean(axis=-1) == 0).any()):
                raise ParameterError(
                    f"strips: {name} of shape {shape.shape} has fewer than 2 values or no "
                    "resultant; give (n_x,) or (n_points, n_x) values with a mean"
                )


@dataclass(frozen=True, slots=True)
class StripContact:
    """The whole width on the road.

    Attributes
    ----------
    layout : Layout
    deflection : shape (n_points,), [m]
        d0 at the equator.
    camber, pressure, omega : shape (n_points,), [rad], [Pa], [rad/s]
    radius : shape (n_points,), [m]
        Radius of the neutral line.
    free_radius : shape (n_strips,), [m]
    strip_deflection : shape (n_points, n_strips), [m]
    edges : shape (n_points, n_strips, 2), [rad]
        Leading and trailing contact angle; NaN where the strip is off the road.
    load : shape (n_points, n_strips), [N]
        Vertical load of each strip.
    phi, weights, line_pressure : shape (n_points, n_strips, n_nodes), [rad], [rad], [N/m]
        Nodes in the patch, their weights, and pressure; zero weight off the road.
    displacement : shape (n_points, n_strips, n_modes + 1, 3)
        Harmonics of (u, v, beta) of each strip, [m], [m], [rad].
    bending : LateralDeflection
        Lateral deflection of the whole belt.
    iterations : int
    """

    layout: Layout
    deflection: FloatArray
    camber: FloatArray
    pressure: FloatArray
    omega: FloatArray
    radius: FloatArray
    free_radius: FloatArray
    strip_deflection: FloatArray
    edges: FloatArray
    load: FloatArray
    phi: FloatArray
    weights: FloatArray
    line_pressure: FloatArray
    displacement: ComplexArray
    bending: LateralDeflection
    iterations: int

    def __len__(self) -> int:
        return int(self.deflection.shape[0])

    @property
    def length(self) -> FloatArray:
        """Contact length along the road, [m], shape (n_points, n_strips); 0 off the road."""
        tangent = np.tan(self.edges)
        height = self.free_radius - self.strip_deflection
        out: FloatArray = np.nan_to_num(height * (tangent[..., 1] - tangent[..., 0]), nan=0.0)
        return out

    @property
    def overturning(self) -> FloatArray:
        """Moment of the strips' loads about the x axis, sum F_i y_i, [N m], shape (n_points,)."""
        out: FloatArray = self.load @ self.layout.lateral
        return out

    @property
    def tilt(self) -> FloatArray:
        """Roll of the belt under the axle, left side up positive, [rad], shape (n_points,).

        Slope over y of the strips' inward displacement.
        """
        y = self.layout.lateral - self.layout.lateral.mean()
        inward = -evaluate(self.displacement[..., 0], np.zeros(1))[..., 0]
        square = float(np.sum(y**2))
        return inward @ y / square if square > 0 else np.zeros(len(self))


PER_POINT = tuple(
    field.name
    for field in fields(StripContact)
    if field.name not in ("layout", "free_radius", "bending", "iterations")
)


def take_points(contact: StripContact, rows: IntArray) -> StripContact:
    """Return some points of a contact."""
    bending = LateralDeflection(
        *[getattr(contact.bending, field.name)[rows] for field in fields(LateralDeflection)]
    )
    values: dict[str, Any] = {name: getattr(contact, name)[rows] for name in PER_POINT}
    return replace(contact, bending=bending, **values)


def join_points(parts: list[StripContact], order: IntArray, iterations: int) -> StripContact:
    """Put points together that settled at different times."""
    back = np.argsort(order)
    bending = LateralDeflection(
        *[
            np.concatenate([getattr(part.bending, field.name) for part in parts])[back]
            for field in fields(LateralDeflection)
        ]
    )
    values: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])[back] for name in PER_POINT
    }
    return replace(parts[0], bending=bending, iterations=iterations, **values)
