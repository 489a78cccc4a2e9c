"""Estimates as a table: one row per turn, in the units of the document, with its provenance."""

from collections.abc import Mapping
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.documents import new_file
from tirelib.core.flags import flag_names
from tirelib.core.version import __version__
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.measured.features.extract import Features
from tirelib.measured.signal.quality import UNUSABLE

CONDITIONS = {
    "omega": ("rad/s", 1.0),
    "speed": ("km/h", 3.6),
    "pressure": ("bar", 1e-5),
    "camber": ("deg", 180.0 / pi),
}
"""Conditions of a turn in the table, with unit and factor."""


def turn_columns(features: Features, estimates: Estimates) -> dict[str, tuple[FloatArray, str]]:
    """Return every number of the turns with its unit, by name; arrays of shape (n,).

    Names are those of the document, with the number of the gage from 1 where there is one.
    """
    columns: dict[str, tuple[FloatArray, str]] = {}
    for quantity in QUANTITIES:
        unit, factor = EDGE_UNIT[quantity]
        columns[quantity] = (estimates.value[quantity] * factor, unit)
        columns[f"{quantity}_std"] = (estimates.std[quantity] * factor, unit)
    for name, (unit, factor) in CONDITIONS.items():
        columns[name] = (getattr(features, name) * factor, unit)
    columns["rolling_radius"] = (1e3 * features.speed / features.omega, "mm")
    for gage in range(features.lateral.size):
        columns[f"contact_length_{gage + 1}"] = (1e3 * estimates.contact_length[:, gage], "mm")
        columns[f"offset_{gage + 1}"] = (1e6 * features.offset[:, gage], "ustrain")
        out = (features.gage_flags[:, gage] & int(UNUSABLE)) != 0
        columns[f"gage_out_{gage + 1}"] = (out.astype(np.float64), "1")
    return columns


class TurnTable:
    """A Parquet file of turns that is written part by part, so that memory does not grow.

    Columns: wheel, run, time [s], ready [s], each of `turn_columns` with its unit in the field's
    metadata, ``<quantity>_valid``, ``valid``, ``flags`` (bits of `TurnFlag`), ``flag_names``,
    ``gage_flags_<k>``, ``tirelib`` and ``calibration``.

    Parameters
    ----------
    path : Path
    calibration : str
        SHA-256 of the calibration file.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """

    def __init__(self, path: Path, calibration: str) -> None:
        self.path, self.calibration = path, calibration
        self._writer: Any = None

    def __enter__(self) -> "TurnTable":
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.close()

    def write(
        self,
        wheel: str,
        run: IntArray | int,
        features: Features,
        estimates: Estimates,
        columns: Mapping[str, tuple[FloatArray, str]] | None = None,
    ) -> None:
        """Append turns of one wheel; `run` is a number for all of them or one each."""
        n = len(features)
        if not n:
            return
        numbers = turn_columns(features, estimates) if columns is None else columns
        flags = [int(flag) for flag in estimates.flags]
        fields: list[Any] = [
            ("wheel", pa.array([wheel] * n), ""),
            ("run", pa.array(np.broadcast_to(np.asarray(run, dtype=np.int64), (n,))), ""),
            ("time", pa.array(features.time), "s"),
            ("ready", pa.array(features.ready), "s"),
            ("period", pa.array(features.period), "s"),
            *((name, pa.array(values), unit) for name, (values, unit) in numbers.items()),
            *((f"{q}_valid", pa.array(estimates.valid[q]), "") for q in QUANTITIES),
            ("valid", pa.array(estimates.turn_valid), ""),
            ("flags", pa.array(flags), ""),
            ("flag_names", pa.array([";".join(flag_names(flag)) for flag in flags]), ""),
            *(
                (f"gage_flags_{gage + 1}", pa.array(features.gage_flags[:, gage]), "")
                for gage in range(features.lateral.size)
            ),
            ("tirelib", pa.array([__version__] * n), ""),
            ("calibration", pa.array([self.calibration] * n), ""),
        ]
        schema = pa.schema(
            [
                pa.field(name, values.type, metadata={"unit": unit} if unit else None)
                for name, values, unit in fields
            ]
        )
        table = pa.table([values for _, values, _ in fields], schema=schema)
        if self._writer is None:
            self._open(schema)
        self._writer.write_table(table)

    def _open(self, schema: Any) -> None:
        with new_file(self.path):
            self._writer = pq.ParquetWriter(self.path, schema, compression="zstd")
