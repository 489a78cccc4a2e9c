"""Figures of the rolling ring: quantities and units, signs, finite data, nothing hidden."""

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from matplotlib.figure import Figure
from ring_figures import cases, contact, lateral, speed, static
from ring_figures import loads as over_load

from tests.unit.report.test_report_figures import UNIT, label_of, with_data
from tirelib.core.parameters import read_tire
from tirelib.report.figures import ring_panels
from tirelib.report.simulation import Simulation, simulate

A, B = (read_tire(name).tire for name in ("table-6-1", "table-6-2-195-65r15"))


@cache
def pressed(contact: str) -> Simulation:
    return cases.by_deflection(A, contact)


@cache
def loads() -> Simulation:
    return cases.by_load(B, "radial", 0.09, 18.0)


@cache
def inflations() -> Simulation:
    return cases.by_inflation(B)


@cache
def speeds() -> tuple[Simulation, ...]:
    return tuple(cases.by_speed(B, damping) for damping in cases.DAMPINGS)


@cache
def standing() -> cases.StaticRing:
    return cases.standing(A.changed(bending_stiffness=20.0), (1416.0, 5666.0))


DRAW: dict[str, Callable[[], Figure]] = {
    "5_10": lambda: static.figure_5_10(standing()),
    "5_22": lambda: static.figure_5_22(standing()),
    "5_24": lambda: static.figure_5_24(standing()),
    "6_7": lambda: contact.figure_6_7(pressed("radial"), inflations()),
    "6_9": lambda: contact.figure_6_9(pressed("shear"), pressed("radial")),
    "6_10": lambda: contact.figure_6_10(pressed("shear"), pressed("radial")),
    "6_12": lambda: contact.figure_6_12(pressed("shear"), pressed("radial")),
    "6_22": lambda: over_load.figure_6_22(loads()),
    "6_23": lambda: over_load.figure_6_23(inflations()),
    "6_24": lambda: over_load.figure_6_24(pressed("shear")),
    "6_26": lambda: over_load.figure_6_26(loads()),
    "6_28": lambda: over_load.figure_6_28(inflations()),
    "6_29": lambda: speed.figure_6_29(speeds()),
    "6_33": lambda: speed.figure_6_33(speeds()),
    "6_34": lambda: over_load.figure_6_34(loads()),
    "6_35": lambda: over_load.figure_6_35(inflations()),
    "6_36": lambda: over_load.figure_6_36(pressed("shear")),
    "6_40": lambda: lateral.figure_6_40(loads()),
    "simulation": lambda: ring_panels.figure_simulation(loads(), "Table 6-2"),
}
NO_ANGLE = {"6_33", "6_40"}
"""Figures over speed and over x."""
LINES = {"5_10": 4, "5_22": 4, "6_9": 12, "6_10": 6, "6_29": 36, "6_22": 6, "6_23": 8}
"""Curves that have an entry in the legend."""


@pytest.fixture(scope="module")
def drawn() -> dict[str, Figure]:
    made = {name: draw() for name, draw in DRAW.items()}
    for figure in made.values():
        figure.draw_without_rendering()
    return made


@pytest.mark.parametrize("name", DRAW)
def test_every_axis_names_its_quantity_and_unit(drawn: dict[str, Figure], name: str) -> None:
    assert with_data(drawn[name])
    for axes in with_data(drawn[name]):
        for which in "xy":
            assert UNIT.search(label_of(axes, which)), axes.get_title(loc="left")


@pytest.mark.parametrize("name", sorted(set(DRAW) - NO_ANGLE))
def test_every_wheel_angle_says_where_the_entry_is(drawn: dict[str, Figure], name: str) -> None:
    for axes in with_data(drawn[name]):
        text = label_of(axes, "x")
        assert "entry < 0 < exit" in text or "forward x" in text


@pytest.mark.parametrize("name", DRAW)
def test_all_drawn_data_are_finite(drawn: dict[str, Figure], name: str) -> None:
    for axes in with_data(drawn[name]):
        for line in axes.lines:
            assert np.isfinite(np.asarray(line.get_xydata(), dtype=np.float64)).all()


@pytest.mark.parametrize("name", LINES)
def test_every_operating_point_has_its_curve(drawn: dict[str, Figure], name: str) -> None:
    named = [
        line
        for axes in drawn[name].axes
        for line in axes.lines
        if not str(line.get_label()).startswith("_")
    ]
    assert len(named) == LINES[name]


@pytest.mark.parametrize("name", DRAW)
def test_the_legend_is_complete_distinct_and_clear_of_all_else(
    drawn: dict[str, Figure], name: str
) -> None:
    figure = drawn[name]
    renderer = figure.canvas.get_renderer()
    assert len(figure.legends) == 1
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(texts) >= 2
    assert len(set(texts)) == len(texts)
    frame = figure.legends[0].get_window_extent()
    page = figure.bbox.padded(1.0)
    assert page.x0 <= frame.x0
    assert frame.x1 <= page.x1
    for axes in figure.axes:
        assert not frame.overlaps(axes.get_tightbbox(renderer))


@pytest.mark.parametrize("name", DRAW)
def test_axes_with_their_labels_and_titles_do_not_meet(drawn: dict[str, Figure], name: str) -> None:
    figure = drawn[name]
    renderer = figure.canvas.get_renderer()
    # tight boxes carry up to two pixels of margin
    boxes = [axes.get_tightbbox(renderer).padded(-2.0) for axes in figure.axes]
    page = figure.bbox.padded(1.0)
    for i, box in enumerate(boxes):
        assert page.x0 <= box.x0
        assert box.x1 <= page.x1
        for other in boxes[i + 1 :]:
            assert not box.overlaps(other)


def test_a_traction_ends_on_the_axis_at_the_edges() -> None:
    done = pressed("radial")
    phi, q = ring_panels.curve(done, ring_panels.PRESSURE, 1)
    for edge in done.edges[1]:
        assert q[phi == edge] == [0.0]
    assert (np.diff(phi) >= 0.0).all()
    assert ring_panels.curve(done, ring_panels.STRAIN, 1)[0].size == done.phi.size


def test_labels_say_what_differs() -> None:
    both = simulate(A, load=4000.0, inflation=[1.2e5, 1.4e5])
    assert ring_panels.point_labels(both) == ["4000 N, 1.2 bar", "4000 N, 1.4 bar"]
    fast = simulate(A, load=4000.0, turn_rate=[0.0, 100.0 / 3.6 / 0.3])
    assert ring_panels.point_labels(fast) == ["4000 N, 0 km/h", "4000 N, 100 km/h"]
    twins = simulate(A, load=[4000.0, 4000.0])
    assert ring_panels.point_labels(twins) == ["4000 N (1)", "4000 N (2)"]
    near = simulate(A, load=[4000.0, 4000.2])
    assert len(set(ring_panels.point_labels(near))) == 2


def test_figures_do_not_need_pyplot() -> None:
    code = (
        "import sys; from ring_figures import contact, lateral, loads, speed, static; "
        "from tirelib.report.figures import ring_panels; "
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    build = Path(__file__).parents[3] / "build"
    assert subprocess.run([sys.executable, "-c", code], cwd=build, check=False).returncode == 0


def script() -> ModuleType:
    path = Path(__file__).parents[3] / "build/figures.py"
    spec = importlib.util.spec_from_file_location("figures_script", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_script_draws_every_figure_that_was_asked_for() -> None:
    names = [drawing.name for make in script().CHAPTERS.values() for drawing in make()]
    assert len(set(names)) == len(names)
    asked = {
        "5-10",
        "5-22",
        "5-24",
        "6-7",
        "6-9",
        "6-10",
        "6-12",
        "6-22",
        "6-23",
        "6-24",
        "6-26",
        "6-28",
        "6-29",
        "6-33",
        "6-34",
        "6-35",
        "6-36",
        "6-40",
    }
    assert asked <= set(names)
