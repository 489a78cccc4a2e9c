"""What is written comes back: signs and units over the axis systems, headers, plans, clocks."""

import math
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.unit.campaign.campaign_synthetic import HEADER, RATE, Write, changed
from tirelib.campaign import (
    CampaignHeader,
    Run,
    RunPlan,
    TireGeometry,
    Tolerance,
    read_campaign,
    write_campaign,
)
from tirelib.campaign.mdf import read_mdf
from tirelib.core.axes import FLIPPED, sign
from tirelib.core.errors import FormatError, ParameterError, ShapeError
from tirelib.core.units import from_si

axis_systems = st.sampled_from(sorted(FLIPPED))
strain_units = st.sampled_from(["1", "%", "mm/m", "ustrain", "um/m"])
angles = st.floats(-0.5, 0.5)
EXACT = 1e-12  # a few roundings of a unit's factor there and back


def run_with(plan: RunPlan, fy: float, fz: float, strain: float) -> Run:
    times = np.array([0.0, 0.01, 0.02])
    rig = {
        "Fy": fy + times,
        "Fz": fz + times,
        "Fx": times,
        "Mz": 3.0 * times,
        "slip_angle": plan.slip_angle + times,
        "tread_temperature": 300.0 + times,
    }
    gages = strain * (1.0 + np.arange(10.0).reshape(2, 5))
    trigger = np.array([False, True, False, False, True])
    return Run(plan, gages, RATE, 0.5, trigger, rig, times)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    axes=axis_systems,
    unit=strain_units,
    slip_angle=angles,
    fy=st.floats(-1e4, 1e4),
    fz=st.floats(1.0, 1e4),
    strain=st.floats(-0.01, 0.01),
    lateral=st.floats(0.001, 0.08),
)
def test_writing_and_reading_gives_the_same_in_every_axis_system(
    tmp_path_factory: pytest.TempPathFactory,
    axes: str,
    unit: str,
    slip_angle: float,
    fy: float,
    fz: float,
    strain: float,
    lateral: float,
) -> None:
    header = replace(HEADER, axes=axes, strain_unit=unit, gage_lateral=(lateral, -lateral))
    plan = RunPlan(7, "runs/007.mf4", "corner", fz, 2.3e5, 18.0, slip_angle, 0.02, -0.1, 3.5)
    run = run_with(plan, fy, fz, strain)
    folder = tmp_path_factory.mktemp("axes") / "c"
    write_campaign(folder, header, [run])
    campaign = read_campaign(folder)
    back = campaign.load(campaign.plans[0])

    assert campaign.header == header
    for name in ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio"):
        # runs.csv keeps 12 digits
        assert getattr(back.plan, name) == pytest.approx(getattr(plan, name), rel=1e-11, abs=1e-12)
    assert run.strain is not None
    assert back.strain is not None
    np.testing.assert_allclose(back.strain, run.strain, rtol=EXACT)
    assert back.trigger is not None
    np.testing.assert_array_equal(back.trigger, [False, True, False, False, True])
    np.testing.assert_array_equal(back.rig_time, run.rig_time)
    assert back.start_time == 0.5
    assert set(back.rig) == set(run.rig)
    for name, samples in run.rig.items():
        np.testing.assert_allclose(back.rig[name], samples, rtol=EXACT, atol=1e-13)


@settings(max_examples=9, deadline=None)
@given(axes=axis_systems, quantity=st.sampled_from(["Fy", "Fz", "Mz", "Fx", "slip_angle"]))
def test_the_file_has_the_sign_of_its_axes(
    tmp_path_factory: pytest.TempPathFactory, axes: str, quantity: str
) -> None:
    plan = RunPlan(0, "", "corner", 4e3, 2e5, 18.0, 0.05, 0.0, 0.0)
    folder = tmp_path_factory.mktemp("signs") / "c"
    run = run_with(plan, -2e3, 4e3, 0.002)
    write_campaign(folder, replace(HEADER, gage_lateral=(0.03, -0.03)), [run], axes=axes)
    raw = {c.name: c.samples for group in read_mdf(folder / "runs/000.mf4") for c in group.channels}
    unit, dimension = {"slip_angle": ("deg", "angle"), "Mz": ("Nm", "moment")}.get(
        quantity, ("N", "force")
    )
    expected = sign(quantity, axes) * from_si(run.rig[quantity], unit, dimension)
    np.testing.assert_allclose(raw[quantity], expected, rtol=EXACT)
    document = tomllib.loads((folder / "campaign.toml").read_text())
    assert document["axes"] == axes
    assert document["gages"]["lateral_m"][0] == (0.03 if axes == "iso" else -0.03)


def test_a_campaign_comes_back_run_by_run(write: Write, sound_runs: tuple[Run, ...]) -> None:
    campaign = read_campaign(write())
    assert campaign.header == HEADER
    assert [plan.run for plan in campaign.plans] == list(range(12))
    for before, after in zip(sound_runs, campaign.runs(), strict=True):
        assert after.plan.file == before.plan.file
        assert after.plan.start == before.plan.start
        assert before.strain is not None
        assert after.strain is not None
        np.testing.assert_allclose(after.strain, before.strain, rtol=EXACT)


def test_extra_columns_are_kept(write: Write, sound_runs: tuple[Run, ...]) -> None:
    def add(run: Run) -> Run:
        return replace(run, plan=replace(run.plan, extra={"rim_width_mm": 7.5, "rim": "A/b, c"}))

    plan = read_campaign(write(changed(sound_runs[:2], 1, add))).plans
    assert plan[0].extra == {}
    assert plan[1].extra == {"rim_width_mm": 7.5, "rim": "A/b, c"}


def test_what_is_known_of_road_and_tread_comes_back(
    write: Write, sound_runs: tuple[Run, ...]
) -> None:
    def known(run: Run) -> Run:
        return replace(
            run,
            plan=replace(run.plan, friction=0.4, tread_depth=0.0065, tread_temperature=313.15),
            rig={**run.rig, "friction": np.full(run.rig["Fz"].size, 0.41)},
        )

    folder = write(changed(sound_runs[:2], 1, known))
    header, first, second = (folder / "runs.csv").read_text().splitlines()
    assert header.endswith("friction,tread_depth_mm,tread_temperature_degC")
    assert first.endswith(",,,")
    assert second.endswith("0.4,6.5,40.0")
    campaign = read_campaign(folder)
    plan = campaign.plans[1]
    assert (plan.friction, plan.tread_depth) == pytest.approx((0.4, 0.0065))
    assert plan.tread_temperature == pytest.approx(313.15)
    assert np.isnan(campaign.plans[0].friction)
    assert campaign.load(plan).mean("friction") == pytest.approx(0.41)


@pytest.mark.parametrize("cell", ["-0.1", "wet", "3"])
def test_a_friction_that_cannot_be_is_refused(
    write: Write, sound_runs: tuple[Run, ...], cell: str
) -> None:
    def known(run: Run) -> Run:
        return replace(run, plan=replace(run.plan, friction=0.25))

    folder = write(changed(sound_runs[:2], 1, known))
    file = folder / "runs.csv"
    file.write_text(file.read_text().replace("0.25", cell))
    with pytest.raises(FormatError, match="line 3, friction"):
        read_campaign(folder)


def test_forces_alone_make_a_campaign(tmp_path: Path) -> None:
    nan = math.nan
    plan = RunPlan(0, "", "sweep", nan, nan, nan, nan, nan, nan)
    times = np.arange(5) / 100.0
    run = Run(plan, rig={"Fz": np.full(5, 1e3), "Fy": times}, rig_time=times)
    header = CampaignHeader("forces", "sae", TireGeometry("kart", 0.2))
    write_campaign(tmp_path / "c", header, [run])
    campaign = read_campaign(tmp_path / "c")
    back = campaign.load(campaign.plans[0])
    assert campaign.header.gage_lateral == ()
    assert math.isnan(campaign.header.rate)
    assert math.isnan(back.plan.load)
    assert back.strain is None
    assert back.trigger is None
    assert back.mean("Fz") == pytest.approx(1e3)
    assert back.mean("Fx") is None


def test_strain_alone_makes_a_campaign(write: Write, sound_runs: tuple[Run, ...]) -> None:
    bare = replace(sound_runs[0], rig={}, rig_time=None, trigger=None)
    (back,) = read_campaign(write([bare])).runs()
    assert back.rig == {}
    assert back.rig_time is None
    assert back.trigger is None


def test_a_channel_nobody_knows_keeps_name_and_dimension(
    write: Write, sound_runs: tuple[Run, ...]
) -> None:
    run = sound_runs[0]
    odd = replace(
        run,
        rig={**run.rig, "rim_offset": np.full_like(run.rig["Fz"], 0.04)},
        dimensions={"rim_offset": "length"},
    )
    folder = write([odd])
    channels = {c.name: c for g in read_mdf(folder / "runs/000.mf4") for c in g.channels}
    assert channels["rim_offset"].unit == "mm"
    (back,) = read_campaign(folder).runs()
    assert back.mean("rim_offset") == pytest.approx(0.04)
    assert back.dimensions == {"rim_offset": "length"}


def test_the_hash_follows_the_content_and_not_the_place(write: Write, tmp_path: Path) -> None:
    folder = write()
    before = read_campaign(folder).content_hash()
    moved = folder.rename(tmp_path / "elsewhere")
    assert read_campaign(moved).content_hash() == before
    file = moved / "runs" / "003.mf4"
    content = file.read_bytes()
    file.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))  # same length, one bit
    assert read_campaign(moved).content_hash() != before
    file.unlink()
    with pytest.raises(FormatError, match=r"003\.mf4: it cannot be read"):
        read_campaign(moved).content_hash()


def test_one_run_is_in_memory_at_a_time(tmp_path: Path, sound_runs: tuple[Run, ...]) -> None:
    written = []

    def stream() -> Iterator[Run]:
        for run in sound_runs[:3]:
            written.append(len(list(tmp_path.glob("c/runs/*.mf4"))))
            yield run

    write_campaign(tmp_path / "c", HEADER, stream())
    assert written == [0, 1, 2]


def test_an_old_campaign_is_replaced_only_on_request(
    tmp_path: Path, sound_runs: tuple[Run, ...]
) -> None:
    write_campaign(tmp_path, HEADER, sound_runs[:3])
    with pytest.raises(ParameterError, match="a campaign is already there"):
        write_campaign(tmp_path, HEADER, sound_runs[:1])
    write_campaign(tmp_path, HEADER, sound_runs[:1], overwrite=True)
    assert [file.name for file in (tmp_path / "runs").iterdir()] == ["000.mf4"]


def test_arrays_that_do_not_match_are_refused(tmp_path: Path, sound_runs: tuple[Run, ...]) -> None:
    run = sound_runs[0]
    assert run.strain is not None
    with pytest.raises(ShapeError, match=r"strain has shape \(4, 1800\); \(5, n_samples\)"):
        write_campaign(tmp_path / "a", HEADER, [replace(run, strain=run.strain[:4])])
    with pytest.raises(ShapeError, match="rig quantities without rig_time"):
        write_campaign(tmp_path / "b", HEADER, [replace(run, rig_time=None)])
    with pytest.raises(ShapeError, match=r"trigger has shape \(7,\)"):
        write_campaign(tmp_path / "c", HEADER, [replace(run, trigger=np.zeros(7, dtype=bool))])
    with pytest.raises(ParameterError, match="run 0 occurs twice"):
        write_campaign(tmp_path / "d", HEADER, [run, run])
    with pytest.raises(ParameterError, match="axes = 'din'"):
        write_campaign(tmp_path / "e", HEADER, [run], axes="din")
    assert not (tmp_path / "e").exists()


def test_a_hold_keeps_the_newest_value_and_knows_nothing_before_the_first() -> None:
    plan = RunPlan(0, "", "free", 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    run = Run(plan, rig={"Fz": np.array([1.0, 2.0, 3.0])}, rig_time=np.array([0.1, 0.2, 0.4]))
    held = run.hold("Fz", np.array([0.05, 0.1, 0.19, 0.2, 0.39, 0.4, 9.0]))
    np.testing.assert_array_equal(held, [np.nan, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0])
    assert run.hold("Fy", np.array([0.1])) is None


def test_a_hold_does_not_hang_on_the_last_digit_of_a_clock() -> None:
    plan = RunPlan(0, "", "free", 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    rig_time = np.arange(0.0, 100.0) * 0.01
    run = Run(plan, np.zeros((1, 10_000)), 1e4, rig={"Fz": np.arange(100.0)}, rig_time=rig_time)
    held = run.hold("Fz", run.time())
    assert held is not None
    np.testing.assert_array_equal(held, np.repeat(np.arange(100.0), 100))


def test_a_header_needs_only_name_axes_and_radius(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(
        'format = "tirelib-campaign/1"\nname = "n"\naxes = "sae"\n'
        '[tire]\nname = "t"\nfree_radius_m = 0.2\n'
    )
    (tmp_path / "runs.csv").write_text(
        "run,file,kind,load_N,pressure_bar,speed_kmh,slip_angle_deg,camber_deg,slip_ratio\n"
        "4,a.mf4,sweep,,,,,,\n5,b.mf4,corner,1000,0.8,40,-3,1,0\n"
    )
    campaign = read_campaign(tmp_path)
    assert campaign.header == CampaignHeader("n", "sae", TireGeometry("t", 0.2), rate=math.nan) or (
        math.isnan(campaign.header.rate)
    )
    assert campaign.header.tolerance is None
    sweep, corner = campaign.plans
    assert math.isnan(sweep.slip_angle)
    assert corner.slip_angle == pytest.approx(math.radians(3.0))  # sae to iso
    assert corner.load == 1000.0
    assert corner.start is None


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "Messung_01.csv").write_text("")
    with pytest.raises(
        FormatError, match=r"Messung_01.csv, \.\.\..*make one with `tirelib import`"
    ):
        read_campaign(tmp_path)
    with pytest.raises(FormatError, match="no such folder"):
        read_campaign(tmp_path / "nothing")


def test_tolerance_comes_back(tmp_path: Path, sound_runs: tuple[Run, ...]) -> None:
    header = replace(HEADER, tolerance=Tolerance(0.1, 0.2, 0.3, 0.4))
    write_campaign(tmp_path, header, sound_runs[:1])
    assert read_campaign(tmp_path).header.tolerance == Tolerance(0.1, 0.2, 0.3, 0.4)
