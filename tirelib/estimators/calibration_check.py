"""What may be wrong with a calibration file: every fault, before any number of it is used."""

import math
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any

import numpy as np

from tirelib.estimators.likeness import DRIFT
from tirelib.estimators.reference_turn import CONDITIONS
from tirelib.estimators.regressors import EVEN, ODD, SHAPE

AXES = "iso"
UNITS = {"Fz": "N", "R_eff": "m", "Fy": "N", "Mz": "1", "Fx": "1", "alpha": "rad"}
"""Models of a chain with the unit of their coefficients."""
REGRESSORS = frozenset(
    (
        *EVEN,
        *ODD,
        *SHAPE,
        "pressure",
        "speed_squared",
        "camber",
        "load",
        "utilisation",
        "slip_ratio",
        "slip_size",
    )
)
"""Names that a polynomial or a range may use."""
QUANTITIES = frozenset(("Fz", "alpha", "kappa", "Fy"))
BORDER = ("near", "growth", "far")
"""What a model's border says, each from 0."""
TABLES = ("geometry_m", "filter", "rolling", "chain", "reference_turn")
"""Tables of a calibration. Others say what it was made from, under any name that is not nearly one
of these."""
PARTS = (
    *("missing_gage", "gages", "mean_load", "laws", "force_laws", "road", "range"),
    *("cloud", "sliding", "likeness", "agreement", *UNITS),
)
"""What a chain may hold."""
MODEL = ("unit", "residual", "floor", "pulled", "border", "variable", "term", "covariance")
HIGHEST_POWER = 12
FEWEST_POINTS = 64
"""Fewest points of a reference turn."""


def faults(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield every fault of a calibration document, each saying where it is."""
    for name in set(document) - set(TABLES):
        if near := get_close_matches(name, TABLES, n=1, cutoff=0.8):
            yield f"{name}: is unknown; did you mean {near[0]!r}?"
    yield from _unknown(document.get("filter"), "filter", ("order", "cut_off_hz"))
    if document.get("axes") != AXES:
        yield f"axes = {document.get('axes')!r}; only {AXES!r} is allowed"
    yield from _numbers(document, "filter", ("order",))
    yield from _numbers(document, "rolling", ("centre", "threshold"))
    lateral = document.get("lateral_m")
    if not isinstance(lateral, list) or len(lateral) < 3 or not all(map(_finite, lateral)):
        yield f"lateral_m = {lateral!r}; a list of at least three numbers is needed"
        return
    chains = document.get("chain")
    if not isinstance(chains, list) or not chains:
        yield "chain: is missing; one table per gage set is needed"
        return
    seen = [chain.get("missing_gage") for chain in chains if isinstance(chain, dict)]
    if len(set(seen)) != len(chains) or 0 not in seen:
        yield f"chain: missing_gage = {seen}; each once, and 0 (none missing) among them"
    for index, chain in enumerate(chains):
        yield from _chain(chain, f"chain[{index}]", len(lateral))
    geometry = document.get("geometry_m", {})
    if not isinstance(geometry, dict) or not all(map(_finite, geometry.values())):
        yield f"geometry_m = {geometry!r}; a table of finite numbers is needed"
    if "reference_turn" in document:
        yield from _reference_turn(document["reference_turn"], len(lateral))


def _chain(chain: Any, where: str, gages: int) -> Iterator[str]:
    if not isinstance(chain, dict):
        yield f"{where}: is no table"
        return
    yield from _unknown(chain, where, PARTS)
    used = chain.get("gages")
    good = isinstance(used, list) and all(_whole(g, 1, gages) for g in used)
    if not isinstance(used, list) or not good or not len(set(used)) == len(used) >= 2:
        yield f"{where}.gages = {used!r}; numbers from 1 to {gages}, each once"
    if not isinstance(chain.get("mean_load"), float | int):
        yield f"{where}.mean_load = {chain.get('mean_load')!r}; a number is needed"
    for name in ("laws", "force_laws"):
        yield from _laws(chain.get(name), f"{where}.{name}")
    ranges = chain.get("range")
    if not isinstance(ranges, dict) or set(ranges) != QUANTITIES:
        yield f"{where}.range: one list for each of {', '.join(sorted(QUANTITIES))} is needed"
    else:
        for quantity, entries in ranges.items():
            for position, entry in enumerate(entries):
                yield from _range(entry, f"{where}.range.{quantity}[{position}]")
            calibrated = quantity in chain and quantity != "kappa"
            if calibrated and not entries:
                yield f"{where}.range.{quantity}: is empty; it decides on validity"
    for name, unit in UNITS.items():
        if name in chain:
            yield from _model(chain[name], f"{where}.{name}", unit)
            known = (*MODEL, "blur", "bend") if name == "alpha" else MODEL
            yield from _unknown(chain[name], f"{where}.{name}", known)
    if "alpha" in chain:
        yield from _numbers(chain, "alpha", ("blur", "bend"), where)
    for name in ("likeness", "agreement"):
        if name in chain:
            yield from _likeness(chain[name], f"{where}.{name}")
    if "cloud" in chain:
        yield from _cloud(chain["cloud"], f"{where}.cloud")
    if "road" in chain:
        yield from _road(chain["road"], f"{where}.road")
    if "sliding" in chain:
        yield from _sliding(chain["sliding"], f"{where}.sliding")


def _unknown(table: Any, where: str, known: Iterable[str]) -> Iterator[str]:
    """Yield the names that a table may not hold, each with the nearest that it may."""
    names = [*known]
    for name in table if isinstance(table, dict) else ():
        if name not in names:
            near = get_close_matches(name, names, n=1, cutoff=0.5)
            told = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(names)}"
            yield f"{where}.{name}: is unknown; {told}"


def _road(table: Any, where: str) -> Iterator[str]:
    for name in ("friction", "tread_depth", "tread_temperature"):
        pair: Any = table.get(name) if isinstance(table, dict) else None
        good = isinstance(pair, list) and len(pair) == 2 and all(map(_number, pair))
        if not good or pair[0] > pair[1] or min(pair) < 0.0:
            yield f"{where}.{name} = {pair!r}; two numbers from 0, the lower first, are needed"


def _sliding(table: Any, where: str) -> Iterator[str]:
    if not isinstance(table, dict):
        yield f"{where}: is no table"
        return
    for name in ("friction", "grip", "sharpness", "fading"):
        if not _finite(table.get(name)) or table[name] <= 0.0:
            yield f"{where}.{name} = {table.get(name)!r}; a number above 0 is needed"
    for name in ("friction_std", "misfit", "slant"):
        if not _number(table.get(name)) or not table[name] >= 0.0:
            yield f"{where}.{name} = {table.get(name)!r}; a number from 0 is needed"
    for name, most in (("stiffness", 3), ("trail", 3), ("ratio", 3), ("camber", 2)):
        row: Any = table.get(name)
        good = isinstance(row, list) and 0 < len(row) <= most and all(map(_finite, row))
        if not good or (name == "camber" and len(row) != most):
            yield f"{where}.{name} = {row!r}; up to {most} finite numbers are needed"


def _reference_turn(table: Any, gages: int) -> Iterator[str]:
    where = "reference_turn"
    if not isinstance(table, dict):
        yield f"{where}: is no table"
        return
    for name in CONDITIONS:
        if not _number(table.get(name)):
            yield f"{where}.{name} = {table.get(name)!r}; a number is needed"
    for name in ("omega", "strain_unit"):
        if not _finite(table.get(name)) or not table[name] > 0.0:
            yield f"{where}.{name} = {table.get(name)!r}; a finite number above 0 is needed"
    if not isinstance(table.get("run"), str):
        yield f"{where}.run = {table.get('run')!r}; a text is needed"
    rows: Any = table.get("strain")
    whole = isinstance(rows, list) and len(rows) == gages and all(map(_long, rows))
    if not whole or len({len(row) for row in rows}) > 1:
        yield (
            f"{where}.strain: {gages} rows of equally many finite numbers, at least "
            f"{FEWEST_POINTS}, are needed"
        )


def _long(row: Any) -> bool:
    return isinstance(row, list) and len(row) >= FEWEST_POINTS and all(map(_finite, row))


def _laws(table: Any, where: str) -> Iterator[str]:
    if not isinstance(table, dict):
        yield f"{where}: is missing"
        return
    for name in ("pressure", "speed"):
        pair = table.get(name)
        if not (isinstance(pair, list) and len(pair) == 2 and all(map(_number, pair))):
            yield f"{where}.{name} = {pair!r}; two numbers are needed"
        if not isinstance(table.get(f"{name}_fitted"), bool):
            yield f"{where}.{name}_fitted: true or false is needed"
    for name in ("contact_width", "radius"):
        if not _number(table.get(name)):
            yield f"{where}.{name} = {table.get(name)!r}; a number is needed"


def _range(entry: Any, where: str) -> Iterator[str]:
    given = entry.get("name") if isinstance(entry, dict) else entry
    if given not in REGRESSORS | QUANTITIES:
        yield f"{where}: name = {given!r} is unknown"
        return
    for name in ("low", "high", "slack"):
        if not _finite(entry.get(name)):
            yield f"{where}.{name} = {entry.get(name)!r}; a finite number is needed"
    if not isinstance(entry.get("needed"), bool):
        yield f"{where}.needed = {entry.get('needed')!r}; true or false is needed"


def _cloud(table: Any, where: str) -> Iterator[str]:
    if not isinstance(table, dict):
        yield f"{where}: is no table"
        return
    names, scale, points = table.get("names"), table.get("scale"), table.get("points")
    if not isinstance(names, list) or len(names) != 2 or not set(names) <= REGRESSORS:
        yield f"{where}.names = {names!r}; two names of regressors are needed"
    if not isinstance(scale, list) or not _pair(scale) or min(scale) <= 0.0:
        yield f"{where}.scale = {scale!r}; two numbers above 0 are needed"
    if not isinstance(points, list) or not points or not all(map(_pair, points)):
        yield f"{where}.points: pairs of finite numbers are needed"
    for name in ("reach", "around"):
        value: Any = table.get(name, 0.0 if name == "around" else None)
        if not _finite(value) or value < 0.0:
            yield f"{where}.{name} = {value!r}; a number from 0 is needed"
    if not isinstance(table.get("mirrored", False), bool):
        yield f"{where}.mirrored = {table['mirrored']!r}; true or false is needed"


def _likeness(table: Any, where: str) -> Iterator[str]:
    if not isinstance(table, dict):
        yield f"{where}: is no table"
        return
    if not _finite(table.get("limit")) or table["limit"] <= 0.0:
        yield f"{where}.limit = {table.get('limit')!r}; a finite number above 0 is needed"
    names, terms, variables = (table.get(k) for k in ("names", "exponents", "variable"))
    if not isinstance(names, list) or not names or not set(names) <= set(DRIFT):
        yield f"{where}.names = {names!r}; names of regressors are needed"
        return
    if not isinstance(variables, list) or not isinstance(terms, list) or not terms:
        yield f"{where}: variable and exponents are needed"
        return
    yield from _variables(variables, where)
    for position, powers in enumerate(terms):
        good = isinstance(powers, list) and len(powers) == len(variables)
        if not good or not all(_whole(p, 0, HIGHEST_POWER) for p in powers):
            yield f"{where}.exponents[{position}] = {powers!r}; {len(variables)} whole numbers"
    rows = table.get("coefficients")
    if (
        not isinstance(rows, list)
        or len(rows) != len(terms)
        or not all(
            isinstance(row, list) and len(row) == len(names) and all(map(_finite, row))
            for row in rows
        )
    ):
        yield f"{where}.coefficients: {len(terms)} rows of {len(names)} finite numbers are needed"
    yield from _covariance(table.get("covariance"), f"{where}.covariance", len(names))


def _variables(variables: list[Any], where: str) -> Iterator[str]:
    for position, variable in enumerate(variables):
        if variable.get("name") not in REGRESSORS:
            yield f"{where}.variable[{position}]: name = {variable.get('name')!r} is unknown"
        if not _finite(variable.get("centre")) or not _finite(variable.get("scale")):
            yield f"{where}.variable[{position}]: centre and scale must be finite numbers"
        elif variable["scale"] == 0.0:
            yield f"{where}.variable[{position}].scale = 0; another number is needed"


def _pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(_finite, value))


def _model(table: Any, where: str, unit: str) -> Iterator[str]:
    if not isinstance(table, dict):
        yield f"{where}: is no table"
        return
    if table.get("unit") != unit:
        yield f"{where}.unit = {table.get('unit')!r}; only {unit!r} is allowed"
    for name in ("residual", "floor"):
        if not _finite(table.get(name)) or table[name] < 0.0:
            yield f"{where}.{name} = {table.get(name)!r}; a number from 0 is needed"
    border: Any = table.get("border", dict.fromkeys(BORDER, 0.0))
    for name in BORDER:
        value: Any = border.get(name) if isinstance(border, dict) else border
        if not _finite(value) or value < 0.0:
            yield f"{where}.border.{name} = {value!r}; a number from 0 is needed"
    variables, terms = table.get("variable"), table.get("term")
    if not isinstance(variables, list) or not isinstance(terms, list) or not terms:
        yield f"{where}: variable and term are needed"
        return
    yield from _variables(variables, where)
    for position, term in enumerate(terms):
        powers = term.get("exponents")
        good = isinstance(powers, list) and len(powers) == len(variables)
        if not good or not all(_whole(p, 0, HIGHEST_POWER) for p in powers):
            yield (
                f"{where}.term[{position}].exponents = {powers!r}; {len(variables)} whole numbers "
                f"from 0 to {HIGHEST_POWER} are needed"
            )
        value = term.get("value")
        if not _finite(value):
            yield f"{where}.term[{position}].value = {value!r}; a finite number is needed"
    yield from _covariance(table.get("covariance"), f"{where}.covariance", len(terms))


def _covariance(rows: Any, where: str, size: int) -> Iterator[str]:
    good = isinstance(rows, list) and len(rows) == size
    if not good or not all(
        isinstance(row, list) and len(row) == size and all(map(_finite, row)) for row in rows
    ):
        yield f"{where}: {size} rows of {size} finite numbers are needed"
        return
    matrix = np.asarray(rows, dtype=np.float64)
    top = float(np.abs(matrix).max())
    if not np.allclose(matrix, matrix.T, rtol=1e-6, atol=1e-9 * top):
        yield f"{where}: is not symmetric"
    elif (np.diag(matrix) < 0.0).any():
        yield f"{where}: has a negative variance"


def _numbers(
    document: Mapping[str, Any], table: str, names: tuple[str, ...], where: str = ""
) -> Iterator[str]:
    part = document.get(table)
    prefix = f"{where}.{table}" if where else table
    for name in names:
        value = part.get(name) if isinstance(part, dict) else None
        if not _finite(value):
            yield f"{prefix}.{name} = {value!r}; a finite number is needed"
    if table == "filter" and isinstance(part, dict):
        fixed = part.get("cut_off_hz", 1.0)
        if not _finite(fixed):
            yield f"filter.cut_off_hz = {fixed!r}; a finite number is needed"


def _number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


def _finite(value: Any) -> bool:
    return _number(value) and math.isfinite(value)


def _whole(value: Any, low: int, high: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high
