"""How far a ring-equivalent parameter may lie from a laboratory's, beyond the fit.

The misfit function in the fit widens its intervals, but a smooth function with a prior does not
know everything that a ring leaves out (strips across the width, a crowned tread, damping). The rest
was measured: 16 tires of the numerical rig, which shares no code with the ring, with every constant
drawn widely, were identified from 19-run campaigns, and the relative error against laboratory tests
on them is what stands here (rms, bias included, rounded up). Section inertia, tread shear and
hardening are barely informed: what stands here is the prior's size or, of tires whose tread grips,
the error. `build/proof/run.py --seeds 101-116` measures it again.
"""

from collections.abc import Mapping
from types import MappingProxyType

STRUCTURE_STD: Mapping[str, float] = MappingProxyType(
    {
        "bending_stiffness": 0.08,
        "radial_stiffness": 0.01,
        "tangential_stiffness": 0.07,
        "tread_stiffness": 0.07,
        "innerliner_offset": 0.013,
        "radial_pressure_slope": 0.06,
        "tangential_pressure_slope": 0.45,
        "extension_stiffness": 0.06,
        "shear_stiffness": 0.17,
        "rotary_inertia": 1.0,
        "tread_shear_stiffness": 0.4,
        "tread_hardening": 0.6,
        "section_pull": 0.5,
        "liner_share": 1.0,
        "offset_pressure_slope": 0.0,
        "tread_poisson": 1.0,
        "contact_crown": 1.3,
        "creep": 1.3,
        "tread_spread": 1.3,
        "centrifugal_tension": 0.01,
    }
)
"""Standard deviation by parameter: of the logarithm of the value, or in units of the value (slopes:
of a typical slope)."""

WITHOUT_SHEAR: Mapping[str, float] = MappingProxyType(
    {
        "bending_stiffness": 0.10,
        "radial_stiffness": 0.025,
        "tangential_stiffness": 0.20,
        "tread_stiffness": 0.215,
        "innerliner_offset": 0.009,
        "radial_pressure_slope": 0.035,
        "tangential_pressure_slope": 0.72,
        "extension_stiffness": 0.06,
    }
)
"""The same of the ring whose belt does not shear, on tires that scatter by a tenth."""
