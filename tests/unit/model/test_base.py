"""The base model: coordinates, slopes, filter, correction."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.inference.identify.model_waves import TIRE, operating
from tirelib.core.errors import ConvergenceError
from tirelib.core.parameters import FIELDS
from tirelib.effects import CATALOGUE
from tirelib.effects.state import State
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model import chain
from tirelib.model.base import (
    FREE,
    Coordinate,
    linearised,
    move,
    predict,
    smoothed,
    values_of,
)

VALUES = values_of(TIRE)
POINTS = operating(np.array([2500.0, 4500.0]), np.array([1.8e5, 2.4e5]))


@given(st.floats(-1.0, 1.0), st.floats(1e-3, 1e6))
def test_a_scaled_coordinate_stays_positive_and_turns_back(z: float, value: float) -> None:
    scaled = Coordinate("bending_stiffness")
    assert scaled.moved(scaled.moved(value, z), -z) == pytest.approx(value)
    assert scaled.moved(value, z) > 0.0
    shifted = Coordinate("radial_pressure_slope", 2.0)
    assert shifted.moved(value, z) == pytest.approx(value + 2.0 * z)
    assert shifted.spread(value, 0.1) == pytest.approx(0.2)
    assert scaled.spread(value, 0.1) == pytest.approx(0.1 * value)


def test_moving_leaves_the_rest_alone() -> None:
    moved = move(VALUES, np.full(len(FREE), 0.1))
    changed = {name for name in VALUES if moved[name] != VALUES[name]}
    assert changed == {c.name for c in FREE}


def test_slopes_agree_with_a_finer_step() -> None:
    coarse = linearised(VALUES, POINTS, low_pass=LowPass())
    fine = linearised(VALUES, POINTS, low_pass=LowPass(), step=1e-5)
    assert coarse.waveform == pytest.approx(fine.waveform)
    for k in range(len(FREE)):
        size = np.abs(fine.waveform_slopes[k]).max()
        # a forward difference errs by half the step times the curvature
        assert coarse.waveform_slopes[k] == pytest.approx(fine.waveform_slopes[k], abs=2e-3 * size)
        deep = np.abs(fine.deflection_slopes[k]).max()
        assert coarse.deflection_slopes[k] == pytest.approx(
            fine.deflection_slopes[k], abs=2e-3 * deep + 1e-12
        )


def test_strain_is_in_proportion_to_the_gages_offset() -> None:
    linear = linearised(VALUES, POINTS)
    k = [c.name for c in FREE].index("innerliner_offset")
    # R / (R + y) bends the proportion by 1 %
    assert linear.waveform_slopes[k] == pytest.approx(
        linear.waveform, abs=0.03 * np.abs(linear.waveform).max()
    )


def test_pressure_slopes_act_with_the_distance_from_the_reference_pressure() -> None:
    at = replace(POINTS, pressure=np.full(2, TIRE.pressure))
    linear = linearised(VALUES, at)
    for name in ("radial_pressure_slope", "tangential_pressure_slope"):
        k = [c.name for c in FREE].index(name)
        assert linear.waveform_slopes[k] == pytest.approx(0.0, abs=1e-12)


@given(st.integers(1, 30), st.floats(-3.0, 3.0))
def test_smoothing_damps_a_harmonic_as_a_gaussian(order: int, phase: float) -> None:
    wave = np.tile(np.cos(order * GRID + phase) + 5.0, (2, 1))
    sigma = LowPass().sigma(1.0)
    expected = np.exp(-0.5 * (sigma * order) ** 2) * (wave - 5.0)
    assert smoothed(wave, POINTS, LowPass()) == pytest.approx(expected, abs=1e-12)


def test_states_change_by_copy() -> None:
    state = State.of(VALUES, POINTS, GRID)
    other = state.but(damping=np.ones(2))
    assert (state.damping == 0).all()
    assert (other.damping == 1).all()
    above = POINTS.pressure - TIRE.pressure
    assert state.k_u == pytest.approx(4.6e5 + 1.1 * above)
    assert state.k_v == pytest.approx(1.9e5 + 0.4 * above)


def test_points_are_tiled_and_taken() -> None:
    assert POINTS.tiled(3).load.tolist() == [2500.0, 4500.0] * 3
    assert POINTS.take([1]).load.tolist() == [4500.0]
    assert len(POINTS.tiled(3)) == 6


def test_changes_act_at_their_stages_in_order() -> None:
    seen: list[str] = []

    def note(name: str):
        def change(state: State) -> State:
            seen.append(name)
            return state

        return change

    predict(VALUES, POINTS, [(s, note(s)) for s in ("gage", "strain", "contact", "constants")])
    assert seen[0] == "constants"
    assert seen[-3:] == ["contact", "strain", "gage"]


def presses(monkeypatch: pytest.MonkeyPatch) -> list[State]:
    """Return the states that are pressed from now on."""
    seen: list[State] = []
    press = chain._press
    monkeypatch.setattr(chain, "_press", lambda state: (seen.append(state), press(state))[1])
    return seen


def test_a_law_that_does_not_follow_the_deflection_is_pressed_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = presses(monkeypatch)
    stiffer = predict(VALUES, POINTS, [CATALOGUE["sidewall_pressure"].at(0.3)])
    assert len(seen) == 1
    assert (stiffer.deflection != predict(VALUES, POINTS).deflection).all()


def test_a_law_that_follows_the_deflection_holds_at_that_which_it_causes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = presses(monkeypatch)
    change = CATALOGUE["sidewall_load"].at(0.3)
    found = predict(VALUES, POINTS, [change])
    assert len(seen) > 2
    plain = State.of(VALUES, POINTS, GRID)
    there = change[1](plain.but(deflection=found.deflection))
    assert found.ring.radial_stiffness == pytest.approx(there.ring.radial_stiffness)
    for start in (0.005, 0.04):  # wherever it begins
        state = plain.but(deflection=np.full(2, start))
        assert chain.waveform(state, [change]).wave == pytest.approx(found.wave, rel=1e-6, abs=1e-9)


def test_a_steep_law_is_followed_in_a_few_presses(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = presses(monkeypatch)

    def stiffens(state: State) -> State:
        return state.but(k_u=state.k_u * (1.0 + (state.deflection / 0.025) ** 8))

    found = predict(VALUES, POINTS, [("constants", stiffens)])
    assert len(seen) < 12
    plain = State.of(VALUES, POINTS, GRID)
    assert found.k_u == pytest.approx(stiffens(plain.but(deflection=found.deflection)).k_u)


def test_a_law_that_no_deflection_satisfies_is_refused() -> None:
    middle = float(predict(VALUES, POINTS).deflection[0])

    def jumps(state: State) -> State:  # deep makes stiff, stiff makes flat, flat makes soft
        return state.but(k_u=state.k_u * np.where(state.deflection > middle, 1.5, 0.7))

    with pytest.raises(ConvergenceError, match="constants that follow the deflection") as caught:
        predict(VALUES, POINTS, [("constants", jumps)])
    assert caught.value.residual > chain.SETTLED


@pytest.mark.parametrize(
    ("name", "unit", "value"),
    [
        ("creep", 0.0, 0.02),
        ("innerliner_offset", 0.0, -0.003),
        ("bending_stiffness", 0.0, 2.0),
        ("tread_poisson", 0.3, 0.1),
    ],
)
def test_moves_end_where_the_range_does(name: str, unit: float, value: float) -> None:
    coordinate, field = Coordinate(name, unit), FIELDS[name]
    low, high = coordinate.ends(value)
    assert low < 0.0 < high
    reached = sorted(float(coordinate.moved(value, z)) for z in (low, high) if np.isfinite(z))
    limits = [x for x in (field.lowest, field.highest) if unit or x * value > 0.0]
    assert reached == pytest.approx([x for x in limits if np.isfinite(x)])
    at_end = float(coordinate.moved(value, high)) if np.isfinite(high) else value
    assert coordinate.ends(at_end)[1] == pytest.approx(0.0 if np.isfinite(high) else high)
