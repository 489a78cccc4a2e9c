"""What a calibration did not vary: beyond it a wheel in a vehicle is flagged at once."""

import math
from collections.abc import Iterator

from tirelib.estimators.calibration import Calibration

LEAST_CAMBER = math.radians(1.0)
"""Calibrated cambers closer together than this were not varied but badly set, [rad]."""


def not_varied(known: Calibration) -> Iterator[str]:
    """Yield each condition that was not varied, with where the calibration holds all the same."""
    full = known.chains[-1]
    laws, degrees = full.laws, math.degrees(1.0)
    if not laws.pressure_fitted:
        low, high = (1e-5 * end for end in laws.pressure_range)
        yield f"pressure: holds for {low:.2f} to {high:.2f} bar"
    if not laws.speed_fitted:
        low, high = (3.6 * end for end in laws.speed_range)
        yield f"speed: holds for {low:.0f} to {high:.0f} km/h"
    for guard in full.guards["Fy"] or full.guards["Fz"]:
        if guard.name == "camber" and guard.high - guard.low < LEAST_CAMBER:
            low, high = (
                degrees * end for end in (guard.low - guard.slack, guard.high + guard.slack)
            )
            yield f"camber: Fz, alpha and Fy hold for {low:.2f} to {high:.2f} deg"
    if not any(guard.name == "kappa" for guard in full.guards["kappa"]):
        yield "slip ratio: braking and driving are not calibrated"
