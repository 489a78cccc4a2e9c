"""What a run prints while it runs, where no terminal draws a table."""

import io
import math
import time
from dataclasses import replace

from rich.console import Console

from tests.bench.in_process import FakeSource
from tests.bench.test_page import turn as made_turn
from tirebench.cli.live import Screen
from tirebench.estimator.estimation import News


def test_numbers_are_headed_and_what_is_not_valid_is_marked() -> None:
    console = Console(record=True, file=io.StringIO(), width=300)
    turn = made_turn(1)
    turn = replace(turn, outputs={**turn.outputs, "Fz": 4000.0, "Fz_std": 25.0, "Fy_valid": 0.0})
    with Screen(console, FakeSource(0)) as screen:
        screen.watch(News([turn]))
    legend, heading, row = console.export_text().splitlines()
    assert legend == "± std: one standard deviation; ?: this quantity is not valid"
    assert "Fz [N] ± std" in heading
    assert "alpha [deg] ± std" in heading
    assert "4000 ± 25 " in row
    assert row.count("?") == 1
    assert not math.isnan(turn.outputs["Fy"])


def test_a_port_that_goes_away_and_comes_back_is_said() -> None:
    console, source = Console(record=True, file=io.StringIO(), width=300), FakeSource(0)
    with Screen(console, source, patience=60.0) as screen:
        screen.watch(News())
        source.lost = time.time() - 1.0
        for _ in range(3):
            screen.watch(News())
        source.lost = None
        for _ in range(3):
            screen.watch(News())
    said = console.export_text().splitlines()[2:]
    assert said[0] == "port lost, tried again for 60 s"
    assert said[1].startswith("back after ")
    assert len(said) == 2
