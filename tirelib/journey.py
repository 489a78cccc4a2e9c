"""The verbs of the command line as functions: a campaign and a model go in, a result comes out.

They are offered as `tirelib.identify`, `tirelib.compare`, `tirelib.diagnose`, `tirelib.add` and
`tirelib.simulate`. Each imports what it needs when it is called. A model is a `TireFile`, as
`read_tire` returns it.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tirelib.core.errors import CalibrationError, ParameterError

if TYPE_CHECKING:
    from tirelib.campaign import Campaign
    from tirelib.core.arrays import FloatArray
    from tirelib.core.parameters import TireFile
    from tirelib.effects import Effect
    from tirelib.inference.compare.forces import ForceComparison
    from tirelib.inference.compare.strain import Comparison
    from tirelib.inference.diagnose.assess import Assessment, ForceAssessment
    from tirelib.inference.identify.whole import Whole
    from tirelib.report.simulation import Simulation

QUANTITIES = ("strain", "Fy", "Fx", "Mz")
"""Measured quantities that a model explains."""
BRUSH = ("bristle_lateral", "bristle_longitudinal", "friction")
"""Numbers that a model of the brush states."""
Progress = Callable[[str], None]


def identify(
    campaign: "Campaign",
    start: "TireFile | None" = None,
    *,
    base: str = "plain",
    progress: Progress | None = None,
) -> "Whole":
    """Fit the base model, ring and brush, to a campaign.

    Parameters
    ----------
    campaign : Campaign
    start : TireFile, optional
        Start and priors of the fit.
    base : str
        plain, or dissertation.
    progress : callable, optional
        Called with a label at each step.

    Returns
    -------
    Whole
        Its `file` is the model that the other verbs take.

    Raises
    ------
    CalibrationError
        If the campaign informs neither ring nor brush.
    ParameterError
        If the geometry of `start` contradicts that of the campaign.
    """
    from tirelib.inference.identify.whole import identify_whole

    return identify_whole(campaign, start, base=base, progress=progress)


def compare(
    campaign: "Campaign",
    model: "TireFile",
    quantity: str | None = None,
    *,
    effects: "Mapping[str, Effect] | None" = None,
    progress: Progress | None = None,
) -> "Comparison | ForceComparison":
    """Compare a model with one measured quantity of a campaign.

    Parameters
    ----------
    campaign : Campaign
    model : TireFile
    quantity : str, optional
        One of `QUANTITIES`; by default strain where it was measured and the model has a ring, else
        the force that fits worst.
    effects : mapping, optional
        Effects by name; the default is the catalogue.
    progress : callable, optional
        Called with a label at each step.

    Raises
    ------
    ParameterError
        If the quantity is unknown.
    CalibrationError
        If the campaign does not hold the quantity, or the model does not predict it.
    """
    from tirelib.inference.compare.forces import compare_forces
    from tirelib.inference.compare.model import model_of
    from tirelib.inference.compare.strain import compare_strain
    from tirelib.measured.waveforms import measure_waveforms

    catalogue = _catalogue(effects)
    if explains_forces(quantity, campaign, model):
        return compare_forces(campaign, model, quantity, catalogue)
    waves = measure_waveforms(campaign, progress=progress)
    return compare_strain(waves, model_of(model, catalogue), campaign.content_hash())


def diagnose(
    campaign: "Campaign",
    model: "TireFile",
    quantity: str | None = None,
    *,
    effects: "Mapping[str, Effect] | None" = None,
    false_alarm: float = 0.05,
    progress: Progress | None = None,
) -> "Assessment | ForceAssessment":
    """Find the physical effect that a model lacks.

    Parameters
    ----------
    campaign, model, quantity, effects, progress
        As of `compare`.
    false_alarm : float
        Probability with which a tire that lacks nothing is said to lack something.

    Raises
    ------
    ParameterError, CalibrationError
        As from `compare`.
    """
    catalogue = _catalogue(effects)
    effects_of = list(catalogue.values())
    if explains_forces(quantity, campaign, model):
        from tirelib.inference.diagnose.assess import assess_forces
        from tirelib.inference.diagnose.forces.case import force_case

        case = force_case(campaign, model, catalogue, quantity)
        return assess_forces(case, effects_of, false_alarm=false_alarm, progress=progress)
    from tirelib.inference.compare.model import model_of
    from tirelib.inference.diagnose.assess import assess
    from tirelib.inference.diagnose.diagnose import diagnose as diagnose_strain
    from tirelib.inference.identify.campaign_data import straight_runs
    from tirelib.measured.waveforms import measure_waveforms

    given = model_of(model, catalogue)
    has, strengths = given.of_strain
    found = diagnose_strain(
        straight_runs(measure_waveforms(campaign, progress=progress)),
        given.values,
        effects_of,
        effects=has,
        strengths=strengths,
        false_alarm=false_alarm,
        progress=progress,
    )
    return assess(found, given)


def add(
    effect: "str | Effect | Sequence[str | Effect]",
    model: "TireFile",
    campaign: "Campaign",
    quantity: str | None = None,
    *,
    effects: "Mapping[str, Effect] | None" = None,
    diagnosis: "Assessment | ForceAssessment | None" = None,
    progress: Progress | None = None,
) -> "tuple[TireFile, dict[str, Any]]":
    """Add an effect, or several at once, to a model and fit the model again.

    Parameters
    ----------
    effect : str or Effect, or a sequence of them
        Effects, or their names in `effects`.
    model, campaign, effects, progress
        As of `compare`.
    quantity : str, optional
        Measured quantity to fit; by default strain, for an effect of the brush the force that it
        helps most.
    diagnosis : Assessment or ForceAssessment, optional
        What `diagnose` said of this campaign and model: its fits are taken over.

    Returns
    -------
    model : TireFile
        With the effect, its strength and the step in its history; with several, a step for each.
    document : dict
        What ``tirelib add --json`` writes, of the last effect: errors before and after, on what was
        fitted and on what was left out.

    Raises
    ------
    ParameterError
        If the effect or the quantity is unknown, or the model has the effect.
    CalibrationError
        If the campaign cannot inform the effect.
    """
    from tirelib.inference.extend.additions import additions
    from tirelib.inference.extend.extension import known_effect

    check_quantity(quantity)
    catalogue = _catalogue(effects)
    given = effect if isinstance(effect, Sequence) and not isinstance(effect, str) else [effect]
    chosen = [known_effect(e, catalogue) if isinstance(e, str) else e for e in given]
    steps = additions(
        chosen, model, campaign, quantity, catalogue, diagnosis=diagnosis, progress=progress
    )
    return list(steps)[-1]


def simulate(
    model: "TireFile",
    *,
    load: "float | FloatArray | None" = None,
    deflection: "float | FloatArray | None" = None,
    inflation: "float | FloatArray | None" = None,
    turn_rate: "float | FloatArray" = 0.0,
    effects: "Mapping[str, Effect] | None" = None,
) -> "Simulation":
    """Press a model with its effects onto the road, at one or many operating points.

    Parameters
    ----------
    model : TireFile
        A model, or a tire, which is a model without effects.
    load, deflection : scalar or shape (n_points,), [N], [m]
        One of the two.
    inflation : scalar or shape (n_points,), [Pa]
        By default the tire's own pressure.
    turn_rate : scalar or shape (n_points,), [rad/s]
    effects : mapping, optional
        Effects by name; the default is the catalogue.

    Raises
    ------
    ParameterError
        If not exactly one of load and deflection is given, or a value is outside the model's range.
    ConvergenceError
        If the contact does not settle.
    """
    import numpy as np

    from tirelib.inference.compare.model import model_of
    from tirelib.report.simulation import simulate as simulate_tire
    from tirelib.report.simulation_model import simulate_file

    if (load is None) == (deflection is None):
        given = "neither load nor deflection" if load is None else "both load and deflection"
        raise ParameterError(
            f"simulate: {given}; give exactly one, the other one follows from the model"
        )
    if not ("model" in model.extra or model.extra.get("effects")):
        return simulate_tire(
            model.tire, load=load, deflection=deflection, inflation=inflation, turn_rate=turn_rate
        )
    points = {
        name: None if value is None else np.atleast_1d(np.asarray(value, dtype=float))
        for name, value in (("load", load), ("deflection", deflection), ("inflation", inflation))
    }
    rate = np.atleast_1d(np.asarray(turn_rate, dtype=float))
    return simulate_file(model_of(model, _catalogue(effects)), model.tire, turn_rate=rate, **points)


def explains_forces(quantity: str | None, campaign: "Campaign", model: "TireFile") -> bool:
    """Return whether a force is to be explained, and not strain.

    Strain comes first, where there is strain and the model has a ring.

    Raises
    ------
    ParameterError
        If there is no such quantity.
    CalibrationError
        If strain is asked for and not measured, or is all that the campaign holds and the model has
        no ring.
    """
    from tirelib.inference.identify.strain_notes import is_straight

    header = campaign.header
    check_quantity(quantity)
    if quantity == "strain" and not header.gage_lateral:
        raise CalibrationError(
            f"{header.name}: it has no strain gages; look at its forces: --quantity "
            f"{', '.join(QUANTITIES[1:])}"
        )
    on_strain = quantity in ("strain", None) and bool(header.gage_lateral) and bool(model.missing)
    if on_strain and (quantity == "strain" or all(map(is_straight, campaign.plans))):
        _needs_ring(campaign, model)
    if quantity is None:
        return not header.gage_lateral or bool(model.missing)
    return quantity != "strain"


def _needs_ring(campaign: "Campaign", model: "TireFile") -> None:
    """Refuse to predict strain from a file that states no ring."""
    name, brush = campaign.header.name, [key for key in BRUSH if key in model.numbers]
    lacks = f"{len(model.missing)} numbers of the ring are missing ({', '.join(model.missing)})"
    if brush:
        raise CalibrationError(
            f"{model.name}: it is a model of the brush only ({', '.join(brush)}) and says nothing "
            f"of the strain of {name}: {lacks}; look at its forces in runs with slip, --quantity "
            f"{', '.join(QUANTITIES[1:])}, or identify the ring from straight runs with `tirelib "
            "identify`"
        )
    raise CalibrationError(
        f"{model.name}: it states no complete ring, so it says nothing about the strain of {name}: "
        f"{lacks}; identify the tire from straight runs with `tirelib identify`, or add them"
    )


def check_quantity(quantity: str | None) -> None:
    """Raise ParameterError if there is no such quantity."""
    if quantity is not None and quantity not in QUANTITIES:
        raise ParameterError(
            f"--quantity {quantity}: allowed are {', '.join(QUANTITIES)}; correct the name"
        )


def _catalogue(effects: "Mapping[str, Effect] | None") -> "Mapping[str, Effect]":
    from tirelib.effects import CATALOGUE

    return CATALOGUE if effects is None else effects
