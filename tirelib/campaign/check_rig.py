"""Checks of the rig's quantities: numbers, signs, units, and the way to the set points."""

import math
from typing import NamedTuple

import numpy as np

from tirelib.campaign.check_gages import not_finite
from tirelib.campaign.finding import RunFinding, finding
from tirelib.campaign.model import CampaignHeader, Run
from tirelib.campaign.write import FIELD_UNITS
from tirelib.core.axes import sign
from tirelib.core.units import dimension_of, from_si


class _SetPoint(NamedTuple):
    """How far a measured mean may lie from its set point, and which mistakes are common."""

    planned: str
    relative: float
    absolute: float  # SI
    factors: tuple[tuple[float, str], ...]


_DEG = math.pi / 180.0

SET_POINTS = {
    "Fz": _SetPoint(
        "load", 0.15, 100.0, ((1e3, "N and kN"), (9.80665, "kgf and N"), (4.448222, "lbf and N"))
    ),
    "pressure": _SetPoint(
        "pressure",
        0.10,
        5e3,
        (
            (1e2, "kPa and bar"),
            (1e5, "Pa and bar"),
            (1e3, "Pa and kPa"),
            (14.5038, "psi and bar"),
            (6.894757, "psi and kPa"),
        ),
    ),
    "speed": _SetPoint(
        "speed",
        0.10,
        0.3,
        ((3.6, "km/h and m/s"), (1.609344, "mph and km/h"), (2.236936, "mph and m/s")),
    ),
    "slip_angle": _SetPoint("slip_angle", 0.20, 0.5 * _DEG, ((1.0 / _DEG, "rad and deg"),)),
    "camber": _SetPoint("camber", 0.20, 0.5 * _DEG, ((1.0 / _DEG, "rad and deg"),)),
    "slip_ratio": _SetPoint("slip_ratio", 0.30, 0.03, ((1e2, "% and 1"),)),
}

PLAUSIBLE = {
    "Fz": (10.0, 2e5),
    "pressure": (1e4, 2e6),
    "speed": (0.0, 150.0),
    "slip_angle": (0.0, 60.0 * _DEG),
    "camber": (0.0, 60.0 * _DEG),
    "slip_ratio": (0.0, 5.0),
}
"""Where the middle of the magnitude of a quantity lies in any tire test, SI."""

LOADED = (0.6, 1.1)
"""Where a loaded radius lies, relative to the free one (assumed: a wide range about the 85 to 100 %
of a tire that carries its load). The lower end catches a free diameter that is given as a radius,
which gives about .46. An end twice as far from 1 (.2) would let it pass; one half as far (.8) would
come near to a tire that is heavily loaded."""

SPIKE = 20.0
"""A rig sample this many robust sigmas off its neighbours is a spike."""


def rig_findings(run: Run, header: CampaignHeader) -> list[RunFinding]:
    """Return the faults of the rig quantities of one run."""
    found: list[RunFinding] = []
    if run.rig_time is None:
        return found
    file = run.plan.file
    sound: list[str] = []
    for quantity, samples in run.rig.items():
        faults = not_finite(file, quantity, samples, run.rig_time)
        found += faults
        if not faults and samples.size:
            sound.append(quantity)
            found += _spikes(run, quantity)
    for quantity in sound:
        faults = _far_from_set_point(run, quantity, header)
        found += faults or _implausible(run, quantity, header)
    if "Fz" in sound:
        found += _wrong_fz_sign(run, header)
    return found + _rolling(run, sound, header)


def shown(quantity: str, value: float, axes: str) -> str:
    """Return a value as the files have it: field unit and sign of their axis system."""
    dimension = dimension_of(quantity) or "ratio"
    unit = FIELD_UNITS[dimension]
    given = sign(quantity, axes) * from_si(value, unit, dimension) + 0.0
    return f"{given:.4g}" if unit == "1" else f"{given:.4g} {unit}"


def _far_from_set_point(run: Run, quantity: str, header: CampaignHeader) -> list[RunFinding]:
    rule = SET_POINTS.get(quantity)
    mean = run.mean(quantity)
    if rule is None or mean is None:
        return []
    planned: float = getattr(run.plan, rule.planned)
    # A load's set point is a magnitude; a wrong sign of Fz has its own message.
    measured = abs(mean) if quantity == "Fz" else mean
    off = abs(measured - planned)
    if not math.isfinite(planned) or off <= max(rule.absolute, rule.relative * abs(planned)):
        return []
    ratio = measured / planned if planned else math.inf
    factor, remedy = _suspect(ratio, rule)
    grave = factor is not None or off > 3.0 * max(rule.absolute, rule.relative * abs(planned))
    shown_plan = shown(quantity, planned, "iso" if quantity == "Fz" else header.axes)
    return [
        finding(
            "set point",
            run.plan.file,
            quantity,
            f"mean {shown(quantity, mean, header.axes)}, the set point is {shown_plan}"
            + (f" (ratio {ratio:.3g})" if math.isfinite(ratio) else ""),
            f"within {100 * rule.relative:.0f} % of the set point or "
            f"{shown(quantity, rule.absolute, 'iso')} is allowed",
            remedy,
            warning=not grave,
        )
    ]


def _suspect(ratio: float, rule: _SetPoint) -> tuple[float | None, str]:
    """Return the factor of a known mix-up of units, and the remedy."""
    if abs(ratio + 1.0) < 0.2:
        return -1.0, "the sign is suspected: correct it, or the axes of campaign.toml"
    for factor, units in rule.factors:
        for suspected in (factor, 1.0 / factor):
            if abs(ratio / suspected - 1.0) < 0.12:
                return (
                    suspected,
                    f"a factor of {suspected:.4g} is suspected ({units} mixed up): "
                    "correct the channel's unit or the column",
                )
    return None, "correct the set point in runs.csv, or find out what the rig did"


def _implausible(run: Run, quantity: str, header: CampaignHeader) -> list[RunFinding]:
    if quantity not in PLAUSIBLE:
        return []
    low, high = PLAUSIBLE[quantity]
    middle = float(np.median(np.abs(run.rig[quantity])))
    if low <= middle <= high:
        return []
    return [
        finding(
            "plausible",
            run.plan.file,
            quantity,
            f"its magnitude is {shown(quantity, middle, 'iso')} in the middle",
            f"{shown(quantity, low, 'iso')} .. {shown(quantity, high, 'iso')} is plausible",
            "check the channel's unit",
        )
    ]


def _wrong_fz_sign(run: Run, header: CampaignHeader) -> list[RunFinding]:
    middle = float(np.median(run.rig["Fz"]))
    if middle >= 0.0:
        return []
    right = "negative" if header.axes == "sae" else "positive"
    return [
        finding(
            "sign",
            run.plan.file,
            "Fz",
            f"wrong sign: {shown('Fz', middle, header.axes)} in the median, axes = {header.axes!r}",
            f"Fz of a loaded tire is {right} in these axes",
            "correct axes in campaign.toml or the sign of the channel",
        )
    ]


def _rolling(run: Run, sound: list[str], header: CampaignHeader) -> list[RunFinding]:
    """Compare speed, wheel speed and loaded radius with the size of the tire."""
    found: list[RunFinding] = []
    radius = header.tire.free_radius
    if {"omega", "speed"} <= set(sound):
        slip = run.rig["slip_ratio"] if "slip_ratio" in sound else np.zeros_like(run.rig["speed"])
        road = float(np.median(np.abs(run.rig["speed"] * (1.0 + slip))))
        rim = float(np.median(np.abs(run.rig["omega"]))) * radius
        if road > 0.5 and not 0.8 < rim / road < 1.3:
            found.append(
                finding(
                    "rolling",
                    run.plan.file,
                    "omega",
                    f"omega times the free radius is {3.6 * rim:.4g} km/h, speed and slip ratio "
                    f"make {3.6 * road:.4g} km/h (ratio {rim / road:.3g})",
                    "they must agree within 30 %",
                    "check the units of omega (rpm, Hz or rad/s?), speed and free_radius_m",
                )
            )
    if "loaded_radius" in sound:
        loaded = float(np.median(run.rig["loaded_radius"]))
        low, high = LOADED
        if not low * radius < loaded < high * radius:
            found.append(
                finding(
                    "rolling",
                    run.plan.file,
                    "loaded_radius",
                    f"{1e3 * loaded:.4g} mm, the free radius is {1e3 * radius:.4g} mm",
                    f"{100 * low:.0f} .. {100 * high:.0f} % of the free radius is plausible",
                    "check the channel's unit and free_radius_m",
                )
            )
    return found


def _spikes(run: Run, quantity: str) -> list[RunFinding]:
    """Find single samples far from both neighbours; a mean hardly cares, hence a warning."""
    samples = run.rig[quantity]
    if samples.size < 10 or run.rig_time is None:
        return []
    middle = np.median(np.stack([samples[:-2], samples[1:-1], samples[2:]]), axis=0)
    excess = np.abs(samples[1:-1] - middle)
    noise = 1.4826 * float(np.median(np.abs(np.diff(samples) - np.median(np.diff(samples)))))
    limit = max(SPIKE * noise / math.sqrt(2.0), 0.05 * float(np.median(np.abs(samples))))
    spikes = np.flatnonzero(excess > limit) + 1 if limit > 0.0 else np.empty(0, dtype=np.intp)
    if not spikes.size:
        return []
    first = int(spikes[0])
    return [
        finding(
            "spike",
            run.plan.file,
            quantity,
            f"{spikes.size} sample(s) in spikes",
            f"at most {SPIKE:.0f} sigma from the neighbours is normal",
            "check the rig's recording there",
            at=f"sample {first} (t = {run.rig_time[first]:.4f} s)",
            warning=True,
        )
    ]
