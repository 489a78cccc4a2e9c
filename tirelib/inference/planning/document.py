"""The next test as JSON, and in words."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.quantities import QUANTITIES
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.diagnose.diagnose import FALSE_ALARM
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.forces.models import plain_tires
from tirelib.inference.diagnose.strain_models import problem_of
from tirelib.inference.planning.envelope import AXES, Envelope
from tirelib.inference.planning.next_test import (
    ENDLESS,
    NOTHING,
    WANTED,
    NextTest,
    PairForecast,
    gains,
    next_test,
)
from tirelib.inference.planning.suspects import Suspects, suspects_of
from tirelib.inference.statistics.hypotheses import Hypotheses

FORMAT = "tirelib-next-test/1"
PROMISING = 0.5
"""Chance of ruling a suspect out below which a run is not advised without a warning, and from which
a plan that is measured again shows an effect."""
NONE = "nothing is in doubt: this campaign leaves no effects that have to be distinguished"
STRUCTURE = "what plain tires show in addition to the model"
"""What hides effects and does not average out."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A next test with what it is for.

    Attributes
    ----------
    test : NextTest or None
        None where nothing is in doubt.
    gains : mapping
        Chance that repeating the plan shows weak effects, by times
        (`tirelib.inference.planning.next_test.gains`).
    wanted : float
        Separation asked for.
    quantity : str
        strain, or the force.
    """

    suspects: Suspects
    test: NextTest | None
    gains: Mapping[str, Mapping[float, float]]
    wanted: float
    campaign: str
    quantity: str = "strain"


def plan_test(
    hypotheses: Hypotheses | None,
    suspects: Suspects,
    envelope: Envelope | None,
    *,
    campaign: str,
    quantity: str = "strain",
    model: ForceModel | None = None,
    wanted: float = WANTED,
    progress: Callable[[str], None] | None,
) -> Plan:
    """Judge the runs of an envelope for suspects.

    Hypotheses are about the present runs; they and the envelope are needed if there are suspects,
    and for a force its model. `wanted` is the separation for which repeats are counted.

    Raises
    ------
    ParameterError
        If no run in the envelope has a solution.
    """
    if not suspects.names or hypotheses is None or envelope is None:
        return Plan(suspects, None, {}, wanted, campaign, quantity)
    test = next_test(hypotheses, suspects, envelope, model=model, progress=progress)
    again = gains(hypotheses, suspects, test)
    return Plan(suspects, test, again, wanted, campaign, quantity)


def plan_force_test(
    case: ForceCase,
    suspects: Suspects,
    envelope: Envelope | None,
    catalogue: Sequence[Effect] = tuple(CATALOGUE.values()),
    *,
    false_alarm: float = FALSE_ALARM,
    wanted: float = WANTED,
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """Judge further runs of a force for suspects: points, or sweeps; errors as of `plan_test`.

    The envelope is the one of `tirelib.inference.planning.force_runs.force_envelope`. Suspects are
    held against the catalogue.
    """
    among = None
    if suspects.names:
        given = case.as_given(catalogue)
        among = Hypotheses(given, plain_tires(case.quantity), false_alarm, progress)
    return plan_test(
        among,
        suspects,
        envelope,
        campaign=case.name,
        quantity=case.quantity,
        model=case.model,
        wanted=wanted,
        progress=progress,
    )


def next_test_document(
    told: Mapping[str, Any],
    hypotheses: Hypotheses,
    catalogue: Mapping[str, Effect],
    *,
    progress: Callable[[str], None],
) -> dict[str, Any]:
    """Return the next test for a diagnosis of strain, as ``tirelib-next-test/1``.

    Parameters
    ----------
    told : mapping
        The diagnosis as JSON.
    hypotheses : Hypotheses
        Hypotheses of the diagnosis.

    Raises
    ------
    TirelibError
        As `plan_test`; and if the campaign does not give its speed.
    """
    suspects, campaign = suspects_of(told, catalogue), str(told.get("campaign", ""))
    envelope = Envelope.of(problem_of(hypotheses).data.points) if suspects.names else None
    plan = plan_test(hypotheses, suspects, envelope, campaign=campaign, progress=progress)
    return plan_document(plan)


def plan_document(plan: Plan) -> dict[str, Any]:
    """Return a plan as ``tirelib-next-test/1``: N, bar, km/h, microstrain."""
    test, said = plan.test, advice(plan)
    head = {
        "format": FORMAT,
        "campaign": plan.campaign,
        "axes": "iso",
        "quantity": plan.quantity,
        "what": said,
        "message": said,
        "between": list(plan.suspects.names),
        "why": plan.suspects.why,
    }
    if test is None or not len(test.points):
        return head | {
            "suspects": [],
            "left_out": dict(test.left_out) if test else {},
            "present": [],
            "candidates": [],
            **dict.fromkeys(("best", "random_median", "repeats", "envelope")),
            "dropped": 0,
        }
    candidates = [_candidate(test, k) for k in range(len(test.points))]
    return head | {
        "suspects": [
            {
                "effect": rival.name,
                "strength": rival.strength.tolist(),
                "chi_square": rival.cost,
                "in_range": rival.in_range,
            }
            for rival in test.rivals
        ],
        "left_out": dict(test.left_out),
        "present": [_present(pair) for pair in test.pairs],
        "candidates": candidates,
        "best": candidates[0],
        "random_median": {
            "separation": float(np.median(test.score)),
            "resolves_probability": _known(float(np.mean(test.probability))),
        },
        "repeats": _repeats(plan, test),
        "envelope": _envelope(test.envelope),
        "dropped": test.dropped,
        **_noise(plan, test),
        "misfit_size": test.size,
    }


def _noise(plan: Plan, test: NextTest) -> dict[str, Any]:
    if plan.quantity == "strain":
        return {"noise_ustrain": {"random": 1e6 * test.random, "structural": 1e6 * test.staying}}
    unit = QUANTITIES[plan.quantity].unit
    return {"noise": {"random": test.random, "structural": test.staying, "unit": unit}}


def _candidate(test: NextTest, k: int) -> dict[str, Any]:
    conditions = zip(test.envelope.names, test.points[k], strict=True)
    return {
        **{AXES[name].key: float(QUANTITIES[name].told(value)) for name, value in conditions},
        **_slips(test.envelope),
        "separation": float(test.score[k]),
        "separation_std": float(test.std[k]),
        "resolves_probability": _known(float(test.probability[k])),
        "pair": list(test.pairs[test.hardest[k]].names),
    }


def _known(chance: float) -> float | None:
    """Return a chance; None where both suspects are out of the confidence set already."""
    return chance if np.isfinite(chance) else None


def _slips(envelope: Envelope) -> dict[str, Any]:
    """Return the slips of a run that is a sweep; the key of a single one is null then."""
    if envelope.sweep is None:
        return {}
    axis = AXES[envelope.sweep.name]
    told = [float(axis.quantity.told(value)) for value in envelope.sweep.values]
    return {axis.key: None, axis.series: told}


def _present(pair: PairForecast) -> dict[str, Any]:
    return {
        "pair": list(pair.names),
        "gap": pair.gap,
        "better": pair.better,
        "resolved": pair.resolved,
        "best_run_separation": float(pair.separation[0]),
        "best_run_probability": _known(float(pair.probability[0])),
    }


def _repeats(plan: Plan, test: NextTest) -> dict[str, Any]:
    pair = test.pairs[test.hardest[0]]
    return {
        "wanted_separation": plan.wanted,
        "of_best": pair.needed(plan.wanted),
        "limit": pair.limit,
        "separation": {str(n): reached for n, reached in pair.repeats.items()},
        "of_plan": {
            name: {"times": _times(by), "gain_now": by[1], "gain_limit": by[ENDLESS]}
            for name, by in plan.gains.items()
        },
    }


def _envelope(envelope: Envelope) -> dict[str, Any]:
    told = {
        AXES[name].key: [float(QUANTITIES[name].told(x)) for x in ends]
        for name, ends in envelope.ranges.items()
    }
    free = [name for name in envelope.names if name not in envelope.declared]
    if envelope.sweep is not None:
        axis, values = AXES[envelope.sweep.name], envelope.sweep.values
        told[axis.key] = [float(axis.quantity.told(x)) for x in (values.min(), values.max())]
    return {
        **told,
        "declared": list(envelope.declared),
        "widened_percent": {name: 100.0 * AXES[name].wider for name in free},
        "levels": {name: envelope.levels.get(name, AXES[name].levels) for name in envelope.names},
        "points_of_run": envelope.points,
    }


def advice(plan: Plan) -> str:
    """Say what to measure next, and what it is worth."""
    test = plan.test
    if test is None:
        return NONE
    if not len(test.points):
        left = "; ".join(f"{name}: {why}" for name, why in test.left_out.items())
        return f"fewer than two suspects could be fitted, so nothing can be compared ({left})"
    sentences = [_said(pair) for pair in test.pairs if pair.resolved]
    if test.open_pairs:
        sentences.append(_advised(plan, test))
    sentences += _weak(plan)
    return "; ".join(sentences)


def _said(pair: PairForecast) -> str:
    worse = pair.names[1] if pair.better == pair.names[0] else pair.names[0]
    return (
        f"the present runs already distinguish {pair.better} from {worse} "
        f"(chi-square {abs(pair.gap):.0f})"
    )


def _advised(plan: Plan, test: NextTest) -> str:
    if test.hopeless:
        return "; ".join(
            f"No run of this envelope separates {_between(pair)} (separation at most "
            f"{float(np.max(pair.separation)):.1f} in chi-square)"
            for pair in test.open_pairs
        )
    best, chance = test.points[0], float(test.probability[0])
    pair = test.pairs[test.hardest[0]]
    where, between = test.envelope.text(best), _between(pair)
    if not np.isfinite(chance):
        text = (
            f"measure {where}: it separates {between} best (chi-square "
            f"{float(test.score[0]):.1f}); the present runs reject both as they stand, so no "
            "chance is given"
        )
    elif chance < PROMISING:
        text = (
            f"no run in the envelope is likely to separate {between}: the best, {where}, does with "
            f"a chance of {100 * chance:.0f} %"
        )
    else:
        text = (
            f"measure {where}: it separates {between} with a chance of {100 * chance:.0f} % (any "
            f"run of the envelope: {100 * float(test.probability.mean()):.0f} %)"
        )
    needed = pair.needed(plan.wanted)
    if needed is None and pair.limit < plan.wanted:
        text += (
            f"; {STRUCTURE} limits its separation to {pair.limit:.0f}, repeats do "
            "not help: widen the envelope"
        )
    elif needed is not None and needed > 1:
        text += f"; {needed} repeats of it reach a separation of {plan.wanted:.0f}"
    return text


def _between(pair: PairForecast) -> str:
    return " and ".join(name.replace(NOTHING, "no effect") for name in pair.names)


def _weak(plan: Plan) -> list[str]:
    """Say what repeating the whole plan would do for hints."""
    said = []
    for name, by in plan.gains.items():
        times = _times(by)
        if times == 1:
            said.append(
                f"the present plan should show {name} at this strength already "
                f"({_chance(by[1])}), so repeats of it would add little"
            )
        elif times is not None:
            said.append(
                f"{times} times the present plan might show {name}, or its absence: fewer will not"
            )
        else:
            said.append(
                f"repeats of the present plan will not show {name}: {STRUCTURE} limits it to "
                f"{_chance(by[ENDLESS])}, and {_chance(PROMISING)} is needed"
            )
    return said


def _times(by: Mapping[float, float]) -> int | None:
    """Return how often the plan has to be measured to show an effect."""
    return next((int(n) for n, x in by.items() if n < ENDLESS and x >= PROMISING), None)


def _chance(size: float) -> str:
    return f"a chance of {100.0 * size:.0f} %"
