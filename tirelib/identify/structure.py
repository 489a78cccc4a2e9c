"""How far a ring-equivalent parameter may lie from a laboratory's, beyond the fit.

The misfit function in the fit widens its intervals, but a smooth function with a prior does not
know everything that a ring leaves out (strips across the width, shear, friction). The rest was
measured: random tires of the numerical rig, which shares no code with the ring, were identified
from 19-run campaigns, and the relative error against the tires' own constants is what stands here
(rms, bias included).
"""

from collections.abc import Mapping
from types import MappingProxyType

STRUCTURE_STD: Mapping[str, float] = MappingProxyType(
    {
        "bending_stiffness": 0.09,
        "radial_stiffness": 0.09,
        "tangential_stiffness": 0.18,
        "tread_stiffness": 0.28,
        "innerliner_offset": 0.08,
        "radial_pressure_slope": 0.4,
        "tangential_pressure_slope": 2.0,
        "extension_stiffness": 0.2,
    }
)
"""Relative standard deviation by parameter, in units of the value (slopes: of a typical slope)."""
