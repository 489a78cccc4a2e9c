"""The result of a contact with shear: tractions, belt loads, forces."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.physics.contact.fourier import evaluate_fields, load_harmonics
from tirelib.physics.contact.shear_law import Elements, Rolling, Shear, elements
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray


@dataclass(frozen=True, slots=True)
class ShearContact:
    """The tire on the road, one row per operating point.

    Attributes
    ----------
    edges : shape (n_points, 2), [rad]
        Leading (negative) and trailing contact angle, from below the axle.
    deflection : shape (n_points,), [m]
        d0, free radius minus loaded radius.
    effective_radius : shape (n_points,), [m]
        R_e, the road's way per radian of the wheel.
    tip_offset : shape (n_points,), [m]
        x_0; zero unless a torque was given.
    phi, weights : shape (n_points, n_nodes), [rad]
        Gauss nodes in the patch and their weights.
    compression, shear : shape (n_points, n_nodes), [m]
        h_0 - h of Eq. (79), and gamma h of tips that stick (where they slide, less is left).
    pressure : shape (n_points, n_nodes), [N/m]
        -f_n, normal to the deformed belt, inward positive, per length of belt.
    shear_traction : shape (n_points, n_nodes), [N/m]
        f_t of the road on the tread along the deformed belt, positive along +phi (rearward). It is
        directed outward, away from the patch's middle, where it has the sign of phi; on a standing
        tire that was pressed down it is larger, `docs/theory/shear_contact.md`.
    sliding : shape (n_points, n_nodes), bool
    declination : shape (n_points, n_nodes), [rad]
        eta, of the belt's normal from the plumb line, positive toward +phi.
    belt_loads : shape (n_points, n_nodes, 3)
        q_u outward, q_v along +phi, [N/m], and q_beta, [N], on the belt.
    compliance : Compliance
        Compliance of the ring, at the solution.
    tread : Tread
    tread_shear : Shear
    extra : shape (n_points, n_modes + 1, 3) or None, [N/m]
        Harmonics of other line loads on the belt.
    edges_given : bool
        Whether the edges were known (`fit_edges`) instead of found.
    edge_mismatch : shape (n_points,), [m]
        Compression left at the leading minus at the trailing edge; zero unless the angles were
        given.
    iterations : int
    residual : shape (n_points,), [m]
        Largest difference between the displacement that went into the tread's loads and the ring's
        answer to them, or compression left at an edge that was to be found; beta counts with R.
    """

    edges: FloatArray
    deflection: FloatArray
    effective_radius: FloatArray
    tip_offset: FloatArray
    phi: FloatArray
    weights: FloatArray
    compression: FloatArray
    shear: FloatArray
    pressure: FloatArray
    shear_traction: FloatArray
    sliding: BoolArray
    declination: FloatArray
    belt_loads: FloatArray
    compliance: Compliance
    tread: Tread
    tread_shear: Shear
    extra: ComplexArray | None
    edges_given: bool
    edge_mismatch: FloatArray
    iterations: int
    residual: FloatArray

    def __len__(self) -> int:
        return int(self.deflection.shape[0])

    @property
    def loaded_radius(self) -> FloatArray:
        """R_l, axle above the road, [m], shape (n_points,)."""
        out: FloatArray = np.asarray(self.tread.free_radius, dtype=float) - self.deflection
        return out

    @property
    def road_traction(self) -> tuple[FloatArray, FloatArray]:
        """Forces of the road per length of belt, [N/m], at the nodes: rearward (+phi), upward."""
        sin, cos = np.sin(self.declination), np.cos(self.declination)
        along: FloatArray = self.shear_traction * cos - self.pressure * sin
        up: FloatArray = self.pressure * cos + self.shear_traction * sin
        return along, up

    @property
    def load(self) -> FloatArray:
        """Vertical load Fz, [N], shape (n_points,)."""
        return self._integral(self.road_traction[1])

    @property
    def longitudinal_force(self) -> FloatArray:
        """Fx of the road on the tire, [N], ISO 8855: forward positive, rolling resistance < 0."""
        return -self._integral(self.road_traction[0])

    @property
    def torque(self) -> FloatArray:
        """Moment of the road about the axle, [N m], positive along +phi (it drives the wheel)."""
        radius = self.compliance.radius[:, None]
        return self._integral(radius * self.belt_loads[..., 1] + self.belt_loads[..., 2])

    @property
    def pressure_centre(self) -> FloatArray:
        """R int p sin phi / int p cos phi of the pressure, [m], negative toward the entry."""
        sin, cos = np.sin(self.phi), np.cos(self.phi)
        part = self.weights * self.pressure
        centre: FloatArray = self.compliance.radius * (part * sin).sum(axis=1)
        centre /= (part * cos).sum(axis=1)
        return centre

    @property
    def sliding_onset(self) -> FloatArray:
        """Angle where the sliding that reaches the trailing edge begins, [rad]; nan without it.

        Between the last sticking node and the first sliding one, where the straight line of
        abs(K_Gt gamma h) - mu abs(f_n) is zero; the leading edge if all slides.
        """
        behind = np.logical_and.accumulate(self.sliding[:, ::-1], axis=1)[:, ::-1]
        count, n_nodes = behind.sum(axis=1), self.phi.shape[1]
        stiffness = np.asarray(self.tread_shear.stiffness, dtype=float)[:, None]
        mu = np.asarray(self.tread_shear.friction, dtype=float)[:, None]
        limit = np.where(np.isfinite(mu), mu, 0.0) * self.pressure
        excess = np.abs(stiffness * self.shear) - limit
        row, after = np.arange(len(self)), np.minimum(n_nodes - count, n_nodes - 1)
        before = np.maximum(after - 1, 0)
        some = (count > 0) & (count < n_nodes)
        rise = np.where(some, excess[row, after] - excess[row, before], 1.0)
        step = self.phi[row, after] - self.phi[row, before]
        between: FloatArray = self.phi[row, after] - step * excess[row, after] / rise
        out: FloatArray = np.where(count == n_nodes, self.edges[:, 0], between)
        return np.where(count > 0, out, np.nan)

    @property
    def harmonics(self) -> ComplexArray:
        """Harmonics of q_u, q_v [N/m] and q_beta [N], shape (n_points, n_modes + 1, 3)."""
        weighted = self.weights[..., None] * self.belt_loads
        return load_harmonics(self.phi, weighted, self.compliance.n_modes)

    @property
    def displacement(self) -> ComplexArray:
        """Harmonics of (u, v, beta), shape (n_points, n_modes + 1, 3), [m], [m], [rad]."""
        loads = self.harmonics if self.extra is None else self.harmonics + self.extra
        out: ComplexArray = (self.compliance.matrix @ loads[..., None])[..., 0]
        return out

    def elements_at(self, phi: FloatArray) -> Elements:
        """Return the tread elements at angles (n_phi,) or (n_points, n_phi), contact or not.

        Outside the patch `height` above h_0 is clearance, and the forces have no meaning.
        """
        belt = evaluate_fields(self.displacement, phi)
        rolling = Rolling(self.effective_radius, self.loaded_radius, self.tip_offset)
        angles = np.broadcast_to(phi, belt.shape[:-1])
        return elements(belt, angles, rolling, self.compliance.radius, self.tread, self.tread_shear)

    def compression_at(self, phi: FloatArray) -> FloatArray:
        """Return h_0 - h at angles (n_phi,) or (n_points, n_phi), [m]; negative is clearance."""
        free_radius = np.asarray(self.tread.free_radius, dtype=float)
        depth = (free_radius - self.compliance.radius)[:, None]
        out: FloatArray = depth - self.elements_at(phi).height
        return out

    def inside(self, phi: FloatArray) -> BoolArray:
        """Return whether angles (n_phi,) or (n_points, n_phi) lie in the patch."""
        out: BoolArray = (phi >= self.edges[:, :1]) & (phi <= self.edges[:, 1:])
        return out

    def _integral(self, density: FloatArray) -> FloatArray:
        total: FloatArray = self.compliance.radius * np.sum(self.weights * density, axis=1)
        return total
