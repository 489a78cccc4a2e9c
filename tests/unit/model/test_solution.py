"""Effects act on the rolling ring: a changed constant is that of another tire, slopes are exact."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from routes.correction import large_displacements, predict_with

from tests.unit.inference.identify.model_waves import TIRE, operating
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.effects.state import READ, State
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import BARE, coordinates, move, predict, values_of
from tirelib.model.chain import Changes
from tirelib.model.slopes import SolutionSlopes, added_by_values, by_effects, by_values, slopes_of
from tirelib.model.solution import Solution, made_with, solved
from tirelib.physics.rolling.solve import Rolling

VALUES = values_of(TIRE)
POINTS = operating(np.array([2500.0, 4500.0, 6500.0]), np.array([1.8e5, 2.1e5, 2.4e5]))


def softer(state: State) -> State:
    return state.but(k_u=0.9 * state.k_u)


GRIPPING = {
    **VALUES,
    "shear_stiffness": 5e4,
    "rotary_inertia": 8e-5,
    "tread_shear_stiffness": 2e7,
    "tread_hardening": 1.0,
    "section_pull": 0.03,
    "liner_share": 0.4,
    "offset_pressure_slope": 0.04,
    "tread_poisson": 0.5,
    "contact_crown": 0.3,
    "creep": 0.005,
    "tread_spread": 0.3,
    "centrifugal_tension": 0.98,
}
CASES: dict[str, tuple[Mapping[str, float | FloatArray], Changes]] = {
    "plain": (VALUES, ()),
    "damped": ({**VALUES, "damping": 0.05}, ()),
    "of the plain tire": (GRIPPING, ()),
}
LOW_PASS = LowPass()
FREE = coordinates(GRIPPING)


def at(
    values: dict[str, float | FloatArray], changes: Changes = (), start: Rolling | None = None
) -> Solution:
    return solved(values, POINTS, changes, low_pass=LOW_PASS, start=start)


@pytest.mark.parametrize(
    ("name", "strength", "field"),
    [("temperature", 0.0, "k"), ("temperature", 0.2, "k"), ("tread_load", 0.3, "tread")],
)
def test_an_effect_is_a_tire_with_other_constants(name: str, strength: float, field: str) -> None:
    found = at(GRIPPING, [CATALOGUE[name].at(strength)])
    values = dict(GRIPPING)
    if field == "k":
        # the temperature is not measured: the place in the campaign stands for it
        soft = np.exp(-strength * POINTS.order)
        for stiffness in ("radial", "tangential"):
            values[f"{stiffness}_stiffness"] = values[f"{stiffness}_stiffness"] * soft
            values[f"{stiffness}_pressure_slope"] = values[f"{stiffness}_pressure_slope"] * soft
        values["tread_stiffness"] = values["tread_stiffness"] * soft
    if field == "tread":
        values["tread_stiffness"] = values["tread_stiffness"] * (POINTS.load / 4000.0) ** strength
    assert found.waveform == pytest.approx(at(values).waveform, abs=1e-11)


@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_gages_whose_offset_goes_with_the_pressure_are_those_of_another_offset(
    damping: float,
) -> None:
    """The rolling ring and, with damping, the linear one see y (1 + s (p / p0 - 1))."""
    values = {**GRIPPING, "damping": damping, "offset_pressure_slope": 0.2}
    grown = np.asarray(values["innerliner_offset"]) * (
        1.0 + 0.2 * (POINTS.pressure - TIRE.pressure) / TIRE.pressure
    )
    each = {**values, "innerliner_offset": grown, "offset_pressure_slope": 0.0}
    assert at(values).waveform == pytest.approx(at(each).waveform, abs=1e-12)
    assert np.ptp(grown) > 0.05 * np.abs(grown).min()
    assert grown == pytest.approx(
        TIRE.changed(offset_pressure_slope=0.2).offset_at(POINTS.pressure)
    )


def test_tension_beyond_the_spinning_belts_own_is_what_less_inertia_leaves() -> None:
    """What the sidewalls pull more than they weigh stiffens a belt as lost inertia does."""
    found = at({**GRIPPING, "centrifugal_tension": 1.03})
    lacking = at({**GRIPPING, "centrifugal_tension": 1.0}, [CATALOGUE["centrifugal"].at(-0.03)])
    assert found.waveform == pytest.approx(lacking.waveform, abs=1e-11)
    stiffer = at(GRIPPING).deflection - found.deflection
    assert (stiffer > 0.0).all()
    still = replace(POINTS, omega=np.zeros(len(POINTS)))
    one, other = (
        solved({**GRIPPING, "centrifugal_tension": x}, still, (), low_pass=LOW_PASS).deflection
        for x in (0.9, 1.1)
    )
    assert one == pytest.approx(other, rel=1e-12)


def test_constants_follow_the_deflection_that_they_cause() -> None:
    def falls(state: State) -> State:
        return state.but(k_u=state.k_u * np.exp(-0.4 * (state.deflection / 0.020 - 1.0)))

    found = at(GRIPPING, [("constants", falls)])
    again = made_with(GRIPPING, POINTS, [falls], found.deflection)
    assert found.made.constants.k_u == pytest.approx(again.constants.k_u, rel=1e-6)
    # softer than at no strength where the tire is pressed beyond 20 mm, stiffer where less
    change = found.deflection - at(GRIPPING).deflection
    assert (change[found.deflection > 0.021] > 0.0).all()


def test_a_sidewall_that_softens_acts_on_the_rolling_ring_at_every_place() -> None:
    effect = CATALOGUE["sidewall_load"]
    found = at(GRIPPING, [effect.at(0.4)])
    assert found.made.constants.softening == pytest.approx([20.0] * len(POINTS))
    assert found.made.constants.k_u == pytest.approx(at(GRIPPING).made.constants.k_u)
    assert (found.deflection > at(GRIPPING).deflection).all()


def test_what_the_rolling_ring_has_not_is_what_the_linear_one_changes() -> None:
    def damped(state: State) -> State:
        return state.but(damping=state.damping + 0.05)

    changes = [("constants", damped)]
    found = at(GRIPPING, changes)
    linear = predict(GRIPPING, POINTS, changes, low_pass=LOW_PASS).wave
    plain = predict(GRIPPING, POINTS, low_pass=LOW_PASS).wave
    assert found.waveform - at(GRIPPING).waveform == pytest.approx(linear - plain, abs=1e-10)
    assert np.abs(linear - plain).max() > 1e-6


def test_effects_at_the_gage_find_the_deflection_of_the_solution() -> None:
    def deeper(state: State) -> State:
        return state.but(waveform=state.waveform * (1.0 + 10.0 * state.deflection[:, None]))

    plain, found = at(GRIPPING), at(GRIPPING, [("gage", deeper)])
    growth = 1.0 + 10.0 * plain.deflection[:, None]
    np.testing.assert_allclose(found.waveform, plain.waveform * growth, rtol=1e-12)
    # the deflection is held: a difference over a step of the waveform
    slopes, before = (by_values(one, FREE[:1]).waveform for one in (found, plain))
    np.testing.assert_allclose(slopes, before * growth, atol=1e-9 * np.abs(before).max())


@pytest.mark.parametrize(
    "effects",
    [
        {"temperature": 0.1},
        {"sidewall_load": 0.4},
        {"gage_saturation": 0.5},
        {"roughness": 0.1},
        {"sidewall_load": 0.3, "roughness": 0.1, "gage_saturation": 0.3},
    ],
)
def test_slopes_are_differences(effects: dict[str, float]) -> None:
    def with_them(z: FloatArray, more: dict[str, float]) -> FloatArray:
        values = move(GRIPPING, z, FREE)
        changes = [CATALOGUE[name].at(s) for name, s in more.items()]
        return at(values, changes, found.rolling).waveform

    zero = np.zeros(len(FREE))
    found = at(GRIPPING, [CATALOGUE[name].at(s) for name, s in effects.items()])
    slopes = by_values(found, FREE).waveform[: len(FREE)] + added_by_values(found, FREE, 1e-3)
    step = 1e-3
    for k in range(len(FREE)):
        there, back = zero.copy(), zero.copy()
        there[k], back[k] = step, -step
        difference = (with_them(there, effects) - with_them(back, effects)) / (2.0 * step)
        assert np.linalg.norm(slopes[k] - difference) < 0.01 * np.linalg.norm(difference), FREE[k]
    there_effects, steps = [], []
    for place, (name, strength) in enumerate(effects.items()):
        effect = CATALOGUE[name]
        there_effects.append((place, effect.at(strength + 1e-3 * effect.toward)))
        steps.append(1e-3 * effect.toward)
    rows = by_effects(found, there_effects, steps).waveform
    for row, name, h in zip(rows, effects, steps, strict=True):
        moved = {**effects, name: effects[name] + h}
        less = {**effects, name: effects[name] - h}
        difference = (with_them(zero, moved) - with_them(zero, less)) / (2.0 * h)
        assert np.linalg.norm(row - difference) < 0.02 * np.linalg.norm(difference), name


@pytest.mark.parametrize("case", CASES)
def test_it_is_the_chain_with_the_correction_of_a_tire_without_effects(case: str) -> None:
    values, changes = CASES[case]
    fix = replace(large_displacements(values, POINTS, LOW_PASS), start=None)
    state = predict_with(fix, values, POINTS, changes, low_pass=LOW_PASS)
    found = at(values, changes)
    assert found.waveform == pytest.approx(state.wave, abs=1e-10)
    assert found.deflection == pytest.approx(state.deflection, abs=1e-12)


@pytest.mark.parametrize("case", [*CASES, "with an effect"])
def test_slopes_by_numbers_and_set_points_are_differences(case: str) -> None:
    values, changes = CASES.get(case, (VALUES, [("constants", softer)]))
    found = at(values, changes)
    free = coordinates(values)
    slopes = slopes_of(found, free)
    h = 1e-5
    for k in range(len(free) + 2):
        ends = []
        for step in (-h, h):
            z = np.zeros(len(free))
            points = POINTS
            if k < len(free):
                z[k] = step
            else:
                name = ("load", "pressure")[k - len(free)]
                points = replace(POINTS, **{name: getattr(POINTS, name) * (1.0 + step)})
            there = move(values, z, free)
            ends.append(solved(there, points, changes, low_pass=LOW_PASS, start=found.rolling))
        wave = (ends[1].waveform - ends[0].waveform) / (2.0 * h)
        depth = (ends[1].deflection - ends[0].deflection) / (2.0 * h)
        # the linear part's one-sided step of 1e-4; where it plays no part, a thousandth of that
        close = 3e-3 if values["damping"] else 1e-5
        assert slopes.waveform[k] == pytest.approx(wave, abs=close * np.abs(wave).max() + 1e-9)
        assert slopes.deflection[k] == pytest.approx(depth, abs=close * np.abs(depth).max() + 1e-9)


def test_a_start_along_the_slopes_is_near() -> None:
    found = at(VALUES)
    dz = np.array([0.05, -0.04, 0.1, 0.05, 0.1, -0.05, 0.02, 0.1])
    start = slopes_of(found, BARE).start(found, dz)
    there = at(move(VALUES, dz, BARE))
    moved = np.abs(there.deflection - found.deflection)
    assert (np.abs(start.depth - there.deflection) < 0.1 * moved).all()


def test_directions_that_move_no_ring_have_no_deflection() -> None:
    with pytest.raises(ParameterError, match="none of their directions"):
        _ = SolutionSlopes(np.zeros((1, 3, 360)), None).deflection


def test_a_state_reads_the_values_it_says() -> None:
    read = set()

    class Watched(dict[str, float]):
        def __getitem__(self, name: str) -> float:
            read.add(name)
            return super().__getitem__(name)

    State.of(Watched(VALUES), POINTS, GRID)
    assert read == READ
