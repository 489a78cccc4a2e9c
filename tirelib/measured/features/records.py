"""Features of whole records: those of a campaign's runs, one after the other."""

from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from typing import Unpack

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.compiled import loaded_core
from tirelib.core.held import Held
from tirelib.measured.features.compiled import CompiledRecords
from tirelib.measured.features.extract import Features, extract_features
from tirelib.measured.signal.lowpass import LowPass
from tirelib.measured.signal.turns import check_gages, cut_turns


class RecordReader:
    """Takes records of the same gages and gives the features of all their turns.

    The compiled core computes, where there is one for this machine (`tirelib.core.compiled`).

    Parameters
    ----------
    lateral : sequence of float, [m]
        Lateral gage positions (ISO), in the order of the samples' rows.
    low_pass : LowPass, optional
    """

    def __init__(self, lateral: Sequence[float], low_pass: LowPass | None = None) -> None:
        core = loaded_core()
        self._lateral = np.asarray(lateral, dtype=np.float64)
        self._low_pass = low_pass or LowPass()
        self._compiled = None if core is None else CompiledRecords(core, self._lateral)
        self._parts: list[Features] = []

    def add(
        self,
        strain: FloatArray,
        rate: float,
        *,
        trigger: BoolArray | None = None,
        start: float = 0.0,
        **held: Unpack[Held],
    ) -> tuple[FloatArray, FloatArray]:
        """Take a record; parameters and errors are those of `tirelib.measured.signal.cut_turns`.

        Parameters
        ----------
        start : float, [s]
            Time of the first sample, which is added to the times of the turns.

        Returns
        -------
        time, omega : arrays, shape (n,), [s], [rad/s]
            Those of its turns.
        """
        if self._compiled is not None and self._compiled.fits(rate):
            check_gages(strain, self._lateral.size)
            return self._compiled.add(strain, rate, self._low_pass, held, trigger, start)
        lateral: Sequence[float] = self._lateral.tolist()
        turns = cut_turns(strain, rate, lateral, trigger=trigger, low_pass=self._low_pass, **held)
        found = extract_features(turns)
        found = replace(found, time=found.time + start, ready=found.ready + start)
        self._close()
        self._parts.append(found)
        return found.time, found.omega

    def features(self) -> Features:
        """Return the features of all records, in their order; there must be one at least."""
        self._close()
        return self._parts[0] if len(self._parts) == 1 else concatenate_features(self._parts)

    def _close(self) -> None:
        """Bring what the core has found to the other parts."""
        if self._compiled is not None:
            self._parts.append(Features(lateral=self._lateral, **self._compiled.take()))


def features_of_record(
    strain: FloatArray,
    rate: float,
    lateral: Sequence[float],
    *,
    trigger: BoolArray | None = None,
    low_pass: LowPass | None = None,
    **held: Unpack[Held],
) -> Features:
    """Return the features of a whole record: `extract_features` of `cut_turns`, in one go.

    Parameters and errors are those of `tirelib.measured.signal.cut_turns`.
    """
    reader = RecordReader(lateral, low_pass)
    reader.add(strain, rate, trigger=trigger, **held)
    return reader.features()


def concatenate_features(parts: Iterable[Features]) -> Features:
    """Join the turns of several runs of the same gages."""
    parts = list(parts)
    names = [field.name for field in fields(Features) if field.name != "lateral"]
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return Features(lateral=parts[0].lateral, **joined)
