"""The chain of estimators of one gage set: load, radius, slip ratio, lateral force, slip angle.

Each link may use what the links before it say:

- ``Fz`` from the contact angle and the compression (and pressure, speed, traction where
  calibrated),
- ``R_eff`` from load and pressure in free rolling; ``kappa = Omega R_eff / v - 1`` (Eq. 21, 22),
- ``Fy`` from the slopes of CP1, CP2, contact angle and tension over the lateral position,
- ``alpha`` from the lateral utilisation Fy/Fz and the load: the inverse of a tire's cornering
  curve.

Prediction needs numpy only.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.estimators.laws import (
    RADIUS_DOUBT,
    RADIUS_SHARE,
    UNKNOWN_CAMBER,
    ConditionLaws,
)
from tirelib.estimators.polynomial import Cloud, Polynomial, Range, all_inside

QUANTITIES = ("Fz", "alpha", "kappa", "Fy")


@dataclass(frozen=True, slots=True)
class Estimate:
    """One quantity for n turns: value, standard deviation (SI), and whether it may be trusted."""

    value: FloatArray
    std: FloatArray
    valid: BoolArray


@dataclass(frozen=True, slots=True)
class AngleModel:
    """Slip angle from utilisation; less certain where the cornering curve is flat.

    With s the slope d alpha / d utilisation, the variance of a turn is the polynomial's plus
    ``(blur s)^2 + (bend s^2)^2``; blur is the uncertainty of the utilisation over the calibration,
    for which that of the turn itself stands where it is larger.
    """

    polynomial: Polynomial
    blur: float
    bend: float

    def predict(
        self, values: Mapping[str, FloatArray], spread: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return slip angle and standard deviation, [rad]; `spread` is the utilisation's own."""
        value, std = self.polynomial.predict(values)
        slope = self.polynomial.slope(values, "utilisation")
        blur = np.maximum(self.blur, spread)
        return value, np.sqrt(std**2 + (blur * slope) ** 2 + (self.bend * slope**2) ** 2)


@dataclass(frozen=True, slots=True)
class Chain:
    """Estimators that use one set of gages.

    Attributes
    ----------
    gages : tuple of int
        Indices of the gages used.
    guards : dict of tuples of Range
        For each quantity, the regressors whose calibrated range decides on validity, and the range
        of the quantity itself under its own name.
    laws, force_laws : ConditionLaws
        Of load and radius; of lateral force and slip angle, where only conditions that were varied
        while there was lateral force count as varied.
    cloud : Cloud or None
        Combinations of traction and lateral distortion that were calibrated.
    mean_load : float, [N]
        Stands for the load where no load model could be calibrated.
    """

    gages: tuple[int, ...]
    guards: Mapping[str, tuple[Range, ...]]
    laws: ConditionLaws
    force_laws: ConditionLaws
    mean_load: float
    load: Polynomial | None = None
    radius: Polynomial | None = None
    force: Polynomial | None = None
    angle: AngleModel | None = None
    cloud: Cloud | None = None

    def has(self, quantity: str) -> bool:
        """Tell whether a quantity is calibrated."""
        model = {"Fz": self.load, "kappa": self.radius, "Fy": self.force, "alpha": self.angle}
        return model[quantity] is not None

    def predict(
        self, regressors: Mapping[str, FloatArray]
    ) -> tuple[dict[str, Estimate], FloatArray]:
        """Return the calibrated quantities and the effective rolling radius [m].

        Parameters
        ----------
        regressors : mapping of name to array, shape (n,)
            From `compute_regressors` with this chain's gages.
        """
        values = dict(regressors)
        n = values["contact_angle"].shape[0]
        values["speed_squared"] = values["speed"] ** 2
        calibrated = self.laws.allowed(values)
        if self.cloud is not None:
            calibrated &= self.cloud.inside(values)
        result: dict[str, Estimate] = {}
        load = np.full(n, self.mean_load)
        if self.load is not None:
            load, std = self.load.predict(values)
            correction, extra = self.laws.load_correction(values)
            load = load + correction
            std = np.hypot(std, extra + self.laws.spread(values, load))
            result["Fz"] = Estimate(load, std, self._valid("Fz", values, load, std) & calibrated)
        values["load"] = load
        radius = np.full(n, np.nan)
        values["slip_ratio"] = np.full(n, np.nan)
        if self.radius is not None:
            radius, radius_std = self._rolling_radius(values, result.get("Fz"))
            with np.errstate(invalid="ignore", divide="ignore"):
                gain = values["omega"] / values["speed"]
                kappa = gain * radius - 1.0
            kappa = np.where(values["speed"] > 0.0, kappa, np.nan)
            std = np.abs(gain) * radius_std
            values["slip_ratio"] = kappa
            valid = self._valid("kappa", values, kappa, std)
            result["kappa"] = Estimate(kappa, std, valid)
        values["slip_size"] = np.abs(values["slip_ratio"])
        if self.force is not None:
            self._lateral(self.force, values, load, calibrated, result)
        return result, radius

    def _lateral(
        self,
        model: Polynomial,
        values: dict[str, FloatArray],
        load: FloatArray,
        calibrated: BoolArray,
        result: dict[str, Estimate],
    ) -> None:
        """Add lateral force and slip angle to the result."""
        laws = self.force_laws
        calibrated = calibrated & laws.allowed(values)
        force, std = model.predict(values)
        factor, doubt = laws.force_factor(values)
        tilted = np.where(np.isnan(values["camber"]), UNKNOWN_CAMBER * np.abs(load), 0.0)
        law = np.hypot(doubt * np.abs(force) + laws.spread(values, factor * force), tilted)
        force, std = factor * force, np.hypot(factor * std, law)
        result["Fy"] = Estimate(force, std, self._valid("Fy", values, force, std) & calibrated)
        load_std = result["Fz"].std if "Fz" in result else np.zeros_like(load)
        with np.errstate(invalid="ignore", divide="ignore"):
            values["utilisation"] = force / load
            spread = np.hypot(std, values["utilisation"] * load_std) / np.abs(load)
        if self.angle is not None:
            angle, std = self.angle.predict(values, spread)
            valid = self._valid("alpha", values, angle, std) & calibrated
            result["alpha"] = Estimate(angle, std, valid)

    def _rolling_radius(
        self, values: Mapping[str, FloatArray], load: Estimate | None
    ) -> tuple[FloatArray, FloatArray]:
        """Return R_eff and its standard deviation, [m].

        It changes little with load; where the load is not known to be right, the mean load of the
        calibration stands for it, and what a departure of half that load would change is doubt, or
        what the load that was estimated would, where that is more.
        """
        model = self.radius
        if model is None:
            unknown = np.full(values["omega"].shape, np.nan)
            return unknown, unknown
        known = load.valid if load is not None else np.zeros(values["omega"].shape, dtype=np.bool_)
        at = dict(values)
        load_here = np.where(known, values["load"], self.mean_load)
        at["load"] = self.laws.equivalent_load(load_here, values)
        radius, std = model.predict(at)
        at_reference, _ = model.predict({**at, "load": load_here})
        std = np.hypot(std, RADIUS_SHARE * np.abs(radius - at_reference))
        std = np.hypot(std, RADIUS_DOUBT * radius * self.laws.speed_departure(values))
        if any(variable.name == "load" for variable in model.variables):
            slope = np.abs(model.slope(at, "load"))
            doubt = 0.5 * self.mean_load * slope
            if load is not None:
                told = model.predict({**at, "load": self.laws.equivalent_load(load.value, values)})
                doubt = np.where(known, slope * load.std, np.fmax(doubt, np.abs(told[0] - radius)))
            std = np.hypot(std, doubt)
        return radius, std

    def _carried(self, quantity: str) -> tuple[Polynomial, ...]:
        """Return the models on whose calibrated data a quantity stands.

        The slip ratio has none: where the load is not known, its own doubt of the radius holds. The
        slip angle's own polynomial is judged by its standard deviation.
        """
        models = {
            "Fz": (self.load,),
            "Fy": (self.force,),
            "alpha": (self.load, self.force),
            "kappa": (),
        }[quantity]
        return tuple(model for model in models if model is not None)

    def _valid(
        self,
        quantity: str,
        values: Mapping[str, FloatArray],
        value: FloatArray,
        std: FloatArray,
    ) -> BoolArray:
        known = np.isfinite(value) & np.isfinite(std)
        for model in self._carried(quantity):
            known &= model.within(values)
        guards = self.guards[quantity]
        if not guards:
            return known
        columns = [value if guard.name == quantity else values[guard.name] for guard in guards]
        return known & all_inside(guards, columns)
