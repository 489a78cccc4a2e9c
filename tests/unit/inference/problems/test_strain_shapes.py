"""Smooth shapes of strain round the turn."""

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import operating
from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.discrepancy import TOP, along_turn
from tirelib.inference.problems.strain_shapes import GOES_WITH, NEIGHBOURS, SHAPES, smooth_shapes
from tirelib.measured.waveforms import GRID

POINTS = operating(np.array([3000.0, 5000.0]), np.array([2.0e5, 2.4e5]))
HALF_ANGLE = np.array([0.18, 0.22])


def groups() -> dict[str, FloatArray]:
    waveform = 1e-3 * np.cos(GRID) * np.ones((2, 1))
    return smooth_shapes(waveform, HALF_ANGLE, POINTS)


def columns() -> FloatArray:
    waveform = 1e-3 * np.cos(GRID) * np.ones((2, 1))
    return SHAPES.columns(waveform, along_turn(GRID, HALF_ANGLE), POINTS)


def test_the_place_along_the_turn_goes_from_edge_to_top_at_every_load() -> None:
    half = np.array([0.08, 0.16, 0.4])
    at = np.stack([-np.pi * np.ones(3), -half, 0.3 * half, half, np.pi * np.ones(3)], axis=1)
    place = np.concatenate([along_turn(at[k], half[k : k + 1]) for k in range(3)])
    assert place == pytest.approx(np.array([-TOP, -1.0, 0.3, 1.0, TOP]) * np.ones((3, 1)))
    turn = along_turn(GRID, half)
    assert (np.diff(turn, axis=1) > 0.0).all()
    # where the contact is as long as that of the unit, the place is in half contact angles
    usual = np.array([np.pi / TOP])
    assert along_turn(GRID, usual) == pytest.approx(GRID[None] / usual[:, None])


def test_what_is_at_the_top_at_every_load_is_constant() -> None:
    wave = 1e-3 * np.exp(-0.5 * ((np.abs(GRID) - 2.6) / 0.5) ** 2) * np.ones((2, 1))
    wave -= wave.mean(axis=1, keepdims=True)
    shapes = groups()["constant, far belt"].reshape(14, -1)
    mix, *_ = np.linalg.lstsq(shapes.T, wave.ravel(), rcond=1e-9)
    left = (wave.ravel() - mix @ shapes).reshape(wave.shape)
    far = np.abs(GRID) > 1.5
    assert np.abs(left[:, far]).max() < 0.05 * wave.max()


def test_every_bump_is_in_one_group() -> None:
    found = groups()
    assert len(found) == 3 * len(GOES_WITH)
    assert sum(map(len, found.values())) == len(columns()) == len(GOES_WITH) * SHAPES.knots


def test_shapes_far_from_the_contact_span_what_their_bumps_span() -> None:
    far = groups()["constant, far belt"].reshape(14, -1)
    bumps = columns()[: SHAPES.knots].reshape(SHAPES.knots, -1)
    # seven bumps on either side
    bumps = np.concatenate([bumps[:7], bumps[-7:]])
    mix, *_ = np.linalg.lstsq(bumps.T, far.T, rcond=None)
    assert bumps.T @ mix == pytest.approx(far.T, abs=1e-12)
    assert np.linalg.matrix_rank(mix, tol=1e-6) == 14
    # equal and independent sizes of the shapes make bumps that go together
    shared = mix @ mix.T
    assert np.diag(shared) == pytest.approx(1.0, abs=2e-3)
    apart = np.arange(7)
    for side in (slice(0, 7), slice(7, 14)):
        assert shared[side, side][0] == pytest.approx(
            np.exp(-0.5 * (apart / NEIGHBOURS) ** 2), abs=2e-3
        )
    assert shared[:7, 7:] == pytest.approx(0.0, abs=1e-9)


def test_shapes_near_the_contact_are_bumps_by_themselves() -> None:
    found = groups()
    bumps = columns()[: SHAPES.knots]
    near = np.concatenate([found["constant, contact"], found["constant, free belt"]])
    middle = bumps[7:-7]
    assert len(near) == len(middle)
    assert all(any(np.array_equal(each, bump) for bump in middle) for each in near)


def test_shapes_go_with_load_and_pressure() -> None:
    found = groups()
    for name in ("load", "pressure"):
        share = [
            np.linalg.norm(found[f"{name}, contact"][:, run])
            / np.linalg.norm(found["constant, contact"][:, run])
            for run in (0, 1)
        ]
        assert share[1] != pytest.approx(share[0], rel=0.1)
