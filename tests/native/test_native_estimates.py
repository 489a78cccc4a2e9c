"""The native core estimates what the library does: values, standard deviations, flags and notes."""

import ctypes
from dataclasses import fields, replace

import numpy as np
import pytest

from tests.fmu import live
from tests.native.core import SOURCE, NativeCutter
from tests.native.estimates import NativeCalibration, assert_same_estimates
from tests.synthetic import LATERAL, synthetic_run, write
from tirelib.campaign import read_campaign
from tirelib.core.errors import FormatError
from tirelib.core.flags import TurnFlag
from tirelib.estimators import core_table
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.chain import Chain
from tirelib.estimators.core_table import flat_table
from tirelib.estimators.polynomial import Polynomial, Variable
from tirelib.estimators.train import train
from tirelib.estimators.unknowns import Road
from tirelib.measured.features import Features
from tirelib.measured.features.extract import reference_features
from tirelib.measured.observations import observe
from tirelib.measured.signal import TurnCutter, stack_turns

SLIPS = (-0.3, -0.1, -0.05, -0.02, 0.0, 0.02, 0.05, 0.1, 0.3)
MOMENT = Polynomial(
    variables=(Variable("cp1_slope", 0.0, 0.1), Variable("tp_slope", 0.0, 0.2)),
    terms=((1, 0), (0, 1), (3, 0)),
    coefficients=np.array([0.1, -0.03, 0.01]),
    covariance=1e-5 * np.eye(3),
    residual=0.01,
    floor=0.003,
)
"""An aligning moment; the made-up tire has none."""


@pytest.fixture(scope="session")
def observed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Calibration, Features]:
    """A calibration with every link of the chain, and features of its runs."""
    corners = [
        (load, angle, speed)
        for load in (2500.0, 4500.0, 6500.0)
        for angle in np.deg2rad([-4.0, -2.0, 0.0, 2.0, 4.0]).tolist()
        for speed in (12.0, 22.0)
    ]
    runs = [
        synthetic_run(number, load=load, slip_angle=angle, speed=speed)
        for number, (load, angle, speed) in enumerate(corners)
    ]
    runs += [
        synthetic_run(100 + number, load=4500.0, slip_ratio=slip, kind="brake" if slip else "free")
        for number, slip in enumerate(SLIPS)
    ]
    campaign = read_campaign(write(tmp_path_factory.mktemp("native") / "rich", runs))
    found = observe([campaign])
    known = train(found).calibration
    chains = {}
    for missing, chain in known.chains.items():
        assert chain.sliding is not None
        curve = replace(chain.sliding, misfit=0.01)
        road = replace(chain.road, friction=(0.6, 0.9))
        chains[missing] = replace(chain, moment=MOMENT, road=road, sliding=curve)
    return replace(known, chains=chains), found.features


def rows_of(features: Features, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Copies of turns, to be changed."""
    return {
        field.name: getattr(features, field.name)[rows].copy()
        for field in fields(Features)
        if field.name != "lateral"
    }


def disturbed(features: Features, n: int, seed: int) -> Features:
    """Turns of which conditions, gages, roads and doubts are changed, unknown or out of range."""
    rng = np.random.default_rng(seed)
    x = rows_of(features, rng.integers(0, len(features), n))

    def some(name: str, values: np.ndarray, share: float) -> None:
        chosen = rng.random(n) < share
        x[name][chosen] = values[chosen]

    def one_of(*values: float) -> np.ndarray:
        return rng.choice(np.array(values), n)

    unknown = np.full(n, np.nan)
    some("pressure", x["pressure"] * rng.uniform(0.4, 1.6, n), 0.4)
    some("pressure", one_of(np.nan, np.inf, 0.0, -1e5), 0.2)
    some("speed", x["speed"] * rng.uniform(0.1, 3.5, n), 0.4)
    some("speed", one_of(np.nan, -12.0, 0.01), 0.1)
    some("omega", -x["omega"], 0.02)
    some("camber", rng.normal(0.0, 0.04, n), 0.3)
    some("camber", unknown, 0.4)
    some("friction", rng.uniform(0.2, 1.2, n), 0.5)
    some("friction", one_of(np.nan, 0.0, 3.0, 0.9), 0.5)
    some("tread_depth", rng.uniform(0.0, 0.013, n), 0.5)
    some("tread_depth", unknown, 0.3)
    some("tread_temperature", rng.uniform(220.0, 410.0, n), 0.5)
    some("tread_temperature", unknown, 0.3)
    some("angle_std", rng.uniform(0.0, 0.05, n), 0.5)
    some("slip_std", rng.uniform(0.0, 0.05, n), 0.5)
    some("flags", one_of(0, 64, 512, 4096, 524288).astype(np.int64), 0.2)
    few = rng.random((n, 5)) < 0.06
    x["gage_flags"][few] |= int(TurnFlag.SATURATED)
    x["offset_std"] = np.abs(rng.normal(0.0, 2e-5, x["offset_std"].shape))
    for name in ("lead", "trail", "cp1", "cp2", "tp", "skew", "e_vertical"):
        x[name] *= rng.normal(1.0, 0.03 * rng.integers(0, 3, n)[:, None], x[name].shape)
    lost = rng.random(n) < 0.03
    x["tp"][lost] = np.nan
    return Features(lateral=features.lateral, **x)


def assert_same(core: ctypes.CDLL, known: Calibration, features: Features) -> set[str]:
    """Estimate all turns with both; return what was flagged and noted."""
    native, wanted = NativeCalibration(core, known), known.reference_estimate(features)
    for row in range(len(features)):
        assert_same_estimates(native.row(features, row), wanted, row)
    notes = {note for turn in wanted.notes for note in turn}
    return notes | {flag.name for flag in TurnFlag if (wanted.flags & int(flag)).any()}


def test_turns_of_the_calibration(
    core: ctypes.CDLL, observed: tuple[Calibration, Features]
) -> None:
    known, features = observed
    links = [getattr(known.chains[-1], name) for name in ("cloud", "drag", "sliding", "likeness")]
    assert all(link is not None for link in links)
    assert_same(core, known, features)


SEEN = {
    *("OUT_OF_RANGE", "OTHER_TIRE", "TOO_FEW_GAGES", "NO_CONDITION", "alpha_saturated"),
    *("condition_extrapolated", "camber_unknown", "friction_implausible"),
    *("tread_depth_implausible", "tread_temperature_implausible"),
    *("pressure_out_of_range", "speed_out_of_range", "camber_out_of_range"),
    *(f"{quantity}_out_of_range" for quantity in ("Fz", "alpha", "kappa", "Fy")),
}


def test_turns_of_which_anything_may_be_wrong(
    core: ctypes.CDLL, observed: tuple[Calibration, Features]
) -> None:
    known, features = observed
    seen = set()
    for seed in range(3):
        seen |= assert_same(core, known, disturbed(features, 700, seed))
    assert seen >= SEEN


def without(known: Calibration, **changed: object) -> Calibration:
    """Change every chain."""
    chains = {missing: replace(chain, **changed) for missing, chain in known.chains.items()}
    return replace(known, chains=chains)


def varied(known: Calibration, name: str) -> Calibration:
    """The calibration without a link, or with other laws."""
    full: Chain = known.chains[-1]
    fitted = replace(full.laws, pressure_fitted=True, pressure=(1.8e5, 2.6e5))
    nowhere = replace(full.laws, pressure=(np.nan, np.nan), speed=(np.nan, np.nan))
    load = Variable("load", 4000.0, 2000.0)
    radius = Polynomial(
        (load,), ((0,), (1,), (2,)), np.array([0.3, -2e-3, 1e-4]), 1e-9 * np.eye(3), 1e-4, 1e-4
    )
    force = full.force
    assert force is not None
    changes: dict[str, dict[str, object]] = {
        "no load": {"load": None},
        "no radius": {"radius": None},
        "no force": {"force": None, "angle": None, "sliding": None},
        "no slip angle": {"angle": None},
        "no curve": {"sliding": None},
        "no moment or drag": {"moment": None, "drag": None},
        "no likeness": {"likeness": None},
        "no cloud": {"cloud": None},
        "near only": {"cloud": replace(full.cloud, around=0.0, mirrored=False)},
        "pressure varied": {"laws": fitted, "force_laws": fitted},
        "conditions unknown": {"laws": nowhere, "force_laws": nowhere},
        "radius over load": {"radius": radius},
        "force over camber": {
            "force": replace(
                force,
                variables=(*force.variables, Variable("camber", 0.0, 0.02)),
                terms=tuple((*term, 0) for term in force.terms),
            )
        },
        "road known": {"road": Road((0.4, 1.0), (0.003, 0.007), (290.0, 330.0))},
        "road unknown": {"road": Road()},
        "slip not varied": {"guards": {**full.guards, "kappa": ()}},
    }
    return without(known, **changes[name])


@pytest.mark.parametrize(
    "name",
    [
        *("no load", "no radius", "no force", "no slip angle", "no curve", "no moment or drag"),
        *("no likeness", "no cloud", "near only", "pressure varied", "conditions unknown"),
        *("radius over load", "force over camber", "road known", "road unknown"),
        "slip not varied",
    ],
)
def test_calibrations_that_lack_a_link_or_know_more(
    core: ctypes.CDLL, observed: tuple[Calibration, Features], name: str
) -> None:
    known, features = observed
    assert_same(core, varied(known, name), disturbed(features, 250, 5))


def test_a_slippery_road_moves_the_slip_angle_outwards_on_both_sides(
    core: ctypes.CDLL, observed: tuple[Calibration, Features]
) -> None:
    known, features = observed
    x = rows_of(features, np.arange(len(features)))
    x["friction"][:] = 0.7
    icy = Features(lateral=features.lateral, **x)
    plain = without(known, sliding=None).reference_estimate(icy).value["alpha"]
    moved = known.reference_estimate(icy).value["alpha"] - plain
    for side in (-1.0, 1.0):
        assert (moved[side * plain > 0.02] * side > 1e-3).sum() > 5
    assert_same(core, known, icy)


def test_from_samples_to_estimates(core: ctypes.CDLL) -> None:
    known, native = live.calibration(), NativeCalibration(core, live.calibration())
    strain, trigger = live.strain_of(4e3, 0.1, turns=6.4)
    strain[0, 2000:] = strain[0, 2000]
    held = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
    cut = TurnCutter(LATERAL, live.RATE).push(strain, trigger=trigger, **held)
    turns = stack_turns(cut, np.array(LATERAL), live.RATE)
    wanted = known.reference_estimate(reference_features(turns))
    cutter = NativeCutter(core, LATERAL, live.RATE)
    got = list(cutter.push(strain, trigger=trigger, **held))
    assert len(got) == len(turns) == 6
    for row, (turn, features) in enumerate(got):
        assert_same_estimates(native.estimate(turn, features), wanted, row)
    assert wanted.turn_valid[1:].all()
    assert wanted.flags[-1] & int(TurnFlag.REDUCED_GAGES)


def test_a_damaged_table_is_refused_and_the_place_told(core: ctypes.CDLL) -> None:
    table = flat_table(live.calibration())
    memory = ctypes.create_string_buffer(core.calibration_size())

    def read(numbers: np.ndarray) -> int:
        return int(core.calibration_read(memory, numbers.ctypes.data, numbers.size))

    assert read(table) == 0
    for n in [*range(200), *range(200, table.size, 37)]:
        assert read(table[:n].copy()) == 1  # it says how long it is
        short = table[:n].copy()
        if n > 2:
            short[2] = n
            assert 1 < read(short) <= n + 1
    rng = np.random.default_rng(0)
    for _ in range(300):
        wild = table.copy()
        wild[rng.integers(0, table.size, 3)] = rng.choice([np.nan, np.inf, -1.0, 1e9, 0.5], 3)
        assert 0 <= read(wild) <= table.size + 1


def test_a_regressor_that_the_core_does_not_know_is_refused() -> None:
    odd = replace(MOMENT, variables=(Variable("cp3", 0.0, 1.0), MOMENT.variables[1]))
    with pytest.raises(FormatError, match="knows no regressor 'cp3'"):
        flat_table(without(live.calibration(), moment=odd))


def test_the_table_knows_the_sizes_that_the_core_was_compiled_with() -> None:
    header = (SOURCE / "calibration.h").read_text()
    for name in ("VARIABLES", "TERMS", "NAMES", "NODES", "WHOLE"):
        assert f" {name} = {getattr(core_table, name)}" in header, name


@pytest.mark.parametrize("terms", [core_table.TERMS, core_table.TERMS + 1])
def test_a_polynomial_fills_its_room_and_a_larger_one_is_refused(
    core: ctypes.CDLL, terms: int
) -> None:
    """Each term is an exponent in one of as many regressors as there is room for."""
    room = core_table.VARIABLES
    names = [core_table.VALUES[n % len(core_table.VALUES)] for n in range(room)]
    large = replace(
        MOMENT,
        variables=tuple(Variable(name, 0.0, 1.0) for name in names),
        terms=tuple(tuple(t // room * (v == t % room) for v in range(room)) for t in range(terms)),
        coefficients=np.zeros(terms),
        covariance=np.zeros((terms, terms)),
    )
    known = without(live.calibration(), moment=large)
    if terms > core_table.TERMS:
        with pytest.raises(FormatError, match="32 and 256 are allowed; calibrate with fewer"):
            flat_table(known)
    else:
        assert NativeCalibration(core, known)
