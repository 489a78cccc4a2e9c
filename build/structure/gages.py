"""Faults of gages, trigger and rim that are in no catalogue, for every family's frames.

Each law takes what perfect gages show and gives what these show.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from structure.family import LATERAL, PHI, POINTS, Array, Frame, Hidden, Shown

FLATTENED = 0.7
"""Crown's curvature that the contact takes out of the innerliner [1/m]."""
ACROSS = 0.4
"""Strain across per strain along, with the other sign: rubber between cords."""
ROW = np.deg2rad(72.0)
"""Angle of the neighbour's gages behind ours."""


def rotated(frame: Frame, tire: Any, angle: float, strength: float) -> Frame:
    """Gages glued at an angle of `strength` [rad] to the circumference, more at the shoulders.

    eps cos^2 a + eps_y sin^2 a + gamma sin a cos a: the strain across is Poisson's and the
    crown's that the contact flattens, the shear that of strips which bend unlike their neighbours.
    """
    a = strength * (1.0 + LATERAL / 0.12)
    lead, trail = frame.edges[:, 0], frame.edges[:, 1]
    middle, half = 0.5 * (lead + trail), 0.5 * (trail - lead)
    with np.errstate(invalid="ignore"):
        flat = 1.0 / (1.0 + np.abs((PHI[:, None] - middle) / half) ** 8)
    flat = np.nan_to_num(flat)
    across = -ACROSS * frame.strain - tire.innerliner_offset * FLATTENED * flat
    shear = 0.1 * np.gradient(frame.strain, PHI[1] - PHI[0], axis=0)
    shown = frame.strain * np.cos(a) ** 2 + across * np.sin(a) ** 2 + shear * np.sin(a) * np.cos(a)
    return replace(frame, strain=shown, by_load=frame.by_load * np.cos(a) ** 2)


def oval_rim(frame: Frame, tire: Any, angle: float, strength: float) -> Frame:
    """Rim that is oval by `strength` [m]: the load swings twice a turn."""
    swing = strength * frame.stiffness * np.cos(2.0 * (PHI - angle))
    return replace(frame, strain=frame.strain + frame.by_load * swing[:, None])


def missing_tooth(frame: Frame, tire: Any, angle: float, strength: float) -> Frame:
    """Toothed wheel that lacks a tooth of `strength` [rad] at `angle`; teeth are counted.

    From there to the next mark at the top the angle is read too small, so that the wave is shown
    too early.
    """
    return _read(frame, PHI + strength * (angle < PHI))


def crosstalk(frame: Frame, tire: Any, angle: float, strength: float) -> Frame:
    """Share `strength` of a neighbour's channel, whose gages sit 72 deg further round the tire."""
    other = _read(frame, PHI + ROW)
    return replace(
        frame,
        strain=frame.strain + strength * other.strain,
        by_load=frame.by_load + strength * other.by_load,
    )


def warm_shoulder(frame: Frame, tire: Any, angle: float, strength: float) -> Frame:
    """Temperature that rises to one shoulder, with time and with the heat of load and speed.

    The gages lose gain with it: 1 - s o (Fz v / 5 kN 25 m/s) (1 + y / 60 mm) / 2.
    """
    s = frame.setting
    heat = s.place * s.load * s.speed / (5000.0 * 25.0)
    gain = 1.0 - strength * heat * 0.5 * (1.0 + LATERAL / 0.06)
    return replace(frame, strain=frame.strain * gain, by_load=frame.by_load * gain)


def _read(frame: Frame, at: Array) -> Frame:
    """Return a frame that is read at other angles."""
    place = np.mod(at + np.pi, 2.0 * np.pi) / (2.0 * np.pi) * POINTS
    low = np.floor(place).astype(np.intp)
    part = (place - low)[:, None]

    def read(values: Array) -> Array:
        return np.asarray((1.0 - part) * values[low % POINTS] + part * values[(low + 1) % POINTS])

    return replace(frame, strain=read(frame.strain), by_load=read(frame.by_load))


def _hidden(name: str, visible: float, largest: float, signed: bool, law: Shown) -> Hidden:
    return Hidden(name, visible, largest, False, signed, law)


GAGES: Mapping[str, Hidden] = {
    each.name: each
    for each in (
        _hidden("rotated_gages", 0.1, 0.6, False, rotated),
        _hidden("oval_rim", 2e-4, 2e-3, False, oval_rim),
        _hidden("missing_tooth", 0.02, 0.21, False, missing_tooth),
        _hidden("crosstalk", 0.02, 0.2, True, crosstalk),
        _hidden("warm_shoulder", 0.05, 0.5, False, warm_shoulder),
    )
}
"""By name; strengths that show, and the largest."""
