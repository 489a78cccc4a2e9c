"""Content of a campaign: tire, gages, plan and runs. Everything here is SI, radians and ISO."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from tirelib.core.errors import ShapeError

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

KINDS = ("free", "corner", "camber", "brake", "drive", "combined", "sweep")
"""Kinds of runs. Only a ``sweep`` may leave its set points empty."""

CLOCK_TOLERANCE = 1e-9
"""Two clock readings closer than this are the same instant, s."""


@dataclass(frozen=True, slots=True)
class TireGeometry:
    """Geometry that a tape measure or a drawing gives.

    Attributes
    ----------
    free_radius : float, [m]
        Outer radius, inflated and unloaded; the only length that is always known.
    ring_radius : float or None, [m]
        Radius of the belt's neutral line.
    tread_thickness, belt_width : float or None, [m]
    innerliner_offset : float or None, [m]
        Innerliner from the belt's neutral line, outward positive, so negative.
    """

    name: str
    free_radius: float
    ring_radius: float | None = None
    tread_thickness: float | None = None
    belt_width: float | None = None
    innerliner_offset: float | None = None


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Repeatability of the set points: relative, one sigma. `gain` is that of the gages."""

    load: float
    pressure: float
    speed: float
    gain: float


@dataclass(frozen=True, slots=True)
class CampaignHeader:
    """Content of ``campaign.toml``, in SI and ISO signs.

    Attributes
    ----------
    axes : str
        Axis system of the *files*: ``iso``, ``sae`` or ``adapted_sae``.
    gage_lateral : tuple of float, [m]
        Lateral positions in ISO (left positive), in the order strain_1, strain_2, ... of the
        files. Empty for force-only campaigns.
    rate : float, [Hz]
        Sampling rate of the gages; NaN when the campaign has none.
    strain_unit : str
        Unit of the strain channels in the files.
    tolerance : Tolerance or None
    rig_name, rig_note : str
    """

    name: str
    axes: str
    tire: TireGeometry
    gage_lateral: tuple[float, ...] = ()
    rate: float = float("nan")
    strain_unit: str = "ustrain"
    tolerance: Tolerance | None = None
    rig_name: str = ""
    rig_note: str = ""


@dataclass(frozen=True, slots=True)
class RunPlan:
    """One row of ``runs.csv``: the nominal set points of a run, SI and ISO.

    A set point is NaN where the row leaves it empty, which only a ``sweep`` may. `load` is a
    magnitude, positive in every axis system. `start` is the start on the campaign's clock, s.
    Friction of the road [1], tread depth left [m] and tread temperature [K] are NaN where nobody
    wrote them down.
    """

    run: int
    file: str
    kind: str
    load: float
    pressure: float
    speed: float
    slip_angle: float
    camber: float
    slip_ratio: float
    start: float | None = None
    extra: Mapping[str, float | str] = field(default_factory=dict)
    friction: float = float("nan")
    tread_depth: float = float("nan")
    tread_temperature: float = float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One recording, in SI, radians and ISO signs. Samples are as recorded, NaN included.

    Attributes
    ----------
    plan : RunPlan
    strain : array, shape (n_gages, n_samples), or None
        In the file order of the gages, tension positive.
    rate : float, [Hz]
        Sample rate of the strain; NaN without strain.
    start_time : float, [s]
        Time of the first strain sample on the recording's clock, the one of `rig_time`;
        the start on the campaign's clock is ``plan.start``.
    trigger : bool array, shape (n_samples,), or None
        True at the sample when the gages pass the top of the wheel, phi = pi.
    rig : mapping of name to array, shape (n_rig,)
        Fx Fy Fz Mz slip_angle camber slip_ratio speed omega pressure loaded_radius ...
        A quantity that was not recorded is absent.
    rig_time : array, shape (n_rig,), or None, [s]
    dimensions : mapping of name to dimension
        For channels of `rig` whose name says nothing of their dimension (`tirelib.core.units`).
    """

    plan: RunPlan
    strain: FloatArray | None = None
    rate: float = float("nan")
    start_time: float = 0.0
    trigger: BoolArray | None = None
    rig: Mapping[str, FloatArray] = field(default_factory=dict)
    rig_time: FloatArray | None = None
    dimensions: Mapping[str, str] = field(default_factory=dict)

    def time(self) -> FloatArray:
        """Return the times of the strain samples on the recording's clock, shape (n_samples,)."""
        if self.strain is None:
            return np.empty(0)
        return self.start_time + np.arange(self.strain.shape[1]) / self.rate

    def mean(self, quantity: str) -> float | None:
        """Return the mean of a rig quantity over the run, or None when it was not recorded."""
        samples = self.rig.get(quantity)
        if samples is None or samples.size == 0:
            return None
        return float(np.mean(samples))

    def hold(self, quantity: str, times: FloatArray) -> FloatArray | None:
        """Return a rig quantity at other times of the recording by zero-order hold.

        The value at ``t`` is the newest one with ``rig_time <= t``; NaN before the first.

        Parameters
        ----------
        quantity : str
        times : array, any shape, [s]
            For instance those of the strain samples, ``run.time()``.

        Returns
        -------
        values : array of the shape of `times`, or None when the quantity was not recorded.

        Raises
        ------
        ShapeError
            If the run has this quantity but not as many times.
        """
        return self.hold_all((quantity,), times).get(quantity)

    def hold_all(self, quantities: Iterable[str], times: FloatArray) -> dict[str, FloatArray]:
        """Return several rig quantities as `hold` does; one that was not recorded is left out."""
        recorded = {name: self.rig[name] for name in quantities if name in self.rig}
        recorded = {name: samples for name, samples in recorded.items() if samples.size}
        for name, samples in recorded.items():
            if self.rig_time is None or self.rig_time.shape != samples.shape:
                given = None if self.rig_time is None else self.rig_time.shape
                raise ShapeError(
                    f"run {self.plan.run}: {name} has shape {samples.shape} but rig_time has "
                    f"{given}; both need the same; give every rig sample its time"
                )
        if not recorded or self.rig_time is None:
            return {}
        newest = np.searchsorted(self.rig_time, times + CLOCK_TOLERANCE, side="right")
        return {name: np.append(np.nan, samples)[newest] for name, samples in recorded.items()}
