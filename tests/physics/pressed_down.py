"""A standing ring pressed on the road in steps: each tread tip sticks where it first touches."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.physics.contact.shear_law import Elements, Rolling, Shear, elements
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    deflection: float
    load: float
    shear: Floats
    """f_t of the road on the tread at the angles, [N/m]."""


class PressedDown:
    """The tread elements of the rolling contact with tips that the load's history has put there."""

    def __init__(self, ring: Compliance, tread: Tread, shear: Shear, n: int = 121) -> None:
        self.phi = np.linspace(-0.36, 0.36, n)
        self.radius, self.free_radius = float(ring.radius[0]), float(np.asarray(tread.free_radius))
        self.depth = self.free_radius - self.radius
        self.tread, self.shear = tread.spread(n), shear.spread(n)
        order = np.arange(ring.n_modes + 1.0)
        self.weight = float(self.phi[1] - self.phi[0])
        unit = np.where(order == 0, 0.5, 1.0) / np.pi * self.weight
        apart = self.phi[:, None] - self.phi[None, :]
        waves = np.exp(1j * order[:, None, None] * apart) * unit[:, None, None]
        kernel = np.einsum("nij,nab->iajb", waves, ring.matrix[0]).real
        self.kernel = kernel.reshape(3 * n, 3 * n)
        self.belt = np.zeros((n, 3))
        self.tip = np.zeros(n)
        self.held = np.zeros(n, dtype=bool)

    def press(self, deflection: float) -> Step:
        """Go on to a deflection; tips that touch from here on stick, tips that slide move."""
        n = self.phi.size
        for _ in range(60):
            e, on = self._elements(deflection)
            loads = np.where(on[:, None], e.loads[:, 0], 0.0)
            slopes = np.where(on[:, None, None], e.d_loads[:, 0, :, :3], 0.0)
            rest = self.belt.ravel() - self.kernel @ loads.ravel()
            matrix = (self.kernel.reshape(3 * n, n, 3)[:, :, None, :] @ slopes).reshape(3 * n, -1)
            step = np.linalg.solve(np.eye(3 * n) - matrix, -rest).reshape(n, 3)
            self.belt = self.belt + step
            if np.abs(step).max() < 1e-9:
                break
        else:
            raise AssertionError("the pressed-down tire does not settle")
        e, on = self._elements(deflection)
        along = np.where(on, e.tangential[:, 0], 0.0)
        stuck = np.asarray(self.shear.stiffness) * e.offset[:, 0]
        slid = np.where(e.sliding[:, 0], (along - stuck) / np.asarray(self.shear.stiffness), 0.0)
        self.tip, self.held = self._tips() + slid, on
        up = loads[:, 1] * np.sin(self.phi) - loads[:, 0] * np.cos(self.phi)
        return Step(deflection, float(self.radius * self.weight * up.sum()), along)

    def _tips(self) -> Floats:
        """Where the held tips stand; the others hang along the belt's normal."""
        u, v, beta = self.belt.T
        hanging = (self.radius + u) * np.sin(self.phi) + v * np.cos(self.phi)
        hanging = hanging + self.depth * np.sin(self.phi + beta)
        return np.where(self.held, self.tip, hanging)

    def _elements(self, deflection: float) -> tuple[Elements, npt.NDArray[np.bool_]]:
        zero = np.zeros_like(self.phi)
        road = Rolling(zero, zero + self.free_radius - deflection, self._tips())
        belt, phi = self.belt[:, None, :], self.phi[:, None]
        e = elements(belt, phi, road, zero + self.radius, self.tread, self.shear)
        return e, e.height[:, 0] < self.depth
