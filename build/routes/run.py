"""Follow the dissertation's two routes, chapters 5 and 6, on a campaign of straight runs.

    tirelib rig --plan straight --out build/out/straight
    python build/routes/run.py build/out/straight --json build/out/routes.json

Prints the contact angles read at the strain-rate peaks, the bias of that reading (Fig. 6-12) and
the load that the angles give as printed and corrected (Fig. 6-21), the static ring's stiffness by
both methods of chapter 5, and the damping by both laws. The JSON file (``routes/1``) holds,
besides, contact length, stiffness and pressure by method, and the rolling tire's pressure by
Eq. (114) at five loads; ``docs/theory/identification_routes.md`` says what each number means.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from routes.document import routes_document
from routes.follow import follow_routes
from tirelib.campaign import read_campaign
from tirelib.cli.common import write_json
from tirelib.core.parameters import read_tire
from tirelib.core.threads import one_thread
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import start_file
from tirelib.measured.waveforms import measure_waveforms

FORMAT = "routes/1"


def angle_lines(dynamic: dict[str, Any]) -> Iterator[str]:
    """Return a line for each run: its contact angle, and the load that follows from it."""
    yield "contact angles from strain-rate peaks, the bias of this method, and the load by them"
    yield f"{'run':>5} {'load':>7} {'half angle':>11} {'bias':>7} {'corrected':>14} {'error':>18}"
    yield f"{'':5} {'[N]':>7} {'read [deg]':>11} {'[deg]':>7} {'[deg]':>14} {'by print,':>18}"
    yield f"{'':48} {'corrected [%]':>18}"
    angles = {row["run"]: row for row in dynamic["contact_angles"]}
    for load in dynamic["loads"]:
        row = angles[load["run"]]
        read, true = (0.5 * float(np.ptp(row[key])) for key in ("read_deg", "corrected_deg"))
        printed = load["as_printed_percent"]
        errors = "" if printed is None else f"{printed:+.1f}, "
        errors += f"{load['corrected_percent']:+.1f}"
        yield (
            f"{load['run']:5d} {load['measured_N']:7.0f} {read:11.2f} {row['half_bias_deg']:+7.2f} "
            f"{true:6.2f} +- {row['half_std_deg']:.2f} {errors:>18}"
        )


def static_line(static: dict[str, Any]) -> str:
    """Return the static ring's stiffness, from strain and by pressing it."""
    by_strain, pressed = (
        {q["name"]: q["value"] for q in static[key]}
        for key in ("from_strain", "from_contact_model")
    )
    said = [
        f"{name} {by_strain[name]:.3g}"
        + (f" against {pressed[name]:.3g}" if name in pressed else "")
        + f" {unit}"
        for name, unit in (("bending_stiffness", "N m^2"), ("radial_stiffness", "N/m^2"))
    ]
    return f"static ring without tension (chapter 5), from strain and pressed: {'; '.join(said)}"


def damping_lines(damping: dict[str, Any]) -> Iterator[str]:
    """Return the damping by both laws, from strain alone and against the trigger."""
    readings, modal = damping["readings"], damping["modal"]
    yield f"damping of the sidewall's dashpots: {_interval(damping)}, from strain alone;"
    yield "  `tirelib add sidewall_damping` adds it to a model"
    yield f"  with the wheel angle from the trigger: {_interval(readings['with_angle'])}"
    if modal is not None:
        yield (
            f"  as a ratio of every mode, Eq. (107): {_interval(modal['without_angle'])}; this is "
            "the value for `tirelib simulate --damping`"
        )


def _interval(found: dict[str, Any] | None) -> str:
    if found is None:
        return "none"
    flags = f" ({', '.join(found['flags'])})" if found["flags"] else ""
    return f"{found['value']:.3f}, 95 % {found['low']:.3f} to {found['high']:.3f}{flags}"


def lines(document: dict[str, Any]) -> Iterator[str]:
    """Return what is printed of a document."""
    if document["chapter_6"] is not None:
        yield from angle_lines(document["chapter_6"])
    if document["chapter_5"] is not None:
        yield static_line(document["chapter_5"])
    if document["damping"] is not None:
        yield from damping_lines(document["damping"])
    yield from document["reasons"]


@one_thread()
def main() -> None:
    """Follow both routes on a campaign."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("campaign", type=Path, help="folder of a campaign with strain")
    parser.add_argument("--tire", help="tire file or name: start values and priors")
    parser.add_argument("--json", type=Path, help="file for all numbers")
    chosen = parser.parse_args()
    campaign = read_campaign(chosen.campaign)
    known = read_tire(chosen.tire) if chosen.tire else None
    runs = straight_runs(measure_waveforms(campaign))
    start = start_file(campaign.header, runs, known, "dissertation")
    document = routes_document(follow_routes(runs, start))
    for line in lines(document):
        sys.stdout.write(f"{line}\n")
    if chosen.json is not None:
        write_json(chosen.json, {"format": FORMAT, "campaign": campaign.header.name, **document})


if __name__ == "__main__":
    main()
