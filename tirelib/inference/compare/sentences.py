"""Lack of fit in plain words."""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.regions import SLIPS, Region
from tirelib.inference.compare.runs import STEP
from tirelib.inference.compare.sectors import SECTORS, sector_at

PLACES = {
    "contact": "in the contact",
    "entry edge": "at the entry of the contact",
    "exit edge": "at the exit of the contact",
    "entry flank": "before the contact",
    "exit flank": "behind the contact",
    "far side": "away from the contact",
}
ENDS = {
    "entry flank": ("before the contact", "before it"),
    "entry edge": ("the entry of the contact", "its entry"),
    "contact": ("inside the contact", "inside it"),
    "exit edge": ("the exit of the contact", "its exit"),
    "exit flank": ("behind the contact", "behind it"),
}
"""What the first and the last angle of a region are called where they lie in two sectors."""


def told(by: str, value: float) -> str:
    """Say a value of a condition with its unit.

    Examples
    --------
    >>> told("load", 4500.0), told("pressure", 1.7e5), told("slip_ratio", -0.04)
    ('4,500 N', '1.7 bar', '-0.04')
    """
    quantity = QUANTITIES[by]
    number = quantity.told(value)
    text = f"{number:,.0f}" if by in ("load", "speed") else f"{round(float(number), 3):g}"
    return f"{text} {quantity.words}".strip()


def set_point(by: str, value: float) -> str:
    """Say the level of a load, a pressure or a speed.

    Examples
    --------
    >>> set_point("load", 4488.0), set_point("pressure", 1.68e5)
    ('4,500 N', '1.7 bar')
    """
    return told(by, STEP[by] * round(value / STEP[by]))


def place(region: Region, edges: FloatArray) -> str:
    """Return the sector of a region's middle in `SECTORS`, by the contact of its runs."""
    return _sector(0.5 * (region.start + region.stop), region, edges)


def extent(region: Region, edges: FloatArray) -> str:
    """Say where a region lies, by its two ends and the contact of its runs."""
    angles = region.start, region.stop
    sectors = [_sector(angle, region, edges) for angle in angles]
    first, last = (
        sector if sector in ENDS else "exit flank" if angle > 0.0 else "entry flank"
        for sector, angle in zip(sectors, angles, strict=True)
    )
    if first == last:
        return PLACES[sectors[0] if sectors[0] == sectors[1] else first]
    return f"from {ENDS[first][0]} to {ENDS[last][1]}"


def _sector(angle: float, region: Region, edges: FloatArray) -> str:
    lead, trail = edges[region.member].mean(axis=0)
    return SECTORS[int(sector_at(np.array([angle / (trail if angle > 0 else -lead)]))[0])]


def amount(mean: float, measured: float) -> str:
    """Say a difference of strain, model less measured.

    Examples
    --------
    >>> amount(6e-4, 2e-3), amount(6e-4, -2e-3), amount(-6e-4, -2e-3)
    ('600 microstrain too much tension', '600 microstrain too little compression', \
'600 microstrain too much compression')
    """
    model = measured + mean
    tension = model + measured > 0.0
    more = (mean > 0.0) == tension
    size = f"{1e6 * abs(mean):,.0f}" if abs(mean) >= 1e-5 else f"{1e6 * abs(mean):.1f}"
    kind = "tension" if tension else "compression"
    return f"{size} microstrain too {'much' if more else 'little'} {kind}"


def conditions(by: str, side: str, value: float) -> str:
    """Say the runs of a region; empty for all.

    Examples
    --------
    >>> conditions("load", "above", 4500.0)
    'at 4,500 N and above'
    """
    if by == "all":
        return ""
    name = f"{by.replace('_', ' ')} " if by in SLIPS else ""
    return f"at {name}{told(by, value)} and {side}"


def sentence(region: Region, edges: FloatArray) -> str:
    """Say one region in plain words."""
    text = (
        f"{extent(region, edges)}, from {region.start:.2f} to {region.stop:.2f} rad, "
        f"{conditions(region.by, region.side, region.value) or 'in all runs'}, "
        f"the model shows {amount(region.mean, region.measured)} (95 % \N{PLUS-MINUS SIGN} "
        f"{small(1.96e6 * region.std)}, {region.runs} runs)."
    )
    return text[0].upper() + text[1:]


def small(value: float) -> str:
    """Say the size of an interval in microstrain."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.1f}"


def millimetres(y: float) -> str:
    """Say a lateral position in whole millimetres with its sign; zero has none.

    Examples
    --------
    >>> millimetres(0.06), millimetres(-1e-5)
    ('+60 mm', '0 mm')
    """
    whole = round(1e3 * y)
    return f"{whole:+d} mm" if whole else "0 mm"
