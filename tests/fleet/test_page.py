"""The page of a fleet of drawn numbers: outliers, changes, and points that open pages."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("fsspec", reason="the extra tirelib[fleet] is not installed")

from tests.bench.browser import chromium
from tests.bench.programs import PATIENCE
from tirelib.fleet.dataset import DataSet
from tirelib.fleet.page import fleet_document, write_fleet_page
from tirelib.report.fleet import NOT_YET

TIRES = 12
DAYS = 9
START = datetime(2026, 3, 1, tzinfo=UTC)
ORIGIN = {"tirelib": "0.1.0", "recipe": "r"}
NAMES = {
    "radial_stiffness": (6.3e5, "N/m^2"),
    "bending_stiffness": (2.1, "N m^2"),
    "ring_radius": (0.302, "m"),
}


def container(number: int, task: str, tire: str, day: int) -> dict[str, Any]:
    start = START + timedelta(days=day)
    page = f"pages/{task}/{number}.html"
    return {
        "container_id": number,
        "start_dt": start,
        "start_ts": round(1e6 * start.timestamp()),
        "name": f"day {day}",
        "tire": tire,
        "file_path": f"/data/{tire}/day-{day}",
        "page": page,
        "answer": 0,
        **ORIGIN,
    }


def identified(rng: np.random.Generator) -> dict[str, list[dict[str, Any]]]:
    """One campaign a tire; tire 4 is a third softer, tire 7 has few runs."""
    rows: dict[str, list[dict[str, Any]]] = {"container_metrics": [], "results": []}
    tags = []
    for k in range(TIRES):
        tire, number = f"tire {k:02d}", 1000 + k
        rows["container_metrics"].append(container(number, "identify", tire, 0))
        tags.append({"container_id": number, "key": "size", "value": "316 mm", **ORIGIN})
        for name, (middle, unit) in NAMES.items():
            value = middle * float(np.exp(rng.normal(0.0, 0.03)))
            relative = 0.15 if k == 7 else 0.01
            value *= 1.0 + relative * float(rng.normal())
            value *= 0.67 if (k, name) == (4, "radial_stiffness") else 1.0
            std = relative * value
            rows["results"].append(
                {
                    "container_id": number,
                    "tire": tire,
                    "kind": "parameter",
                    "name": name,
                    "value": value,
                    "std": std,
                    "low": value - 1.96 * std,
                    "high": value + 1.96 * std,
                    "unit": unit,
                    "flags": "",
                    **ORIGIN,
                }
            )
    return {"container_tags": tags, **rows}


def driven(rng: np.random.Generator) -> dict[str, list[dict[str, Any]]]:
    """A recording a day; tire 02 leaks 0.04 bar a day, gage 3 of tire 05 comes off."""
    rows: dict[str, list[dict[str, Any]]] = {"container_metrics": [], "channel_metrics": []}
    for k in range(TIRES):
        for day in range(DAYS):
            number = 2000 + DAYS * k + day
            rows["container_metrics"].append(container(number, "estimate", f"tire {k:02d}", day))
            pressure = 2.3 + rng.normal(0.0, 0.02) - (0.04 * day if k == 2 else 0.0)
            offset = 2500.0 + rng.normal(0.0, 20.0) - (120.0 * day if k == 5 else 0.0)
            load = 4000.0 + rng.normal(0.0, 200.0)
            radius = 306.0 + 4.0 * (pressure - 2.3) - 1e-3 * (load - 4000.0)
            for name, unit, mean in (
                ("FL.pressure", "bar", pressure),
                ("FL.offset_3", "ustrain", offset),
                ("FL.Fz", "N", load),
                ("FL.rolling_radius", "mm", radius + rng.normal(0.0, 0.1)),
            ):
                rows["channel_metrics"].append(
                    {
                        "container_id": number,
                        "channel_name": name,
                        "unit": unit,
                        "mean": mean,
                        "sample_count": 9000,
                        **ORIGIN,
                    }
                )
    return rows


def diagnosed() -> dict[str, list[dict[str, Any]]]:
    """Tire 04 has a softening sidewall; tire 06 hints at friction."""
    rows: dict[str, list[dict[str, Any]]] = {"container_metrics": [], "results": []}
    for k in range(TIRES):
        number = 3000 + k
        rows["container_metrics"].append(container(number, "diagnose", f"tire {k:02d}", 0))
        named = "sidewall_load" if k == 4 else ""
        same = {"container_id": number, "tire": f"tire {k:02d}", **ORIGIN}
        verdict = {"kind": "verdict", "name": "strain", "flags": named}
        rows["results"].append({**same, **verdict, "text": "named" if named else "none"})
        for effect in ("sidewall_load", "tread_friction"):
            level = "alarm" if effect == named else "quiet"
            level = "hint" if (k, effect) == (6, "tread_friction") else level
            rows["results"].append({**same, "kind": "effect", "name": effect, "flags": level})
    return rows


def failing() -> dict[str, list[dict[str, Any]]]:
    same = {"fingerprint": "f", "failed_dt": START, "flags": "failed", **ORIGIN}
    said = "truncated or damaged MDF N file of N bytes"
    return {
        "failures": [
            {
                "container_id": 4000 + k,
                "file_path": f"/data/tire {k:02d}/day-0",
                "cause": said if k else "no such folder",
                "message": "runs/001.mf4: truncated or damaged MDF 4 file of 900 bytes",
                **same,
            }
            for k in range(4)
        ]
    }


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> DataSet:
    rng = np.random.default_rng(8)
    data = DataSet(str(tmp_path_factory.mktemp("page") / "data"))
    data.open()
    data.add("identify", identified(rng))
    data.add("estimate", driven(rng))
    data.add("diagnose", diagnosed())
    data.add("compare", failing())
    for row in data.table("container_metrics", ["page", "name", "tire"]).to_pylist():
        data.write(f"<h1>{row['tire']} {row['name']}</h1>".encode(), *row["page"].split("/"))
    write_fleet_page(data)
    return data


def test_what_was_planted_is_found_and_nothing_else(data: DataSet) -> None:
    found = fleet_document(data)
    odd = {
        (point["tire"], each["name"])
        for each in found["parameters"]
        for point in each["points"]
        if point["outlier"]
    }
    assert odd == {("tire 04", "radial_stiffness")}
    changing = {(e["tire"], e["channel"]): e["cause"] for e in found["changes"] if e["changes"]}
    assert changing == {
        ("tire 02", "pressure"): "the tire loses pressure",
        ("tire 05", "offset_3"): "gage 3 comes off or ages",
    }
    assert [(e["tire"], e["named"]) for e in found["effects"] if e["named"]] == [
        ("tire 04", ["sidewall_load"])
    ]
    assert [each["number"] for each in found["failures"]] == [3, 1]


def test_a_tire_with_few_runs_gains_from_its_siblings(data: DataSet) -> None:
    for each in fleet_document(data)["parameters"]:
        gain = {row["tire"]: row["gain"] for row in each["joined"]}
        assert gain["tire 07"] > 2.5
        assert max(value for tire, value in gain.items() if tire != "tire 07") < 1.3
        if each["name"] == "radial_stiffness":
            assert "tire 04" not in gain  # it stands out


def test_campaigns_of_one_name_are_told_apart_and_negative_answers_shown(tmp_path: Path) -> None:
    data = DataSet(str(tmp_path / "data"))
    data.open()
    rows = [
        container(k, "check", "tire 00", 0) | {"file_path": f"/data/{place}", "answer": int(k == 2)}
        for k, place in enumerate(("north/a", "south/a", "south/b"))
    ]
    reason = {"container_id": 2, "kind": "error", "name": "runs.csv", "text": "missing; write one"}
    data.add("check", {"container_metrics": rows, "results": [reason | ORIGIN]})
    found = fleet_document(data)
    names = [each["name"] for each in found["containers"]]
    assert names == ["day 0 (a) (/data/north/a)", "day 0 (a) (/data/south/a)", "day 0 (b)"]
    (negative,) = found["negative"]
    assert (negative["name"], negative["first"]) == (names[2], "runs.csv: missing; write one")
    page = Path(write_fleet_page(data)).read_text()
    assert "runs.csv: missing" in page
    assert all(said in page for said in NOT_YET.values())  # nothing is said to be in order


def test_too_few_tires_and_recordings_are_not_said_to_be_alike(tmp_path: Path) -> None:
    data = DataSet(str(tmp_path / "data"))
    data.open()
    rng = np.random.default_rng(9)
    for task, made in (("identify", identified(rng)), ("estimate", driven(rng))):
        rows = made["container_metrics"]
        few = {row["container_id"] for row in rows if row["tire"] in ("tire 00", "tire 01")}
        few = {k for k in few if task == "identify" or k % DAYS < 4}
        data.add(
            task,
            {
                name: [row for row in rows if row["container_id"] in few]
                for name, rows in made.items()
            },
        )
    page = Path(write_fleet_page(data)).read_text()
    assert "at least 5 campaigns of one size of tire are needed, here are 2" in page
    assert "at least 5 recordings of one wheel are needed, here are 4" in page
    assert "no tire, beyond its interval" not in page


def test_a_click_on_a_point_opens_its_campaign(data: DataSet) -> None:
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1200, "height": 900})
        page.set_default_timeout(1e3 * PATIENCE)
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(Path(data.path("index.html")).as_uri())
        page.wait_for_selector("#plot-parameter-1 .scatterlayer .point")
        text = page.inner_text("main")
        assert "tire 04 (radial_stiffness)" in text
        assert "the tire loses pressure" in text
        assert "not known" not in text
        page.locator("#plot-parameter-1").scroll_into_view_if_needed()
        point = page.locator("#plot-parameter-1 .scatterlayer .point").nth(3)
        box = point.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.wait_for_url("**/pages/identify/*.html")
        assert page.inner_text("h1") == "tire 03 day 0"
        assert not errors
