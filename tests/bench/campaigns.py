"""A campaign of closed-form waveforms, quantised as the default device does it."""

from pathlib import Path

import numpy as np

from bench.device import Device
from tests.synthetic import LATERAL, RATE, FloatArray, record
from tirelib.campaign import CampaignHeader, Run, RunPlan, TireGeometry, write_campaign


def make_run(number: int, *, turns: float = 6.0, half: float = 0.2, speed: float = 18.0) -> Run:
    """Run of a few turns; speed is measured at 100 Hz and swings a little."""
    strain, trigger, omega = record(turns=turns, half=half, speed=speed, noise=2e-6, seed=number)
    strain = np.rint(strain / Device().scale) * Device().scale
    n = int(strain.shape[1] / RATE * 100.0) + 1
    time = np.arange(n) / 100.0
    rig: dict[str, FloatArray] = {
        "Fz": np.full(n, 3000.0 + 100.0 * number),
        "Fy": np.full(n, -50.0 * number),
        "slip_angle": np.full(n, 0.01 * number),
        "slip_ratio": np.zeros(n),
        "speed": speed + 0.01 * np.sin(time * 40.0),
        "pressure": np.full(n, 2.3e5),
        "camber": np.zeros(n),
        "omega": np.full(n, omega),
    }
    plan = RunPlan(run=number, file=f"runs/{number:03d}.mf4", kind="free", load=3000.0,
                   pressure=2.3e5, speed=speed, slip_angle=0.0, camber=0.0,
                   slip_ratio=0.0)  # fmt: skip
    return Run(plan, strain, RATE, 0.0, trigger, rig, time)


def write_tiny_campaign(folder: Path) -> None:
    """Three runs of six turns at 65 km/h: 0.64 s each."""
    header = CampaignHeader("tiny", "iso", TireGeometry("synthetic", 0.305), LATERAL, RATE)
    runs = [make_run(number, half=0.18 + 0.02 * number) for number in (1, 2, 3)]
    write_campaign(folder, header, runs)
