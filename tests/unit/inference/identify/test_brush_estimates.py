"""Intervals of the brush hold what a structurally different tire has; advice is computed."""

import numpy as np
import pytest

from tests.magic_tires import RATIOS, magic, magic_data
from tests.unit.inference.identify.test_brush_fit import A0, MU, SMALL, TRUTH, WIDE, C, make
from tirelib.inference.identify.brush_advice import NO_RUN, advice
from tirelib.inference.identify.brush_estimates import estimates_of, slip_stiffness
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.brush_study import Study, study_of
from tirelib.inference.identify.force_data import ForceData
from tirelib.physics.brush.mf import magic_forces
from tirelib.physics.brush.mf_tire import MagicTire


def inside(study: Study, tire: MagicTire) -> dict[str, list[bool]]:
    """Return for each property of the tire whether its interval holds it."""
    out: dict[str, list[bool]] = {}
    by_name = {each.name: each for each in estimates_of(study)}
    friction = float(magic_forces(tire, study.fit.reference.load, 0.1).friction_y)
    found = by_name["friction"]
    out["friction"] = [found.low <= friction <= found.high]
    for each in slip_stiffness(study):
        at = magic_forces(tire, each.load, 0.0)
        across = each.slip == "slip_angle"
        true = -float(at.cornering_stiffness) if across else float(at.slip_stiffness)
        out.setdefault(each.slip, []).append(each.low <= true <= each.high)
        if abs(each.load - 4500.0) < 200.0:
            # told at a middle load: within what may be called identifiable
            assert 0.5 * (each.high - each.low) < 0.4 * each.value
    return out


def test_intervals_hold_the_stiffness_and_friction_of_another_kind_of_tire() -> None:
    """Coverage 0.90 or more; 12 tires, seeds that no constant of the intervals has seen."""
    hits: dict[str, list[bool]] = {}
    narrow = 0
    for seed in range(500, 512):
        rng = np.random.default_rng(seed)
        tire = magic(rng)
        data = magic_data(tire, rng, RATIOS if seed % 3 == 0 else ())
        study = study_of(fit_brush(data))
        for name, each in inside(study, tire).items():
            hits.setdefault(name, []).extend(each)
        # what the points' scatter alone says is far too sure of itself
        friction = next(e for e in estimates_of(study) if e.name == "friction")
        narrow += friction.high - friction.low > 3.0 * 2.0 * 1.96 * friction.fit_std
    every = [hit for each in hits.values() for hit in each]
    assert np.mean(every) >= 0.90
    for name, each in hits.items():
        assert np.mean(each) >= 0.75, name
    assert narrow > 0


def test_a_brush_is_recognised_as_one() -> None:
    """Its own misfit is noise: intervals are narrow and hold the truth."""
    data = make(WIDE, noise=20.0, seed=3)
    study = study_of(fit_brush(data))
    by_name = {each.name: each for each in estimates_of(study)}
    # c_py is C over the square of the contact length: twice its error
    for name, widest in (("lateral_stiffness", 0.3), ("friction", 0.1), ("half_length", 0.15)):
        each = by_name[name]
        assert each.low < TRUTH[name] < each.high, name
        assert each.high - each.low < widest * each.value, name
        assert not each.flags
    for slope in slip_stiffness(study):
        half = A0 * (slope.load / np.median(data.load)) ** 0.45
        assert slope.low < 2.0 * C * half**2 < slope.high
        assert slope.high - slope.low < 0.1 * slope.value


def told(data: ForceData, **options: object) -> tuple[Study, dict[str, str]]:
    study = study_of(fit_brush(data, **options))
    return study, advice(study)


def test_what_mz_would_tell_is_said_to_be_told_by_mz() -> None:
    data = make(WIDE, noise=20.0)
    study, helps = told(data, forces=("Fy",))
    by_name = {each.name: each for each in estimates_of(study)}
    assert by_name["lateral_stiffness"].flags == ("not_identifiable",)
    assert helps["lateral_stiffness"].startswith("Mz recorded in the same runs")
    assert "not_identifiable" not in by_name["friction"].flags


def test_what_large_slip_would_tell_is_said_to_be_told_by_large_slip() -> None:
    study, helps = told(make(SMALL, noise=60.0, seed=4))
    friction = next(e for e in estimates_of(study) if e.name == "friction")
    assert "not_identifiable" in friction.flags
    assert friction.low < MU < friction.high
    assert "up to" in helps["friction"] or "slip ratios" in helps["friction"]


def test_what_nothing_helps_is_said_to_be_the_misfit() -> None:
    """A dense campaign of another kind of tire: more runs of the kind do not narrow mu."""
    rng = np.random.default_rng(7)
    tire = magic(rng)
    _, helps = told(magic_data(tire, rng, RATIOS))
    assert NO_RUN in helps.values()


def test_a_half_length_that_no_tire_has_is_flagged() -> None:
    data = make(WIDE)
    study = study_of(fit_brush(data))
    flags = {
        radius: next(e for e in estimates_of(study, free_radius=radius) if e.name == "half_length")
        for radius in (0.08, 0.3)
    }
    assert "beyond_geometry" in flags[0.08].flags
    assert "beyond_geometry" not in flags[0.3].flags


@pytest.mark.parametrize("seed", [1, 2])
def test_a_rigid_carcass_stands_at_its_boundary(seed: int) -> None:
    data = make(WIDE, noise=20.0, yaw_compliance=1.2e-3, seed=seed)
    study = study_of(fit_brush(data, free=("yaw_compliance",)))
    each = next(e for e in estimates_of(study) if e.name == "yaw_compliance")
    assert "at_boundary" in each.flags
    assert each.high <= 5e-4
