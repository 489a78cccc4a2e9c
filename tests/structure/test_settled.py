"""A campaign on which a fit goes along the edge of a sliding tread.

`tests/golden/sliding_edge.npz` is the mean over the gages of fifteen runs of the numerical rig with
hydroplaning at an error ratio of 1.5 (seed 338):

    python build/structure/make.py --family rig --seeds 338 --kinds hydroplaning --ratios 1.5
"""

from pathlib import Path

import numpy as np

from build.structure.cases import load_case
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import fitted, intervals_of

FILE = Path(__file__).parents[1] / "golden" / "sliding_edge.npz"


def test_identification_settles_where_slopes_hold_on_one_side_only() -> None:
    runs = straight_runs(load_case(FILE).waves)
    start, fit = fitted(runs)
    estimates = intervals_of(start, fit)
    # with one damping for all numbers it ended after 37 steps, 40 units of the cost higher
    assert fit.steps < 100
    assert fit.found.cost < 1200.0
    assert np.isfinite([e.value for e in estimates]).all()
    assert fit.error < 1.0  # below its noise and the misfit that it allows
