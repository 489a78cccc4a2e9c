"""Every kind of bad input has its defined answer from the virtual tire too, and the host lives."""

import math
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu.virtual_host import RATE, TYPICAL, Host, file
from tirelib.fmu import export
from tirelib.fmu.virtual.spec import build_virtual


@pytest.fixture(scope="module", params=[False, True], ids=["native", "python"])
def ten(request: pytest.FixtureRequest) -> Iterator[Host]:
    host = Host(file(10, python=request.param))
    yield host
    host.close()


@pytest.fixture(scope="module")
def python_ten() -> Iterator[Host]:
    """The one whose Python a test can reach into."""
    host = Host(file(10, python=True))
    yield host
    host.close()


def refused(host: Host, step: float, cause: str) -> None:
    """A step is refused with its cause; the frame and the angle stay."""
    host.messages.clear()
    before = host.frame().tolist(), host.get("wheel_angle")
    with pytest.raises(FMICallException, match="status 3"):
        host.slave.doStep(host.time, step)
    assert any(cause in text for text in host.messages), host.messages
    assert host.get("frame_valid") is False
    assert host.get("status").startswith(f"step_refused: {cause.split(';')[0]}")
    assert (host.frame().tolist(), host.get("wheel_angle")) == before


@pytest.mark.parametrize(
    "inputs",
    [
        {"Fz": np.nan},
        {"Fz": np.inf},
        {"alpha": -np.inf},
        {"kappa": np.nan},
        {"camber": np.inf},
        {"speed": np.inf},
        {"speed": -np.inf},
        {"speed": -20.0},
        {"pressure": np.nan},
        {"pressure": -np.inf},
        {"kappa": -1.5},
        {"Fz": 1e308, "alpha": -1e308},
        dict.fromkeys(TYPICAL, np.nan),
    ],
)
def test_what_cannot_be_is_named_held_and_forgotten(ten: Host, inputs: dict[str, float]) -> None:
    ten.start(relaxation_length=0.05, relaxation_length_kappa=0.05)
    wanted = ten.play(3)
    ten.put(**inputs)
    ten.play(2)
    assert ten.get("frame_valid") is False
    assert ten.get("status").startswith(f"out_of_range: {next(iter(inputs))}")
    np.testing.assert_array_equal(ten.frame(), wanted[-10:])
    assert all(math.isfinite(ten.get(name)) for name in ("omega", "wheel_angle", "alpha_relaxed"))
    ten.put(**TYPICAL)
    ten.play(40)
    assert (ten.get("status"), ten.get("frame_valid")) == ("ok", True)
    assert np.isfinite(ten.frame()).all()


WRONG = {
    "Fz": (-4000.0, "Fz_out_of_range: Fz [N] = -4000; the virtual tire holds for 800 .. 9000; "),
    "alpha": (3.0, "alpha_out_of_range: alpha [rad] = 3; the virtual tire holds for -0.139626 .. "),
    "kappa": (
        -0.3,
        "kappa_out_of_range: kappa [1] = -0.3; the virtual tire holds for -0.12 .. 0.12",
    ),
    "camber": (np.nan, "camber_out_of_range: camber [rad] = nan; the virtual tire holds for -0.06"),
    "speed": (65.0, "speed_out_of_range: speed [m/s] = 65; the virtual tire holds for 5.5"),
    "pressure": (2.3, "pressure_out_of_range: pressure [Pa] = 2.3; the virtual tire holds for 180"),
}
"""By input: what cannot be, and how the log begins that says it."""


@pytest.mark.parametrize("name", WRONG)
def test_an_input_out_of_range_is_logged_once_with_its_value_range_and_remedy(
    ten: Host, name: str
) -> None:
    value, said = WRONG[name]
    for _ in range(2):  # a reset lets it be logged again
        ten.messages.clear()
        ten.start()
        ten.put(**{name: value})
        ten.play(3)
        ten.put(**TYPICAL)
        ten.play(3)
        ten.put(**{name: value})
        ten.play(3)
        (line,) = ten.messages
        assert line.startswith(said)
        assert "beyond, the last frame is held: give it in " in line


def test_what_a_wheel_that_stands_does_not_need_is_not_logged(ten: Host) -> None:
    ten.messages.clear()
    ten.start()
    ten.put(speed=0.0, kappa=9.0, alpha=-np.nan)
    ten.play(3)
    assert not ten.messages


@pytest.mark.parametrize(
    ("step", "cause"),
    [
        (0.0, "communication step = 0 s; allowed is above 0"),
        (-1e-3, "communication step = -0.001 s; allowed is above 0"),
        (math.nan, "communication step = nan s; allowed is above 0"),
        (math.inf, "communication step = inf s; allowed is above 0"),
        (0.11, "communication step = 0.11 s brings 1100 samples"),  # a turn takes 0.1 s
        (1e300, "communication step = 1e+300 s brings"),
    ],
)
def test_a_step_that_cannot_be_is_an_error_with_its_cause(
    ten: Host, step: float, cause: str
) -> None:
    ten.start()
    ten.play(2)
    refused(ten, step, cause)
    again = ten.play(1)
    ten.start()
    np.testing.assert_array_equal(ten.play(3)[-10:], again)


def test_steps_before_the_start_and_after_the_end_are_refused(ten: Host) -> None:
    ten.slave.reset()
    refused(ten, 1e-3, "the FMU is not initialised")
    ten.start()
    wanted = ten.play(2)
    ten.slave.terminate()
    refused(ten, 1e-3, "the FMU is terminated")
    np.testing.assert_array_equal(ten.frame(), wanted[-10:])
    ten.start()
    np.testing.assert_array_equal(ten.play(2), wanted)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sample_rate", 1.0),
        ("sample_rate", math.nan),
        ("relaxation_length", -0.1),
        ("relaxation_length_kappa", math.inf),
        ("noise_std", math.nan),
        ("start_angle", 4.0),
        ("fault_start", -1.0),
        ("saturation", 2.0),
        ("drift", -math.inf),
        ("dropped_frames", 1.5),
        ("dead_gage", 6),
        ("dead_gage", -1),
        ("seed", -1),
    ],
)
def test_a_parameter_out_of_range_fails_the_start_by_name_and_a_reset_heals_it(
    ten: Host, name: str, value: float
) -> None:
    ten.messages.clear()
    with pytest.raises(FMICallException):
        ten.start(**{name: value})
    assert any(f"{name} = {value:g}; allowed are" in text for text in ten.messages), ten.messages
    refused(ten, 1e-3, "the FMU is not initialised")
    ten.start()
    ten.step()
    assert ten.get("frame_valid") is True


def test_outputs_and_fixed_parameters_cannot_be_set(ten: Host) -> None:
    ten.start()
    at = ten.references
    for call, cause in (
        (lambda: ten.slave.setReal([at["omega"]], [1.0]), "omega: cannot be set now"),
        (lambda: ten.slave.setReal([at["noise_std"]], [0.0]), "noise_std: cannot be set now"),
        (lambda: ten.slave.setInteger([at["seed"]], [3]), "seed: cannot be set now"),
        (lambda: ten.slave.setReal([at["seed"]], [3.0]), "seed is not of type Real"),
        (
            lambda: ten.slave.getReal([99999]),
            "IndexError" if ten.python else "value reference = 99999; allowed are 0 .. ",
        ),
    ):
        ten.messages.clear()
        with pytest.raises(FMICallException):
            call()
        assert any(cause in text for text in ten.messages), ten.messages
    ten.step()
    assert ten.get("status") == "ok"


def test_an_error_nobody_expected_holds_the_frame_and_no_sample_is_counted_twice(
    python_ten: Host, monkeypatch: pytest.MonkeyPatch
) -> None:
    ten = python_ten
    options = {"noise_std": 4e-6, "seed": 3}
    ten.start(**options)
    wanted = ten.play(6)
    package = next((Path(ten.folder) / "resources").glob("tirelib_*")).name
    surface = sys.modules[f"{package}.fmu.virtual.surface"].Surface
    ten.start(**options)
    found = ten.play(2)
    ten.messages.clear()

    def fails(*_: Any) -> Any:
        raise ZeroDivisionError("made by a test")

    with monkeypatch.context() as patch:
        patch.setattr(surface, "strain", fails)
        ten.put(alpha=TYPICAL["alpha"] + 1e-3)
        ten.play(2)
    assert ten.messages == ["ZeroDivisionError: made by a test"]
    assert ten.get("frame_valid") is False
    assert ten.get("status") == "fault: ZeroDivisionError: made by a test"
    np.testing.assert_array_equal(ten.frame(), found[-10:])
    ten.put(**TYPICAL)
    ten.play(1)
    assert (ten.get("status"), ten.get("frame_valid")) == ("ok", True)
    # the slip angle was another for 2 ms, of which little is left; angle and noise are in step
    np.testing.assert_allclose(ten.play(1), wanted[-10:], atol=1e-5)


def without(path: Path, change: str, text: bytes) -> Path:
    """Write the FMU with one of its files replaced."""
    with (
        zipfile.ZipFile(file(10, python=change == "surface.npz")) as old,
        zipfile.ZipFile(path, "w") as new,
    ):
        for name in old.namelist():
            if not name.endswith(change):
                new.writestr(name, old.read(name))
            elif text:
                new.writestr(name, text)
    return path


@pytest.mark.parametrize(
    ("name", "text", "cause"),
    [
        ("surface.npz", b"", "No such file"),
        ("surface.npz", b"PK\3\4", "is not the response surface"),
        ("VirtualTire.core", b"", "StrainTire.core or VirtualTire.core cannot be read"),
        ("VirtualTire.core", b"tirelib-core/1\n", "VirtualTire.core is no tirelib-core/1"),
    ],
)
def test_a_surface_that_is_missing_or_damaged_fails_the_instance_and_says_why(
    tmp_path: Path, name: str, text: bytes, cause: str
) -> None:
    messages: list[str] = []
    with pytest.raises(Exception, match="Failed to instantiate"):
        Host(without(tmp_path / "x.fmu", name, text), messages)
    assert any(cause in message for message in messages), messages


def test_two_versions_in_one_process_each_run_their_own_code(
    python_ten: Host, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ten = python_ten
    honest = export.collect

    def doubled(slave: Path) -> dict[str, str]:
        sources = honest(slave)
        text = sources["fmu/virtual/wheel.py"]
        old = "self._force = self._surface.forces_of(answers)[-1].tolist()"
        assert old in text
        new = old.replace("forces_of(answers)", "forces_of(2.0 * answers)")
        return {**sources, "fmu/virtual/wheel.py": text.replace(old, new)}

    monkeypatch.setattr(export, "collect", doubled)
    second = Host(build_virtual(tmp_path / "second.fmu", samples_per_step=10, python=True))
    third = Host(file(10, python=True))
    try:
        for host in (ten, second, third):
            host.start()
        for _ in range(3):
            for host in (second, ten, third):
                host.step()
        forces = [host.get("Fy_rig") for host in (ten, second, third)]
        np.testing.assert_array_equal(ten.frame(), second.frame())
    finally:
        second.close()
        third.close()
    assert forces == [forces[0], 2.0 * forces[0], forces[0]]


def test_a_frame_goes_on_at_the_rate_that_was_set(ten: Host) -> None:
    ten.start(sample_rate=2e3)
    ten.step(10 / 2e3)
    assert (ten.get("samples"), RATE) == (10, 1e4)
    refused(ten, 11 / 2e3, "communication step = 0.0055 s brings 11 samples at 2000 Hz")
