"""Laws of the regressors: what a common gain, the mirror image and a reversed contact do to them.

And the lines and parabolas over the width that they are read from.
"""

from dataclasses import fields, replace

import numpy as np
import pytest

from tirelib.estimators.regressors import EVEN, ODD, SHAPE, compute_regressors
from tirelib.measured.features.extract import Features

N, GAGES = 7, 5
STRAINS = ("cp1", "cp2", "tp", "rate_lead", "rate_trail", "e_vertical")
"""What grows with a gain that all gages share."""
REVERSED = {"steepness_change": -1.0, "skew": -1.0, "traction": -1.0}
"""What turns its sign where the contact is run through from behind."""


@pytest.fixture(scope="module")
def features() -> Features:
    """Any numbers, edges and peaks in their order."""
    rng = np.random.default_rng(5)
    made = {
        field.name: rng.uniform(0.5, 1.5, (N, GAGES))
        for field in fields(Features)
        if field.name != "lateral"
    }
    for name in ("omega", "speed", "pressure", "camber"):
        made[name] = made[name][:, 0]
    made |= {
        "lead": -0.2 * made["lead"],
        "trail": 0.2 * made["trail"],
        "cp1_angle": -0.4 * made["cp1_angle"],
        "cp2_angle": 0.4 * made["cp2_angle"],
        "rate_trail": -made["rate_trail"],
    }
    made["time"] = made["time"][:, 0]
    return Features(**made, lateral=np.array([-0.06, -0.03, 0.0, 0.03, 0.06]))


def of(features: Features) -> dict[str, np.ndarray]:
    return compute_regressors(features, range(GAGES))


def test_a_gain_that_all_gages_share_drops_out(features: Features) -> None:
    grown = replace(features, **{name: 1.3 * getattr(features, name) for name in STRAINS})
    here, there = of(features), of(grown)
    np.testing.assert_allclose(there["tension"], 1.3 * here["tension"])
    for name in {*EVEN, *ODD, *SHAPE} - {"tension"}:
        np.testing.assert_allclose(there[name], here[name], rtol=1e-9, atol=1e-12, err_msg=name)


def test_the_mirror_image_keeps_what_is_even_and_turns_what_is_odd(features: Features) -> None:
    over_width = [f.name for f in fields(Features) if getattr(features, f.name).ndim == 2]
    turned = replace(features, **{name: getattr(features, name)[:, ::-1] for name in over_width})
    here, there = of(features), of(turned)
    for name in (*EVEN, *SHAPE):
        np.testing.assert_allclose(there[name], here[name], rtol=1e-9, atol=1e-12, err_msg=name)
    for name in ODD:
        np.testing.assert_allclose(there[name], -here[name], rtol=1e-9, atol=1e-12, err_msg=name)


def test_a_contact_run_through_from_behind_changes_ends(features: Features) -> None:
    """Leading and trailing change places, and so do both peaks; what is left stays."""
    f = features
    other = replace(
        f,
        lead=-f.trail,
        trail=-f.lead,
        rate_lead=-f.rate_trail,
        rate_trail=-f.rate_lead,
        cp1=f.cp2,
        cp2=f.cp1,
        cp1_angle=-f.cp2_angle,
        cp2_angle=-f.cp1_angle,
        skew=-f.skew,
    )
    here, there = of(f), of(other)
    for one, two in (
        ("lead_bend", "trail_bend"),
        ("cp1_slope", "cp2_slope"),
        ("cp1_bow", "cp2_bow"),
    ):
        np.testing.assert_allclose(there[one], here[two], rtol=1e-9, atol=1e-12, err_msg=one)
        assert (np.abs(here[one] - here[two]) > 1e-3).any()
    for name in (
        "contact_angle",
        "compression",
        "tension",
        "angle_slope",
        "tp_slope",
        "angle_bow",
        "tp_bow",
        "fullness",
        "steepness",
        *REVERSED,
    ):
        sign = REVERSED.get(name, 1.0)
        np.testing.assert_allclose(there[name], sign * here[name], rtol=1e-9, err_msg=name)


def test_levels_slopes_and_bows_are_those_of_a_parabola_over_the_width(features: Features) -> None:
    """With c + d y + e y^2 over +-1: slope d; bow e whichever gages are left; level of the line."""
    y = features.lateral / 0.06
    level, slope, bow = (
        np.linspace(1.0, 2.0, N),
        np.linspace(-0.2, 0.3, N),
        np.linspace(0.1, 0.5, N),
    )
    curved = level[:, None] + slope[:, None] * y + bow[:, None] * y**2
    even = replace(features, tp=np.full((N, GAGES), 2.0), cp1=curved)
    found = of(even)
    np.testing.assert_allclose(found["cp1_slope"], slope / 2.0)
    np.testing.assert_allclose(found["cp1_bow"], bow / 2.0)
    np.testing.assert_allclose(found["tp_bow"], 0.0, atol=1e-12)
    np.testing.assert_allclose(
        found["traction"] + np.mean(even.cp2, axis=1) / 2.0, (level + bow * np.mean(y**2)) / 2.0
    )
    few = compute_regressors(even, (0, 2, 3, 4))
    np.testing.assert_allclose(few["cp1_bow"], bow / 2.0)
    np.testing.assert_allclose(of(features)["skew"], features.skew.mean(axis=1))
    # a bend is a distance: from the edge outwards to its peak
    apart = replace(features, lead=np.full((N, GAGES), -0.2), cp1_angle=np.full((N, GAGES), -0.3))
    np.testing.assert_allclose(of(apart)["lead_bend"], 0.1)
