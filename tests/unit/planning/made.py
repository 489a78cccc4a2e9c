"""A small campaign of a tire unlike the model, with an effect that its plan hardly tells apart."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from tests.unit.identify.model_waves import ANGLE_STD, TIRE, TOLERANCE, exact_waveform, operating
from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import values_of
from tirelib.model.state import Operating
from tirelib.planning.criterion import NextTest
from tirelib.planning.envelope import Envelope
from tirelib.planning.next_test import next_test
from tirelib.planning.variants import Track, Variants, draw_variants
from tirelib.signal import LowPass

NOISE = 4e-6
PLANTED, TWIN = "temperature", "dynamic_stiffening"
STRENGTH, STRONG = 0.014, 0.030
"""The six runs leave the first open. They tell the second from its twin by a chi-square of 87, in
the metric in which a diagnosis weighs a ring's structure, and need no further run."""
CONDITIONS = (
    (3000.0, 1.8e5, 11.0),
    (6000.0, 2.4e5, 11.0),
    (4500.0, 2.1e5, 17.0),
    (4500.0, 2.1e5, 22.0),
    (3000.0, 2.4e5, 28.0),
    (6000.0, 1.8e5, 28.0),
)
"""Speed rises in the order of the runs, so softening with time looks like softening with speed."""


def points_at(conditions: tuple[tuple[float, float, float], ...]) -> Operating:
    load, pressure, speed = np.array(conditions).T
    return replace(operating(load, pressure), speed=speed, omega=speed / TIRE.ring_radius)


@dataclass(frozen=True)
class Case:
    data: Data
    base: Refit
    bench: Data
    model: Refit
    variants: Variants


@cache
def case(strength: float = STRENGTH, seed: int = 5) -> Case:
    points, random = points_at(CONDITIONS), np.random.default_rng(seed)
    wave, _ = exact_waveform(TIRE, points)
    n = len(points)
    noise = float(np.hypot(NOISE, 0.016 * np.sqrt(np.mean(wave**2))))
    bench = Data(
        wave, points, np.full(n, ANGLE_STD), TOLERANCE, noise, LowPass(), np.full(n, np.nan)
    )
    model = refit(bench, values_of(TIRE))
    variants = draw_variants(1, 0.3, random)
    track = Track.of(variants, model, bench, points, noise=NOISE, random=random)
    strain = track.measured([CATALOGUE[PLANTED].at(strength)], bench)[0]
    data = replace(bench, strain=strain)
    return Case(data, refit(data, values_of(TIRE)), bench, model, variants)


@cache
def planned() -> NextTest:
    made = case()
    suspects = [(CATALOGUE[name], np.array([0.02])) for name in (TWIN, PLANTED)]
    return next_test(made.data, made.base, suspects, Envelope.of(made.data.points), noise=NOISE)


def measured(data: Data, points: Operating, strain: FloatArray) -> Data:
    """Return runs with measured waveforms as data of the same rig."""
    n = len(points)
    return replace(
        data,
        strain=strain,
        points=points,
        angle_std=np.full(n, float(np.mean(data.angle_std))),
        deflection=np.full(n, np.nan),
    )


def joined(data: Data, more: Data) -> Data:
    """Return the runs of both; order in the campaign is counted anew."""
    points = Operating(
        *[
            np.concatenate([getattr(data.points, name), getattr(more.points, name)])
            for name in data.points.__slots__
        ]
    )
    count = len(points)
    points = replace(
        points, order=np.argsort(np.argsort(points.order, kind="stable")) / (count - 1)
    )
    return replace(
        data,
        points=points,
        strain=np.concatenate([data.strain, more.strain]),
        angle_std=np.concatenate([data.angle_std, more.angle_std]),
        deflection=np.concatenate([data.deflection, more.deflection]),
    )
