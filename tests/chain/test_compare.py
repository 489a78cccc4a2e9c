"""`tirelib compare` from the command line: files, exit codes, messages, forces and strain."""

import json
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.chain.test_command_line import run
from tests.synthetic import LATERAL, RATE, header
from tests.unit.inference.compare.compare_synthetic import bump, model_file, plan, points_of
from tirelib.campaign import Run, RunPlan, write_campaign
from tirelib.core.parameters import Number, TireFile, write_tire
from tirelib.inference.identify.brush_law import brush_of
from tirelib.inference.identify.force_data import ForceData
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import values_of
from tirelib.model.solution import solved
from tirelib.physics.brush.predict import PointConditions, predict_forces

NO_FILTER = LowPass(order=120.0)


def brush_file() -> TireFile:
    given = {"bristle_lateral": 9e6, "friction": 0.95}
    numbers = {k: Number(v, float("nan"), "assumed", "test") for k, v in given.items()}
    return replace(model_file(), numbers={**model_file().numbers, **numbers})


def strain_runs(seed: int = 0, plant: float = 0.0, copies: int = 0) -> Iterable[Run]:
    """Recordings of what the model shows, five turns each; `plant` is added in the contact.

    `copies` runs instead of the short plan.
    """
    rng = np.random.default_rng(seed)
    conditions = plan()[1:20:2] + plan()[20:24]
    if copies:
        conditions = (3 * plan())[:copies]
    at = points_of(conditions)
    values = values_of(model_file().tire)
    shown = solved(values, at, low_pass=NO_FILTER)
    waves = shown.waveform + bump(-0.1, 0.1, plant, 3000.0)(at.load, GRID)
    for i, (load, pressure, speed) in enumerate(conditions):
        omega = at.omega[i]
        phi = np.pi + omega * np.arange(int(5.2 * 2 * np.pi / omega * RATE)) / RATE
        folded = (phi + np.pi) % (2 * np.pi) - np.pi
        strain = np.interp(folded, np.append(GRID, np.pi), np.append(waves[i], waves[i, 0]))
        noise = 4e-6 * rng.standard_normal((len(LATERAL), phi.size))
        top = np.floor((phi - np.pi) / (2 * np.pi))
        rig = {
            "Fz": load,
            "pressure": pressure,
            "speed": speed,
            "omega": omega,
            "loaded_radius": 0.3155 - shown.deflection[i],
        }
        yield Run(
            RunPlan(
                i, f"runs/{i:03d}.mf4", "free", load, pressure, speed, 0.0, 0.0, 0.0, start=12.0 * i
            ),
            strain=strain + 2e-3 + noise,
            rate=RATE,
            trigger=np.concatenate(([False], np.diff(top) > 0.5)),
            rig={name: np.full(20, value) for name, value in rig.items()},
            rig_time=np.arange(20) / 100.0,
        )


def force_runs(excess: float = 0.0, repeats: int = 2) -> Iterable[Run]:
    """Steady runs of the model's brush; above 4 deg the measured Fy is smaller by `excess`."""
    rng = np.random.default_rng(4)
    i = 0
    for load in (2000.0, 4000.0, 6000.0):
        for angle in (-6.0, -4.5, -3.0, -1.0, 0.0, 1.0, 3.0, 4.5, 6.0):
            for _ in range(repeats):
                alpha = float(np.deg2rad(angle))
                one = {
                    name: np.array([value])
                    for name, value in (
                        ("load", load),
                        ("pressure", 2.1e5),
                        ("slip_angle", alpha),
                        ("slip_ratio", 0.0),
                        ("camber", 0.0),
                        ("omega", 60.0),
                        ("Fx", 0.0),
                        ("Fy", 0.0),
                        ("Mz", 0.0),
                    )
                }
                data = ForceData(**one, block=np.zeros(1, dtype=np.int64))
                at = PointConditions(data.load, data.slip_angle)
                found = predict_forces(brush_of(brush_file()).parameters(data), at)
                side = float(found.Fy[0]) + 8.0 * float(rng.standard_normal())
                if abs(angle) > 4.0:
                    side -= excess * np.sign(side)
                rig = {
                    "Fz": load,
                    "pressure": 2.1e5,
                    "slip_angle": alpha,
                    "camber": 0.0,
                    "speed": 18.0,
                    "omega": 60.0,
                    "Fy": side,
                    "Mz": float(found.Mz[0]) + 0.5 * float(rng.standard_normal()),
                }
                yield Run(
                    RunPlan(
                        i,
                        f"runs/{i:03d}.mf4",
                        "corner",
                        load,
                        2.1e5,
                        18.0,
                        alpha,
                        0.0,
                        0.0,
                        start=12.0 * i,
                    ),
                    rig={name: np.full(20, value) for name, value in rig.items()},
                    rig_time=np.arange(20) / 100.0,
                )
                i += 1


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compare")
    write_tire(model_file(), folder / "M.toml")
    write_tire(brush_file(), folder / "B.toml", "tirelib-model/1")
    alone = {name: brush_file().numbers[name] for name in ("bristle_lateral", "friction")}
    write_tire(replace(brush_file(), numbers=alone), folder / "brush.toml", "tirelib-model/1")
    write_campaign(folder / "strain", header(), strain_runs(plant=3e-4))
    bare = replace(header(), gage_lateral=(), rate=float("nan"))
    write_campaign(folder / "forces", bare, force_runs(excess=150.0))
    write_campaign(folder / "own", bare, force_runs())
    write_campaign(folder / "single", bare, force_runs(repeats=1))
    return folder


def compared(place: Path, campaign: str, model: str, *words: str) -> dict[str, Any]:
    target = place / "C.json"
    done = run("compare", place / campaign, "--model", place / model, "--json", target, *words)
    assert done.returncode == 0, done.stderr
    read = json.loads(target.read_text())
    assert isinstance(read, dict)
    return read


def test_the_contract_holds_as_other_programs_call_it(place: Path) -> None:
    done = run(
        "compare",
        place / "strain",
        "--model",
        place / "M.toml",
        "--out",
        place / "out",
        "--json",
        place / "S.json",
    )
    assert done.returncode == 0, done.stderr
    found = json.loads((place / "S.json").read_text())
    assert found == json.loads((place / "out/comparison.json").read_text())
    assert found["format"] == "tirelib-comparison/1"
    assert found["quantity"] == "strain"
    assert found["verdict"] == "lack_of_fit"
    # the planted plateau, smeared by the filter, through files and turns
    assert found["regions"][0]["mean"] == pytest.approx(-300.0, rel=0.15)
    assert found["regions"][0]["from_rad"] == pytest.approx(-0.1, abs=0.051)
    assert found["regions"][0]["to_rad"] == pytest.approx(0.1, abs=0.051)
    assert found["regions"][0]["value"] == pytest.approx(3900.0)
    assert "300 microstrain" in done.stdout or "too little tension" in done.stdout
    html = (place / "out/index.html").read_text()
    own = html[: html.index("plotly.js v")] + html[html.index("const figures") :]
    assert not re.search(r"""(src|href)=["'](?!#|data:)""", own)
    assert (place / "out/comparison.md").read_text().startswith("# Model against measurement")


def test_own_forces_fit_and_a_planted_excess_is_told(place: Path) -> None:
    own = compared(place, "own", "B.toml")
    assert own["verdict"] == "fits"
    assert own["statements"] == []
    # 27 repeats tell the noise to 14 %
    assert own["error"] == pytest.approx(1.0, abs=0.4)
    found = compared(place, "forces", "B.toml")
    assert found["quantity"] == "Fy"
    assert found["verdict"] == "lack_of_fit"
    assert found["noise"] == pytest.approx(8.0, rel=0.4)
    first = found["statements"][0]
    assert first.startswith("At slip angle 4 deg to 6 deg, either sign, the model's Fy is 15")
    assert "too large" in first
    assert any(row["by"] == "slip_angle" and row["low"] == 0.0 for row in found["table"])


def test_the_quantity_can_be_chosen(place: Path) -> None:
    assert compared(place, "own", "B.toml", "--quantity", "Mz")["unit"] == "Nm"
    page = run("compare", place / "own", "--model", place / "B.toml", "--out", place / "forces-out")
    assert page.returncode == 0, page.stderr
    assert "Fy" in (place / "forces-out/index.html").read_text()


def test_forces_without_repeats_have_no_noise_and_no_statement(place: Path) -> None:
    found = compared(place, "single", "B.toml")
    assert found["verdict"] == "noise_unknown"
    assert found["noise"] is None
    assert found["error_unit"] in ("N", "Nm")
    assert found["error"] == found["residual_rms_raw"]
    assert found["statements"] == []
    assert "errors are given in N" in found["messages"][0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("strain", "--model", "nowhere.toml"), "no such file"),
        (("nowhere", "--model", "M.toml"), "nowhere"),
        (("strain", "--model", "M.toml", "--quantity", "strian"), "allowed are strain, Fy"),
        (("strain", "--model", "M.toml", "--quantity", "Fy"), "states no bristle_lateral"),
        (("forces", "--model", "M.toml"), "states no bristle_lateral"),
        (("forces", "--model", "B.toml", "--quantity", "Fx"), "Fx is not measured"),
        (("forces", "--model", "B.toml", "--quantity", "strain"), "no strain gages"),
        (("strain", "--model", "brush.toml"), "a model of the brush only (bristle_lateral"),
    ],
)
def test_bad_input_ends_with_2_and_a_message(
    place: Path, words: tuple[str, ...], said: str
) -> None:
    folder, option, model, *rest = words
    given = place / model if model != "nowhere.toml" else model
    done = run("compare", place / folder, option, given, *rest)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
