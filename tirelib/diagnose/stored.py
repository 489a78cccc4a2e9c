"""The structural ensemble kept in a user's cache folder, under the hash of all that it depends on.

``TIRELIB_CACHE`` names another folder; empty or ``off`` switches the store off. A file that cannot
be read or written is no fault: the ensemble is then computed.
"""

import hashlib
import inspect
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tirelib import __version__
from tirelib.arrays import FloatArray
from tirelib.diagnose import ensemble, variant
from tirelib.diagnose.ensemble import MEMBERS, Variants, variants
from tirelib.diagnose.refit import Refit
from tirelib.identify import delay
from tirelib.identify.waveform_fit import Data

VARIABLE = "TIRELIB_CACHE"
OFF = ("", "off", "0", "none")
KEPT = 20
"""Files that are kept, the latest ones."""


def cache_folder() -> Path | None:
    """Return the folder of stored ensembles, or None if the store is switched off."""
    named = os.environ.get(VARIABLE)
    if named is not None:
        return None if named.strip().lower() in OFF else Path(named)
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "tirelib" / "ensembles"


def ensemble_of(
    data: Data,
    model: Refit,
    *,
    noise: float,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Variants:
    """Return the variants of a model, from the store if they are there.

    Parameters as in `structural_ensemble`.
    """
    folder = cache_folder()
    if folder is None:
        made = variants(data, model, members=members, seed=seed, progress=progress)
        return Variants(made, noise)
    file = folder / f"{key_of(data, model, members, seed)}.npy"
    shape = (members, data.strain.size)
    found = _read(file, shape)
    if found is not None:
        return Variants(found, noise)
    made = variants(data, model, members=members, seed=seed, progress=progress)
    if made.shape == shape:
        # what is returned now is what a later call reads
        made = made.astype(np.float32).astype(np.float64)
        _write(file, made)
    return Variants(made, noise)


def key_of(data: Data, model: Refit, members: int, seed: int) -> str:
    """Return the hash of model, plan, ensemble's constants, laws and version."""
    told = hashlib.sha256()

    def add(*items: object) -> None:
        for item in items:
            if isinstance(item, np.ndarray | float):
                # a fit that starts elsewhere ends within a millionth: the same ensemble
                told.update(
                    np.array2string(
                        np.asarray(item, dtype=float).ravel(),
                        precision=5,
                        threshold=10**9,
                        floatmode="maxprec",
                    ).encode()
                )
            else:
                told.update(repr(item).encode())
            told.update(b";")

    add(__version__, members, seed, data.noise, data.angle_std, data.tolerance)
    add(repr(data.low_pass))
    for name in data.points.__slots__:
        add(name, np.asarray(getattr(data.points, name)))
    for name in sorted(model.values):
        add(name, np.asarray(model.values[name], dtype=float))
    for effect, strength in zip(model.effects, model.strengths, strict=True):
        add(effect.name, strength)
    for module in (delay, ensemble, variant):
        told.update(inspect.getsource(module).encode())
    return told.hexdigest()


def _read(file: Path, shape: tuple[int, int]) -> FloatArray | None:
    try:
        found = np.load(file, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    if found.shape != shape or not np.isfinite(found).all():
        return None
    return np.asarray(found, dtype=np.float64)


def _write(file: Path, rests: FloatArray) -> None:
    """Write a file under another name first: two programs may write at once."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=file.parent, suffix=".part")
        with os.fdopen(handle, "wb") as stream:
            np.save(stream, rests.astype(np.float32))
        Path(name).replace(file)
        stored = sorted(file.parent.glob("*.npy"), key=lambda path: path.stat().st_mtime)
        for old in stored[:-KEPT]:
            old.unlink(missing_ok=True)
    except OSError:
        return
