"""What of a campaign's forces is left out or assumed is said in words."""

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
from tirelib.inference.identify.force_notes import force_notes, noise_note

TIME = np.arange(20) / 10.0
FULL = {
    "Fz": np.full(20, 3000.0),
    "Fy": np.full(20, -900.0),
    "slip_angle": np.full(20, 0.02),
    "slip_ratio": np.zeros(20),
    "camber": np.zeros(20),
}


def notes(folder: Path, *rigs: dict[str, np.ndarray], kind: str = "corner") -> tuple[str, ...]:
    set_points = (np.nan,) * 6 if kind == "sweep" else (3000.0, 2e5, 18.0, 0.02, 0.0, 0.0)
    runs = [
        Run(RunPlan(i, f"runs/{i}.mf4", kind, *set_points), rig=rig, rig_time=TIME)
        for i, rig in enumerate(rigs)
    ]
    header = CampaignHeader("c", "iso", TireGeometry("t", 0.3))
    write_campaign(folder / "c", header, iter(runs), axes="iso")
    return force_notes(read_campaign(folder / "c"))


def changed(name: str, index: int, value: float) -> dict[str, np.ndarray]:
    samples = FULL[name].copy()
    samples[index] = value
    return {**FULL, name: samples}


def test_nothing_is_said_of_whole_runs(tmp_path: Path) -> None:
    assert notes(tmp_path, FULL, FULL) == ()


def test_a_sample_that_is_no_number_costs_its_run(tmp_path: Path) -> None:
    found = notes(tmp_path, FULL, changed("Fy", 3, np.nan), changed("Fz", 4, np.nan))
    assert found == (
        "run 1: Fy holds samples that are no number; left out of the brush",
        "run 2: Fz holds samples that are no number; left out of the brush",
    )


def test_set_points_that_stand_in_are_named(tmp_path: Path) -> None:
    bare = {name: value for name, value in FULL.items() if name != "slip_angle"}
    assert notes(tmp_path, bare, FULL, bare) == (
        "2 runs (0, 2): slip_angle was not measured; its set point is used",
    )


def test_samples_of_a_sweep_are_counted(tmp_path: Path) -> None:
    load = FULL["Fz"].copy()
    load[:5] = -3.0
    angle = FULL["slip_angle"].copy()
    angle[3:8] = np.nan
    (found,) = notes(tmp_path, {**FULL, "Fz": load, "slip_angle": angle}, kind="sweep")
    assert found.startswith("8 samples of sweeps have no positive load or no slip angle")


@pytest.mark.parametrize("name", ["Fz", "slip_angle"])
def test_a_sweep_without_load_or_slip_is_useless(tmp_path: Path, name: str) -> None:
    bare = {key: value for key, value in FULL.items() if key != name}
    assert f"run 0: {name} is not recorded; left out of the brush" in notes(
        tmp_path, bare, kind="sweep"
    )


def test_slips_that_nobody_recorded_are_zero_and_said(tmp_path: Path) -> None:
    bare = {key: FULL[key] for key in ("Fz", "Fy", "slip_angle")}
    assert notes(tmp_path, bare, kind="sweep") == (
        "run 0: slip ratio is unknown and taken as zero",
        "run 0: camber is unknown and taken as zero",
    )


def test_a_noise_of_another_condition_is_told_from_that_of_a_rig() -> None:
    assert noise_note("Fy", 207.0, 3450.0) == (
        "the noise from repeats, 207 N, is 6 % of the rms of Fy; a rig repeats to 3 % or better: "
        "these repeats differ in something that is not recorded or not mapped (camber, "
        "temperature, wear, another tire), so no effect can be named reliably",
    )
    assert noise_note("Fy", 13.0, 3450.0) == noise_note("Fy", np.nan, 3450.0) == ()
