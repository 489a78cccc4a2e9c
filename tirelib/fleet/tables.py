"""The tables of the data set: names, columns and types, in the layout of measurement lakehouses.

The five tables of containers and channels have the names, keys and columns that query engines for
vehicle measurements expect (Databricks Labs *Impulse*, "Silver layer schema"): a container is a
campaign or a recording, a channel is one number of each turn. Two tables are ours: ``results`` has
the numbers that a verb says of a whole container, ``failures`` the containers without any.
Every table is partitioned by ``task`` in the way of Hive, and every row has the version of tirelib
and the hash of the calibration, model and options that it comes from.
"""

import pyarrow as pa

PARTITION = "task"
_ORIGIN = [("tirelib", pa.string()), ("recipe", pa.string())]
_TIME = pa.timestamp("us", tz="UTC")


def _schema(*columns: tuple[str, pa.DataType]) -> pa.Schema:
    return pa.schema([*columns, *_ORIGIN])


SCHEMAS: dict[str, pa.Schema] = {
    "container_tags": _schema(
        ("container_id", pa.int64()), ("key", pa.string()), ("value", pa.string())
    ),
    "channel_metrics": _schema(
        ("container_id", pa.int64()),
        ("channel_id", pa.int32()),
        ("channel_name", pa.string()),
        ("unit", pa.string()),
        ("value_type", pa.string()),
        ("sample_count", pa.int64()),
        ("nan_ratio", pa.float64()),
        ("begin_s", pa.float64()),
        ("end_s", pa.float64()),
        ("duration_ms", pa.int64()),
        ("original_sample_count", pa.int64()),
        ("original_sr", pa.float64()),
        ("min", pa.float64()),
        ("max", pa.float64()),
        ("mean", pa.float64()),
        ("std", pa.float64()),
        ("pz1", pa.float64()),
        ("pz10", pa.float64()),
        ("pz90", pa.float64()),
        ("pz99", pa.float64()),
        ("flags", pa.int64()),
    ),
    "channel_tags": _schema(
        ("container_id", pa.int64()),
        ("channel_id", pa.int32()),
        ("key", pa.string()),
        ("value", pa.string()),
    ),
    "channels": _schema(
        ("container_id", pa.int64()),
        ("channel_id", pa.int32()),
        ("tstart", pa.int64()),
        ("tend", pa.int64()),
        ("value", pa.float64()),
        ("is_plausible", pa.bool_()),
        ("flags", pa.int64()),
        ("run", pa.int32()),
    ),
    "results": _schema(
        ("container_id", pa.int64()),
        ("tire", pa.string()),
        ("kind", pa.string()),
        ("name", pa.string()),
        ("value", pa.float64()),
        ("std", pa.float64()),
        ("low", pa.float64()),
        ("high", pa.float64()),
        ("unit", pa.string()),
        ("flags", pa.string()),
        ("text", pa.string()),
    ),
    "failures": _schema(
        ("container_id", pa.int64()),
        ("file_path", pa.string()),
        ("fingerprint", pa.string()),
        ("cause", pa.string()),
        ("message", pa.string()),
        ("failed_dt", _TIME),
        ("flags", pa.string()),
    ),
    # last: a container is finished when its row is here
    "container_metrics": _schema(
        ("container_id", pa.int64()),
        ("start_dt", _TIME),
        ("stop_dt", _TIME),
        ("start_ts", pa.int64()),
        ("stop_ts", pa.int64()),
        ("duration_ms", pa.int64()),
        ("num_channels", pa.int32()),
        ("file_name", pa.string()),
        ("file_path", pa.string()),
        ("kind", pa.string()),
        ("name", pa.string()),
        ("tire", pa.string()),
        ("content_hash", pa.string()),
        ("fingerprint", pa.string()),
        ("answer", pa.int32()),
        ("compute_s", pa.float64()),
        ("page", pa.string()),
        ("document", pa.string()),
        ("file", pa.string()),
        ("finished_dt", _TIME),
        ("flags", pa.string()),
    ),
}
"""Columns by table, in the order in which a batch of results is written."""
CLIENT_TABLES = tuple(name for name in SCHEMAS if name != "channels")
"""Tables that the client writes, a file for many containers; a worker writes the channels."""
