"""What one run of a rig tells of its own signs and units, and what it is said to be."""

from dataclasses import replace

import numpy as np
import pytest

from tests.synthetic import header, synthetic_run
from tirelib.campaign import Run, RunPlan
from tirelib.campaign.check_order import force_sign_of
from tirelib.campaign.check_rig import rig_findings, shown
from tirelib.campaign.overview import run_row
from tirelib.campaign.read import Campaign
from tirelib.core.axes import FLIPPED, sign

PLAN = RunPlan(0, "a.mf4", "corner", 3e3, 2e5, 5.0, 0.03, 0.0, 0.0)


def rolling(run: Run) -> list[str]:
    return [each.key for each in rig_findings(run, header()) if each.key.startswith("rolling")]


@pytest.mark.parametrize("kappa", [-0.4, -0.2, 0.2, 0.4])
def test_a_wheel_that_brakes_or_drives_hard_has_the_turn_rate_that_its_slip_says(
    kappa: float,
) -> None:
    hard = synthetic_run(0, slip_ratio=kappa, load=4500.0)
    assert rolling(hard) == []
    unsaid = {name: values for name, values in hard.rig.items() if name != "slip_ratio"}
    other = {-0.4: True, -0.2: False, 0.2: False, 0.4: True}  # beyond four fifths, or 1.3 times
    assert bool(rolling(replace(hard, rig=unsaid))) == other[kappa]


@pytest.mark.parametrize("axes", list(FLIPPED))
@pytest.mark.parametrize("quantity", ["Fz", "Fy", "slip_angle", "pressure"])
def test_a_finding_shows_a_number_as_the_campaigns_axes_have_it(axes: str, quantity: str) -> None:
    """Inside it is ISO; the file's own sign is the one that its writer looks for."""
    assert shown(quantity, 0.1, axes) == shown(quantity, sign(quantity, axes) * 0.1, "iso")


@pytest.mark.parametrize("camber", [0.0, 0.3])
def test_a_small_slip_angle_beside_a_large_camber_tells_no_sign(camber: float) -> None:
    """Camber has a side force of its own, which goes to the side that the wheel leans to."""
    rig = {"slip_angle": 0.03, "camber": camber, "Fy": 500.0, "Fz": 3000.0}
    wrong = Run(PLAN, rig={name: np.full(5, value) for name, value in rig.items()})
    assert force_sign_of(wrong).share == (None if camber else 1.0)


def test_a_run_lasts_as_long_as_its_samples_do() -> None:
    assert run_row(Run(PLAN, np.zeros((5, 1000)), 1e3)).duration == pytest.approx(1.0)


def test_content_that_moves_from_one_file_to_the_next_is_other_content(tmp_path) -> None:
    plans = tuple(replace(PLAN, run=k, file=f"{k}.mf4") for k in range(2))
    campaign, hashes = Campaign(tmp_path, header(), plans), set()
    for name in ("campaign.toml", "runs.csv"):
        (tmp_path / name).write_text(name)
    # the last two are the same bytes with the names between them
    for first, second in ((b"ab", b"c"), (b"a", b"bc"), (b"a1.mf4\0b", b""), (b"a", b"b1.mf4\0")):
        (tmp_path / "0.mf4").write_bytes(first)
        (tmp_path / "1.mf4").write_bytes(second)
        hashes.add(campaign.content_hash())
    assert len(hashes) == 4
