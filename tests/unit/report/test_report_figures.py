"""Every figure names its quantities and units, shows finite data, and hides nothing."""

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pages.cutoff_study import nearest_runs, study_cut_off
from pages.figures.camber import figure_4_16
from pages.figures.contact import contact_area, figure_4_2
from pages.figures.cutoff import figure_cut_off
from pages.figures.live import LastTurn, Strip, figure_live
from pages.figures.slip_ratio import figure_4_17, figure_4_18
from pages.figures.strain import figure_3_7, figure_4_1
from pages.turns import TypicalTurns, typical_turns

from tests.unit.report.conftest import World
from tirelib.core.errors import CalibrationError
from tirelib.estimators.cornering import CorneringTrend
from tirelib.report import figures
from tirelib.report.accuracy import QUANTITIES
from tirelib.report.figures.cornering import bend_factor


def trend(world: World) -> CorneringTrend:
    assert world.trained.cornering is not None
    return world.trained.cornering


def turns(world: World, name: str, count: int) -> TypicalTurns:
    campaign = world.campaigns[name]
    plans = campaign.plans[:count]
    return typical_turns(campaign, plans, [f"run {plan.run}" for plan in plans])


def live(world: World) -> Figure:
    """Two runs of four turns; the first turn of each has no estimate."""
    rng = np.random.default_rng(5)
    known = np.where(np.arange(8) % 4 == 0, np.nan, 1.0)
    strip = Strip(
        time=0.1 * np.arange(8),
        run=np.repeat([3, 7], 4),
        value={name: known * rng.normal(3.0, 0.1, 8) for name in QUANTITIES},
        std=dict.fromkeys(QUANTITIES, known * 0.1),
        truth={name: np.full(8, 3.0) for name in QUANTITIES},
    )
    trace = turns(world, "set1", 1).trace
    return figure_live(LastTurn(7, trace.phi, trace.strain[0], trace.lateral), strip)


DRAW: dict[str, Callable[[World], Figure]] = {
    "3_7": lambda w: figure_3_7(turns(w, "set1", 3)),
    "4_1": lambda w: figure_4_1(turns(w, "set1", 1)),
    "4_2": lambda w: figure_4_2(w.observations["set1"], w.estimates["set1"]),
    "4_3": lambda w: figures.figure_4_3(w.trained.means),
    "4_4": lambda w: figures.figure_4_4(w.trained),
    "4_5": lambda w: figures.figure_4_5(w.trained),
    "4_7": lambda w: figures.figure_4_7(w.trained),
    "4_8": lambda w: figures.figure_4_8(w.observations["set1"], w.estimates["set1"]),
    "4_12": lambda w: figures.figure_4_12(w.trained),
    "4_14": lambda w: figures.figure_4_14(w.trained),
    "4_16": lambda w: figure_4_16(w.trained.means),
    "4_17": lambda w: figure_4_17(
        turns(w, "brake_drive", 3), w.observations["brake_drive"], w.calibration.rolling
    ),
    "4_18": lambda w: figure_4_18(w.observations["brake_drive"], w.estimates["brake_drive"]),
    "4_20": lambda w: figures.figure_4_20(w.trained.means, trend(w)),
    "4_23": lambda w: figures.figure_4_23(trend(w)),
    "accuracy": lambda w: figures.figure_accuracy(w.observations["set1"], w.estimates["set1"]),
    "residuals": lambda w: figures.figure_residuals(w.trained, "alpha"),
    "live": live,
    "cut_off": lambda w: figure_cut_off(
        study_cut_off(w.campaigns["set3"], nearest_runs(w.campaigns["set3"]))
    ),
}
SIGNLESS = {"3_7", "4_4", "4_23", "cut_off"}
"""Figures of quantities whose sign does not depend on an axis system."""
UNIT = re.compile(r"\[[^\]]+\]")


@pytest.fixture(scope="module")
def drawn(world: World) -> dict[str, Figure]:
    made = {name: draw(world) for name, draw in DRAW.items()}
    for figure in made.values():
        figure.draw_without_rendering()
    return made


def with_data(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.has_data()]


def label_of(axes: Axes, which: str) -> str:
    """An axis' own label, or that of the axes or figure it shares it with."""
    get = f"get_{which}label"
    shared = getattr(axes, f"get_shared_{which}_axes")().get_siblings(axes)
    figure = axes.get_figure(root=True)
    assert figure is not None
    whole = getattr(figure, f"get_sup{which}label")()
    return "".join([getattr(axes, get)(), *(getattr(other, get)() for other in shared), whole])


@pytest.mark.parametrize("name", DRAW)
def test_every_axis_names_its_quantity_and_unit(drawn: dict[str, Figure], name: str) -> None:
    assert with_data(drawn[name])
    for axes in with_data(drawn[name]):
        for which in "xy":
            text = label_of(axes, which)
            assert UNIT.search(text), f"{which} axis of {axes.get_title(loc='left')!r}: {text!r}"


@pytest.mark.parametrize("name", sorted(set(DRAW) - SIGNLESS))
def test_a_figure_with_signs_names_the_axis_system(drawn: dict[str, Figure], name: str) -> None:
    texts = [label_of(axes, which) for axes in with_data(drawn[name]) for which in "xy"]
    assert any("ISO 8855" in text for text in texts)


@pytest.mark.parametrize("name", DRAW)
def test_all_drawn_data_are_finite(drawn: dict[str, Figure], name: str) -> None:
    points = 0
    for axes in with_data(drawn[name]):
        for collection in axes.collections:
            offsets = np.asarray(collection.get_offsets(), dtype=np.float64)
            assert np.isfinite(offsets).all()
            points += len(offsets)
        for line in axes.lines:
            known = np.isfinite(np.asarray(line.get_xydata(), dtype=np.float64)).all(axis=1)
            assert known.any() or line.get_xydata().size == 0  # a trace ends before its grid
            points += int(known.sum())
    assert points >= 10


@pytest.mark.parametrize("name", DRAW)
def test_legend_entries_are_distinct_and_stand_clear_of_the_data(
    drawn: dict[str, Figure], name: str
) -> None:
    figure = drawn[name]
    legends = [*figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend())]
    assert len(legends) == 1
    texts = [text.get_text() for text in legends[0].get_texts()]
    assert all(texts)
    assert len(set(texts)) == len(texts)
    frame = legends[0].get_window_extent()
    for axes in with_data(figure):
        assert not frame.overlaps(axes.get_window_extent())


@pytest.mark.parametrize("name", DRAW)
def test_nothing_leaves_the_figure_and_titles_do_not_meet(
    drawn: dict[str, Figure], name: str
) -> None:
    figure = drawn[name]
    renderer = figure.canvas.get_renderer()
    page = figure.bbox.padded(1.0)
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert page.x0 <= box.x0
        assert box.x1 <= page.x1
    boxes = []
    for axes in figure.axes:
        title = axes._left_title
        if title.get_text():
            boxes.append(title.get_window_extent(renderer))
    for i, box in enumerate(boxes):
        assert page.x0 <= box.x0
        assert box.x1 <= page.x1, figure.axes[i].get_title(loc="left")
        for other in boxes[i + 1 :]:
            assert not box.overlaps(other)


def dots(axes: Axes) -> np.ndarray:
    """Return the points of an axes' scatters, (n, 2)."""
    return np.concatenate([np.asarray(part.get_offsets()) for part in axes.collections])


def test_a_residual_is_what_was_measured_less_what_the_fit_says(drawn: dict[str, Figure]) -> None:
    over, residuals = (dots(axes) for axes in drawn["4_4"].axes[:2])
    assert "measured \N{MINUS SIGN} estimated" in drawn["4_4"].axes[1].get_ylabel()
    np.testing.assert_allclose(residuals.sum(axis=1), over[:, 1], rtol=1e-9)


def test_lateral_forces_are_drawn_up_to_the_angles_of_the_dissertations_table(
    world: World,
) -> None:
    links = world.trained.links
    angle = 2.0 * links.truth["slip_angle"]
    wider = replace(links, truth={**links.truth, "slip_angle": angle})
    own = dots(figures.figure_4_12(replace(world.trained, links=wider)).axes[1])
    assert 0 < len(own) == np.count_nonzero(np.abs(np.rad2deg(angle)) <= 5.5) < angle.size


def test_figures_do_not_need_pyplot() -> None:
    code = "import sys, tirelib.report.figures; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_drawing_leaves_the_settings_of_the_caller_alone(world: World) -> None:
    import matplotlib as mpl

    before = {name: mpl.rcParams[name] for name in mpl.rcParams}
    figures.figure_4_3(world.trained.means)
    assert {name: mpl.rcParams[name] for name in mpl.rcParams} == before


def test_a_figure_without_its_data_says_what_it_needs(world: World) -> None:
    from dataclasses import replace

    bare = replace(world.trained, regressions=())
    for draw in (figures.figure_4_4, figures.figure_4_7, figures.figure_4_12, figures.figure_4_14):
        with pytest.raises(CalibrationError, match="needs"):
            draw(bare)


def test_contact_area_of_a_rectangle_is_length_times_width() -> None:
    lateral = np.array([60.0, 30.0, 0.0, -30.0, -60.0])
    assert contact_area(lateral, np.full(5, 100.0)) == pytest.approx(12000.0)


def test_bend_factor_is_found_again() -> None:
    from tirelib.estimators.cornering import magic_formula

    angle = np.linspace(-8.0, 8.0, 17)
    force = magic_formula(angle, 900.0, 4000.0, -1.5)
    assert bend_factor(angle, force, 900.0, 4000.0) == pytest.approx(-1.5, abs=1e-3)
