"""The sticking part of a contact under a shaped pressure."""

import numpy as np
import pytest

from tirelib.physics.brush import shaped


def test_the_ends_of_sticking_are_found_in_few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bristle at either end needs just the demand that it can bear; most points take 6 steps."""
    monkeypatch.setattr(shaped, "_STEPS", 20)
    c, t = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.8, 2.8, 37), np.linspace(0, 2, 81)))
    trailing, leading = shaped._ends(t, c)
    inside = (trailing > 0.0) & (trailing < 1.0)
    assert inside.sum() > 1000
    assert shaped._reach(trailing, c)[inside] == pytest.approx(t[inside], abs=1e-13)
    ahead = leading < 1.0
    assert ahead.sum() > 10
    assert shaped._reach(leading, c)[ahead] == pytest.approx(t[ahead], abs=1e-13)
    assert (trailing <= leading).all()
