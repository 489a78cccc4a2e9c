"""Numbers of a tire that no campaign header holds: what the literature has, or what is assumed."""

from collections.abc import Mapping

from tirelib.core.parameters import Number

_LITERATURE: Mapping[str, tuple[float, float, str]] = {
    "bending_stiffness": (2.1, 0.5, "literature, Table 6-3: 1.57 to 4 N m^2"),
    "tread_stiffness": (7.5e7, 0.5, "literature, Table 6-3: 5.1e7 to 9.9e7 N/m^2"),
    "mass": (3.3, 0.15, "literature, Tables 6-1, 6-2: 3.15 kg/m"),
    "extension_stiffness": (3.2e6, 0.6, "assumed: steel belts, 1 to 10 MN"),
}
OF_PLAIN: Mapping[str, tuple[float, float, str]] = {
    "shear_stiffness": (6e4, 0.7, "assumed: 25 kN and more, of which the belt's tension takes 20"),
    "rotary_inertia": (
        5e-5,
        1.0,
        "rho A h^2 / 12 of 12.5 mm of belt and tread, and room for blocks",
    ),
    "tread_shear_stiffness": (2.5e7, 1.0, "k_t / 3, for rubber keeps its volume"),
    "tread_hardening": (1.0, 0.7, "assumed: blocks bulge into their grooves"),
    "section_pull": (0.03, 1.5, "assumed: growth of the belt and ply arches, 1 to 7 %"),
    "liner_share": (0.3, 1.3, "0 of a gage on the belt itself, .8 under a thick liner"),
    "tread_poisson": (0.3, 1.0, "0 of narrow blocks, .8 of solid rubber"),
    "contact_crown": (0.12, 1.3, "assumed: crowns of .2 to 1.2 1/m, of which a belt keeps some"),
    "tread_spread": (
        0.3,
        1.3,
        "0 of a tread that stands like a brush, about .4 of finite-element treads",
    ),
    "centrifugal_tension": (
        1.0,
        0.01,
        "1 of a belt alone; a third of the sidewalls' mass moves with it, about a half pulls",
    ),
    "creep": (0.004, 1.3, "assumed: rubber's friction grows up to .01 to 1 m/s of sliding, Grosch"),
}
"""Value, relative standard deviation and source of what no campaign header holds."""
_OFFSET_SLOPE = (
    0.0,
    0.03,
    "0 of a liner that keeps its thickness; finite-element tires show -.04 to 0",
)
"""Value, standard deviation and source of the growth of the gages' offset with pressure."""
_RADIAL = (1.0, 2.4e5)
_TANGENTIAL = (0.35, 1.1e5)
"""Slope by pressure [m] and offset [N/m^2] of sidewall stiffnesses, about those of Table 6-3."""


def literature(pressure: float, *, plain: bool = True) -> dict[str, Number]:
    """Return numbers of a tire at a pressure [Pa], with standard deviations and sources.

    Those of the plain tire as well, or of the dissertation's ring alone.
    """
    numbers = {
        name: Number(value, share * value, "literature", source)
        for name, (value, share, source) in {**_LITERATURE, **(OF_PLAIN if plain else {})}.items()
    }
    for prefix, (slope, offset) in (("radial", _RADIAL), ("tangential", _TANGENTIAL)):
        value = slope * pressure + offset
        share = 0.4 if prefix == "radial" else 0.5
        source = "literature, Table 6-3, at this pressure"
        numbers[f"{prefix}_stiffness"] = Number(value, share * value, "literature", source)
        numbers[f"{prefix}_pressure_slope"] = Number(slope, 1.0, "literature", source)
    if plain:
        value, std, source = _OFFSET_SLOPE
        numbers["offset_pressure_slope"] = Number(value, std, "literature", source)
    return numbers
