"""Co-simulations of a third-party vehicle with four virtual and four strain tires: ``make cosim``.

A multi-body vehicle drives; four ``VirtualTire.fmu`` turn its wheels' states into strain, four
``StrainTire.fmu`` turn the strain into estimates, which are held against the truth. The same
tires then close loops on the 14-DOF vehicle: slip control, stability control, anti-lock braking on
roads of unknown friction, and a drive into water. Everything lands in ``build/out/cosim``.
"""

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from pages.cosim import Series, write_cosim
from rich.console import Console

from cosim import (
    antilock,
    antilock_report,
    antilock_roads,
    closed_loop,
    closed_loop_report,
    closed_loop_stability,
    hydroplaning,
    hydroplaning_report,
)
from cosim import closed_loop_stability_report as stability_report
from cosim.calibrate import CALIBRATION
from cosim.drill import drill
from cosim.manoeuvres import MANOEUVRES
from cosim.recording import TIME_STEP, VEHICLE, Recording, build_fmus, record
from cosim.score import COVERED, LIMITS, score, turns_of
from cosim.wheels import WHEELS, FourWheels
from tirelib.cli.progress import progress_bar
from tirelib.core.threads import one_thread
from tirelib.core.version import __version__
from tirelib.rig.campaign import THREADS

ROOT = Path(__file__).parents[2]
DRILL, STABILITY, WATER = "range", "stability", "hydroplaning"
BRAKING = {f"closed_loop_{road.name}": road for road in closed_loop.SHOWN_ROADS}
ANTILOCK = {f"antilock_{road.name}": road for road in antilock_roads.ROADS}
LOOPS = (*BRAKING, STABILITY, *ANTILOCK, WATER)
LONG = "closed_loop_split"
"""Half of the work: on a split road the way to a stop is long, and every source goes it."""
ON_FRICTION = ("alpha",)
"""What the friction of the road changes at the same strain."""
OTHERS = {
    DRILL: 4.0,
    STABILITY: 15.0,
    WATER: 8.0,
    **dict.fromkeys(BRAKING, 20.0),
    **dict.fromkeys(ANTILOCK, 6.0),
}
"""As long as a manoeuvre of so many seconds."""
EVERY = 10
"""The page shows every so many steps of the truth."""
_EXAMPLES = """examples:
  python build/cosim/run.py                                  # build/out/cosim/index.html
  python build/cosim/run.py --all                            # and braking on a split road
  python build/cosim/run.py step_steer slalom --jobs 1       # two of them, nothing else
  python build/cosim/run.py --json build/out/cosim/cosim.json --calibration cal.toml

exit code: 0 all figures reached, 1 some are not, 2 wrong arguments"""


Fmus = tuple[Path, Path]


def work(name: str, fmus: Fmus) -> tuple[str, Any]:
    """Do one part in a process of its own: a manoeuvre, the drill or the closed loop."""
    if name in BRAKING:
        return name, closed_loop.study(*fmus, [BRAKING[name]])
    if name == STABILITY:
        return name, closed_loop_stability.stability(*fmus)
    if name in ANTILOCK:
        return name, antilock.study(*fmus, [ANTILOCK[name]])
    if name == WATER:
        return name, hydroplaning.study(*fmus)
    with FourWheels(*fmus, speed_sensors=True) as wheels:
        if name == DRILL:
            return name, drill(wheels)
        recording = record(MANOEUVRES[name], wheels)
        return name, (score(recording), series(recording))


def series(recording: Recording) -> Series:
    """Return what the page draws of a recording."""
    rows = slice(None, None, EVERY)
    truth = {name: recording.truth[name][rows] for name in ("Fz", "alpha", "kappa")}
    turns = [turns_of(recording, wheel) for wheel in range(len(WHEELS))]
    return Series(
        name=recording.name,
        about=MANOEUVRES[recording.name].about,
        time=recording.time[rows],
        truth=truth | {"Fy": recording.told["tire_fy"][rows]},
        contact=[t.contact for t in turns],
        told=[t.told for t in turns],
        valid=[t.valid for t in turns],
        steady=[t.steady for t in turns],
    )


def reached(scores: Sequence[dict[str, Any]], checks: Sequence[dict[str, Any]]) -> list[str]:
    """Return in words which figures are not reached.

    On a road of another friction than the calibrated one every interval has to hold, and a slip
    angle cannot be told any better than its own says, so no figure binds its error there.
    """
    missed = []
    for one in scores:
        whole, slippery = one["all"], one["least_friction"] < 1.0
        for name, limit in LIMITS.items():
            error, part = whole["steady"][name], whole["interval"][name]["covered"]
            if slippery and part < COVERED:
                missed.append(
                    f"{one['name']}: the interval of {name} holds {100 * part:.0f} % of the "
                    f"turns < {100 * COVERED:g} %"
                )
            if slippery and name in ON_FRICTION:
                continue
            if math.isfinite(error) and error > limit:
                missed.append(f"{one['name']}: {name} {error:.3g} > {limit:g}")
        if whole["false_alarms"] > 0.01:
            missed.append(f"{one['name']}: false alarms {100 * whole['false_alarms']:.1f} % > 1 %")
        if whole["missed_s"] > 0.0:
            missed.append(f"{one['name']}: valid {whole['missed_s']:.3f} s out of range")
        if whole["over_deg"] > 0.0:
            missed.append(f"{one['name']}: output {whole['over_deg']:.2f} deg too late")
    missed += [f"range: {check['case']}" for check in checks if not check["passed"]]
    return missed


def run(parts: Mapping[str, Fmus], jobs: int) -> dict[str, Any]:
    """Run parts, each with its FMUs; return what each found."""
    found: dict[str, Any] = {}
    for name in THREADS:  # with more, processes wait for each other's most of the time
        os.environ.setdefault(name, "1")
    names = sorted(parts, key=_length, reverse=True)
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"))
    with progress_bar("co-simulation", len(names)) as advance, pool:
        for job in as_completed([pool.submit(work, name, parts[name]) for name in names]):
            name, result = job.result()
            found[name] = result
            advance(name)
    return found


def _length(name: str) -> float:
    return MANOEUVRES[name].duration if name in MANOEUVRES else OTHERS[name]


def main() -> None:
    """Run the co-simulations and write the page."""
    parser = argparse.ArgumentParser(
        description="Vehicle co-simulations: estimated against true wheel quantities.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "manoeuvres",
        nargs="*",
        metavar="MANOEUVRE",
        help=f"or loop, of {', '.join([*MANOEUVRES, *LOOPS])}",
    )
    parser.add_argument("--all", action="store_true", help=f"with the long part, {LONG}")
    parser.add_argument("--calibration", type=Path, default=CALIBRATION, metavar="CAL.toml")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/cosim", metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures as JSON too")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes")
    given = parser.parse_args()
    known = (*MANOEUVRES, *LOOPS)
    unknown = [name for name in given.manoeuvres if name not in known]
    if unknown or given.jobs < 1 or not given.calibration.is_file():
        parser.error(
            f"manoeuvres {', '.join(unknown) or 'are fine'}, jobs = {given.jobs}, calibration "
            f"{given.calibration}; allowed are {', '.join(known)}, 1 or more, a file made by "
            "build/cosim/calibrate.py or `tirelib calibrate`"
        )
    console, began = Console(), time.monotonic()
    every = not given.manoeuvres
    names = [name for name in given.manoeuvres if name in MANOEUVRES] or (every * list(MANOEUVRES))
    given.out.mkdir(parents=True, exist_ok=True)
    fmus = build_fmus(given.out, given.calibration)
    parts = dict.fromkeys([*names, DRILL], fmus)
    loops = [
        name
        for name in LOOPS
        if (every and (given.all or name != LONG)) or name in given.manoeuvres
    ]
    if loops:
        slow = build_fmus(given.out / "closed_loop", given.calibration, closed_loop.TIME_STEP)
        parts |= dict.fromkeys(loops, slow)
    found = run(parts, given.jobs)
    scores, checks = [found[name][0] for name in names], found[DRILL]
    stops = [found[name] for name in ANTILOCK if name in found]
    brakes, water = antilock.joined(stops) if stops else None, found.get(WATER)
    missed = reached(scores, checks)
    missed += antilock.missed(brakes) if brakes else []
    missed += hydroplaning.missed(water) if water else []
    studies = [found[name] for name in BRAKING if name in found]
    stability = found.get(STABILITY)
    study = closed_loop.joined(studies) if studies else None
    document = {
        "format": "tirelib-cosim/1",
        "tirelib": __version__,
        "date": datetime.now(UTC).date().isoformat(),
        "vehicle": f"CommonRoad multi-body, parameter set {VEHICLE}",
        "loop_vehicle": "14 degrees of freedom",
        "step_s": TIME_STEP,
        "calibration": given.calibration.name,
        "limits": dict(LIMITS),
        "missed": missed,
        "manoeuvres": scores,
        "range": checks,
        "closed_loop": study.document() if study else None,
        "stability": closed_loop_stability.document(stability) if stability else None,
        "antilock": brakes.document() if brakes else None,
        "hydroplaning": hydroplaning.document(water) if water else None,
    }
    more = closed_loop_report.parts(study) if study else []
    more += [stability_report.part(stability)] if stability else []
    more += [antilock_report.part(brakes)] if brakes else []
    more += [hydroplaning_report.part(water)] if water else []
    page = write_cosim(document, [found[name][1] for name in names], given.out, more)
    if given.json:
        given.json.parent.mkdir(parents=True, exist_ok=True)
        given.json.write_text(json.dumps(_plain(document), indent=1) + "\n", encoding="utf-8")
    for text in missed:
        console.print(f"not reached  {text}", style="red", highlight=False, soft_wrap=True)
    said = f"{len(names)} manoeuvres in {time.monotonic() - began:.0f} s"
    console.print(f"{said}; open {page}", highlight=False, soft_wrap=True)
    sys.exit(1 if missed else 0)


def _plain(value: Any) -> Any:
    """Return the same with null for what is no number, as JSON wants it."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


if __name__ == "__main__":
    with one_thread():
        main()
