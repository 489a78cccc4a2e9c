"""Another tire is told by its name, by its dimensions and by its strain; this one is not."""

from collections.abc import Mapping
from dataclasses import fields, replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from tests.synthetic import LATERAL, header, synthetic_run
from tirelib.campaign import Campaign
from tirelib.cli.limits import weakly_checked
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.core.flags import TurnFlag
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.doubt import ANGLE_STEP, with_moved
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.likeness import DRIFT, ROAD_DRIFT, suspected
from tirelib.estimators.mixed import strangers
from tirelib.estimators.regressors import ODD, compute_regressors
from tirelib.estimators.result import estimate_document
from tirelib.estimators.train import Trained, take
from tirelib.measured.features import Features
from tirelib.measured.observations import Observations, measure_run, observe, same_tire

Regressors = Mapping[str, FloatArray]


def other(features: Features) -> Features:
    """Return what a tire with longer edges of the contact would show: each edge is less steep."""
    return replace(
        features, rate_lead=0.8 * features.rate_lead, rate_trail=0.8 * features.rate_trail
    )


def flagged(found: Estimates) -> np.ndarray:
    return (found.flags & int(TurnFlag.OTHER_TIRE)) != 0


def test_another_day_of_the_same_tire_is_not_taken_for_another_tire(
    trained: Trained, another_day: Campaign
) -> None:
    day = observe([another_day])
    found = trained.calibration.estimate(day.features)
    assert flagged(found).sum() <= 1
    assert not estimate_document(day, found, trained.calibration)["other_tire"]["suspected"]


def exchanged(features: Features, one: int, two: int) -> Features:
    """Return what two gages show whose wires are exchanged."""
    order = np.arange(features.lateral.size)
    order[[one, two]] = two, one
    rows = {field.name: getattr(features, field.name) for field in fields(features)}
    wired = {name: x[:, order] for name, x in rows.items() if x.ndim == 2}
    return replace(features, **wired)


@pytest.mark.parametrize(("one", "two"), [*combinations(range(5), 2)])
def test_exchanged_gages_give_no_valid_value_that_is_wrong(
    trained: Trained, another_day: Campaign, one: int, two: int
) -> None:
    features, known = observe([another_day]).features, trained.calibration
    right, found = known.estimate(features), known.estimate(exchanged(features, one, two))
    wrong = np.zeros(len(features), dtype=np.bool_)
    for quantity, goal in (("Fz", 100.0), ("alpha", np.deg2rad(0.2)), ("Fy", 150.0)):
        apart = np.abs(found.value[quantity] - right.value[quantity])
        wrong |= (apart > goal) & (apart > 3.0 * found.std[quantity])
    assert right.turn_valid.any()
    assert not (wrong & found.turn_valid & right.turn_valid).any()


def test_an_estimate_says_where_another_tire_may_go_undetected(
    trained: Trained, another_day: Campaign
) -> None:
    day = observe([another_day])
    softer = replace(day.features, pressure=0.9 * day.features.pressure)
    told = []
    for features in (day.features, softer):
        found, seen = trained.calibration.estimate(features), replace(day, features=features)
        told.append(estimate_document(seen, found, trained.calibration)["other_tire"])
    own, away = told
    assert own["extrapolated"] == 0
    assert weakly_checked(own) == ""
    assert away["extrapolated"] == away["judged"] > 20
    assert "may go undetected" in weakly_checked(away)
    assert weakly_checked(away | {"suspected": True}) == ""  # then it is said to be another tire
    assert weakly_checked(None) == ""  # and that nothing is checked stands in `not_checked`


def test_what_worn_treads_and_slippery_roads_show_of_the_own_tire_is_no_other_tire() -> None:
    """Largest share of three tires of the rig on drawn roads, and the least of another tire."""
    assert not suspected(12, 218)
    assert suspected(16, 168)


def test_another_shape_of_the_contact_is_another_tire(
    trained: Trained, another_day: Campaign
) -> None:
    day = observe([another_day])
    strange = other(day.features)
    found = trained.calibration.estimate(strange)
    told = flagged(found)
    assert told.sum() > 0.5 * len(day)
    assert not found.turn_valid[told].any()
    assert not any(found.valid[quantity][told].any() for quantity in found.valid)
    assert np.isfinite(found.value["Fz"][told]).all()
    document = estimate_document(replace(day, features=strange), found, trained.calibration)[
        "other_tire"
    ]
    assert document["suspected"]
    assert document["turns"] == told.sum()


@pytest.mark.parametrize("outside", [{"load": 9500.0}, {"slip_ratio": -0.3}, {"pressure": 3.2e5}])
def test_out_of_range_is_not_called_another_tire(
    trained: Trained, outside: dict[str, float]
) -> None:
    features = measure_run(synthetic_run(0, **outside), header())[0]
    assert not flagged(trained.calibration.estimate(features)).any()


def test_a_file_keeps_what_the_tire_looks_like(trained: Trained, tmp_path: Path) -> None:
    write_calibration(trained.calibration, tmp_path / "cal.toml")
    again = read_calibration(tmp_path / "cal.toml")
    strange = other(measure_run(synthetic_run(0), header())[0])
    assert (
        flagged(again.estimate(strange)).tolist()
        == flagged(trained.calibration.estimate(strange)).tolist()
    )
    assert again.geometry == trained.calibration.geometry
    assert again.geometry["free_radius"] == header().tire.free_radius


def test_a_tire_of_other_dimensions_is_refused(trained: Trained) -> None:
    calibration = trained.calibration
    radius = calibration.geometry["free_radius"]
    calibration.check_layout("made-up tire", LATERAL, "here", {"free_radius": 1.005 * radius})
    with pytest.raises(CalibrationError, match="here: free_radius of the tire is"):
        calibration.check_layout("made-up tire", LATERAL, "here", {"free_radius": 1.05 * radius})
    first = header()
    wider = replace(first, tire=replace(first.tire, free_radius=1.05 * first.tire.free_radius))
    with pytest.raises(CalibrationError, match="calibrate them separately, or mend"):
        same_tire([first, wider])


def test_a_worn_tread_and_a_width_read_off_a_cut_are_the_same_tire(trained: Trained) -> None:
    size = trained.calibration.geometry
    told = {
        "tread_thickness": 0.5 * size["tread_thickness"],
        "belt_width": 1.02 * size["belt_width"],
        "free_radius": size["free_radius"] - 0.006,  # the tread that is gone
    }
    trained.calibration.check_layout("made-up tire", LATERAL, "here", told)


def test_an_uncertain_wheel_angle_is_no_other_tire(trained: Trained) -> None:
    features = measure_run(synthetic_run(0), header())[0]
    longer = with_moved(features)
    n = len(features)
    scale = 0.03 / ANGLE_STEP  # the angles of every turn 3 % too long

    def stretched(name: str) -> np.ndarray:
        values = getattr(longer, name)
        return np.asarray(values[:n] + scale * (values[n : 2 * n] - values[:n]))

    names = (
        "lead",
        "trail",
        "cp1_angle",
        "cp2_angle",
        "tp_angle",
        "rate_lead",
        "rate_trail",
        "e_vertical",
        "skew",
    )
    strange = replace(features, **{name: stretched(name) for name in names})
    known = trained.calibration.estimate(strange)
    doubtful = trained.calibration.estimate(replace(strange, angle_std=np.full(n, 0.03)))
    assert flagged(known).sum() > 0
    assert not flagged(doubtful).any()


def test_too_few_conditions_say_nothing_of_the_tire(observed: Observations) -> None:
    from tirelib.estimators.calibrate import calibrate_chain

    few = take(observed, observed.group < 10)
    assert calibrate_chain(few, range(5))[0].likeness is None


def test_a_calibration_of_two_tires_says_so(cornering: Campaign, another_day: Campaign) -> None:
    both = observe([cornering, another_day])
    assert strangers(both) == ()
    second = both.campaign == 1
    strange = other(both.features)
    features = replace(
        both.features,
        rate_lead=np.where(second[:, None], strange.rate_lead, both.features.rate_lead),
        rate_trail=np.where(second[:, None], strange.rate_trail, both.features.rate_trail),
    )
    (found,) = strangers(replace(both, features=features))
    assert found.unlike > 0.5 * found.judged


def test_two_odd_runs_are_not_two_tires_and_many_turns_of_one_run_are_no_more_than_one(
    cornering: Campaign, another_day: Campaign
) -> None:
    both = observe([cornering, another_day])
    first_runs = np.unique(both.run[both.campaign == 1])[:20]
    both = take(both, (both.campaign == 0) | np.isin(both.run, first_runs))
    few = (both.campaign == 1) & np.isin(both.run, first_runs[8:10])
    strange = other(both.features)
    features = replace(
        both.features,
        rate_lead=np.where(few[:, None], strange.rate_lead, both.features.rate_lead),
        rate_trail=np.where(few[:, None], strange.rate_trail, both.features.rate_trail),
    )
    assert few.sum() >= 5
    assert strangers(replace(both, features=features)) == ()


def test_a_road_of_other_friction_is_no_other_tire(
    cornering: Campaign, another_day: Campaign
) -> None:
    """A tread that slides more shifts the strain as `ROAD_DRIFT` says; the campaigns know why."""
    both = observe([cornering, another_day])
    second, slip = both.campaign == 1, both.truth["slip_angle"]
    side = second * np.sign(slip) * (np.abs(slip) > np.deg2rad(1.0))
    shift = 0.7 * ROAD_DRIFT["angle_slope"][1] * both.features.lateral / 0.06
    features = replace(both.features, trail=both.features.trail + side[:, None] * shift)
    unknown = replace(both, features=features)
    friction = np.where(second, 0.3, 1.0)
    known = replace(both, features=replace(features, friction=friction))
    assert strangers(unknown) != ()
    assert strangers(known) == ()


@pytest.mark.parametrize("share", [0.65, 1.2])
def test_another_tire_is_noticed_at_another_pressure_and_this_one_is_not_taken_for_it(
    trained: Trained, another_day: Campaign, share: float
) -> None:
    chain, day = trained.calibration.chains[-1], observe([another_day])
    likeness = chain.likeness
    assert likeness is not None

    def unlike(features: Features, tires: float) -> float:
        """Return the share of turns flagged where the tire shifts by so much of `DRIFT`."""
        values = compute_regressors(features, range(5))
        side = np.sign(values["cp1_slope"])
        values["pressure"] = share * values["pressure"]
        for name, (shift, _) in DRIFT.items():
            values[name] = values[name] + tires * (share - 1.0) * shift * (
                side if name in ODD else 1.0
            )
        values["speed_squared"] = values["speed"] ** 2
        apart = likeness.apart(values, chain.laws, force_laws=chain.force_laws)[day.usable]
        apart = apart[np.isfinite(apart)]
        assert apart.size > 20
        return float(np.mean(apart > likeness.limit))

    for tires in (0.5, 1.0, 1.5):
        assert unlike(day.features, tires) < 0.02
    assert unlike(other(day.features), 1.0) > 0.5


def test_a_pressure_that_was_varied_straight_only_is_not_fitted_in_a_turn(
    cornering: Campaign, pressures: Campaign
) -> None:
    from tirelib.estimators.calibrate import calibrate_chain

    chain, _ = calibrate_chain(observe([cornering, pressures]), range(5))
    assert chain.likeness is not None
    names = [variable.name for variable in chain.likeness.variables]
    pressure, side = names.index("pressure"), names.index("cp1_slope")
    with_pressure = [term for term in chain.likeness.terms if term[pressure]]
    assert len(with_pressure) == 2
    assert all(term[side] == 0 for term in with_pressure)


def test_a_worn_tread_and_a_sliding_one_are_not_another_tire(
    trained: Trained, another_day: Campaign
) -> None:
    chain, day = trained.calibration.chains[-1], observe([another_day])
    likeness = chain.likeness
    assert likeness is not None
    seen = compute_regressors(day.features, range(5))
    values = {name: x[day.usable] for name, x in seen.items()}
    values["speed_squared"] = values["speed"] ** 2
    n = int(day.usable.sum())
    none, harder = np.zeros(n), 3.0 * np.ones(n)
    odd = np.array([name in ODD for name in likeness.names])
    for column, flip in ((0, 1.0), (1, 1.0), (1, -1.0)):
        moved = dict(values)
        for name, is_odd in zip(likeness.names, odd, strict=True):
            side = flip if is_odd else 1.0
            moved[name] = values[name] + side * 3.0 * ROAD_DRIFT[name][column]

        def unlike(
            tread: tuple[FloatArray, FloatArray], sliding: FloatArray, at: Regressors = moved
        ) -> float:
            apart = likeness.apart(at, chain.laws, tread, sliding)
            return float(np.mean(apart[np.isfinite(apart)] > likeness.limit))

        def distance(sliding: FloatArray, at: Regressors = moved) -> float:
            return float(np.nanmean(likeness.apart(at, chain.laws, (none, none), sliding)))

        assert unlike((none, none), none) > 0.9  # where the road is known
        if column == 0:
            assert unlike((none, harder), none) < 0.1
            assert unlike((harder, none), none) < 0.1
        else:
            assert unlike((none, none), flip * harder) < 0.1
            # slid to the other side it lies further off
            assert distance(-flip * harder) > 1.05 * distance(flip * harder)
