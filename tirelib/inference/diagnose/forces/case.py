"""One force of a campaign with a model's brush, ready to be fitted and diagnosed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.arrays import FloatArray, rms
from tirelib.core.errors import CalibrationError
from tirelib.core.parameters import TireFile
from tirelib.core.quantities import QUANTITIES
from tirelib.effects import Effect
from tirelib.inference.compare.force_model import (
    ForceModel,
    force_model_of,
    quantities_of,
    slip_of,
    slips,
    usable_points,
)
from tirelib.inference.identify.force_bench import ForceBench
from tirelib.inference.identify.force_data import force_data
from tirelib.inference.identify.force_noise import force_noise
from tirelib.inference.identify.force_notes import noise_note, taken_as_zero
from tirelib.inference.identify.force_points import ForcePoints, force_points
from tirelib.inference.problems.forces import ForceProblem, changes_at

MOST_POINTS = 4000
"""Points that are fitted; of a longer sweep passes are left out evenly."""
LEAST_POINTS = 12
MISFIT = 0.02
"""Part of the measured rms that counts as noise of the brush itself when residuals are scaled."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceCase:
    """One force of a campaign, ready to be fitted.

    Attributes
    ----------
    name : str
        Name of the campaign.
    quantity : str
        Fy, Fx or Mz.
    bench : ForceBench
        At the points that are fitted.
    whole : ForceBench
        At all points, for which errors are reported.
    noise : float, [N] or [N m]
        Standard deviation of a point; NaN without repeats.
    """

    name: str
    model: ForceModel
    quantity: str
    bench: ForceBench
    whole: ForceBench
    noise: float
    repeats: int
    messages: tuple[str, ...]

    @property
    def unit(self) -> str:
        """Unit of errors: noise, N or Nm."""
        return "noise" if np.isfinite(self.noise) else QUANTITIES[self.quantity].unit

    @property
    def factor(self) -> float:
        """Factor from an rms in SI to an error in the unit of documents."""
        return 1.0 / self.noise if np.isfinite(self.noise) else 1.0

    @property
    def size(self) -> float:
        """Rms of the force at all points, in the unit of errors."""
        return self.factor * rms(getattr(self.whole.points.data, self.quantity))

    @property
    def scale(self) -> float:
        """By which residuals of a fit are divided, [N] or [N m]."""
        noise = self.noise if np.isfinite(self.noise) else 0.0
        misfit = MISFIT * rms(getattr(self.bench.points.data, self.quantity))
        return max(float(np.hypot(misfit, noise)), 1e-9)

    def error(
        self,
        values: Mapping[str, float],
        effects: Sequence[Effect],
        strengths: Sequence[FloatArray],
    ) -> float:
        """Return the error of a brush over all points, in the unit of documents."""
        found = self.whole.forces(values, changes_at(effects, strengths))
        measured = getattr(self.whole.points.data, self.quantity)
        return self.factor * rms(measured - getattr(found, self.quantity))

    @property
    def given(self) -> float:
        """The error of the model as its file has it."""
        return self.error(self.model.values, self.effects, self.strengths)

    def named_errors(self, before: float, after: float) -> dict[str, Any]:
        """Return the keys under which a document states the errors before and after a change."""
        return {
            "error_unit": self.unit,
            "noise": self.noise,
            "error_before": before,
            "error_after": after,
            "residual_rms_before": before / self.factor,
            "residual_rms_after": after / self.factor,
            "residual_rms_unit": QUANTITIES[self.quantity].unit,
        }

    @property
    def effects(self) -> list[Effect]:
        """Effects that the model has."""
        return [used.effect for used in self.model.used]

    @property
    def strengths(self) -> list[FloatArray]:
        """Their strengths, arrays of components."""
        return [used.components for used in self.model.used]

    def as_given(self, catalogue: Sequence[Effect]) -> ForceProblem:
        """Return the force as the inference sees it, about the model as its file has it."""
        return ForceProblem(
            self.bench,
            self.quantity,
            self.model.values,
            catalogue,
            noise=self.noise,
            effects=self.effects,
            strengths=self.strengths,
        )


def force_case(
    campaign: Campaign, file: TireFile, effects: Mapping[str, Effect], quantity: str | None
) -> ForceCase:
    """Return the force of a campaign that is asked for, else the one with the largest lack of fit.

    Errors are those of `force_cases`.
    """

    def lack(case: ForceCase) -> float:
        return case.given if np.isfinite(case.noise) else case.given / case.size

    return max(force_cases(campaign, file, effects, quantity), key=lack)


def force_cases(
    campaign: Campaign, file: TireFile, effects: Mapping[str, Effect], quantity: str | None = None
) -> list[ForceCase]:
    """Return the force that is asked for, else every force to which the slips matter.

    Raises
    ------
    CalibrationError
        If the model has no brush, the force is not measured, or there are too few points.
    """
    model = force_model_of(file, effects)
    points = force_points(force_data(campaign))
    wanted = quantities_of(campaign, points, quantity)
    points = usable_points(campaign, model, points)
    notes = taken_as_zero(campaign)
    return [_case(campaign.header.name, model, points, name, notes) for name in wanted]


def _case(
    name: str, model: ForceModel, points: ForcePoints, quantity: str, notes: Sequence[str]
) -> ForceCase:
    points = points.take(np.isfinite(getattr(points.data, quantity)))
    if len(points) < LEAST_POINTS:
        raise CalibrationError(
            f"{name}: {quantity} is measured at {len(points)} points; {LEAST_POINTS} are needed to "
            "tell effects apart; add runs with other loads, pressures and slips"
        )
    if not slips(points.data, quantity):
        slip = slip_of(quantity).replace("_", " ")
        raise CalibrationError(
            f"{name}: one {slip} only, so {quantity} says nothing about the brush; "
            "add runs with slip"
        )
    messages = list(notes)
    whole = points
    if len(points) > MOST_POINTS:
        step = int(np.ceil(len(points) / MOST_POINTS))
        points = points.take(np.arange(0, len(points), step))
        messages.append(
            f"{len(whole)} points, passes of the sweep; one in {step} is fitted ({len(points)})"
        )
    measured = getattr(whole.data, quantity)
    noise, _, repeats = force_noise(whole, measured)
    messages += noise_note(quantity, noise, rms(measured))
    benches = model.bench(points), model.bench(whole)
    return ForceCase(name, model, quantity, *benches, noise, repeats, tuple(messages))
