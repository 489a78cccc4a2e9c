"""A fleet on a cluster: what is kept, skipped, reported, resumed, and who can read it."""

import errno
import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import fsspec
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from fsspec import AbstractFileSystem
from fsspec.implementations.local import LocalFileSystem

pytest.importorskip("distributed", reason="the extra tirelib[fleet] is not installed")

from distributed import Client

from tests.fleet.recordings import describe, write_drive
from tests.trained import campaign_folder
from tirelib.cli import program
from tirelib.cli.fleet import run_verb
from tirelib.core.errors import FormatError, ParameterError
from tirelib.fleet import dataset, engine, work
from tirelib.fleet.dataset import DataSet, now
from tirelib.fleet.engine import Counts
from tirelib.fleet.page import fleet_document, write_fleet_page
from tirelib.fleet.recipes import recipe_of
from tirelib.fleet.sources import Source, content_hash, find_sources


def run(
    task: str, paths: Sequence[Path | str], out: Path | str, client: Client, **options: object
) -> Counts:
    data = DataSet(str(out))
    data.open()
    files = {k: str(options.pop(k)) for k in ("calibration", "model") if k in options}
    recipe = recipe_of(task, data, files=files, options=options.pop("also", ()))  # type: ignore[arg-type]
    sources = find_sources([str(p) for p in paths])
    return engine.run(sources, data, recipe, client, run_verb, **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def estimated(
    campaigns: Path, calibration: Path, client: Client, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Counts]:
    out = tmp_path_factory.mktemp("fleet") / "data"
    drive = describe(out.parent / "drives" / "commute")
    write_drive(drive / "a.mf4", seconds=12.0)
    paths = [campaigns, out.parent / "drives"]
    counts = run("estimate", paths, out, client, calibration=calibration, delta=True)
    return out, counts


def test_a_broken_campaign_stops_no_other(estimated: tuple[Path, Counts]) -> None:
    out, counts = estimated
    assert (counts.total, counts.done, counts.failed, counts.left) == (5, 4, 1, 0)
    (message,) = counts.messages.values()
    assert "'tirelib-campaign/99' is an unknown version" in message
    failures = DataSet(str(out)).table("failures").to_pylist()
    assert failures[0]["cause"]
    assert failures[0]["file_path"].endswith("broken")


def test_numbers_are_those_of_the_command(
    estimated: tuple[Path, Counts], campaigns: Path, calibration: Path, tmp_path: Path
) -> None:
    out, _ = estimated
    folder = campaigns / "north" / "day-1"
    document = tmp_path / "e.json"
    command = ["estimate", str(folder), "--calibration", str(calibration), "--json", str(document)]
    CliRunner().invoke(program, command, catch_exceptions=False)
    turns = json.loads(document.read_text())["turns"]
    metrics = pd.read_parquet(out / "container_metrics")
    row = metrics[metrics.file_path == str(folder)].iloc[0]
    assert row.content_hash == content_hash(folder)
    channels = pd.read_parquet(out / "channels", filters=[("container_id", "==", row.container_id)])
    names = pd.read_parquet(out / "channel_metrics")
    names = names[names.container_id == row.container_id].set_index("channel_name")
    for name in ("Fz", "alpha", "Fy_std"):
        mine = channels[channels.channel_id == names.loc[name, "channel_id"]].sort_values("tstart")
        expected = [np.nan if turn[name] is None else turn[name] for turn in turns]
        np.testing.assert_allclose(mine.value, expected, rtol=1e-12)
        assert mine.run.tolist() == [turn["run"] for turn in turns]
        assert names.loc[name, "mean"] == pytest.approx(np.nanmean(expected))
    assert (channels.tend >= channels.tstart).all()
    assert channels.tirelib.nunique() == 1
    assert channels.recipe.nunique() == 1


def test_a_recording_of_a_wheel_is_a_container(estimated: tuple[Path, Counts]) -> None:
    out, _ = estimated
    metrics = pd.read_parquet(out / "container_metrics")
    row = metrics[metrics.kind == "recording"].iloc[0]
    assert row.duration_ms == pytest.approx(12000, abs=300)
    assert str(row.start_dt).startswith("2026-05-28")
    tags = pd.read_parquet(out / "channel_tags")
    tags = tags[(tags.container_id == row.container_id) & (tags.key == "wheel")]
    assert set(tags.value) == {"FL"}


def test_readers_agree(estimated: tuple[Path, Counts]) -> None:
    polars, duckdb = pytest.importorskip("polars"), pytest.importorskip("duckdb")
    deltalake = pytest.importorskip("deltalake")
    out, _ = estimated
    for table in ("channels", "channel_metrics", "container_tags", "container_metrics", "results"):
        frame = pd.read_parquet(out / table)
        pattern = str(out / table / "task=*" / "*.parquet")
        count = len(frame)
        assert count
        assert set(frame.task) == {"estimate"}
        assert polars.read_parquet(pattern, hive_partitioning=True).height == count
        query = f"select count(*), min(task) from read_parquet('{pattern}', hive_partitioning=true)"
        assert duckdb.sql(query).fetchall()[0] == (count, "estimate")
        assert deltalake.DeltaTable(str(out / table)).to_pyarrow_table().num_rows == count


def test_finished_ones_are_skipped_wherever_they_lie(
    estimated: tuple[Path, Counts], campaigns: Path, calibration: Path, client: Client
) -> None:
    out, _ = estimated
    again = run("estimate", [campaigns], out, client, calibration=calibration)
    assert (again.skipped, again.done, again.failed) == (3, 0, 1)
    moved = out.parent / "moved"
    (campaigns / "north" / "day-2").rename(moved)
    try:
        counts = run("estimate", [moved], out, client, calibration=calibration)
    finally:
        moved.rename(campaigns / "north" / "day-2")
    assert (counts.total, counts.known, counts.done) == (1, 1, 0)
    assert len(pd.read_parquet(out / "container_metrics")) == 4


def test_a_folder_that_cannot_be_searched_is_named(
    campaigns: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def listed(self: LocalFileSystem, path: str, **more: object) -> object:
        if path.endswith("broken"):
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return real(self, path, **more)

    real = LocalFileSystem.ls
    monkeypatch.setattr(LocalFileSystem, "ls", listed)
    said: list[Exception] = []
    assert len(find_sources([str(campaigns)], said.append)) == 3
    (error,) = said
    assert str(campaigns / "broken") in str(error)


def test_a_copy_is_computed_once_and_named_beside_the_other(
    campaigns: Path, client: Client, tmp_path: Path
) -> None:
    for place in ("a", "b", "c"):
        shutil.copytree(campaigns / "north" / f"day-{int(place == 'c')}", tmp_path / "in" / place)
    out = tmp_path / "out"
    assert run("check", [tmp_path / "in" / "b"], out, client).done == 1
    first, again = (run("check", [tmp_path / "in"], out, client) for _ in range(2))
    assert (first.skipped, first.done, first.known, first.copies) == (1, 1, 1, 1)
    assert (again.skipped, again.copies) == (3, 0)
    document = fleet_document(DataSet(str(out)))
    places = {row["file_path"]: row["copies"] for row in document["containers"]}
    one = str(tmp_path / "in" / "a")  # whichever came first
    assert places[one] == [str(tmp_path / "in" / "b")]
    assert len(places) == 2
    assert places[one][0] in Path(write_fleet_page(DataSet(str(out)))).read_text()


def test_a_recording_is_refused_as_one_where_only_campaigns_serve(
    client: Client, tmp_path: Path
) -> None:
    drive = describe(tmp_path / "in" / "drive")
    write_drive(drive / "a.mf4", seconds=1.0)
    for task in ("check", "features"):
        counts = run(task, [drive], tmp_path / "out", client)
        (said,) = counts.messages.values()
        assert f"a recording is given; {task} takes campaigns" in said


def test_a_worker_that_has_not_the_folders_says_so(campaigns: Path, tmp_path: Path) -> None:
    data = DataSet(str(tmp_path / "out"))
    data.open()
    recipe = recipe_of("check", data, files={})
    here = find_sources([str(campaigns / "north")])[0]
    gone, too = (Source(str(tmp_path / name), True) for name in ("gone", "too"))
    causes = []
    for source, place in ((gone, data.url), (too, data.url), (here, str(tmp_path / "elsewhere"))):
        outcome = work.process(source, "mark", recipe, place, run_verb)
        assert "no such folder on the worker's machine" in outcome.failed
        causes.append(outcome.rows["failures"][0]["cause"])
    assert causes[0] == causes[1]  # one line for both
    assert not (tmp_path / "elsewhere").exists()


def test_a_data_set_has_the_same_address_for_workers_of_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert DataSet("out").url == str(tmp_path / "out")


def test_a_header_that_is_broken_is_the_cause_and_not_the_tire_that_it_hides(
    campaigns: Path, client: Client, tmp_path: Path
) -> None:
    calibrations = DataSet(str(tmp_path / "calibrations"))
    calibrations.open()
    row = {
        "container_id": 1,
        "tire": "mine",
        "content_hash": "f",
        "file": "f",
        "finished_dt": now(),
    }
    calibrations.add("calibrate", {"container_metrics": [row]})
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "campaign.toml").write_text("[tire\n")
    counts = run("estimate", [tmp_path], tmp_path / "out", client, calibration=calibrations.url)
    (said,) = counts.messages.values()
    assert "campaign.toml: not TOML" in said


def test_a_client_that_dies_loses_nothing(
    campaigns: Path, client: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed after two small tables: the half batch goes, and notes are taken unread."""
    data = DataSet(str(tmp_path / "out"))

    def dies(self: DataSet, task: str, rows: dict[str, list[dict[str, object]]]) -> None:
        real(self, task, {"results": rows["results"]})
        for path in data.files("container_metrics"):
            data.fs.rm(data.path("container_metrics", path))
        raise SystemError("killed")

    real = DataSet.add
    monkeypatch.setattr(DataSet, "add", dies)
    with pytest.raises(SystemError, match="killed"):
        run("check", [campaigns / "north"], tmp_path / "out", client)
    monkeypatch.setattr(DataSet, "add", real)
    assert data.files("results")
    assert not data.files("container_metrics")
    assert len(data.fs.ls(data.path("pending", "check"))) == 3

    computed: list[object] = []
    monkeypatch.setattr(work, "_compute", lambda *given: computed.append(given))
    counts = run("check", [campaigns / "north"], tmp_path / "out", client)
    assert (counts.done, computed) == (3, [])
    assert len(data.table("container_metrics")) == 3
    names = data.table("results")["name"].to_pylist()
    assert names.count("errors") == names.count("warnings") == 3  # none twice
    assert not data.fs.ls(data.path("pending", "check"))


def test_calibrations_of_a_data_set_serve_every_campaign_of_their_tire(
    campaigns: Path, client: Client, tmp_path: Path
) -> None:
    calibrations, out = tmp_path / "calibrations", tmp_path / "estimates"
    assert run("calibrate", [campaign_folder()], calibrations, client, also=("--quick",)).done == 1
    counts = run("estimate", [campaigns / "north"], out, client, calibration=calibrations)
    assert (counts.done, counts.failed) == (3, 0)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ('{"format": "tirelib-fleet/1"}', "without any calibration; run `tirelib fleet calibrate"),
        ('{"format": "tirelib-fleet/2"}', "this version reads 'tirelib-fleet/1'"),
        ('{"form', "fleet.json is damaged"),
        ("[]", "fleet.json is damaged"),
    ],
)
def test_a_data_set_that_cannot_serve_is_refused_before_any_work(
    head: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "fleet.json").write_text(head)
    data = DataSet(str(tmp_path / "out"))
    data.open()
    with pytest.raises(FormatError, match=said):
        recipe_of("estimate", data, files={"calibration": str(tmp_path / "other")})
    if "/1" not in head:
        with pytest.raises(FormatError, match=said):
            DataSet(str(tmp_path / "other")).open()


@pytest.mark.parametrize(
    ("task", "files", "said"),
    [
        ("estimate", {}, "--calibration is missing"),
        ("check", {"model": "table-6-1"}, "takes no --model"),
        ("estimate", {"calibration": "nowhere"}, "neither a file nor a data set"),
        ("diagnose", {"model": "nowhere"}, "no data set of `tirelib fleet`; .*no such file"),
        ("diagnose", {"model": __file__}, f"--model {__file__}: is not TOML"),
        ("estimate", {"calibration": __file__}, f"--calibration {__file__}: .*TOML"),
    ],
)
def test_a_wrong_recipe_is_refused(
    task: str, files: dict[str, str], said: str, tmp_path: Path
) -> None:
    data = DataSet(str(tmp_path / "out"))
    data.open()
    with pytest.raises((ParameterError, FormatError), match=said):
        recipe_of(task, data, files=files)


@pytest.mark.parametrize("form", ["--effects {}", "--effects={}"])
def test_a_file_among_the_options_counts_by_its_content(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    data = DataSet(str(tmp_path / "out"))
    data.open()
    seen = []
    for name, text in (("mine.py", "a = 1"), ("mine.py", "a = 2"), ("copy.py", "a = 2")):
        (tmp_path / name).write_text(text)
        recipe = recipe_of(
            "diagnose", data, files={"model": "table-6-1"}, options=form.format(name).split()
        )
        assert recipe.options == tuple(form.format(tmp_path / name).split())
        seen.append(recipe.hash)
    assert seen[0] != seen[1] == seen[2]


def test_paths_without_campaigns_and_foreign_folders_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(FormatError) as caught:
        find_sources([str(tmp_path / "empty"), "nowhere/at-all", "s4://what"])
    assert len(caught.value.problems) == 3
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(FormatError, match="not empty and not a data set"):
        DataSet(str(tmp_path)).open()


def test_a_full_disk_is_said_with_the_file_and_the_same_command_goes_on(
    campaigns: Path, client: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"

    def full(table: object, where: object, **more: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(dataset.pq, "write_table", full)
        with pytest.raises(FormatError, match=rf"{out}/.*cannot be written \(No space left"):
            run("check", [campaigns / "north"], out, client)
    assert not list(out.rglob("*.part"))
    monkeypatch.setattr(work, "_compute", lambda *given: pytest.fail("computed again"))
    assert run("check", [campaigns / "north"], out, client).done == 3


class Locked(AbstractFileSystem):  # type: ignore[misc]
    """A storage without keys; its errors are of a kind of its own."""

    protocol = "locked"

    def exists(self, path: str, **more: object) -> bool:
        raise LookupError("unable to locate credentials")

    isdir = exists


def test_a_storage_without_keys_is_said() -> None:
    fsspec.register_implementation("locked", Locked, clobber=True)
    with pytest.raises(FormatError, match=r"locked://a: cannot be reached .*locate credentials"):
        find_sources(["locked://a"])
    with pytest.raises(FormatError, match=r"locked://a: cannot be written .*locate credentials"):
        DataSet("locked://a").open()


@pytest.mark.parametrize("more", ["--nosuch 3", "--quick 'x", "--order few", "--json a.json"])
def test_wrong_options_of_the_verb_are_said_once_before_any_work(
    more: str, campaigns: Path, tmp_path: Path
) -> None:
    command = ["fleet", "calibrate", str(campaigns), "--out", str(tmp_path / "out"), "--with", more]
    done = CliRunner().invoke(program, command, catch_exceptions=False)
    assert done.exit_code == 2
    assert f"--with {more!r}" in done.output
    assert not (tmp_path / "out").exists()


def test_errors_that_a_check_found_are_counted_also_when_it_was_finished_before(
    campaigns: Path, client: Client, tmp_path: Path
) -> None:
    for done, skipped in ((4, 0), (0, 4)):
        counts = run("check", [campaigns], tmp_path / "out", client)
        assert (counts.done, counts.skipped, counts.failed, counts.negative) == (
            done,
            skipped,
            0,
            1,
        )


def test_failures_of_one_cause_are_one_line(client: Client, tmp_path: Path) -> None:
    for day in range(3):
        (tmp_path / f"day-{day}").mkdir()
        (tmp_path / f"day-{day}" / "campaign.toml").write_text('format = "tirelib-campaign/99"\n')
    counts = run("features", [tmp_path], tmp_path / "out", client)
    ((message, number),) = engine.causes(counts)
    assert (counts.failed, number) == (3, 3)
    assert "day-0" in message


def test_patterns_find_each_once(campaigns: Path) -> None:
    found = find_sources([f"{campaigns}/no*/day-*", str(campaigns / "north")])
    assert [Path(source.url).name for source in found] == ["day-0", "day-1", "day-2"]


def test_the_page_shows_failures_and_links(estimated: tuple[Path, Counts]) -> None:
    out, _ = estimated
    data = DataSet(str(out))
    page = Path(write_fleet_page(data)).read_text()
    assert "Failures by cause" in page
    assert "is an unknown version" in page
    document = fleet_document(data)
    assert {each["channel"] for each in document["changes"]} >= {"pressure", "rolling_radius"}
    for each in document["containers"]:
        own = (out / each["page"]).read_text()
        assert each["page"] in page
        assert "../../index.html" in own
