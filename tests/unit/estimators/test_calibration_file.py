"""A damaged calibration is refused, and every fault of it is named."""

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from tirelib.core.errors import FormatError
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.reference_turn import ReferenceTurn
from tirelib.estimators.train import Trained

Edit = Callable[[dict[str, Any]], None]


def put(*path: str | int, value: object) -> Edit:
    def edit(document: dict[str, Any]) -> None:
        place: Any = document
        for step in path[:-1]:
            place = place[step]
        place[path[-1]] = value

    return edit


def moved(place: tuple[str | int, ...], name: str, other: str) -> Edit:
    def edit(document: dict[str, Any]) -> None:
        table: Any = document
        for step in place:
            table = table[step]
        table[other] = table.pop(name)

    return edit


CLOUD = {
    "names": ["traction", "cp1_slope"],
    "scale": [1.0, 1.0],
    "points": [[0.0, 0.0]],
    "reach": 0.1,
}
TURN = ReferenceTurn(np.zeros((5, 128)), 20.0, float("nan"), 0.0, 66.0, "somewhere, run 1")
FZ = ("chain", 0, "Fz")
FAULTS: dict[str, tuple[Edit, str]] = {
    "axes": (put("axes", value="sae"), "axes = 'sae'"),
    "unit": (put(*FZ, "unit", value="kN"), "unit = 'kN'; only 'N' is allowed"),
    "nan": (put(*FZ, "term", 1, "value", value=float("nan")), "term[1].value = nan"),
    "text": (put(*FZ, "term", 1, "value", value="12"), "term[1].value = '12'"),
    "truth value": (put(*FZ, "term", 1, "value", value=True), "term[1].value = True"),
    "power": (put(*FZ, "term", 1, "exponents", 0, value=-1), "whole numbers from 0"),
    "broken power": (put(*FZ, "term", 1, "exponents", 0, value=1.7), "whole numbers from 0"),
    "huge power": (put(*FZ, "term", 1, "exponents", 0, value=10**9), "whole numbers from 0"),
    "regressor": (put(*FZ, "variable", 0, "name", value="luck"), "name = 'luck' is unknown"),
    "scale": (put(*FZ, "variable", 0, "scale", value=0.0), "scale = 0"),
    "residual": (put(*FZ, "residual", value=-1.0), "residual = -1.0"),
    "covariance": (put(*FZ, "covariance", 0, 0, value=-1.0), "negative variance"),
    "asymmetric": (put(*FZ, "covariance", 0, 1, value=1e9), "is not symmetric"),
    "gage": (put("chain", 0, "gages", 0, value=9), "numbers from 1 to 5"),
    "range": (put("chain", 0, "range", "Fz", value=[]), "it decides on validity"),
    "needed": (put("chain", 0, "range", "Fz", 0, "needed", value="no"), "true or false"),
    "order": (put("filter", "order", value="24"), "filter.order = '24'"),
    "cloud": (put("chain", 0, "cloud", value=7), "cloud: is no table"),
    "cloud's scale": (put("chain", 0, "cloud", value=CLOUD | {"scale": [1, 0]}), "numbers above 0"),
    "cloud's reach": (put("chain", 0, "cloud", value=CLOUD | {"reach": -1.0}), "reach = -1.0"),
    "cloud's points": (put("chain", 0, "cloud", value=CLOUD | {"points": [[1]]}), "pairs of"),
    "turn": (put("reference_turn", value=1), "reference_turn: is no table"),
    "turn's rate": (put("reference_turn", "omega", value=0.0), "reference_turn.omega = 0.0"),
    "turn's unit": (put("reference_turn", "strain_unit", value="ppm"), "strain_unit = 'ppm'"),
    "turn's speed": (put("reference_turn", "speed", value="fast"), "speed = 'fast'"),
    "turn's run": (put("reference_turn", "run", value=3), "run = 3; a text"),
    "turn's gages": (put("reference_turn", "strain", value=[[1] * 99]), "5 rows of equally many"),
    "turn's hole": (put("reference_turn", "strain", 1, 7, value=float("nan")), "finite numbers"),
    "turn's length": (put("reference_turn", "strain", 1, value=[1] * 99), "equally many"),
    "table": (moved((), "filter", "filters"), "filters: is unknown; did you mean 'filter'?"),
    "turn's name": (moved((), "reference_turn", "reference_trun"), "you mean 'reference_turn'?"),
    "cut-off": (put("filter", "cutoff_hz", value=9.0), "filter.cutoff_hz: is unknown; did you"),
    "likeness": (moved(("chain", 0), "likeness", "likenes"), "likenes: is unknown; did you mean"),
    "no part": (put("chain", 0, "extra", value=1), "chain[0].extra: is unknown; there are"),
    "border": (put(*FZ, "boarder", value={}), "Fz.boarder: is unknown; did you mean 'border'?"),
    "twice": (put("chain", 1, "missing_gage", value=0), "each once"),
}


@pytest.fixture(scope="module")
def sound(trained: Trained, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("cal") / "cal.toml"
    write_calibration(replace(trained.calibration, reference=TURN), path)
    return path.read_text()


def test_what_is_optional_may_be_absent(sound: str, tmp_path: Path) -> None:
    document = tomllib.loads(sound)
    del document["reference_turn"]
    (tmp_path / "cal.toml").write_text(tomli_w.dumps(document))
    assert read_calibration(tmp_path / "cal.toml").reference is None


@pytest.mark.parametrize("fault", FAULTS)
def test_a_damaged_number_is_refused_and_named(sound: str, tmp_path: Path, fault: str) -> None:
    edit, message = FAULTS[fault]
    document = tomllib.loads(sound)
    edit(document)
    (tmp_path / "bad.toml").write_text(tomli_w.dumps(document))
    with pytest.raises(FormatError) as caught:
        read_calibration(tmp_path / "bad.toml")
    assert message in str(caught.value)
    assert "bad.toml" in str(caught.value)


def test_all_faults_are_listed_at_once(sound: str, tmp_path: Path) -> None:
    document = tomllib.loads(sound)
    for name in ("axes", "unit", "gage"):
        FAULTS[name][0](document)
    (tmp_path / "bad.toml").write_text(tomli_w.dumps(document))
    with pytest.raises(FormatError) as caught:
        read_calibration(tmp_path / "bad.toml")
    assert len(caught.value.problems) == 3
