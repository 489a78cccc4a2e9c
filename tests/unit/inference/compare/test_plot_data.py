"""What plots are drawn from: arrays of a comparison, and traces that look like the residual."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from tests.synthetic import synthetic_run, write
from tests.unit.inference.diagnose.planted import EFFECT, STRENGTH, model_file, waves
from tests.unit.inference.force_campaigns import brush_file, steady_runs, write_forces
from tests.unit.inference.identify.model_waves import TIRE
from tirelib.campaign import Campaign, Run, read_campaign
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import Number
from tirelib.effects import CATALOGUE
from tirelib.inference.compare.forces import compare_forces
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.plot_data import measured_data, plot_data, write_plot_data
from tirelib.inference.compare.strain import compare_strain
from tirelib.inference.identify.delay import by_delay
from tirelib.measured.waveforms import measure_waveforms
from tirelib.model.base import coordinates, operating_points
from tirelib.model.slopes import by_values
from tirelib.model.solution import solved


def like(trace: Any, rest: Any) -> float:
    """Return the cosine between a trace and what is left."""
    return float(np.sum(trace * rest) / np.sqrt(np.sum(trace**2) * np.sum(rest**2)))


def test_the_trace_of_the_planted_effect_looks_like_what_is_left(tmp_path: Path) -> None:
    """In units of the noise, and beyond what the tire's own numbers and the delay could take up."""
    file = model_file()
    file.numbers["bending_stiffness"] = Number(TIRE.bending_stiffness, 0.2, "fitted", "test")
    model = model_of(file)
    found = compare_strain(waves(EFFECT, STRENGTH), model)
    planted = [(EFFECT, (STRENGTH,)), ("gage_length", (900.0,))]
    data = plot_data(found, cast(Campaign, None), file, planted, CATALOGUE)
    np.testing.assert_allclose(data["difference"], 1e6 * found.difference)
    assert data["noise"] == pytest.approx(1e6 * found.noise.std)
    white, whiten = data["white"], found.error.whiten
    assert np.sqrt(np.mean(white**2)) == pytest.approx(found.error.value)
    at, low_pass = operating_points(found.chosen.waves), found.chosen.waves.low_pass
    free = coordinates(model.values)
    here = solved(model.values, at, low_pass=low_pass)
    assert whiten is not None
    slopes = [*by_values(here, free).waveform[: len(free)], by_delay(here.waveform, at.omega)]
    basis = np.linalg.qr(whiten(np.stack(slopes)).reshape(len(slopes), -1).T)[0]
    rest = white.ravel() - basis @ (basis.T @ white.ravel())
    own = data[f"trace_{EFFECT}"]
    assert like(whiten(1e-6 * own).ravel(), rest) > 0.95
    other = whiten(1e-6 * data["trace_gage_length"]).ravel()
    assert abs(like(other, rest)) < 0.8
    # what a run's errors of load, pressure, gain and angle would take is out of it
    shifts = found.points.tangent[..., :4]
    size = np.sqrt(np.sum(own**2, axis=1)[:, None] * np.sum(shifts**2, axis=1))
    assert np.all(np.abs(np.sum(own[..., None] * shifts, axis=1)) < 0.02 * size)
    write_plot_data(tmp_path / "d.npz", data)
    with np.load(tmp_path / "d.npz") as again:
        assert str(again["quantity"]) == "strain"
        np.testing.assert_array_equal(again[f"trace_{EFFECT}"], own)


def test_the_trace_of_a_brush_effect_looks_like_what_is_left(tmp_path: Path) -> None:
    campaign = write_forces(tmp_path / "steady", steady_runs(slope=0.25), "steady")
    file = brush_file(campaign)
    found = compare_forces(campaign, file, "Fy")
    planted = [("friction_load", (0.25,)), ("conicity", (20.0,))]
    data = plot_data(found, campaign, file, planted, CATALOGUE)
    np.testing.assert_allclose(data["model"] - data["measured"], data["difference"])
    found_like = like(data["trace_friction_load"], data["difference"])
    assert found_like > 0.5  # of first order: the fit has moved stiffness and friction far
    assert abs(like(data["trace_conicity"], data["difference"])) < 0.5 * found_like
    for name, _ in planted:  # a constant force and a harder brush are out of it
        assert abs(like(data[f"trace_{name}"], np.ones(len(data["run"])))) < 1e-6


def test_what_was_measured_is_the_same_before_and_after_a_model(tmp_path: Path) -> None:
    campaign = write_forces(tmp_path / "steady", steady_runs(slope=0.25), "steady")
    before = measured_data(campaign)
    found = compare_forces(campaign, brush_file(campaign), "Fy")
    after = plot_data(found, campaign, brush_file(campaign), [], CATALOGUE)
    assert set(after) - set(before) == {"model", "difference", "white", "noise"}
    for name in before:
        np.testing.assert_array_equal(before[name], after[name])


def test_what_was_measured_of_strain_is_the_same_before_and_after_a_model(tmp_path: Path) -> None:
    runs = [synthetic_run(k, load=load) for k, load in enumerate((2500.0, 4000.0, 5500.0))]
    campaign = read_campaign(write(tmp_path / "straight", runs))
    file = model_file()
    found = compare_strain(measure_waveforms(campaign), model_of(file))
    before, after = measured_data(campaign), plot_data(found, campaign, file, [], CATALOGUE)
    assert set(after) - set(before) == {
        *("edges", "model", "difference", "white", "noise", "by_gage")
    }
    for name in before:
        np.testing.assert_array_equal(before[name], after[name])
    assert before["measured"].shape == (len(found.run), before["angle"].size)


def test_a_campaign_without_forces_and_gages_has_nothing_to_draw(tmp_path: Path) -> None:
    def bare() -> Iterator[Run]:
        for run in steady_runs(repeats=1):
            kept = {name: x for name, x in run.rig.items() if name not in ("Fx", "Fy", "Mz")}
            yield replace(run, rig=kept)

    with pytest.raises(CalibrationError, match="record a force"):
        measured_data(write_forces(tmp_path / "bare", bare(), "bare"))


def test_an_unknown_effect_is_refused() -> None:
    file = model_file()
    found = compare_strain(waves(EFFECT, STRENGTH), model_of(file))
    with pytest.raises(ParameterError, match="--trace nonsense"):
        plot_data(found, cast(Campaign, None), file, [("nonsense", (1.0,))], CATALOGUE)


def test_an_effect_below_zero_that_cannot_be_there_is_refused_in_plain_words() -> None:
    file = model_file()
    found = compare_strain(waves(EFFECT, STRENGTH), model_of(file))
    planted = [("sidewall_damping", (-0.03,)), ("belt_shear", (0.02,))]
    data = plot_data(found, cast(Campaign, None), file, planted, CATALOGUE)
    assert str(data["fault_sidewall_damping"]) == (
        "its strength of -0.03 is below zero, where the effect has no meaning (0 to 0.3 is "
        "plausible); there is nothing to draw"
    )
    assert "trace_belt_shear" in data


def test_a_law_that_fails_within_its_range_says_why_itself() -> None:
    def broken(*_: Any) -> Any:
        raise ParameterError("no such belt")

    file, name = model_file(), "sidewall_load"
    found = compare_strain(waves(EFFECT, STRENGTH), model_of(file))
    effects = {name: replace(CATALOGUE[name], law=broken, low=-1.0)}
    for strength in (-2.0, 0.1):
        data = plot_data(found, cast(Campaign, None), file, [(name, (strength,))], effects)
        assert str(data[f"fault_{name}"]) == "no such belt"


def test_both_ways_of_rolling_are_one_speed() -> None:
    file = model_file()
    found = compare_strain(waves(EFFECT, STRENGTH), model_of(file))
    there = found.chosen.waves
    way = np.where(np.arange(len(there)) % 2 == 0, 1.0, -1.0)
    conditions = {**there.conditions, "speed": way * there.conditions["speed"]}
    turned = replace(
        found, chosen=replace(found.chosen, waves=replace(there, conditions=conditions))
    )
    levels = [
        plot_data(one, cast(Campaign, None), file, [], CATALOGUE)["level_speed"]
        for one in (found, turned)
    ]
    np.testing.assert_array_equal(*levels)


def test_the_scatter_of_a_rig_makes_no_set_points_of_its_own(tmp_path: Path) -> None:
    def scattered() -> Iterator[Run]:
        rng = np.random.default_rng(11)
        for run in steady_runs(loads=(2000.0, 4000.0), repeats=1):
            rig = {name: values.copy() for name, values in run.rig.items()}
            rig["Fz"] *= 1.0 + 0.004 * rng.standard_normal()
            rig["camber"] += np.deg2rad(0.05 * rng.standard_normal())
            yield replace(run, rig=rig)

    campaign = write_forces(tmp_path / "scattered", scattered(), "scattered")
    file = brush_file(campaign)
    data = plot_data(compare_forces(campaign, file, "Fy"), campaign, file, [], CATALOGUE)
    assert np.unique(data["camber"]).size == 20
    found = {name[6:]: np.unique(data[name]).size for name in data if name.startswith("level_")}
    assert found == {
        "load": 2,
        "pressure": 1,
        "speed": 1,
        "slip_angle": 10,
        "camber": 1,
        "slip_ratio": 1,
    }
