"""What decides where the contact models refuse: pull inside the patch, harmonics of the start.

    python build/contact_constants.py

Wheels of a bicycle, a kart and a car, light to heavy and with treads up to ten times harder, are
simulated with the linear ring; the largest tension inside the patch over the peak pressure is
printed, which `LARGEST_PULL` allows. Then the exact ring is started with fewer and more harmonics.
"""

from itertools import product
from unittest import mock

import click

from tirelib.core.errors import ConvergenceError, TirelibError
from tirelib.core.parameters import read_tire
from tirelib.core.threads import one_thread
from tirelib.physics.contact import checks, exact
from tirelib.physics.contact import exact_energy as energy
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.ring import Ring
from tirelib.report.simulation import simulate

BICYCLE = {
    "ring_radius": 0.330,
    "free_radius": 0.3335,
    "belt_width": 0.04065,
    "tread_thickness": 0.0035,
    "innerliner_offset": -0.001,
    "bending_stiffness": 0.009382,
    "mass": 0.25,
    "pressure": 2.946e5,
    "radial_stiffness": 1.73e5,
    "tangential_stiffness": 4e4,
    "tread_stiffness": 1.191e8,
}
WHEELS: dict[str, tuple[dict[str, float], tuple[float, ...]]] = {
    "car": ({}, (500.0, 4000.0, 8000.0)),
    "kart": ({"ring_radius": 0.125, "free_radius": 0.1375}, (100.0, 600.0)),
    "bicycle": (BICYCLE, (20.0, 100.0, 400.0, 800.0)),
}
HARDER = (1.0, 3.0, 10.0)
TRIED = (0.5, 1.0, 2.0)


def pulls() -> list[tuple[str, float]]:
    """Return the largest pull over peak pressure of every wheel that can be pressed at all."""
    base, found = read_tire("table-6-1").tire, []
    for (name, (changes, loads)), harder in product(WHEELS.items(), HARDER):
        wheel = base.changed(**changes)
        wheel = wheel.changed(tread_stiffness=harder * wheel.tread_stiffness)
        for load in loads:
            pull = 0.0
            with mock.patch.object(checks, "LARGEST_PULL", 0.0):
                try:
                    simulate(wheel, load=load)
                except ConvergenceError as error:
                    pull = error.residual
                except TirelibError:
                    continue
            found.append((f"{name}, {load:g} N, tread x {harder:g}", pull))
    return found


def main() -> None:
    """Print both tables."""
    found = pulls()
    for label, pull in found:
        click.echo(f"{label}: {pull:.1e}")
    for factor in TRIED:
        refused = sum(pull > factor * checks.LARGEST_PULL for _, pull in found)
        click.echo(f"LARGEST_PULL x {factor:g}: {refused} of {len(found)} refused")
    thin = (
        read_tire("table-6-1")
        .tire.changed(**BICYCLE)
        .changed(
            belt_width=0.026,
            bending_stiffness=0.0207,
            pressure=5.664e5,
            radial_stiffness=2.6e4,
            tread_stiffness=2.79e9,
        )
    )
    for modes in (1, 2, 4, 8):
        count = modes * energy.N_MODES
        cells = []
        for load in (30.0, 60.0, 100.0, 200.0, 400.0):
            with mock.patch.object(exact, "START_MODES", count):
                try:
                    exact.load_exact(Ring.of(thin, thin.pressure), Tread.of(thin), load)
                    cells.append(f"{load:g} N solved")
                except TirelibError as error:
                    cells.append(f"{load:g} N {type(error).__name__}")
        click.echo(f"START_MODES = {modes} N_MODES: {', '.join(cells)}")


if __name__ == "__main__":
    with one_thread():
        main()
