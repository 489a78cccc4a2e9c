"""A diagnosis with what its reader needs: floor, held-out errors, what is left; as JSON."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.core.errors import TirelibError
from tirelib.inference.compare.error import NOISE, ModelError, named_errors
from tirelib.inference.compare.model import TireModel
from tirelib.inference.diagnose.diagnose import Diagnosis, Finding
from tirelib.inference.diagnose.fitted import Fitted
from tirelib.inference.diagnose.floor import floor_of
from tirelib.inference.diagnose.guess import Guess
from tirelib.inference.diagnose.left import Left, left_of, told_powers
from tirelib.inference.diagnose.told import Assessed, listed, next_step

NO_REPEATS = (
    "no runs were repeated at equal set points, so the noise is unknown: errors are in "
    "microstrain, no effect is named and none is more than a hint; repeat some runs"
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Assessment(Assessed):
    """What the document of a strain diagnosis holds; it has no folds if nothing is named.

    Attributes
    ----------
    given : TireModel
        The model that was diagnosed, as its file has it.
    before, refitted, after : ModelError
        Errors of the model as it is given, with the numbers of the least error, and with the named
        effects.
    left : Left
        What no effect explains.
    """

    diagnosis: Diagnosis
    given: TireModel
    before: ModelError
    refitted: ModelError
    after: ModelError
    left: Left

    def error_with(self, finding: Finding) -> float:
        """Return the error with one effect alone, to first order unless it is the one named."""
        if self.named == (finding.effect.name,):
            return self.after.value
        return self.refitted.value * float(np.sqrt(max(1.0 - finding.share, 0.0)))


def assess(found: Diagnosis, given: TireModel) -> Assessment:
    """Return a diagnosis with floor, held-out errors and what is left.

    Parameters
    ----------
    found : Diagnosis
    given : TireModel
        The model that was diagnosed, as its file has it.
    """
    models = found.models
    verdict, named, findings, messages = found.verdict.kind, found.named, found.findings, []
    if models.yardstick.unit != NOISE:
        verdict, named = "none", ()
        findings = tuple(_hint(finding) for finding in findings)
        messages.append(NO_REPEATS)
    final = found.final if named else found.base
    chosen = models.folds if named else ()
    singles = {name: one for name in named if (one := _with_one(found, name)) is not None}
    models.find(found.base, given, held=(found.base, *singles.values(), final) if chosen else ())
    before, refitted = models.least_error(found.base, given)
    after = final.reached if named else refitted
    floor = floor_of(after, found.verdict.best, found.verdict.alpha)
    if named and not chosen:
        messages.append(
            "nothing can be held out: three loads or two pressures, and four other runs, are needed"
        )
    messages += [
        _too_large(finding)
        for finding in findings
        if finding.effect.name in named and not finding.in_range
    ]
    return Assessment(
        diagnosis=found,
        verdict=verdict,
        named=named,
        findings=findings,
        floor=floor,
        folds=chosen,
        singles=singles,
        messages=tuple(messages),
        given=given,
        before=before,
        refitted=refitted,
        after=after,
        left=_left(found, final),
    )


def _too_large(finding: Finding) -> str:
    effect = finding.effect
    size = ", ".join(f"{x:.3g}" for x in finding.strength)
    return (
        f"{effect.name} explains it, but only at {size} {effect.unit}, and {effect.low:g} to "
        f"{effect.high:g} is plausible: it is larger than thought, or something of the same kind; "
        "measure it in another way before it is believed"
    )


def _hint(finding: Finding) -> Finding:
    return replace(finding, level="hint") if finding.level == "alarm" else finding


def _with_one(found: Diagnosis, name: str) -> Fitted | None:
    """Return the base model with one effect fitted, or None if that fails."""
    try:
        return found.models.at((name,))
    except TirelibError:
        return None


def diagnosis_document(told: Assessment) -> dict[str, Any]:
    """Return the numbers as ``tirelib-diagnosis/1``; strains in microstrain, angles in deg."""
    return {
        **told.shared,
        "campaign": told.diagnosis.runs.waves.header.name,
        "quantity": "strain",
        "unit": "ustrain",
        **named_errors(told.before, told.after),
        "error_refitted": told.refitted.value,
        "repeats": told.diagnosis.runs.noise.repeats,
        "delay_us": 1e6 * told.after.delay,
        "unexplained": _unexplained(told),
        "next_test": next_test(told),
    }


def _left(found: Diagnosis, final: Fitted) -> Left:
    """Return what is left; how it grows by the guessed law, where there is one."""
    points = found.problem.data.points
    if found.beyond is None:
        return left_of(final.reached, points)
    left = left_of(final.reached, points, found.beyond)
    if found.guess is None:
        return left
    powers = {**left.powers, **found.guess.powers}
    return replace(left, powers=powers, scaling=told_powers(powers))


def _unexplained(told: Assessment) -> dict[str, Any]:
    left, guess = told.left, told.diagnosis.guess
    if not told.diagnosis.exceeds:
        return {"where": None, "scaling": None, "guess": None}
    start, stop = np.rad2deg(left.span)
    return {
        "where": {
            "text": left.where,
            "from_deg": float(start),
            "to_deg": float(stop),
            "sectors": dict(left.sectors),
            "gages": _gages(told),
        },
        "scaling": {
            "text": left.scaling,
            **{
                name: None
                if power is None
                else {"exponent": power.value, "low": power.low, "high": power.high}
                for name, power in left.powers.items()
            },
        },
        "guess": None if guess is None else _guess(guess),
    }


def _gages(told: Assessment) -> list[dict[str, float]]:
    """Return the rms residual of each gage in use, in microstrain."""
    found = told.diagnosis
    waves = found.runs.waves
    out = []
    for gage in found.runs.gages:
        rest = told.after.prediction.strain - waves.strain[:, gage]
        out.append(
            {
                "lateral_mm": 1e3 * waves.header.gage_lateral[gage],
                "rms_ustrain": 1e6 * float(np.sqrt(np.mean(rest**2))),
            }
        )
    return out


def _guess(guess: Guess) -> dict[str, Any]:
    return {
        "law": guess.law,
        "explained_held_out": guess.explained,
        "terms": [
            {
                "shape": term.shape,
                "powers": dict(term.powers),
                "coefficient": 1e6 * term.coefficient,
                "std": 1e6 * term.std,
                "unit": "ustrain",
            }
            for term in guess.terms
        ],
        "note": "measured less model; a guess by sparse regression, kept on left-out conditions: "
        "where and how it grows is often right, the reason is not part of it",
    }


def _and(names: Sequence[str]) -> str:
    return listed(names, "load, pressure and speed")


def next_test(told: Assessment) -> dict[str, Any]:
    """Return what to do or to measure next, and why."""
    by_name = {finding.effect.name: finding.effect for finding in told.findings}
    varies = [set(by_name[name].varies_with) for name in told.named]
    every = {name for names in varies for name in names}
    common = {name for name in every if all(name in names for names in varies)}
    named = told.named

    def parting() -> str:
        differ = sorted(every - common) or sorted(every)
        return f"more levels of {_and(differ)}, to the ends that the rig allows: there " + (
            f"{_and(named)} part" if len(named) > 1 else "it shows"
        )

    words = {
        "indistinguishable": parting,
        "form_inadequate": lambda: (
            f"{_and(named)} is needed but its law does not fit: more levels of "
            f"{_and(sorted(every))} would show the right law"
        ),
        "unknown": lambda: (
            f"the misfit stands {told.left.where}; it {told.left.scaling}: more levels there, or "
            "an effect of your own (--effects)"
        ),
    }
    if not told.after.known:
        words["none"] = lambda: (
            "repeat some runs at equal set points, best at the ends of load, pressure and speed"
        )
    dead = told.diagnosis.dead.items()
    lacking = {name: reason for name, reason in dead if reason.startswith("no run has")}
    return next_step(told, words, lacking)
