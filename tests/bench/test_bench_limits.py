"""The proof of endurance fails where one figure is missed, and tells which."""

import io
from typing import Any

import pytest
from rich.console import Console


@pytest.fixture(scope="module")
def limits(build_programs: None) -> Any:
    import bench_limits

    return bench_limits


LINE = {
    "line": "serial, 1 wheel",
    "minutes": 10.0,
    "frames_sent": 9,
    "frames": 9,
    "unheard": 0,
    "lost": {"crc_bad": 0, "gaps": 0},
    "p50_ms": 6.0,
    "p99_ms": 9.0,
    "cpu_per_second": 0.4,
    "load_average": 1.0,
}
PLUG = {"cycles": 100, "back_p50_s": 0.01, "back_max_s": 1.9, "not_back": 0, "load_average": 1.0}
KILL = {
    "kills": [{"role": "run", "all_gone_s": 0.5}, {"role": "reader"}],
    "processes": ["reader"],
    "readable": {"a.mcap": True},
    "lost_max_s": 0.9,
    "back_max_s": 5.0,
    "not_back": 0,
    "load_average": 1.0,
}
SOUND: dict[str, dict[str, Any]] = {"serial, 1 wheel": LINE, "plug": PLUG, "kill": KILL}


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("serial, 1 wheel", {"lost": {"crc_bad": 1, "gaps": 0}}),
        ("serial, 1 wheel", {"frames": 8}),
        ("serial, 1 wheel", {"unheard": 1}),
        ("serial, 1 wheel", {"p99_ms": 20.0}),
        ("serial, 1 wheel", {"p99_ms": None}),
        ("serial, 1 wheel", {"cpu_per_second": 1.0}),
        ("plug", {"back_max_s": 2.1}),
        ("plug", {"not_back": 1}),
        ("kill", {"lost_max_s": 1.1}),
        ("kill", {"not_back": 1}),
        ("kill", {"readable": {"a.mcap": True, "b.mcap": False}}),
        ("kill", {"kills": [{"role": "run", "all_gone_s": None}]}),
    ],
)
def test_a_figure_that_is_missed_fails_its_part_alone(
    limits: Any, part: str, change: dict[str, Any]
) -> None:
    console = Console(file=io.StringIO(), width=120)
    assert limits.show(SOUND, set(SOUND), console)
    missed = {**SOUND, part: SOUND[part] | change}
    assert not limits.show(missed, {part}, console)
    assert limits.show(missed, set(SOUND) - {part}, console)
    assert [row for row in limits.rows(part, missed[part]) if not row.good]
    assert console.file.getvalue().count("BAD") == 2


def test_only_one_wheel_has_to_do_with_one_core(limits: Any) -> None:
    four = LINE | {"line": "slcan FD, 4 wheels", "cpu_per_second": 1.2}
    assert limits.show({"four": four}, {"four"}, Console(file=io.StringIO()))
