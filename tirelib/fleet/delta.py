"""A Delta log beside the Parquet files: the same files, readable as Delta tables as well.

Only the client writes the log, one commit for a batch, so that no lock is needed on any storage.
"""

import os
import time
from collections.abc import Sequence

import pyarrow as pa
from deltalake import DeltaTable, Schema
from deltalake.transaction import AddAction, create_table_with_add_actions

from tirelib.fleet.dataset import DataSet
from tirelib.fleet.tables import PARTITION, SCHEMAS


class DeltaLog:
    """The logs of all tables of a data set; needs the package deltalake.

    Parameters
    ----------
    data : DataSet
    """

    def __init__(self, data: DataSet) -> None:
        self._data = data
        self._options = None if data.local else _storage_options()

    def add(self, written: Sequence[tuple[str, str]]) -> None:
        """Commit files, each as (table, path within it); a new log takes all that are there."""
        for name, arrow in SCHEMAS.items():
            paths = [path for table, path in written if table == name]
            if not paths:
                continue
            uri = self._uri(name)
            schema = Schema.from_arrow(arrow.append(pa.field(PARTITION, pa.string())))
            if DeltaTable.is_deltatable(uri, storage_options=self._options):
                DeltaTable(uri, storage_options=self._options).create_write_transaction(
                    [self._action(name, path) for path in paths],
                    "append",
                    schema,
                    partition_by=[PARTITION],
                )
                continue
            create_table_with_add_actions(
                uri,
                schema,
                [self._action(name, path) for path in self._data.files(name)],
                partition_by=[PARTITION],
                storage_options=self._options,
            )

    def _uri(self, name: str) -> str:
        return self._data.path(name) if self._data.local else f"{self._data.url.rstrip('/')}/{name}"

    def _action(self, name: str, path: str) -> AddAction:
        return AddAction(
            path=path,
            size=int(self._data.fs.size(self._data.path(name, path))),
            partition_values={PARTITION: path.partition("=")[2].partition("/")[0]},
            modification_time=round(1e3 * time.time()),
            data_change=True,
            stats="{}",
        )


def _storage_options() -> dict[str, str] | None:
    """Return what the Delta library needs to reach a bucket, from the environment."""
    known = {key: value for key, value in os.environ.items() if key.startswith("AWS_")}
    if known.get("AWS_ENDPOINT_URL", "").startswith("http://"):
        known["AWS_ALLOW_HTTP"] = "true"
    return known or None
