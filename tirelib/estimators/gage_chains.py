"""Estimates of turns by the chains of a calibration, with numpy.

The same in C is in `tirelib.estimators.compiled`; both agree to 1e-9.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.flags import INVALIDATING, TurnFlag
from tirelib.core.threads import one_thread
from tirelib.estimators.chain import Chain
from tirelib.estimators.contact_length import contact_lengths
from tirelib.estimators.doubt import doubt, with_moved
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.unknowns import PLAUSIBLE
from tirelib.measured.features.extract import Features
from tirelib.measured.signal.quality import UNUSABLE

LARGEST_ANGLE_STD = float(np.deg2rad(1.0))
"""A slip angle less certain than this is not called valid: the cornering curve is flat there."""
_NO_CONDITION = int(TurnFlag.NO_CONDITION)


@dataclass(frozen=True, slots=True)
class Rolling:
    """Threshold between free rolling and traction, on ``(CP1 - CP2) / TP``.

    Under braking the second peak is deeper (traction > 0), under driving the first (section 4.1.5).
    Free rolling itself shifts the balance a little through damping: `centre`.
    """

    centre: float
    threshold: float

    def classify(self, traction: FloatArray) -> tuple[str, ...]:
        """Return the rolling condition of each turn."""
        apart = traction - self.centre
        words = np.where(apart > self.threshold, "braking", "free").astype(object)
        words[apart < -self.threshold] = "driving"
        words[~np.isfinite(apart)] = "unknown"
        return tuple(str(word) for word in words)


@dataclass(frozen=True, slots=True, kw_only=True)
class GageChains:
    """Chains of estimators for all gages, and for each set with one gage missing.

    Attributes
    ----------
    lateral : tuple of float, [m]
        Gage positions, ISO, in file order.
    chains : dict of int to Chain
        By index of the missing gage; -1 is the full set.
    order : float, [cycles per turn]
        Cut-off of the low-pass with which the features were read.
    cut_off : float or None, [Hz]
        Fixed cut-off, where one was chosen.
    """

    lateral: tuple[float, ...]
    chains: Mapping[int, Chain]
    rolling: Rolling
    order: float
    cut_off: float | None = None

    @one_thread()
    def reference_estimate(self, features: Features) -> Estimates:
        """Estimate every turn with numpy: the reference of the compiled core."""
        n = len(features)
        value = {q: np.full(n, np.nan) for q in QUANTITIES}
        std = {q: np.full(n, np.nan) for q in QUANTITIES}
        valid = {q: np.zeros(n, dtype=np.bool_) for q in QUANTITIES}
        flags = features.flags.copy()
        radius = np.full(n, np.nan)
        traction = np.full(n, np.nan)
        out = (features.gage_flags & int(UNUSABLE)) != 0
        extrapolated, unlike, tilted = (np.zeros(n, dtype=np.bool_) for _ in range(3))
        moved = with_moved(features)
        missing = np.where(out.any(axis=1), out.argmax(axis=1), -1)
        missing[out.sum(axis=1) > 1] = -2
        for index in np.unique(missing):
            chain = self.chains.get(int(index))
            rows = missing == index
            if chain is None:
                flags[rows] |= int(TurnFlag.TOO_FEW_GAGES)
                continue
            part = compute_regressors(moved, chain.gages)
            if not rows.all():
                each = np.tile(rows, 3)
                part = {name: x[each] for name, x in part.items()}
            estimates, radii = chain.predict(part)
            many = int(rows.sum())
            unlike[rows] = chain.unlike(part, estimates, features.angle_std[rows])
            part, radius[rows] = {name: x[:many] for name, x in part.items()}, radii[:many]
            traction[rows] = part["traction"]
            extrapolated[rows] = chain.laws.extrapolated(part) | (
                chain.force_laws.extrapolated(part) if chain.has("Fy") else False
            )
            for quantity, estimate in estimates.items():
                tilted[rows] |= estimate.camber_decides[:many]
                value[quantity][rows] = estimate.value[:many]
                more = doubt(estimate.value, features.angle_std[rows])
                std[quantity][rows] = np.hypot(estimate.std[:many], more)
                valid[quantity][rows] = estimate.valid[:many]
            flags[rows] |= np.where(self._unknown_condition(chain, part), _NO_CONDITION, 0)
        std["kappa"] = np.hypot(std["kappa"], (1.0 + value["kappa"]) * features.slip_std)
        said = {"condition_extrapolated": extrapolated, "camber_unknown": tilted}
        return self._finish(features, value, std, valid, flags, radius, traction, said, unlike)

    @property
    def knows_tire(self) -> bool:
        """Whether another tire would be noticed: the calibration knows what its own looks like."""
        return self.chains[-1].likeness is not None

    @property
    def needed(self) -> tuple[str, ...]:
        """Conditions without which no turn is valid."""
        return self.chains[-1].needed

    def _unknown_condition(self, chain: Chain, regressors: Mapping[str, FloatArray]) -> BoolArray:
        """Tell where a condition that a model needs is not known."""
        unknown = np.zeros(regressors["omega"].shape, dtype=np.bool_)
        for name in chain.needed:
            unknown |= np.isnan(regressors[name]) & np.isfinite(regressors["omega"])
        return unknown

    def _finish(
        self,
        features: Features,
        value: dict[str, FloatArray],
        std: dict[str, FloatArray],
        valid: dict[str, BoolArray],
        flags: IntArray,
        radius: FloatArray,
        traction: FloatArray,
        said: Mapping[str, BoolArray],
        unlike: BoolArray,
    ) -> Estimates:
        measured = (flags & int(INVALIDATING)) == 0
        full = self.chains[-1]
        notes: list[list[str]] = [[] for _ in range(len(features))]
        in_range = np.ones(len(features), dtype=np.bool_)
        for quantity in QUANTITIES:
            if not full.has(quantity):
                continue
            unfit = measured & ~valid[quantity]
            if quantity == "kappa":
                unfit &= (flags & int(TurnFlag.NO_SPEED)) == 0
            in_range &= ~unfit
            for row in np.flatnonzero(unfit):
                notes[row].append(f"{quantity}_out_of_range")
            valid[quantity] &= measured
        other = measured & in_range & unlike  # beyond the data nobody knows what it looks like
        for quantity in QUANTITIES:
            valid[quantity] &= ~other
        saturated = valid["alpha"] & (std["alpha"] > LARGEST_ANGLE_STD)
        valid["alpha"] &= ~saturated
        for row in np.flatnonzero(saturated):
            notes[row].append("alpha_saturated")
        given = {name: getattr(features, name) for name in PLAUSIBLE}
        wrong = full.road.plausible(given)
        said = {**said, **{f"{name}_implausible": ~good for name, good in wrong.items()}}
        held = full.conditions_allowed(
            {name: getattr(features, name) for name in ("pressure", "speed", "camber")}
        )
        said |= {f"{name}_out_of_range": ~good for name, good in held.items()}
        for note, rows in said.items():
            for row in np.flatnonzero(rows & measured):
                notes[row].append(note)
        flags = flags | np.where(measured & ~in_range, int(TurnFlag.OUT_OF_RANGE), 0)
        flags = flags | np.where(other, int(TurnFlag.OTHER_TIRE), 0)
        bad = ~measured
        for quantity in QUANTITIES:
            value[quantity] = np.where(bad, np.nan, value[quantity])
            std[quantity] = np.where(bad, np.nan, std[quantity])
        length, length_std = contact_lengths(features.contact_angle, radius, features.angle_std)
        return Estimates(
            value=value,
            std=std,
            valid=valid,
            turn_valid=measured & in_range & ~other,
            flags=flags,
            notes=tuple(tuple(row) for row in notes),
            rolling=self.rolling.classify(traction),
            radius=radius,
            contact_length=length,
            contact_length_std=length_std,
        )
