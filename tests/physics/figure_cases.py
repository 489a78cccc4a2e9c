"""Simulations behind the dissertation's figures, each made once, and how the tests read them."""

from functools import cache

import numpy as np
import pytest
from ring_figures import cases

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import Tire, read_tire
from tirelib.report.simulation import Simulation

ROLLING, TEST = "table-6-1", "table-6-2-195-65r15"
CONTACTS = ("radial", "shear")
CASE = pytest.mark.parametrize("contact", CONTACTS)
STIFF, SOFT = cases.LUMPED_STIFFNESS, 1.144
"""Bending stiffness with the belt's tension lumped into it, and without, [N m^2]."""


@cache
def tire(name: str) -> Tire:
    return read_tire(name).tire


@cache
def deflections(contact: str) -> Simulation:
    return cases.by_deflection(tire(ROLLING), contact)


@cache
def loads(contact: str, damping: float = 0.0, speed: float = 0.0) -> Simulation:
    return cases.by_load(tire(TEST), contact, damping, speed)


@cache
def inflations(damping: float = 0.0, speed: float = 0.0) -> Simulation:
    return cases.by_inflation(tire(TEST), damping, speed)


@cache
def speeds(damping: float) -> Simulation:
    return cases.by_speed(tire(TEST), damping)


@cache
def standing(stiffness: float) -> cases.StaticRing:
    return cases.standing(tire(ROLLING).changed(bending_stiffness=stiffness))


def flatness(done: Simulation) -> FloatArray:
    """Pressure at the middle over the largest: 1 is convex, less is concave."""
    return done.middle_pressure / done.largest_pressure


def crown(done: Simulation, point: int) -> float:
    """Place of the largest pressure, 0 at the middle of the contact and 1 at an edge."""
    top = done.phi[np.argmax(done.pressure[point])]
    lead, trail = done.edges[point]
    return float(abs(top - 0.5 * (lead + trail)) / (0.5 * (trail - lead)))


def grows(values: object) -> bool:
    return bool((np.diff(np.asarray(values, dtype=float)) > 0.0).all())
