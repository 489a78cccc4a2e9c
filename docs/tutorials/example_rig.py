"""A rig for the tutorials: a virtual tire that is measured in a second.

It writes what a laboratory would hand over: a campaign folder with five gages at 10 kHz and the
rig's own channels. The strain comes from the response surface inside ``VirtualTire.fmu``, which
holds solutions of the numerical rig (``tirelib rig``); noise and errors of the set points are added
here.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

import tirelib
from tirelib.campaign import (
    Campaign,
    CampaignHeader,
    Run,
    RunPlan,
    TireGeometry,
    Tolerance,
    write_campaign,
)
from tirelib.fmu.virtual.spec import default_surface
from tirelib.fmu.virtual.surface import shared_surface

RATE = 1e4  # of the gages, Hz
PRESSURE = 2.3e5  # Pa
SPEED = 65 / 3.6  # m/s
NOISE = 5e-6  # of a strain sample


def measure(
    folder: Path,
    conditions: Iterable[tuple[float, float, float]],
    *,
    seed: int,
    turns: float = 5.0,
) -> Campaign:
    """Measure the virtual tire and return the campaign.

    ``conditions`` are (Fz [N], slip angle [deg], slip ratio [1]) of each run, straight up, at
    65 km/h and 2.3 bar; ``seed`` is the day: noise and set-point errors differ from day to day.
    """
    surface = shared_surface(default_surface())
    random = np.random.default_rng(seed)
    header = CampaignHeader(
        name=f"tutorial, day {seed}",
        axes="iso",
        tire=TireGeometry("virtual tire", 0.3155, 0.302, 0.012, 0.165, -0.0033),
        gage_lateral=tuple(surface.lateral),
        rate=RATE,
        tolerance=Tolerance(load=0.005, pressure=0.002, speed=0.001, gain=0.003),
        rig_name="response surface of the numerical rig",
    )

    def runs() -> Iterable[Run]:
        for number, (load, degrees, kappa) in enumerate(conditions):
            alpha = np.deg2rad(degrees)
            true_load = load * (1 + 0.005 * random.standard_normal())
            state = np.array([[true_load, alpha, kappa, 0.0, SPEED, PRESSURE]])
            answers = surface.answers(state)
            fx, fy, mz, radius = surface.forces_of(answers)[0]
            free = surface.rolling_radius(true_load, SPEED, PRESSURE)
            omega = (1 + kappa) * SPEED / free
            time = np.arange(int(turns * 2 * np.pi / omega * RATE)) / RATE
            angle = random.uniform(-3, 3) + omega * time
            wheel_angle = (angle + np.pi) % (2 * np.pi) - np.pi
            strain = surface.strain(answers, wheel_angle).T
            slow = np.zeros(int(time[-1] * 100))  # the rig's own channels: 100 values a second
            yield Run(
                plan=RunPlan(
                    number,
                    "",
                    "corner" if degrees else "free",
                    load,
                    PRESSURE,
                    SPEED,
                    alpha,
                    0.0,
                    kappa,
                    start=12.0 * number,
                    friction=0.9,
                    tread_depth=0.008,
                    tread_temperature=313.15,
                ),
                strain=strain + NOISE * random.standard_normal(strain.shape),
                rate=RATE,
                trigger=np.concatenate(([False], np.diff(wheel_angle) < -np.pi)),
                rig={
                    "Fx": slow + fx,
                    "Fy": slow + fy,
                    "Fz": slow + true_load,
                    "Mz": slow + mz,
                    "loaded_radius": slow + radius,
                    "slip_angle": slow + alpha,
                    "camber": slow,
                    "slip_ratio": slow + kappa,
                    "speed": slow + SPEED,
                    "omega": slow + omega,
                    "pressure": slow + PRESSURE,
                },
                rig_time=np.arange(slow.size) / 100,
            )

    write_campaign(folder, header, runs(), overwrite=True)
    return tirelib.read_campaign(folder)
