"""The problem of identification: waveforms and deflections of runs, and the numbers of a tire.

Coordinates are those of the tire about its start and, behind them, the delay of the gages against
the trigger. The structural misfit (`discrepancy`) is a sum of smooth shapes that is fitted beside
the model; each shape is a row, as large as one standard deviation of its coefficient.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.effects.state import Operating
from tirelib.inference.identify.campaign_data import Data, begins_with
from tirelib.inference.identify.delay import STD, UNIT, by_delay, earlier
from tirelib.inference.identify.discrepancy import Discrepancy
from tirelib.inference.identify.whiten_runs import RunWhitening
from tirelib.inference.statistics.problem import Point
from tirelib.measured.waveforms import GRID
from tirelib.model.base import Coordinate, move
from tirelib.model.slopes import SolutionSlopes, slopes_of
from tirelib.model.solution import Solution, solved
from tirelib.physics.rolling.assemble import Unknowns
from tirelib.physics.rolling.solve import Rolling

MISFIT = "misfit"
"""Name of the rows of the structural misfit."""


@dataclass(frozen=True, slots=True, eq=False)
class WaveformSolved:
    """The model at a point, `tirelib.inference.statistics.problem.Solved`.

    Attributes
    ----------
    rest : shape (n_runs * n_phi + n_known,)
        Measured less model: strain, then the deflections that take part.
    waveform : shape (n_runs, n_phi)
        The model's, with the delay.
    """

    rest: FloatArray
    point: Point
    model: Solution
    waveform: FloatArray

    @property
    def delay(self) -> float:
        """Delay of the gages against the trigger, [s]."""
        return UNIT * float(self.point.base[-1])


class WaveformProblem:
    """Straight runs and the numbers of a tire, `tirelib.inference.statistics.problem.Model`.

    Values of a tire are the start, by name of `Tire`; `std` (n_free,) are the standard deviations
    of the coordinates' priors about it. Without a discrepancy there is no structural misfit.
    """

    living: Sequence[Effect] = ()
    lookalike: float = 0.0

    def __init__(
        self,
        data: Data,
        start: Mapping[str, float | FloatArray],
        std: FloatArray,
        free: tuple[Coordinate, ...],
        discrepancy: Discrepancy | None = None,
    ) -> None:
        self.data, self.free, self.discrepancy = data, free, discrepancy
        self.values = dict(start)
        self.start = Point(np.zeros(len(free) + 1))
        self.widths = np.append(std, STD / UNIT)
        ends = [c.ends(float(np.max(self.values[c.name]))) for c in free]
        low, high = np.array([*ends, (-np.inf, np.inf)]).T  # a delay has none
        self.ends = low, high
        self._known = np.isfinite(data.deflection) & data.with_deflection
        self._last: tuple[WaveformSolved, SolutionSlopes] | None = None

    @property
    def starts(self) -> tuple[Point, ...]:
        """Where fits start: as given, and with a tread that is rounder across.

        A stiff tread that is round and a soft one that is flat leave much the same, and between
        them the cost is higher: a fit ends in the valley it starts in.
        """
        round_ = [k for k, c in enumerate(self.free) if c.name == "contact_crown"]
        if not round_:
            return (self.start,)
        rounder = self.start.base.copy()
        rounder[round_] += self.widths[round_]
        return self.start, Point(rounder)

    def thinned(self) -> "WaveformProblem":
        """Return the problem of a quarter of the runs; itself if they are few."""
        chosen = begins_with(len(self.data.points))
        if chosen.all():
            return self
        out = copy(self)
        out.data = self.data.take(chosen)
        out._known = np.isfinite(out.data.deflection) & self.data.with_deflection
        out._last = None
        return out

    def whitening(self, here: WaveformSolved) -> RunWhitening:
        """Return the whitening about a solution."""
        by = self._slopes_at(here)
        late = earlier(by.waveform[-2:], self.data.points.omega, -here.delay)
        return RunWhitening.about(
            self.data, here.waveform, late, here.model.deflection, by.deflection[-2:]
        )

    def solve(self, point: Point, near: WaveformSolved | None = None) -> WaveformSolved:
        """Return the model at a point; raises TirelibError where it has none."""
        start: Rolling | Unknowns | None = None
        if near is not None:
            start = near.model.rolling
            if self._last is not None and self._last[0] is near:
                start = self._last[1].start(near.model, (point.base - near.point.base)[:-1])
        data = self.data
        model = solved(
            move(self.values, point.base[:-1], self.free),
            data.points,
            low_pass=data.low_pass,
            start=start,
        )
        waveform = earlier(model.waveform, data.points.omega, -UNIT * float(point.base[-1]))
        rest = self._rows(
            (data.strain - waveform)[None], (data.deflection - model.deflection)[None]
        )
        return WaveformSolved(rest[0], point, model, waveform)

    def _slopes_at(self, here: WaveformSolved) -> SolutionSlopes:
        if self._last is None or self._last[0] is not here:
            self._last = here, slopes_of(here.model, self.free)
        return self._last[1]

    def slopes(self, point: Point, solved: WaveformSolved, *, near: bool = False) -> FloatArray:
        """Return slopes by the coordinates and the delay, (n_free + 1, n)."""
        by, runs = self._slopes_at(solved), len(self.data.points)
        strain = self.by_coordinates(solved.model, by, solved.delay)
        depth = np.concatenate([by.deflection[: len(self.free)], np.zeros((1, runs))])
        return self._rows(strain, depth)

    def by_coordinates(self, model: Solution, by: SolutionSlopes, delay: float) -> FloatArray:
        """Return slopes of a waveform by the coordinates and the delay, (n_free + 1, ...)."""
        omega = model.points.omega
        rows = np.concatenate(
            [by.waveform[: len(self.free)], by_delay(model.waveform, omega)[None]]
        )
        return earlier(rows, omega, -delay)

    def remainder(self, point: Point, solved: WaveformSolved) -> dict[str, FloatArray]:
        """Return the shapes of the structural misfit."""
        shapes = self.misfit(solved.waveform, solved.model.deflection, self.data.points)
        return {MISFIT: self._rows(shapes, np.zeros(shapes.shape[:2]))}

    def misfit(self, waveform: FloatArray, depth: FloatArray, points: Operating) -> FloatArray:
        """Return the shapes of the structural misfit at operating points, (k, n_points, n_phi)."""
        if self.discrepancy is None:
            return np.zeros((0, *waveform.shape))
        half = 0.6 * np.sqrt(2.0 * depth / float(np.max(self.values["free_radius"])))
        return self.discrepancy.columns(waveform, GRID / half[:, None], points)

    def roughly(
        self, point: Point, solved: WaveformSolved, slopes: FloatArray, count: int
    ) -> Sequence[FloatArray]:
        """Return nothing: no effect is fitted."""
        return ()

    def _rows(self, strain: FloatArray, deflection: FloatArray) -> FloatArray:
        """Return rows of strain (k, n_runs, n_phi) and deflection (k, n_runs)."""
        flat = strain.reshape(len(strain), self.data.strain.size)
        return np.concatenate([flat, deflection[:, self._known]], axis=1)
