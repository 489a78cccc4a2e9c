"""A small rig recording as columns, its map, and writers of every format."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import tomli_w

FloatArray = npt.NDArray[np.float64]
Columns = dict[str, FloatArray]

UNITS = {
    "ET": "s",
    "FX": "N",
    "FY": "N",
    "FZ": "N",
    "SA": "deg",
    "IA": "deg",
    "P": "kPa",
    "V": "km/h",
    "TSTC": "degC",
}


def sae_columns(rows: int = 400, seed: int = 1) -> Columns:
    """A cornering sweep in SAE axes: Fz negative, Fy against the slip angle."""
    random = np.random.default_rng(seed)
    time = 10.0 + 0.01 * np.arange(rows)
    angle = 6.0 * np.sin(2.0 * np.pi * np.arange(rows) / rows)
    load = 1500.0 + 20.0 * random.standard_normal(rows)
    return {
        "ET": np.round(time, 6),
        "FX": 5.0 * random.standard_normal(rows),
        "FY": -350.0 * angle + 10.0 * random.standard_normal(rows),
        "FZ": -load,
        "SA": angle,
        "IA": 0.01 * random.standard_normal(rows),
        "P": 83.0 + 0.1 * random.standard_normal(rows),
        "V": 40.0 + 0.05 * random.standard_normal(rows),
        "TSTC": 50.0 + 0.01 * np.arange(rows),
    }


def sae_map(**changes: Any) -> dict[str, Any]:
    """The map of `sae_columns`; a change of None takes a key out."""
    document: dict[str, Any] = {
        "format": "tirelib-map/1",
        "axes": "sae",
        "name": "made-up sweep",
        "kind": "sweep",
        "tire": {"free_radius_m": 0.203},
        "channels": {
            "time": {"column": "ET", "unit": "s"},
            "Fx": {"column": "FX", "unit": "N"},
            "Fy": {"column": "FY", "unit": "N"},
            "Fz": {"column": "FZ", "unit": "N"},
            "slip_angle": {"column": "SA", "unit": "deg"},
            "camber": {"column": "IA", "unit": "deg"},
            "pressure": {"column": "P", "unit": "kPa"},
            "speed": {"column": "V", "unit": "km/h"},
            "tread_temperature": {"column": "TSTC", "unit": "degC"},
        },
    }
    document.update(changes)
    return {key: value for key, value in document.items() if value is not None}


def with_channels(**changes: Any) -> dict[str, Any]:
    """The map of `sae_columns` with other channels; None takes one out."""
    document = sae_map()
    document["channels"].update(changes)
    document["channels"] = {k: v for k, v in document["channels"].items() if v is not None}
    return document


def write_map(folder: Path, document: Mapping[str, Any] | str) -> Path:
    path = folder / "map.toml"
    text = document if isinstance(document, str) else tomli_w.dumps(document)
    path.write_text(text, encoding="utf-8")
    return path


def write_csv(
    path: Path,
    columns: Mapping[str, FloatArray],
    *,
    separator: str = ",",
    decimal: str = ".",
    heading: str | None = None,
) -> Path:
    rows = zip(*columns.values(), strict=True)
    lines = [separator.join(columns) if heading is None else heading]
    lines += [
        separator.join(repr(float(x)).replace(".", decimal) for x in row).replace("nan", "")
        for row in rows
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_mat5(path: Path, columns: Mapping[str, Any]) -> Path:
    from scipy.io import savemat

    savemat(path, {name: np.asarray(values) for name, values in columns.items()}, oned_as="column")
    return path


def write_mat73(path: Path, columns: Mapping[str, FloatArray], units: bool = False) -> Path:
    """Write what MATLAB's ``save -v7.3`` does: 512 bytes of heading, then HDF5, transposed."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            item = file.create_dataset(name, data=np.atleast_2d(values))
            item.attrs["MATLAB_class"] = np.bytes_("double")
        if units:
            group = file.create_group("channel")
            for key, texts in (("name", list(columns)), ("units", [UNITS[n] for n in columns])):
                cells = []
                for number, text in enumerate(texts):
                    codes = np.array([[ord(c)] for c in text], dtype=np.uint16)
                    cell = file.create_dataset(f"#refs#/{key}{number}", data=codes)
                    cell.attrs["MATLAB_class"] = np.bytes_("char")
                    cells.append(cell.ref)
                group.create_dataset(key, data=np.array([cells], dtype=h5py.ref_dtype))
    heading = b"MATLAB 7.3 MAT-file, made by a test".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as stream:
        stream.write(heading.ljust(512, b"\0"))
    return path


def write_parquet(path: Path, columns: Mapping[str, Any]) -> Path:
    import pandas as pd

    pd.DataFrame(dict(columns)).to_parquet(path, index=False)
    return path
