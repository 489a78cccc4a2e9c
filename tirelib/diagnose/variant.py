"""One structural variant of a model: what any tire has and the fitted ring has not.

Its constants differ, its belt stretches, shears and grows with what blows and spins it, its tread
hardens, gains width with load and is crowned, its sections have inertia, and the large part of its
displacements is other than computed.
"""

from collections.abc import Mapping

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.contact.layout import GAGES
from tirelib.contact.radial import press
from tirelib.diagnose.refit import Refit
from tirelib.effects.effect import State
from tirelib.errors import ConvergenceError
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import Correction, coordinates, predict
from tirelib.model.chain import Change

REFERENCE_LOAD = 4000.0
STIFFNESSES = (
    "bending_stiffness",
    "radial_stiffness",
    "tangential_stiffness",
    "extension_stiffness",
)
TREAD_AND_SECTIONS = (
    "shear_stiffness",
    "rotary_inertia",
    "tread_shear_stiffness",
    "tread_hardening",
)
SPREAD = 0.1
"""Relative standard deviation of them."""
LARGE = 0.3
"""Relative standard deviation of the part that large displacements add."""
FOLLOWED = 0.1
"""The same where the model has the belt's shear and a tread that sticks."""
SECTIONS = 8e-5
"""Largest inertia of the belt's sections, [kg m]: twice that of 12.5 mm of belt and tread."""
MASS = 0.15
"""Relative standard deviation of the belt's mass, which no fit of straight runs tells."""
CROWN = 1.2
"""Largest curvature of the tread's crown, [1/m]: radii of passenger tires are 0.8 m and more."""
STRIPS = np.array([y for y in GAGES if y >= 0.0])
"""Lateral positions of half the strips, [m]."""
SHARES = np.where(STRIPS > 0.0, 2.0, 1.0) / len(GAGES)
PASSES, CARRIED = 6, 1e-4
"""Most passes, and the relative error of the load that ends them."""


def variant(data: Data, model: Refit, random: np.random.Generator) -> FloatArray:
    """Return the waveforms of one variant at the plan, (n_runs, n_phi).

    Raises
    ------
    TirelibError
        If the draw is no tire.
    """
    points = data.points
    values = dict(model.values)
    for name in STIFFNESSES:
        values[name] = values[name] * float(np.exp(SPREAD * random.standard_normal()))
    values["mass"] = values["mass"] * float(np.exp(MASS * random.standard_normal()))
    plain = bool(np.isfinite(values["shear_stiffness"]).all())
    if plain:
        for name in TREAD_AND_SECTIONS:
            values[name] = values[name] * float(np.exp(SPREAD * random.standard_normal()))
    else:
        values["shear_stiffness"] = 1e3 / random.uniform(0.001, 0.03)
        values["tread_hardening"] = random.uniform(0.0, 3.0)
        values["rotary_inertia"] = random.uniform(0.0, SECTIONS)
    values["tread_stiffness"] = values["tread_stiffness"] * (
        points.load / REFERENCE_LOAD
    ) ** random.uniform(-0.1, 0.2)
    large = 1.0 + (FOLLOWED if plain else LARGE) * float(random.standard_normal())
    follows = model.correction.moved(_moves(model.values, values, len(points)))
    correction = Correction(
        large * follows.waveform, large * follows.deflection, start=follows.start
    )
    crown = crowned(float(random.uniform(0.0, CROWN)))
    own = [("constants", grown), ("constants", flung), ("contact", crown)]
    return predict(
        values, points, [*model.changes, *own], low_pass=data.low_pass, correction=correction
    ).wave


def _moves(
    values: Mapping[str, float | FloatArray], others: Mapping[str, float | FloatArray], n: int
) -> FloatArray:
    """Return moves of the fitted coordinates from values to others, (n_free, n)."""
    free = coordinates(values)
    moves = np.zeros((len(free), n))
    for row, each in zip(moves, free, strict=True):
        value, other = values[each.name], others[each.name]
        if np.isfinite(value).all():  # a belt that does not stretch has nowhere to go
            row[:] = each.distance(value, other)
    return moves


def flung(state: State) -> State:
    """Return the state with the sidewalls' share of what spins off the belt that stretches."""
    share = 1.0 / (1.0 + state.EA / (state.k_u * state.radius**2))
    spin = state.mass * (state.radius * np.asarray(state.conditions.omega)) ** 2
    return state.but(tension=state.tension - share * spin)


def grown(state: State) -> State:
    """Return the state with a belt as large as what blows and spins it makes it in each run.

    w = T R / (EA + k_u R^2), less the mean of the runs, for which the radii were measured.
    """
    wide = state.belt_tension * state.radius / (state.EA + state.k_u * state.radius**2)
    more = wide - np.mean(wide)
    return state.but(radius=state.radius + more, free_radius=state.free_radius + more)


def crowned(curvature: float) -> Change:
    """Return the change to the mean of strips whose tread lies lower by c y^2 / 2.

    Each strip is the whole ring, pressed by so much less; together they carry the load.
    """
    gap = 0.5 * curvature * STRIPS**2

    def change(state: State) -> State:
        c, strips, n = state.contact, STRIPS.size, len(state.contact)
        ring = c.compliance.spread(n).take(np.tile(np.arange(n), strips))
        tread = c.tread.spread(n).take(np.tile(np.arange(n), strips))
        extra = None if c.extra is None else np.tile(c.extra, (strips, 1, 1))
        depth = c.deflection + float(SHARES @ gap)
        slope = c.load / c.deflection
        target = c.load
        for _ in range(PASSES):
            pressed = press(
                ring, tread, (depth - gap[:, None]).ravel(), extra=extra, n_nodes=c.phi.shape[1]
            )
            wrong = target - SHARES @ pressed.load.reshape(strips, n)
            if np.abs(wrong / target).max() < CARRIED:
                break
            depth = depth + wrong / slope
        else:
            raise ConvergenceError(
                f"crowned tread of {curvature:g} 1/m: the strips' load is off by up to "
                f"{np.abs(wrong).max():.2g} N after {PASSES} passes; draw another tire",
                pressed,
                float(np.abs(wrong).max()),
            )
        belt = pressed.displacement.reshape(strips, n, *state.belt.shape[1:])
        return state.but(belt=np.tensordot(SHARES, belt, axes=1), deflection=depth)

    return change
