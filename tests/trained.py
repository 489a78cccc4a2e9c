"""The made-up tire that corners: its campaign, what is observed of it, and what is trained on that.

Each is made once for all processes of a test run.
"""

from functools import cache
from pathlib import Path

from tests.once import once, value_once
from tests.synthetic import cornering_runs, write
from tirelib.campaign import read_campaign
from tirelib.estimators.train import Trained, train
from tirelib.measured.observations import Observations, observe


@cache
def campaign_folder() -> Path:
    """Return the campaign."""
    return once("cornering", lambda place: write(place / "set1", cornering_runs())) / "set1"


@cache
def observed_and_trained() -> tuple[Observations, Trained]:
    """Return both, as the second refers to the first."""
    return value_once("cornering_trained", _train)


def _train() -> tuple[Observations, Trained]:
    observed = observe([read_campaign(campaign_folder())])
    return observed, train(observed)
