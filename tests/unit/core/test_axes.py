"""Signs of quantities in axis systems, from the turn that leads from one system to another."""

import pytest

from tirelib.core.axes import sign

ALONG_Y_OR_Z = ("Fy", "Fz", "Mz", "lateral")
NAMES = (*ALONG_Y_OR_Z, "Fx", "Mx", "slip_angle", "camber", "slip_ratio", "speed", "pressure")


@pytest.mark.parametrize("name", NAMES)
def test_sae_is_iso_turned_by_half_a_turn_about_x(name: str) -> None:
    assert sign(name, "iso") == 1.0
    assert sign(name, "sae") == (-1.0 if name in (*ALONG_Y_OR_Z, "slip_angle") else 1.0)


@pytest.mark.parametrize("name", NAMES)
def test_adapted_sae_is_sae_with_a_positive_load_and_the_slip_angle_of_iso(name: str) -> None:
    changed = name in ("Fz", "slip_angle")
    assert sign(name, "adapted_sae") == (1.0 if changed else sign(name, "sae"))
