"""Serial lines of other makes, by a map: sync word and struct, or columns of text."""

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from crccheck.crc import Crc16Modbus
from hypothesis import given, settings
from hypothesis import strategies as st
from pythonfmu import FmuBuilder

from tests.bench.campaigns import tiny_runs
from tests.bench.conftest import TOY
from tirebench.cli.run_inputs import RunInputs
from tirebench.errors import DeviceError
from tirebench.estimator.estimation import Estimation
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.links.opening import PortPlan
from tirebench.protocols import LINE_MAP
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.user_map import parse_map
from tirebench.recording.document import turn_document
from tirebench.setup.source_plan import SourcePlan, protocol_of, wheels_of
from tirebench.wire.conditions import Conditions, Measured
from tirebench.wire.device import Device
from tirebench.wire.frames import Frames
from tirebench.wire.timeline import Samples

BINARY = """
format = "tirebench-map/1"
rate_hz = 1000
strain_unit = "ustrain"
[[wheel]]
wheel = 2
message = "W"
samples = [["g1", "g2", "g3", "g4", "g5"]]
counter = "count"
time = "stamp"
time_unit = "us"
[pressure]
message = "W"
signal = "p"
unit = "bar"
[[message]]
name = "W"
sync = "AA55"
struct = "<HxI5hB"
fields = ["count", "stamp", { name = "g1", factor = 0.5 }, { name = "g2", factor = 0.5 },
          { name = "g3", factor = 0.5 }, { name = "g4", factor = 0.5 },
          { name = "g5", factor = 0.5 }, { name = "p", factor = 0.02 }]
checksum = "CRC-16/MODBUS"
checksum_from = "fields"
"""
TEXT = """
format = "tirebench-map/1"
rate_hz = 1000
strain_unit = "ustrain"
[[wheel]]
wheel = 2
message = "W"
samples = [["g1", "g2", "g3", "g4", "g5"]]
counter = "count"
[speed]
message = "V"
signal = "v"
unit = "km/h"
[[camber]]
wheel = 2
message = "V"
signal = "tilt"
unit = "deg"
[[message]]
name = "W"
starts = "$W"
separator = ";"
columns = [{ name = "count", bits = 16 }, "g1", "g2", "g3", "g4", "g5"]
checksum = "XOR-8"
[[message]]
name = "V"
starts = "$V"
separator = " "
columns = ["v", "", "tilt"]
"""
GAGES = np.random.default_rng(3).integers(-4000, 4000, (400, 5))


DOCS = Path(__file__).parents[2] / "docs" / "reference" / "protocols.md"


def binary(count: int = len(GAGES), sync: bytes = b"\xaa\x55") -> list[bytes]:
    """Frames of ascending number; some hold the sync word among their data."""
    frames = []
    for number in range(count):
        gages = [0x55AA if number % 7 == 3 else int(x) for x in GAGES[number]]
        body = struct.pack("<HxI5hB", number, 1000 * number, *gages, 115)
        frames.append(sync + body + struct.pack("<H", Crc16Modbus.calc(body)))
    return frames


def text(count: int = len(GAGES)) -> list[bytes]:
    lines = []
    for number in range(count):
        body = ";".join(["W", str(number), *(f"{x / 2:.1f}" for x in GAGES[number])])
        checksum = 0
        for letter in body.encode():
            checksum ^= letter
        lines.append(f"${body}*{checksum:02X}\r\n".encode())
        if number % 100 == 50:
            lines.append(f"$V  {number}.5 7 -1.5\n".encode())
    return lines


def plan_of(map_text: str) -> ProtocolPlan:
    return ProtocolPlan(LINE_MAP, 1e3, parse_map(map_text, "", "m.toml"))


def decoded(map_text: str, pieces: list[bytes]) -> tuple[list[Frames | Measured], ProtocolPlan]:
    decoder = plan_of(map_text).decoder()
    return [item for piece in pieces for item in decoder.push(piece)], plan_of(map_text)


def strain_of(map_text: str, pieces: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the frames that came, and their strain in microstrain."""
    items, plan = decoded(map_text, pieces)
    frames = [item for item in items if isinstance(item, Frames)]
    numbers = np.concatenate([f.seq for f in frames])
    strain = np.concatenate([plan.device.strain(f.counts, f.flags)[0] for f in frames])
    return numbers, 1e6 * strain


@pytest.mark.parametrize(("map_text", "wire"), [(BINARY, binary()), (TEXT, text())])
@pytest.mark.parametrize("size", [1, 13, 10**6])
def test_frames_come_however_the_line_is_cut_into_reads(
    map_text: str, wire: list[bytes], size: int
) -> None:
    line = b"".join(wire)
    numbers, strain = strain_of(map_text, [line[i : i + size] for i in range(0, len(line), size)])
    np.testing.assert_array_equal(numbers, np.arange(400))
    plain = np.arange(400) % 7 != 3
    np.testing.assert_allclose(strain[plain], GAGES[plain] / 2.0, atol=1e-9)


def test_conditions_stand_between_the_frames_of_strain() -> None:
    items, _ = decoded(TEXT, [b"".join(text(120))])
    kinds = ["strain" if isinstance(item, Frames) else item.name for item in items]
    assert kinds == ["strain", "speed", "camber", "strain"]
    speed, camber = items[1], items[2]
    assert speed == Measured("speed", pytest.approx(50.5 / 3.6), hold=1.0)
    assert camber == Measured("camber", pytest.approx(np.radians(-1.5)), 2, hold=1.0)
    told = [item for item in decoded(BINARY, binary(9))[0] if isinstance(item, Measured)]
    assert [one.value for one in told] == pytest.approx([2.3e5] * 9)


@settings(max_examples=30)
@given(
    seed=st.integers(0, 2**31),
    kind=st.sampled_from(["flip", "cut", "insert"]),
    size=st.integers(1, 60),
)
def test_a_damage_costs_one_frame_and_invents_none(seed: int, kind: str, size: int) -> None:
    rng = np.random.default_rng(seed)
    wire, struck = binary(30), int(rng.integers(5, 25))
    frame, place = bytearray(wire[struck]), int(rng.integers(0, len(wire[struck])))
    if kind == "flip":
        frame[place] ^= 1 << int(rng.integers(0, 8))
    elif kind == "cut":
        del frame[place : place + int(rng.integers(1, 9))]
    else:
        frame[place:place] = rng.bytes(int(rng.integers(1, 40)))
    wire[struck] = bytes(frame)
    line = b"".join(wire)
    numbers, strain = strain_of(BINARY, [line[i : i + size] for i in range(0, len(line), size)])
    assert set(range(30)) - set(numbers.tolist()) <= {struck}
    plain = numbers % 7 != 3
    np.testing.assert_allclose(strain[plain], GAGES[numbers[plain]] / 2.0, atol=1e-9)


def test_without_a_checksum_a_frame_counts_where_another_follows() -> None:
    bare = BINARY.replace('checksum = "CRC-16/MODBUS"\nchecksum_from = "fields"\n', "")
    wire = [frame[:-2] for frame in binary(50)]
    wire[20] = wire[20][:9]  # cut off: the next frame must not fill it up
    numbers, _ = strain_of(bare, wire)
    assert numbers.tolist() == [n for n in range(49) if n != 20]


@pytest.mark.parametrize(
    ("line", "counter"),
    [
        (b"$W;1;2;3;4;5;6*00\n", "crc"),
        (b"$V 1 2\n", "framing"),
        (b"$V 1 x 3\n", "framing"),
        (b"$V 1_0 2 3\n", "framing"),
        (b"$V inf 2 3\n", "framing"),
        (b"\xff\xfe\n", "framing"),
        (b"$X 1 2 3\n", "unknown"),
        (b"W;1;2;3;4;5;6\n", "unknown"),
        (b"$W;1;2;3;4;5;6\n", "crc"),
        (b"x" * 5000 + b"\n", "framing"),
    ],
)
def test_a_wrong_line_is_counted_and_left_out(line: bytes, counter: str) -> None:
    decoder = plan_of(TEXT).decoder()
    decoder.push(text(1)[0])
    assert decoder.push(line) == []
    counts = decoder.counts
    assert (counts.ok, counts.bad + counts.unknown) == (1, 1)
    assert getattr(counts, counter) == 1
    assert len(decoder.push(text(2)[1])) == 1


def test_joined_in_the_middle_nothing_is_damage() -> None:
    for map_text, wire in ((BINARY, binary(5)), (TEXT, text(5))):
        decoder = plan_of(map_text).decoder()
        decoder.push(wire[0][7:])
        decoder.push(b"".join(wire[1:]))
        assert (decoder.counts.ok, decoder.counts.bad) == (4, 0)
        decoder.push(wire[0][:9])
        decoder.interrupt()
        decoder.push(b"".join(wire[1:]))
        assert (decoder.counts.ok, decoder.counts.bad) == (8, 0)


def test_a_gage_that_is_not_there_is_unknown() -> None:
    four = BINARY.replace('"g4", "g5"]]', '"g4", ""]]')
    plan = plan_of(four)
    wheels = wheels_of([SourcePlan(PortPlan("p"), plan)])
    blocks = wheels.push(b"".join(binary(100)), 1)
    strain = np.concatenate([b.content.strain for b in blocks if isinstance(b.content, Samples)])
    assert list(wheels.heard) == [2]
    assert np.isnan(strain[:, 4]).all()
    np.testing.assert_allclose(1e6 * strain[0, :4], GAGES[0, :4] / 2.0)


@pytest.mark.parametrize(
    ("map_text", "change", "message"),
    [
        (BINARY, ('"AA55"', '"AA5"'), "sync, struct and fields .* are needed"),
        (BINARY, ('"<HxI5hB"', '"HxI5hB"'), "struct must begin with < or >"),
        (BINARY, ('"<HxI5hB"', '"<HxI5h4sB"'), "struct may use x b B"),
        (BINARY, ('"<HxI5hB"', '"<HxI5h"'), "struct has 7 values, but fields has more"),
        (BINARY, ("CRC-16/MODBUS", "CRC-17"), "checksum = 'CRC-17' is unknown; SUM-8"),
        (BINARY, ('"AA55"', '"AA55"\nlength = 3'), "unknown key length"),
        (TEXT, ("bits = 16", "bits = 40"), "bits must be 1 .. 32"),
        (
            TEXT,
            ('{ name = "count", bits = 16 }', '"count"'),
            "must be integers.*the column's bits",
        ),
        (TEXT, ('separator = ";"', 'separator = "; "'), "separator must be one ASCII character"),
        (TEXT, ('starts = "$V"', "id = 3"), "unknown key id"),
        (BINARY, ('["g1", "g2", "g3", "g4", "g5"]', '["", "", "", "", ""]'), "at least one"),
    ],
)
def test_a_wrong_map_of_a_line_says_what_is_wrong(
    map_text: str, change: tuple[str, str], message: str
) -> None:
    changed = map_text.replace(*change)
    assert changed != map_text
    with pytest.raises(DeviceError, match=message):
        parse_map(changed, "", "m.toml")


def test_a_map_fits_its_kind_of_port_and_comes_back_from_a_header(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(BINARY)
    with pytest.raises(
        DeviceError,
        match="this map describes a serial line, which needs a port PORT, tcp:// or udp://",
    ):
        protocol_of(PortPlan("can:socketcan:can0"), 1e3, tmp_path / "m.toml")
    plan = protocol_of(PortPlan("tcp://a:1"), 1e3, tmp_path / "m.toml")
    assert plan.encoding == LINE_MAP
    again = ProtocolPlan.of_header(plan.as_header(), "a.mcap")
    assert again.user_map == plan.user_map


THREE = """
format = "tirebench-map/1"
rate_hz = 10000
strain_unit = "ustrain"
[[wheel]]
wheel = 1
message = "W"
samples = [["left", "centre", "right"]]
counter = "count"
[[message]]
name = "W"
columns = [{ name = "count", bits = 16 }, "left", "centre", "right"]
"""


@pytest.fixture(scope="module")
def toy_of_three(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the toy for three gages."""
    folder = tmp_path_factory.mktemp("three")
    text = (
        TOY.read_text().replace("range(1, 6)", "range(1, 4)").replace("n[-1]) == 3", "n[-1]) == 2")
    )
    script = folder / "toy_slave_three.py"
    script.write_text(text.replace("ToyTire", "ToyThree"))
    FmuBuilder.build_FMU(script, dest=folder)
    return folder / "ToyThree.fmu"


def test_three_gages_where_the_estimator_has_three(toy_of_three: Path) -> None:
    strain = 1e6 * np.asarray(tiny_runs()[0].strain)[1:4].T
    lines = [
        f"{number},{row[0]:.3f},{row[1]:.3f},{row[2]:.3f}\n".encode()
        for number, row in enumerate(strain)
        if number not in range(3000, 3010)
    ]
    source = SourcePlan(PortPlan("p"), plan_of(THREE))
    with FmuFile(read_fmu(toy_of_three)) as file, FmuModel(file) as model:
        assert (file.samples, file.gages) == (16, 3)
        wheels = wheels_of([source])
        estimation = Estimation(lambda _: model, Conditions.constant(18.0))
        reads = [b"".join(lines[i] for i in part) for part in np.array_split(range(len(lines)), 9)]
        turns = [turn for read in reads for turn in estimation.take(wheels.push(read)).turns]
    assert len(turns) >= 4
    assert all(turn.saturated == (0, 0, 0) for turn in turns)
    assert [turn.outputs["Fy"] for turn in turns].count(10.0) == 1  # the toy counts what is lost
    assert {"contact_length_3_mm"} < turn_document(turns[0]).keys()
    assert "contact_length_4_mm" not in turn_document(turns[0])


def test_wheels_with_other_gages_than_the_calibration_are_refused() -> None:
    given = RunInputs((SourcePlan(PortPlan("p"), plan_of(THREE)),), Conditions.constant(), ())
    given.check_layout((0.03, 0.0, -0.03), "X.fmu")
    with pytest.raises(
        DeviceError, match=r"X.fmu: its calibration has 5 gages, but this wheel sends 3"
    ):
        given.check_layout((0.06, 0.03, 0.0, -0.03, -0.06), "X.fmu")
    device = Device("wheel 1", zero=(1.0, 2.0, 3.0))
    with pytest.raises(
        DeviceError, match="'wheel 1' has zeros or gains for 3 gages, but the wheel sends 5"
    ):
        device.strain(np.zeros((1, 2, 5), np.int16), np.zeros(1, np.int64))


def test_the_text_line_of_the_handbook_is_read_with_its_map() -> None:
    (example,) = [
        block
        for block in re.findall(r"```toml\n(.*?)```", DOCS.read_text(), re.DOTALL)
        if "starts " in block
    ]
    (line,) = re.findall(r"# (\$W;.*)", example)
    source = SourcePlan(PortPlan("p"), plan_of(example))
    wheels = wheels_of([source])
    (block,) = wheels.push(f"{line}\r\n".encode(), 1)
    assert isinstance(block.content, Samples)
    np.testing.assert_allclose(
        1e6 * block.content.strain, [[1203.5, 1187.0, 1241.5, 1190.0, 998.0]]
    )
    assert wheels.heard[0].timeline.rate == 5000.0
    assert wheels.push(line.replace("998", "999").encode() + b"\n") == []  # its checksum is wrong
