"""Smooth shapes of strain round the turn."""

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import operating
from tirelib.core.arrays import FloatArray
from tirelib.inference.problems.strain_shapes import GOES_WITH, NEIGHBOURS, SHAPES, smooth_shapes
from tirelib.measured.waveforms import GRID

POINTS = operating(np.array([3000.0, 5000.0]), np.array([2.0e5, 2.4e5]))
HALF_ANGLE = np.array([0.18, 0.22])


def groups() -> dict[str, FloatArray]:
    waveform = 1e-3 * np.cos(GRID) * np.ones((2, 1))
    return smooth_shapes(waveform, HALF_ANGLE, POINTS)


def columns() -> FloatArray:
    waveform = 1e-3 * np.cos(GRID) * np.ones((2, 1))
    return SHAPES.columns(waveform, HALF_ANGLE, POINTS, GRID)


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
