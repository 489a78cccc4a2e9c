"""Brush parameters from forces: what is known comes back, what is not is said."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tirelib.campaign import (
    CampaignHeader,
    Run,
    RunPlan,
    TireGeometry,
    read_campaign,
    write_campaign,
)
from tirelib.campaign.importing import import_campaign
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import read_tire
from tirelib.inference.identify.brush_fit import BrushFit, fit_brush
from tirelib.inference.identify.brush_study import stiffness_at
from tirelib.inference.identify.error_bands import band_errors, bands, levels
from tirelib.inference.identify.force_data import ForceData, force_data
from tirelib.inference.identify.ring_patch import half_lengths, ring_contact
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces

C, MU, A0, N = 8e6, 0.95, 0.062, 0.45
LOADS = (1500.0, 3000.0, 4500.0, 6000.0)
TRUTH = {"lateral_stiffness": C, "friction": MU, "half_length": A0, "load_power": N}


def cornering_stiffness(fit: BrushFit) -> float:
    return float(stiffness_at(fit, np.array([fit.reference.load]))["slip_angle"][0])


def make(
    angles: np.ndarray,
    *,
    ratios: tuple[float, ...] = (0.0,),
    loads: tuple[float, ...] = LOADS,
    pressures: tuple[float, ...] = (2.0e5,),
    noise: float = 0.0,
    half: np.ndarray | None = None,
    seed: int = 1,
    **more: float,
) -> ForceData:
    """Return forces of a brush whose half length follows (Fz/F0)^N, F0 the median load."""
    grid = np.meshgrid(angles, ratios, loads, pressures, indexing="ij")
    alpha, kappa, load, pressure = (x.ravel() for x in grid)
    rng = np.random.default_rng(seed)
    if half is None:
        half = A0 * (load / np.median(load)) ** N
        half = half * (pressure / np.median(pressure)) ** more.pop("pressure_power", 0.0)
    brush = {"lateral_stiffness": C, "longitudinal_stiffness": 1.5 * C, "friction": MU} | more
    camber = 0.03 * np.sin(np.arange(load.size))
    found = predict_forces(
        PointParameters(half_length=half, **brush), PointConditions(load, alpha, kappa, camber)
    )
    forces = (found.Fx, found.Fy, found.Mz)
    Fx, Fy, Mz = (
        f + noise * s * rng.standard_normal(load.size)
        for f, s in zip(forces, (1.0, 1.0, 0.02), strict=True)
    )
    omega = np.full(load.size, 59.0)
    return ForceData(load, pressure, alpha, kappa, camber, omega, Fx, Fy, Mz, np.arange(load.size))


WIDE = np.radians(np.linspace(-12.0, 12.0, 13))
SMALL = np.radians(np.linspace(-0.6, 0.6, 7))


@pytest.mark.parametrize("robust", [None, 3.0])
def test_exact_forces_give_the_brush_back(robust: float | None) -> None:
    data = make(WIDE, ratios=(-0.08, -0.02, 0.0, 0.03), Fy_offset=40.0, slip_angle_offset=0.003)
    fit = fit_brush(data, robust=robust)
    wanted = TRUTH | {
        "longitudinal_stiffness": 1.5 * C,
        "Fy_offset": 40.0,
        "slip_angle_offset": 0.003,
    }
    for name, value in wanted.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-5), name
    for name in ("Fx_offset", "Mz_offset", "slip_ratio_offset"):
        assert fit.values[name] == pytest.approx(0.0, abs=1e-4), name
    assert max(fit.rmse.values()) < 1e-2
    assert set(fit.status) == {"ok"}
    assert cornering_stiffness(fit) == pytest.approx(2 * C * A0**2, rel=1e-5)


@pytest.mark.parametrize(
    "name_value",
    [
        ("camber_thrust", 0.15),
        ("pressure_power", -0.4),
        ("yaw_compliance", 4e-5),
        ("lateral_compliance", 6e-6),
    ],
)
def test_what_is_freed_is_found(name_value: tuple[str, float]) -> None:
    name, value = name_value
    data = make(WIDE, ratios=(-0.05, 0.0, 0.04), pressures=(1.6e5, 2.0e5, 2.4e5), **{name: value})
    fit = fit_brush(data, free=(name,))
    assert fit.values[name] == pytest.approx(value, rel=1e-3)
    assert fit.values["lateral_stiffness"] == pytest.approx(C, rel=1e-3)
    assert fit_brush(data).rmse["Mz"] > 10.0 * fit.rmse["Mz"]


def test_a_rigid_carcass_is_a_boundary() -> None:
    fit = fit_brush(make(WIDE, noise=20.0), free=("yaw_compliance",))
    at = fit.names.index("yaw_compliance")
    rigid = fit.status[at] == "at boundary"
    assert rigid or abs(fit.value[at]) < 3.0 * fit.std[at]
    stuck = fit_brush(make(WIDE, yaw_compliance=1.2e-3), free=("yaw_compliance",))
    assert stuck.status[stuck.names.index("yaw_compliance")] == "at boundary"


def test_lateral_force_alone_knows_only_the_stiffness_of_the_whole_contact() -> None:
    fit = fit_brush(make(WIDE), forces=("Fy",))
    assert fit.held["half_length"] == (0.06, "assumed: Mz is not fitted")
    status = dict(zip(fit.names, fit.status, strict=True))
    assert status["lateral_stiffness"] == "not identifiable from this campaign"
    assert status["friction"] == "ok"
    assert cornering_stiffness(fit) == pytest.approx(2 * C * A0**2, rel=1e-5)
    known = fit_brush(make(WIDE), forces=("Fy",), held={"half_length": A0})
    assert known.values["lateral_stiffness"] == pytest.approx(C, rel=1e-5)
    assert set(known.status) == {"ok"}


def test_small_slip_tells_nothing_of_friction() -> None:
    fit = fit_brush(make(SMALL, noise=60.0, seed=4))
    status = dict(zip(fit.names, fit.status, strict=True))
    assert status["friction"] != "ok"
    std = dict(zip(fit.names, fit.std / fit.value, strict=True))["lateral_stiffness"]
    assert cornering_stiffness(fit) == pytest.approx(2 * C * A0**2, rel=4.0 * std)


def test_offsets_that_cannot_be_told_apart_are_said() -> None:
    """Small slip angles at one load: an angle offset is a force offset."""
    data = make(SMALL, loads=(4000.0,), noise=60.0)
    fit = fit_brush(data, forces=("Fy",), held={"half_length": A0, "friction": 3.0})
    assert fit.held["load_power"] == (0.0, "one load only")
    status = dict(zip(fit.names, fit.status, strict=True))
    assert status["slip_angle_offset"] == "not identifiable from this campaign"
    assert status["Fy_offset"] == "not identifiable from this campaign"


def test_intervals_hold_the_truth() -> None:
    """With noise alone, errors in standard deviations are of order one: 40 fits, 4 parameters."""
    scores = []
    for seed in range(40):
        fit = fit_brush(make(WIDE, noise=50.0, seed=seed), robust=None)
        values = dict(zip(fit.names, zip(fit.value, fit.std, strict=True), strict=True))
        scores += [(values[n][0] - t) / values[n][1] for n, t in TRUTH.items()]
    # chi-square with 160 degrees (parameters correlate): 0.7 .. 1.45 is beyond 99.9 %
    assert 0.7 < np.mean(np.square(scores)) < 1.45


def test_errors_that_go_together_widen_the_intervals() -> None:
    """An error common to a block of points is not averaged away by many points."""
    data = make(np.radians(np.linspace(-12.0, 12.0, 241)))
    rng = np.random.default_rng(2)
    block = np.arange(len(data)) // 24
    drift = 60.0 * rng.standard_normal(block.max() + 1)[block]
    common = replace(data, Fy=data.Fy + drift, block=block)
    alone = replace(data, Fy=data.Fy + rng.permutation(drift))
    pair = [fit_brush(d, forces=("Fy",), held={"half_length": A0}) for d in (common, alone)]
    k = pair[0].names.index("Fy_offset")
    assert pair[0].std[k] > 2.0 * pair[1].std[k]


def test_outliers_hardly_count() -> None:
    data = make(WIDE, noise=10.0)
    Fy = data.Fy.copy()
    Fy[::17] += 4000.0
    bad = replace(data, Fy=Fy)
    robust, plain = (fit_brush(bad, robust=r).values["friction"] for r in (3.0, None))
    assert abs(robust - MU) < 0.01 < abs(plain - MU)


def test_missing_measurements_are_left_out() -> None:
    data = make(WIDE)
    Mz, Fx = data.Mz.copy(), np.full(len(data), np.nan)
    Mz[::3] = np.nan
    fit = fit_brush(replace(data, Mz=Mz, Fx=Fx))
    assert fit.values["half_length"] == pytest.approx(A0, rel=1e-5)
    assert set(fit.rmse) == {"Fy", "Mz"}


def test_bands_report_the_error_where_it_is() -> None:
    data = make(WIDE, pressures=(1.6e5, 2.4e5))
    error = np.where(data.load > 5000.0, 30.0, 0.0) + np.where(data.pressure < 2e5, 4.0, -4.0)
    rows = {(r.by, round(r.low)): r for r in band_errors(data, error) if r.by in LEVELS}
    assert rows["load", 6000].bias == pytest.approx(30.0)
    assert rows["load", 1500].rmse == pytest.approx(4.0)
    assert rows["pressure", 160000].bias == pytest.approx(30.0 / 4 + 4.0)
    by_angle = [band for band in bands(data) if band.by == "slip_angle"]
    assert sum(band.member.sum() for band in by_angle) == len(data)


def test_levels_are_set_points_or_quarters() -> None:
    jitter = 1.0 + 0.005 * np.sin(np.arange(40))
    assert levels(np.tile([1000.0, 2000.0, 4000.0, 4500.0], 10) * jitter).max() == 3
    assert levels(np.linspace(1000.0, 4000.0, 200)).max() == 3
    assert levels(2e5 * jitter).max() == 0
    assert set(levels(np.array([np.nan, 1.0, 2.0]))) == {-1, 0, 1}


LEVELS = ("load", "pressure")
TIRE = read_tire("table-6-1").tire


class TestRing:
    def test_half_length_of_the_ring_replaces_the_law(self) -> None:
        loads = (2000.0, 3000.0, 4000.0)
        pressures = (1.2e5, 1.4e5)
        blank = make(WIDE, loads=loads, pressures=pressures)
        half = half_lengths(TIRE, blank.load, blank.pressure)
        data = make(WIDE, loads=loads, pressures=pressures, half=half)
        fit = fit_brush(data, tire=TIRE)
        assert not {"load_power", "half_length"} & set(fit.names)
        assert fit.values["lateral_stiffness"] == pytest.approx(C, rel=1e-5)
        assert fit.values["friction"] == pytest.approx(MU, rel=1e-5)
        np.testing.assert_allclose(fit.brush.predict(data).Fy, data.Fy, atol=0.05)

    def test_many_points_are_read_from_a_surface(self) -> None:
        rng = np.random.default_rng(3)
        load, pressure = rng.uniform(1500.0, 4500.0, 300), rng.uniform(1.1e5, 1.5e5, 300)
        surface = half_lengths(TIRE, load, pressure)[:20]
        edges = ring_contact(TIRE, load[:20], pressure[:20]).edges
        # the surface's own error; contact length is smooth in both
        np.testing.assert_allclose(
            surface, 0.5 * TIRE.ring_radius * (edges[:, 1] - edges[:, 0]), rtol=1e-4
        )

    def test_higher_pressure_shortens_the_contact(self) -> None:
        soft = replace(TIRE, radial_pressure_slope=2.0)
        short, long = half_lengths(soft, np.full(2, 3000.0), np.array([1.6e5, 1.2e5]))
        assert short < long

    def test_unknown_pressure_is_refused(self) -> None:
        data = make(WIDE)
        with pytest.raises(ParameterError, match="pressure is unknown at 52 of 52"):
            fit_brush(replace(data, pressure=np.full(len(data), np.nan)), tire=TIRE)


@pytest.mark.parametrize(
    ("data", "options", "error", "message"),
    [
        (make(np.zeros(8)), {}, CalibrationError, "slip angles span 0 deg and slip ratios 0"),
        (
            make(np.zeros(8), ratios=(0.0, 0.1)),
            {"forces": ("Fy",)},
            CalibrationError,
            "the slip angle does not vary, so Fy does not determine",
        ),
        (make(WIDE), {"forces": ("Fx",)}, CalibrationError, "the slip ratio does not vary"),
        (make(WIDE), {"forces": ("Fz",)}, ParameterError, "'Fz'; allowed are Fy, Fx, Mz"),
        (make(WIDE), {"free": ("colour",)}, ParameterError, "'colour' is no parameter"),
        (make(WIDE), {"held": {"half_length": 62.0}}, ParameterError, r"0.005 .. 0.5 m; give SI"),
        (make(WIDE), {"robust": -1.0}, ParameterError, "robust = -1"),
        (
            make(WIDE),
            {
                "forces": ("Fy",),
                "held": {
                    "lateral_stiffness": C,
                    "friction": MU,
                    "load_power": N,
                    "slip_angle_offset": 0.0,
                    "Fy_offset": 0.0,
                },
            },
            ParameterError,
            "every parameter is held",
        ),
    ],
)
def test_what_cannot_be_fitted_is_refused(
    data: ForceData, options: dict, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        fit_brush(data, **options)


def test_forces_that_were_not_recorded_are_refused() -> None:
    data = make(WIDE)
    none = np.full(len(data), np.nan)
    with pytest.raises(CalibrationError, match="Fy not measured"):
        fit_brush(replace(data, Fy=none))
    with pytest.raises(CalibrationError, match="Mz is not measured"):
        fit_brush(replace(data, Mz=none), forces=("Fy", "Mz"))


def test_braking_alone_gives_one_stiffness() -> None:
    data = make(np.zeros(1), ratios=(-0.2, -0.1, -0.05, -0.02, -0.01, 0.01, 0.02, 0.05, 0.1, 0.2))
    fit = fit_brush(data, held={"half_length": A0})
    assert fit.values["lateral_stiffness"] == pytest.approx(1.5 * C, rel=1e-4)
    assert fit.values["friction"] == pytest.approx(MU, rel=1e-4)


def test_bad_points_are_refused() -> None:
    data = make(WIDE)
    with pytest.raises(ParameterError, match=r"load = -1 at point 0, 52 such points"):
        replace(data, load=np.full(52, -1.0))


def _campaign(folder: Path, runs: list[Run]) -> None:
    header = CampaignHeader("c", "sae", TireGeometry("t", 0.3))
    write_campaign(folder, header, iter(runs), axes="sae")


def test_runs_are_means_and_sweeps_are_samples(tmp_path: Path) -> None:
    time = np.arange(200) / 10.0
    angle = 0.1 * np.sin(time)
    steady = RunPlan(0, "runs/0.mf4", "corner", 3000.0, 2e5, 18.0, 0.02, 0.0, 0.0)
    empty = [np.nan] * 6
    sweep = RunPlan(1, "runs/1.mf4", "sweep", *empty)
    ones = np.ones(200)
    rig = {"Fz": 3000.0 + 100.0 * np.sin(time), "Fy": -900.0 + angle, "slip_ratio": -2e-4 * ones}
    rig["slip_angle"] = 0.02 * ones
    load = np.where(time < 1.0, -5.0, 2000.0)
    moving = {"Fz": load, "Fy": -1e4 * angle, "slip_angle": angle, "pressure": 1.9e5 * ones}
    _campaign(
        tmp_path / "c",
        [Run(steady, rig=rig, rig_time=time), Run(sweep, rig=moving, rig_time=time)],
    )
    data = force_data(read_campaign(tmp_path / "c"))
    assert len(data) == 1 + 190  # the first second has no load
    assert data.load[0] == pytest.approx(rig["Fz"].mean())
    assert data.pressure[0] == pytest.approx(2e5)  # the set point stands in
    assert data.slip_ratio[0] == 0.0  # freely rolling by its kind
    assert np.isnan(data.Mz).all()
    np.testing.assert_allclose(data.slip_angle[1:], angle[10:], atol=1e-9)
    assert data.block.tolist() == [0] + [1] * 90 + [2] * 100


def test_slip_ratio_by_travel_speed_becomes_that_of_the_wheel_plane(tmp_path: Path) -> None:
    plan = RunPlan(0, "runs/0.mf4", "combined", 3000.0, 2e5, 18.0, 0.2, 0.0, 0.0)
    rig = {"slip_angle": np.full(5, 0.2), "slip_ratio": np.full(5, np.cos(0.2) - 1.0)}
    rig["Fz"] = np.full(5, 3000.0)
    _campaign(tmp_path / "c", [Run(plan, rig=rig, rig_time=np.arange(5.0))])
    campaign = read_campaign(tmp_path / "c")
    assert force_data(campaign, travel_speed=True).slip_ratio[0] == pytest.approx(0.0, abs=1e-12)
    assert force_data(campaign).slip_ratio[0] == pytest.approx(np.cos(0.2) - 1.0)


def test_a_campaign_without_slip_angles_is_refused(tmp_path: Path) -> None:
    plan = RunPlan(0, "runs/0.mf4", "sweep", *[np.nan] * 6)
    _campaign(tmp_path / "c", [Run(plan, rig={"Fz": np.ones(5)}, rig_time=np.arange(5.0))])
    with pytest.raises(CalibrationError, match="no run holds a slip angle"):
        force_data(read_campaign(tmp_path / "c"))


def test_real_flat_belt_run(shared: Callable[[str], Path], tmp_path: Path) -> None:
    """A racing tire on a real rig: the errors that a fit of its own found, 165 and 158 N."""
    source, names = shared("real/cornering.mat"), shared("real/cornering.map.toml")
    import_campaign([source], names, tmp_path / "c")
    data = force_data(read_campaign(tmp_path / "c"))
    constant = {"load_power": 0.0, "slip_angle_offset": 0.0, "Fy_offset": 0.0}
    plain = fit_brush(data, forces=("Fy",), held=constant, robust=None)
    # other samples and blocks than here: 2 %
    assert plain.rmse["Fy"] == pytest.approx(165.0, rel=0.02)
    offsets = fit_brush(data, forces=("Fy",), held={"load_power": 0.0}, robust=None)
    assert offsets.rmse["Fy"] == pytest.approx(157.7, rel=0.03)
    full = fit_brush(data, forces=("Fy",), robust=None)
    assert full.rmse["Fy"] == pytest.approx(130.3, rel=0.03)
    assert 0.26 < full.values["load_power"] * 1.0 < 0.33  # C goes with Fz^.53 to Fz^.66
