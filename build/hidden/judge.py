"""What the library says of a case, and how that stands against the truth."""

import hashlib
import json
import time
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import tirelib
from hidden.cases import NONE, VERSION, Case, base_fit, case_file, fitted_data, residual
from hidden.measured import CACHE, keep
from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import candidates
from tirelib.diagnose.diagnose import Diagnosis, diagnose
from tirelib.diagnose.ensemble import MEMBERS
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import straight_runs
from tirelib.identify.identify import estimated
from tirelib.identify.random_effects import whitening
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import large_displacements, operating_points, predict
from tirelib.waveforms import Waveforms

BELT = frozenset({"belt_shear", "belt_extension"})
"""Right additions on a tire whose belt really shears and stretches; they may not hide another."""
HELD_OUT_BY = ("load", "pressure", "speed")
_CODE = {
    "diagnose": (
        "candidates",
        "diagnose",
        "ensemble",
        "fitter",
        "noise",
        "plain",
        "ranking",
        "refit",
        "rivals",
        "rounds",
        "secants",
        "shape",
        "shear",
        "spread",
        "stage",
        "structure",
        "unlisted",
        "variant",
    ),
    "identify": (
        "campaign_data",
        "delay",
        "discrepancy",
        "identify",
        "noise",
        "random_effects",
        "span",
        "structure",
        "waveform_fit",
    ),
    "effects": ("*",),
    "model": ("*",),
    "contact": ("*",),
    "ring": ("*",),
    "strain": ("*",),
}
"""Modules of the library that a verdict depends on."""


@lru_cache(maxsize=1)
def fingerprint() -> str:
    """Return a hash of the library's code that a verdict depends on."""
    digest, root = hashlib.sha256(), Path(tirelib.__file__).parent
    for part, names in _CODE.items():
        for name in names:
            for file in sorted((root / part).glob(f"{name}.py")):
                digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def verdict_file(case: Case, members: int) -> Path:
    """Return where a verdict is kept."""
    name = case_file(case.seed, case.kind, case.wanted).with_suffix(".json").name
    return CACHE / "verdicts" / f"{fingerprint()}-{members}-{VERSION}" / name


def judge(case: Case, members: int = MEMBERS) -> dict[str, Any]:
    """Return the verdict on a case as a document, from the cache if the code is the same."""
    file = verdict_file(case, members)
    if file.exists():
        stored: dict[str, Any] = json.loads(file.read_text())
        return stored
    began = time.process_time()
    try:
        made = _judged(case, members)
    except TirelibError as error:
        made = {"outcome": "failed", "error": str(error)}
    made |= {
        "seed": case.seed,
        "kind": case.kind,
        "wanted": case.wanted,
        "ratio": case.ratio,
        "white_ratio": case.white_ratio,
        "strength": dict(case.strength),
        "known": case.known,
        "seconds": time.process_time() - began,
    }
    keep(file, json.dumps(made, indent=1).encode())
    return made


def _judged(case: Case, members: int) -> dict[str, Any]:
    runs = straight_runs(case.waves.take(~case.held_out))
    _, fit, _ = estimated(runs)
    found = diagnose(runs, fit.values, list(CATALOGUE.values()), members=members)
    out: dict[str, Any] = {
        "outcome": outcome(case, found.verdict, found.named),
        "verdict": found.verdict,
        "named": list(found.named),
        "left_over_floor": found.left / found.floor,
        "leaders": [
            {
                "effect": f.effect.name,
                "level": f.level,
                "ratio": f.score / f.threshold,
                "share": f.share,
                "in_range": f.in_range,
                "strength": np.ravel(f.strength).tolist(),
            }
            for f in found.findings[:6]
        ],
    }
    if case.kind != NONE and case.known:
        out |= _addition(case, found)
    return out


def outcome(case: Case, verdict: str, named: Sequence[str]) -> str:
    """Return how a verdict stands against the truth."""
    truth = set(case.names)
    said = set(named) - (BELT - truth)
    if case.kind == NONE:
        return "alarm" if said or verdict == "unknown" else "quiet"
    if not case.known:
        if said:
            return "wrong"
        return "flagged" if verdict == "unknown" else "missed"
    if verdict == "indistinguishable" and len(truth) == 1 and truth <= said:
        return "twins"
    if said == truth:
        return "right"
    if said - truth:
        return "wrong"
    if said:
        return "partly"
    return "flagged" if verdict == "unknown" else "missed"


def _addition(case: Case, found: Diagnosis) -> dict[str, Any]:
    """Return errors before and after the right effects are added, and without them at all."""
    data = fitted_data(case.waves, case.held_out)
    model = found.base
    try:
        for name in case.names:
            model = _with(data, model, name)
    except TirelibError as error:
        return {"addition": str(error)}
    sheared = _with_shear(data, model)
    plain = base_fit(case.floor_waves, case.held_out, found.base)
    floor_data = fitted_data(case.floor_waves, case.held_out)
    held = [
        _held_out(case.waves, case, found.base),
        _held_out(case.waves, case, model),
        _held_out(case.floor_waves, case, plain),
    ]
    return {
        "addition": "done",
        "added_strength": [np.ravel(s).tolist() for s in model.strengths],
        "error": {
            "before": residual(data, found.base),
            "after": residual(data, model),
            "floor": residual(floor_data, plain),
            "with_shear": residual(data, sheared),
        },
        "white_error": {
            "before": found.base.error * data.noise,
            "after": model.error * data.noise,
            "floor": plain.error * floor_data.noise,
        },
        "held_out": {
            name: {"before": held[0][k], "after": held[1][k], "floor": held[2][k]}
            for k, name in enumerate(HELD_OUT_BY)
        },
    }


def _with_shear(data: Data, model: Refit) -> Refit:
    """Return a model with the belt's shear as well, if it takes any."""
    if "belt_shear" in [effect.name for effect in model.effects]:
        return model
    try:
        return _with(data, model, "belt_shear")
    except TirelibError:
        return model


def _with(data: Data, model: Refit, name: str) -> Refit:
    """Return a model with one effect more, everything fitted."""
    effect = CATALOGUE[name]
    living = candidates(data, model, [effect]).living
    if not living:
        raise TirelibError(f"{name} is dead")
    strength, _ = living[0].alone(data, model)
    start = np.clip(strength, 0.9 * effect.low, 0.9 * effect.high)
    return refit(
        data, model.values, [*model.effects, effect], [*model.strengths, start], delay=model.delay
    )


def _held_out(waves: Waveforms, case: Case, model: Refit) -> list[float]:
    """Return the residual of each held-out run, load, pressure and speed in this order.

    Rms of the residual as `tirelib.diagnose.held_out` counts it, with set-point errors discounted.
    """
    used = straight_runs(waves.take(~case.held_out))
    points = operating_points(waves)
    order = np.interp(waves.start, used.waves.start, operating_points(used.waves).order)
    points.order[:] = order
    out = points.take(case.held_out)
    correction = large_displacements(model.values, out, low_pass=waves.low_pass)
    wave = predict(
        model.values, out, model.changes, low_pass=waves.low_pass, correction=correction
    ).wave
    strain: FloatArray = waves.strain[case.held_out][:, used.gages].mean(axis=1)
    data = used.data(with_deflection=False)
    whiten = whitening(
        wave,
        model.values,
        out,
        data.tolerance,
        waves.angle_std[case.held_out],
        data.noise,
        waves.low_pass,
    )
    rms = data.noise * np.sqrt(np.mean(whiten(strain - wave) ** 2, axis=1))
    return [float(x) for x in rms[np.argsort(waves.group[case.held_out])]]
