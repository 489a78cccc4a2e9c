"""Fixtures: the synthetic runs, made once, and a campaign written from them."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.unit.campaign.campaign_synthetic import HEADER, Write, make_runs
from tirelib.campaign import CampaignHeader, Run, write_campaign
from tirelib.campaign.mdf import write_mdf


@pytest.fixture(scope="session")
def sound_runs() -> tuple[Run, ...]:
    return tuple(make_runs())


@pytest.fixture(scope="session")
def sound_campaign(sound_runs: tuple[Run, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound") / "campaign"
    write_campaign(folder, HEADER, sound_runs)
    return folder


@pytest.fixture
def write(tmp_path: Path, sound_runs: tuple[Run, ...], sound_campaign: Path) -> Write:
    """Write a campaign, by default the sound one, and return its folder.

    The file of a sound run is a copy of the one that was written first.
    """

    def write_it(runs: Sequence[Run] | None = None, header: CampaignHeader = HEADER) -> Path:
        folder, given = tmp_path / "campaign", sound_runs if runs is None else runs
        sound = {run.plan.run for run in given if any(run is each for each in sound_runs)}

        def written(path: Path, groups: Any) -> None:
            if header is HEADER and int(path.stem) in sound:
                shutil.copyfile(sound_campaign / "runs" / path.name, path)
            else:
                write_mdf(path, groups)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("tirelib.campaign.write.write_mdf", written)
            write_campaign(folder, header, given)
        return folder

    return write_it
