"""Another make's transmitter: its DBC or a list of signals is enough."""

from pathlib import Path

import cantools
import numpy as np
import pytest

from tirebench.errors import DeviceError
from tirebench.estimator.chain import Outputs
from tirebench.estimator.estimation import Estimation
from tirebench.estimator.wheels import Wheels
from tirebench.protocols import CAN
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.user_can import UserCan
from tirebench.protocols.user_map import parse_map, read_map
from tirebench.wire.can_batch import joined, pack, same_kind
from tirebench.wire.conditions import Condition, Conditions, Held, Measured
from tirebench.wire.timeline import Timeline
from tirelib.core.arrays import FloatArray

DBC = """VERSION ""
BU_: W
BO_ 529 WHEEL_FL: 12 W
 SG_ g1 : 7|16@0- (0.5,10) [0|0] "ustrain" W
 SG_ g2 : 23|16@0- (0.5,10) [0|0] "ustrain" W
 SG_ g3 : 39|16@0- (0.5,10) [0|0] "ustrain" W
 SG_ g4 : 55|16@0- (0.5,10) [0|0] "ustrain" W
 SG_ g5 : 71|16@0- (0.5,10) [0|0] "ustrain" W
 SG_ stamp : 80|8@1+ (1,0) [0|0] "ms" W
 SG_ count : 88|8@1+ (1,0) [0|0] "" W
BO_ 700 ABS: 8 W
 SG_ v_ref : 0|16@1+ (0.01,0) [0|0] "km/h" W
"""
MAP = """
format = "tirebench-map/1"
dbc = "wheel.dbc"
rate_hz = 1000
strain_unit = "ustrain"
[[wheel]]
wheel = 2
message = "WHEEL_FL"
samples = [["g1", "g2", "g3", "g4", "g5"]]
counter = "count"
time = "stamp"
time_unit = "ms"
[speed]
message = "ABS"
signal = "v_ref"
unit = "km/h"
"""
LISTED = """
format = "tirebench-map/1"
rate_hz = 2000
[[wheel]]
wheel = 0
message = "A"
samples = [["a", "b", "c", "d", "e"]]
counter = "n"
[[message]]
name = "A"
id = 0x210
length = 8
signals = [
  { name = "a", start = 0, length = 10 }, { name = "b", start = 10, length = 10 },
  { name = "c", start = 20, length = 10 }, { name = "d", start = 30, length = 10 },
  { name = "e", start = 40, length = 10 }, { name = "n", start = 52, length = 12 },
]
"""


def physical(count: int) -> np.ndarray:
    """Strain in microstrain, in steps of the signal."""
    return 0.5 * (np.arange(count)[:, None] * 7 % 4001 - 2000 + np.arange(5)) + 10.0


def frames_of(values: np.ndarray) -> np.ndarray:
    message = cantools.database.load_string(DBC, "dbc").get_message_by_name("WHEEL_FL")
    rows = []
    for i, row in enumerate(values):
        signals = {f"g{g + 1}": row[g] for g in range(5)}
        rows.append(message.encode({**signals, "stamp": i % 256, "count": i % 256}))
    return np.frombuffer(b"".join(rows), np.uint8).reshape(-1, 12)


def test_a_dbc_and_a_map_are_enough(tmp_path: Path) -> None:
    (tmp_path / "wheel.dbc").write_text(DBC)
    (tmp_path / "m.toml").write_text(MAP)
    plan = ProtocolPlan(CAN, 1000.0, read_map(tmp_path / "m.toml"))
    again = ProtocolPlan.of_header(plan.as_header(), "x")  # as a recording keeps it
    sent = physical(600)
    for which in (plan, again):
        decoder = UserCan(which.user_map, which.decoder().counts)
        timeline = Timeline(which.device, 2)
        batch = same_kind(529, frames_of(sent), fd=True)
        items = [
            i
            for rows in np.array_split(np.arange(600), 5)
            for i in decoder.push(batch.take(rows), int(rows[-1]) * 1_000_000)
        ]
        blocks = [b for item in items for b in timeline.push(item)]
        strain = np.concatenate([b.strain for b in blocks])
        np.testing.assert_allclose(1e6 * strain, sent, atol=1e-9)
        assert timeline.counts.gaps == 0


def test_signals_may_be_listed_without_a_dbc() -> None:
    user = parse_map(LISTED, "", "m.toml")
    assert user.wheels[0].strain[1].start == 10
    counts = np.arange(50)[:, None] + np.arange(5)
    words = [
        sum(int(c) << (10 * g) for g, c in enumerate(row)) | i << 52 for i, row in enumerate(counts)
    ]
    data = np.frombuffer(b"".join(w.to_bytes(8, "little") for w in words), np.uint8).reshape(-1, 8)
    frames = UserCan(user, ProtocolPlan(CAN, 2e3, user).decoder().counts).push(
        same_kind(0x210, data, fd=False), 0
    )
    np.testing.assert_array_equal(frames[0].counts[:, 0], counts)
    assert frames[0].t_us.tolist()[:3] == [0, 500, 1000]


PAGED = """VERSION ""
BU_: W
BO_ 530 WHEEL: 32 W
 SG_ page M : 0|8@1+ (1,0) [0|0] "" W
 SG_ g1 m1 : 8|32@1- (2,10) [0|0] "ustrain" W
 SG_ g2 m1 : 40|32@1- (2,10) [0|0] "ustrain" W
 SG_ g3 m1 : 72|32@1- (2,10) [0|0] "ustrain" W
 SG_ g4 m1 : 104|32@1- (2,10) [0|0] "ustrain" W
 SG_ g5 m1 : 143|32@0- (2,10) [0|0] "ustrain" W
 SG_ count m1 : 168|16@1+ (1,0) [0|0] "" W
 SG_ v m2 : 8|64@1- (1,0) [0|0] "km/h" W
 SG_ other : 184|8@1+ (1,0) [0|0] "" W
SIG_VALTYPE_ 530 g1 : 1;
SIG_VALTYPE_ 530 g2 : 1;
SIG_VALTYPE_ 530 g3 : 1;
SIG_VALTYPE_ 530 g4 : 1;
SIG_VALTYPE_ 530 g5 : 1;
SIG_VALTYPE_ 530 v : 2;
"""
PAGED_MAP = """
format = "tirebench-map/1"
dbc = "wheel.dbc"
rate_hz = 1000
strain_unit = "ustrain"
[[wheel]]
wheel = 0
message = "WHEEL"
samples = [["g1", "g2", "g3", "g4", "g5"]]
counter = "count"
[speed]
message = "WHEEL"
signal = "v"
unit = "km/h"
"""


def test_multiplexed_and_real_signals_are_read_as_cantools_wrote_them() -> None:
    """Strain on one page of a message, the speed on another; counted apart."""
    user = parse_map(PAGED_MAP, PAGED, "m.toml")
    message = cantools.database.load_string(PAGED, "dbc").get_message_by_name("WHEEL")
    rng = np.random.default_rng(1)
    sent = rng.normal(scale=500.0, size=(40, 5)).astype(np.float32).astype(float)
    rows = []
    for i, row in enumerate(sent):
        gages = {f"g{g + 1}": 2.0 * row[g] + 10.0 for g in range(5)}
        rows.append(message.encode({"page": 1, **gages, "count": i, "other": 0}))
        if i % 10 == 0:
            rows.append(message.encode({"page": 2, "v": 36.0 + i, "other": 7}))
    batch = same_kind(530, np.frombuffer(b"".join(rows), np.uint8).reshape(-1, 32), fd=True)
    plan = ProtocolPlan(CAN, 1e3, user)
    speeds = Speeds()
    wheels = Wheels.of_one(plan.decoder(), {None: plan.device})
    estimation = Estimation(lambda _: speeds, Conditions.constant(5.0))
    blocks = wheels.push(pack(batch), 10**6)
    estimation.take(blocks)
    estimation.finish()
    strain = np.concatenate([b.content.strain for b in blocks if hasattr(b.content, "strain")])
    np.testing.assert_allclose(1e6 * strain, 2.0 * sent + 10.0, rtol=1e-12)
    assert wheels.counts[1].gaps == 0
    assert wheels.counts[0].ok == len(batch)
    told = [5.0] + [(36.0 + 10 * (i // 10)) / 3.6 for i in range(39)]
    np.testing.assert_allclose(speeds.seen, told, rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('counter = "count"', 'counter = "other"'), "must be in the same frames"),
        (('strain_unit = "ustrain"', ""), "strain that is sent as float"),
        (('"g5"]]', '"count"]]'), "all gages must have the same length, sign and factor"),
        (('counter = "count"', 'counter = "g1"'), "counter and time must be integers"),
    ],
)
def test_a_wrong_map_of_pages_says_what_is_wrong(change: tuple[str, str], message: str) -> None:
    with pytest.raises(DeviceError, match=message):
        parse_map(PAGED_MAP.replace(*change), PAGED, "m.toml")


class Speeds:
    """An estimator that notes the speed of every sample."""

    samples = 16

    def __init__(self) -> None:
        self.seen: list[float] = []

    def start(self, period: float) -> None:
        pass

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> Outputs | None:
        self.seen += [conditions[0]] * len(strain)
        return None


@pytest.mark.parametrize("reads", [1, 3, 50])
def test_a_speed_on_the_bus_holds_from_the_sample_after_it(reads: int) -> None:
    user = parse_map(MAP, DBC, "m.toml")
    strain = same_kind(529, frames_of(physical(100)), fd=True)
    speed = np.zeros((2, 8), np.uint8)
    speed[:, :2] = np.array([3600, 7200], "<u2").view(np.uint8).reshape(2, 2)
    told = same_kind(700, speed, fd=True)
    rows = np.arange(100)
    batch = joined(
        [
            strain.take(rows[:10]),
            told.take(rows[:1]),
            strain.take(rows[10:61]),
            told.take(rows[1:2]),
            strain.take(rows[61:]),
        ]
    )
    plan, speeds = ProtocolPlan(CAN, 1e3, user), Speeds()
    wheels = Wheels.of_one(plan.decoder(), {None: plan.device})
    estimation = Estimation(lambda _: speeds, Conditions.constant(5.0))
    for part in np.array_split(np.arange(102), reads):
        estimation.take(wheels.push(pack(batch.take(part)), 10**6 * int(part[-1])))
    estimation.finish()
    assert speeds.seen == [5.0] * 10 + [10.0] * 51 + [20.0] * 39


def test_what_is_held_is_bounded_and_the_newest_counts() -> None:
    held = Held(Conditions.constant(1.0, 2e5, 0.0))
    for i in range(1000):
        held.set_from_bus(1000 * i, Measured("speed", float(i)))
    assert held.at(999_500)[:3] == (999.0, 2e5, 0.0)
    assert held.next_change(998_500) == 999_000
    assert len(held._from_bus) < 300


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"tirebench-map/1"', '"x/1"'), "'x/1'; this program reads 'tirebench-map/1'"),
        (("rate_hz = 1000", "rate_hz = 1"), "rate_hz = 1; a rate of 153 .. 200000 Hz"),
        (('"g5"', '"g9"'), "signal = 'g9'; WHEEL_FL has the signals g1"),
        (('"WHEEL_FL"', '"FR"'), "message = 'FR'; the known messages are ABS, WHEEL_FL"),
        (('time = "stamp"', ""), "time_unit|wraps after 256"),
        (('"ms"', '"bar"'), "time_unit = 'bar'; a unit of time is needed"),
        (('strain_unit = "ustrain"', 'strain_unit = "N"'), "a unit of strain is needed"),
        (('unit = "km/h"', 'unit = "N"'), "a unit of speed is needed"),
        (("[speed]", "[sped]"), "unknown key sped"),
        (('unit = "km/h"', 'unit = "km/h"\nweel = 0'), "speed: unknown key weel; allowed keys are"),
        (('unit = "km/h"', 'unit = "km/h"\nhold_s = 0'), "hold_s = 0; a time above 0 s"),
        (('time = "stamp"', 'time = "stamp"\ncouter = "g1"'), "wheel 0: unknown key couter"),
        (("[speed]", "[[speed]]\nwheel = 300"), r"speed: wheel = 300; 0 \.\. 255 is needed"),
        (("rate_hz = 1000", "rate_hz = 1000\ncamber = 5"), r"camber = 5; a table \[camber\]"),
        (("[[wheel]]", "wheel = [1, 2]\n[other]"), r"wheel = \[1, 2\]; tables \[\[wheel\]\]"),
        (('[["g1", "g2", "g3", "g4", "g5"]]', "1.5"), r"samples = 1.5; one list per sample"),
    ],
)
def test_a_wrong_map_says_what_is_wrong(change: tuple[str, str], message: str) -> None:
    if change[0] == 'time = "stamp"':
        text = MAP.replace('counter = "count"', "").replace('time = "stamp"', "")
        message = "a counter or time signal is needed"
    else:
        text = MAP.replace(*change)
    with pytest.raises(DeviceError, match=message):
        parse_map(text, DBC, "m.toml")


def test_a_counter_that_wraps_too_soon_needs_a_time() -> None:
    with pytest.raises(
        DeviceError, match=r"it wraps after 8 ms; without a time signal at least 100 ms are needed"
    ):
        parse_map(LISTED.replace("length = 12", "length = 4"), "", "m.toml")
