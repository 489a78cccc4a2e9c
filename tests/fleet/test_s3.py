"""Campaigns in a bucket, results in a bucket, through a server of S3 on this machine."""

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from socket import create_connection, socket
from subprocess import Popen

import pandas as pd
import pytest

pytest.importorskip("s3fs", reason="the extra tirelib[fleet] is not installed")
pytest.importorskip("moto.server", reason="moto is not installed, so there is no bucket")

import fsspec
from distributed import Client

from tests.bench.programs import PATIENCE
from tirelib.cli.fleet import run_verb
from tirelib.fleet import engine
from tirelib.fleet.dataset import DataSet
from tirelib.fleet.page import write_fleet_page
from tirelib.fleet.recipes import recipe_of
from tirelib.fleet.sources import find_sources


@pytest.fixture
def bucket() -> Iterator[str]:
    """A server in its own process: the Delta library waits for it and lets no thread run."""
    with socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = Popen([sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)])
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{port}")
            patch.setenv("AWS_ACCESS_KEY_ID", "key")
            patch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
            patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
            _wait_for(port)
            fsspec.filesystem("s3", skip_instance_cache=True).mkdir("fleet")
            yield "s3://fleet"
    finally:
        server.kill()
        server.wait()


def _wait_for(port: int) -> None:
    until = time.monotonic() + PATIENCE
    while True:
        try:
            create_connection(("127.0.0.1", port), timeout=1.0).close()
        except OSError:
            assert time.monotonic() < until
            time.sleep(0.1)
        else:
            return


def test_from_bucket_to_bucket(
    bucket: str, campaigns: Path, calibration: Path, client: Client, tmp_path: Path
) -> None:
    fs = fsspec.filesystem("s3", skip_instance_cache=True)
    fs.put(str(campaigns / "north" / "day-0"), "fleet/in/day-0", recursive=True)
    fs.put(str(campaigns / "broken"), "fleet/in/broken", recursive=True)
    data = DataSet(f"{bucket}/out")
    data.open()
    for skipped in (0, 1):
        recipe = recipe_of("estimate", data, files={"calibration": str(calibration)})
        counts = engine.run(
            find_sources([f"{bucket}/in"]), data, recipe, client, run_verb, delta=True
        )
        assert (counts.total, counts.skipped, counts.failed) == (2, skipped, 1), counts.messages
    assert write_fleet_page(data).endswith("fleet/out/index.html")
    fs.get("fleet/out", str(tmp_path / "out"), recursive=True)
    (row,) = pd.read_parquet(tmp_path / "out" / "container_metrics").to_dict("records")
    assert row["file_path"] == "s3://fleet/in/day-0"
    assert (tmp_path / "out" / row["page"]).is_file()
    assert len(pd.read_parquet(tmp_path / "out" / "channels")) > 100
    deltalake = pytest.importorskip("deltalake")
    table = deltalake.DeltaTable(str(tmp_path / "out" / "container_metrics"))
    assert table.to_pyarrow_table().num_rows == 1
