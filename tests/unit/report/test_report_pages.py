"""Pages hold the numbers they are given, stand alone, and let no name become markup."""

from dataclasses import dataclass, field, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from tests.unit.report.conftest import World
from tirelib.report.calibration import write_calibration_report
from tirelib.report.estimate import write_estimate_report
from tirelib.report.page import number
from tirelib.report.statistics import in_use_table, regression_tables

HOSTILE = "<script>alert('tire')</script>"
HELD_OUT = [
    {
        "held_out": "load",
        "level": "1500 N",
        "quantity": "Fz",
        "unit": "N",
        "dissertation": 123.4,
        "in_use": 56.78,
        "inside": False,
        "n": 7,
    },
    {
        "held_out": "slip_ratio",
        "level": HOSTILE,
        "quantity": "kappa",
        "unit": "1",
        "dissertation": None,
        "in_use": 0.00123,
    },
]


@dataclass
class Page(HTMLParser):
    """What a page links, and its cells."""

    file: Path
    links: list[str] = field(default_factory=list)
    images: list[str] = field(default_factory=list)
    tags: list[str] = field(default_factory=list)
    cells: list[str] = field(default_factory=list)
    text: str = ""
    _in_cell: bool = False

    def __post_init__(self) -> None:
        super().__init__()
        self.feed(self.file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        found = dict(attrs)
        for name in ("src", "href", "data", "action", "srcset"):
            if found.get(name):
                self.links.append(str(found[name]))
        if tag == "img":
            self.images.append(str(found["src"]))
            assert found.get("alt")
        if tag == "td":
            self._in_cell = True
            self.cells.append("")

    def handle_endtag(self, tag: str) -> None:
        if tag == "td":
            self._in_cell = False

    def handle_data(self, data: str) -> None:
        self.text += data
        if self._in_cell:
            self.cells[-1] += data


@pytest.fixture(scope="module")
def hostile(world: World) -> World:
    calibration = replace(world.calibration, tire=HOSTILE)
    links = replace(world.trained.links, refused={"kappa": f"no speed & {HOSTILE}"})
    return replace(world, trained=replace(world.trained, calibration=calibration, links=links))


@pytest.fixture(scope="module")
def calibration_page(
    hostile: World, tmp_path_factory: pytest.TempPathFactory, rough_figures: None
) -> Page:
    folder = tmp_path_factory.mktemp("pages") / "new" / "calibration"
    written = write_calibration_report(hostile.trained, folder, held_out=HELD_OUT)
    assert written == folder / "index.html"
    return Page(written)


@pytest.fixture(scope="module")
def estimate_page(
    hostile: World, tmp_path_factory: pytest.TempPathFactory, rough_figures: None
) -> Page:
    observations = hostile.observations["set1"]
    header = replace(observations.headers[0], name=HOSTILE)
    return Page(
        write_estimate_report(
            replace(observations, headers=(header,)),
            hostile.estimates["set1"],
            hostile.calibration,
            tmp_path_factory.mktemp("pages"),
        )
    )


@pytest.fixture(params=["calibration", "estimate"])
def page(request: pytest.FixtureRequest) -> Page:
    found: Page = request.getfixturevalue(f"{request.param}_page")
    return found


def test_a_hostile_name_stays_text(page: Page) -> None:
    assert "script" not in page.tags
    assert HOSTILE in page.text
    assert "<script>alert" not in page.file.read_text(encoding="utf-8")


def test_no_network_is_needed(page: Page) -> None:
    source = page.file.read_text(encoding="utf-8")
    for word in ("http:", "https:", "//cdn", "@import", "url("):
        assert word not in source
    assert "link" not in page.tags
    assert not any(link.startswith(("/", "\\")) for link in page.links)


def test_every_link_leads_somewhere(page: Page) -> None:
    assert page.images
    source = page.file.read_text(encoding="utf-8")
    for link in page.links:
        if link.startswith("#"):
            assert f'id="{link[1:]}"' in source
        else:
            target = page.file.parent / link
            assert target.is_file()
            assert target.stat().st_size > 500
    for image in page.images:
        assert (page.file.parent / image).read_bytes()[:4] == b"\x89PNG"


def test_the_page_names_its_axis_system_and_both_colour_schemes(page: Page) -> None:
    assert "ISO 8855" in page.text
    assert "prefers-color-scheme: dark" in page.file.read_text(encoding="utf-8")


def test_every_statistic_of_every_regression_is_there(
    hostile: World, calibration_page: Page
) -> None:
    cells = set(calibration_page.cells)
    for regression in hostile.trained.regressions:
        assert f"R\u00b2 = {100 * regression.r2:.2f} %" in calibration_page.text
        assert f"cross-validated = {number(regression.cross_validated)}" in calibration_page.text
        for term in regression.terms:
            assert term.name in cells
            assert number(term.coefficient, 5) in cells
            assert number(term.std_error, 3) in cells


def test_every_coefficient_in_use_is_there(hostile: World, calibration_page: Page) -> None:
    cells = set(calibration_page.cells)
    load = hostile.calibration.chains[-1].load
    assert load is not None
    for name, b, variance in zip(
        load.names(), load.coefficients, np.diag(load.covariance), strict=True
    ):
        assert name in cells
        assert number(float(b), 5) in cells
        assert number(float(np.sqrt(variance)), 3) in cells
    assert calibration_page.cells.count("in use") == 4  # one candidate of each quantity


def test_cross_validation_and_refusals_are_there(calibration_page: Page) -> None:
    cells = calibration_page.cells
    for cell in ("123.4", "56.78", "0.00123", "1500 N", "beyond others", "7"):
        assert cell in cells
    assert cells[cells.index("0.00123") - 1] == "\N{EN DASH}"
    assert f"no speed & {HOSTILE}" in cells


def test_held_out_errors_are_those_of_the_links(hostile: World) -> None:
    table = in_use_table(hostile.trained)
    links = hostile.trained.links
    error = np.rad2deg(links.truth["slip_angle"] - links.held_out["alpha"])
    row = next(row for row in table.rows if row[0] == "slip angle")
    assert row[2] == number(float(np.sqrt(np.mean(error**2))))


def test_cambers_stand_side_by_side(hostile: World) -> None:
    last = regression_tables(hostile.trained.regressions)[-1]
    assert "Table 4-2" in last.title
    assert [column for column in last.columns if column.startswith("p value")] == [
        "p value, -4 deg",
        "p value, 0 deg",
        "p value, +4 deg",
    ]


def test_the_estimate_page_tells_accuracy_and_flags(hostile: World, estimate_page: Page) -> None:
    cells = estimate_page.cells
    observations = hostile.observations["set1"]
    assert "lateral force Fy" in cells
    assert "first turn" in cells
    assert str(len(observations)) in cells
    count = int((observations.features.flags & 1 > 0).sum())
    assert cells[cells.index("first turn") + 1] == str(count)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-1234.5, "\N{MINUS SIGN}1234"),
        (1.5, "1.5"),
        (None, "\N{EN DASH}"),
        (100.0, "100"),
        (0.00012, "0.00012"),
        (-3e-9, "\N{MINUS SIGN}3.000e-09"),
        (1e9, "1.000e+09"),
    ],
)
def test_numbers_keep_their_digits(value: float | None, text: str) -> None:
    assert number(value) == text
