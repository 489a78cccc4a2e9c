"""Laws of the virtual tire whose road may be slippery: the friction is an input of its surface."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from fmpy.validation import validate_fmu

from tests.fmu.virtual_host import (
    TYPICAL,
    Host,
    file,
    friction,
    friction_file,
    hold_against_rig,
    hold_mirrored,
    surface,
)
from tirelib.cli.fmu import fmu as command
from tirelib.fmu.check import check_fmu
from tirelib.fmu.virtual.coordinates import FRICTION, INPUTS
from tirelib.rig.tire import tire

OWN = tire("reference").friction


@pytest.fixture(scope="module")
def slippery() -> Iterator[Host]:
    host = Host(friction_file())
    yield host
    host.close()


def conditions(n: int, seed: int) -> np.ndarray:
    known = friction()
    share = np.random.default_rng(seed).uniform(0.05, 0.95, (n, known.low.size))
    return np.asarray(known.low + (known.high - known.low) * share)


def test_friction_is_an_input_of_this_surface_and_not_of_the_other(slippery: Host) -> None:
    assert friction().inputs == (*INPUTS, FRICTION)
    assert surface().inputs == INPUTS
    assert FRICTION in slippery.references
    assert validate_fmu(str(friction_file())) == []
    document = check_fmu(friction_file())
    assert document["passed"], document["parts"]


def test_it_is_the_rig_at_another_friction_within_its_stated_error() -> None:
    condition, part = (3500.0, 0.05, -0.03, 0.01, 22.0, 2.4e5, 0.45), "friction 0.3 .. 0.5"
    _, apart = hold_against_rig(friction(), condition, part)
    told = friction().about["left_out"][part]
    assert abs(apart.fx) < 2.0 * told["Fx_N_rms"]
    assert abs(apart.fy) < 2.0 * told["Fy_N_rms"]


def test_at_the_friction_of_the_other_surface_both_say_the_same_within_their_errors() -> None:
    inputs = conditions(40, 1)
    inputs[:, -1] = OWN
    angle = np.linspace(-np.pi, np.pi, 180)
    apart = []
    for row in inputs:
        one = friction().strain(friction().answers(row[None]), angle)
        two = surface().strain(surface().answers(row[None, :-1]), angle)
        apart.append(one - two)
    left = [s.about["left_out"]["all"]["strain_ustrain_rms"] for s in (friction(), surface())]
    assert 1e6 * np.sqrt(np.mean(np.square(apart))) < np.hypot(*left)


def test_no_force_along_the_road_is_larger_than_friction_allows() -> None:
    inputs = conditions(400, 2)
    force = friction().forces_of(friction().answers(inputs))
    spare = inputs[:, -1] * inputs[:, 0] - np.hypot(force[:, 0], force[:, 1])
    told = friction().about["left_out"]["friction 0.3 .. 0.5"]
    error = np.hypot(told["Fx_N_rms"], told["Fy_N_rms"])  # at the friction where it is largest
    assert np.sqrt(np.mean(np.minimum(spare, 0.0) ** 2)) < error
    assert spare.min() > -4.0 * error


def test_the_mirror_image_of_a_slippery_condition_has_the_mirror_image_of_its_strain() -> None:
    hold_mirrored(friction(), conditions(20, 3), np.linspace(-np.pi, np.pi, 20))


def test_where_the_road_is_slippery_the_lateral_force_is_what_friction_leaves(
    slippery: Host,
) -> None:
    found = {}
    for mu in (0.95, 0.35):
        slippery.start({**TYPICAL, "alpha": 0.12, "kappa": 0.0, FRICTION: mu})
        found[mu] = slippery.get("Fy_rig")
    assert found[0.95] < 2.0 * found[0.35] < 0.0
    assert abs(found[0.35]) == pytest.approx(0.35 * 4000.0, rel=0.1)


def test_friction_acts_at_once_and_out_of_range_it_is_named(slippery: Host) -> None:
    inputs = {**TYPICAL, "alpha": 0.1, FRICTION: 0.95}
    slippery.start(inputs)
    before = slippery.play(2)
    slippery.put(friction=0.4)
    slippery.step()
    assert slippery.get("status") == "ok"
    there = slippery.get("Fy_rig")
    slippery.start({**inputs, FRICTION: 0.4})
    assert there == pytest.approx(slippery.get("Fy_rig"), rel=1e-9)
    for value in (0.1, 1.5, -0.5, np.nan, np.inf):
        slippery.start(inputs)
        slippery.play(2)
        slippery.put(friction=value)
        slippery.step()
        assert slippery.get("status") == "out_of_range: friction"
        assert slippery.get("frame_valid") is False
        np.testing.assert_array_equal(slippery.frame(), before[-10:])


def test_a_dry_and_a_slippery_wheel_roll_in_one_process(slippery: Host) -> None:
    dry = Host(file(10))
    inputs = {**TYPICAL, "alpha": 0.1}
    try:
        dry.start(inputs)
        alone = dry.play(20)
        dry.start(inputs)
        slippery.start({**inputs, FRICTION: 0.4})
        together = []
        for _ in range(20):
            dry.step()
            slippery.step()
            together.append(dry.frame())
        np.testing.assert_array_equal(np.concatenate(together), alone)
        assert abs(slippery.get("Fy_rig")) < 0.7 * abs(dry.get("Fy_rig"))
    finally:
        dry.close()


def test_the_command_line_makes_it_and_refuses_two_surfaces(tmp_path: Path) -> None:
    out = tmp_path / "x.fmu"
    made = CliRunner().invoke(command, ["virtual", "--out", str(out), "--friction"])
    assert made.exit_code == 0, made.output
    assert out.read_bytes() == friction_file().read_bytes()
    both = ["virtual", "--out", str(out), "--friction", "--surface", "y.npz"]
    refused = CliRunner().invoke(command, both)
    assert "--friction and --surface y.npz; only one of them is allowed" in str(refused.exception)
