"""What plain tires show beside the shear of their belt."""

import numpy as np
import pytest

from tirelib.diagnose.plain import BESIDE, BY_ITSELF, SHEAR, SHOWN, usual
from tirelib.effects import CATALOGUE

FRICTION, DAMPING = CATALOGUE["tread_friction"], CATALOGUE["sidewall_damping"]


@pytest.mark.parametrize(
    ("name", "shown"),
    [("tread_friction", (0.045, 0.0)), ("gage_saturation", (0.01,)), ("rotary_inertia", (1e-4,))],
)
def test_plain_tires_show_a_strength_and_twice_beside_others(
    name: str, shown: tuple[float, ...]
) -> None:
    effect, strength = CATALOGUE[name], np.array(shown)
    assert usual([SHEAR], effect, strength)
    assert not usual([SHEAR], effect, 2.3 * strength)
    assert usual([SHEAR, DAMPING], effect, 2.3 * strength)
    assert not usual([SHEAR, DAMPING], effect, 4.6 * strength)


def test_without_the_shear_nothing_is_known_to_be_usual() -> None:
    assert not usual([], FRICTION, np.zeros(2))
    assert not usual([DAMPING], FRICTION, np.zeros(2))


def test_friction_that_bends_the_flat_piece_is_more_than_structure() -> None:
    pulled, bent = SHOWN[FRICTION]
    assert not usual([SHEAR], FRICTION, np.array([0.0, -1.01 * BY_ITSELF * bent]))
    assert not usual([SHEAR], FRICTION, 0.8 * BY_ITSELF * np.array([pulled, bent])), "together"
    assert usual([SHEAR], FRICTION, 0.7 * BY_ITSELF * np.array([pulled, bent]))
    assert BESIDE > BY_ITSELF


def test_what_no_structure_looks_like_is_never_usual() -> None:
    assert not usual([SHEAR], DAMPING, np.zeros(1))
