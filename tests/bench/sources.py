"""Sources of a run: wheels of a tiny campaign, and a vehicle's bus with speed and pressure."""

import numpy as np

from tests.bench.campaigns import tiny_runs
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.links.opening import PortPlan
from tirebench.protocols import SLCAN, slcan
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.user_map import parse_map
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.can_batch import same_kind
from tirebench.wire.device import Device

VEHICLE = """
format = "tirebench-map/1"
[speed]
message = "ABS"
signal = "v"
unit = "km/h"
hold_s = 3600.0
[[pressure]]
wheel = 3
message = "ABS"
signal = "p3"
unit = "bar"
[[message]]
name = "ABS"
id = 0x100
length = 4
signals = [{ name = "v", start = 0, length = 16, factor = 0.01 },
           { name = "p3", start = 16, length = 8, factor = 0.1 }]
"""


def told(speed: float, pressure: float = 2.5) -> bytes:
    """One message of the vehicle on a line of slcan."""
    values = round(100 * speed).to_bytes(2, "little") + bytes([round(10 * pressure), 0])
    data = np.frombuffer(values, np.uint8)[None, :]
    return b"".join(slcan.encode(same_kind(0x100, data, fd=False)))


def wire() -> list[bytes]:
    """Three runs of a wheel that calls itself 0."""
    return list(write_script(tiny_runs(), Device(), Faults({})).frames)


def vehicle(url: str = "p") -> SourcePlan:
    return SourcePlan(
        PortPlan(f"slcan:{url}"), ProtocolPlan(SLCAN, 1e3, parse_map(VEHICLE, "", "v.toml"))
    )


def serial(port: str, wheel: int | None = None) -> SourcePlan:
    return SourcePlan(PortPlan(port), wheel=wheel)
