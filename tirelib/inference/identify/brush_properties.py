"""What a tire has beyond its best brush: its own slope at zero slip, largest force and trail."""

from tirelib.inference.identify.brush_misfit import Term
from tirelib.inference.identify.brush_study import Study, known_pressure

NEAR_ZERO = 0.01
"""Slip, in units of full sliding, between whose signs the slope at zero is taken."""


def property_terms(study: Study, name: str) -> list[Term]:
    """Return what the tire's own property has beyond the best brush, for the parameter's z."""
    load, pressure = study.misfit.load, study.misfit.pressure
    forces = set(study.fit.rmse)
    fitted = set(study.fit.names)
    side = "slip_angle" if "Fy" in forces else "slip_ratio"

    def slope(slip: str, factor: float) -> list[Term]:
        return slope_terms(study, slip, factor, load, pressure, study.stiffness[slip])

    def length(factor: float) -> list[Term]:
        """Return ln a = ln 3 + ln (slope of Mz) - ln C."""
        return [*_trail_terms(study, factor), *slope("slip_angle", -factor)]

    has_length = "half_length" in fitted and {"Fy", "Mz"} <= forces
    if name == "friction":
        return _peak_terms(study, side)
    if name == "half_length" and has_length:
        return length(1.0)
    if name in ("lateral_stiffness", "longitudinal_stiffness"):
        along = name == "longitudinal_stiffness" or side == "slip_ratio"
        own = slope("slip_ratio" if along else "slip_angle", 1.0)
        return own + (length(-2.0) if has_length else [])
    return []


def _scale(study: Study, force: str) -> float | None:
    if force not in study.fit.rmse or study.problem.scale is None:
        return None
    return float(study.problem.scale[tuple(study.fit.rmse).index(force)])


def slope_terms(
    study: Study, slip: str, factor: float, load: float, pressure: float, size: float
) -> list[Term]:
    """Return factor times the change of ln C by the misfit's slope at zero slip."""
    force = "Fy" if slip == "slip_angle" else "Fx"
    scale = _scale(study, force)
    if scale is None:
        return []
    sign = -1.0 if force == "Fy" else 1.0
    slide = 3.0 * study.fit.values["friction"] * load / size
    h = NEAR_ZERO * slide
    each = sign * factor * scale / (2.0 * h * size)
    where = known_pressure(pressure)
    return [_place(force, load, where, slip, slide, s * h, s * each) for s in (1.0, -1.0)]


def _trail_terms(study: Study, factor: float) -> list[Term]:
    """Return factor times the change of ln (slope of Mz at zero slip)."""
    scale = _scale(study, "Mz")
    if scale is None:
        return []
    size = study.stiffness["slip_angle"] * study.fit.values["half_length"] / 3.0
    slide = study.slide["slip_angle"]
    h = NEAR_ZERO * slide
    load, pressure, each = study.misfit.load, study.misfit.pressure, factor * scale / (2 * h * size)
    return [_place("Mz", load, pressure, "slip_angle", slide, s * h, s * each) for s in (1.0, -1.0)]


def _peak_terms(study: Study, slip: str) -> list[Term]:
    """Return the change of ln mu by the misfit where the whole contact slides."""
    force = "Fy" if slip == "slip_angle" else "Fx"
    scale = _scale(study, force)
    if scale is None:
        return []
    sign = -1.0 if force == "Fy" else 1.0
    load, pressure = study.misfit.load, study.misfit.pressure
    each = 0.5 * sign * scale / (study.fit.values["friction"] * load)
    far = study.slide[slip]
    return [_place(force, load, pressure, slip, far, s * far, s * each) for s in (1.0, -1.0)]


def _place(
    force: str, load: float, pressure: float, slip: str, slide: float, at: float, factor: float
) -> Term:
    if slip == "slip_angle":
        return Term(force, load, pressure, at, 0.0, slide, 1.0, factor)
    return Term(force, load, pressure, 0.0, at, 1.0, slide, factor)
