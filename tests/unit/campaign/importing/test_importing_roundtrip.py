"""What goes into a file comes out of the campaign: every format, SI and ISO, to 1e-12."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import synthetic
from tests.unit.campaign.importing.conftest import Importer
from tests.unit.campaign.importing.importing_synthetic import (
    UNITS,
    Columns,
    sae_columns,
    sae_map,
    with_channels,
    write_csv,
    write_mat5,
    write_mat73,
    write_parquet,
)
from tirelib.campaign import Run, check_campaign, read_campaign, write_campaign
from tirelib.campaign.importing import TydexChannel, TydexFile, write_tydex
from tirelib.campaign.mdf import Channel, Group, write_mdf
from tirelib.campaign.write import FIELD_UNITS
from tirelib.core.axes import sign
from tirelib.core.units import dimension_of, from_si

EXACT = 1e-12  # one conversion to field units and back on each side, a few ulp
DEG = np.pi / 180.0


def only_run(folder: Path) -> Run:
    campaign = read_campaign(folder)
    (plan,) = campaign.plans
    return campaign.load(plan)


def expected(columns: Columns) -> dict[str, Any]:
    """`sae_columns` in SI and ISO, written out by hand."""
    return {
        "Fx": columns["FX"],
        "Fy": -columns["FY"],
        "Fz": -columns["FZ"],
        "slip_angle": -columns["SA"] * DEG,
        "camber": columns["IA"] * DEG,
        "pressure": columns["P"] * 1e3,
        "speed": columns["V"] / 3.6,
        "tread_temperature": columns["TSTC"] + 273.15,
    }


def assert_imported(run: Run, columns: Columns, *, rtol: float = EXACT, atol: float = 0.0) -> None:
    wanted = expected(columns)
    assert set(run.rig) == set(wanted)
    for name, values in wanted.items():
        np.testing.assert_allclose(run.rig[name], values, rtol=rtol, atol=atol, err_msg=name)
    np.testing.assert_allclose(run.rig_time, columns["ET"], rtol=rtol)


def write_loose_mdf(path: Path, columns: Columns) -> Path:
    channels = [Channel(n, UNITS[n], v) for n, v in columns.items() if n != "ET"]
    write_mdf(path, [Group(0, Channel("t", "s", columns["ET"]), tuple(channels))])
    return path


def comma(path: Path, columns: Columns) -> Path:
    return write_csv(path, columns, separator=";", decimal=",")


def tab(path: Path, columns: Columns) -> Path:
    return write_csv(path, columns, separator="\t")


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("a.mat", write_mat5),
        ("b.mat", write_mat73),
        ("c.csv", write_csv),
        ("d.csv", comma),
        ("e.txt", tab),
        ("f.parquet", write_parquet),
    ],
)
def test_every_format_gives_the_same_run_in_si_and_iso(
    name: str, write: Callable[[Path, Columns], Path], imported: Importer, tmp_path: Path
) -> None:
    columns = sae_columns()
    report = imported(write(tmp_path / name, columns))
    assert_imported(only_run(report.campaign), columns)
    assert check_campaign(report.campaign) == []
    plan = read_campaign(report.campaign).plans[0]
    assert (plan.run, plan.kind) == (0, "sweep")
    assert np.isnan([plan.load, plan.pressure, plan.speed, plan.slip_angle, plan.camber]).all()


def test_a_loose_mdf_brings_its_own_clock_and_units(imported: Importer, tmp_path: Path) -> None:
    columns = sae_columns()
    document = with_channels(time=None)
    for rule in document["channels"].values():
        del rule["unit"]
    report = imported(write_loose_mdf(tmp_path / "log.mf4", columns), by=document)
    assert_imported(only_run(report.campaign), columns)


def test_tydex_comes_in_to_the_digits_that_its_columns_hold(
    imported: Importer, tmp_path: Path
) -> None:
    columns = sae_columns()
    channels = tuple(TydexChannel(n, "", UNITS[n]) for n in columns)
    write_tydex(tmp_path / "a.tdx", TydexFile(channels, np.column_stack(list(columns.values()))))
    report = imported(tmp_path / "a.tdx")
    assert_imported(only_run(report.campaign), columns, rtol=5e-7, atol=5e-7)


def test_units_that_the_file_states_need_not_stand_in_the_map(
    imported: Importer, tmp_path: Path
) -> None:
    columns = sae_columns()
    document = sae_map()
    for rule in document["channels"].values():
        del rule["unit"]
    report = imported(write_mat73(tmp_path / "a.mat", columns, units=True), by=document)
    assert_imported(only_run(report.campaign), columns)


def test_factor_sign_and_offset_come_before_the_unit(imported: Importer, tmp_path: Path) -> None:
    columns = sae_columns()
    counts = {**columns, "FZ": -columns["FZ"] / 2.5, "P": (columns["P"] + 4.0) / 2.0}
    document = with_channels(
        Fz={"column": "FZ", "unit": "N", "factor": 2.5, "sign": -1},
        pressure={"column": "P", "unit": "kPa", "factor": 2.0, "offset": -4.0},
    )
    report = imported(write_csv(tmp_path / "a.csv", counts), by=document)
    run = only_run(report.campaign)
    np.testing.assert_allclose(run.rig["Fz"], -columns["FZ"], rtol=EXACT)
    np.testing.assert_allclose(run.rig["pressure"], columns["P"] * 1e3, rtol=EXACT)


def test_the_map_may_overrule_the_unit_that_a_file_states(
    imported: Importer, tmp_path: Path
) -> None:
    columns = sae_columns()
    document = with_channels(pressure={"column": "P", "unit": "psi", "override_unit": True})
    report = imported(write_mat73(tmp_path / "a.mat", columns, units=True), by=document)
    psi = 4.4482216152605 / 0.0254**2
    run = only_run(report.campaign)
    np.testing.assert_allclose(run.rig["pressure"], columns["P"] * psi, rtol=EXACT)


@pytest.mark.parametrize("axes", ["iso", "sae", "adapted_sae"])
def test_a_campaign_taken_apart_and_imported_is_the_same_campaign(
    axes: str, imported: Importer, tmp_path: Path
) -> None:
    """Campaign with strain to one MATLAB file a run and back: strain, trigger, rig, plans."""
    first = tmp_path / "first"
    runs = [
        synthetic.synthetic_run(k, load=3000.0 + 500 * k, slip_angle=0.03, turns=3.2)
        for k in range(3)
    ]
    write_campaign(first, synthetic.header(axes=axes), runs)
    files, document = taken_apart(first, tmp_path, axes)
    report = imported(*files, by=document)

    one, two = read_campaign(first), read_campaign(report.campaign)
    assert two.header == one.header
    for plan, other in zip(one.plans, two.plans, strict=True):
        assert (other.run, other.kind, other.file) == (plan.run, plan.kind, plan.file)
        assert other.start == plan.start
        for name in ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio"):
            # runs.csv holds 12 digits
            assert getattr(other, name) == pytest.approx(getattr(plan, name), rel=2e-12, abs=1e-15)
        a, b = one.load(plan), two.load(other)
        assert a.strain is not None
        assert b.strain is not None
        np.testing.assert_allclose(b.strain, a.strain, rtol=EXACT)
        np.testing.assert_array_equal(b.trigger, a.trigger)
        np.testing.assert_allclose(b.time(), a.time(), rtol=EXACT, atol=1e-12)
        np.testing.assert_allclose(b.rig_time, a.rig_time, rtol=EXACT)
        assert set(b.rig) == set(a.rig)
        for name, samples in a.rig.items():
            np.testing.assert_allclose(b.rig[name], samples, rtol=EXACT, err_msg=name)


def taken_apart(folder: Path, out: Path, axes: str) -> tuple[list[Path], dict[str, Any]]:
    """Write a campaign's runs as MATLAB files in `axes` and return these with their map."""
    campaign = read_campaign(folder)
    files = []
    entries = {}
    channels: dict[str, Any] = {}
    for plan in campaign.plans:
        run = campaign.load(plan)
        assert run.strain is not None
        columns: dict[str, Any] = {"tg": run.time(), "tr": run.rig_time, "trigger": run.trigger}
        channels = {
            "time": {"column": "tr", "unit": "s"},
            "gage_time": {"column": "tg", "unit": "s"},
            "trigger": {"column": "trigger", "unit": "1"},
        }
        columns["strain"] = run.strain.T * 1e6
        for k in range(1, len(run.strain) + 1):
            channels[f"strain_{k}"] = {"column": f"strain(:,{k})", "unit": "ustrain"}
        for name, samples in run.rig.items():
            unit = FIELD_UNITS[dimension_of(name) or ""]
            given = sign(name, axes) * samples
            columns[name] = from_si(given, unit, dimension_of(name) or "")
            channels[name] = {"column": name, "unit": unit}
        entries[str(plan.run)] = {
            "kind": plan.kind,
            "load_N": plan.load,
            "slip_angle_deg": sign("slip_angle", axes) * plan.slip_angle / DEG,
            "start_s": plan.start,
        }
        files.append(write_mat5(out / f"run{plan.run}.mat", columns))
    header = campaign.header
    points = {"pressure_bar": 2.3, "speed_kmh": 64.8, "camber_deg": 0.0, "slip_ratio": 0.0}
    flip = sign("lateral", axes)
    document = {
        "format": "tirelib-map/1",
        "axes": axes,
        "name": header.name,
        "tire": {
            "name": header.tire.name,
            "free_radius_m": header.tire.free_radius,
            "ring_radius_m": header.tire.ring_radius,
            "tread_thickness_m": header.tire.tread_thickness,
            "belt_width_m": header.tire.belt_width,
            "innerliner_offset_m": header.tire.innerliner_offset,
        },
        "gages": {"lateral_m": [flip * y for y in header.gage_lateral]},
        "tolerance": {"load": 0.005, "pressure": 0.002, "speed": 0.001, "gain": 0.003},
        "rig": {"name": header.rig_name, "note": header.rig_note},
        "set_points": points,
        "runs": entries,
        "channels": channels,
    }
    return files, document


@pytest.mark.parametrize("mapped", [{}, {"time": {"column": "2/time", "unit": "s"}}])
def test_loose_mdf_with_two_rates_keeps_both_clocks(
    mapped: dict[str, Any], imported: Importer, tmp_path: Path
) -> None:
    run = synthetic.synthetic_run(0, turns=3.2)
    assert run.strain is not None
    assert run.rig_time is not None
    strains = [Channel(f"G{k}", "um/m", 1e6 * row) for k, row in enumerate(run.strain, start=1)]
    rig = [Channel("FZ", "kN", run.rig["Fz"] / 1e3)]
    groups = [
        Group(0, Channel("time", "s", run.time()), tuple(strains)),
        Group(1, Channel("time", "s", run.rig_time), tuple(rig)),
    ]
    write_mdf(tmp_path / "log.mf4", groups)
    document = sae_map(axes="iso", gages={"lateral_m": list(synthetic.LATERAL)})
    document["channels"] = {"Fz": {"column": "FZ", "unit": "kN"}, **mapped} | {
        f"strain_{k}": {"column": f"G{k}", "unit": "ustrain"} for k in range(1, 6)
    }
    document["tire"]["free_radius_m"] = 0.3155
    report = imported(tmp_path / "log.mf4", by=document)
    back = only_run(report.campaign)
    assert back.strain is not None
    np.testing.assert_allclose(back.strain, run.strain, rtol=EXACT)
    np.testing.assert_allclose(back.rig["Fz"], run.rig["Fz"], rtol=EXACT)
    assert back.rate == synthetic.RATE
    assert any("rate of the gages from the time columns: 10000 Hz" in n for n in report.notes)
    assert any("GROUP/NAME: time" in note for note in report.notes)


def test_a_run_column_divides_one_file(imported: Importer, tmp_path: Path) -> None:
    columns = sae_columns(rows=300)
    columns["RUN"] = np.repeat([7.0, 3.0, 12.0], 100)
    columns["PSET"] = np.repeat([80.0, 83.0, 90.0], 100)
    document = sae_map(
        run_column="RUN",
        set_points={
            "pressure_bar": {"column": "PSET", "unit": "kPa"},
            "load_N": {"mean_to": 100},
            "slip_angle_deg": {"mean_to": 0.5},
            "speed_kmh": 40.0,
        },
        runs={"3": {"note": "wet", "speed_kmh": 41.0}, "12": {"skip": True}},
    )
    report = imported(write_parquet(tmp_path / "a.parquet", columns), by=document)
    campaign = read_campaign(report.campaign)
    assert [plan.run for plan in campaign.plans] == [7, 3]
    seven, three = campaign.plans
    assert (seven.pressure, seven.load) == pytest.approx((0.8e5, 1500.0))
    # a mean is rounded in the file's axes, and a set point stands in those of ISO
    for plan, span in ((seven, slice(0, 100)), (three, slice(100, 200))):
        mean = 0.5 * np.round(columns["SA"][span].mean() / 0.5)
        assert plan.slip_angle == pytest.approx(-mean * DEG)
    assert abs(seven.slip_angle) > 2.0 * DEG
    assert (seven.speed * 3.6, three.speed * 3.6) == pytest.approx((40.0, 41.0))
    assert three.extra == {"note": "wet"}
    assert (seven.start, three.start) == pytest.approx((10.0, 11.0))
    for plan, span in ((seven, slice(0, 100)), (three, slice(100, 200))):
        assert_imported(
            campaign.load(plan),
            {k: v[span] for k, v in columns.items() if k not in ("RUN", "PSET")},
        )


def test_files_are_runs_in_the_order_given(imported: Importer, tmp_path: Path) -> None:
    one = write_csv(tmp_path / "z.csv", sae_columns(seed=1))
    two = write_parquet(tmp_path / "a.parquet", sae_columns(seed=2))
    report = imported(one, two)
    assert [(run.plan.run, run.source) for run in report.runs] == [(0, str(one)), (1, str(two))]
    campaign = read_campaign(report.campaign)
    assert_imported(campaign.load(campaign.plans[1]), sae_columns(seed=2))


def test_a_clock_without_a_column_counts_the_rows(imported: Importer, tmp_path: Path) -> None:
    columns = sae_columns()
    document = with_channels(time={"rate_hz": 100.0})
    report = imported(write_csv(tmp_path / "a.csv", columns), by=document)
    run = only_run(report.campaign)
    np.testing.assert_allclose(run.rig_time, np.arange(400) / 100.0, rtol=EXACT)


def test_uneven_gage_times_become_the_even_clock_and_that_is_said(
    imported: Importer, tmp_path: Path
) -> None:
    run = synthetic.synthetic_run(0, turns=3.2)
    assert run.strain is not None
    times = 7.5 + run.time()  # the logger had run before
    jitter = np.zeros(times.size)
    jitter[5:-5:7] = 1e-5  # a tenth of a step
    columns = {"t": times + jitter} | {f"G{k}": row for k, row in enumerate(run.strain, start=1)}
    document = sae_map(gages={"lateral_m": [0.06, 0.03, 0.0, -0.03, -0.06]})
    document["channels"] = {"time": {"column": "t", "unit": "s"}} | {
        f"strain_{k}": {"column": f"G{k}", "unit": "m/m"} for k in range(1, 6)
    }
    report = imported(write_parquet(tmp_path / "a.parquet", columns), by=document)
    assert any("0.01 ms off an even clock of 10000 Hz" in note for note in report.notes)
    assert report.header.strain_unit == "m/m"
    np.testing.assert_allclose(only_run(report.campaign).time(), times, atol=1e-12)


def test_an_old_campaign_goes_only_when_asked_for(imported: Importer, tmp_path: Path) -> None:
    one = write_csv(tmp_path / "a.csv", sae_columns(seed=1))
    two = write_csv(tmp_path / "b.csv", sae_columns(seed=2))
    imported(one, two)
    with pytest.raises(ValueError, match="a campaign is already there"):
        imported(two)
    assert len(read_campaign(tmp_path / "campaign").plans) == 2
    report = imported(two, overwrite=True)
    assert_imported(only_run(report.campaign), sae_columns(seed=2))
    assert check_campaign(report.campaign) == []


@pytest.mark.shared
def test_a_real_rig_recording_comes_in_sound(shared: Callable[[str], Path], tmp_path: Path) -> None:
    from tirelib.campaign.importing import import_campaign

    folder = shared("real/cornering.mat").parent
    report = import_campaign(
        [folder / "cornering.mat"], folder / "cornering.map.toml", tmp_path / "c"
    )
    assert check_campaign(report.campaign) == []
    run = only_run(report.campaign)
    assert run.rig["Fz"].size == 59965
    assert (run.rig["Fz"].min(), run.rig["Fz"].max()) == pytest.approx((405.325, 2928.475))
    assert run.rig["pressure"].max() == pytest.approx(99.2e3)
    turning = np.abs(run.rig["slip_angle"]) > 3.0 * DEG
    assert (run.rig["slip_angle"] * run.rig["Fy"])[turning].max() < 0.0
