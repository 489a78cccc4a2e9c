"""Calibrations as TOML files (``tirelib-calibration/2``): written once, read everywhere.

Version 1 knew nothing of friction and tread: a brush through its slip angle stands for the
cornering curve, and its tread counts as new.

Numbers keep all their digits, so an estimate from a file equals the one from memory.
"""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import FormatError
from tirelib.estimators.angle_model import AngleModel
from tirelib.estimators.border import Border
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_check import BORDER, faults
from tirelib.estimators.chain import Chain
from tirelib.estimators.gage_chains import Rolling
from tirelib.estimators.laws import ConditionLaws
from tirelib.estimators.likeness import Likeness
from tirelib.estimators.polynomial import Cloud, Polynomial, Range, Variable
from tirelib.estimators.reference_turn import ReferenceTurn
from tirelib.estimators.sliding import SlidingCurve, brush_through
from tirelib.estimators.unknowns import Road

FORMAT = "tirelib-calibration/2"
FIRST_FORMAT = "tirelib-calibration/1"
_ROAD = tuple(field.name for field in fields(Road))
_NUMBERS = re.compile(r"\[\n((?:\s+[-+.\w]+,\n)+)\s*\]")
_MODEL_UNITS = {"Fz": "N", "R_eff": "m", "Fy": "N", "Mz": "1", "Fx": "1", "alpha": "rad"}


def write_calibration(
    calibration: Calibration, path: str | Path, provenance: Mapping[str, Any] | None = None
) -> None:
    """Write a calibration; `provenance` holds further tables (data, statistics, history)."""
    import tomli_w  # writing only: an FMU reads calibrations without it

    document: dict[str, Any] = {
        "format": FORMAT,
        "axes": "iso",
        "tire": calibration.tire,
        "lateral_m": list(calibration.lateral),
        "geometry_m": dict(calibration.geometry),
        "filter": {"order": calibration.order},
        "rolling": {
            "centre": calibration.rolling.centre,
            "threshold": calibration.rolling.threshold,
        },
        **(provenance or {}),
        "chain": [
            {"missing_gage": missing + 1, **_chain_table(chain)}
            for missing, chain in sorted(calibration.chains.items())
        ],
    }
    if calibration.cut_off is not None:
        document["filter"]["cut_off_hz"] = calibration.cut_off
    if calibration.reference is not None:
        document["reference_turn"] = calibration.reference.table()
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(
        "# Calibration of strain estimators. SI units, ISO 8855 axes; missing_gage = 0: none.\n"
        + rows_on_lines(tomli_w.dumps(document)),
        encoding="utf-8",
    )


def rows_on_lines(text: str) -> str:
    r"""Join every list of plain numbers, which ``tomli_w`` writes number by number, on a line.

    Examples
    --------
    >>> print(rows_on_lines("a = [\n    1.5,\n    -2,\n]"))
    a = [1.5, -2]
    """
    return _NUMBERS.sub(
        lambda found: "[" + " ".join(found.group(1).split()).removesuffix(",") + "]", text
    )


def read_calibration(path: str | Path) -> Calibration:
    """Read a calibration.

    Raises
    ------
    FormatError
        If the file is no calibration of a known version, or a part is missing or of a wrong type.
    """
    return read_with_provenance(path)[0]


def read_with_provenance(path: str | Path) -> tuple[Calibration, dict[str, Any]]:
    """Read a calibration and the whole document, which tells what it was made on; see the above.

    Reading the text takes most of the time.
    """
    where = str(path)
    try:
        document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise FormatError(
            f"{where}: cannot be read ({error.strerror}); give a file made by `tirelib calibrate`"
        ) from None
    except UnicodeDecodeError:
        raise FormatError(
            f"{where}: is not TOML (it is no text); give a file made by `tirelib calibrate`, not "
            "the table of `tirelib fmu table`"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise FormatError(
            f"{where}: is not TOML ({error}); give a file made by `tirelib calibrate`"
        ) from None
    given = document.get("format")
    if given not in (FORMAT, FIRST_FORMAT):
        raise FormatError(
            f"{where}: format = {given!r}; this version reads {FORMAT!r} and {FIRST_FORMAT!r}; "
            "calibrate anew"
        )
    found = [f"{where}: {fault}; calibrate anew" for fault in faults(document)]
    if found:
        raise FormatError(found)
    try:
        calibration = _calibration(document)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise FormatError(
            f"{where}: is damaged ({type(error).__name__}: {error}); calibrate anew"
        ) from None
    if -1 not in calibration.chains:
        raise FormatError(f"{where}: holds no chain for all gages; calibrate anew")
    return calibration, document


def _calibration(document: Mapping[str, Any]) -> Calibration:
    turn = document.get("reference_turn")
    return Calibration(
        tire=str(document["tire"]),
        lateral=tuple(float(y) for y in document["lateral_m"]),
        geometry={name: float(x) for name, x in document.get("geometry_m", {}).items()},
        chains={int(table["missing_gage"]) - 1: _chain(table) for table in document["chain"]},
        rolling=Rolling(
            float(document["rolling"]["centre"]), float(document["rolling"]["threshold"])
        ),
        order=float(document["filter"]["order"]),
        cut_off=document["filter"].get("cut_off_hz"),
        reference=None if turn is None else ReferenceTurn.from_table(turn),
        version=int(str(document["format"]).rpartition("/")[2]),
    )


def _chain_table(chain: Chain) -> dict[str, Any]:
    table: dict[str, Any] = {
        "gages": [gage + 1 for gage in chain.gages],
        "mean_load": chain.mean_load,
        "laws": _laws_table(chain.laws),
        "force_laws": _laws_table(chain.force_laws),
        "road": {name: list(getattr(chain.road, name)) for name in _ROAD},
        "range": {
            quantity: [
                {"name": r.name, "low": r.low, "high": r.high, "slack": r.slack, "needed": r.needed}
                for r in ranges
            ]
            for quantity, ranges in chain.guards.items()
        },
    }
    if chain.cloud is not None:
        table["cloud"] = {
            "names": list(chain.cloud.names),
            "scale": chain.cloud.scale.tolist(),
            "points": chain.cloud.points.tolist(),
            "reach": chain.cloud.reach,
            "around": chain.cloud.around,
            "mirrored": chain.cloud.mirrored,
        }
    if chain.sliding is not None:
        curve = chain.sliding
        table["sliding"] = {
            field.name: list(x) if isinstance(x := getattr(curve, field.name), tuple) else x
            for field in fields(curve)
        }
    models = {
        "Fz": chain.load,
        "R_eff": chain.radius,
        "Fy": chain.force,
        "Mz": chain.moment,
        "Fx": chain.drag,
    }
    if chain.likeness is not None:
        table["likeness"] = _likeness_table(chain.likeness)
    if chain.agreement is not None:
        table["agreement"] = _likeness_table(chain.agreement)
    for name, model in models.items():
        if model is not None:
            table[name] = _polynomial_table(model, _MODEL_UNITS[name])
    if chain.angle is not None:
        table["alpha"] = {
            **_polynomial_table(chain.angle.polynomial, _MODEL_UNITS["alpha"]),
            "blur": chain.angle.blur,
            "bend": chain.angle.bend,
        }
    return table


def _sliding(table: Mapping[str, Any], angle: AngleModel | None) -> SlidingCurve | None:
    """Return the cornering curve; for a version that held none, a brush through the slip angle."""
    if "sliding" in table:
        part = table["sliding"]
        values: dict[str, Any] = {field.name: part[field.name] for field in fields(SlidingCurve)}
        values |= {name: tuple(map(float, x)) for name, x in values.items() if isinstance(x, list)}
        return SlidingCurve(**values)
    ends = {r["name"]: r for r in table["range"]["alpha"]}
    if angle is None or "road" in table or not {"utilisation", "alpha"} <= set(ends):
        return None
    load = {r["name"]: r for r in table["range"]["Fz"]}.get("Fz")
    mean = float(table["mean_load"])
    low, high = (mean, 1.01 * mean) if load is None else (load["low"], load["high"])
    used = max(abs(ends["utilisation"]["low"]), abs(ends["utilisation"]["high"]))
    return brush_through(angle.polynomial, float(used), (float(low), float(high)))


def _chain(table: Mapping[str, Any]) -> Chain:
    angle = None
    cloud = None
    if "cloud" in table:
        part = table["cloud"]
        first, second = part["names"]
        cloud = Cloud(
            (str(first), str(second)),
            np.asarray(part["scale"], dtype=np.float64),
            np.asarray(part["points"], dtype=np.float64).reshape(-1, 2),
            float(part["reach"]),
            float(part.get("around", 0.0)),  # files before these two keys: only what is near
            bool(part.get("mirrored", False)),
        )
    if "alpha" in table:
        part = table["alpha"]
        angle = AngleModel(_polynomial(part), float(part["blur"]), float(part["bend"]))
    return Chain(
        gages=tuple(int(gage) - 1 for gage in table["gages"]),
        guards={
            quantity: tuple(
                Range(
                    str(r["name"]),
                    float(r["low"]),
                    float(r["high"]),
                    float(r["slack"]),
                    bool(r["needed"]),
                )
                for r in ranges
            )
            for quantity, ranges in table["range"].items()
        },
        laws=_laws(table["laws"]),
        force_laws=_laws(table["force_laws"]),
        mean_load=float(table["mean_load"]),
        load=_polynomial(table["Fz"]) if "Fz" in table else None,
        radius=_polynomial(table["R_eff"]) if "R_eff" in table else None,
        force=_polynomial(table["Fy"]) if "Fy" in table else None,
        angle=angle,
        cloud=cloud,
        moment=_polynomial(table["Mz"]) if "Mz" in table else None,
        drag=_polynomial(table["Fx"]) if "Fx" in table else None,
        sliding=_sliding(table, angle),
        road=Road(**{name: _pair(pair) for name, pair in table.get("road", {}).items()}),
        likeness=_likeness(table["likeness"]) if "likeness" in table else None,
        agreement=_likeness(table["agreement"]) if "agreement" in table else None,
    )


def _likeness_table(known: Likeness) -> dict[str, Any]:
    return {
        "limit": known.limit,
        "names": list(known.names),
        "variable": _variables_table(known.variables),
        "exponents": [list(term) for term in known.terms],
        "coefficients": known.coefficients.tolist(),
        "covariance": known.covariance.tolist(),
    }


def _likeness(table: Mapping[str, Any]) -> Likeness:
    return Likeness(
        variables=_variables(table["variable"]),
        terms=tuple(tuple(int(e) for e in term) for term in table["exponents"]),
        names=tuple(str(name) for name in table["names"]),
        coefficients=np.asarray(table["coefficients"], dtype=np.float64),
        covariance=np.asarray(table["covariance"], dtype=np.float64),
        limit=float(table["limit"]),
    )


def _variables_table(variables: Sequence[Variable]) -> list[dict[str, Any]]:
    return [{"name": v.name, "centre": v.centre, "scale": v.scale} for v in variables]


def _variables(rows: Sequence[Mapping[str, Any]]) -> tuple[Variable, ...]:
    return tuple(Variable(str(v["name"]), float(v["centre"]), float(v["scale"])) for v in rows)


def _polynomial_table(model: Polynomial, unit: str) -> dict[str, Any]:
    std = np.sqrt(np.diag(model.covariance))
    border = model.border
    return {
        "unit": unit,
        "residual": model.residual,
        "floor": model.floor,
        **({"pulled": model.pulled} if model.pulled else {}),
        **({} if border is None else {"border": asdict(border)}),
        "variable": _variables_table(model.variables),
        "term": [
            {
                "name": name,
                "exponents": list(exponents),
                "value": float(value),
                "std": float(sigma),
                "unit": unit,
                "kind": "fitted",
            }
            for name, exponents, value, sigma in zip(
                model.names(), model.terms, model.coefficients, std, strict=True
            )
        ],
        "covariance": [[float(c) for c in row] for row in model.covariance],
    }


def _polynomial(table: Mapping[str, Any]) -> Polynomial:
    terms: Sequence[Mapping[str, Any]] = table["term"]
    covariance: FloatArray = np.asarray(table["covariance"], dtype=np.float64)
    if covariance.shape != (len(terms), len(terms)):
        raise ValueError(f"covariance has shape {covariance.shape} for {len(terms)} terms")
    return Polynomial(
        variables=_variables(table["variable"]),
        terms=tuple(tuple(int(e) for e in term["exponents"]) for term in terms),
        coefficients=np.array([float(term["value"]) for term in terms]),
        covariance=covariance,
        residual=float(table["residual"]),
        floor=float(table["floor"]),
        pulled=float(table.get("pulled", 0.0)),
        border=Border(**{name: float(table["border"][name]) for name in BORDER})
        if "border" in table  # files of before say nothing of it
        else None,
    )


def _laws_table(laws: ConditionLaws) -> dict[str, Any]:
    return {
        "pressure": list(laws.pressure),
        "speed": list(laws.speed),
        "pressure_fitted": laws.pressure_fitted,
        "speed_fitted": laws.speed_fitted,
        "contact_width": laws.contact_width,
        "radius": laws.radius,
    }


def _laws(table: Mapping[str, Any]) -> ConditionLaws:
    return ConditionLaws(
        pressure=_pair(table["pressure"]),
        speed=_pair(table["speed"]),
        pressure_fitted=bool(table["pressure_fitted"]),
        speed_fitted=bool(table["speed_fitted"]),
        contact_width=float(table["contact_width"]),
        radius=float(table["radius"]),
    )


def _pair(values: Sequence[Any]) -> tuple[float, float]:
    low, high = values
    return float(low), float(high)
