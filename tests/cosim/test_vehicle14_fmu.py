"""The 14-degrees-of-freedom vehicle as an FMU, through FMPy: it is the library."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cosim.vehicle14 import build_fmu, port
from cosim.vehicle14.files import make_vehicle, usual_tires
from cosim.vehicle14.model import SPIN, Controls
from cosim.vehicle14.parameters import WHEELS, VehicleParameters
from cosim.vehicle14.run import Drive
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from tests.cosim import fmus
from tests.fmu import live
from tirelib.core.arrays import FloatArray


@pytest.fixture(scope="module")
def file() -> Path:
    return fmus.vehicle()


class Host:
    """One instance in FMPy."""

    def __init__(self, path: Path) -> None:
        description = read_model_description(str(path))
        self.at = {v.name: v.valueReference for v in description.modelVariables}
        self.outputs = [
            v.valueReference
            for v in description.modelVariables
            if v.causality == "output" and v.type == "Real"
        ]
        self.slave: Any = FMU2Slave(
            guid=description.guid,
            unzipDirectory=extract(str(path)),
            instanceName="car",
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        self.slave.instantiate()

    def start(self, **values: float) -> None:
        self.slave.reset()
        self.slave.setupExperiment(startTime=0.0)
        self.put(**values)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = 0.0

    def put(self, **values: float) -> None:
        for name, value in values.items():
            self.slave.setReal([self.at[name]], [value])

    def play(self, steps: int, step: float = 1e-3) -> FloatArray:
        rows = []
        for _ in range(steps):
            self.slave.doStep(self.time, step)
            self.time += step
            rows.append(self.slave.getReal(self.outputs))
        return np.array(rows)

    def get(self, name: str) -> float:
        return float(self.slave.getReal([self.at[name]])[0])

    def status(self) -> str:
        return str(self.slave.getString([self.at["status"]])[0].decode())


@pytest.fixture(scope="module")
def host(file: Path) -> Host:
    return Host(file)


INPUT = {"steer_front": 0.02, "brake_FL": 700.0, "brake_FR": 600.0, "friction_RL": 0.7}


def test_the_fmu_is_valid_and_its_bytes_depend_on_the_code_only(file: Path) -> None:
    assert validate_fmu(str(file)) == []
    again = build_fmu.build_vehicle(live.folder() / "VehicleModel_again.fmu")
    assert again.read_bytes() == file.read_bytes()


def test_the_fmu_gives_what_the_library_gives(host: Host) -> None:
    host.start(start_speed=22.0, **INPUT)
    host.play(40)
    drive = Drive(make_vehicle(), make_vehicle().at_rest(22.0))
    given = Controls(
        steer=np.array([0.02, 0.02, 0.0, 0.0]),
        drive=np.zeros(4),
        brake=np.array([700.0, 600.0, 0.0, 0.0]),
        friction=np.array([1.0, 1.0, 0.7, 1.0]),
        road=np.zeros(4),
    )
    for _ in range(40):
        motion = drive.step(1e-3, given)
    wheels = motion.wheels
    for name in ("Fz", "Fx", "Fy", "Mz", "alpha", "kappa", "camber", "speed"):
        seen = [host.get(f"{name}_{wheel}") for wheel in WHEELS]
        np.testing.assert_allclose(seen, getattr(wheels, name), rtol=0, atol=1e-9, err_msg=name)
    np.testing.assert_allclose([host.get(f"omega_{w}") for w in WHEELS], drive.state[SPIN])
    body = [host.get(name) for name in port.BODY]
    expected = [*drive.state[:6], *drive.state[10:16], *motion.acceleration]
    np.testing.assert_allclose(body, expected, rtol=0, atol=1e-9)


def test_a_restored_port_shows_what_the_saved_one_showed() -> None:
    p = VehicleParameters()
    values = [22.0, 0.0, 1e-3, p.sprung_mass, p.height]
    row = [INPUT.get(name, 1.0 if name[:8] == "friction" else 0.0) for name in port.INPUTS]
    one = port.Port(usual_tires(), values, row)
    for _ in range(5):
        one.step(1e-3, row)
    other = port.Port(usual_tires(), values, [0.0] * len(row))
    other.restore(one.state())
    assert other.outputs() == one.outputs()


def test_communication_steps_do_not_matter(host: Host) -> None:
    """1 ms by 12, 4 ms by 3, and uneven ones: the integration's own step is 1 ms or less."""
    ends = []
    for steps in ([1e-3] * 12, [4e-3] * 3, [5e-4, 2.5e-3, 3e-3, 6e-3]):
        host.start(**INPUT)
        ends.append(np.concatenate([host.play(1, step) for step in steps])[-1])
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ends[2], ends[0], rtol=1e-5, atol=1e-5)


def test_a_state_taken_up_again_gives_the_same_bits(host: Host) -> None:
    host.start(**INPUT)
    host.play(5)
    kept = host.slave.getFMUstate()
    data = host.slave.serializeFMUstate(kept)
    time, first = host.time, host.play(5)
    host.slave.setFMUstate(kept)
    host.time = time
    assert (host.play(5) == first).all()
    host.slave.freeFMUstate(kept)
    host.slave.reset()
    host.slave.setFMUstate(host.slave.deSerializeFMUstate(data))
    host.time = time
    assert (host.play(5) == first).all()


@pytest.mark.parametrize(
    ("bad", "told"),
    [
        ({"brake_FL": -1.0}, "brake_FL = -1"),
        ({"friction_RR": 0.0}, "friction_RR = 0"),
        ({"steer_front": np.nan}, "steer_front = nan"),
    ],
)
def test_bad_inputs_refuse_the_step_and_heal(host: Host, bad: dict[str, float], told: str) -> None:
    host.start(**INPUT)
    host.play(2)
    good = {name: INPUT.get(name, 1.0 if name[:8] == "friction" else 0.0) for name in bad}
    host.put(**bad)
    with pytest.raises(Exception, match="status 3"):
        host.play(1)
    assert told in host.status()
    host.put(**good)
    assert np.isfinite(host.play(1)).all()
    assert host.status() == "ok"


def test_outputs_are_there_before_the_start(host: Host) -> None:
    """Other FMUs that start together are given the wheels' first state."""
    host.slave.reset()
    host.slave.setupExperiment(startTime=0.0)
    host.put(start_speed=31.0)
    host.slave.enterInitializationMode()
    names = [f"{q}_{w}" for q, w in itertools.product(("Fz", "speed"), WHEELS)]
    found = host.slave.getReal([host.at[name] for name in names])
    assert found[:4] == pytest.approx(VehicleParameters().static_load)
    assert found[4:] == pytest.approx([31.0] * 4)
    host.slave.exitInitializationMode()
