"""The chain of estimators of one gage set: load, radius, slip ratio, lateral force, slip angle.

Each link may use what the links before it say:

- ``Fz`` from the contact angle and the compression (and pressure, speed, traction where
  calibrated),
- ``R_eff`` from load and pressure in free rolling; ``kappa = Omega R_eff / v - 1`` (Eq. 21, 22),
- ``Fy`` from the slopes of CP1, CP2, contact angle and tension over the lateral position,
- ``alpha`` from the lateral utilisation Fy/Fz and the load: the inverse of a tire's cornering
  curve; where the friction is not known, the aligning moment tells how much of the tread slides.

What friction, tread and its temperature may do to each is in `tirelib.estimators.unknowns`.

Prediction needs numpy only.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.estimators import tilt
from tirelib.estimators.angle_model import WIDEST, AngleModel
from tirelib.estimators.any_road import slid
from tirelib.estimators.doubt import moved_by
from tirelib.estimators.estimate import Estimate
from tirelib.estimators.laws import RADIUS_DOUBT, RADIUS_SHARE, ConditionLaws, slip_range
from tirelib.estimators.likeness import Likeness
from tirelib.estimators.polynomial import Cloud, Polynomial, Range, all_inside
from tirelib.estimators.sliding import FORCE_DOUBT, LOAD_DOUBT, SlidingCurve, Told
from tirelib.estimators.unknowns import BENT, CORNERING, EDGE, FORCE, LAW_DOUBT, Road

STANDS_ON = {"Fz": ("Fz",), "Fy": ("Fy",), "alpha": ("Fz", "Fy"), "kappa": ()}
"""Models on whose calibrated data a quantity stands. The slip ratio has none: where the load is not
known, its own doubt of the radius holds. The slip angle's own polynomial is judged by its standard
deviation."""


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
        Laws of load and radius; laws of lateral force and slip angle, where only conditions that
        were varied while there was lateral force count as varied.
    cloud : Cloud or None
        Combinations of traction and lateral distortion that were calibrated.
    mean_load : float, [N]
        Stands for the load where no load model could be calibrated.
    moment : Polynomial or None
        Aligning moment over load and longest trail, Mz / (Fz q0), [1].
    drag : Polynomial or None
        Longitudinal force over load, -Fx / Fz, [1].
    sliding : SlidingCurve or None
        The cornering curve on roads of other friction.
    road : Road
        Friction and tread of the calibration.
    likeness : Likeness or None
        What turns of the calibrated tire look like; None where too few conditions were measured.
    agreement : Likeness or None
        What the gages leave over the width beyond level, slope and bow: gages that are mixed up, or
        one that is disturbed, do not agree.
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
    moment: Polynomial | None = None
    drag: Polynomial | None = None
    sliding: SlidingCurve | None = None
    road: Road = field(default_factory=Road)
    likeness: Likeness | None = None
    agreement: Likeness | None = None

    def has(self, quantity: str) -> bool:
        """Tell whether a quantity is calibrated."""
        return quantity in self.polynomials

    @property
    def polynomials(self) -> dict[str, Polynomial]:
        """The polynomial of each calibrated quantity; that of kappa gives the rolling radius."""
        angle = self.angle.polynomial if self.angle else None
        every = {"Fz": self.load, "alpha": angle, "kappa": self.radius, "Fy": self.force}
        return {quantity: model for quantity, model in every.items() if model is not None}

    @property
    def needed(self) -> tuple[str, ...]:
        """Conditions that its models use, without which they say nothing."""
        used = {v.name for k, p in self.polynomials.items() if k != "kappa" for v in p.variables}
        sources = {"pressure": "pressure", "camber": "camber", "speed_squared": "speed"}
        return tuple(source for name, source in sources.items() if name in used)

    def conditions_allowed(self, values: Mapping[str, FloatArray]) -> dict[str, BoolArray]:
        """Tell for pressure, speed and camber which turns the calibration holds for.

        An unknown condition counts as allowed; a turn that needs it has the note `no_condition`.
        """
        laws = (self.laws, self.force_laws) if self.has("Fy") else (self.laws,)
        camber = values["camber"]
        upright = tuple(guard for guard in self.guards["Fy"] if guard.name == "camber")
        inside = np.isnan(camber)
        inside |= all_inside(upright, [camber]) if upright else True
        return {
            "pressure": np.logical_and.reduce([law.pressure_allowed(values) for law in laws]),
            "speed": np.logical_and.reduce([law.speed_allowed(values) for law in laws]),
            "camber": inside,
        }

    def unlike(
        self,
        moved: Mapping[str, FloatArray],
        found: Mapping[str, Estimate],
        angle_std: FloatArray,
    ) -> BoolArray:
        """Tell which turns show strain that the calibrated tire's gages do not, shape (n,).

        Parameters
        ----------
        moved : mapping of name to array, shape (3 n,)
            Regressors of `tirelib.estimators.doubt.with_moved`.
        found : mapping of quantity to Estimate
            What `predict` says of the same turns.
        angle_std : array, shape (n,), [1]
        """
        n = angle_std.size
        every = {**moved, "speed_squared": moved["speed"] ** 2}
        values = {name: x[:n] for name, x in every.items()}
        sliding = None
        if {"Fz", "Fy"} <= set(found) and found["Fy"].sliding is not None:
            side = np.where(found["Fy"].value[:n] > 0.0, -1.0, 1.0)
            share = np.nan_to_num(found["Fy"].sliding[:n], nan=1.0)  # any, where no angle fits
            sliding = side * share
        tread = self.road.hardened(values)
        camber = np.where(np.isnan(values["camber"]), tilt.USUAL, 0.0)
        unlike = np.zeros(n, dtype=np.bool_)
        for known in (self.likeness, self.agreement):
            if known is not None:
                moves = moved_by(known.rest(every), angle_std)
                apart = known.apart(
                    values, self.laws, tread, sliding, moves, camber, self.force_laws
                )
                unlike |= apart > known.limit
        return unlike

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
        plausible = np.logical_and.reduce(list(self.road.plausible(values).values()))
        calibrated = self.laws.allowed(values) & plausible
        if self.cloud is not None:
            calibrated &= self.cloud.inside(values)
        result: dict[str, Estimate] = {}
        near: dict[str, BoolArray] = {}
        tread = harder, unknown = self.road.hardened(values)
        load = np.full(n, self.mean_load)
        if self.load is not None:
            load, std, near["Fz"] = self.load.judge(values)
            correction, extra = self.laws.load_correction(values)
            load = load + correction + self._load_per_hardening() * harder
            std = np.hypot(std, extra + self.laws.spread(values, load))
            valid = self._valid("Fz", values, load, std, near) & calibrated
            result["Fz"] = Estimate(load, std, valid)
        values["load"] = load
        radius = np.full(n, np.nan)
        values["slip_ratio"] = np.full(n, np.nan)
        if self.radius is not None:
            radius, radius_std = self._rolling_radius(values, result.get("Fz"), tread)
            with np.errstate(invalid="ignore", divide="ignore"):
                gain = values["omega"] / values["speed"]
                kappa = gain * radius - 1.0
            kappa = np.where(values["speed"] > 0.0, kappa, np.nan)
            std = np.abs(gain) * radius_std
            values["slip_ratio"], values["slip_std"] = kappa, std
            # the radius depends on the pressure; at a low speed it is what it is at a higher one
            held = self.laws.pressure_allowed(values) & self.laws.not_too_fast(values)
            slowest, fastest = slip_range(values["contact_angle"])
            rolls = (kappa > slowest) & ~(kappa >= fastest)
            valid = self._valid("kappa", values, kappa, std, near) & plausible & held & rolls
            result["kappa"] = Estimate(kappa, std, valid)
        values["slip_size"] = np.abs(values["slip_ratio"])
        if self.force is not None:
            self._lateral(self.force, values, load, calibrated, result, near, tread)
        if "Fz" in result:
            doubt = self._load_per_hardening() * np.hypot(unknown, LAW_DOUBT * harder)
            result["Fz"] = result["Fz"].widened(doubt)
        if "kappa" in result:
            checked = self._slip_calibrated(result["kappa"].value)
            for name in result.keys() - {"kappa"}:
                result[name] = replace(result[name], valid=result[name].valid & checked)
        return result, radius

    def _lateral(
        self,
        model: Polynomial,
        values: dict[str, FloatArray],
        load: FloatArray,
        calibrated: BoolArray,
        result: dict[str, Estimate],
        near: dict[str, BoolArray],
        tread: tuple[FloatArray, FloatArray],
    ) -> None:
        """Add lateral force and slip angle to the result."""
        laws = self.force_laws
        calibrated = calibrated & laws.allowed(values)
        force, std, near["Fy"] = model.judge(values)
        factor, doubt = laws.force_factor(values)
        law = doubt * np.abs(force) + laws.spread(values, factor * force)
        leaning, tilted = self._tilt(model, values, factor * force, load)
        force, std = factor * force - leaning, np.hypot(np.hypot(factor * std, law), tilted)
        valid = self._valid("Fy", values, force, std, near) & calibrated
        owed = np.where(np.isnan(values["camber"]), tilted, 0.0)
        result["Fy"] = Estimate(force, std, valid, by_camber=owed)
        load_std = result["Fz"].std if "Fz" in result else np.zeros_like(load)
        with np.errstate(invalid="ignore", divide="ignore"):
            values["utilisation"] = force / load
            spread = np.hypot(std, values["utilisation"] * load_std) / np.abs(load)
        slid = self._slid(values, force, load)
        if self.angle is not None:
            angle = self._slip_angle(self.angle, values, load, spread, slid, tread)
            valid = self._valid("alpha", values, angle.value, angle.std, near) & angle.valid
            result["alpha"] = replace(angle, valid=valid & calibrated)
        harder, unknown = tread
        result["Fy"] = result["Fy"].widened(FORCE * np.hypot(harder, unknown) * np.abs(force))
        if slid is not None:
            share = np.nan_to_num(slid.sliding, nan=1.0)  # any, where no slip angle fits
            widened = result["Fy"].widened(FORCE_DOUBT * share * np.abs(force))
            result["Fy"] = replace(widened, sliding=slid.sliding)
            if "Fz" in result:
                result["Fz"] = result["Fz"].widened(LOAD_DOUBT * share * np.abs(load))

    def _slip_angle(
        self,
        model: AngleModel,
        values: Mapping[str, FloatArray],
        load: FloatArray,
        spread: FloatArray,
        slid: Told | None,
        tread: tuple[FloatArray, FloatArray],
    ) -> Estimate:
        """Return the slip angle; valid where road and tread leave it known."""
        angle, std = model.predict(values, spread)
        slope = np.abs(model.polynomial.slope(values, "utilisation"))
        told = np.isfinite(angle)
        if slid is not None:
            # than where it was calibrated
            flatter = np.sqrt(np.fmax(slid.slope**2 - slope**2, 0.0))
            angle, told = angle + slid.change, np.isfinite(slid.std)
            std = np.sqrt(std**2 + slid.std**2 + (np.fmax(model.blur, spread) * flatter) ** 2)
            slope = slid.slope
        harder, unknown = tread
        # a stiffer tread hides load, so the utilisation seems larger, and turns it into more force
        hidden = self._load_per_hardening() / np.abs(load)
        lighter = slope * np.abs(values["utilisation"])
        if self.sliding is not None:  # and the tire is stiffer for its load than it seems
            lighter = lighter + self.sliding.load_power(np.maximum(load, 1.0)) * np.abs(angle)
        both = np.maximum(lighter, 0.0) * hidden + CORNERING * np.abs(angle)
        doubt = both * np.hypot(unknown, LAW_DOUBT * harder)
        std = np.fmin(np.hypot(std, doubt), WIDEST)
        return Estimate(angle * (1.0 - CORNERING * harder), std, told)

    def _load_per_hardening(self) -> float:
        """Return the load that a tread of e times the stiffness hides, [N]."""
        ends = {known.name: known for known in self.guards["Fz"]}
        if not {"Fz", "contact_angle"} <= set(ends) or not self.laws.radius > 0.0:
            return 0.0
        load, angle = ends["Fz"], ends["contact_angle"]
        if not angle.high > angle.low:  # one contact length tells no slope
            return 0.0
        per_angle = (load.high - load.low) / (angle.high - angle.low)
        return per_angle * EDGE / self.laws.radius

    def _slid(
        self, values: Mapping[str, FloatArray], force: FloatArray, load: FloatArray
    ) -> Told | None:
        """Return what is known of a tread that slides more than it was calibrated."""
        if self.sliding is None:
            return None
        ends = [known.high for known in self.guards["alpha"] if known.name == "alpha"]
        models = self.moment, self.drag
        widest = max(ends or [WIDEST])
        return slid(self.sliding, self.road, models, values, force, load, widest)

    def _tilt(
        self,
        model: Polynomial,
        values: Mapping[str, FloatArray],
        force: FloatArray,
        load: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the part of Fy that is a camber's and its standard deviation, [N].

        Both are zero where the model knows the camber, or the camber is a calibrated one.
        """
        camber = values["camber"]
        if any(variable.name == "camber" for variable in model.variables):
            return np.zeros_like(camber), np.zeros_like(camber)
        left = None
        if self.likeness is not None and np.isnan(camber).any():
            known = self._slid(values, force, load)
            sliding = np.zeros_like(camber) if known is None else known.sliding
            left = self.likeness.slope_left(values, sliding)
        ends = [guard for guard in self.guards["Fy"] if guard.name == "camber"]
        return tilt.part_of_force(camber, load, (ends[0].low, ends[0].high) if ends else None, left)

    def _rolling_radius(
        self,
        values: Mapping[str, FloatArray],
        load: Estimate | None,
        tread: tuple[FloatArray, FloatArray],
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
        if not np.array_equal(at["load"], load_here):
            at_reference, _ = model.predict({**at, "load": load_here})
            std = np.hypot(std, RADIUS_SHARE * np.abs(radius - at_reference))
        std = np.hypot(std, RADIUS_DOUBT * radius * self.laws.speed_departure(values))
        worn, unknown = self.road.worn(values)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.fmin(BENT / values["contact_angle"], 1.0)
        doubt = share * np.hypot(unknown, LAW_DOUBT * worn)
        if any(variable.name == "load" for variable in model.variables):
            per_load = np.abs(model.slope(at, "load"))
            away = 0.5 * self.mean_load * per_load
            if load is not None and not known.all():
                told = model.predict({**at, "load": self.laws.equivalent_load(load.value, values)})
                away = np.fmax(away, np.abs(told[0] - radius))
            if load is not None:
                away = np.where(known, per_load * load.std, away)
            std = np.hypot(std, away)
            harder, unknown = tread
            hidden = self._load_per_hardening() * np.hypot(unknown, LAW_DOUBT * harder)
            doubt = doubt + per_load * hidden  # one tread is behind both
        return radius - share * worn, np.hypot(std, doubt)

    def _slip_calibrated(self, kappa: FloatArray) -> BoolArray:
        """Tell which slip ratios were calibrated, or are not known, shape (n,).

        What the contact does at a slip ratio that was not calibrated nobody has checked; the
        traction alone does not show it where most of the contact slides.
        """
        own = tuple(guard for guard in self.guards["kappa"] if guard.name == "kappa")
        if not own:
            return np.ones(kappa.shape, dtype=np.bool_)
        return np.isnan(kappa) | all_inside(own, [kappa])

    def _valid(
        self,
        quantity: str,
        values: Mapping[str, FloatArray],
        value: FloatArray,
        std: FloatArray,
        near: Mapping[str, BoolArray],
    ) -> BoolArray:
        """Tell which turns may be used; `near`: which lie near the data of load and force."""
        known = np.isfinite(value) & np.isfinite(std)
        for model in STANDS_ON[quantity]:
            known &= near.get(model, True)
        guards = self.guards[quantity]
        if not guards:
            return known
        columns = [value if guard.name == quantity else values[guard.name] for guard in guards]
        return known & all_inside(guards, columns)
