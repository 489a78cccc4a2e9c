"""An error says where, what was given, what is allowed and what to do, as text and as fields."""

import ast
import pickle
from pathlib import Path

import numpy as np
import pytest

import tirelib
from tirelib.campaign.campaign_fault import CampaignFault, raise_errors
from tirelib.campaign.mdf import read_mdf
from tirelib.core.errors import ConvergenceError, Fault, FormatError, ParameterError, TirelibError
from tirelib.core.units import to_si
from tirelib.physics.ring.ring import Ring

HERE = Fault("M.toml, ring.mass", "-1 kg", "a mass is above 0", "correct it")
THERE = Fault("", "no unit; at all", "allowed are m", "add it")


@pytest.mark.parametrize("kind", [ParameterError, FormatError])
def test_the_text_is_the_parts_and_the_parts_are_kept(kind: type[TirelibError]) -> None:
    error = kind(HERE)
    assert str(error) == "M.toml, ring.mass: -1 kg; a mass is above 0; correct it"
    assert error.faults == (HERE,)
    assert pickle.loads(pickle.dumps(error)).faults == (HERE,)


def test_a_format_error_keeps_every_fault_and_every_text() -> None:
    error = FormatError([HERE, "something else", THERE])
    assert error.faults == (HERE, THERE)
    assert error.problems == (str(HERE), "something else", "no unit; at all; allowed are m; add it")


def test_a_text_alone_has_no_parts() -> None:
    assert ParameterError("x: y; z; w").faults == ()


def test_a_problem_is_a_fault_at_its_place_and_a_folder_goes_before_it() -> None:
    problem = CampaignFault.at("runs.csv, row 3", THERE)
    with pytest.raises(FormatError) as raised:
        raise_errors([problem, CampaignFault("x", "a", "b", "c", "warning")], prefix="set1/")
    (fault,) = raised.value.faults
    assert (fault.where, fault.given) == ("set1/runs.csv, row 3", "no unit; at all")
    assert str(raised.value) == f"set1/{problem}"


@pytest.mark.parametrize(("unit", "dimension"), [("", "force"), ("m", "force"), ("N", "colour")])
def test_a_wrong_unit_is_stated_in_parts(unit: str, dimension: str) -> None:
    with pytest.raises(TirelibError) as raised:
        to_si(1.0, unit, dimension)
    (fault,) = raised.value.faults
    assert str(raised.value) == f"{fault.given}; {fault.allowed}; {fault.remedy}"


@pytest.mark.parametrize(
    "content",
    [
        None,
        b"UnFinMF 4.10",
        b"PK\3\4",
        b"MDF     3.30",
        b"MDF     4.10",
        b"MDF     4.10" + bytes(300),
    ],
)
def test_an_unreadable_run_file_is_stated_in_parts(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "a.mf4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FormatError) as raised:
        read_mdf(path)
    (fault,) = raised.value.faults
    assert str(raised.value) == f"{fault.given}; {fault.allowed}; {fault.remedy}"


def test_an_iteration_that_failed_in_another_process_keeps_its_iterate_and_residual() -> None:
    there = pickle.loads(pickle.dumps(ConvergenceError("no contact", [1.0, 2.0], 0.5, 3)))
    assert (str(there), there.iterate, there.residual) == ("no contact", [1.0, 2.0], 0.5)
    assert there.point == 3


def test_every_message_that_names_a_point_hands_its_index_on() -> None:
    named = 0
    for file in (Path(tirelib.__file__).parent / "physics").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if not (isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)):
                continue
            texts = [t for t in ast.walk(node.exc) if isinstance(t, ast.JoinedStr)]
            if any("point {" in ast.unparse(text) for text in texts):
                named += 1
                assert "point" in {k.arg for k in node.exc.keywords}, f"{file}, line {node.lineno}"
    assert named >= 20


def test_a_ring_says_which_point_is_wrong() -> None:
    with pytest.raises(ParameterError, match="at point 2; a finite number") as raised:
        Ring(0.3, 2.0, 3.0, 1e4, 1e5, 1e5, tension=np.array([0.0, 0.0, np.inf]))
    assert raised.value.point == 2
