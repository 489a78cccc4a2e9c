"""A manoeuvre on the numerical rig: load, slip angle, slip ratio and speed over time, to strain.

``tirebench-manoeuvre/1`` as TOML::

    format = "tirebench-manoeuvre/1"
    tire   = "reference"
    [[point]]                      # held on straight lines from one point to the next
    t_s = 0.0
    load_N = 4000.0
    slip_angle_deg = 0.0
    speed_kmh = 65.0
    slip_ratio = -0.02             # left out: the wheel rolls freely
    pressure_bar = 2.3             # left out: 2.3
    camber_deg = 0.0               # left out: 0
    wheel = 1                      # left out: for every wheel without points of its own

or as CSV with those columns. The rig is solved at the points and between them wherever a condition
moves by more than `tirelib.rig.ramp.STEPS`; strain between two solutions is a straight line at each
wheel angle. The rig is steady at each of them: transients of the tire (relaxation) are not in it.
"""

import csv
import math
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tirebench.errors import DeviceError, cause
from tirelib.core.arrays import FloatArray
from tirelib.core.units import from_si, to_si
from tirelib.rig.measure import MeasuringChain, gages
from tirelib.rig.observe import forces, trace
from tirelib.rig.ramp import Point, dense
from tirelib.rig.solve import LIMITS, RigState, solve
from tirelib.rig.tire import TIRES, Condition, RigTire

FORMAT = "tirebench-manoeuvre/1"
COLUMNS: Mapping[str, tuple[str, str, str]] = {
    "load_N": ("load", "N", "force"),
    "slip_angle_deg": ("slip_angle", "deg", "angle"),
    "speed_kmh": ("speed", "km/h", "speed"),
    "slip_ratio": ("slip_ratio", "1", "ratio"),
    "pressure_bar": ("pressure", "bar", "pressure"),
    "camber_deg": ("camber", "deg", "angle"),
}
"""Column, condition, unit and dimension."""
REQUIRED = ("t_s", "load_N", "speed_kmh")
USUAL = {"slip_angle": 0.0, "camber": 0.0, "pressure": 2.3e5}
MOST_SOLUTIONS = 2000


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """Points in order of time, for each wheel; ``None`` is the key for all others."""

    tire: RigTire
    points: Mapping[int | None, tuple[Point, ...]]

    def of_wheel(self, wheel: int) -> tuple[Point, ...]:
        """Return the points of a wheel.

        Raises
        ------
        DeviceError
            If there are none.
        """
        points = self.points.get(wheel, self.points.get(None))
        if points is None:
            known = ", ".join(str(number) for number in self.points)
            raise DeviceError(
                f"wheel {wheel}: the manoeuvre has no points for this wheel; it has points for "
                f"{known}; add some, or leave out the column wheel"
            )
        return points


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Strain of a wheel along a manoeuvre, at the rig's solutions.

    Attributes
    ----------
    time : array, shape (k,), [s]
    omega : array, shape (k,), [rad/s]
    strain : array, shape (k, n, 5)
        On an even grid of n wheel angles from -pi.
    conditions : tuple of k Condition
    truth : mapping of name to array, shape (k,), SI
        Fz, alpha, kappa, Fy, Fx.
    """

    time: FloatArray
    omega: FloatArray
    strain: FloatArray
    conditions: tuple[Condition, ...]
    truth: Mapping[str, FloatArray]


def read_manoeuvre(path: Path) -> Manoeuvre:
    """Read a manoeuvre, TOML or CSV by the file's ending.

    Raises
    ------
    DeviceError
        With every fault of the file.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if path.suffix.lower() == ".csv":
            rows: list[Any] = list(csv.DictReader(text.splitlines()))
            tire = "reference"
        else:
            document = tomllib.loads(text)
            if document.get("format") != FORMAT:
                raise DeviceError(
                    f"{path}: format = {document.get('format')!r}; this program reads {FORMAT!r}; "
                    "correct it"
                )
            rows, tire = list(document.get("point", [])), str(document.get("tire", "reference"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, TypeError) as error:
        raise DeviceError(
            f"{path}: cannot be read ({cause(error)}); a manoeuvre is TOML or CSV in UTF-8; check "
            "the path and the file"
        ) from None
    if tire not in TIRES:
        raise DeviceError(
            f"{path}: tire = {tire!r}; known tires are {', '.join(TIRES)}; choose one"
        )
    return Manoeuvre(TIRES[tire], _points(rows, str(path)))


def _points(rows: Sequence[Any], where: str) -> dict[int | None, tuple[Point, ...]]:
    faults: list[str] = []
    if not rows:
        faults.append(f"{where}: the manoeuvre has no points; at least two are needed; write them")
    points: dict[int | None, list[Point]] = {}
    unknown: set[str] = set()
    for number, row in enumerate(rows, start=1):
        here = f"{where}: point {number}"
        if not isinstance(row, dict):
            faults.append(f"{here}: {row!r}; a table is needed; begin each point with [[point]]")
            continue
        given = {str(k): v for k, v in row.items() if v not in (None, "")}
        said = [
            _unknown(key, here)
            for key in given
            if key not in (*COLUMNS, "t_s", "wheel") and key not in unknown
        ]
        unknown |= set(given)
        said += [
            f"{here}: {key} is missing; a number is needed; add it"
            for key in REQUIRED
            if key not in given
        ]
        wheel, point = _point(given, here, said)
        faults += said
        if point is not None and not said:
            points.setdefault(wheel, []).append(point)
    if not faults:
        faults = [fault for wheel, own in points.items() for fault in _order(wheel, own, where)]
    if faults:
        raise DeviceError(faults)
    return {wheel: tuple(own) for wheel, own in points.items()}


def _unknown(key: str, here: str) -> str:
    """Return the fault of an unknown column; name one with the same meaning if there is any."""
    if key == "None":
        return (
            f"{here}: the line has more values than the table has columns; one value per column "
            "is needed; correct the line"
        )
    meant = [column for column in COLUMNS if column.rpartition("_")[0] == key.rpartition("_")[0]]
    hint = f"write {meant[0]}, in that unit" if meant else "correct the spelling"
    return (
        f"{here}: unknown column {key}; known columns are t_s, wheel, {', '.join(COLUMNS)}; {hint}"
    )


def _point(
    given: Mapping[str, Any], here: str, faults: list[str]
) -> tuple[int | None, Point | None]:
    """Return wheel and point of a row; add what is wrong with its numbers to the faults."""
    si: dict[str, float] = {}
    for key in (key for key in given if key in COLUMNS):
        name, unit, dimension = COLUMNS[key]
        low, high = (float(from_si(limit, unit, dimension)) for limit in LIMITS[name])
        value = _number(given[key])
        if low <= value <= high:
            si[name] = float(to_si(value, unit, dimension))
        else:
            faults.append(
                f"{here}: {key} = {given[key]}; a number from {low:g} to {high:g} is "
                "needed; correct it"
            )
    wheel, time = _number(given.get("wheel", -1.0)), _number(given.get("t_s", 0.0))
    if not math.isfinite(time):
        faults.append(f"{here}: t_s = {given['t_s']}; a time in seconds is needed; correct it")
    if not wheel.is_integer():
        faults.append(f"{here}: wheel = {given['wheel']}; a whole number is needed; correct it")
    if faults:
        return None, None
    return int(wheel) if "wheel" in given else None, Point(time, Condition(**{**USUAL, **si}))


def _number(value: Any) -> float:
    """Return a value of a file as a number; NaN where it is not a number."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _order(wheel: int | None, points: Sequence[Point], where: str) -> Iterator[str]:
    """Yield what is wrong with the points of a wheel together."""
    of = "" if wheel is None else f" of wheel {wheel}"
    times = [point.time for point in points]
    if len(points) < 2 or times[0] != 0.0 or any(b <= a for a, b in pairwise(times)):
        yield (
            f"{where}: times {times[:5]}{of}; at least two times are needed, increasing from 0; "
            "correct them"
        )
    if len({point.condition.slip_ratio is None for point in points}) > 1:
        yield (
            f"{where}: slip_ratio{of} is given at some points only; it must be given at all "
            "points or at none; complete it"
        )


def nodes(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the points and as many between them as `tirelib.rig.ramp.STEPS` asks for.

    Raises
    ------
    DeviceError
        If there are too many to be solved.
    """
    path = dense(points)
    if len(path) > MOST_SOLUTIONS:
        raise DeviceError(
            f"manoeuvre: it needs {len(path)} solutions of the rig; {MOST_SOLUTIONS} are allowed "
            "(0.7 s each); use smaller or slower changes"
        )
    return path


class Rig:
    """Solves conditions of one tire; what was solved once is remembered."""

    def __init__(self, tire: RigTire, points: int = 3600) -> None:
        self._tire = tire
        self._points = points
        self._known: dict[Condition, tuple[FloatArray, float, dict[str, float]]] = {}
        self._last: RigState | None = None

    def motion(
        self, path: Sequence[Point], progress: Callable[[int, int], None] = lambda done, of: None
    ) -> Motion:
        """Return what a wheel shows at each node of its path.

        `progress` is called after each node, with the number of solved nodes and of all nodes.
        """
        shown = []
        for done, point in enumerate(path, start=1):
            shown.append(self._show(point.condition))
            progress(done, len(path))
        return Motion(
            time=np.array([point.time for point in path]),
            omega=np.array([omega for _, omega, _ in shown]),
            strain=np.stack([strain for strain, _, _ in shown]),
            conditions=tuple(point.condition for point in path),
            truth={name: np.array([t[name] for _, _, t in shown]) for name in shown[0][2]},
        )

    def _show(self, condition: Condition) -> tuple[FloatArray, float, dict[str, float]]:
        if condition not in self._known:
            state = solve(self._tire, condition, self._last)
            self._last = state
            force = forces(state)
            kappa = state.omega * state.free_radius / condition.speed - 1.0
            truth = {
                "Fz": force.fz,
                "alpha": condition.slip_angle,
                "kappa": kappa,
                "Fy": force.fy,
                "Fx": force.fx,
            }
            strain = np.asarray(trace(state, self._points).strain)
            self._known[condition] = (strain, state.omega, truth)
        return self._known[condition]


def waveform(
    motion: Motion,
    tire: RigTire,
    rate: float,
    *,
    seed: int = 0,
    chain: MeasuringChain | None = None,
) -> FloatArray:
    """Return strain over time as the gages give it, shape (n, 5).

    The angle is the integral of the wheel's speed; gain, offset and noise are those of the rig's
    measuring chain.
    """
    chain = chain or MeasuringChain()
    n = int(motion.time[-1] * rate) + 1
    time = np.arange(n) / rate
    omega = np.interp(time, motion.time, motion.omega)
    steps = 0.5 * (omega[1:] + omega[:-1]) / rate
    phi = -np.pi + np.concatenate(([0.0], np.cumsum(steps)))
    size = motion.strain.shape[1]
    angle = (phi + np.pi) / (2.0 * np.pi) * size
    place = np.interp(time, motion.time, np.arange(len(motion.time)))
    k = np.minimum(place.astype(np.int64), len(motion.time) - 2)
    low = np.floor(angle).astype(np.int64)
    share, part = (place - k)[:, None], (angle - low)[:, None]
    a, b = low % size, (low + 1) % size
    before = (1.0 - part) * motion.strain[k, a] + part * motion.strain[k, b]
    after = (1.0 - part) * motion.strain[k + 1, a] + part * motion.strain[k + 1, b]
    strain = (1.0 - share) * before + share * after
    sensors = gages(tire, chain)
    noise = chain.gage_noise * np.random.default_rng([seed, 3]).standard_normal(strain.shape)
    return np.asarray(strain * sensors.gain + sensors.offset + noise)
