"""What a calibration cannot use, before the first turn: conditions out of range, slow sampling."""

import math
from collections.abc import Iterator

import numpy as np
from rich.console import Console

from tirebench.cli.run_inputs import RunInputs
from tirebench.errors import DeviceError
from tirebench.protocols import SERIAL
from tirebench.wire.conditions import QUANTITIES, Conditions
from tirelib.core.units import from_si
from tirelib.estimators.calibration import Calibration
from tirelib.fmu.remarks import condition_ends
from tirelib.measured.signal.lowpass import NYQUIST_SHARE, LowPass

_GIVEN = {
    "speed": "--speed {value:g} km/h",
    "pressure": "--pressure {value:g} bar",
    "camber": "--camber {value:g} deg",
    "friction": "--condition friction={value:g}",
    "tread_depth": "--condition tread_depth={value:g} mm",
    "tread_temperature": "--condition tread_temperature={value:g} degC",
}
_EXAMPLE = {
    "speed": "--speed 65",
    "pressure": "--pressure 2.3",
    "camber": "--camber 0",
    "friction": "--condition friction=0.9",
    "tread_depth": "--condition tread_depth=8",
    "tread_temperature": "--condition tread_temperature=40",
}
SAMPLES_PER_CYCLE = 2.0 / NYQUIST_SHARE
"""Samples in a cycle of the filter's cut-off, below which the FMU flags every turn `cut_off`."""
LEAST_SAMPLES = 2.0 * SAMPLES_PER_CYCLE
"""Samples in a cycle with which a calibration of 10 kHz still knows its own tire: at 65 km/h (24
cycles a turn) 59 of 60 turns of the rig are valid with 7.5, 60 with 9, 29 with 5.7 and 3 with 4.5;
``docs/reference/protocols.md`` has the table."""


def check_conditions(given: Conditions, calibration: Calibration) -> None:
    """Refuse a condition of which no value lies where the calibration holds.

    Raises
    ------
    DeviceError
        If a condition is beyond what the calibration allows; the text lists each in the unit of
        its option.
    """
    if faults := list(_beyond(given, calibration)):
        raise DeviceError(faults)


def _beyond(given: Conditions, calibration: Calibration) -> Iterator[str]:
    for kind, ends in condition_ends(calibration).items():
        name = kind.removesuffix("_implausible").removesuffix("_out_of_range")
        unit, dimension = QUANTITIES[name]
        values = np.array(given.values)[:, list(QUANTITIES).index(name)]
        values = values[np.isfinite(values)]
        if not values.size or ((values >= ends[0]) & (values <= ends[1])).any():
            continue
        value, low, high = (float(from_si(x, unit, dimension)) for x in (values[0], *ends))
        yield (
            f"{_GIVEN[name].format(value=value)}: {low:.3g} .. {high:.3g} {unit} is "
            f"{'possible' if kind.endswith('implausible') else 'what this calibration holds for'}, "
            f"and no turn is valid beyond; give it in {unit}, such as {_EXAMPLE[name]}, or leave "
            f"it out and use `tirebench record`"
        )


def least_rate(calibration: Calibration, speed: float, per_cycle: float = LEAST_SAMPLES) -> float:
    """Return the sample rate [Hz] that a calibration needs at a speed [m/s]."""
    radius = _radius(calibration)
    turn_rate = abs(speed) / (2.0 * math.pi * radius)
    return per_cycle * LowPass(calibration.order, calibration.cut_off).frequency(turn_rate)


def say_slow(given: RunInputs, calibration: Calibration, console: Console) -> None:
    """Print which sources sample too slowly for the calibration, and what it needs."""
    speeds = np.array(given.conditions.values)[:, list(QUANTITIES).index("speed")]
    speeds = np.abs(speeds[np.isfinite(speeds)])
    for source in given.sources:
        if source.protocol.encoding != SERIAL and source.sends_strain:
            said = slow(calibration, source.protocol.rate, speeds.max(initial=0.0))
            for text in (said,) if said else ():
                style = "bold red" if text.startswith("WARNING") else None
                console.print(
                    f"{source.port.port}: {text}", style=style, soft_wrap=True, markup=False
                )


def slow(calibration: Calibration, rate: float, speed: float) -> str:
    """Return the warning on a sample rate [Hz] at a speed [m/s]; 0 where it is not known."""
    kmh = 3.6 * speed
    turn = 2.0 * math.pi * _radius(calibration)
    if not speed:
        if calibration.cut_off is not None:
            return ""
        up_to = 3.6 * rate * turn / (LEAST_SAMPLES * calibration.order)
        return f"note: {rate:g} Hz is enough for this calibration up to {up_to:.0f} km/h"
    needed, impossible = (
        least_rate(calibration, speed, n) for n in (LEAST_SAMPLES, SAMPLES_PER_CYCLE)
    )
    if rate >= needed:
        return ""
    what = (
        f"{rate:g} Hz gives {rate * turn / speed:.0f} samples in a turn at {kmh:.0f} km/h; this "
        f"calibration needs at least {needed:.0f} Hz there"
    )
    if rate < impossible:
        return (
            f"WARNING: {what}, and below {impossible:.0f} Hz NO TURN WILL BE VALID (flag cut_off): "
            "sample faster, drive slower, or calibrate with a filter of a lower order (`tirelib "
            "calibrate --order`)"
        )
    return (
        f"WARNING: {what}; most turns will be flagged other_tire or out of range although the "
        "gages are in order: sample faster, drive slower, or calibrate with runs of this sample "
        "rate (then ignore this)"
    )


def _radius(calibration: Calibration) -> float:
    """Return the way of a radian of turning, [m]."""
    turn = calibration.reference
    known = abs(turn.speed / turn.omega) if turn is not None and turn.omega else math.nan
    return known if math.isfinite(known) else calibration.geometry.get("free_radius", 0.3)
