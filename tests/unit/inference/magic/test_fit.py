"""The Magic Formula fitted to forces, its file, and the verb that writes it.

What reads the file here shares nothing with the library: a few lines, and the formula typed anew.
"""

import json
import re
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tests.unit.inference.force_campaigns import steady_runs, write_forces
from tests.unit.physics.brush.test_mf import PLAIN
from tirelib.cli import program
from tirelib.core.errors import CalibrationError, TirelibError
from tirelib.core.parameters import Number, TireFile, write_tire
from tirelib.core.parameters.tir import read_tir
from tirelib.inference.compare.force_model import force_model_of
from tirelib.inference.compare.magic_points import model_points
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.magic.file import magic_tire
from tirelib.inference.magic.fit import STAGES, MagicFit, _Fit, fit_magic
from tirelib.physics.brush.mf import magic_forces
from tirelib.physics.brush.mf_tire import Coefficients, MagicTire

TRUTH = {
    name: value
    for name, value in PLAIN.items()
    if not re.fullmatch("PEX[34]|PEY3|PKX3|QBZ[39]|QBZ10|QEZ[34]|RVY.|RBX2|RHY2|SSZ.", name)
} | {"PPY1": 0.4, "PPX1": -0.3, "PDY3": 1.5, "PKY6": -0.9, "RBX2": 8.0, "PKY4": 2.0}
LOADS, PRESSURES = (1500.0, 3000.0, 4500.0, 6000.0), (1.9e5, 2.2e5, 2.5e5)
SLIPS = np.array([0.01, 0.03, 0.06, 0.1, 0.15, 0.2])
BOTH = np.concatenate([-SLIPS[::-1], [0.0], SLIPS])


def made(slips: np.ndarray = BOTH, loads: tuple[float, ...] = LOADS) -> ForceData:
    """Points of a tire of the formula itself."""
    pairs = [(a, 0.0) for a in slips] + [(0.0, k) for k in slips]
    pairs += list(product(slips[::3], slips[::3]))
    rows = product(loads, PRESSURES, (-0.05, 0.0, 0.05), pairs)
    load, pressure, camber, pair = (np.array(x) for x in zip(*rows, strict=True))
    alpha, kappa = pair.T
    tire = MagicTire(61, Coefficients(TRUTH), 0.32, 4000.0, 2.2e5, 2.2e5, {})
    at = magic_forces(tire, load, alpha, kappa, camber, pressure)
    return ForceData(load, pressure, alpha, kappa, camber, Fx=at.Fx, Fy=at.Fy, Mz=at.Mz)


@cache
def refitted() -> MagicFit:
    return fit_magic(made(), radius=0.32, nominal_load=4000.0)


@pytest.mark.parametrize(("force", "share"), [("Fx", 2e-3), ("Fy", 2e-3), ("Mz", 0.02)])
def test_a_tire_of_the_formula_is_found_also_between_the_points(force: str, share: float) -> None:
    between = made(0.5 * (BOTH[1:] + BOTH[:-1]), (2200.0, 3700.0, 5200.0))
    names = ("load", "slip_angle", "slip_ratio", "camber", "pressure")
    found = magic_forces(refitted().tire, *(getattr(between, name) for name in names))
    wanted = getattr(between, force)
    assert np.abs(getattr(found, force) - wanted).max() < share * np.abs(wanted).max()
    assert found.curved_well.all()
    assert found.in_range.all()


def test_a_coefficient_is_fitted_as_its_values_at_the_ends_of_the_loads() -> None:
    """So E <= 1 and a friction above zero hold at every load between them."""
    points, (low, high) = made(), (LOADS[0] / 4000.0 - 1.0, LOADS[-1] / 4000.0 - 1.0)
    for stage in STAGES[:5]:
        fit = _Fit(points, stage, (low, high))
        random = np.random.default_rng(1).uniform(0.1, 0.9, fit.size)
        ends: dict[str, float] = {}
        fit._put(random, ends)
        rest, most = iter(random), dict(zip(fit.names, fit._column("high"), strict=True))
        for term in fit.terms:
            first = next(rest)
            if term.slope:
                assert ends[term.name] + ends[term.slope] * low == pytest.approx(first)
                assert ends[term.name] + ends[term.slope] * high == pytest.approx(next(rest))
            else:
                assert ends[term.name] == first
            if term.name[1] == "E":
                assert most[term.name] == most[term.slope] == 1.0


def test_what_does_not_vary_is_not_fitted_and_what_is_missing_is_named() -> None:
    points = made()
    chosen = (points.load == LOADS[1]) & (points.pressure == 2.2e5) & (points.camber == 0.0)
    none = np.full(int(chosen.sum()), np.nan)
    fit = fit_magic(replace(points.take(chosen), Fx=none, Mz=none), radius=0.32)
    assert set(fit.fitted) == {
        *("PCY1", "PDY1", "PEY1", "PKY1", "PHY1", "PVY1"),
        *("RBY1", "RBY2", "RBY3", "RCY1", "REY1", "RHY1"),
    }
    assert set(fit.errors) == {"Fy"}
    assert set(fit.assumed) == {"PCX1", "PDX1", "PKX1"}
    stiffness = magic_forces(fit.tire, 3000.0, 0.0)
    assert stiffness.slip_stiffness == pytest.approx(-stiffness.cornering_stiffness)


def test_too_few_points_are_refused() -> None:
    points = made()
    with pytest.raises(CalibrationError, match=r"9 points with Fy .* are needed"):
        fit_magic(points.take(np.arange(9)), radius=0.32)


def brush(**more: float) -> TireFile:
    values = {
        "bristle_lateral": 9e6,
        "friction": 0.95,
        "half_length": 0.06,
        "load_power": 0.45,
        "reference_load": 4000.0,
        "reference_pressure": 2.2e5,
        "pressure_power": -0.4,
        "free_radius": 0.32,
    }
    values |= more
    return TireFile("made", {n: Number(v, np.nan, "assumed", "test") for n, v in values.items()})


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    write_tire(brush(), folder / "M.toml", "tirelib-model/1")
    words = ["export", "M.toml", "--tir", "F.tir", "--json", "F.json"]
    words = [str(folder / word) if "." in word else word for word in words]
    found = CliRunner().invoke(program, words)
    assert found.exit_code == 0, found.output + repr(found.exception)
    return folder


def numbers_of(file: Path) -> dict[str, float]:
    """Read KEY = number of a file, and nothing else of it."""
    found = re.findall(r"^([A-Z]\w*) *= *([-+.\deE]+) *(?:\$.*)?$", file.read_text(), re.MULTILINE)
    return {key: float(value) for key, value in found}


def side_force(c: dict[str, float], load: float, alpha: np.ndarray, pressure: float) -> np.ndarray:
    """Fy at no camber, from Pacejka (2012), (4.E19) to (4.E29), typed anew."""
    dfz = load / c["FNOMIN"] - 1.0
    dpi = pressure / c["NOMPRES"] - 1.0
    turn = np.arctan(load / c["FNOMIN"] / (c["PKY2"] * (1.0 + c["PPY2"] * dpi)))
    K = c["PKY1"] * c["FNOMIN"] * (1.0 + c["PPY1"] * dpi) * np.sin(c["PKY4"] * turn)
    mu = (c["PDY1"] + c["PDY2"] * dfz) * (1.0 + c["PPY3"] * dpi + c["PPY4"] * dpi**2)
    D, C, E = mu * load, c["PCY1"], c["PEY1"] + c["PEY2"] * dfz
    x = K / (C * D) * (np.tan(alpha) + c["PHY1"] + c["PHY2"] * dfz)
    curve = D * np.sin(C * np.arctan(x - E * (x - np.arctan(x))))
    return np.asarray(curve + load * (c["PVY1"] + c["PVY2"] * dfz))


@pytest.mark.parametrize("pressure", [1.87e5, 2.2e5, 2.53e5])
def test_an_independent_reader_gets_the_forces_of_the_brush(written: Path, pressure: float) -> None:
    c = numbers_of(written / "F.tir")
    tire, model = magic_tire(read_tir(written / "F.tir")), force_model_of(brush())
    told = json.loads((written / "F.json").read_text())["errors"]["Fy"]
    points = model_points(model, slip_angle=0.2, slip_ratio=0.1, speed=16.0, radius=0.32)
    for load in (2000.0, 4000.0):
        rows = (points.load == load) & (points.slip_ratio == 0.0)
        rows &= np.isclose(points.pressure, pressure)
        assert rows.sum() > 15
        read = side_force(c, load, points.slip_angle[rows], pressure)
        ours = magic_forces(tire, load, points.slip_angle[rows], pressure=pressure).Fy
        np.testing.assert_allclose(read, ours, atol=1e-6 * load)
        assert np.abs(read - points.Fy[rows]).max() <= 1.01 * told["largest"]


def test_the_comments_tell_error_and_range(written: Path) -> None:
    told = json.loads((written / "F.json").read_text())
    text = (written / "F.tir").read_text()
    comments = text[: text.index("[UNITS]")]
    for name, limit in (("Fx", 0.02), ("Fy", 0.02), ("Mz", 0.06)):
        error = told["errors"][name]
        assert f"{name}: rms {error['rms']:.3g} " in comments
        assert error["rms"] < limit * error["peak"]
    for line in ("load: 1000 .. 7000 N", "slip angle: -12 .. 12 deg", "pressure: 1.87 .. 2.53 bar"):
        assert line in comments
    assert "camber: 0 .. 0 deg" in comments  # this brush has no camber thrust
    assert numbers_of(written / "F.tir")["FZMAX"] == 7000.0


def test_a_campaign_gives_the_forces_that_it_measured(tmp_path: Path) -> None:
    write_forces(tmp_path / "steady", steady_runs(), "steady")
    words = ["export", tmp_path / "steady", "--tir", tmp_path / "F.tir", "--json", tmp_path / "j"]
    found = CliRunner().invoke(program, list(map(str, words)))
    assert found.exit_code == 0, found.output
    assert "No point has Fx" in found.output
    assert "PDX1 from the lateral friction PDY1" in found.output
    error = json.loads((tmp_path / "j").read_text())["errors"]["Fy"]
    assert error["points"] == 60
    assert 3.0 < error["rms"] < 0.01 * error["peak"]  # noise of 6 N, and another curve's shape


def refused(tmp_path: Path, file: TireFile, *options: object) -> str:
    write_tire(file, tmp_path / "M.toml", "tirelib-model/1")
    words = ["export", tmp_path / "M.toml", "--tir", tmp_path / "F.tir", *options]
    found = CliRunner().invoke(program, list(map(str, words)))
    assert isinstance(found.exception, TirelibError), found.output
    assert not (tmp_path / "F.tir").exists()
    return str(found.exception)


def test_bad_input_is_refused(tmp_path: Path) -> None:
    most = "largest slip angle = 1.571; allowed are 0.01 to 0.6"
    assert most in refused(tmp_path, brush(), "--slip-angle", 90)
    numbers = {name: x for name, x in brush().numbers.items() if name != "free_radius"}
    assert "states no free_radius" in refused(tmp_path, replace(brush(), numbers=numbers))
