"""A calibration: the estimators of one tire and gage layout."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tirelib.core.errors import CalibrationError
from tirelib.core.sizes import differing
from tirelib.estimators.compiled import core_calibration
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.gage_chains import GageChains
from tirelib.estimators.reference_turn import ReferenceTurn
from tirelib.measured.features.extract import Features

UNITS = {"Fz": "N", "alpha": "rad", "kappa": "1", "Fy": "N"}
"""Unit of each estimated quantity inside the library."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration(GageChains):
    """The chains of estimators of one tire, and what tells whether data belong to it.

    Attributes
    ----------
    tire : str
    reference : ReferenceTurn or None
        A measured turn that the calibration takes for valid.
    geometry : mapping of str to float, [m]
        Dimensions of the tire, as far as its campaigns gave them.
    version : int
        Version of the file format that it was read from.
    """

    tire: str
    reference: ReferenceTurn | None = None
    geometry: Mapping[str, float] = field(default_factory=dict)
    version: int = 2

    def check_layout(
        self,
        tire: str,
        lateral: tuple[float, ...],
        where: str,
        geometry: Mapping[str, float] | None = None,
    ) -> None:
        """Refuse data of another tire or gage layout.

        Raises
        ------
        CalibrationError
            Naming both.
        """
        if tire != self.tire:
            raise CalibrationError(
                f"{where}: the tire is {tire!r}, the calibration is of {self.tire!r}; "
                "calibrate on a campaign of this tire"
            )
        for name, given, known in differing(geometry or {}, self.geometry):
            raise CalibrationError(
                f"{where}: {name} of the tire is {1e3 * given:g} mm, of the calibrated one "
                f"{1e3 * known:g} mm; calibrate on a campaign of this tire, or mend campaign.toml"
            )
        same = len(lateral) == len(self.lateral) and np.allclose(lateral, self.lateral, atol=1e-4)
        if not same:
            raise CalibrationError(
                f"{where}: gages lie at {_millimetres(lateral)} mm (ISO), the calibration has "
                f"them at {_millimetres(self.lateral)} mm; calibrate with this layout"
            )

    def estimate(self, features: Features) -> Estimates:
        """Estimate every turn; a turn with one gage out uses the chain without it.

        The compiled core estimates, where there is one for this machine (`tirelib.core.compiled`).
        """
        known = core_calibration(self)
        return self.reference_estimate(features) if known is None else known.estimate(features)


def _millimetres(lateral: tuple[float, ...]) -> str:
    return ", ".join(f"{1e3 * y:+.0f}" for y in lateral)
