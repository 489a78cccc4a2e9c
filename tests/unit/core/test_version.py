"""Every file that can carry it names the version that wrote it."""

import json
import tomllib
from pathlib import Path

import numpy as np
from asammdf import MDF
from matplotlib.figure import Figure
from PIL import Image

from tirebench.recording.header import RecordingHeader, header_of
from tirelib.campaign.header import parse_header
from tirelib.campaign.model import CampaignHeader, Run, RunPlan, TireGeometry
from tirelib.campaign.write import write_campaign
from tirelib.core.documents import write_json
from tirelib.core.parameters import read_tire, write_tire
from tirelib.core.version import __version__
from tirelib.fleet.dataset import DataSet
from tirelib.report.style import save


def test_a_document_names_it_behind_its_format(tmp_path: Path) -> None:
    write_json(tmp_path / "d.json", {"format": "tirelib-any/1", "a": 1})
    written = json.loads((tmp_path / "d.json").read_text())
    assert written == {"format": "tirelib-any/1", "tirelib": __version__, "a": 1}
    assert list(written)[:2] == ["format", "tirelib"]


def test_a_tire_names_the_version_that_wrote_it_last(tmp_path: Path) -> None:
    path = tmp_path / "tire.toml"
    write_tire(read_tire("table-6-1"), path)
    old = path.read_text().replace(f'tirelib = "{__version__}"', 'tirelib = "0.0.1"')
    assert 'tirelib = "0.0.1"' in old
    path.write_text(old)
    known = read_tire(path)
    assert "tirelib" not in known.extra
    write_tire(known, path)
    assert tomllib.loads(path.read_text())["tirelib"] == __version__


def test_a_campaign_names_it_and_is_read_without_a_warning(tmp_path: Path) -> None:
    header = CampaignHeader("forces", "iso", TireGeometry("tire", 0.3))
    plan = RunPlan(1, "runs/001.mf4", "corner", 4000.0, 2.2e5, 18.0, 0.0, 0.0, 0.0)
    time = np.linspace(0.0, 1.0, 11)
    run = Run(plan=plan, rig_time=time, rig={"Fz": np.full(11, 4000.0)})
    write_campaign(tmp_path, header, [run])
    assert tomllib.loads((tmp_path / "campaign.toml").read_text())["tirelib"] == __version__
    assert parse_header(tmp_path)[1] == []
    with MDF(tmp_path / "runs/001.mf4") as mdf:
        assert mdf.header.description == f"written by tirelib {__version__}"


def test_a_figure_names_it(tmp_path: Path) -> None:
    save(Figure(), tmp_path, "figure")
    with Image.open(tmp_path / "figure.png") as picture:
        assert picture.info["Software"] == f"tirelib {__version__}"
    assert f"tirelib {__version__}" in (tmp_path / "figure.svg").read_text()


def test_a_data_set_of_a_fleet_names_it_and_is_opened_again(tmp_path: Path) -> None:
    data = DataSet(str(tmp_path / "out"))
    data.open()
    assert json.loads((tmp_path / "out/fleet.json").read_text())["tirelib"] == __version__
    data.open()


def test_a_recording_names_it() -> None:
    text = RecordingHeader({}).as_text()
    assert text["tirelib"] == __version__
    assert header_of(text, "a.mcap").settings == {}
