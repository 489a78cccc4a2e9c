"""Effects added to a model one after the other, each step from one set of fits.

The model with all of them has them fitted at once; the models on the way have been fitted on the
way to it. Where a diagnosis of the same campaign and model is at hand, its fits serve.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.errors import CalibrationError, ParameterError, TirelibError
from tirelib.core.parameters import TireFile
from tirelib.effects import Effect
from tirelib.inference.compare.force_model import ForceModel, force_model_of
from tirelib.inference.compare.model import TireModel, model_of
from tirelib.inference.diagnose.document import Assessment
from tirelib.inference.diagnose.forces.assess import ForceAssessment, force_cases
from tirelib.inference.extend.document import extension_document
from tirelib.inference.extend.extension import (
    Extension,
    extended,
    refuse,
    remove_effect,
    strain_models,
)
from tirelib.inference.extend.force_document import force_extended_file, force_extension_document
from tirelib.inference.extend.force_extension import (
    ForceExtension,
    case_for,
    extended_brush,
    force_models,
    refuse_brush,
    remove_brush_effect,
)
from tirelib.inference.extend.model_file import extended_file
from tirelib.inference.extend.step import Step
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.force_data import FORCES
from tirelib.measured.waveforms import measure_waveforms

Progress = Callable[[str], None]
S = TypeVar("S", bound=Step[Any])
Known = TireModel | ForceModel
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
    """Yield the model with one effect more after the other.

    Parameters
    ----------
    effects : sequence of Effect
        All of strain, or all of the brush.
    file : TireFile
    campaign : Campaign
    quantity : str or None
        Measured quantity to fit; by default strain, for an effect of the brush the force that it
        helps most.
    catalogue : mapping
        Effects by name.
    diagnosis : Assessment or ForceAssessment, optional
        A diagnosis of this campaign and model: its fits are used.
    failed : callable, optional
        Called for an effect that cannot be added, which is then left out.
    progress : callable, optional

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
    written = _brush(campaign, catalogue)
    if isinstance(diagnosis, ForceAssessment):
        _belongs(
            diagnosis.case.name, diagnosis.case.model, campaign, force_model_of(file, catalogue)
        )
        case, brush = diagnosis.case, diagnosis.diagnosis.models
        return _chain(effects, file, partial(extended_brush, brush, case), written, failed)
    if diagnosis is None and acts_on_forces(effects[0], quantity):
        case = case_for(force_cases(campaign, file, catalogue, quantity), effects[0])
        for effect in effects:
            refuse_brush(case, effect)
        brush = force_models(case, effects, progress)
        return _chain(effects, file, partial(extended_brush, brush, case), written, failed)
    model = model_of(file, catalogue)
    for effect in effects:
        refuse(model, effect)
    if diagnosis is None:
        runs = straight_runs(measure_waveforms(campaign, progress=progress))
        strain = strain_models(runs, model, effects, progress)
    else:
        strain = diagnosis.diagnosis.models
        _belongs(strain.runs.waves.header.name, diagnosis.given, campaign, model)
    return _chain(effects, file, partial(extended, strain, model), _strain(campaign), failed)


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
    if acts_on_forces(effect, quantity):
        case = case_for(force_cases(campaign, file, catalogue, quantity), effect)
        removed = remove_brush_effect(case, effect, progress=progress)
        return _brush(campaign, catalogue)(file, removed)
    runs = straight_runs(measure_waveforms(campaign, progress=progress))
    step = remove_effect(runs, model_of(file, catalogue), effect, progress=progress)
    return _strain(campaign)(file, step)


def acts_on_forces(effect: Effect, quantity: str | None) -> bool:
    """Return whether a force is fitted, and not strain."""
    return quantity not in (None, "strain") or (quantity is None and effect.hook == "brush")


def _belongs(name: str, of: Known, campaign: Campaign, model: Known) -> None:
    """Refuse a diagnosis of another campaign, or of another model."""
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


def _strain(campaign: Campaign) -> Callable[[TireFile, Extension], Extended]:
    def written(file: TireFile, step: Extension) -> Extended:
        new = extended_file(file, step, campaign.content_hash())
        return new, extension_document(step, new)

    return written


def _brush(
    campaign: Campaign, catalogue: Mapping[str, Effect]
) -> Callable[[TireFile, ForceExtension], Extended]:
    def written(file: TireFile, step: ForceExtension) -> Extended:
        new = force_extended_file(file, step, campaign.content_hash())
        others = _others(campaign, (file, new), catalogue, step.case.quantity)
        return new, force_extension_document(step, new) | {"others": others}

    return written


def _others(
    campaign: Campaign, files: Sequence[TireFile], catalogue: Mapping[str, Effect], fitted: str
) -> dict[str, dict[str, Any]]:
    """Return the errors of the forces that were not fitted, before and after: one brush has all."""
    told = {}
    for name in FORCES:
        if name == fitted:
            continue
        try:
            (old,), (new,) = (force_cases(campaign, each, catalogue, name) for each in files)
        except CalibrationError:
            continue
        told[name] = {"error_before": old.given, "error_after": new.given, "error_unit": new.unit}
    return told


def _chain(
    effects: Sequence[Effect],
    file: TireFile,
    step_of: Callable[[Effect, Any], S],
    written: Callable[[TireFile, S], Extended],
    failed: Callable[[Effect, TirelibError], None] | None,
) -> Iterator[Extended]:
    before = None
    for effect in effects:
        try:
            step = step_of(effect, before)
            file, document = written(file, step)
        except TirelibError as error:
            if failed is None:
                raise
            failed(effect, error)
            continue
        before = step.after
        yield file, document
