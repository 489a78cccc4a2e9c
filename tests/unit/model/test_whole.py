"""The whole model is the chain with its correction, and its slopes are its differences."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from tests.unit.identify.model_waves import TIRE, operating
from tirelib.arrays import FloatArray
from tirelib.errors import ParameterError
from tirelib.model.base import BARE, coordinates, large_displacements, move, predict, values_of
from tirelib.model.chain import Changes
from tirelib.model.state import State
from tirelib.model.whole import solve_whole, whole_slopes, with_slopes

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
    "tread_poisson": 0.5,
    "contact_crown": 0.3,
    "creep": 0.005,
    "tread_spread": 0.3,
}
CASES: dict[str, tuple[Mapping[str, float | FloatArray], Changes]] = {
    "plain": (VALUES, ()),
    "damped": ({**VALUES, "damping": 0.05}, ()),
    "of the plain tire": (GRIPPING, ()),
    "with an effect": (VALUES, [("constants", softer)]),
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_the_chain_with_its_correction(case: str) -> None:
    values, changes = CASES[case]
    fix = replace(large_displacements(values, POINTS), start=None)  # both from the same start
    state = predict(values, POINTS, changes, correction=fix)
    found = solve_whole(values, POINTS, changes)
    # an effect sees the corrected deflection or not: none of these looks at it
    assert found.waveform == pytest.approx(state.wave, abs=1e-10)
    assert found.deflection == pytest.approx(state.deflection, abs=1e-12)


def test_without_large_displacements_it_is_the_chain() -> None:
    found = solve_whole(VALUES, POINTS, exact=False)
    assert found.contact is None
    assert found.waveform == pytest.approx(predict(VALUES, POINTS).wave, abs=1e-15)


@pytest.mark.parametrize(("case", "exact"), [(c, True) for c in CASES] + [("damped", False)])
def test_slopes_are_differences(case: str, exact: bool) -> None:
    values, changes = CASES[case]
    found = solve_whole(values, POINTS, changes, exact=exact)
    free = coordinates(values)
    slopes = whole_slopes(found, values, POINTS, free, changes)
    h = 1e-5
    for k in range(len(free) + 2):
        ends = []
        for step in (-h, h):
            z = np.zeros(len(free))
            at = POINTS
            if k < len(free):
                z[k] = step
            else:
                name = ("load", "pressure")[k - len(free)]
                at = replace(POINTS, **{name: getattr(POINTS, name) * (1.0 + step)})
            ends.append(
                solve_whole(move(values, z, free), at, changes, start=found.contact, exact=exact)
            )
        wave = (ends[1].waveform - ends[0].waveform) / (2.0 * h)
        depth = (ends[1].deflection - ends[0].deflection) / (2.0 * h)
        # the linear part's one-sided step of 1e-4; where it plays no part, a thousandth of that
        close = 3e-3 if changes or values["damping"] or not exact else 1e-5
        assert slopes.waveform[k] == pytest.approx(wave, abs=close * np.abs(wave).max() + 1e-9)
        assert slopes.deflection[k] == pytest.approx(depth, abs=close * np.abs(depth).max() + 1e-9)


def test_a_start_along_the_slopes_is_near() -> None:
    found = solve_whole(VALUES, POINTS)
    slopes = whole_slopes(found, VALUES, POINTS, BARE)
    dz = np.array([0.05, -0.04, 0.1, 0.05, 0.1, -0.05, 0.02, 0.1])
    start = slopes.start(found, dz)
    there = solve_whole(move(VALUES, dz, BARE), POINTS)
    assert start is not None
    moved = np.abs(there.deflection - found.deflection)
    assert (np.abs(start.depth - there.deflection) < 0.1 * moved).all()


def test_a_correction_follows_the_coordinates_to_first_order() -> None:
    fix = with_slopes(large_displacements(VALUES, POINTS), VALUES, POINTS, BARE)
    way = np.array([0.05, -0.04, 0.1, 0.05, 0.1, -0.05, 0.02, 0.1])
    off = []
    for share in (1.0, 0.5):
        there = large_displacements(move(VALUES, share * way, BARE), POINTS)
        moved, change = fix.moved(share * way), there.waveform - fix.waveform
        off.append(float(np.abs(moved.waveform - there.waveform).max()))
        assert off[-1] < 0.2 * np.abs(change).max()
        assert (
            np.abs(moved.deflection - there.deflection).max()
            < 0.2 * np.abs(there.deflection - fix.deflection).max()
        )
    assert off[1] < 0.35 * off[0], "what is left goes with the square"


def test_points_may_move_by_themselves() -> None:
    fix = with_slopes(large_displacements(VALUES, POINTS), VALUES, POINTS, BARE)
    way = 0.05 * np.ones((len(BARE), len(POINTS)))
    way[:, 1:] = 0.0
    moved, all_moved = fix.moved(way), fix.moved(way[:, 0])
    np.testing.assert_array_equal(moved.waveform[0], all_moved.waveform[0])
    np.testing.assert_array_equal(moved.waveform[1:], fix.waveform[1:])


def test_a_correction_without_its_contact_has_no_slopes() -> None:
    fix = replace(large_displacements(VALUES, POINTS), contact=None)
    with pytest.raises(ParameterError, match="without its contact"):
        with_slopes(fix, VALUES, POINTS, BARE)
