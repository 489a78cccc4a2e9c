"""A campaign of forces as the library sees it: the identified brush, and the problem."""

from tirelib.effects import CATALOGUE
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.brush_law import BrushModel
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_noise import force_noise
from tirelib.inference.identify.force_points import force_points
from tirelib.inference.problems.forces import ForceProblem


def problem_of(data: ForceData, quantity: str) -> ForceProblem:
    """Return the problem of a campaign about the brush that `tirelib identify` fits to it."""
    fit = fit_brush(data)
    reference = (fit.reference.load, fit.reference.pressure)
    brush = BrushModel("fitted", fit.values, fit.reference, None)
    points = force_points(data)
    model = ForceModel("fitted", brush, (), reference, ())
    noise = force_noise(points, getattr(points.data, quantity))[0]
    return ForceProblem(
        model.bench(points), quantity, model.values, list(CATALOGUE.values()), noise=noise
    )
