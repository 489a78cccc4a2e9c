"""The document of a continuous recording: counted as the turns come, and written as they come."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from tirelib.campaign.recording import Recording
from tirelib.core.documents import new_file, plain, stamped
from tirelib.core.flags import flag_names
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.continuous import WheelTurns
from tirelib.estimators.edge import EDGE_UNIT, FORMAT
from tirelib.estimators.estimate import QUANTITIES
from tirelib.estimators.likeness import suspected
from tirelib.estimators.result import other_tire, turn_row

SLICE = 600.0
"""Length of the slices whose means the document holds, [s]: a drift over a drive shows in them."""


class Totals:
    """Sums over the turns of a recording; the memory is that of its slices of time."""

    def __init__(self, recording: Recording, calibration: Calibration) -> None:
        self._recording, self._calibration = recording, calibration
        self._wheels: dict[str, dict[str, Any]] = {}
        self._until = 0.0

    def add(self, part: WheelTurns) -> None:
        """Count the turns of one part."""
        name = part.wheel.name
        wheel = self._wheels.setdefault(
            name,
            {
                "tire": part.wheel.tire,
                "turns": 0,
                "valid": 0,
                "gaps": -1,
                "missing_samples": 0,
                "flags": Counter(),
                "other_tire": Counter(),
                "sums": {},
            },
        )
        estimates, features = part.estimates, part.features
        wheel["turns"] += len(features)
        wheel["valid"] += int(estimates.turn_valid.sum())
        wheel["gaps"] += int(part.fresh)
        wheel["missing_samples"] += part.missing
        found = other_tire(estimates)
        wheel["other_tire"].update({key: found[key] for key in ("turns", "judged", "extrapolated")})
        for flags, notes in zip(estimates.flags, estimates.notes, strict=True):
            wheel["flags"].update((*flag_names(int(flags)), *notes))
        number = (features.time / SLICE).astype(np.int64)
        for quantity in QUANTITIES:
            good = estimates.valid[quantity]
            value = estimates.value[quantity] * EDGE_UNIT[quantity][1]
            for index in np.unique(number[good]):
                chosen = value[good & (number == index)]
                key = (int(index), quantity)
                count, total = wheel["sums"].get(key, (0, 0.0))
                wheel["sums"][key] = (count + chosen.size, total + float(chosen.sum()))
        self._until = max(self._until, part.until)

    def document(self) -> dict[str, Any]:
        """Return everything of the document but its turns."""
        wheels = {
            name: {
                "tire": wheel["tire"],
                "turns": wheel["turns"],
                "valid": wheel["valid"],
                "gaps": wheel["gaps"],
                "missing_samples": wheel["missing_samples"],
                "flags": dict(wheel["flags"]),
                "other_tire": self._other_tire(wheel["other_tire"]),
                "slices": [
                    {"t": index * SLICE, "quantity": quantity, "n": n, "mean": total / n}
                    for (index, quantity), (n, total) in sorted(wheel["sums"].items())
                ],
            }
            for name, wheel in self._wheels.items()
        }
        nothing = {"rmse": None, "r2": None, "n": 0, "rmse_percent_of_range": None}
        chain = self._calibration.chains[-1]
        return {
            "format": FORMAT,
            "axes": "iso",
            "recording": self._recording.name,
            "tire": self._calibration.tire,
            "duration_s": self._until,
            "turn_count": sum(wheel["turns"] for wheel in wheels.values()),
            "valid_turns": sum(wheel["valid"] for wheel in wheels.values()),
            "wheels": wheels,
            "summary": {
                q: {**nothing, "unit": EDGE_UNIT[q][0]} if chain.has(q) else None
                for q in QUANTITIES
            },
        }

    def _other_tire(self, found: Mapping[str, int]) -> dict[str, Any] | None:
        if not self._calibration.knows_tire:
            return None
        return {**found, "suspected": suspected(found["turns"], found["judged"])}


class TurnsInJson:
    """A JSON document whose turns are written as they come, before its head.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        with new_file(path):
            self._file = path.open("w", encoding="utf-8")
        self._file.write('{"turns": [')
        self._between = "\n"

    def __enter__(self) -> "TurnsInJson":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()

    def write(self, part: WheelTurns) -> None:
        """Write the turns of one part."""
        for row in range(len(part.features)):
            turn = {"wheel": part.wheel.name, **turn_row(row, 0, part.features, part.estimates)}
            self._file.write(self._between + json.dumps(plain(turn), allow_nan=False))
            self._between = ",\n"

    def end(self, head: dict[str, Any]) -> None:
        """Write the rest of the document."""
        text = json.dumps(plain(stamped(head)), indent=1, allow_nan=False)
        self._file.write("\n],\n" + text.lstrip("{").lstrip())
        self._file.write("\n")
