"""A campaign on the virtual tire: what a laboratory would measure, for its calibration."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from tirelib.campaign import (
    CampaignHeader,
    Run,
    RunPlan,
    TireGeometry,
    Tolerance,
    write_campaign,
)
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.fmu.parts import DEFAULT_RATE
from tirelib.fmu.virtual.coordinates import FRICTION
from tirelib.fmu.virtual.drive import PRESSURE, drive
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.surface import Surface
from tirelib.fmu.virtual.table import START

GEOMETRY = {
    "free_radius": 0.316,
    "ring_radius": 0.303,
    "tread_thickness": 0.0115,
    "belt_width": 0.168,
    "innerliner_offset": -0.003,
}
"""Dimensions of the numerical rig's tire, from which the surfaces are made, [m]."""
TURNS = 5.1
LOAD_SETTING, GAIN_REPEATABILITY = 0.005, 0.003
"""How far the load is from its set point, and the gain of a gage from that of another run, [1]."""
TREAD_DEPTH, TREAD_TEMPERATURE = 0.008, 313.15
"""The only tread that the surfaces know, [m], [K]."""
RIG_RATE = 100.0


def measure(
    surface: Surface,
    folder: str | Path,
    *,
    conditions: FloatArray | None = None,
    seed: int = 0,
    overwrite: bool = False,
    progress: Callable[[str], None] | None = None,
) -> int:
    """Measure a virtual tire; write a campaign and return the number of its runs.

    Parameters
    ----------
    surface : Surface
    folder : path
        Where the campaign is written.
    conditions : array, shape (n, 5), optional
        Conditions in the columns of `drive`; by default those that the wheels of a car meet.
    seed : int
        The day: noise, loads and gains.
    overwrite : bool
        Whether the folder may hold something.
    progress : callable, optional
        Called with what was done.

    Raises
    ------
    ParameterError
        If the folder is not empty.
    """
    path = Path(folder)
    if path.exists() and any(path.iterdir()) and not overwrite:
        raise ParameterError(
            f"{path} is not empty; allowed is a new or empty folder; name another one or ask to "
            "overwrite (--force)"
        )
    random = np.random.default_rng(seed)
    table = drive() if conditions is None else conditions

    def runs() -> Iterator[Run]:
        for number, condition in enumerate(table):
            yield _run(surface, number, condition, random)
            if progress is not None:
                progress(f"run {number + 1} of {len(table)}")

    header = CampaignHeader(
        name="virtual tire, what the wheels of a car do",
        axes="iso",
        tire=TireGeometry(str(surface.about.get("tire", "virtual tire")), **GEOMETRY),
        gage_lateral=tuple(surface.lateral.tolist()),
        rate=DEFAULT_RATE,
        tolerance=Tolerance(LOAD_SETTING, 0.0, 0.0, GAIN_REPEATABILITY),
        rig_name="response surface of VirtualTire.fmu",
    )
    write_campaign(path, header, runs(), overwrite=overwrite)
    return len(table)


def _run(surface: Surface, number: int, condition: FloatArray, random: np.random.Generator) -> Run:
    """Return a steady run of some turns; the slip ratio of a condition is along the wheel."""
    asked, alpha, along, camber, speed = condition.tolist()
    load = asked * (1.0 + LOAD_SETTING * float(random.standard_normal()))
    kappa = (1.0 + along) * math.cos(alpha) - 1.0
    given = [load, alpha, kappa, camber, speed, PRESSURE]
    if FRICTION in surface.inputs:
        given.append(START[FRICTION])
    answers = surface.answers(np.array([given]))
    fx, fy, mz, radius = surface.forces_of(answers)[0].tolist()
    omega = speed * (1.0 + kappa) / surface.rolling_radius(load, speed, PRESSURE)
    time = np.arange(math.ceil(TURNS * 2.0 * math.pi / omega * DEFAULT_RATE)) / DEFAULT_RATE
    angle = (random.uniform(0.0, 2.0 * math.pi) + omega * time) % (2.0 * math.pi) - math.pi
    strain = surface.strain(answers, angle).T
    gain = 1.0 + GAIN_REPEATABILITY * random.standard_normal((len(strain), 1))
    rig_time = np.arange(int(time[-1] * RIG_RATE) + 1) / RIG_RATE
    rig = {
        "Fx": fx,
        "Fy": fy,
        "Fz": load,
        "Mz": mz,
        "loaded_radius": radius,
        "slip_angle": alpha,
        "camber": camber,
        "slip_ratio": kappa,
        "speed": speed,
        "omega": omega,
        "pressure": PRESSURE,
    }
    return Run(
        plan=RunPlan(
            number,
            "",
            "combined" if along else "corner",
            asked,
            PRESSURE,
            speed,
            alpha,
            camber,
            kappa,
            start=12.0 * number,
            friction=START[FRICTION],
            tread_depth=TREAD_DEPTH,
            tread_temperature=TREAD_TEMPERATURE,
        ),
        strain=gain * strain + Options().noise * random.standard_normal(strain.shape),
        rate=DEFAULT_RATE,
        trigger=np.concatenate(([False], np.diff(angle) < -math.pi)),
        rig={name: np.full(rig_time.size, value) for name, value in rig.items()},
        rig_time=rig_time,
    )
