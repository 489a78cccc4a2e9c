r"""The rolling ring with damping by one of two laws, and its waveform.

"modal"     c_n = 2 lambda sqrt(m_n k_n), Eq. (107): every harmonic has the same ratio, which gives
            the belt's bending as much as the sidewall's.
"sidewall"  Dashpots stand beside the springs: c_u = 2 lambda sqrt(k_u rhoA), c_v the same with k_v.

They are different tires: c_n of the second is (c_v + n^2 c_u), that of the first grows with
n sqrt(k_n), and for the same shift lambda of the first is several times smaller. A ratio is only
worth something together with its law.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.effects.state import Operating, State
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import smoothed
from tirelib.physics.contact import radial, shear
from tirelib.physics.contact.shear_law import Shear
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import ComplexArray, Ring, columns, modal_stiffness
from tirelib.physics.strain.innerliner import strain_at

N_MODES = 60
SHEAR_SHARE = 1.0 / 3.0
"""Shear over normal stiffness of the tread where none is known: E = 2 (1 + nu) G, and rubber keeps
its volume (nu = 1/2). Half and double of it move the ratio of the rig's tire by 2 % of itself."""

Law = Literal["sidewall", "modal"]


def damped_compliance(
    ring: Ring, omega: float | FloatArray, damping: float, law: Law, n_modes: int = N_MODES
) -> Compliance:
    """Return the compliance of an inextensible, unshearable ring with damping by a law.

    Parameters
    ----------
    ring : Ring
        Its own damping is left out.
    omega : [rad/s]
    damping : float
        lambda.
    law : str
        "sidewall" or "modal".

    Raises
    ------
    ParameterError
        If the ring stretches or shears, or the law is unknown.
    """
    if law not in ("sidewall", "modal"):
        raise ParameterError(f"damping law {law!r} is unknown; known are 'sidewall' and 'modal'")
    if law == "modal":
        return compliance(replace(ring, damping=damping), omega, n_modes)
    if not (ring.inextensible and ring.unshearable):
        raise ParameterError(
            "damping: the law 'sidewall' needs an inextensible ring without shear; give infinite "
            "extension and shear stiffness"
        )
    r, m, k_u, k_v, w = columns(
        ring.radius, ring.mass, ring.radial_stiffness, ring.tangential_stiffness, omega
    )
    n = np.arange(n_modes + 1.0)[None, :]
    system: ComplexArray = modal_stiffness(ring, omega, n_modes)
    rate = 1j * n * w * 2.0 * damping * np.sqrt(m)
    system[..., 0, 0] += rate * np.sqrt(k_u)
    system[..., 1, 1] += rate * np.sqrt(k_v)
    shape = np.stack(
        np.broadcast_arrays(-1j * n + 0 * r, np.ones_like(n * r) + 0j, (1.0 - n**2) / r + 0j),
        axis=-1,
    )
    scalar = np.einsum("pni,pnij,pnj->pn", shape.conj(), system, shape)
    matrix = shape[..., :, None] * shape[..., None, :].conj() / scalar[..., None, None]
    return Compliance(np.broadcast_to(r[:, 0], (len(scalar),)), matrix)


def damped_waveform(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    damping: float,
    law: Law,
    *,
    sheared: bool = True,
    low_pass: LowPass | None = None,
) -> FloatArray:
    """Return the model's filtered strain over `GRID` with a damping ratio, (n_points, n_phi).

    Parameters
    ----------
    values : mapping
        The tire's constants; each may have one value per point.
    points : Operating
    damping, law
        The damping ratio and its law, as `damped_compliance` takes them.
    sheared : bool
        Whether the tread carries shear, the tire rolling without torque; otherwise the tread is
        radial springs alone.
    """
    state = State.of(values, points, GRID)
    ring = damped_compliance(state.ring, points.omega, damping, law)
    displacement = _displacement(values, ring, state.tread, points.load, sheared)
    strain = strain_at(displacement, state.radius, state.offset, GRID)
    return smoothed(strain, points, low_pass or LowPass())


def _displacement(
    values: Mapping[str, float | FloatArray],
    ring: Compliance,
    tread: Tread,
    load: FloatArray,
    sheared: bool,
) -> ComplexArray:
    if not sheared:
        return radial.load(ring, tread, load, n_nodes=24).displacement
    given = np.asarray(values["tread_shear_stiffness"], dtype=float)
    normal = np.asarray(values["tread_stiffness"], dtype=float)
    stiffness = np.where(given > 0, given, SHEAR_SHARE * normal)
    law = Shear(stiffness if stiffness.ndim else float(stiffness), values["friction"])
    return shear.load(ring, tread, law, load, torque=0.0).displacement
