"""The stored finite-element reference, and what the ring models say about the same tire."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tirelib.physics.contact import shear
from tirelib.physics.contact.exact import load_exact
from tirelib.physics.contact.radial import load
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.ring import Ring
from tirelib.physics.strain.innerliner import strain_at

Floats = npt.NDArray[np.float64]

GOLDEN = Path(__file__).resolve().parents[1] / "golden"
PAIRS = ("solid", "blocks", "stretchy")
NEAR_CONTACT = 0.6
"""The strain is compared at wheel angles up to here, [rad]; beyond, it is smooth and small."""
HEADROOM = 1.2
FLOOR = 0.003
"""Least bound, where a deviation happens to be near zero: the reference is no better."""
POINTS = np.array([0.2, 0.4, 0.6, 0.8])
"""Where shear is compared, as shares of the reference's edge."""


@cache
def recipe() -> dict[str, dict]:
    return tomllib.loads((GOLDEN / "fem_tire.toml").read_text())


@dataclass(frozen=True)
class Reference:
    """Columns of one case, (n_loads, n_phi), and its summary, (n_loads,)."""

    tire: Mapping[str, float]
    summary: dict[str, Floats]
    columns: dict[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        return self.columns[name]

    @property
    def loads(self) -> Floats:
        return self["load_N"][:, 0]

    @property
    def phi(self) -> Floats:
        return self["phi_rad"][0]


@cache
def reference(case: str) -> Reference:
    path = GOLDEN / f"fem_tire_{case}.csv"
    head, *lines = path.read_text().splitlines()
    names = head.split(",")
    rows = np.loadtxt(lines, delimiter=",")
    n_loads = np.unique(rows[:, 0]).size
    columns = {name: rows[:, k].reshape(n_loads, -1) for k, name in enumerate(names)}
    # The solver's sign is that of the tire on the road; here it is that of the road on the tire.
    columns["shear_N_per_m"] = -columns["shear_N_per_m"]
    summary = {k: np.array(v) for k, v in recipe()["cases"][case].items()}
    return Reference(recipe()["tires"][case.split("_")[0]], summary, columns)


@dataclass(frozen=True)
class Answer:
    """What a ring says at the reference's loads and angles."""

    strain: Floats
    pressure: Floats
    deflection: Floats
    edge: Floats
    shear: Floats | None = None
    """f_t of the road on the tread, [N/m], positive outward where phi > 0."""


def ring_and_tread(fem: Reference, *, extensible: bool) -> tuple[Ring, Tread]:
    tire = fem.tire
    ring = Ring(
        tire["ring_radius_m"],
        tire["bending_stiffness_N_m2"],
        3.0,  # rho A: no bearing on a standing tire
        tire["inflation_pressure_Pa"] * tire["belt_width_m"],
        tire["radial_stiffness_N_per_m2"],
        tire["tangential_stiffness_N_per_m2"],
        extension_stiffness=tire["extension_stiffness_N"] if extensible else np.inf,
    )
    tread = Tread(
        tire["free_radius_m"], tire["tread_stiffness_N_per_m2"], tire["tread_thickness_m"]
    )
    return ring, tread


def tensioned(fem: Reference, *, extensible: bool) -> Answer:
    """Ring under the tension of the inflation pressure, radial tread springs."""
    ring, tread = ring_and_tread(fem, extensible=extensible)
    solved = load(compliance(ring, 0.0, 120), tread, fem.loads)
    strain = strain_at(
        solved.displacement, fem.tire["ring_radius_m"], fem.tire["innerliner_offset_m"], fem.phi
    )
    return Answer(strain, solved.pressure_at(fem.phi), solved.deflection, solved.edges[:, 1])


def sheared(fem: Reference, friction: float, *, extensible: bool = False) -> Answer:
    """The same ring with tread elements that are sheared: the rolling tire's contact."""
    ring, tread = ring_and_tread(fem, extensible=extensible)
    law = shear.Shear(fem.tire["tread_shear_stiffness_N_per_m2"], friction)
    solved = shear.load(compliance(ring, 0.0, 120), tread, law, fem.loads)
    strain = strain_at(
        solved.displacement, fem.tire["ring_radius_m"], fem.tire["innerliner_offset_m"], fem.phi
    )
    tractions = solved.elements_at(fem.phi)
    inside = solved.inside(fem.phi)
    return Answer(
        strain,
        np.where(inside, -tractions.normal, 0.0),
        solved.deflection,
        solved.edges[:, 1],
        np.where(inside, tractions.tangential, 0.0),
    )


def exact(fem: Reference) -> Answer:
    """Ring under tension, extensible, with large displacements."""
    ring, tread = ring_and_tread(fem, extensible=True)
    solved = load_exact(ring, tread, fem.loads)
    strain = solved.strain(fem.tire["innerliner_offset_m"], fem.phi)
    return Answer(strain, solved.pressure_at(fem.phi), solved.deflection, solved.half_angle)


def apart(ring: Answer, fem: Reference) -> dict[str, Floats]:
    """Deviation of the ring, relative to the continuum's value (rms: to its centre tension)."""
    found = fem["beam_strain"]
    centre = found[:, 0]
    near = np.abs(fem.phi) <= NEAR_CONTACT
    inside = fem.phi <= fem.summary["edge_rad"][:, None]
    difference = ring.strain - found

    def rms(where: npt.NDArray[np.bool_]) -> Floats:
        return np.sqrt(np.sum(difference**2 * where, axis=1) / np.sum(where, axis=1)) / centre

    pressure = fem["pressure_N_per_m"]
    return {
        "centre tension": ring.strain[:, 0] / centre - 1.0,
        "deepest compression": ring.strain.min(axis=1) / found.min(axis=1) - 1.0,
        "strain inside": rms(inside & near),
        "strain outside": rms(~inside & near),
        "deflection": ring.deflection / fem.summary["deflection_m"] - 1.0,
        "edge": ring.edge / fem.summary["edge_rad"] - 1.0,
        "centre pressure": ring.pressure[:, 0] / pressure[:, 0] - 1.0,
        "largest pressure": ring.pressure.max(axis=1) / pressure.max(axis=1) - 1.0,
    }


def at_points(fem: Reference, curve: Floats) -> Floats:
    """Return a curve over the angle at `POINTS` of the reference's contact, (n_loads, 4)."""
    edge = fem.summary["edge_rad"]
    return np.array(
        [np.interp(e * POINTS, fem.phi, row) for e, row in zip(edge, curve, strict=True)]
    )


def within(found: dict[str, Floats], measured: dict[str, tuple[float, ...]]) -> None:
    for name, was in measured.items():
        bound = np.maximum(HEADROOM * np.abs(was), FLOOR)
        assert np.all(np.abs(found[name]) <= bound), f"{name}: {found[name]}, bound {bound}"
