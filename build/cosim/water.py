"""What a wedge of water ahead of the contact does to the strain: solved on the numerical rig.

The virtual tire's surface knows no water. So the rig is solved with its water wedge
(`tirelib.rig.laws.WaterWedge`) and without, rolling freely straight ahead, and the difference of
the waveforms is added to what the virtual tire shows. Speed acts by the dynamic pressure: the wedge
presses with s rho v^2 / 2, and nothing else of it depends on the speed.

    cd build && python -m cosim.water      # what the calibration makes of the load on water
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import click
import numpy as np

from cosim.calibrate import CALIBRATION
from cosim.wheels import PRESSURE
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.estimate import Estimates
from tirelib.measured.features.extract import extract_features
from tirelib.measured.signal import LowPass, cut_turns
from tirelib.rig.laws import WaterWedge
from tirelib.rig.observe import contact, trace
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import NEW_DEPTH, Condition, RigTire, tire

DENSITY = 1000.0
"""Density of water [kg/m^3]."""
LOADS = (2700.0, 3100.0, 3500.0, 3900.0, 4300.0, 4700.0)
WEDGES = (0.0, 6e4, 1.2e5, 1.8e5, 2.4e5)
"""Loads [N] and pressures of the wedge [Pa] that are solved."""
SPEED = 22.0
"""At which they are [m/s]."""
POINTS = 1440
"""Wheel angles of a waveform."""
TURNS, RATE = 4, 1e4
"""Turns that are played to the calibration, at a sample rate [Hz]."""
_WEDGE = WaterWedge(1.0)
SPREAD = 0.5 * (_WEDGE.length + _WEDGE.fade) * RigTire().belt_width
"""Lift per pressure of the wedge [m^2]: a triangle ahead of the contact and one into it."""


def wedge_pressure(strength: float, speed: FloatArray | float) -> FloatArray:
    """Return s rho v^2 / 2 [Pa] of a strength [1] at speeds [m/s]."""
    return np.asarray(strength * 0.5 * DENSITY * np.square(speed), dtype=np.float64)


@dataclass(frozen=True)
class WaterTable:
    """Differences of strain over load, pressure of the wedge and wheel angle.

    Attributes
    ----------
    loads, wedges : array, shapes (l,), (w,), [N], [Pa]
    change : array, shape (l, w, n, 5)
        Strain with the wedge less strain without; n wheel angles from -pi on, evenly.
    """

    loads: FloatArray
    wedges: FloatArray
    change: FloatArray

    def at(self, load: float, wedge: float, angle: FloatArray) -> FloatArray:
        """Return the change of the strain, shape (n, 5), at wheel angles [rad], linear between.

        Outside of the table the nearest load or pressure holds.
        """
        i, a = _place(self.loads, load)
        j, b = _place(self.wedges, wedge)
        rows = self.change[i : i + 2, j : j + 2]
        wave = np.tensordot(np.outer((1.0 - a, a), (1.0 - b, b)), rows, axes=2)
        n = wave.shape[0]
        at = np.mod(angle + np.pi, 2.0 * np.pi) * n / (2.0 * np.pi)
        first = np.floor(at).astype(np.int64)
        part = (at - first)[:, None]
        found: FloatArray = (1.0 - part) * wave[first % n] + part * wave[(first + 1) % n]
        return found


def _place(knots: FloatArray, value: float) -> tuple[int, float]:
    """Return the knot below a value, and the share of the way to the next, 0 .. 1."""
    i = int(np.clip(np.searchsorted(knots, value) - 1, 0, knots.size - 2))
    return i, float(np.clip((value - knots[i]) / (knots[i + 1] - knots[i]), 0.0, 1.0))


def solved(
    load: float, wedge: float, speed: float = SPEED, start: RigState | None = None
) -> RigState:
    """Return the rig's state that rolls freely on a wedge of a pressure [Pa], from a near one."""
    rolling = tire("reference")
    if wedge:
        law = WaterWedge(wedge / float(wedge_pressure(1.0, speed)))
        rolling = replace(rolling, road_laws=(law,))
    return solve(rolling, Condition(load, PRESSURE, speed, 0.0, 0.0, None), start)


def lift_of(state: RigState) -> float:
    """Return what the water carries in a state [N]: the load less that of the same tread, dry."""
    wet = contact(state)
    dry = contact(replace(state, tire=replace(state.tire, road_laws=())))
    return float(np.sum(wet.area * (wet.q - dry.q)))


def water_table(loads: Sequence[float] = LOADS, wedges: Sequence[float] = WEDGES) -> WaterTable:
    """Solve the rig at every load and pressure of the wedge, the first of which is 0; a minute."""
    change = []
    for load in loads:
        states = [solved(load, 0.0)]
        for wedge in wedges[1:]:
            states.append(solved(load, wedge, start=states[-1]))
        waves = np.array([trace(state, POINTS).strain for state in states])
        change.append(waves - waves[0])
    return WaterTable(np.array(loads), np.array(wedges), np.array(change))


def told_of(state: RigState, calibration: Calibration) -> Estimates:
    """Return what a calibration tells of turns of a state."""
    wave, omega = trace(state, POINTS).strain, SPEED / RigTire().ring_radius
    samples = int(TURNS * 2.0 * np.pi / omega * RATE)
    angle = omega * np.arange(samples) / RATE - np.pi
    grid = 2.0 * np.pi * np.arange(POINTS) / POINTS - np.pi
    strain = np.array([np.interp(angle, grid, gage, period=2.0 * np.pi) for gage in wave.T])
    low_pass = LowPass(calibration.order, calibration.cut_off)
    turns = cut_turns(
        strain,
        RATE,
        calibration.lateral,
        low_pass=low_pass,
        speed=SPEED,
        omega=omega,
        pressure=PRESSURE,
        camber=0.0,
        tread_depth=NEW_DEPTH,
    )
    return calibration.estimate(extract_features(turns))


def main() -> None:
    """Print what the load and its standard deviation are on a wedge of water."""
    calibration = read_calibration(CALIBRATION)
    click.echo(
        "load [N]   on the water [%]   told / load   std / told   valid   (std / told) / share"
    )
    for load in LOADS:
        state = solved(load, 0.0)
        for wedge in (0.0, 4e4, 8e4, 1.2e5, 1.6e5):
            state = solved(load, wedge, start=state)
            found, share = told_of(state, calibration), lift_of(state) / load
            told, std, valid = found.value["Fz"][-1], found.std["Fz"][-1], found.valid["Fz"][-1]
            ratio = std / told / share if share else np.nan
            click.echo(
                f"{load:8.0f} {100 * share:18.1f} {told / load:13.3f} {std / told:12.3f} "
                f"{valid!s:>7} {ratio:23.2f}"
            )


if __name__ == "__main__":
    with one_thread():
        main()
