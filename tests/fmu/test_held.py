"""What `tirelib fmu build` says of a calibration: its gages, and what was not varied."""

from dataclasses import replace
from pathlib import Path

from click.testing import CliRunner

from tests.fmu import live
from tirelib.cli import program
from tirelib.estimators.calibration_file import read_calibration
from tirelib.fmu.held import not_varied


def test_the_build_says_where_the_gages_are_and_what_was_not_varied(tmp_path: Path) -> None:
    path = live.calibration_file()
    out = str(tmp_path / "X.fmu")
    told = CliRunner().invoke(program, ["fmu", "build", "--calibration", str(path), "--out", out])
    assert told.exit_code == 0
    assert "strain_1 = +60 mm (left) .. strain_5 = -60 mm (right) (ISO 8855)" in told.output
    for condition in not_varied(read_calibration(path)):
        assert f"not varied in the calibration: {condition}" in told.output


def test_what_was_not_varied_is_what_the_laws_stand_in_for() -> None:
    known = read_calibration(Path(__file__).parents[2] / "build/cosim/calibration.toml")
    assert list(not_varied(known)) == ["pressure: holds for 1.14 to 2.89 bar"]
    chain = known.chains[-1]
    laws = replace(chain.laws, speed_fitted=False)
    guards = {**chain.guards, "kappa": ()}
    level = tuple(
        replace(g, low=-0.001, high=0.001) if g.name == "camber" else g for g in guards["Fy"]
    )
    poor = replace(
        known,
        chains={-1: replace(chain, laws=laws, guards={**guards, "Fy": level})},
    )
    said = [condition.partition(":")[0] for condition in not_varied(poor)]
    assert said == ["pressure", "speed", "camber", "slip ratio"]
