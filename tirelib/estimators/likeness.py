r"""Whether the strain is that of the calibrated tire: how far a turn lies from what it can show.

Contact angle, lateral distortion (CP1 slope), traction and the known conditions say what a turn of
the calibrated tire looks like in everything else: compression, the other slopes, the shape of the
contact. With r what the other regressors differ from that, and S the covariance of r over
conditions that were held out and over single turns,

.. math:: D^2 = r^T (S + K)^{-1} r / m

is near 1 for the calibrated tire, m the number of regressors. Another tire, whose contact is
otherwise shaped at the same contact angle, has more. `limit` is the value that a turn of the
calibrated tire exceeds with the probability `FALSE_ALARM` (Hotelling; Johnson and Wichern, *Applied
Multivariate Statistical Analysis*, section 5.4).

Pressures and speeds that were not calibrated shift the regressors by `DRIFT`, as the rig's tires
show it. The shift of even regressors with pressure is taken off, and half of it is doubt; that of
odd ones and that with speed is all doubt. A tread that is stiffer than calibrated and a larger
share of it that slides shift the regressors by `ROAD_DRIFT`: all together, so K has one direction
for each, as wide as `tirelib.estimators.unknowns` leaves it; a camber that nobody gave
(`CAMBER_DRIFT`), an uncertain wheel angle and an uncertain offset of the turn have one each. Where
a regressor that says where a turn lies is beyond its calibrated range, nobody knows what the tire
looks like. Predicting needs numpy only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.estimators import tilt
from tirelib.estimators.laws import ConditionLaws
from tirelib.estimators.polynomial import Term, Variable, design
from tirelib.estimators.regressors import SIDED, TWISTS, WAVES

DRIFT = {
    "compression": (0.0170, 0.0021),
    "cp2_slope": (0.0132, 0.0032),
    "angle_slope": (-0.0135, 0.0007),
    "tp_slope": (-0.0258, 0.0004),
    "angle_bow": (0.0114, 0.0016),
    "tp_bow": (0.0003, 0.0502),
    "cp1_bow": (-0.0016, 0.0186),
    "cp2_bow": (0.0086, 0.0055),
    "fullness": (-0.0120, 0.0027),
    "skew": (-0.0006, 0.0011),
    "steepness": (0.3553, 0.1099),
    "steepness_change": (0.0997, 0.3831),
    "lead_bend": (-0.0150, 0.0346),
    "trail_bend": (-0.0440, 0.0286),
    "angle_twist": (-0.0017, 0.0003),
    "cp1_twist": (-0.0340, 0.0002),
    "cp2_twist": (-0.0425, 0.0021),
    "tp_twist": (-0.0251, 0.0004),
    "angle_wave": (0.0035, 0.0006),
    "cp1_wave": (-0.0043, 0.0360),
    "cp2_wave": (0.0134, 0.0029),
    "tp_wave": (0.0492, 0.0200),
}
"""Shift (SI) at the same contact angle, for a pressure that is doubled and for a squared speed that
grows by (40 m/s)^2: of the rig's tires `reference`, `soft` and `stiff`, mean with the pressure and
rms with the speed, measured by ``python build/other_tire.py``. Odd regressors shift with the side,
at 3 deg by so much. Twists and waves are of `reference` alone."""
ROAD_DRIFT = {
    "compression": (-0.0053, 0.0080),
    "cp2_slope": (0.0000, 0.0563),
    "angle_slope": (0.0000, -0.0126),
    "tp_slope": (0.0000, -0.0103),
    "angle_bow": (0.0029, 0.0001),
    "tp_bow": (0.0301, 0.0575),
    "cp1_bow": (-0.0155, -0.0031),
    "cp2_bow": (-0.0179, -0.0035),
    "fullness": (0.0051, -0.0027),
    "skew": (-0.0001, 0.0020),
    "steepness": (0.4199, -0.3629),
    "steepness_change": (0.0481, -0.2342),
    "lead_bend": (-0.0014, -0.0244),
    "trail_bend": (-0.0041, 0.0065),
    "angle_twist": (0.0000, -0.0044),
    "cp1_twist": (0.0000, -0.0167),
    "cp2_twist": (0.0000, 0.0225),
    "tp_twist": (0.0000, -0.0036),
    "angle_wave": (0.0015, 0.0005),
    "cp1_wave": (-0.0075, 0.0075),
    "cp2_wave": (-0.0041, 0.0054),
    "tp_wave": (0.0064, 0.0262),
}
"""Shift (SI) at the same contact angle for a tread of e times the stiffness, and for a sliding
share that grows by one at a positive slip angle (odd regressors change their sign with it): mean of
the rig's tires `reference` and `soft` on treads of 4 to 8 mm and frictions of 0.4 and 0.6, measured
by ``python build/road_constants.py --measure reference`` (and ``soft``); twists and waves are of
`reference` alone."""
CAMBER_DRIFT = {
    "cp2_slope": -0.3,
    "angle_slope": tilt.SLOPE,
    "tp_slope": -1.2,
    "angle_twist": 0.17,
    "cp1_twist": -0.49,
    "cp2_twist": -0.65,
    "tp_twist": -0.40,
}
"""Shift (SI) at the same contact angle and lateral distortion per radian of a camber, of the rig's
tires from 3 to 7 kN: -0.8 to 0.05, -0.47 to -0.26, -1.4 to -0.8 (``build/camber_doubt.py``). Twists
are of the tire `reference` at 3.2 and 4.8 kN: 0.17 and 0.18, -0.47 and -0.52, -0.53 and -0.77,
-0.28 and -0.51."""
ROAD_DOUBT = 0.5
"""Standard deviation of another tire's shift with tread and sliding, as a share of `ROAD_DRIFT`."""
PRESSURE_DOUBT, SPEED_DOUBT = 0.5, 1.0
"""Tires differ: standard deviation of another tire's shift, as a share of `DRIFT`; those of the rig
by 0.35 of the shift with pressure. ``docs/theory/estimate_numbers.md`` has half and double."""
AGREEMENT = (*TWISTS, *WAVES)
"""Regressors that say whether the gages agree with each other; the others say what tire it is."""
FEWEST_UNLIKE, SHARE_UNLIKE = 5, 0.08
"""Turns, and share of them, that must look like another tire's. On drawn roads and treads up to
0.055 of a tire's own turns do (``python build/other_tire.py --own``), all above 6.5 kN on a worn
tread; on dry roads none. Half of the share takes one of six such campaigns for another tire's,
double misses a tire of which 0.1 of the turns are flagged."""
EDGE = 1.0 + 1e-6
"""End of a standardised regressor's calibrated range, in half ranges."""


@dataclass(frozen=True, slots=True, eq=False)
class Likeness:
    """What a turn of the calibrated tire looks like.

    Attributes
    ----------
    variables, terms
        As in `tirelib.estimators.polynomial.Polynomial`.
    names : tuple of m str
        Regressors that the polynomials predict.
    coefficients : array, shape (k, m)
    covariance : array, shape (m, m)
        Covariance of one turn about what is predicted.
    limit : float
        Value of D^2 above which a turn is not of this tire.
    """

    variables: tuple[Variable, ...]
    terms: tuple[Term, ...]
    names: tuple[str, ...]
    coefficients: FloatArray
    covariance: FloatArray
    limit: float

    def rest(self, values: Mapping[str, FloatArray]) -> FloatArray:
        """Return how far the regressors lie from what is predicted, shape (n, m)."""
        seen = np.stack([values[name] for name in self.names], axis=1)
        return seen - design(self.variables, self.terms, values) @ self.coefficients

    def apart(
        self,
        values: Mapping[str, FloatArray],
        laws: ConditionLaws,
        tread: tuple[FloatArray, FloatArray] | None = None,
        sliding: FloatArray | None = None,
        moves: Sequence[FloatArray] = (),
        camber: FloatArray | None = None,
        force_laws: ConditionLaws | None = None,
    ) -> FloatArray:
        """Return D^2 of each turn, shape (n,); NaN where it cannot be computed.

        Parameters
        ----------
        values : mapping of arrays, shape (n,)
            Regressors and conditions.
        laws : ConditionLaws
        tread : two arrays, shape (n,), optional
            How much stiffer the tread is than calibrated, L, and its standard deviation.
        sliding : shape (n,), optional
            Standard deviation of the sliding share, with the sign of the slip angle.
        moves : sequence of arrays, shape (n, m)
            What one standard deviation of an uncertain angle or offset adds to `rest`.
        camber : shape (n,), [rad], optional
            Standard deviation of a camber that nobody gave; 0 where it is known.
        force_laws : ConditionLaws, optional
            Laws of what was varied while there was lateral force; without them, `laws` hold.
        """
        pressure, unknown = laws.pressure_departure(values)
        sided = np.hypot(*(force_laws or laws).pressure_departure(values))
        speed = laws.speed_departure(values)
        with_pressure, with_speed = np.array([DRIFT[name] for name in self.names]).T
        odd = np.array([name in SIDED for name in self.names])
        rest = self.rest(values) - pressure[:, None] * np.where(odd, 0.0, with_pressure)
        doubt = np.hypot(PRESSURE_DOUBT * pressure, unknown)[:, None] * with_pressure
        doubt = np.where(odd, sided[:, None] * with_pressure, doubt)
        doubt = np.hypot(doubt, SPEED_DOUBT * np.nan_to_num(speed)[:, None] * with_speed)
        spread = self.covariance + _each(doubt)
        with_tread, with_sliding = np.array([ROAD_DRIFT[name] for name in self.names]).T
        if tread is not None:
            rest -= tread[0][:, None] * with_tread
            spread = spread + _along(tread[1][:, None] * with_tread)
            spread = spread + _each(ROAD_DOUBT * tread[0][:, None] * with_tread)
        if sliding is not None:
            side = np.where(odd, np.sign(sliding)[:, None], 1.0)
            spread = spread + _along(np.abs(sliding)[:, None] * side * with_sliding)
        if camber is not None:
            with_camber = np.array([CAMBER_DRIFT.get(name, 0.0) for name in self.names])
            spread = spread + _along(camber[:, None] * with_camber)
        for move in moves:
            spread = spread + move[:, :, None] * move[:, None, :]
        found = np.linalg.solve(spread, rest[:, :, None])[..., 0]
        square = np.sum(rest * found, axis=1) / len(self.names)
        return np.where(self.within(values), square, np.nan)

    @property
    def edge(self) -> float:
        """How far from the middle of what was calibrated a turn is looked at, in half ranges.

        Whether the gages agree is looked at wherever a turn can be valid.
        """
        return np.inf if self.names[0] in AGREEMENT else EDGE

    def within(self, values: Mapping[str, FloatArray]) -> BoolArray:
        """Tell which turns lie where the tire was seen, shape (n,)."""
        near = [np.abs(v.standardise(values[v.name])) <= self.edge for v in self.variables]
        return np.asarray(np.all(near, axis=0), dtype=np.bool_)

    def slope_left(
        self, values: Mapping[str, FloatArray], sliding: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return what the slope of the contact angle leaves unexplained, and its deviation.

        Parameters
        ----------
        values : mapping of arrays, shape (n,)
            Regressors and conditions.
        sliding : shape (n,)
            Standard deviation of the sliding share.
        """
        nothing = np.full(sliding.shape, np.nan)
        if "angle_slope" not in self.names:
            return nothing, nothing
        column = self.names.index("angle_slope")
        slid = ROAD_DRIFT["angle_slope"][1] * np.nan_to_num(sliding, nan=1.0)
        noise = np.hypot(np.sqrt(self.covariance[column, column]), slid)
        return np.where(self.within(values), self.rest(values)[:, column], np.nan), noise


def _each(shift: FloatArray) -> FloatArray:
    """Return the covariance of shifts that have nothing to do with each other, (n, m, m)."""
    return np.asarray(shift[:, :, None] ** 2 * np.eye(shift.shape[1]))


def _along(shift: FloatArray) -> FloatArray:
    """Return the covariance of one shift of all regressors, (n, m, m); tires differ in it."""
    return np.asarray(shift[:, :, None] * shift[:, None, :] + _each(ROAD_DOUBT * shift))


def suspected(unlike: int, judged: int) -> bool:
    """Tell whether so many turns of those judged are no chance.

    Examples
    --------
    >>> suspected(4, 4), suspected(5, 60), suspected(5, 70)
    (False, True, False)
    """
    return unlike >= FEWEST_UNLIKE and unlike > SHARE_UNLIKE * judged
