"""Estimates to other programs: what a foreign DBC reader sees is what was estimated."""

import json
import math
import socket
from dataclasses import replace

import can
import cantools
import pytest

from tirebench.errors import DeviceError
from tirebench.estimator.chain import Turn
from tirebench.links.opening import PortPlan
from tirebench.live.bridges import CanSender, UdpSender, udp_target
from tirebench.live.estimate_frames import estimate_frames
from tirebench.protocols.dbc import FILES

OUTPUTS = {
    "Fz": 4321.5,
    "alpha": math.radians(-3.25),
    "kappa": -0.0123,
    "Fy": -1502.0,
    "Fz_std": 40.0,
    "alpha_std": math.radians(0.05),
    "kappa_std": 0.0011,
    "Fy_std": 21.5,
    "age": 0.0123,
    "valid": 1.0,
    "Fz_valid": 1.0,
    "alpha_valid": 1.0,
    "kappa_valid": 0.0,
    "Fy_valid": 1.0,
}
TURN = Turn(1, 0, 0.5, 0.6, 0.6, OUTPUTS, {}, 8192 | 16, (0, 0, 0, 0, 0), wheel=2)


@pytest.mark.parametrize("file", list(FILES))
def test_a_dbc_reader_sees_the_estimates(file: object) -> None:
    db = cantools.database.load_file(str(file))
    seen: dict[str, float] = {}
    frames = estimate_frames(TURN, 2, 70_000)
    for row in range(3):
        seen |= db.decode_message(int(frames.identifier[row]), frames.data[row].tobytes())
    assert seen["Fz"] == 4321.5
    assert seen["Fy"] == -1502.0
    assert seen["alpha"] == pytest.approx(-3.25, abs=5e-4)
    assert seen["kappa"] == pytest.approx(-0.0123, abs=5e-5)
    assert seen["alpha_std"] == pytest.approx(0.05, abs=5e-4)
    assert (seen["turn"], seen["flags"], seen["valid"]) == (70_000 % 65536, 8208, 0b0111)
    assert seen["age"] == pytest.approx(12.3)


@pytest.mark.parametrize("value", [math.nan, math.inf, 2e4, -2e4])
def test_what_does_not_fit_is_not_known(value: float) -> None:
    turn = replace(TURN, outputs={**OUTPUTS, "Fz": value, "Fy_std": math.nan, "age": -1.0})
    frames = estimate_frames(turn, 0, 1)
    assert frames.data[0][:2].tobytes() == (-(2**15)).to_bytes(2, "little", signed=True)
    assert frames.data[1][2:4].tobytes() == b"\xff\xff"
    assert frames.data[2][2:4].tobytes() == b"\xff\xff"


def test_estimates_go_out_on_a_bus() -> None:
    sender = CanSender(PortPlan("can:virtual:out"))
    with can.Bus(interface="virtual", channel="out", protocol=can.CanProtocol.CAN_FD) as listener:
        sender.send([TURN])
        seen = [listener.recv(2.0) for _ in range(3)]
        assert [m.arbitration_id for m in seen if m] == [0x142, 0x14A, 0x152]
    sender.close()
    with pytest.raises(DeviceError, match=r"not a CAN bus"):
        CanSender(PortPlan("/dev/ttyUSB0"))


def test_plotjuggler_gets_a_line_of_json_a_turn() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(5.0)
        sender = UdpSender("127.0.0.1", listener.getsockname()[1])
        sender.send([TURN])
        line = json.loads(listener.recv(65536))
        assert line["t"] == 0.6
        assert line["tirebench"]["2"]["Fz"] == 4321.5
        sender.close()


@pytest.mark.parametrize("text", ["0", "70000", "localhost:x", "nowhere:99", ":"])
def test_a_target_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(DeviceError, match=r"PORT or ADDRESS:PORT is needed"):
        udp_target(text)
