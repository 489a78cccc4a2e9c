"""Estimates as a document (``tirelib-estimate/1``): every turn, and how far the rig agrees.

Units at this edge are what engineers say: N and deg. Axes are ISO 8855.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.flags import TurnFlag, flag_names
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.chain import Chain
from tirelib.estimators.costs import COLUMN, Cost
from tirelib.estimators.edge import EDGE_UNIT, FORMAT, VARIED
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.estimators.likeness import suspected
from tirelib.measured.features.extract import Features
from tirelib.measured.observations import Observations, mean_by

TRUTH = {"Fz": "Fz", "alpha": "slip_angle", "kappa": "slip_ratio", "Fy": "Fy"}


def estimate_document(
    observations: Observations,
    estimates: Estimates,
    calibration: Calibration,
    costs: Sequence[Cost] = (),
) -> dict[str, Any]:
    """Return summary and turns; errors are of the mean of a run's valid turns.

    `costs` says what conditions that nobody gave cost.
    """
    chain = calibration.chains[-1]
    return {
        "format": FORMAT,
        "axes": "iso",
        "tire": calibration.tire,
        "other_tire": other_tire(estimates) if calibration.knows_tire else None,
        "not_given": cost_rows(costs),
        "summary": {
            quantity: _summary(quantity, observations, estimates, _floor(chain, quantity))
            if chain.has(quantity)
            else None
            for quantity in QUANTITIES
        },
        "turns": [
            turn_row(row, int(run), observations.features, estimates)
            for row, run in enumerate(observations.run)
        ],
    }


def other_tire(estimates: Estimates) -> dict[str, Any]:
    """Return how many turns in range show another tire's strain, and whether that is no chance.

    `extrapolated` counts the turns in range at a pressure or speed that was not calibrated: there
    the doubt of how the strain shifts with both hides most other tires.
    """
    unlike = (estimates.flags & int(TurnFlag.OTHER_TIRE)) != 0
    in_range = estimates.turn_valid | unlike
    judged, turns = int(in_range.sum()), int(unlike.sum())
    away = [
        "condition_extrapolated" in notes
        for notes, use in zip(estimates.notes, in_range, strict=True)
        if use
    ]
    return {
        "turns": turns,
        "judged": judged,
        "suspected": suspected(turns, judged),
        "extrapolated": sum(away),
    }


def cost_rows(costs: Sequence[Cost]) -> list[dict[str, Any]]:
    """Return what unknown conditions cost in the units of the document, the dearest first."""
    rows = []
    for cost in costs:
        unit, factor = EDGE_UNIT[cost.quantity]
        rows.append(
            {
                "condition": cost.unknown,
                "column": COLUMN[cost.unknown],
                "quantity": cost.quantity,
                "unit": unit,
                "std": _number(factor * cost.std),
                "std_if_given": _number(factor * cost.std_if_given),
                "valid": cost.valid,
                "valid_if_given": cost.valid_if_given,
            }
        )
    return rows


def run_means(
    quantity: str, observations: Observations, estimates: Estimates, floor: float = 0.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return estimate, standard deviation and measurement of each run, SI, over its valid turns.

    `floor` is the standard deviation of a single turn about the mean of its run; of the mean of n
    turns it is 1/sqrt(n) of that.
    """
    truth = observations.truth[TRUTH[quantity]]
    good = estimates.valid[quantity] & np.isfinite(estimates.value[quantity])
    unit = observations.unit
    turns = np.bincount(unit[good])
    turns = turns[turns > 0]
    variance = mean_by(unit, estimates.std[quantity] ** 2, good) - floor**2 * (1.0 - 1.0 / turns)
    return (
        mean_by(unit, estimates.value[quantity], good),
        np.sqrt(np.maximum(variance, 0.0)),
        mean_by(unit, truth, good),
    )


def _floor(chain: Chain, quantity: str) -> float:
    """Return the scatter of a single turn about the mean of its run, SI."""
    model = {"Fz": chain.load, "Fy": chain.force}.get(quantity)
    return 0.0 if model is None else model.floor


def _summary(
    quantity: str, observations: Observations, estimates: Estimates, floor: float
) -> dict[str, Any]:
    unit, factor = EDGE_UNIT[quantity]
    value, std, truth = (x * factor for x in run_means(quantity, observations, estimates, floor))
    known = np.isfinite(truth)
    value, std, truth = value[known], std[known], truth[known]
    empty = {
        "rmse": None,
        "unit": unit,
        "r2": None,
        "n": 0,
        "rmse_percent_of_range": None,
        "coverage_95": None,
        "bias": None,
    }
    if value.size == 0:
        return empty
    error = value - truth
    rmse = float(np.sqrt(np.mean(error**2)))
    spread = float(np.sum((truth - truth.mean()) ** 2))
    span = float(np.ptp(truth))
    varied = span > VARIED[quantity]
    return {
        "rmse": rmse,
        "unit": unit,
        "r2": 1.0 - float(np.sum(error**2)) / spread if varied else None,
        "n": int(value.size),
        "rmse_percent_of_range": 100.0 * rmse / span if varied else None,
        "coverage_95": float(np.mean(np.abs(error) <= 1.96 * std)),
        "bias": float(error.mean()),
    }


def turn_row(row: int, run: int, features: Features, estimates: Estimates) -> dict[str, Any]:
    """Return one turn of the document."""
    turn: dict[str, Any] = {
        "run": run,
        "t": _number(features.time[row]),
        "ready": _number(features.ready[row]),
    }
    for quantity in QUANTITIES:
        factor = EDGE_UNIT[quantity][1]
        turn[quantity] = _number(estimates.value[quantity][row] * factor)
        turn[f"{quantity}_std"] = _number(estimates.std[quantity][row] * factor)
        turn[f"{quantity}_valid"] = bool(estimates.valid[quantity][row])
    for gage in range(estimates.contact_length.shape[1]):
        turn[f"contact_length_{gage + 1}_mm"] = _number(1e3 * estimates.contact_length[row, gage])
        turn[f"contact_length_{gage + 1}_std_mm"] = _number(
            1e3 * estimates.contact_length_std[row, gage]
        )
    turn["omega_rad_s"] = _number(features.omega[row])
    turn["rolling"] = estimates.rolling[row]
    turn["valid"] = bool(estimates.turn_valid[row])
    turn["flags"] = [*flag_names(int(estimates.flags[row])), *estimates.notes[row]]
    return turn


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
