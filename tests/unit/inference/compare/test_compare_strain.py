"""Laws of the comparison: own data fit, a planted difference is found where it is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.inference.compare.compare_synthetic import bump, model_file, plan, waveforms
from tirelib.core.errors import CalibrationError, FormatError
from tirelib.core.parameters import Number, TireFile
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.regions import find_regions
from tirelib.inference.compare.sectors import SECTORS, sectors_of
from tirelib.inference.compare.strain import Comparison, compare_strain
from tirelib.measured.waveforms import GRID, Waveforms

MODEL = model_of(model_file())
BIN = 0.05
"""Width of an angle bin near the contact, [rad]."""


def compared(waves: Waveforms) -> Comparison:
    return compare_strain(waves, MODEL)


def changed(**values: float) -> TireFile:
    file = model_file()
    numbers = {k: Number(v, float("nan"), "assumed", "changed") for k, v in values.items()}
    return replace(file, numbers={**file.numbers, **numbers})


@pytest.mark.parametrize("seed", range(5))
def test_a_model_fits_its_own_data_and_nothing_is_said(seed: int) -> None:
    found = compared(waveforms(seed=seed))
    assert found.verdict == "fits"
    # eight repeats tell the noise to 4 %, eight hundred samples of 28 runs the error to 3 %
    assert 0.88 < found.error.value < 1.12
    assert found.p > 0.01
    assert found.sentences == ()
    assert found.regions == ()
    assert found.messages == ()


@pytest.mark.parametrize("seed", range(3))
def test_set_points_inside_their_tolerance_are_no_lack_of_fit(seed: int) -> None:
    found = compared(waveforms(seed=seed))
    # what they add is three times the noise, and all of it is taken out
    assert found.error.rms > 2.0 * found.noise.std
    assert found.rms < 1.1 * found.noise.std
    spread = np.sqrt(np.mean(found.points.scaled**2, axis=0))
    assert (spread < 1.5).all()
    assert spread[0] > 0.5
    assert spread[2] > 0.5


def test_set_points_far_outside_their_tolerance_show_in_units_of_it() -> None:
    waves = waveforms()
    off = 0.02 * np.random.default_rng(1).standard_normal(len(waves))
    found = compared(replace(waves, strain=waves.strain * (1.0 + off)[:, None, None]))
    # of 6.7 tolerances a part goes to load and pressure, which look alike
    assert np.sqrt(np.mean(found.points.scaled[:, 2] ** 2)) > 3.0
    assert found.verdict == "lack_of_fit"
    assert "gain" in found.beyond
    assert any("times the tolerance" in text for text in found.sentences)


@pytest.mark.parametrize(
    ("start", "stop", "size", "least"),
    [
        (-0.1, 0.1, 3e-4, 3900.0),
        (-0.1, 0.1, -3e-4, 3900.0),
        (0.3, 0.5, 5e-5, 0.0),
        (-0.45, -0.25, -1e-4, 5100.0),
        (-0.05, 0.15, 6e-4, 2700.0),
    ],
)
def test_a_planted_difference_is_described_where_it_is(
    start: float, stop: float, size: float, least: float
) -> None:
    """Measured is higher by `size`, so the model is lower."""
    found = compared(waveforms(plant=bump(start, stop, size, least)))
    assert found.verdict == "lack_of_fit"
    first = found.regions[0]
    assert first.start == pytest.approx(start, abs=BIN / 2)
    assert first.stop == pytest.approx(stop, abs=BIN / 2)
    # the zero and the set points take a little of it
    assert first.mean == pytest.approx(-size, rel=0.1)
    assert first.runs == sum(load >= least for load, _, _ in plan())
    if least:
        assert (first.by, first.side) == ("load", "above")
        assert first.value == pytest.approx(least)
        assert f"at {least:,.0f} N and above" in found.sentences[0]
    else:
        assert first.by == "all"
        assert "in all runs" in found.sentences[0]
    assert f"from {start:.2f} to {stop:.2f} rad" in found.sentences[0]
    assert "microstrain too " in found.sentences[0]


def test_few_runs_with_noise_alone_give_no_region() -> None:
    """The level is for any false statement, over some ten thousand candidates."""
    few = [(1500.0, 2.1e5, 15.0), (4000.0, 2.1e5, 15.0), (6300.0, 2.1e5, 15.0)]
    for seed in range(10):
        found = compared(waveforms([*few, *few[:2]], seed=seed))
        assert not find_regions(
            found.difference,
            found.chosen.strain,
            found.chosen.straight,
            found.chosen.factors,
            found.noise,
            found.points,
        )


def test_words_tell_the_sign_and_the_kind_of_strain() -> None:
    inside = compared(waveforms(plant=bump(-0.1, 0.1, -3e-4)))
    assert "too much tension" in inside.sentences[0]
    assert inside.sentences[0].startswith("In the contact")
    inside = compared(waveforms(plant=bump(-0.1, 0.1, 3e-4)))
    assert "too little tension" in inside.sentences[0]
    behind = compared(waveforms(plant=bump(0.3, 0.5, -5e-5)))
    assert "too little compression" in behind.sentences[0]
    assert behind.sentences[0].startswith("Behind the contact")
    before = compared(waveforms(plant=bump(-0.5, -0.3, 5e-5)))
    assert "too much compression" in before.sentences[0]
    assert before.sentences[0].startswith("Before the contact")
    across = compared(waveforms(plant=bump(-0.4, 0.05, -3e-4)))
    assert across.sentences[0].startswith("From before the contact to inside it, from -0.40 to")


@settings(max_examples=6)
@given(middle=st.floats(-1.0, 1.0), size=st.sampled_from([-2e-4, 2e-4]), seed=st.integers(0, 99))
def test_the_first_sentence_has_the_planted_sign_and_overlaps_its_place(
    middle: float, size: float, seed: int
) -> None:
    found = compared(waveforms(plant=bump(middle - 0.1, middle + 0.1, size), seed=seed))
    first = found.regions[0]
    assert np.sign(first.mean) == -np.sign(size)
    assert first.start < middle < first.stop


def test_a_difference_by_speed_is_told_by_speed() -> None:
    fast = np.array([speed > 20.0 for _, _, speed in plan()], dtype=float)

    def plant(load: np.ndarray, phi: np.ndarray) -> np.ndarray:
        return 1e-4 * np.outer(fast, (phi > -0.3) & (phi < -0.1))

    first = compared(waveforms(plant=plant)).regions[0]
    assert (first.by, first.side) == ("speed", "above")
    assert first.value * 3.6 == pytest.approx(90.0)


def test_the_order_of_the_runs_does_not_matter() -> None:
    waves = waveforms(plant=bump(-0.1, 0.1, 3e-4, 3900.0))
    order = np.random.default_rng(1).permutation(len(waves))
    first, second = compared(waves), compared(waves.take(order))
    assert second.error.value == pytest.approx(first.error.value, rel=1e-9)
    assert second.sentences == first.sentences
    # the fixed number of steps of the set points is summed in another order
    assert [c.mean for c in second.table] == pytest.approx([c.mean for c in first.table], rel=1e-6)
    assert second.difference == pytest.approx(first.difference[order], abs=1e-11)
    assert [second.run[i] for i in second.ranked().values()] == [
        first.run[i] for i in first.ranked().values()
    ]


def test_the_difference_is_model_less_measured() -> None:
    found = compared(waveforms(plant=bump(-0.1, 0.1, 3e-4)))
    there = (GRID > -0.09) & (GRID < 0.09)
    assert found.difference[:, there].mean() == pytest.approx(-3e-4, rel=0.1)
    contact = [c for c in found.table if c.by == "all" and c.sector == "contact"]
    assert contact[0].mean < 0.0
    assert found.by_gage[:, :, there].mean() == pytest.approx(-3e-4, rel=0.1)


def test_a_gage_that_differs_shows_in_its_own_row() -> None:
    waves = waveforms()
    strain = waves.strain.copy()
    strain[:, 1] *= 1.1
    found = compared(replace(waves, strain=strain))
    rms = np.sqrt(np.mean(found.by_gage**2, axis=(0, 2)))
    assert int(np.argmax(rms)) == 1


def test_sectors_follow_the_contact_and_cover_the_turn() -> None:
    number = sectors_of(np.array([[-0.1, 0.1], [-0.25, 0.2]]))
    assert set(np.unique(number)) == set(range(len(SECTORS)))
    assert SECTORS[number[0, 180]] == "contact"
    assert SECTORS[number[0, 0]] == "far side"
    entry, leaving = np.searchsorted(GRID, [-0.25, 0.2])
    assert SECTORS[number[1, entry]] == "entry edge"
    assert SECTORS[number[1, leaving]] == "exit edge"
    assert SECTORS[number[0, entry]] == "entry flank"
    # 1.2 half contacts on the entry side, which would be 1.5 of the exit side's
    assert SECTORS[number[1, np.searchsorted(GRID, -0.3)]] == "entry edge"
    assert SECTORS[number[0, leaving]] == "exit flank"


def test_a_model_with_an_effect_fits_data_of_that_effect_only() -> None:
    extra = {"effects": [{"effect": "gage_drift", "strength": 0.08}]}
    model = model_of(replace(model_file(), extra=extra))
    waves = waveforms()
    drift = 1.0 + 0.08 * (np.linspace(0.0, 1.0, len(waves)) - 0.5)
    drifted = replace(waves, strain=waves.strain * drift[:, None, None])
    right, wrong = compare_strain(drifted, model), compare_strain(drifted, MODEL)
    # a drift is a gain, which a set point can be: it shows in units of the gain's tolerance; of 13
    # at the ends a half goes to the load, which looks alike: 6.8 to 8.9 are left over three draws
    assert np.abs(right.points.scaled[:, 2]).max() < 4.0
    assert np.abs(wrong.points.scaled[:, 2]).max() > 6.0
    assert right.verdict == "fits"
    assert wrong.verdict == "lack_of_fit"
    assert "gain" in wrong.beyond
    assert any("the size of the strain differs" in text for text in wrong.sentences)


def test_without_repeats_the_noise_is_unknown_and_nothing_is_said() -> None:
    found = compared(waveforms(plan()[:20], plant=bump(-0.1, 0.1, 3e-4)))
    assert found.verdict == "noise_unknown"
    assert found.error.unit == "ustrain"
    assert found.error.value == pytest.approx(1e6 * found.error.rms)
    assert np.isnan(found.noise.std)
    assert found.sentences == ()
    assert "has no repeated run" in found.messages[0]
    assert "microstrain" in found.messages[0]
    assert found.rms > 1e-5


def test_one_condition_is_said_and_the_rest_still_works() -> None:
    found = compared(waveforms([(4000.0, 2.1e5, 15.0)] * 4))
    assert any("one condition only" in message for message in found.messages)
    assert found.verdict == "fits"
    assert found.chosen.factors == ()
    single = compared(waveforms([(4000.0, 2.1e5, 15.0)]))
    assert single.verdict == "noise_unknown"
    assert sum("only" in m or "no repeated" in m for m in single.messages) == 2


def test_a_model_that_does_not_fit_at_all_gets_no_sentences() -> None:
    found = compare_strain(waveforms(), model_of(changed(innerliner_offset=-0.012)))
    assert found.verdict == "does_not_fit"
    assert found.sentences == ()
    assert "does not fit at all" in found.messages[0]


def test_a_model_without_a_solution_says_so() -> None:
    waves = waveforms([(4000.0, 2.1e5, 15.0)] * 2)
    heavy = {**waves.conditions, "Fz": np.array([4000.0, 4e5])}
    with pytest.raises(CalibrationError, match="no solution at the campaign's conditions"):
        compare_strain(replace(waves, conditions=heavy), MODEL)


def test_runs_without_load_are_refused_with_the_channel() -> None:
    waves = waveforms()
    lost = {**waves.conditions, "Fz": np.full(len(waves), np.nan)}
    with pytest.raises(CalibrationError, match="Fz is missing"):
        compare_strain(replace(waves, conditions=lost), MODEL)


def test_an_unknown_effect_or_ring_is_refused_with_every_fault() -> None:
    extra = {
        "effects": [{"effect": "magic", "strength": 1.0}, {"effect": "x"}],
        "model": {"ring": "cubic"},
    }
    with pytest.raises(FormatError) as caught:
        model_of(replace(model_file(), extra=extra))
    assert len(caught.value.problems) == 3
    assert "'magic' is not known" in caught.value.problems[0]


def test_slip_runs_do_not_count_and_have_their_own_level() -> None:
    waves = waveforms(plant=None)
    angle = np.zeros(len(waves))
    angle[-4:] = np.deg2rad(3.0)
    strain = waves.strain.copy()
    strain[-4:] += 5e-4 * ((GRID > -0.1) & (GRID < 0.1))
    slipped = replace(
        waves,
        strain=strain,
        conditions={**waves.conditions, "slip_angle": angle},
        group=np.where(angle > 0, waves.group + 100, waves.group),
    )
    found = compared(slipped)
    assert found.chosen.straight.sum() == len(waves) - 4
    assert found.verdict == "fits"
    rows = [c for c in found.table if c.by == "slip_angle" and c.sector == "contact"]
    assert [round(float(np.rad2deg(c.value))) for c in rows] == [0, 3]
    assert rows[1].mean < -1e-4
    assert abs(rows[0].mean) < 1e-5
