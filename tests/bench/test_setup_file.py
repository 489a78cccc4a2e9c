"""Sources of a run as options and setup files name them: what they fill in, what is refused."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.bench.sources import VEHICLE, serial, vehicle
from tirebench.cli import program
from tirebench.errors import DeviceError
from tirebench.links.opening import PortPlan
from tirebench.protocols import SLCAN
from tirebench.protocols.plan import ProtocolPlan
from tirebench.setup.setup_file import check_sources, read_setup
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.conditions import Conditions


@pytest.mark.parametrize(
    ("sources", "conditions", "message"),
    [
        ((serial("a"), serial("a")), None, "--port a: given twice"),
        ((serial("a", 1), serial("b", 1)), None, "wheel 1 comes from a and b"),
        (
            (vehicle("a"), vehicle("b")),
            None,
            "the same condition: speed from slcan:a, pressure of wheel 3 fr",
        ),
        (
            (serial("a"), vehicle("b")),
            Conditions.constant(18.0),
            "speed comes from slcan:b, and from",
        ),
    ],
)
def test_sources_that_contradict_each_other_are_refused(
    sources: tuple[SourcePlan, ...], conditions: Conditions | None, message: str
) -> None:
    with pytest.raises(DeviceError, match=message):
        check_sources(sources, conditions)
    check_sources((serial("a", 1), serial("b", 2), vehicle("c")), Conditions.constant(camber=0.1))


SETUP = """
format = "tirebench-setup/1"
[[source]]
port = "/dev/ttyUSB0"
wheel = 0
device = "left.toml"
[[source]]
port = "slcan:/dev/ttyACM0"
bitrate = 1000000
map = "vehicle.toml"
"""
DEVICE = 'format = "tirebench-device/1"\nname = "left"\n[scale]\nstrain_per_count = 1e-6\n'


def test_a_setup_lists_sources_and_the_options_fill_in(tmp_path: Path) -> None:
    (tmp_path / "left.toml").write_text(DEVICE)
    (tmp_path / "vehicle.toml").write_text(VEHICLE)
    (tmp_path / "s.toml").write_text(SETUP)
    usual = SourcePlan(PortPlan("", baud=1_000_000), ProtocolPlan(rate=5e3))
    left, bus = read_setup(tmp_path / "s.toml", usual)
    assert (left.port.port, left.port.baud, left.wheel) == ("/dev/ttyUSB0", 1_000_000, 0)
    assert left.devices[None].scale == 1e-6
    assert (bus.port.encoding, bus.port.bitrate, bus.wheel) == (SLCAN, 1_000_000, None)
    assert bus.protocol.user_map is not None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("tirebench-setup/1", "x/1"), "'x/1'; this program reads 'tirebench-setup/1'"),
        (("wheel = 0", "wheel = 300"), "source 1: wheel = 300; 0 .. 255"),
        (("bitrate = 1000000", 'bitrate = "fast"'), "source 2: bitrate = 'fast'; .* type int"),
        (("wheel = 0", "weel = 0"), "source 1: unknown key weel; allowed keys are port"),
        (('port = "/dev/ttyUSB0"', ""), "source 1: port is missing"),
        (("[[source]]", "[[sources]]"), "unknown key sources"),
        (('map = "vehicle.toml"', 'map = "none.toml"'), "source 2: .*none.toml: cannot be read"),
        (('"vehicle.toml"', '"left.toml"'), "s.toml: source 2: .*left.toml: .*'tirebench-map/1'"),
        (
            ('"left.toml"', '"vehicle.toml"'),
            "s.toml: source 1: .*vehicle.toml: .*tirebench-device/1",
        ),
        (("[[source]]", "[source]"), "cannot be read|tables"),
    ],
)
def test_a_wrong_setup_says_what_is_wrong(
    change: tuple[str, str], message: str, tmp_path: Path
) -> None:
    (tmp_path / "left.toml").write_text(DEVICE)
    (tmp_path / "vehicle.toml").write_text(VEHICLE)
    (tmp_path / "s.toml").write_text(SETUP.replace(*change))
    with pytest.raises(DeviceError, match=message):
        read_setup(tmp_path / "s.toml", serial(""))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--port", "1=/dev/a", "--port", "1=/dev/b"), "wheel 1 comes from /dev/a and /dev/b"),
        (("--port", "300=/dev/a"), r"--port 300=/dev/a: wheel 300; 0 \.\. 255 is allowed"),
        (
            ("--port", "/dev/a", "--device", "256=a.toml"),
            r"--device 256=a.toml: wheel 256; 0 \.\. 255",
        ),
    ],
)
def test_options_that_cannot_be_end_the_command(
    toy_fmus: dict[int, Path], words: tuple[str, ...], message: str
) -> None:
    outcome = CliRunner().invoke(program, ["run", *words, "--fmu", str(toy_fmus[16]), "--no-page"])
    assert isinstance(outcome.exception, DeviceError)
    assert re.search(message, str(outcome.exception))
