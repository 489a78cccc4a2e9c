"""Effects added to a model one after the other, each step from one set of fits.

The model with all of them has them fitted at once; the models on the way have been fitted on the
way to it. Where a diagnosis of the same campaign and model is at hand, its fits serve.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.errors import CalibrationError, ParameterError, TirelibError
from tirelib.core.parameters import TireFile
from tirelib.effects import Effect
from tirelib.inference.compare.force_model import ForceModel, force_model_of
from tirelib.inference.compare.model import TireModel, model_of
from tirelib.inference.diagnose.assess import Assessment, ForceAssessment
from tirelib.inference.diagnose.forces.case import ForceCase, force_cases
from tirelib.inference.extend.document import extension_document
from tirelib.inference.extend.extension import (
    Extension,
    ForceExtension,
    StrainCase,
    case_for,
    extended,
    models_of,
    refuse,
    without_effect,
)
from tirelib.inference.extend.model_file import extended_file
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.force_data import FORCES
from tirelib.measured.waveforms import measure_waveforms

Progress = Callable[[str], None]
Extended = tuple[TireFile, dict[str, Any]]
"""A model after a step, and ``tirelib-extension/1`` of it."""


def additions(
    effects: Sequence[Effect],
    file: TireFile,
    campaign: Campaign,
    quantity: str | None,
    catalogue: Mapping[str, Effect],
    *,
    diagnosis: Assessment | ForceAssessment | None = None,
    failed: Callable[[Effect, TirelibError], None] | None = None,
    progress: Progress | None = None,
) -> Iterator[Extended]:
    """Return the model with one effect more after the other, in turn.

    Parameters
    ----------
    effects : sequence of Effect
        All of strain, or all of the brush.
    quantity : str or None
        Measured quantity to fit; by default strain, for an effect of the brush the force that it
        helps most.
    catalogue : mapping
        Effects by name.
    diagnosis : Assessment or ForceAssessment, optional
        A diagnosis of this campaign and model: its fits are used.
    failed : callable, optional
        Called for an effect that cannot be added, which is then left out.

    Raises
    ------
    ParameterError
        If an effect is there already, or acts on something else.
    CalibrationError
        If the campaign cannot inform an effect, unless `failed` is given.
    """
    names = [effect.name for effect in effects]
    if len(set(names)) < len(names):
        raise ParameterError(f"effects {', '.join(names)}: one is named twice; leave it out")
    case: StrainCase | ForceCase
    models: Any
    if diagnosis is not None:
        models = diagnosis.diagnosis.models
        if isinstance(diagnosis, ForceAssessment):
            case = diagnosis.case
            _belongs(case, campaign, force_model_of(file, catalogue))
        else:
            case = StrainCase(models.runs, diagnosis.given)
            _belongs(case, campaign, model_of(file, catalogue))
        for effect in effects:
            refuse(case.model, effect)
    else:
        case = _case(effects, file, campaign, quantity, catalogue, progress, refuse)
        models = models_of(case, effects, progress)
    before = None
    for effect in effects:
        try:
            step = extended(models, case, effect, before)
            file, document = _written(file, step, campaign, catalogue)
        except TirelibError as error:
            if failed is None:
                raise
            failed(effect, error)
            continue
        before = step.after
        yield file, document


def removal(
    effect: Effect,
    file: TireFile,
    campaign: Campaign,
    quantity: str | None,
    catalogue: Mapping[str, Effect],
    *,
    progress: Progress | None = None,
) -> Extended:
    """Return the model without one of its effects; parameters as of `additions`.

    Raises
    ------
    ParameterError
        If the model does not have the effect.
    """
    case = _case([effect], file, campaign, quantity, catalogue, progress)
    step = without_effect(case, effect, progress=progress)
    return _written(file, step, campaign, catalogue)


def _case(
    effects: Sequence[Effect],
    file: TireFile,
    campaign: Campaign,
    quantity: str | None,
    catalogue: Mapping[str, Effect],
    progress: Progress | None,
    check: Callable[[TireModel | ForceModel, Effect], None] = lambda model, effect: None,
) -> StrainCase | ForceCase:
    """Return what effects are fitted to, after a look at each with the model."""
    if acts_on_forces(effects[0], quantity):
        case = case_for(force_cases(campaign, file, catalogue, quantity), effects[0])
        for effect in effects:
            check(case.model, effect)
        return case
    model = model_of(file, catalogue)
    for effect in effects:
        check(model, effect)
    return StrainCase(straight_runs(measure_waveforms(campaign, progress=progress)), model)


def acts_on_forces(effect: Effect, quantity: str | None) -> bool:
    """Return whether a force is fitted, and not strain."""
    return quantity not in (None, "strain") or (quantity is None and effect.hook == "brush")


def _belongs(
    case: StrainCase | ForceCase, campaign: Campaign, model: TireModel | ForceModel
) -> None:
    """Refuse a diagnosis of another campaign, or of another model."""
    name, of = case.name, case.model
    same = [effect.effect.name for effect in of.used] == [each.effect.name for each in model.used]
    same = same and of.values.keys() == model.values.keys()
    same = same and all(
        np.array_equal(value, of.values[key], equal_nan=True) for key, value in model.values.items()
    )
    if name != campaign.header.name or not same:
        raise ParameterError(
            f"diagnosis: it is of campaign {name!r} and model {of.name!r}, and the effects are to "
            f"be added to {model.name!r} on {campaign.header.name!r}; diagnose that model, or "
            "leave the diagnosis out"
        )


def _written(
    file: TireFile,
    step: Extension | ForceExtension,
    campaign: Campaign,
    catalogue: Mapping[str, Effect],
) -> Extended:
    """Return the model after a step and the step's document.

    One brush has all forces: that of a force tells the errors of the others, before and after.
    """
    new = extended_file(file, step, campaign.content_hash())
    document = extension_document(step, new)
    if isinstance(step, ForceExtension):
        document["others"] = others = {}
        for name in (each for each in FORCES if each != step.case.quantity):
            try:
                (old,), (now,) = (
                    force_cases(campaign, each, catalogue, name) for each in (file, new)
                )
            except CalibrationError:
                continue
            errors = {"error_before": old.given, "error_after": now.given, "error_unit": now.unit}
            others[name] = errors
    return new, document
