"""A fit that starts at a solution nearby gives what a fit from nothing gives."""

from typing import Any

import numpy as np
import pytest

from tests.unit.diagnose.planted import runs
from tests.unit.identify.model_waves import TIRE
from tirelib.compare.error import Yardstick
from tirelib.diagnose import fitter, held_out, refit
from tirelib.model.base import Correction, large_displacements, values_of
from tirelib.rolling.solve import Start


def test_a_start_nearby_is_used_and_changes_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    data = runs().data(with_deflection=False)
    starts: list[Start | None] = []

    def watched(*given: Any, start: Start | None = None, **named: Any) -> Correction:
        starts.append(start)
        return large_displacements(*given, start=start, **named)

    def cold(*given: Any, start: Start | None = None, **named: Any) -> Correction:
        return large_displacements(*given, **named)

    found = {}
    for name, solve in (("near", watched), ("cold", cold)):
        monkeypatch.setattr(fitter, "large_displacements", solve)
        monkeypatch.setattr("tirelib.compare.model.large_displacements", solve)
        model = refit.refit(data, values_of(TIRE))
        folds = held_out.folds(data)
        found[name] = (model, held_out.held_out_errors(data, model, folds, Yardstick.of(runs())))
    # only the very first solution has nothing nearby
    assert [start is None for start in starts] == [True] + [False] * (len(starts) - 1)
    near, cold_one = found["near"], found["cold"]
    # Newton's tolerance on displacements is far below a nanostrain
    np.testing.assert_allclose(near[0].waveform, cold_one[0].waveform, atol=1e-10)
    np.testing.assert_allclose(near[1], cold_one[1], rtol=1e-6)


def test_a_start_without_stiffness_at_some_pressure_ends_where_another_does() -> None:
    data = runs().data(with_deflection=False)
    values = values_of(TIRE)
    below = float(np.max(values["pressure"])) - float(data.points.pressure.min())
    assert below > 0.0
    edge = float(np.max(values["tangential_stiffness"])) / below
    model = refit.refit(data, {**values, "tangential_pressure_slope": np.float64(1.02 * edge)})
    plain = refit.refit(data, values)
    apart = model.whiten(model.waveform - plain.waveform)
    assert np.sqrt(np.mean(apart**2)) < 0.05, "a twentieth of the noise"


@pytest.mark.parametrize("factor", [0.75, 1.3])
def test_a_start_far_away_ends_where_one_nearby_does(factor: float) -> None:
    data = runs().data(with_deflection=False)
    near = values_of(TIRE)
    moved = ("radial_stiffness", "radial_pressure_slope", "extension_stiffness", "tread_stiffness")
    far = {**near, **{name: factor * np.asarray(near[name]) for name in moved}}
    there, here = refit.refit(data, far), refit.refit(data, near)
    # large displacements are brought up to date until they are those of the result
    assert there.error == pytest.approx(here.error, rel=0.05)
    apart = here.whiten(there.waveform - here.waveform)
    assert np.sqrt(np.mean(apart**2)) < 0.3 * here.error
