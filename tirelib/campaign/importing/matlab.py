"""MATLAB files, version 5 (scipy) and 7.3 (HDF5, h5py), as columns.

A vector is a column, a matrix one column for each of its shorter side (``strain(:,2)``), a field of
a struct ``run.FZ``, a scalar a constant. A struct with the fields ``name`` and ``units`` (tire test
consortium) states the units of the vectors next to it.
"""

import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.campaign.importing.columns import Column, Table, refusal

MAGIC = b"MATLAB 5.0 MAT-file"
MAGIC_73 = b"MATLAB 7.3 MAT-file"
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"

_WIDEST = 64  # columns of a matrix; wider ones are pictures or maps
_LONGEST_TEXT = 80  # characters of a text that are shown


def read_mat5(path: Path) -> Table:
    """Read a MATLAB file of version 5 to 7.

    Raises
    ------
    FormatError
        If it is damaged or truncated.
    """
    from scipy.io import loadmat

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            content = loadmat(path, simplify_cells=True)
        except MemoryError:
            raise
        except Exception as error:  # the reader has no exception class of its own for damage
            raise _damaged(path, error) from error
    notes = tuple(f"the MATLAB reader says: {item.message}" for item in caught)
    return _table(path, "MATLAB 5", content, notes)


def read_mat73(path: Path) -> Table:
    """Read a MATLAB file of version 7.3, which is an HDF5 file.

    Raises
    ------
    FormatError
        If it is damaged or truncated.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            content = {key: _plain(file, item) for key, item in file.items() if key[0] != "#"}
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise _damaged(path, error) from error
    return _table(path, "MATLAB 7.3", content, ())


def _damaged(path: Path, error: Exception) -> Exception:
    reason = str(error)[:80] or type(error).__name__
    return refusal(
        str(path),
        f"truncated or damaged MATLAB file of {path.stat().st_size} bytes (reader: {reason})",
        "a complete file is needed",
        "copy it again, or save it again from MATLAB",
    )


def _plain(file: Any, item: Any) -> Any:
    """Return an HDF5 item as the reader of version 5 would give it."""
    import h5py

    if isinstance(item, h5py.Group):
        return {key: _plain(file, child) for key, child in item.items()}
    if item.attrs.get("MATLAB_empty", 0):
        return np.empty(0)
    values = item[()]
    if item.dtype.kind == "O":  # a cell array: references to its elements
        return np.array([_plain(file, file[ref]) for ref in np.ravel(values)], dtype=object)
    if item.attrs.get("MATLAB_class", b"") in (b"char", "char"):
        return "".join(chr(code) for code in np.ravel(values, order="F"))
    return np.squeeze(np.asarray(values).T)  # MATLAB's columns are HDF5's rows


def _table(path: Path, form: str, content: Mapping[str, Any], notes: tuple[str, ...]) -> Table:
    columns: dict[str, Column] = {}
    left_out: dict[str, str] = {}
    for name, value, units in _leaves(content, ""):
        array = np.asarray(value)
        if array.dtype.kind == "U" and array.size == 1:
            left_out[name] = f"it holds the text {str(array)[:_LONGEST_TEXT]!r}, no numbers"
        elif array.dtype.kind not in "biuf" or array.ndim > 2:
            left_out[name] = f"it holds {array.dtype} of shape {array.shape}, no vector of numbers"
        elif array.ndim == 2 and min(array.shape) > _WIDEST:
            left_out[name] = f"it has {array.shape[0]} x {array.shape[1]} elements, no table"
        else:
            for key, column in _vectors(name, array.astype(np.float64)):
                columns[key] = Column(
                    key, column, units.get(name.rpartition(".")[2], ""), constant=array.size == 1
                )
    return Table(str(path), form, columns, left_out, notes)


def _leaves(
    content: Mapping[str, Any], prefix: str
) -> Iterator[tuple[str, Any, Mapping[str, str]]]:
    """Yield every value that is not a struct, with its dotted name and its stated units."""
    units = _units(content)
    for key, value in content.items():
        if key.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value, units


def _units(content: Mapping[str, Any]) -> dict[str, str]:
    found: dict[str, str] = {}
    for value in content.values():
        if isinstance(value, Mapping) and {"name", "units"} <= set(value):
            names, units = np.ravel(value["name"]), np.ravel(value["units"])
            if names.size == units.size:
                found.update(zip(map(str, names), map(str, units), strict=True))
    return found


def _vectors(name: str, array: Any) -> Iterator[tuple[str, Any]]:
    array = np.squeeze(array)
    if array.ndim < 2:
        yield name, np.atleast_1d(array)
    elif array.shape[0] >= array.shape[1]:
        yield from ((f"{name}(:,{k})", column) for k, column in enumerate(array.T, start=1))
    else:
        yield from ((f"{name}({k},:)", row) for k, row in enumerate(array, start=1))
