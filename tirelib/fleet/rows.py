"""Documents and turns as rows of the tables."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.flags import flag_names
from tirelib.core.version import __version__
from tirelib.fleet.tables import SCHEMAS
from tirelib.measured.features.table import PER_TURN
from tirelib.measured.features.table import units as units_of_features

MOST_KEPT = 4096
"""Values of a channel from which its percentiles are taken, evenly spaced over the container. With
half of it the 1st percentile rests on 20 values, with double on 80; all of an hour are 36,000."""
BETWEEN = 1.0
"""Time between two runs of a campaign whose plan does not say when they began, [s]."""
_KEYS = frozenset({"wheel", "run", "turn", "gage", "time", "ready", "period", "flags", "valid"})
UNITS = units_of_features()
Row = dict[str, Any]


def result_rows(task: str, document: Mapping[str, Any]) -> list[Row]:
    """Return what a verb's document says of the whole container, one row a number."""
    return list(_OF[task](document))


def _row(kind: str, name: str, value: Any = None, **more: Any) -> Row:
    number = None if value is None or isinstance(value, bool | str) else value
    if isinstance(number, list):
        more["text"] = json.dumps(number)
        number = number[0] if number else None
    std = more.get("std")
    if isinstance(std, list):
        more["std"] = std[0] if std else None
    flags = more.pop("flags", ())
    more["flags"] = flags if isinstance(flags, str) else ";".join(flags)
    return {"kind": kind, "name": name, "value": None if number is None else float(number), **more}


def _check(document: Mapping[str, Any]) -> Iterator[Row]:
    for severity in ("errors", "warnings"):
        yield _row("count", severity, document[severity])
    for problem in document["problems"]:
        said = f"{problem['given']}; {problem['allowed']}; {problem['remedy']}"
        yield _row(problem["severity"], problem["where"], text=said)


def _features(document: Mapping[str, Any]) -> Iterator[Row]:
    for name in ("turns", "usable"):
        yield _row("count", name, document[name])
    for name, count in document["flags"].items():
        yield _row("flag", name, count)


def _calibrate(document: Mapping[str, Any]) -> Iterator[Row]:
    for quantity, entry in document["in_use"].items():
        if entry is not None:
            yield _row(
                "held-out error",
                quantity,
                entry["cross_validated_rmse"],
                unit=entry["unit"],
                text=None if entry["r2"] is None else f"R2 {entry['r2']:.5f}",
            )
    for quantity, reason in document["refused"].items():
        yield _row("refused", quantity, text=str(reason))


def _estimate(document: Mapping[str, Any]) -> Iterator[Row]:
    for quantity, entry in document["summary"].items():
        if entry is not None:
            yield _row("error", quantity, entry["rmse"], unit=entry["unit"])
    for name, wheel in document.get("wheels", {}).items():
        yield _row("turns", name, wheel["turns"], text=f"{wheel['valid']} valid")
        for flag, count in wheel["flags"].items():
            yield _row("flag", flag, count, text=name)
    other = document.get("other_tire")
    if other:
        yield _row("other tire", "turns", other["turns"], flags="suspected" * other["suspected"])


def _identify(document: Mapping[str, Any]) -> Iterator[Row]:
    brush = document.get("brush") or {"parameters": []}
    for entry in (*document["parameters"], *brush["parameters"]):
        yield _row(
            "parameter",
            entry["name"],
            entry["value"],
            std=entry.get("std"),
            low=entry["low"],
            high=entry["high"],
            unit=entry["unit"],
            flags=entry["flags"],
        )
    if document.get("error") is not None:
        yield _row("error", "strain", document["error"], unit=document.get("error_unit"))
    for reason in document.get("reasons", ()):
        yield _row("reason", "", text=str(reason))


def _compare(document: Mapping[str, Any]) -> Iterator[Row]:
    yield _row("verdict", document["quantity"], text=document["verdict"])
    yield _row("error", document["quantity"], document["error"], unit="noise")
    yield _row("residual", document["quantity"], document["residual_rms"], unit=document["unit"])
    for line in document["statements"]:
        yield _row("statement", document["quantity"], text=str(line))


def _diagnose(document: Mapping[str, Any]) -> Iterator[Row]:
    named = ";".join(document["named"])
    yield _row("verdict", document["quantity"], flags=named, text=document["verdict"])
    yield _row("error", document["quantity"], document["error_before"])
    for entry in document["candidates"]:
        chance = entry.get("p")
        yield _row(
            "effect",
            entry["effect"],
            entry["strength"],
            std=entry["std"],
            flags=entry["level"],
            text=None if chance is None else f"p {chance:.3g}",
        )


_OF: dict[str, Callable[[Mapping[str, Any]], Iterator[Row]]] = {
    "check": _check,
    "features": _features,
    "calibrate": _calibrate,
    "estimate": _estimate,
    "identify": _identify,
    "compare": _compare,
    "diagnose": _diagnose,
}


class Channels:
    """The channels of one container, from the table of its turns, part by part.

    Parameters
    ----------
    container : int
    recipe : str
    begins : mapping of run number to float, [s]
        Start of each run on the container's clock; a recording's is zero.
    """

    def __init__(self, container: int, recipe: str, begins: Mapping[int, float]) -> None:
        self._container, self._recipe, self._begins = container, recipe, dict(begins)
        self._until = -BETWEEN
        self._known: dict[tuple[str, int, str], _Channel] = {}

    def write(self, turns: Path, target: Path) -> None:
        """Read a table of turns and write the rows of the channels."""
        with (
            pq.ParquetFile(turns) as file,
            pq.ParquetWriter(target, SCHEMAS["channels"], compression="zstd") as writer,
        ):
            for part in range(file.num_row_groups):
                rows = list(self._rows(file.read_row_group(part)))
                writer.write_table(pa.concat_tables(rows).combine_chunks())

    def _rows(self, table: pa.Table) -> Iterator[pa.Table]:
        columns = {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
        units = {
            field.name: (field.metadata or {}).get(b"unit", b"").decode()
            or UNITS.get(field.name, "")
            for field in table.schema
        }
        n = table.num_rows
        for run in dict.fromkeys(columns["run"].astype(np.int64).tolist()):
            begin = self._begins.setdefault(
                run, 0.0 if "wheel" in columns and run == 0 else self._until + BETWEEN
            )
            last = np.nanmax(columns["time"][columns["run"] == run])
            self._until = max(self._until, begin + float(last))
        wheel = columns.get("wheel", np.full(n, ""))
        gage = columns.get("gage", np.zeros(n, dtype=np.int64))
        flags = columns["flags"] if "flags" in columns else np.zeros(n, dtype=np.int64)
        if flags.dtype.kind not in "iu":
            flags = np.zeros(n, dtype=np.int64)
        names = [
            name
            for name, values in columns.items()
            if name not in _KEYS and values.dtype.kind == "f"
        ]
        for side in dict.fromkeys(wheel.tolist()):
            for number in dict.fromkeys(gage.tolist()):
                chosen = (wheel == side) & (gage == number)
                for name in names:
                    once = "gage" in columns and name in PER_TURN
                    if once and number != gage[0]:
                        continue  # one value for all gages
                    valid = columns.get(f"{name.removesuffix('_std')}_valid", columns.get("valid"))
                    if valid is None:
                        valid = np.isfinite(columns[name])
                    yield self._of(
                        (str(side), 0 if once else int(number), name),
                        units[name],
                        {key: columns[key][chosen] for key in (name, "time", "period", "run")},
                        flags[chosen],
                        np.asarray(valid, dtype=np.bool_)[chosen],
                    )

    def _of(
        self,
        key: tuple[str, int, str],
        unit: str,
        columns: Mapping[str, Any],
        flags: IntArray,
        valid: BoolArray,
    ) -> pa.Table:
        channel = self._known.setdefault(key, _Channel(len(self._known) + 1, *key, unit))
        run = columns["run"].astype(np.int64)
        begins = np.array([self._begins.get(int(each), 0.0) for each in run])
        start = columns["time"] + begins
        length = np.where(np.isfinite(columns["period"]), columns["period"], 0.0)
        # a value holds until the next turn, but not over a gap
        end = start + 1.5 * length
        if start.size > 1:
            end[:-1] = np.maximum(np.minimum(end[:-1], start[1:]), start[:-1])
        values = columns[key[2]].astype(np.float64)
        channel.add(start, end, values, flags)
        n = values.size
        return pa.table(
            [
                pa.array(np.full(n, self._container)),
                pa.array(np.full(n, channel.number, dtype=np.int32)),
                pa.array(np.round(1e6 * start).astype(np.int64)),
                pa.array(np.round(1e6 * end).astype(np.int64)),
                pa.array(values),
                pa.array(valid),
                pa.array(flags.astype(np.int64)),
                pa.array(run.astype(np.int32)),
                pa.array([__version__] * n, pa.string()),
                pa.array([self._recipe] * n, pa.string()),
            ],
            schema=SCHEMAS["channels"],
        )

    def metrics(self) -> list[Row]:
        """Return a row of statistics for each channel."""
        return [each.metrics() for each in self._known.values()]

    def tags(self) -> list[Row]:
        """Return the tags of each channel."""
        return [
            {"channel_id": each.number, "key": key, "value": value}
            for each in self._known.values()
            for key, value in each.tags().items()
            if value
        ]


class _Channel:
    """Statistics of one channel, added up part by part."""

    def __init__(self, number: int, wheel: str, gage: int, name: str, unit: str) -> None:
        self.number, self._wheel, self._gage, self._unit = number, wheel, gage, unit
        whole = f"{name}_{gage}" if gage else name
        self.name = f"{wheel}.{whole}" if wheel else whole
        self._quantity = name
        self._kept: list[float] = []
        self._step, self._count, self._known, self._flags = 1, 0, 0, 0
        self._sum = self._squares = 0.0
        self._low, self._high = np.inf, -np.inf
        self._begin, self._end = np.inf, -np.inf

    def add(self, start: FloatArray, end: FloatArray, values: FloatArray, flags: IntArray) -> None:
        """Add values of one part."""
        if not values.size:
            return
        first = -self._count % self._step
        self._kept += values[first :: self._step].tolist()
        self._count += values.size
        while len(self._kept) > MOST_KEPT:
            self._kept, self._step = self._kept[::2], 2 * self._step
        known = values[np.isfinite(values)]
        self._begin = min(self._begin, float(start[0]))
        self._end = max(self._end, float(end[-1]))
        self._flags |= int(np.bitwise_or.reduce(flags))
        if known.size:
            self._known += known.size
            self._sum += float(known.sum())
            self._squares += float((known**2).sum())
            self._low = min(self._low, float(known.min()))
            self._high = max(self._high, float(known.max()))

    def metrics(self) -> Row:
        """Return the row of ``channel_metrics``."""
        kept = np.array([value for value in self._kept if np.isfinite(value)])
        pz1, pz10, pz90, pz99 = (
            np.percentile(kept, (1, 10, 90, 99)).tolist() if kept.size else [None] * 4
        )
        n = self._known
        mean = self._sum / n if n else None
        spread = None
        if mean is not None:
            spread = float(np.sqrt(max(self._squares / n - mean**2, 0.0)))
        length = max(self._end - self._begin, 0.0)
        return {
            "channel_id": self.number,
            "channel_name": self.name,
            "unit": self._unit,
            "value_type": "double",
            "sample_count": self._count,
            "nan_ratio": 1.0 - n / self._count if self._count else None,
            "begin_s": self._begin,
            "end_s": self._end,
            "duration_ms": round(1e3 * length),
            "original_sample_count": self._count,
            "original_sr": self._count / length if length > 0.0 else None,
            "min": self._low if n else None,
            "max": self._high if n else None,
            "mean": mean,
            "std": spread,
            "pz1": pz1,
            "pz10": pz10,
            "pz90": pz90,
            "pz99": pz99,
            "flags": self._flags,
        }

    def tags(self) -> dict[str, str]:
        """Return what the channel is searched by."""
        return {
            "channel_name": self.name,
            "quantity": self._quantity,
            "unit": self._unit,
            "wheel": self._wheel,
            "gage": str(self._gage) if self._gage else "",
            "axes": "iso",
            "flags": ";".join(flag_names(self._flags)),
        }


def every(rows: Sequence[Row], **same: Any) -> list[Row]:
    """Return rows with further columns that are the same in all of them."""
    return [{**row, **same} for row in rows]
