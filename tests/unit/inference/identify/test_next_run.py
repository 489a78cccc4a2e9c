"""What would tell a number: predicted intervals are those of a fit that has the run or the test."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import TIRE, exact_waveform, made_waves, operating
from tirelib.effects.state import Operating
from tirelib.inference.identify import next_run as module
from tirelib.inference.identify.campaign_data import Data, straight_runs
from tirelib.inference.identify.laboratory import SIDEWALL, TREAD, laboratory_tests
from tirelib.inference.identify.next_run import NextRun, next_run
from tirelib.inference.identify.waveform_fit import WaveformFit, fit_waveforms
from tirelib.model.base import BARE, values_of

NAMES = [c.name for c in BARE]
K_V, K_U_SLOPE, K_T, EI = (
    NAMES.index(name)
    for name in (
        "tangential_stiffness",
        "radial_pressure_slope",
        "tread_stiffness",
        "bending_stiffness",
    )
)
STRUCTURE = np.array([0.1, 0.03, 0.04, 0.2, 0.25, 0.2, 0.01, 0.06])
PRIOR = np.array([0.5, 0.5, 1.0, 0.5, 1.0, 0.5, 0.1, 0.5])


@pytest.fixture(scope="module")
def data() -> Data:
    """Three loads at one pressure: slopes by pressure are not told."""
    waves = made_waves(pressures=(2.1e5,), loads=(2400.0, 4800.0, 7200.0), repeats=1, radius=False)
    return straight_runs(waves).data()


def fit_of(data: Data) -> WaveformFit:
    return fit_waveforms(data, values_of(TIRE), PRIOR, free=BARE)


@pytest.fixture(scope="module")
def fit(data: Data) -> WaveformFit:
    return fit_of(data)


@pytest.fixture(scope="module")
def ways(fit: WaveformFit) -> NextRun:
    return next_run(fit, STRUCTURE)


def added(data: Data, load: float, pressure: float, speed: float) -> Data:
    """Return the data with one more run as the model makes it."""
    more = operating(np.array([load]), np.array([pressure]), speed)
    wave = exact_waveform(TIRE, more)[0]
    points = Operating(
        *[
            np.append(getattr(data.points, name), getattr(more, name))
            for name in Operating.__slots__
        ]
    )
    return replace(
        data,
        strain=np.concatenate([data.strain, wave]),
        points=points,
        angle_std=np.append(data.angle_std, data.angle_std[0]),
        deflection=np.append(data.deflection, np.nan),
    )


def test_now_is_fit_and_structure(fit: WaveformFit, ways: NextRun) -> None:
    expected = 1.96 * np.sqrt(np.diag(fit.covariance) + STRUCTURE**2)
    assert ways.half_width == pytest.approx(expected)


def test_a_run_does_what_was_predicted(data: Data, fit: WaveformFit, ways: NextRun) -> None:
    """The fit of the campaign with the advised run has the interval that was told before."""
    advice = ways.best_run(K_U_SLOPE)
    assert advice is not None
    single = (each for each in ways.runs if each.effort == 1)
    run = min(single, key=lambda each: each.half_width[K_U_SLOPE])
    load, pressure, speed = (
        float(word) for word in np.array(run.words.replace(",", "").split())[[4, 6, 8]]
    )
    assert min(abs(pressure * 1e5 - 2.1e5), 1e9) > 3e4, "another pressure tells the slope"
    again = fit_of(added(data, load, 1e5 * (1.68 if pressure < 2.0 else 2.52), speed / 3.6))
    found = 1.96 * np.hypot(np.sqrt(again.covariance[K_U_SLOPE, K_U_SLOPE]), STRUCTURE[K_U_SLOPE])
    assert run.half_width[K_U_SLOPE] == pytest.approx(found, rel=0.1)
    assert run.half_width[K_U_SLOPE] < 0.4 * ways.half_width[K_U_SLOPE]


def test_structure_is_no_runs_business(ways: NextRun) -> None:
    for k in (K_V, K_T):
        assert ways.best_run(k) is None
        assert all(run.half_width[k] >= 1.96 * STRUCTURE[k] for run in ways.runs)


def test_a_test_by_definition_leaves_its_accuracy(fit: WaveformFit, ways: NextRun) -> None:
    best = ways.best(K_V)
    assert best is not None
    assert best.words.startswith("a torsional sidewall test")
    total = fit.covariance[K_V, K_V] + STRUCTURE[K_V] ** 2
    # two independent views of one number: precisions add
    assert best.half_width[K_V] == pytest.approx(1.96 / np.sqrt(1.0 / total + 1.0 / SIDEWALL**2))
    tread = ways.best(K_T)
    assert tread is not None
    assert tread.words.startswith("a press test of the tread alone")
    assert tread.half_width[K_T] == pytest.approx(1.96 * TREAD, rel=0.05)


def test_a_press_test_tells_the_fit_and_not_its_structure(ways: NextRun) -> None:
    press = next(test for test in ways.tests if test.words.startswith("a press test (vertical"))
    assert (press.half_width >= 1.96 * STRUCTURE).all()
    assert (press.half_width <= ways.half_width * (1.0 + 1e-9)).all()


def test_nothing_is_advised_where_nothing_helps(ways: NextRun) -> None:
    one = replace(ways, runs=(), tests=())
    assert one.best(0) is None
    assert one.best_run(0) is None


def test_a_run_beyond_the_tire_is_left_out(
    fit: WaveformFit, ways: NextRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "ABOVE", 8.0)
    fewer = next_run(fit, STRUCTURE)
    assert 0 < len(fewer.runs) < len(ways.runs)


def test_laboratory_tests_measure_what_they_say() -> None:
    tests = {
        (t.words.split(" (")[0], len(t.rows)): t
        for t in laboratory_tests(values_of(TIRE), BARE, (1e5, 3e5))
    }
    turn = tests["a torsional sidewall test", 1].rows[0]
    assert turn[K_V] == pytest.approx(1.0)
    assert np.delete(turn, K_V) == pytest.approx(0.0, abs=1e-9)
    shift = tests["sidewall tests", 2].rows[0]
    k_u, k_v = TIRE.radial_stiffness, TIRE.tangential_stiffness
    assert shift[[1, K_V]] == pytest.approx([k_u / (k_u + k_v), k_v / (k_u + k_v)])
    both = tests["torsional sidewall tests", 2].rows
    slope = NAMES.index("tangential_pressure_slope")
    for row, pressure in zip(both, (1e5, 3e5), strict=True):
        above = pressure - TIRE.pressure
        at = TIRE.tangential_stiffness + TIRE.tangential_pressure_slope * above
        assert row[slope] == pytest.approx(above / at)
        assert row[K_V] == pytest.approx(TIRE.tangential_stiffness / at)
    modes = tests["a modal test", 8].rows
    assert (np.diff(modes[:, EI]) > 0.0).all(), "high orders tell EI"
    assert tests["a cut section", 1].rows[0, NAMES.index("innerliner_offset")] == pytest.approx(1.0)


def test_no_test_is_proposed_where_the_fitted_sidewall_has_no_stiffness() -> None:
    values = values_of(TIRE)
    steep = dict(values)
    steep["tangential_pressure_slope"] = 1.01 * TIRE.tangential_stiffness / (TIRE.pressure - 1e5)

    def words(given: dict[str, float | np.ndarray]) -> list[str]:
        return [t.words for t in laboratory_tests(given, BARE, (1e5, 3e5))]

    assert sum(" bar" in text for text in words(values)) == 2
    left = words(steep)
    assert not any(" bar" in text for text in left)
    assert len(left) == len(words(values)) - 2
