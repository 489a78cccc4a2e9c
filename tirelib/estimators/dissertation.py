"""The dissertation's own regressions (section 4.1), by ordinary least squares.

They are always fitted and reported beside the estimators in use, so that a reader sees what each
step away from them brings. Lengths in mm, strains in microstrain, forces in N and angles in
degrees, as in Tables 4-1 and 4-2, so that coefficients can be compared; axes are ISO 8855.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.folds import held_out_folds
from tirelib.estimators.least_squares import least_squares
from tirelib.measured.features.extract import Features
from tirelib.measured.features.table import rate_slope


@dataclass(frozen=True, slots=True)
class TermStatistics:
    """One row of a regression table."""

    name: str
    coefficient: float
    std_error: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Regression:
    """An ordinary least-squares regression with its statistics.

    Attributes
    ----------
    name, source, quantity, unit : str
        What it is, where it stands, what it predicts.
    terms : tuple of TermStatistics
        The constant first.
    r2, rmse, cross_validated : float
        Coefficient of determination; residual and held-out error (leave one condition out), in
        `unit`.
    measured, fitted : arrays, shape (n,), in `unit`
    regressor : array, shape (n,)
        The first regressor, for plots.
    rows : array of bool, shape (n_units,)
        Which of the independent measurements were used.
    """

    name: str
    source: str
    quantity: str
    unit: str
    terms: tuple[TermStatistics, ...]
    r2: float
    rmse: float
    cross_validated: float
    measured: FloatArray
    fitted: FloatArray
    regressor: FloatArray
    rows: BoolArray = field(repr=False)


@dataclass(frozen=True, slots=True)
class Means:
    """Means over the usable turns of each independent measurement, in the units of the tables.

    `contact_length`, `cp1` and `rate_lead` have shape (n, n_gages); the rest (n,).
    """

    lateral: FloatArray
    contact_length: FloatArray
    cp1: FloatArray
    rate_lead: FloatArray
    rate_slope: FloatArray
    slip_ratio: FloatArray
    load: FloatArray
    lateral_force: FloatArray
    slip_angle: FloatArray
    camber: FloatArray
    groups: IntArray


def means_for_tables(
    features: Features,
    radius: FloatArray,
    truth: dict[str, FloatArray],
    groups: IntArray,
    average: Callable[[FloatArray], FloatArray],
) -> Means:
    """Average what the regressions need.

    Parameters
    ----------
    features : Features
    radius : array, shape (n_turns,), [m]
        Effective rolling radius of each turn.
    truth : dict of arrays, shape (n,), SI, ISO
    groups : array, shape (n,)
    average : callable
        Mean over the usable turns of each independent measurement.
    """
    length = features.contact_angle * radius[:, None]

    def by_gage(values: FloatArray, factor: float) -> FloatArray:
        return np.stack([average(column) for column in values.T], axis=1) * factor

    return Means(
        lateral=features.lateral,
        contact_length=by_gage(length, 1e3),
        cp1=by_gage(features.cp1, 1e6),
        rate_lead=by_gage(features.rate_lead, 1.0),
        rate_slope=average(rate_slope(features)),
        load=truth["Fz"],
        lateral_force=truth["Fy"],
        slip_angle=np.rad2deg(truth["slip_angle"]),
        camber=np.rad2deg(average(features.camber)),
        slip_ratio=truth["slip_ratio"],
        groups=groups,
    )


def fit_all(means: Means) -> tuple[tuple[Regression, ...], dict[str, str]]:
    """Fit every regression of section 4.1 that the data can inform; say why not the others.

    Returns
    -------
    regressions : tuple of Regression
    skipped : dict of str to str
        Name of each regression that was left out, and the reason.
    """
    order = np.argsort(means.lateral)
    near = np.sort(np.argsort(np.abs(means.lateral), kind="stable")[:3])
    near = near[np.argsort(means.lateral[near])]
    right, centre, left = (int(i) for i in near)
    label = [f"y={1e3 * means.lateral[i]:+.0f}mm" for i in range(order.size)]
    length, peak, rate = means.contact_length, means.cp1, means.rate_lead
    lengths = {f"CL@{label[i]}": length[:, i] for i in (right, centre, left)}
    peaks = {f"CP1@{label[i]}": peak[:, i] for i in (right, centre, left)}
    made: list[Regression] = []
    skipped: dict[str, str] = {}

    def add(
        name: str,
        source: str,
        quantity: str,
        unit: str,
        y: FloatArray,
        columns: dict[str, FloatArray],
        rows: BoolArray | None = None,
    ) -> None:
        try:
            made.append(_fit(name, source, quantity, unit, y, columns, means.groups, rows))
        except CalibrationError as error:
            skipped[name] = str(error)

    plain = ~(np.abs(means.camber) > UPRIGHT) & ~(np.abs(means.slip_ratio) > FREE)
    middle = length[:, centre]
    add(
        "load from centre contact length",
        "Fig. 4-4",
        "Fz",
        "N",
        means.load,
        {"CL@centre": middle, "CL@centre^2": middle**2},
        plain,
    )
    ratio = rate[:, right] / rate[:, left]
    small = plain & (np.abs(means.slip_angle) <= SMALL_ANGLE)
    add(
        "slip angle from in/out ratio of peak rates",
        "Fig. 4-5",
        "alpha",
        "deg",
        means.slip_angle,
        {"ratio": ratio, "ratio^2": ratio**2},
        small,
    )
    add(
        "slip angle from slope of peak rates",
        "Fig. 4-7",
        "alpha",
        "deg",
        means.slip_angle,
        {"slope": means.rate_slope},
        small,
    )
    force = means.lateral_force
    add("Fy from six regressors", "Table 4-1", "Fy", "N", force, lengths | peaks, small)
    add("Fy from three contact lengths", "section 4.1.4", "Fy", "N", force, lengths, small)
    add("Fy from three compressive peaks", "section 4.1.4", "Fy", "N", force, peaks, small)
    levels = np.unique(np.round(means.camber[np.isfinite(means.camber)]))
    if levels.size > 1:
        for level in levels:
            rows = (np.round(means.camber) == level) & ~(np.abs(means.slip_ratio) > FREE)
            add(
                f"Fy from six regressors, camber {level + 0.0:+.0f} deg",
                "Table 4-2",
                "Fy",
                "N",
                force,
                lengths | peaks,
                rows,
            )
    return tuple(made), skipped


SMALL_ANGLE = 5.5
"""Slip angle, [deg], up to which the dissertation regresses (test set 1)."""
LEAST_RANGE = {"Fz": 300.0, "alpha": 0.5, "Fy": 100.0}
"""Range, in the unit of the tables, that a quantity must cover."""
STANDS_STILL = 1e-6
"""Relative range below which a regressor does not vary."""
UPRIGHT = 0.5
"""Camber, [deg], above which a run belongs to Table 4-2 and not to the other regressions."""
FREE = 0.02
"""Slip ratio above which a run belongs to none of them."""


def _fit(
    name: str,
    source: str,
    quantity: str,
    unit: str,
    y: FloatArray,
    columns: dict[str, FloatArray],
    groups: IntArray,
    rows: BoolArray | None,
) -> Regression:
    """Fit one regression; an error where the data hold too little or no variation."""
    x = np.stack(list(columns.values()), axis=1)
    use = np.isfinite(x).all(axis=1) & np.isfinite(y)
    use &= np.ones(y.size, dtype=np.bool_) if rows is None else rows
    x, y, groups = x[use], y[use], groups[use]
    conditions = np.unique(groups).size
    if conditions < x.shape[1] + 2:
        raise CalibrationError(
            f"{conditions} conditions for {x.shape[1] + 1} coefficients; "
            f"at least {x.shape[1] + 2} are needed"
        )
    if np.ptp(y) < LEAST_RANGE[quantity]:
        raise CalibrationError(
            f"{quantity} varies by {np.ptp(y):.3g} {unit} only; "
            f"at least {LEAST_RANGE[quantity]:g} {unit} are needed"
        )
    for column, values in zip(columns, x.T, strict=True):
        if np.ptp(values) < STANDS_STILL * np.abs(values).max():
            raise CalibrationError(
                f"regressor {column} is {values.mean():.4g} in every run; "
                "a regression needs variation"
            )
    design = np.column_stack((np.ones(y.size), x))
    result = least_squares(design, y)
    held_out = np.empty_like(y)
    for test in held_out_folds(groups):
        held_out[test] = design[test] @ (np.linalg.pinv(design[~test]) @ y[~test])
    terms = tuple(
        TermStatistics(term, float(b), float(e), float(p))
        for term, b, e, p in zip(
            ["constant", *columns],
            result.coefficients,
            result.std_errors,
            result.p_values,
            strict=True,
        )
    )
    return Regression(
        name=name,
        source=source,
        quantity=quantity,
        unit=unit,
        terms=terms,
        r2=result.r2,
        rmse=float(np.sqrt(np.mean((y - result.fitted) ** 2))),
        cross_validated=float(np.sqrt(np.mean((y - held_out) ** 2))),
        measured=y,
        fitted=result.fitted,
        regressor=x[:, 0],
        rows=use,
    )
