"""Fixtures: the synthetic runs, made once, and a campaign written from them."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.unit.campaign.campaign_synthetic import HEADER, Write, make_runs
from tirelib.campaign import CampaignHeader, Run, write_campaign


@pytest.fixture(scope="session")
def sound_runs() -> tuple[Run, ...]:
    return tuple(make_runs())


@pytest.fixture
def write(tmp_path: Path, sound_runs: tuple[Run, ...]) -> Write:
    """Write a campaign, by default the sound one, and return its folder."""

    def write_it(runs: Sequence[Run] | None = None, header: CampaignHeader = HEADER) -> Path:
        folder = tmp_path / "campaign"
        write_campaign(folder, header, sound_runs if runs is None else runs)
        return folder

    return write_it
