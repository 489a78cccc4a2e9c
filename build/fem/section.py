"""The tire section that the finite elements stand for: layers, stiffness, and their checks.

Polar angle ``phi`` is 0 at the road's normal, radii are measured from the axle, ``y`` from the
belt's middle line at radius R (outward positive). The moduli are chosen so that the whole section,
tread included, has the bending stiffness EI, and the way from the middle line to the tread's
surface has the radial stiffness kt of a ring model with tread springs.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Target:
    """The ring model's numbers, SI."""

    ring_radius: float = 0.302
    radial_stiffness: float = 4.5e5
    tangential_stiffness: float = 1.6e5
    bending_stiffness: float = 1.8
    tread_stiffness: float = 8.5e7
    pressure: float = 2.1e5
    width: float = 0.165
    tread_thickness: float = 0.012
    outer_offset: float = 0.0135
    liner_offset: float = -0.0033
    core_thickness: float = 0.001
    """Thickness of the stiff layer in the belt's middle: the thinner, the less it stretches."""
    coat_modulus: float = 60.0e6
    liner_modulus: float = 6.0e6
    poisson: float = 1.0 / 3.0
    """Ratio of all rubber, in plane stress. 1/3 makes the shear stiffness a third of kt."""
    along: float = 1.0
    """Modulus of the tread along the circumference over the radial one: 1 is solid rubber, a
    small number is a tread cut into blocks."""


@dataclass(frozen=True)
class Layer:
    """One layer between two distances from the middle line; plane-stress constants."""

    name: str
    inner: float
    outer: float
    modulus: float
    poisson: float
    along: float = 1.0

    @property
    def confined(self) -> float:
        """Radial modulus where the layer cannot strain along the circumference, [Pa]."""
        return self.modulus / (1.0 - self.along * self.poisson**2)

    @property
    def shear(self) -> float:
        """Shear modulus, [Pa]: that of the isotropic rubber, whatever `along` is."""
        return self.modulus / (2.0 * (1.0 + self.poisson))

    def bending(self, width: float) -> float:
        """Share of the section's bending stiffness, [N m^2]."""
        return self.along * self.modulus * width * (self.outer**3 - self.inner**3) / 3.0

    def stretching(self, width: float) -> float:
        """Share of the section's tensile stiffness, [N]."""
        return self.along * self.modulus * width * (self.outer - self.inner)

    def radial_compliance(self, radius: float, width: float) -> float:
        """Compliance of the layer between two circles, per length of the middle line, [m^2/N]."""
        ratio = (radius + self.outer) / (radius + self.inner)
        return radius * float(np.log(ratio)) / (self.confined * width)


@dataclass(frozen=True)
class Section:
    """Layers from inside to outside, and what they add up to."""

    target: Target
    layers: tuple[Layer, ...]

    @property
    def bending(self) -> float:
        """EI of the whole section about the middle line, [N m^2]."""
        return sum(layer.bending(self.target.width) for layer in self.layers)

    @property
    def stretching(self) -> float:
        """EA of the whole section, [N]."""
        return sum(layer.stretching(self.target.width) for layer in self.layers)

    @property
    def tread_stiffness(self) -> float:
        """Radial stiffness from the middle line to the surface per length at R, [N/m^2]."""
        t = self.target
        way = [layer for layer in self.layers if layer.outer > 0.0 and layer.name != "core"]
        return 1.0 / sum(layer.radial_compliance(t.ring_radius, t.width) for layer in way)

    @property
    def shear_stiffness(self) -> float:
        """Shear stiffness of the tread per length at R, [N/m^2]."""
        t = self.target
        tread = self.layers[-1]
        return tread.shear * t.width / (tread.outer - tread.inner)

    def share(self, name: str) -> float:
        """Part of EI that the layers of this name carry."""
        part = sum(x.bending(self.target.width) for x in self.layers if x.name == name)
        return part / self.bending


def section(target: Target) -> Section:
    """Choose the moduli of tread and core for the target's kt and EI."""
    half = target.core_thickness / 2.0
    base = target.outer_offset - target.tread_thickness
    coat = [
        Layer("coat", -base, -half, target.coat_modulus, target.poisson),
        Layer("coat", half, base, target.coat_modulus, target.poisson),
    ]
    liner = Layer("liner", target.liner_offset, -base, target.liner_modulus, target.poisson)
    unit = Layer("tread", base, target.outer_offset, 1.0, target.poisson, target.along)
    left = 1.0 / target.tread_stiffness
    left -= coat[1].radial_compliance(target.ring_radius, target.width)
    modulus = unit.radial_compliance(target.ring_radius, target.width) / left
    tread = Layer("tread", base, target.outer_offset, modulus, target.poisson, target.along)
    rest = sum(x.bending(target.width) for x in (*coat, liner, tread))
    core = (target.bending_stiffness - rest) * 12.0 / (target.width * target.core_thickness**3)
    if core <= 0.0:
        raise ValueError(
            f"section: the rubber alone has EI = {rest:.3g} N m^2, more than the target's "
            f"{target.bending_stiffness:.3g}; lower Target.along or raise bending_stiffness"
        )
    return Section(
        target,
        (liner, coat[0], Layer("core", -half, half, core, 0.0), coat[1], tread),
    )
