"""A campaign of closed-form waveforms, quantised as the default device does it."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.synthetic import synthetic_run, write
from tirebench.wire.device import Device
from tirelib.campaign import Run


def quantised(run: Run) -> Run:
    """Return the run with strain as counts can say it, so that the wire loses nothing."""
    strain = np.asarray(run.strain)
    return replace(run, strain=np.rint(strain / Device().scale) * Device().scale)


def tiny_runs() -> list[Run]:
    """Three runs of six turns at 65 km/h: 0.65 s each."""
    conditions = [(3000.0, 0.0), (4500.0, 0.02), (6000.0, -0.03)]
    return [
        quantised(synthetic_run(number, load=load, slip_angle=angle, turns=6.0, seed=5))
        for number, (load, angle) in enumerate(conditions, start=1)
    ]


def write_tiny_campaign(folder: Path) -> Path:
    """Write the three runs."""
    return write(folder, tiny_runs())
