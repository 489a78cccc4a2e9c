"""The virtual tire without Python: sample by sample what the Python one computes, to 1e-9."""

import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException

from tests.fmu import virtual_host
from tests.fmu.virtual_host import RATE, Host
from tests.native.test_native_fmu import c_host
from tirelib.fmu.refusals import StepError
from tirelib.fmu.virtual.faults import Faults
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.spec import build_virtual, default_surface, friction_surface
from tirelib.fmu.virtual.surface import Surface, read_surface
from tirelib.fmu.virtual.wheel import VirtualWheel

SEQUENCES = int(os.environ.get("TIRELIB_SEQUENCES", "16"))
"""How many sequences are made up."""
SAMPLES = 10
SIZES = {"strain": 1e-2, "Fx_rig": 1e3, "Fy_rig": 1e3, "Mz_rig": 1e2}
"""Usual sizes of what may be near zero; of everything else 1."""


class Pair:
    """The FMU and the library's wheel, which get the same."""

    def __init__(self, path: Path, surface: Surface, options: dict[str, Any]) -> None:
        self.host, self.surface, self.options = Host(path), surface, options
        self.wheel: Any = None

    def start(self, inputs: list[float]) -> None:
        o = self.options
        faults = Faults(o["fault_start"], o["dead_gage"], o["saturation"], o["drift"], o["dropped"])
        relaxation = o["relaxation_length"], o["relaxation_length_kappa"]
        rest = o["noise_std"], o["seed"], o["start_angle"], faults
        self.wheel = VirtualWheel(
            self.surface, Options(o["sample_rate"], relaxation, *rest), SAMPLES
        )
        self.wheel.begin(inputs)
        given = {("dropped_frames" if k == "dropped" else k): v for k, v in o.items()}
        self.host.start(dict(zip(self.surface.inputs, inputs, strict=True)), **given)
        self.same()

    def step(self, step: float, inputs: list[float]) -> None:
        """Step both; a step that one refuses is refused by the other, in the same words."""
        self.host.put(**dict(zip(self.surface.inputs, inputs, strict=True)))
        cause = None
        try:
            self.wheel.step(step, inputs)
        except StepError as error:
            cause = str(error)
        if cause is None:
            self.host.step(step)
            self.same()
            return
        with pytest.raises(FMICallException):
            self.host.step(step)
        assert self.host.get("status") == f"step_refused: {cause}".replace(";", ",")

    def same(self) -> None:
        reals, others = self.wheel.outputs()
        shown = self.host
        assert [shown.get(n) for n in ("samples", "frame_valid", "moving", "status")] == [*others]
        names = [n for n, kind in shown.kinds.items() if kind == "Real"]
        names = names[names.index("strain_1_1") :]
        found = shown.slave.getReal([shown.references[n] for n in names])
        size = [SIZES.get(n if n in SIZES else n[:6], 1.0) for n in names]
        scale = np.maximum(np.abs(reals), size)
        np.testing.assert_allclose(
            np.array(found) / scale, np.array(reals) / scale, rtol=0.0, atol=1e-9
        )


@pytest.fixture(scope="module", params=["reference", "friction"])
def tire(request: pytest.FixtureRequest) -> tuple[Path, Surface]:
    if request.param == "friction":
        return virtual_host.friction_file(), read_surface(friction_surface())
    return virtual_host.file(SAMPLES), read_surface(default_surface())


def made_up(random: np.random.Generator) -> dict[str, Any]:
    """Options: noise, relaxation and faults, each there or not."""

    def some(value: float, none: float = 0.0) -> float:
        return value if random.random() < 0.4 else none

    return {
        "sample_rate": float(random.choice([1e4, 5e3, 12345.6])),
        "relaxation_length": some(0.3, some(0.05)),
        "relaxation_length_kappa": some(0.1),
        "noise_std": some(4e-6),
        "seed": int(random.integers(0, 2**31 - 1)),
        "start_angle": float(random.uniform(-3.1, 3.1)),
        "fault_start": some(0.02),
        "dead_gage": int(some(float(random.integers(1, 6)))),
        "saturation": some(2e-3),
        "drift": some(1e-3),
        "dropped": some(0.3),
    }


def condition(random: np.random.Generator, surface: Surface) -> list[float]:
    """A condition, mostly in range; now and then a wheel that stands, locks, or is nowhere."""
    middle = 0.5 * (surface.low + surface.high)
    values = middle + 0.3 * (surface.high - surface.low) * random.uniform(-1.0, 1.0, middle.size)
    kind, names = random.random(), surface.inputs
    if kind < 0.06:
        values[names.index("speed")] = 0.0
    elif kind < 0.12:
        values[names.index("kappa")] = -1.0
    elif kind < 0.18:
        values[int(random.integers(values.size))] = float(
            random.choice([np.nan, np.inf, 1e9, -5.0])
        )
    return [float(x) for x in values]


@pytest.mark.parametrize("seed", range(SEQUENCES))
def test_sequences_are_those_of_the_library(tire: tuple[Path, Surface], seed: int) -> None:
    random = np.random.default_rng(seed)
    pair = Pair(*tire, made_up(random))
    rate = pair.options["sample_rate"]
    inputs = condition(random, pair.surface)
    pair.start(inputs)
    for _ in range(80):
        if random.random() < 0.3:
            inputs = condition(random, pair.surface)
        step = SAMPLES / rate * float(random.choice([1.0, 1.0, 1.0, 0.37, 0.05, 1.3, 0.0, -1.0]))
        pair.step(step, inputs)
    pair.host.close()


def test_a_long_steady_run_stays_in_step(tire: tuple[Path, Surface]) -> None:
    """The library takes the angle of a steady run from its beginning, the core step by step."""
    pair = Pair(*tire, made_up(np.random.default_rng(1)) | {"dropped": 0.0, "sample_rate": RATE})
    inputs = [*(virtual_host.TYPICAL.values()), 0.9][: len(pair.surface.inputs)]
    pair.start(inputs)
    for _ in range(3000):
        pair.wheel.step(SAMPLES / RATE, inputs)
        pair.host.step(SAMPLES / RATE)
    pair.same()
    pair.host.close()


def test_states_go_back_and_forth(tire: tuple[Path, Surface]) -> None:
    path, surface = tire
    random = np.random.default_rng(5)
    options = {"noise_std": 4e-6, "seed": 7, "relaxation_length": 0.4}
    host, other = Host(path), Host(path)
    course = [dict(zip(surface.inputs, condition(random, surface), strict=True)) for _ in range(40)]
    host.start(course[0], **options)
    states, shown = [], []
    for inputs in course:
        states.append(host.slave.serializeFMUstate(host.slave.getFMUstate()))
        host.put(**inputs)
        host.step()
        shown.append((host.frame().tolist(), host.get("status"), host.get("wheel_angle")))
    for at in (30, 3):
        other.slave.setFMUState(other.slave.deSerializeFMUstate(states[at]))
        for number in range(at, 40):
            other.put(**course[number])
            other.step()
            found = other.frame().tolist(), other.get("status"), other.get("wheel_angle")
            assert repr(found) == repr(shown[number])
    damaged = bytearray(states[20])
    damaged[-100] ^= 1
    with pytest.raises(FMICallException):
        other.slave.setFMUState(other.slave.deSerializeFMUstate(bytes(damaged)))
    assert "not a saved state of this FMU" in other.messages[-1]
    host.close()
    other.close()


REFUSED = {
    "sample_rate": 50.0,
    "relaxation_length": -1.0,
    "relaxation_length_kappa": 1e3,
    "noise_std": 2.0,
    "start_angle": 4.0,
    "fault_start": -1.0,
    "saturation": 1.5,
    "drift": -2.0,
    "dropped_frames": np.nan,
    "dead_gage": 6,
    "seed": -1,
}


def test_parameters_and_their_refusals_are_those_of_the_python_fmu() -> None:
    files = [virtual_host.file(SAMPLES, python=python) for python in (False, True)]
    native, python = (read_model_description(str(file)) for file in files)
    for own, other in zip(native.modelVariables, python.modelVariables, strict=True):
        for name in (
            *("name", "valueReference", "type", "causality", "variability", "description"),
            *("unit", "displayUnit", "min", "max", "nominal", "start"),
        ):
            assert getattr(own, name) == getattr(other, name), (own.name, name)
    hosts = [Host(file) for file in files]
    for name, value in REFUSED.items():
        for host in hosts:
            host.messages.clear()
            with pytest.raises(FMICallException):
                host.start(**{name: value})
        assert hosts[0].messages[0] == hosts[1].messages[0], name
        assert name in hosts[0].messages[0]
    for host in hosts:
        host.start()
        host.step()
        assert host.get("status") == "ok"
        host.close()


def test_outputs_before_the_start_are_those_of_a_start_now() -> None:
    host = Host(virtual_host.file(SAMPLES))
    host.put(**virtual_host.TYPICAL, **virtual_host.QUIET)
    before = host.frame().tolist(), host.get("Fy_rig"), host.get("status")
    host.start()
    assert (host.frame().tolist(), host.get("Fy_rig"), host.get("status")) == before
    assert before[2] == "ok"
    host.slave.reset()
    host.put(noise_std=-1.0)
    assert host.get("status") == "not_started"
    assert not host.frame().any()
    host.close()


def test_the_same_bytes_again_and_a_process_without_python_runs_it(tmp_path: Path) -> None:
    path = virtual_host.file(SAMPLES)
    again = build_virtual(tmp_path / "again.fmu", samples_per_step=SAMPLES)
    assert again.read_bytes() == path.read_bytes()
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "x")
        assert not [name for name in archive.namelist() if name.endswith((".py", ".npz"))]
    c_host(tmp_path / "x", "VirtualTire", tmp_path, 0.001)
