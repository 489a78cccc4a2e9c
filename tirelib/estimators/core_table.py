"""A calibration as a flat table of numbers, which the native core reads.

The core (``fmu_src/core``) knows no TOML: what it needs stands in one array of doubles, in the
order in which ``fmu_src/core/calibration.c`` takes it. The estimators' constants stand in it as
well, so they are written in the Python modules only, and so does what follows from the
calibration alone (fitting matrices, the spread of what nobody measures, the ends of ranges).
Regressors have the numbers of their places in `VALUES`.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import FormatError
from tirelib.estimators import (
    angle_model,
    any_road,
    contact_length,
    doubt,
    gage_chains,
    laws,
    likeness,
    pulled,
    regressors,
    sliding,
    tilt,
    unknowns,
)
from tirelib.estimators.chain import Chain
from tirelib.estimators.estimate import QUANTITIES
from tirelib.estimators.gage_chains import GageChains
from tirelib.estimators.polynomial import Cloud, Polynomial, Range, Term, Variable

MAGIC, VERSION = 20220117.0, 2.0
"""First numbers of a table; a core refuses others."""
VALUES = (
    *("contact_angle", "compression", "traction", "tension"),
    *("cp1_slope", "cp2_slope", "angle_slope", "tp_slope"),
    *("angle_bow", "tp_bow", "cp1_bow", "cp2_bow", "fullness", "skew"),
    *("steepness", "steepness_change", "lead_bend", "trail_bend"),
    *("omega", "pressure", "speed", "camber", "friction", "tread_depth", "tread_temperature"),
    *regressors.TWISTS,
    *regressors.WAVES,
    *("speed_squared", "load", "slip_ratio", "slip_std", "slip_size", "utilisation"),
)
"""Regressors and what the chain adds to them, in the order of ``values.h``."""
CONSTANTS = (
    *laws.PRESSURE_ENVELOPE,
    *(laws.PRESSURE_DOUBT, laws.FORCE_EXPONENT, laws.FORCE_DOUBT, laws.UNKNOWN_PRESSURE),
    *(laws.FASTEST, laws.SLOWEST, laws.SPEED_DOUBT, laws.SPEED_UNIT, laws.RADIUS_SHARE),
    *(laws.RADIUS_DOUBT, laws.CALIBRATED_SLACK),
    *(unknowns.UNDER_GROOVES, unknowns.SOFTENING, unknowns.BENT, unknowns.CORNERING),
    *(unknowns.FORCE, unknowns.LAW_DOUBT),
    *(sliding.LOAD, sliding.MOMENT_DOUBT, sliding.CURVE_DOUBT, sliding.LOAD_DOUBT),
    *(sliding.FORCE_DOUBT, sliding.FREE, sliding.LEAST_ROLLING, sliding.TINY, sliding.STEEPEST),
    float(sliding.NEWTON),
    *(any_road.ROUGHER, any_road.HIDDEN, any_road.HIDDEN_DOUBT, any_road.LEAST_UTILISATION),
    *(unknowns.FRICTION[1], unknowns.FRICTION[0]),
    pulled.PULL,
    *(tilt.USUAL, tilt.FORCE, tilt.LOAD, tilt.POWER, tilt.SLOPE, tilt.READ_DOUBT),
    tilt.LEAST_LOAD,
    *(likeness.ROAD_DOUBT, likeness.PRESSURE_DOUBT, likeness.SPEED_DOUBT),
    likeness.ROAD_DRIFT["angle_slope"][1],
    *(angle_model.WIDEST, doubt.ANGLE_STEP, gage_chains.LARGEST_ANGLE_STD),
    *(contact_length.BIAS, contact_length.MIDDLE, contact_length.WIDTH),
    *(contact_length.LEAST_STD, contact_length.SHORT_STD, contact_length.SHORT_WIDTH),
)
"""In the order of ``Constants`` in ``calibration.h``."""
VARIABLES, TERMS, NAMES, NODES, WHOLE = 32, 256, 24, 64, 6
"""Sizes that the core was compiled with, in ``calibration.h``."""


def flat_table(known: GageChains) -> FloatArray:
    """Return the table of a calibration, shape (n,).

    Raises
    ------
    FormatError
        If the calibration holds a regressor that the core does not know, or more of them than it
        has room for.
    """
    if (any_road.NODES, any_road.WHOLE) != (NODES, WHOLE):
        raise FormatError(
            f"native core: compiled for {NODES} and {WHOLE} slip angles, the estimators look at "
            f"{any_road.NODES} and {any_road.WHOLE}; compile it anew"
        )
    cut_off = np.nan if known.cut_off is None else known.cut_off
    numbers = [
        float(len(known.lateral)),
        *known.lateral,
        *(known.order, cut_off, known.rolling.centre, known.rolling.threshold),
        *CONSTANTS,
        *np.concatenate(np.polynomial.legendre.leggauss(NODES)).tolist(),
        float(len(known.chains)),
    ]
    for missing, part in sorted(known.chains.items()):
        numbers += [float(missing), *_chain(part, np.array(known.lateral))]
    return np.array([MAGIC, VERSION, len(numbers) + 3.0, *numbers], dtype=np.float64)


def _number(name: str) -> float:
    """Return the number of a regressor."""
    if name not in VALUES:
        raise FormatError(
            f"native core: it knows no regressor {name!r}, only {', '.join(VALUES)}; calibrate "
            "anew, or build the FMU with --python"
        )
    return float(VALUES.index(name))


def _chain(part: Chain, lateral: FloatArray) -> Iterator[float]:
    """Yield the numbers of a chain."""
    places = tuple((lateral[list(part.gages)] / np.abs(lateral).max()).tolist())
    camber = [guard for guard in part.guards["Fy"] if guard.name == "camber"]
    widest = [guard.high for guard in part.guards["alpha"] if guard.name == "alpha"]
    yield from (float(len(part.gages)), *map(float, part.gages))
    yield from regressors._fitted(places, 1).ravel().tolist()
    for degree in (2, 3, 4):
        yield from regressors._fitted(places, degree)[degree].tolist()
    yield from (float(name in part.needed) for name in ("pressure", "camber", "speed"))
    yield from (_uses(part.force, "camber"), _uses(part.radius, "load"))
    yield from (part.mean_load, part._load_per_hardening(), max(widest or [angle_model.WIDEST]))
    yield from (camber[0].low, camber[0].high) if camber else (np.nan, np.nan)
    for quantity in QUANTITIES:
        yield from _guard(quantity, part.guards[quantity])
    for law in (part.laws, part.force_laws):
        yield from (*law.pressure, *law.speed, law.contact_width, law.radius)
        yield from (float(law.pressure_fitted), float(law.speed_fitted))
    yield from _road(part.road)
    for model in (part.load, part.radius, part.force):
        yield from _polynomial(model)
    yield from _polynomial(part.angle.polynomial if part.angle else None)
    yield from (part.angle.blur, part.angle.bend) if part.angle else (0.0, 0.0)
    for model in (part.moment, part.drag):
        yield from _polynomial(model)
    yield from _sliding(part)
    yield from _cloud(part.cloud)
    yield from _likeness(part.likeness)
    yield from _likeness(part.agreement)


def _uses(model: Polynomial | None, name: str) -> float:
    return float(model is not None and any(v.name == name for v in model.variables))


def _guard(quantity: str, ranges: Sequence[Range]) -> Iterator[float]:
    yield float(len(ranges))
    for known in ranges:
        yield -1.0 if known.name == quantity else _number(known.name)
        yield from (known.low - known.slack, known.high + known.slack, float(not known.needed))


def _road(road: unknowns.Road) -> Iterator[float]:
    nothing = {name: np.full(1, np.nan) for name in road.ends}
    yield from (*road.depth, *road.tread_temperature)
    for low, high in road.ends.values():
        yield from (low, high)
    yield float(road.worn(nothing)[1][0])
    yield unknowns._unknown_height(road.depth, unknowns.DEPTH, unknowns.UNDER_GROOVES)
    yield unknowns._unknown_warmth(unknowns.TEMPERATURE)


def _form(variables: Sequence[Variable], terms: Sequence[Term]) -> Iterator[float]:
    if len(variables) > VARIABLES or len(terms) > TERMS:
        raise FormatError(
            f"native core: a polynomial has {len(variables)} regressors and {len(terms)} terms; "
            f"{VARIABLES} and {TERMS} are allowed; calibrate with fewer, or build the FMU with "
            "--python"
        )
    yield from (float(len(variables)), float(len(terms)))
    for variable in variables:
        yield from (_number(variable.name), variable.centre, variable.scale)
    for term in terms:
        yield from map(float, term)


def _polynomial(model: Polynomial | None) -> Iterator[float]:
    if model is None:
        yield 0.0
        return
    yield 1.0
    yield from _form(model.variables, model.terms)
    yield from model.coefficients.tolist()
    yield from model.covariance.ravel().tolist()
    yield from (model.residual, model.floor, model.pulled)
    border = model.border
    yield from (1.0, border.near, border.growth, border.far) if border else (0.0, 0.0, 0.0, 0.0)


def _three(logs: tuple[float, ...]) -> tuple[float, ...]:
    """Return a polynomial of up to three coefficients with three."""
    return (*logs, 0.0, 0.0)[:3]


def _sliding(part: Chain) -> Iterator[float]:
    curve = part.sliding
    if curve is None:
        yield 0.0
        return
    yield from (1.0, curve.friction, curve.friction_std, curve.grip, curve.sharpness, curve.fading)
    yield from (*curve.camber, curve.misfit, curve.slant)
    yield part.road.unseen_friction(curve.friction)
    for logs in (curve.stiffness, curve.trail, curve.ratio):
        yield from _three(logs)


def _cloud(cloud: Cloud | None) -> Iterator[float]:
    if cloud is None:
        yield 0.0
        return
    yield from (1.0, *map(_number, cloud.names), *cloud.scale.tolist())
    yield from (cloud.reach, cloud.around, float(cloud.mirrored), float(len(cloud.points)))
    yield from cloud.points.ravel().tolist()


def _likeness(known: likeness.Likeness | None) -> Iterator[float]:
    if known is None:
        yield 0.0
        return
    names = known.names
    if len(names) > NAMES:
        raise FormatError(
            f"native core: another tire is recognised by {len(names)} features; at most {NAMES} "
            "are allowed; build the FMU with --python"
        )
    yield 1.0
    yield from _form(known.variables, known.terms)
    yield float(len(names))
    yield float(names.index("angle_slope") if "angle_slope" in names else -1)
    yield from (known.limit, known.edge)
    for name in names:
        yield from (_number(name), *likeness.DRIFT[name], float(name in regressors.SIDED))
        yield from (*likeness.ROAD_DRIFT[name], likeness.CAMBER_DRIFT.get(name, 0.0))
    yield from known.coefficients.ravel().tolist()
    yield from known.covariance.ravel().tolist()
