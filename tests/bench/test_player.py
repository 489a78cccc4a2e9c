"""What an emulator plays arrives as it was, in every format; each fault does what it says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.campaigns import tiny_runs
from tirebench.emulator.emulator import Player, Tape, record_tape
from tirebench.emulator.faults import Faults, parse_faults
from tirebench.emulator.manoeuvre import Motion, Rig, nodes, read_manoeuvre, waveform
from tirebench.emulator.sources import manoeuvre_tape
from tirebench.errors import DeviceError
from tirebench.links.can_bus import packed
from tirebench.protocols import CAN, SERIAL, SLCAN
from tirebench.protocols.layouts import RAW12, RAW12C, RAW16
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.transmitter import transmitter
from tirebench.wire.can_batch import pack
from tirebench.wire.conditions import conditions_document, parse_conditions
from tirebench.wire.device import Device
from tirebench.wire.timeline import Samples, Timeline
from tirelib.rig.measure import MeasuringChain, gages
from tirelib.rig.ramp import Point
from tirelib.rig.tire import Condition, tire

COUNT = Device().scale


@pytest.fixture(scope="module")
def tape() -> Tape:
    """Two runs of two wheels, cut to 0.3 s."""
    runs = [
        replace(r, strain=np.asarray(r.strain)[:, :2880], trigger=None) for r in tiny_runs()[:2]
    ]
    return record_tape(runs, Device(), Faults({}), (0, 3))


def blocks_of(tape: Tape, kind: str, line: str, faults: Faults, wheel: int) -> list[Samples]:
    """Play everything to a decoder, arrivals and all."""
    plan = ProtocolPlan(line, 1e4)
    decoder, timeline = plan.decoder(), Timeline(Device(), wheel)
    blocks: list[Samples] = []
    for piece in Player(transmitter(kind), line, faults).pieces(tape):
        arrival = round(1e9 * (1.0 + piece.due[-1]))
        if line == CAN:
            batch = packed([m for frame in piece.frames for m in frame])
            decoded = decoder.push(pack(batch), arrival)
        else:
            decoded = decoder.push(b"".join(piece.frames), arrival)
        blocks += [block for frames in decoded for block in timeline.push(frames)]
    return blocks


LINES = [("serial", SERIAL), (RAW16, SLCAN), (RAW12, SLCAN), (RAW12C, SLCAN), (RAW16, CAN)]


@pytest.mark.parametrize(("kind", "line"), LINES)
@pytest.mark.parametrize("wheel", [0, 3])
def test_every_format_brings_every_sample(tape: Tape, kind: str, line: str, wheel: int) -> None:
    blocks = blocks_of(tape, kind, line, Faults({}), wheel)
    records = [record for record in tape.records if record.wheel == wheel]
    starts = [block for block in blocks if block.reset]
    assert [block.reset for block in starts] == ["start", "time_reset"]
    for number, record in enumerate(records):
        mine = [block for block in blocks if block.segment == number]
        seen = np.concatenate([block.strain for block in mine]) / COUNT
        step = 16.0 if kind in (RAW12, RAW12C) else 0.0
        assert seen.shape == record.counts.shape
        np.testing.assert_allclose(seen, record.counts, atol=0.5 * step + 1e-6)
        assert mine[0].t_us == record.start_us


def seen_with(tape: Tape, *texts: str, kind: str = RAW16) -> tuple[list[Samples], Faults]:
    faults = Faults(parse_faults(texts), seed=4)
    return blocks_of(tape, kind, SLCAN, faults, 0), faults


def test_a_fade_loses_what_was_sent_in_it_and_is_filled_with_nothing(tape: Tape) -> None:
    blocks, faults = seen_with(tape, "fades=10")
    lost = sum(int(block.lost.sum()) for block in blocks)
    assert faults.done["fades"] > 50
    assert 500 < lost < 6000
    for block in blocks:
        assert np.isnan(block.strain[block.lost]).all()


def test_lost_and_doubled_frames_cost_themselves(tape: Tape) -> None:
    blocks, faults = seen_with(tape, "lost=0.05", "dup=0.05")
    assert faults.done["lost"] > 20
    lost = sum(int(block.lost.sum()) for block in blocks)
    assert 3 * faults.done["lost"] * 0.5 < lost <= 6 * faults.done["lost"]


def test_a_restarted_device_begins_a_segment(tape: Tape) -> None:
    blocks, faults = seen_with(tape, "reset=0.2")
    assert faults.done["reset"] >= 2
    assert sum(bool(block.reset) for block in blocks) >= 3


def test_a_fast_clock_sends_sooner(tape: Tape) -> None:
    due = []
    for texts in ([], ["drift=5000"]):
        player = Player(transmitter("serial"), SERIAL, Faults(parse_faults(texts)))
        due.append([d for piece in player.pieces(tape) for d in piece.due])
    np.testing.assert_allclose(np.array(due[0]) / np.array(due[1]), 1.005)


def test_hum_is_sixty_hertz_of_the_size_that_was_asked_for() -> None:
    counts = np.zeros((10_000, 5), np.int16)
    struck, _ = Faults({"hum": 100.0}).gages(counts)
    spectrum = np.abs(np.fft.rfft(struck[:, 2] * COUNT)) / 5000
    assert int(np.argmax(spectrum)) == 60
    assert spectrum[60] == pytest.approx(1e-4, rel=1e-2)


@pytest.mark.parametrize("text", ["hum=-1", "drift=1e6", "reset=0", "fades=x", "flips=2"])
def test_a_size_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(DeviceError, match=rf"--fault {text}: .* is allowed; correct it"):
        parse_faults([text])


def test_the_sidecar_keeps_the_plan_and_the_campaign() -> None:
    from tirelib.campaign import CampaignHeader, TireGeometry

    header = CampaignHeader("x", "sae", TireGeometry("t", 0.31), (0.06, 0.03, 0.0, -0.03, -0.06))
    tape = record_tape(tiny_runs()[:1], Device(), Faults({}), (0,), header)
    text = json.dumps(conditions_document(tape.conditions))
    back = parse_conditions(json.loads(text), "x")
    assert back.campaign is not None
    assert back.campaign["axes"] == "iso"
    assert back.campaign["gages"]["lateral_m"][0] == pytest.approx(0.06)
    assert back.runs[0].plan["load"] == 3000.0


def test_conditions_end_with_the_strain_of_their_run() -> None:
    runs = [
        replace(run, rig_time=time, rig={"speed": np.full(8, 18.0)}, start_time=2.0)
        for run in tiny_runs()[:2]
        for time in [2.0 + 0.2 * np.arange(8.0)]  # 1.4 s, where the strain has 0.65 s
    ]
    conditions = record_tape(runs, Device(), Faults({}), (0,)).conditions
    parse_conditions(conditions_document(conditions), "x")  # refuses times that do not increase
    assert [t for t in conditions.t_us if t < conditions.runs[1].t_us] == [
        0,
        200_000,
        400_000,
        600_000,
    ]


MANOEUVRE = """
format = "tirebench-manoeuvre/1"
[[point]]
t_s = 0.0
load_N = 4000
speed_kmh = 60
[[point]]
t_s = 0.5
load_N = 5000
speed_kmh = 60
slip_angle_deg = 1.0
"""


def test_a_manoeuvre_is_solved_where_it_moves(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(MANOEUVRE)
    read = read_manoeuvre(tmp_path / "m.toml")
    path = nodes(read.of_wheel(2))
    assert [point.condition.load for point in path] == pytest.approx(
        [4000, 4333.3, 4666.7, 5000], abs=0.1
    )
    (tmp_path / "m.csv").write_text(
        "t_s,load_N,speed_kmh,slip_angle_deg,wheel\n0,4000,60,,\n0.5,5000,60,1,\n"
    )
    table = read_manoeuvre(tmp_path / "m.csv").of_wheel(0)
    assert table == read.of_wheel(0)


def test_each_solution_of_a_manoeuvre_is_told_while_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "m.toml").write_text(MANOEUVRE)
    solved = (np.zeros((3600, 5)), 50.0, {"Fz": 4000.0})
    monkeypatch.setattr(Rig, "_show", lambda rig, condition: solved)
    told: list[str] = []
    manoeuvre = read_manoeuvre(tmp_path / "m.toml")
    manoeuvre_tape(manoeuvre, Device(), Faults({}), (0, 3), rate=1e4, progress=told.append)
    assert told == [f"wheel {wheel}, {done} of 4" for wheel in (0, 3) for done in range(1, 5)]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("load_N = 4000", "", "point 1: load_N is missing"),
        ("load_N = 4000", "load_kN = 4", "unknown column load_kN; .*; write load_N, in that unit"),
        ("load_N = 4000", "load_N = 4.0", "point 1: load_N = 4.0; a number from 200 to 12000"),
        (
            "_deg = 1.0",
            "_deg = -40",
            "point 2: slip_angle_deg = -40; a number from -22.9183 to 22.9",
        ),
        (
            "_deg = 1.0",
            "_degree = 1.0",
            "unknown column slip_angle_degree; .*; write slip_angle_deg",
        ),
        ("_deg = 1.0", "_deg = nan", "point 2: slip_angle_deg = nan; a number from"),
        ("_deg = 1.0", "_deg = 1.0\nwheel = 0.5", "wheel = 0.5; a whole number is needed"),
        ("t_s = 0.5", "t_s = inf", "t_s = inf; a time in seconds is needed"),
        (
            "[[point]]\nt_s = 0.0\nload_N = 4000\nspeed_kmh = 60\n[[point]]",
            "[point]",
            r"point 1: 't_s'; a table is needed; begin each point with \[\[point",
        ),
        ("t_s = 0.5", "t_s = 0.0", "increasing from 0"),
        ("slip_angle_deg = 1.0", "slip_ratio = 0.1", "slip_ratio is given at some"),
        ('"tirebench-manoeuvre/1"', '"x"', "format = 'x'"),
        ("load_N = 5000", 'load_N = "much"', "point 2: .*much"),
    ],
)
def test_a_wrong_manoeuvre_says_what_is_wrong(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    (tmp_path / "m.toml").write_text(MANOEUVRE.replace(old, new))
    with pytest.raises(DeviceError, match=message):
        read_manoeuvre(tmp_path / "m.toml")


def test_each_fault_of_a_manoeuvre_is_told_once_and_nothing_that_is_right(tmp_path: Path) -> None:
    lines = ["t_s,load_kN,speed_kmh", "0,4,60", "1,4,60,9", "2,4,fast"]
    (tmp_path / "m.csv").write_text("\n".join(lines))
    with pytest.raises(DeviceError) as caught:
        read_manoeuvre(tmp_path / "m.csv")
    told = [line.partition("m.csv: ")[2] for line in str(caught.value).splitlines()]
    assert [line.partition(";")[0] for line in told] == [
        "point 1: unknown column load_kN",
        "point 1: load_N is missing",
        "point 2: the line has more values than the table has columns",
        "point 2: load_N is missing",
        "point 3: load_N is missing",
        "point 3: speed_kmh = fast",
    ]


def test_the_wheel_turns_at_the_speed_of_the_rig() -> None:
    """A gage that shows its own angle: turns are counted, and speed changes bend them evenly."""
    angle = np.linspace(-1.0, 1.0, 360, endpoint=False)
    strain = np.broadcast_to(1e-3 * np.cos(np.pi * angle)[:, None], (2, 360, 5))
    condition = Condition(4000.0, 2.3e5, 18.0)
    motion = Motion(
        np.array([0.0, 2.0]), np.array([40.0, 60.0]), strain, (condition, condition), {}
    )
    quiet = MeasuringChain(gage_noise=0.0)
    wave = waveform(motion, tire("reference"), 1e4, chain=quiet)
    sensors = gages(tire("reference"), quiet)
    time = np.arange(len(wave)) / 1e4
    phi = -np.pi + 40.0 * time + 5.0 * time**2
    np.testing.assert_allclose(
        wave, 1e-3 * np.cos(phi)[:, None] * sensors.gain + sensors.offset, atol=1e-7
    )


def test_strain_between_two_solutions_is_a_straight_line() -> None:
    strain = np.stack([np.full((36, 5), 1e-3), np.full((36, 5), 3e-3)])
    condition = Condition(4000.0, 2.3e5, 18.0)
    motion = Motion(
        np.array([0.0, 1.0]), np.array([50.0, 50.0]), strain, (condition, condition), {}
    )
    quiet = MeasuringChain(gage_noise=0.0, gage_gain=0.0, gage_offset=0.0)
    wave = waveform(motion, tire("reference"), 1e3, chain=quiet)
    np.testing.assert_allclose(wave[:, 0], np.linspace(1e-3, 3e-3, 1001), rtol=1e-12)
    assert isinstance(nodes([Point(0.0, condition), Point(1.0, condition)]), tuple)
