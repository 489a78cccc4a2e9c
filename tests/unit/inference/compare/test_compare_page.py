"""The page stands alone and holds its data; JSON has its keys; Markdown has the words."""

import base64
import csv
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from tests.unit.inference.compare.compare_synthetic import bump, model_file, plan, waveforms
from tirelib.cli.common import plain
from tirelib.inference.compare.document import comparison_document
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.strain import Comparison, compare_strain
from tirelib.report.comparison import strain_parts, write_comparison

KEYS = {
    "format",
    "campaign",
    "model",
    "effects",
    "axes",
    "quantity",
    "unit",
    "verdict",
    "error",
    "p",
    "noise",
    "repeats",
    "residual_rms",
    "residual_rms_noise",
    "residual_rms_raw",
    "measured_rms",
    "error_unit",
    "delay_us",
    "delay_std_us",
    "floor",
    "floor_source",
    "smooth_floor",
    "smooth_share",
    "statements",
    "regions",
    "messages",
    "table",
    "set_points",
    "tracks",
    "gages",
    "curves",
    "runs",
    "ranked",
    "sources",
}


class Links(HTMLParser):
    """What a page loads, its downloads and the places of its figures."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.data: dict[str, str] = {}
        self.places: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        if "src" in given or tag == "link":
            self.loads.append(given.get("src", given.get("href", "")))
        if tag == "a" and "download" in given:
            self.data[given["download"]] = given["href"]
        elif tag == "a":
            assert given["href"].startswith("#")
        if given.get("class") == "plot":
            self.places.append(given["id"].removeprefix("plot-"))


@pytest.fixture(scope="module")
def found() -> Comparison:
    waves = waveforms(plant=bump(-0.1, 0.1, 3e-4, 3900.0))
    hostile = replace(waves.header, name="</script><b>x")
    return compare_strain(replace(waves, header=hostile), model_of(model_file()))


@pytest.fixture(scope="module")
def page(found: Comparison, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    files = write_comparison(found, tmp_path_factory.mktemp("page"))
    return tuple(file.read_text(encoding="utf-8") for file in files)


def test_the_page_loads_nothing_and_has_plotly_once(page: tuple[str, str]) -> None:
    html = page[0]
    links = Links(html)
    assert links.loads == []
    assert html.count("plotly.js v") == 1
    own = html[: html.index("plotly.js v")] + html[html.index("const figures") :]
    assert not re.search(r"https?://", own)
    assert "</script><b>x" not in html


def test_every_figure_has_a_place_and_its_data(page: tuple[str, str], found: Comparison) -> None:
    links = Links(page[0])
    start = page[0].index("const figures = ") + len("const figures = ")
    figures, _ = json.JSONDecoder().raw_decode(page[0][start:])
    names = [plot.name for part in strain_parts(found) for plot in part.plots]
    assert len(set(names)) == len(names)
    assert list(figures) == links.places == names
    assert set(links.data) == {f"{name}.csv" for name in names}
    for name, href in links.data.items():
        text = base64.b64decode(href.partition("base64,")[2]).decode()
        rows = list(csv.reader(io.StringIO(text)))
        assert len(rows) > 1, name
        assert {len(row) for row in rows} == {len(rows[0])}, name
        assert "[" in ",".join(rows[0]), name


def test_axes_have_titles_with_units_and_maps_are_symmetric(found: Comparison) -> None:
    for part in strain_parts(found):
        for plot in part.plots:
            layout = plot.figure.layout
            titles = [
                layout[key].title.text for key in layout if key.startswith(("xaxis", "yaxis"))
            ]
            assert any(title and "[" in title for title in titles), plot.name
            for trace in plot.figure.data:
                if trace.type == "heatmap":
                    assert trace.zmin == -trace.zmax
                    assert trace.zmax > 0


def test_the_map_of_a_tensile_model_is_red_in_the_contact(found: Comparison) -> None:
    """The plant makes the measurement more tensile: the model is blue, below zero."""
    plots = {plot.name: plot for part in strain_parts(found) for plot in part.plots}
    z = np.array(plots["heat-load"].figure.data[0].z)
    assert z[-1, 180] < -50.0
    assert abs(z[0, 180]) < 20.0
    downloaded = np.array(plots["heat-load"].rows, dtype=float)
    assert downloaded[180, 0] == pytest.approx(0.0)
    assert downloaded[180, -1] == pytest.approx(z[-1, 180], abs=0.01)


def test_json_has_its_keys_and_units(found: Comparison) -> None:
    document = json.loads(json.dumps(plain(comparison_document(found)), allow_nan=False))
    assert set(document) == KEYS
    assert document["format"] == "tirelib-comparison/1"
    assert document["axes"] == "iso"
    assert document["noise"] == pytest.approx(3.0, rel=0.3)
    errors = [run["error"] for run in document["runs"] if run["counted"]]
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(document["error"])
    assert document["residual_rms_noise"] == pytest.approx(
        document["residual_rms"] / document["noise"]
    )
    region = document["regions"][0]
    assert (region["by"], region["unit"], region["value"]) == ("load", "N", 3900.0)
    pressures = {round(row["value"], 6) for row in document["table"] if row["by"] == "pressure"}
    assert pressures == {1.9, 2.3}
    speeds = {round(row["value"], 6) for row in document["table"] if row["by"] == "speed"}
    assert speeds == {36.0, 90.0}
    assert [row["name"] for row in document["set_points"]] == ["load", "pressure", "gain", "angle"]
    assert [row["lateral_mm"] for row in document["gages"]] == [60.0, 30.0, 0.0, -30.0, -60.0]
    assert len(document["runs"]) == len(plan())


def test_unknown_noise_is_null_and_the_page_speaks_microstrain(tmp_path: Path) -> None:
    found = compare_strain(waveforms(plan()[:20]), model_of(model_file()))
    document = plain(comparison_document(found))
    assert document["noise"] is None
    assert document["error_unit"] == "ustrain"
    assert document["p"] is None
    assert document["verdict"] == "noise_unknown"
    html, words = write_comparison(found, tmp_path)
    assert "The noise is unknown" in html.read_text()
    assert "in microstrain" in words.read_text()
    assert "[noise]" not in json.dumps(
        [list(plot.columns) for part in strain_parts(found) for plot in part.plots]
    )


def test_one_condition_and_one_run_make_a_page(tmp_path: Path) -> None:
    found = compare_strain(waveforms([(4000.0, 2.1e5, 15.0)]), model_of(model_file()))
    html, _ = write_comparison(found, tmp_path)
    assert "one condition only" in html.read_text()


def test_markdown_holds_words_and_tables(page: tuple[str, str], found: Comparison) -> None:
    words = page[1]
    for sentence in found.sentences:
        assert f"- {sentence}" in words
    assert "| contact |" in words
    assert "Reissner" in words


def test_effects_are_in_the_sources(tmp_path: Path) -> None:
    extra = {"effects": [{"effect": "gage_drift", "strength": 0.01}]}
    found = compare_strain(waveforms(), model_of(replace(model_file(), extra=extra)))
    _, words = write_comparison(found, tmp_path)
    assert f"gage_drift: {found.model.used[0].effect.source}" in words.read_text()
    assert comparison_document(found)["effects"] == [{"effect": "gage_drift", "strength": 0.01}]
