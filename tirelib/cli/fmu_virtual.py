"""``tirelib fmu virtual``: a tire with strain gages as an FMU, for any vehicle model."""

import shlex
from pathlib import Path

import click

from tirelib.cli.common import FILE, NEW_FILE, NEW_FOLDER, Real, Whole, output
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import ParameterError
from tirelib.fmu.parts import DEFAULT_RATE
from tirelib.fmu.virtual.spec import build_virtual, default_surface, friction_surface
from tirelib.fmu.virtual.surface import read_surface

_EPILOG = """\b
Examples:
  tirelib fmu virtual --out VirtualTire.fmu --samples-per-step 10
  tirelib fmu virtual --out Wet.fmu --friction     # friction is an input
  tirelib fmu virtual --out Slow.fmu --python       # computes in Python
  tirelib fmu check VirtualTire.fmu

\b
FMI 2.0 co-simulation, one wheel: Fz, alpha, kappa, camber, speed and pressure in, strain frames out
for StrainTire.fmu with the same samples per step. It is compiled for Linux, Windows and macOS and
needs nothing else where it runs (with --python: CPython with numpy and scipy).
"""


@click.command(epilog=_EPILOG)
@click.option("--out", metavar="X.fmu", type=NEW_FILE, required=True, help="FMU to write.")
@click.option(
    "--samples-per-step",
    metavar="K",
    type=Whole(),
    default=10,
    show_default=True,
    help="Largest number of samples of each gage in one communication step. 10 are 1 ms at 10 kHz, "
    "the step of a vehicle model. Build StrainTire.fmu with the same number: its own default is 1.",
)
@click.option(
    "--sample-rate",
    metavar="HZ",
    type=Real(),
    default=DEFAULT_RATE,
    show_default=True,
    help="Start value of the FMU's parameter of the same name.",
)
@click.option(
    "--surface",
    metavar="FILE.npz",
    type=FILE,
    help="Response surface of the tire. Default: that of the reference tire.",
)
@click.option(
    "--friction",
    is_flag=True,
    help="Use the reference tire's response surface with friction as an input.",
)
@click.option(
    "--python",
    is_flag=True,
    help="Pack the Python tire instead of the compiled one.",
)
@progress_options
def virtual(
    out: Path,
    samples_per_step: int,
    sample_rate: float,
    surface: Path | None,
    friction: bool,
    python: bool,
) -> None:
    """Write VirtualTire.fmu: the numerical rig as a sensor."""
    if friction and surface is not None:
        raise ParameterError(
            f"fmu virtual: --friction and --surface {surface}; only one of them is allowed; leave "
            "out --friction: a surface that covers friction provides the input by itself"
        )
    usual = friction_surface() if friction else default_surface()
    with progress_bar("building", 3) as progress:
        path = build_virtual(
            out,
            samples_per_step=samples_per_step,
            sample_rate=sample_rate,
            surface=surface or usual,
            python=python,
            progress=progress,
        )
    console = output()
    console.print(f"communication step up to {1e3 * samples_per_step / sample_rate:g} ms")
    console.print(f"written: {path} ({path.stat().st_size / 1e3:.0f} kB)")
    console.print(f"next: {shlex.join(['tirelib', 'fmu', 'check', str(path)])}")


_MEASURE = """\b
Examples:
  tirelib fmu measure --out car
  tirelib calibrate car --out car.toml
  tirelib fmu build --calibration car.toml --out StrainTire.fmu --samples-per-step 10

\b
The calibration that a vehicle on VirtualTire.fmu needs: load 0.9 to 7.4 kN, slip angle to 5.8 deg,
slip ratio -0.115 to 0.015, camber to 3.7 deg, 8 to 30 m/s, 2.3 bar, in 384 runs. The strain is that
of VirtualTire.fmu, not that of the numerical rig (`tirelib rig`), so it takes seconds.
"""


@click.command(epilog=_MEASURE)
@click.option("--out", metavar="DIR", type=NEW_FOLDER, required=True, help="Campaign folder.")
@click.option(
    "--seed",
    default=1,
    show_default=True,
    type=Whole(min=0),
    help="Seed of one test day: noise, loads and gains.",
)
@click.option(
    "--surface",
    metavar="FILE.npz",
    type=FILE,
    help="Response surface of the tire. Default: that of the reference tire.",
)
@click.option("--force", is_flag=True, help="Write into a folder that is not empty.")
@progress_options
def measure(out: Path, seed: int, surface: Path | None, force: bool) -> None:
    """Measure the virtual tire over what a car's wheels do; write a campaign."""
    from tirelib.fmu.virtual.drive import drive
    from tirelib.fmu.virtual.measure import measure as measured

    known = read_surface(surface or default_surface())
    with progress_bar("measuring", len(drive())) as progress:
        runs = measured(known, out, seed=seed, overwrite=force, progress=progress)
    console = output()
    console.print(f"{runs} runs of the virtual tire in {out} (axes iso, seed {seed})")
    console.print(f"next: {shlex.join(['tirelib', 'calibrate', str(out), '--out', 'car.toml'])}")
