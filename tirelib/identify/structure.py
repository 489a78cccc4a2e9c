"""How far a ring-equivalent parameter may lie from a laboratory's, beyond the fit.

The misfit function in the fit widens its intervals, but a smooth function with a prior does not
know everything that a ring leaves out (strips across the width, shear, friction). The rest was
measured: 16 random tires of the numerical rig, which shares no code with the ring, were identified
from 19-run campaigns, and the relative error against laboratory tests on them is what stands here
(rms, bias included, rounded up). `build/proof/run.py --seeds 101-116` measures it again.
"""

from collections.abc import Mapping
from types import MappingProxyType

STRUCTURE_STD: Mapping[str, float] = MappingProxyType(
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
"""Relative standard deviation by parameter, in units of the value (slopes: of a typical slope)."""
