"""Do the forces fit their slips? Dead channels and wrong signs, before anything is fitted."""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.inference.identify.force_data import ForceData

ANGLE_SPAN, RATIO_SPAN = np.deg2rad(1.0), 0.01
"""Least ranges of slip angle and slip ratio that tell anything of the law."""
DEAD = 1e-3
"""Range of a force over the load below which its channel is dead."""
WRONG = 0.5
"""Correlation of the wrong sign from which slip and force cannot belong to one axis system."""


def slips_vary(data: ForceData) -> tuple[bool, bool]:
    """Return whether slip angle and slip ratio vary enough.

    Raises
    ------
    CalibrationError
        If neither does; with the slips that there are.
    """
    angles, ratios = np.ptp(data.slip_angle), np.ptp(data.slip_ratio)
    if angles < ANGLE_SPAN and ratios < RATIO_SPAN:
        only = round(float(np.median(data.slip_angle)), 4)
        raise CalibrationError(
            f"brush fit: the only slip angle is {np.rad2deg(only) + 0.0:.2f} deg "
            f"and the only slip ratio {np.median(data.slip_ratio):.3f}: slip angles span "
            f"{np.rad2deg(angles):.2g} deg and slip ratios {ratios:.2g} over {len(data)} points; "
            f"at least {np.rad2deg(ANGLE_SPAN):g} deg or {RATIO_SPAN:g} is needed; add runs with "
            "other slip angles or slip ratios, or correct the unit of the slip"
        )
    return bool(angles >= ANGLE_SPAN), bool(ratios >= RATIO_SPAN)


def refuse_wrong_forces(data: ForceData, forces: tuple[str, ...]) -> None:
    """Raise if a force is dead over its slip or follows it with the wrong sign.

    Raises
    ------
    CalibrationError
        Naming force, size and slip.
    """
    for name, slip, words, sign in (
        ("Fy", data.slip_angle, "slip angle", -1.0),
        ("Fx", data.slip_ratio, "slip ratio", 1.0),
    ):
        if name not in forces:
            continue
        force = getattr(data, name)
        known = np.isfinite(force)
        share = force[known] / data.load[known]
        if np.ptp(share) < DEAD:
            raise CalibrationError(
                f"brush fit: {name} over Fz stays within {np.ptp(share):.1g} over {known.sum()} "
                f"points while the {words} varies; at least {DEAD:g} is expected; the channel is "
                "dead or its unit wrong; mend or leave out the channel"
            )
        together = sign * _correlation(share, slip[known])
        if together < -WRONG:
            raise CalibrationError(
                f"brush fit: {name} follows the {words} with the wrong sign (correlation "
                f"{sign * together:+.2f}, {sign:+.0f} is expected in ISO axes); "
                "correct axes in campaign.toml, or the factor of the channel in the import map"
            )


def _correlation(force: FloatArray, slip: FloatArray) -> float:
    """Return the correlation of force and slip; 0 where the slip stands still."""
    if np.ptp(slip) == 0.0:
        return 0.0
    return float(np.corrcoef(force, slip)[0, 1])
