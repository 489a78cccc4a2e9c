"""Campaigns that the model itself makes, with known parameters and noise."""

from collections.abc import Mapping, Sequence

import numpy as np
from routes.damped_ring import Law, damped_waveform

from tirelib.campaign import CampaignHeader, Tolerance
from tirelib.campaign.model import TireGeometry
from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import Number, Tire, TireFile, read_tire
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import CONDITIONS, Waveforms
from tirelib.model.base import operating_points, predict, values_of
from tirelib.model.solution import solved

BAR = 1e5
KMH = 1.0 / 3.6
Condition = tuple[float, float, float]
"""Load [N], pressure [bar], speed [km/h]."""

SERIES: Sequence[Condition] = [
    (load, bar, 65.0)
    for bar, loads in (
        (1.7, (1700, 3400, 6800)),
        (2.1, (1700, 2600, 4300, 6000, 6800)),
        (2.5, (1700, 3400, 6800)),
    )
    for load in loads
]
FIVE_LOADS: Sequence[Condition] = [
    (load, bar, 65.0) for bar in (1.7, 2.1, 2.5) for load in (1700, 2600, 4300, 6000, 6800)
]
"""At every pressure: a stiffness over three loads is itself known to 3 % only."""
SPEEDS: Sequence[Condition] = [
    (load, 2.1, kmh) for kmh in (15.0, 65.0, 120.0) for load in (2400.0, 4800.0, 6800.0)
]


def tire(**values: float) -> Tire:
    """Return the tire of Table 6-1 with the corrected pressure slope and changes."""
    plain = read_tire("table-6-1").tire
    return plain.changed(
        **{"pressure": 2.1e5, "radial_pressure_slope": 0.9, "tangential_pressure_slope": 0.3}
        | values
    )


def tire_file(of: Tire, **std: float) -> TireFile:
    """Return a tire file of all values, with relative deviations of some."""
    numbers = {}
    for name, value in values_of(of).items():
        deviation = std.get(name, float("nan")) * abs(float(value))
        numbers[name] = Number(float(value), deviation, "assumed", "test")
    return TireFile("start", numbers)


def waves(
    of: Tire,
    conditions: Sequence[Condition],
    *,
    noise: float = 1e-6,
    angle_std: float = 0.0,
    damping: float = 0.0,
    law: Law = "sidewall",
    exact: bool = True,
    seed: int = 1,
) -> Waveforms:
    """Return waveforms of straight runs; the exact ring without damping, the sheared one with."""
    random = np.random.default_rng(seed)
    load, bar, kmh = np.array(conditions, dtype=float).T
    n = load.size
    header = CampaignHeader(
        "made by the model",
        "iso",
        TireGeometry(
            "known",
            of.free_radius,
            of.ring_radius,
            of.tread_thickness,
            of.belt_width,
            of.innerliner_offset,
        ),
        (-0.03, 0.0, 0.03),
        10e3,
        tolerance=Tolerance(0.003, 0.002, 0.001, 0.001),
    )
    zero = np.zeros(n)
    known: Mapping[str, FloatArray] = {
        "Fz": load,
        "pressure": bar * BAR,
        "speed": kmh * KMH,
        "omega": kmh * KMH / 0.305,
        "slip_angle": zero,
        "camber": zero,
        "slip_ratio": zero,
    }
    plain = Waveforms(
        header,
        np.zeros((n, 3, 360)),
        np.arange(1, n + 1),
        np.full(n, 9),
        np.full(n, 3.0 * noise),
        np.full(n, angle_std if angle_std else 1e-5),
        np.arange(n, dtype=float),
        np.arange(n),
        {name: known.get(name, np.full(n, np.nan)) for name in CONDITIONS},
        {},
        LowPass(),
        {},
    )
    points, values = operating_points(plain), values_of(of)
    linear = predict(values, points)
    strain, deflection = linear.wave, linear.deflection
    if exact:
        whole = solved(values, points, low_pass=LowPass())
        strain, deflection = whole.waveform, whole.deflection
    if damping:
        strain = damped_waveform(values, points, damping, law)
    shift = angle_std * random.standard_normal(n)
    strain = turned(strain, shift)[:, None, :] + noise * random.standard_normal((n, 3, 360))
    radius = of.free_radius - deflection
    fields = {name: getattr(plain, name) for name in plain.__dataclass_fields__}
    measured = dict(plain.conditions) | {"loaded_radius": radius}
    return Waveforms(**(fields | {"strain": strain, "conditions": measured}))


def turned(strain: FloatArray, shift: FloatArray) -> FloatArray:
    """Return waveforms turned forward by angles (n_runs,)."""
    spectrum = np.fft.rfft(strain, axis=1)
    order = np.arange(spectrum.shape[1])
    out: FloatArray = np.fft.irfft(
        spectrum * np.exp(-1j * order * shift[:, None]), n=strain.shape[1], axis=1
    )
    return out


def runs(of: Tire, conditions: Sequence[Condition], **options: float) -> StraightRuns:
    """Return the straight runs of `waves`."""
    return straight_runs(waves(of, conditions, **options))
