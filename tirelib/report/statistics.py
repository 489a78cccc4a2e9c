"""Statistics of a calibration as tables: the dissertation's regressions and those in use."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tirelib.core.arrays import r_squared
from tirelib.estimators.dissertation import Regression
from tirelib.estimators.polynomial import Polynomial
from tirelib.estimators.train import Trained
from tirelib.report.accuracy import SAID
from tirelib.report.figures.lateral_force import SMALL_ANGLE
from tirelib.report.figures.regression import in_use, known_rms
from tirelib.report.page import DASH, Table, number, p_value

REGRESSOR_UNIT = {
    "contact_angle": "rad",
    "angle_slope": "rad",
    "load": "N",
    "pressure": "Pa",
    "speed_squared": "m2/s2",
    "camber": "rad",
}
"""SI units of regressors; the others are ratios."""


def regression_tables(regressions: Sequence[Regression]) -> list[Table]:
    """Return Table 4-1 of every regression, and the cambers side by side as in Table 4-2."""
    single = [r for r in regressions if r.source != "Table 4-2"]
    cambers = [r for r in regressions if r.source == "Table 4-2"]
    tables = [_one_regression(regression) for regression in single]
    return [*tables, _side_by_side(cambers)] if cambers else tables


def _summary(regression: Regression) -> str:
    return (
        f"R\u00b2 = {100.0 * regression.r2:.2f} %, rmse = {number(regression.rmse)} "
        f"{regression.unit}, cross-validated = {number(regression.cross_validated)} "
        f"{regression.unit}, n = {regression.measured.size}"
    )


def _one_regression(regression: Regression) -> Table:
    return Table.of(
        f"{regression.name} ({regression.source})",
        regression.terms,
        {
            "term": lambda term: term.name,
            "coefficient": lambda term: number(term.coefficient, 5),
            "std error": lambda term: number(term.std_error, 3),
            "p value": lambda term: p_value(term.p_value),
        },
        note=_summary(regression),
    )


def _side_by_side(regressions: Sequence[Regression]) -> Table:
    """Coefficients and p-values of the same terms at several cambers."""
    levels = [regression.name.split("camber ")[-1] for regression in regressions]
    levels = ["0 deg" if level in ("-0 deg", "+0 deg") else level for level in levels]
    whats = ("coefficient", "std error", "p value")
    rows = [
        [terms[0].name]
        + [number(t.coefficient, 5) for t in terms]
        + [number(t.std_error, 3) for t in terms]
        + [p_value(t.p_value) for t in terms]
        for terms in zip(*(regression.terms for regression in regressions), strict=True)
    ]
    said = (f"{level}: {_summary(r)}" for level, r in zip(levels, regressions, strict=True))
    return Table(
        "Fy from six regressors at each camber (Table 4-2)",
        ["term", *(f"{what}, {level}" for what in whats for level in levels)],
        rows,
        note="; ".join(said),
    )


def in_use_table(trained: Trained) -> Table:
    """Return one row per quantity: held-out error, R2, terms, and the dissertation's beside it."""
    rows = []
    angle = trained.links.truth["slip_angle"]
    for quantity, model in trained.calibration.chains[-1].polynomials.items():
        held = in_use(trained, quantity)
        if held is None:
            continue
        measured, error = held[0], held[0] - held[1]
        small = error[np.abs(np.rad2deg(angle)) <= SMALL_ANGLE] if quantity == "alpha" else None
        old = [
            r.cross_validated
            for r in trained.regressions
            if r.quantity == quantity and r.source != "Table 4-2"
        ]
        rows.append(
            {
                "quantity": SAID[quantity].title,
                "unit": SAID[quantity].unit,
                "held out": number(known_rms(error)),
                f"up to {SMALL_ANGLE} deg": DASH if small is None else number(known_rms(small)),
                "dissertation, held out": number(min(old)) if old else DASH,
                "R\u00b2": f"{r_squared(measured, error):.5f}",
                "measurements": str(error.size),
                "terms": str(len(model.terms)),
            }
        )
    return Table(
        "Estimators in use: errors at held-out conditions",
        [*rows[0]] if rows else ["quantity"],
        [[*row.values()] for row in rows],
        texts=2,
        note="Held out: each condition in turn is left out of the fit and then estimated. The "
        "dissertation's column is the best of its own regressions of the quantity, on the same "
        f"data up to {SMALL_ANGLE} deg of slip angle.",
    )


def estimator_tables(trained: Trained) -> list[Table]:
    """Return coefficients, regressors and candidates of every estimator in use, folded."""
    return [
        table
        for quantity, model in trained.calibration.chains[-1].polynomials.items()
        for table in (
            _coefficients(quantity, model),
            _regressors(trained, quantity, model),
            _candidates(trained, quantity, model),
        )
    ]


def _name(quantity: str) -> tuple[str, str, float]:
    """Return name, unit and factor from SI of what the polynomial of a quantity gives."""
    if quantity == "kappa":
        return "effective rolling radius (for the slip ratio)", "mm", 1e3
    return SAID[quantity].title, SAID[quantity].unit, float(SAID[quantity].told(1.0))


def _coefficients(quantity: str, model: Polynomial) -> Table:
    name, unit, factor = _name(quantity)
    std = np.sqrt(np.diag(model.covariance))
    return Table(
        f"{name}: {len(model.terms)} terms",
        ("term", f"coefficient [{unit}]", f"std [{unit}]"),
        [
            (term, number(factor * b, 5), number(factor * s, 3))
            for term, b, s in zip(model.names(), model.coefficients, std, strict=True)
        ],
        note=f"Regressors are standardised, (x {DASH} centre) / scale. Residual of the "
        f"polynomial: {number(factor * model.residual)} {unit}; scatter of one turn about the "
        f"mean of its run: {number(factor * model.floor)} {unit}.",
        folded=True,
    )


def _regressors(trained: Trained, quantity: str, model: Polynomial) -> Table:
    scales = {v.name: (number(v.centre, 5), number(v.scale, 5)) for v in model.variables}
    limits = {
        guard.name: (number(guard.low - guard.slack), number(guard.high + guard.slack))
        for guard in trained.calibration.chains[-1].guards.get(quantity, ())
    }
    return Table(
        f"{_name(quantity)[0]}: regressors and their valid ranges",
        ("regressor", "SI unit", "centre", "scale", "valid from", "to"),
        [
            (
                name,
                REGRESSOR_UNIT.get(name, "1"),
                *scales.get(name, (DASH, DASH)),
                *limits.get(name, ("", "")),
            )
            for name in scales | limits
        ],
        texts=2,
        folded=True,
    )


def _candidates(trained: Trained, quantity: str, model: Polynomial) -> Table:
    tried, count = trained.links.candidates[quantity], len(model.terms)
    name, unit, factor = _name(quantity)
    best = min((score for terms, score in tried if terms == count), default=float("nan"))
    note = "The error is weighted: it counts less where the cornering curve is flat."
    return Table.of(
        f"{name}: candidate estimators",
        tried,
        {
            "terms": lambda each: str(each[0]),
            f"held-out error [{unit}{' of radius' if quantity == 'kappa' else ''}]": (
                lambda each: number(factor * each[1])
            ),
            "": lambda each: "in use" if each == (count, best) else "",
        },
        texts=0,
        note=note if quantity == "alpha" else "",
        folded=True,
    )


def held_out_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Return the cross-validation by level: each level of a condition left out of the fit."""
    where = {True: "between others", False: "beyond others", None: ""}
    return Table.of(
        "Error at a held-out level",
        rows,
        {
            "held out": lambda row: str(row["held_out"]).replace("_", " "),
            "level": lambda row: str(row["level"]),
            "quantity": lambda row: SAID[str(row["quantity"])].title,
            "unit": lambda row: str(row["unit"]),
            "where": lambda row: where[row.get("inside")],
            "runs": lambda row: str(row.get("n", "")),
            "dissertation": lambda row: number(row["dissertation"]),
            "in use": lambda row: number(row["in_use"]),
            "in range": lambda row: f"{row['in_range']:.0%}" if "in_range" in row else DASH,
            "in use, in range": lambda row: number(row.get("in_use_in_range")),
        },
        texts=5,
        note="A level beyond the others is an extrapolation. Errors are root mean squares over "
        "run means. Turns outside the calibrated range are flagged; the last column holds the "
        "turns inside it.",
    )


def refused_table(trained: Trained) -> Table:
    """Return the quantities that could not be calibrated, and why."""
    return Table(
        "Quantities without a calibration",
        ("quantity", "why"),
        [(SAID[q].title, why) for q, why in trained.links.refused.items()],
        texts=2,
    )
