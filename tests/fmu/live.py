"""A small synthetic campaign and its calibration, made once for the tests of stream and FMU."""

import atexit
import shutil
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from tests.once import once
from tests.synthetic import LATERAL, record
from tirelib.campaign import CampaignHeader, Run, RunPlan, TireGeometry, write_campaign
from tirelib.campaign.read import read_campaign
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.train import train
from tirelib.estimators.typical import typical_turn
from tirelib.fmu.build import build_fmu
from tirelib.fmu.native import core_file
from tirelib.fmu.run import LoadedFmu
from tirelib.measured.observations import observe

RATE = 5000.0
SPEED = 18.0
RADIUS = 0.305
PRESSURE = 2.3e5
HEADER = CampaignHeader(
    name="live",
    axes="adapted_sae",
    tire=TireGeometry("live tire", 0.32, RADIUS, 0.012, 0.165, -0.0033),
    gage_lateral=LATERAL,
    rate=RATE,
)


def strain_of(
    load: float,
    tilt: float,
    *,
    seed: int = 0,
    turns: float = 3.4,
    speed: float = SPEED,
    start: float = np.pi,
) -> tuple[np.ndarray, np.ndarray]:
    """Strain and trigger at a load [N] and a lateral tilt [1], at `RATE`."""
    strain, trigger, _ = record(
        turns=turns,
        speed=speed,
        radius=RADIUS,
        start=start,
        half=0.1 + 2.5e-5 * load,
        tilt=tilt,
        dip=1e-3 + 4e-7 * load,
        noise=4e-6,
        rate=RATE,
        seed=seed,
    )
    return strain, trigger


def make_run(number: int, load: float, tilt: float, **options: float) -> Run:
    """One run, with rig quantities at 100 Hz that do not start with a frame."""
    strain, trigger = strain_of(load, tilt, seed=number, **options)
    times = np.arange(0.0037, strain.shape[1] / RATE, 0.01) - 0.01
    angle = -0.3 * tilt
    random = np.random.default_rng(number)
    means = {
        "Fz": load,
        "Fy": -4e4 * angle * load / 4e3,
        "slip_angle": angle,
        "camber": 0.0,
        "slip_ratio": 0.0,
        "speed": options.get("speed", SPEED),
        "pressure": PRESSURE,
        "Fx": 0.0,
    }
    rig = {
        name: mean + 1e-3 * abs(mean) * random.standard_normal(times.size)
        for name, mean in means.items()
    }
    plan = RunPlan(
        number,
        f"runs/{number:03d}.mf4",
        "corner" if tilt else "free",
        load,
        PRESSURE,
        SPEED,
        angle,
        0.0,
        0.0,
    )
    return Run(plan, strain, RATE, 0.0, trigger, rig, times)


def make_runs() -> list[Run]:
    """Three loads, five tilts."""
    points = [(load, tilt) for load in (3e3, 4e3, 5e3) for tilt in (-0.2, -0.1, 0.0, 0.1, 0.2)]
    return [make_run(number, *point) for number, point in enumerate(points, start=1)]


@cache
def folder() -> Path:
    """Return a folder that lives as long as the test process."""
    path = Path(tempfile.mkdtemp(prefix="tirelib_live_"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


@cache
def campaign_folder() -> Path:
    """Return the campaign, written once."""
    return (
        once("live", lambda at: write_campaign(at / "campaign", HEADER, make_runs())) / "campaign"
    )


@cache
def calibration_file() -> Path:
    """Return the calibration, made once."""
    return once("live_calibration", _calibrate) / "cal.toml"


def _calibrate(place: Path) -> None:
    told = {"unit": "N", "n": 15, "conditions": 15, "cross_validated_rmse": 12.3, "r2": 0.99}
    campaign = read_campaign(campaign_folder())
    observations = observe([campaign])
    trained = train(observations).calibration
    turn = typical_turn([campaign], observations, trained)
    write_calibration(
        replace(trained, reference=turn),
        place / "cal.toml",
        {"statistics": {"Fz": told}, "data": [{"name": "live"}]},
    )


@cache
def calibration() -> Calibration:
    """Return the calibration."""
    return read_calibration(calibration_file())


def kind(case: tuple[int, bool]) -> str:
    """Name a case of samples and whether Python computes."""
    return f"{'python' if case[1] else 'native'}-{case[0]}"


@cache
def fmu_file(samples: int, *, buffered: bool = False, python: bool = False) -> Path:
    """Return an FMU that takes frames of so many samples."""
    kind = ("_buffered" if buffered else "") + ("_python" if python else "")
    name = f"StrainTire_{samples}{kind}.fmu"

    def build(place: Path) -> None:
        build_fmu(
            calibration_file(),
            place / name,
            samples_per_step=samples,
            sample_rate=RATE,
            buffered=buffered,
            python=python,
        )

    return once(f"fmu_{name}", build) / name


def is_python(fmu: LoadedFmu) -> bool:
    """Tell whether Python computes in an FMU."""
    return (Path(fmu.slave.unzipDirectory) / "resources" / "slavemodule.txt").is_file()


def write_other(known: Calibration, path: Path, fmu: LoadedFmu) -> str:
    """Write a calibration as the FMU's parameter takes it; return the path."""
    if is_python(fmu):
        write_calibration(known, path)
    else:
        path.write_bytes(core_file(known))
    return str(path)
