"""The tire: every constant of the rolling continuum, and how a tire is drawn."""

from dataclasses import dataclass, field, replace

import numpy as np

from continuum.material import Rubber, rubber
from continuum.polar import Array
from continuum.sidewall import Arch

LATERAL = np.array([-0.06, -0.03, 0.0, 0.03, 0.06])
"""Gages across the width, y to the left [m]."""
STRIP = np.array([2, 1, 0, 1, 2])
"""Strip under each gage: centre, middle, shoulder; straight rolling is symmetric."""
STRIPS = np.array([0.0, 0.03, 0.06])
"""Distance of the strips from the middle plane [m]."""
SHARE = np.array([0.2, 0.4, 0.4])
"""Part of the width that a strip and its mirror image stand for."""

ROAD_STIFFNESS = 6.0e9
"""Pressure per depth of the surface below the road [Pa/m]: asperities, some twenty times stiffer
than the tread's 4 MPa over 12 mm; they count in k_t."""


FILM = 1e-3
"""Gap at which water ahead of the contact presses most [m]."""
LINER_DENSITY = 1100.0
"""[kg/m^3]"""


@dataclass(frozen=True)
class Tire:
    """Constants of a tire, SI, for the whole width.

    Attributes
    ----------
    name : str
    ring_radius, belt_width : float
        Radius of the belt's middle line, not inflated; width of belt, tread and pressure [m].
    extension, bending, shear : float
        EA [N], EI [N m^2] and GA [N] of the belt layer, which fix its thickness and moduli.
    innerliner_offset : float
        Gages from the belt's middle line, outward positive [m].
    liner_modulus, tread_density, belt_density : float
        [Pa], [kg/m^3]; the tread's is the mean of rubber and grooves.
    tread_thickness, tread_upright, tread_shear, tread_along : float
        Thickness from the belt to the crown's surface [m]; C_rr, shear modulus and modulus along
        the circumference, grooves included [Pa]. A tread of blocks has little of the last.
    crown_curvature : float
        A strip at y has its surface y^2 c / 2 lower than the crown [1/m].
    crown_bending, crown_shear : float
        Bending stiffness across the belt [N m], and its in-plane shear stiffness G t [N/m].
    arch : Arch
        The sidewall's section.
    shoulder_share : float
        Part of the sidewalls' force that the two shoulder strips take; the rest goes as the width.
    friction : float
        Coulomb coefficient of tread and road [1].
    creep : float
        Slip at which friction has 71 % of its full value, as a share of the rolling radius [1].
    damping : float
        Relaxation time of the sidewalls, force k (w + tau dw/dt) [s].
    softening : float
        Share of the arch's own nonlinearity that the sidewall's force has [1].
    roughness : float
        Height of asperities: q = k h ln(1 + exp(depth / h)); zero is a smooth road [m].
    water : float
        Pressure of water ahead of the contact, greatest where the gap is `FILM` [Pa].
    """

    name: str = "continuum"
    ring_radius: float = 0.302
    belt_width: float = 0.168
    extension: float = 4.6e6
    bending: float = 2.2
    shear: float = 7.0e4
    innerliner_offset: float = -0.003
    liner_modulus: float = 6.0e6
    tread_density: float = 900.0
    belt_density: float = 2200.0
    tread_thickness: float = 0.0125
    tread_upright: float = 4.2e6
    tread_shear: float = 1.1e6
    tread_along: float = 1.2e6
    crown_curvature: float = 0.7
    crown_bending: float = 2.0
    crown_shear: float = 1.0e5
    arch: Arch = field(default_factory=Arch)
    shoulder_share: float = 0.5
    friction: float = 0.0
    creep: float = 3e-3
    damping: float = 0.0
    softening: float = 0.0
    roughness: float = 0.0
    water: float = 0.0

    def __post_init__(self) -> None:
        room = -self.innerliner_offset - 0.5 * self.belt_thickness
        if room < 2e-4:
            raise ValueError(
                f"continuum tire, innerliner_offset = {1e3 * self.innerliner_offset:.3g} mm; the "
                f"belt of {1e3 * self.belt_thickness:.3g} mm needs it below "
                f"{-500.0 * self.belt_thickness - 0.2:.3g} mm; give a deeper innerliner, or a "
                "belt with less EI for its EA"
            )

    @property
    def belt_thickness(self) -> float:
        """Thickness of a homogeneous layer with this EI and EA [m]."""
        return float(np.sqrt(12.0 * self.bending / self.extension))

    @property
    def free_radius(self) -> float:
        """Radius of the crown's surface, not inflated [m]."""
        return self.ring_radius + 0.5 * self.belt_thickness + self.tread_thickness

    @property
    def layers(self) -> tuple[Rubber, ...]:
        """Liner, belt, tread; the belt carries the mass of the others (see `carried`)."""
        area = self.belt_width * self.belt_thickness
        along, shear = self.extension / area, 1.2 * self.shear / area
        tread = rubber(self.tread_upright, self.tread_shear, self.tread_along, 0.0)
        liner = self.liner_modulus
        return (
            rubber(liner, 0.3 * liner, 0.8 * liner, 0.0),
            rubber(3.0 * shear, shear, along, self.belt_density),
            tread,
        )

    def carried(self, strip: int) -> tuple[float, float]:
        """Return mass [kg/m] and height over the belt's middle [m] of liner and tread.

        They ride on the belt's sections, of which they make the rotary inertia. Waves of their own
        (rubber without loss carries sound at 35 m/s along the tread) are left out.
        """
        heights = self.radii(strip) - self.ring_radius
        density = np.array([LINER_DENSITY, 0.0, self.tread_density])
        mass = self.belt_width * density * np.diff(heights)
        middle = 0.5 * (heights[1:] + heights[:-1])
        mass = mass * (1.0 + middle / self.ring_radius)
        return float(mass.sum()), float(mass @ middle / mass.sum())

    def contact(self, depth: Array) -> tuple[Array, Array]:
        """Return the road's pressure on the surface and its derivative; never a tension."""
        if self.roughness:
            x = depth / self.roughness
            return (
                ROAD_STIFFNESS * self.roughness * np.logaddexp(0.0, x),
                ROAD_STIFFNESS / (1.0 + np.exp(np.minimum(-x, 500.0))),
            )
        slope = np.where(depth > 0.0, ROAD_STIFFNESS, 0.0)
        return slope * depth, slope

    def wedge(self, gap: Array) -> tuple[Array, Array]:
        """Return the water's pressure over the gap ahead of the contact, and its derivative."""
        x = np.maximum(gap, 0.0) / FILM
        bell = self.water * np.exp(1.0 - x)
        return bell * x, bell * (1.0 - x) / FILM * (gap > 0.0)

    def radii(self, strip: int) -> Array:
        """Radii of the borders of a strip's layers, from inside [m]."""
        outer = 0.5 * self.belt_thickness
        surface = outer + self.tread_thickness - 0.5 * self.crown_curvature * STRIPS[strip] ** 2
        return self.ring_radius + np.array([self.innerliner_offset, -outer, outer, surface])

    @property
    def sidewall_share(self) -> Array:
        """Share of the sidewalls' force on each strip, with its mirror image."""
        ends = np.array([0.0, 0.0, self.shoulder_share])
        return np.asarray((1.0 - self.shoulder_share) * SHARE + ends)

    @property
    def section(self) -> dict[str, float]:
        """What a ring model would call EA, EI, GA, k_t and m of the whole section, SI.

        The laminate's formulas about its own neutral line; k_t from the belt's middle to the
        crown's surface, per length of the belt's middle line.
        """
        radii, layers, width = self.radii(0), self.layers, self.belt_width
        heights = radii - self.ring_radius
        along = np.array([m.along for m in layers])
        first, square, cube = (np.diff(heights**k) / k for k in (1, 2, 3))
        ea = width * float(along @ first)
        neutral = width * float(along @ square) / ea
        ei = width * float(along @ cube) - ea * neutral**2
        middle = 0.5 * (radii[1:] + radii[:-1]) / self.ring_radius
        upright = np.array([m.upright for m in layers])
        way = np.array([0.0, 0.5, 1.0]) * np.diff(heights) / (upright * width * middle)
        road = self.ring_radius / (ROAD_STIFFNESS * width * radii[-1])
        belt = width * self.belt_density * self.belt_thickness
        return {
            "EA": ea,
            "EI": ei,
            "GA": self.shear,
            "k_t": 1.0 / float(way.sum() + road),
            "mass": belt + float(SHARE @ [self.carried(i)[0] for i in range(3)]),
            "innerliner_offset": self.innerliner_offset - neutral,
        }


@dataclass(frozen=True)
class Condition:
    """A steady state of straight, free rolling: load [N], gauge pressure [Pa], speed [m/s]."""

    load: float
    pressure: float
    speed: float


def draw(seed: int) -> Tire:
    """Draw a plain tire: every constant, widely, without friction, damping or softening.

    Stiffnesses are spread evenly in their logarithm. A draw whose innerliner would lie inside its
    belt is drawn again.
    """
    rng = np.random.default_rng([seed, 4101])
    while True:
        try:
            return _draw(rng, f"continuum {seed}")
        except ValueError:
            continue


def _draw(rng: np.random.Generator, name: str) -> Tire:
    base = Tire()

    def times(value: float, factor: float) -> float:
        return value * float(factor ** rng.uniform(-1.0, 1.0))

    height = base.arch.height * float(rng.uniform(0.85, 1.15))
    arch = replace(
        base.arch,
        height=height,
        lower=float(rng.uniform(0.95, 1.55)),
        upper=float(rng.uniform(1.43, 1.57)),
        ply=times(base.arch.ply, 1.5),
        thickness=times(base.arch.thickness, 1.5),
        along=times(base.arch.along, 2.0),
        shear=times(base.arch.shear, 2.0),
    )
    return replace(
        base,
        name=name,
        ring_radius=base.ring_radius * float(rng.uniform(0.94, 1.06)),
        belt_width=base.belt_width * float(rng.uniform(0.88, 1.12)),
        extension=times(base.extension, 1.7),
        bending=times(base.bending, 1.7),
        shear=times(base.shear, 2.0),
        innerliner_offset=times(base.innerliner_offset, 1.5),
        liner_modulus=times(base.liner_modulus, 1.5),
        tread_density=times(base.tread_density, 1.2),
        belt_density=times(base.belt_density, 1.3),
        tread_thickness=times(base.tread_thickness, 1.3),
        tread_upright=times(base.tread_upright, 1.5),
        tread_shear=times(base.tread_shear, 1.5),
        tread_along=times(base.tread_along, 2.0),
        crown_curvature=float(rng.uniform(0.2, 1.2)),
        crown_bending=times(base.crown_bending, 2.0),
        crown_shear=times(base.crown_shear, 1.5),
        arch=arch,
        shoulder_share=float(rng.uniform(0.2, 0.8)),
    )
