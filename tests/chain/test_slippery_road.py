"""A calibration from a dry road meets the virtual tire's strain on roads of any friction."""

from collections.abc import Sequence

import numpy as np

from tirelib.campaign import CampaignHeader, TireGeometry
from tirelib.estimators.calibrate import calibrate_chain
from tirelib.estimators.calibration import LARGEST_ANGLE_STD
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.unknowns import FRICTION, TWO_SIGMA
from tirelib.features.extract import extract_features
from tirelib.fmu.virtual.spec import friction_surface
from tirelib.fmu.virtual.surface import read_surface
from tirelib.observations import TRUTH, Observations, concatenate_features
from tirelib.signal import cut_turns

RATE, SPEED, PRESSURE, DRY = 1e4, 65.0 / 3.6, 2.3e5, 0.95
HEADER = CampaignHeader(
    "virtual", "iso", TireGeometry("virtual", 0.316, 0.303, 0.0115, 0.168, -0.003),
    (-0.06, -0.03, 0.0, 0.03, 0.06), RATE,
)  # fmt: skip


def shown(conditions: Sequence[tuple[float, float, float]], *, told: bool) -> Observations:
    """Two turns of strain at each load, slip angle and friction; `told`: the friction is known."""
    surface, parts, truths = read_surface(friction_surface()), [], []
    rng = np.random.default_rng([len(conditions), told])
    for load, angle, friction in conditions:
        at = np.array([load, angle, np.cos(angle) - 1.0, 0.0, SPEED, PRESSURE, friction])
        answer = surface.answers(at[None])
        force = surface.forces_of(answer)[0]
        omega = SPEED * np.cos(angle) / surface.rolling_radius(load, SPEED, PRESSURE)
        angles = -0.2 + omega * np.arange(int(4.6 * np.pi / omega * RATE)) / RATE
        phi = angles % (2.0 * np.pi) - np.pi
        strain = surface.strain(answer, phi, surface.waveform(answer)).T
        strain = strain * (1.0 + 3e-3 * rng.standard_normal((5, 1)))  # gains, from run to run
        strain = strain + 4e-6 * rng.standard_normal(strain.shape)
        turns = cut_turns(
            strain, RATE, surface.lateral.tolist(), speed=SPEED, pressure=PRESSURE, camber=0.0,
            friction=friction if told else np.nan, tread_depth=0.008, tread_temperature=313.0,
        )  # fmt: skip
        parts.append(extract_features(turns))
        measured = (force[0], force[1], load, force[2], angle, at[2])
        truths.append(np.tile(measured, (len(parts[-1]), 1)))
    truth = np.concatenate(truths).T
    run = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    nominal = {"load": truth[2], "slip_angle": truth[4]}
    return Observations(
        concatenate_features(parts), run, 0 * run, run, run < 0,
        dict(zip(TRUTH, truth, strict=True)), nominal, (HEADER,),
    )  # fmt: skip


def test_a_dry_calibration_tells_slip_angles_of_any_road_within_its_intervals() -> None:
    angles = np.deg2rad(np.arange(-5.0, 6.0))
    dry = shown(
        [(load, a, DRY) for load in (1300.0, 2900.0, 4500.0, 6100.0, 7700.0) for a in angles],
        told=True,
    )
    chain, _ = calibrate_chain(dry, range(5))
    assert chain.moment is not None
    rng = np.random.default_rng(4)
    drawn = [
        (rng.uniform(2000.0, 7000.0), np.deg2rad(rng.uniform(-5.0, 5.0)), rng.uniform(*FRICTION))
        for _ in range(60)
    ]
    seen = shown(drawn, told=False)
    good = seen.usable
    found, _ = chain.predict(compute_regressors(seen.features, range(5)))
    angle, truth = found["alpha"], seen.truth["slip_angle"]
    valid = good & angle.valid & (angle.std <= LARGEST_ANGLE_STD)
    assert valid.sum() > 0.75 * good.sum()
    error = np.abs(angle.value - truth)[valid]
    assert np.mean(error <= TWO_SIGMA * angle.std[valid]) >= 0.9
    # by the dry curve alone it would be further off
    alone, _ = chain.predict(
        compute_regressors(seen.features, range(5)) | {"friction": np.full(len(seen), DRY)}
    )
    own, dry_error = ((told["alpha"].value - truth)[good] for told in (found, alone))
    assert np.sqrt(np.mean(own**2)) < 0.8 * np.sqrt(np.mean(dry_error**2))
    for name, measured in (("Fz", "Fz"), ("Fy", "Fy")):
        sure = good & found[name].valid
        apart = np.abs(found[name].value - seen.truth[measured])[sure]
        assert np.mean(apart <= TWO_SIGMA * found[name].std[sure]) >= 0.9
    # straight on, a slippery road is as good as a dry one
    straight = shown([(4000.0, 0.0, 0.4)], told=False)
    plain, _ = chain.predict(compute_regressors(straight.features, range(5)))
    assert (plain["alpha"].std[straight.usable] < np.deg2rad(0.2)).all()
