"""Observations of a made-up tire with cornering, camber and traction, made once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from tests.once import once, value_once
from tests.synthetic import cornering_runs, synthetic_run, write
from tirelib.campaign import Campaign, Run, read_campaign
from tirelib.estimators.calibrate import calibrate_chain
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.chain import Chain
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.links import Links
from tirelib.estimators.train import Trained, train
from tirelib.measured.observations import Observations, observe

SLIPS = (-0.3, -0.05, 0.0, 0.05, 0.3)


def camber_runs() -> list[Run]:
    points = [(c, a) for c in (-4.0, 0.0, 4.0) for a in (-10, -5, -3, -1, 0, 1, 3, 5, 10)]
    return [
        synthetic_run(
            i,
            load=4500.0,
            slip_angle=float(np.deg2rad(a)),
            camber=float(np.deg2rad(c)),
            kind="camber",
        )
        for i, (c, a) in enumerate(points)
    ]


def braking_runs() -> list[Run]:
    return [
        synthetic_run(
            i,
            load=4500.0,
            slip_ratio=k,
            kind="free" if k == 0.0 else "brake" if k < 0.0 else "drive",
        )
        for i, k in enumerate(SLIPS)
    ]


def speed_runs() -> list[Run]:
    speeds = (10.0, 65.0, 150.0)
    return [
        synthetic_run(i, load=4500.0, speed=v / 3.6, kind="free", noise=2e-5)
        for i, v in enumerate(speeds)
    ] + [synthetic_run(3, load=3000.0, speed=65.0 / 3.6, kind="free")]


def one_chain() -> Callable[..., tuple[Chain, Links]]:
    """Calibrate the full gage set only: reports show no other, and it takes a fifth of the time."""
    made: list[tuple[Chain, Links]] = []

    def calibrate(
        observations: Observations, gages: Sequence[int], progress: object = None
    ) -> tuple[Chain, Links]:
        if not made:
            made.append(calibrate_chain(observations, gages))
        return made[0]

    return calibrate


@dataclass(frozen=True)
class World:
    """Campaigns of the made-up tire and what is known of them."""

    campaigns: dict[str, Campaign]
    observations: dict[str, Observations]
    estimates: dict[str, Estimates]
    trained: Trained

    @property
    def calibration(self) -> Calibration:
        return self.trained.calibration


@pytest.fixture(scope="session")
def world() -> World:
    return value_once("report_world", made_world)


def made_world() -> World:
    runs = {
        "set1": [run for run in cornering_runs() if run.plan.load in (1500.0, 4500.0, 7500.0)],
        "set2": camber_runs(),
        "brake_drive": braking_runs(),
        "set3": speed_runs(),
    }
    folder = once("report", lambda at: [write(at / k, v, name=k) for k, v in runs.items()])
    campaigns = {name: read_campaign(folder / name) for name in runs}
    seen = {name: observe([campaign]) for name, campaign in campaigns.items()}
    together = observe([campaigns[name] for name in ("set1", "set2", "brake_drive")])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tirelib.estimators.train.calibrate_chain", one_chain())
        trained = train(together)
    estimates = {k: trained.calibration.estimate(o.features) for k, o in seen.items()}
    return World(campaigns, seen, estimates, trained)
