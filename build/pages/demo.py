"""The page of the demonstration: every figure of chapter 4 from campaigns, and what they show."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pages import DEMO
from pages.cutoff_study import nearest_runs, study_cut_off
from pages.figures.camber import figure_4_16
from pages.figures.contact import figure_4_2
from pages.figures.cutoff import figure_cut_off
from pages.figures.slip_ratio import figure_4_17, figure_4_18
from pages.figures.strain import figure_3_7, figure_4_1
from pages.live import LiveFiles, live_drawing, live_table, live_text, read_line
from pages.turns import TypicalTurns, typical_turns
from tirelib.campaign import Campaign, RunPlan, read_campaign
from tirelib.core.errors import CalibrationError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.train import Trained, train
from tirelib.measured.observations import Observations, observe
from tirelib.measured.signal import LowPass
from tirelib.report import figures
from tirelib.report.accuracy import QUANTITIES, Accuracy, accuracy, compare
from tirelib.report.calibration import regression_drawings
from tirelib.report.estimate import accuracy_table
from tirelib.report.figures.regression import find_regression, in_use, known_rms
from tirelib.report.page import DASH, Part, Picture, Table, draw_all, number, write_page

NEEDED = ("set1", "set1-unseen")
OPTIONAL = ("set2", "brake_drive", "brake_drive-unseen", "set3")
"""Folders that the page can use: cornering, the same on another day, camber, braking, speeds."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A campaign with its turns and their estimates."""

    campaign: Campaign
    observations: Observations
    estimates: Estimates


def write_demo_page(
    folder: str | Path,
    data: Mapping[str, str | Path],
    calibration: Calibration,
    *,
    live: LiveFiles | None = None,
    commands: Sequence[tuple[str, str]] = (),
    reports: Sequence[tuple[str, str]] = (),
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write the page with all figures; return its ``index.html``.

    Parameters
    ----------
    folder : path
    data : mapping of name to campaign folder
        ``set1`` and ``set1-unseen``; with ``set2``, ``brake_drive``, ``brake_drive-unseen`` and
        ``set3`` their figures, too.
    calibration : Calibration
        Made without the unseen campaigns.
    live : LiveFiles, optional
        What FMU and bench made of runs of ``set1-unseen``; without them no section "Live".
    commands : sequence of (what, command), optional
        Shown on the page.
    reports : sequence of (title, file), optional
        Links.
    progress : callable, optional
        Called with a label at each step.

    Raises
    ------
    CalibrationError
        If a campaign is missing or is of another tire than the calibration.
    """
    folder, say = Path(folder), progress or (lambda _: None)
    missing = [name for name in NEEDED if name not in data]
    if missing:
        raise CalibrationError(
            f"demo page: no campaign {' and no '.join(missing)}; {' and '.join(NEEDED)} are "
            "needed; name their folders"
        )
    seen: dict[str, Seen] = {}
    for name in (*NEEDED, *OPTIONAL):
        if name in data:
            say(f"reading {name}")
            seen[name] = _read(Path(data[name]), calibration)
    say("fitting the dissertation's regressions")
    low_pass = LowPass(calibration.order, calibration.cut_off)
    trained = train(seen["set1"].observations, low_pass=low_pass)
    camber = train(seen["set2"].observations, low_pass=low_pass) if "set2" in seen else None
    sections = []
    for title, anchor, text, drawings in _parts(seen, trained, camber, calibration):
        say(f"drawing: {title.lower()}")
        sections.append(Part(title, anchor, text, pictures=draw_all(folder, drawings)))
    if live is not None:
        say("drawing: live")
        sections.insert(1, _live(folder, live, seen["set1-unseen"].campaign, low_pass))
    return write_page(
        folder,
        DEMO,
        title="From innerliner strain to load, slip and lateral force",
        lead=_lead(seen, calibration),
        headline=[_accuracy(seen), _comparison(trained)],
        commands=[{"what": what, "command": command} for what, command in commands],
        reports=[{"title": title, "file": file} for title, file in reports],
        sections=sections,
    )


def _read(folder: Path, calibration: Calibration) -> Seen:
    campaign = read_campaign(folder)
    header = campaign.header
    calibration.check_layout(header.tire.name, header.gage_lateral, str(folder))
    low_pass = LowPass(calibration.order, calibration.cut_off)
    observations = observe([campaign], low_pass=low_pass)
    return Seen(campaign, observations, calibration.estimate(observations.features))


def _lead(seen: Mapping[str, Seen], calibration: Calibration) -> str:
    day = seen["set1-unseen"]
    return (
        f"A tire ({calibration.tire}) with {len(calibration.lateral)} strain gages on its "
        f"innerliner was calibrated on a rig. It then estimated {len(day.observations)} turns of a "
        f"day that the calibration had not seen ({day.campaign.header.name}, "
        f"{len(day.campaign.plans)} runs)."
    )


def _live(folder: Path, live: LiveFiles, campaign: Campaign, low_pass: LowPass) -> Part:
    line = read_line(live, campaign)
    drawing = live_drawing(live, campaign, low_pass)
    return Part(
        "Live",
        "live",
        live_text(line),
        tables=[live_table(live, line)],
        pictures=draw_all(folder, [drawing]),
    )


def _accuracy(seen: Mapping[str, Seen]) -> Table:
    """Return the accuracy on the unseen campaigns."""
    rows: list[Accuracy] = []
    names: list[str] = []
    for name, part in seen.items():
        if not name.endswith("-unseen"):
            continue
        for quantity in QUANTITIES:
            row = accuracy(compare(part.observations, part.estimates, quantity))
            if row.turns:
                rows.append(row)
                names.append(name.replace("-", ", "))
    return accuracy_table(rows, "Accuracy on days that the calibration had not seen", names)


REPORTED = (
    ("Fz from the centre contact length", "Fig. 4-4", "Fz", "99.5 %"),
    ("slip angle from the in/out ratio", "Fig. 4-5", "alpha", DASH),
    ("slip angle from the slope of peak rates", "Fig. 4-7", "alpha", "99.4 %"),
    ("Fy from six regressors", "Table 4-1", "Fy", "99.3 .. 99.6 %"),
)
"""Regressions with the coefficient of determination that the dissertation prints for its tires."""


def _comparison(trained: Trained) -> Table:
    """Return the dissertation's regressions on our data beside the estimators in use."""
    rows = []
    for name, source, quantity, printed in REPORTED:
        regression, held = find_regression(trained, source), in_use(trained, quantity)
        if regression is None:
            continue
        unit = regression.unit
        ours = number(known_rms(held[0] - held[1]), 3) if held else DASH
        rows.append(
            (
                name,
                source,
                unit,
                printed,
                f"{100.0 * regression.r2:.1f} %",
                number(regression.cross_validated, 3),
                ours,
            )
        )
    return Table(
        "The dissertation's regressions on the cornering campaign (set1)",
        (
            "regression",
            "source",
            "unit",
            "R\u00b2 in the dissertation",
            "R\u00b2 here",
            "held-out error here",
            "estimator in use, held out",
        ),
        rows,
        texts=3,
        note="The numbers differ because the tire is another one. Where a regression is much "
        "worse here, its figure shows why: usually the regressor also depends on the load.",
    )


Drawn = tuple[str, str, str, list[Picture]]


def _parts(
    seen: Mapping[str, Seen], trained: Trained, camber: Trained | None, calibration: Calibration
) -> list[Drawn]:
    """Return title, anchor, text and drawings of each section."""
    set1, unseen = seen["set1"], seen["set1-unseen"]
    drawn = {drawing.name: drawing for drawing in regression_drawings(trained)}
    day = "Estimates on the unseen day."
    accuracy_drawings = [
        Picture(
            f"accuracy_{name.replace('-', '_')}",
            f"Estimated against measured, {name.replace('-', ', ')}",
            "Each mark is one turn. Below: residuals with their 95 % intervals.",
            lambda part=part: figures.figure_accuracy(part.observations, part.estimates),  # type: ignore[misc]
        )
        for name, part in seen.items()
        if name.endswith("-unseen")
    ]
    parts: list[Drawn] = [
        ("Accuracy", "accuracy", "", accuracy_drawings),
        ("Strain of a turn", "strain", "", _strain(set1)),
        (
            "Contact",
            "contact",
            "Contact length is contact angle times effective rolling radius.",
            [
                Picture(
                    "figure_4_2",
                    "Contact shapes at the middle load (Fig. 4-2)",
                    "The contact grows on the outer side of the corner and shrinks on the inner "
                    "side.",
                    lambda: figure_4_2(set1.observations, set1.estimates),
                ),
                drawn["figure_4_3"],
            ],
        ),
        ("Vertical load", "load", "", [drawn["figure_4_4"]]),
        (
            "Slip angle",
            "slip-angle",
            "",
            [
                drawn["figure_4_5"],
                drawn["figure_4_7"],
                Picture(
                    "figure_4_8",
                    "Slip angle turn after turn at all loads (Fig. 4-8)",
                    f"{day} Bars are 95 % intervals: wider where the cornering curve is flat.",
                    lambda: figures.figure_4_8(unseen.observations, unseen.estimates),
                ),
            ],
        ),
        ("Lateral force", "lateral-force", "", [drawn["figure_4_12"], *_camber(camber)]),
        (
            "Cornering stiffness and peak force",
            "cornering",
            "",
            [drawn["figure_4_20"], drawn["figure_4_23"]],
        ),
    ]
    if "brake_drive" in seen or "brake_drive-unseen" in seen:
        parts.append(("Slip ratio", "slip-ratio", "", _braking(seen, calibration)))
    if "set3" in seen:
        parts.append(("Low-pass", "low-pass", "", [_cut_off(seen["set3"])]))
    return parts


def _strain(part: Seen) -> list[Picture]:
    plans = part.campaign.plans

    def free_turns() -> TypicalTurns:
        free = sorted((p for p in plans if p.kind == "free"), key=lambda p: p.load)
        by_load = list({round(p.load): p for p in free}.values())
        if not by_load:
            raise CalibrationError("no freely rolling run; the figure needs one at each load")
        return typical_turns(part.campaign, by_load, [f"{p.load:.0f} N" for p in by_load])

    def slipping() -> TypicalTurns:
        plan = _cornering_run(plans)
        text = f"slip angle {np.rad2deg(plan.slip_angle):+.0f} deg (ISO), {plan.load:.0f} N"
        return typical_turns(part.campaign, [plan], [text])

    return [
        Picture(
            "figure_3_7",
            "Strain and strain rate at several loads (Fig. 3-7, 3-8)",
            "Time runs to the right. The innerliner is compressed before the contact (CP1), "
            "stretched in it (TP), compressed after it (CP2). A turn is evaluated up to 20 "
            "degrees after its contact.",
            lambda: figure_3_7(free_turns()),
        ),
        Picture(
            "figure_4_1",
            "All gages under slip, and the slope of their peak rates (Fig. 4-1, 4-6)",
            "CP1 and the peak rates differ across the tire. The slope of the peak rates over the "
            "three middle gages is the dissertation's regressor for the slip angle.",
            lambda: figure_4_1(slipping()),
        ),
    ]


def _cornering_run(plans: Sequence[RunPlan]) -> RunPlan:
    """Return the run nearest to -4 deg and the middle load."""
    corner = [plan for plan in plans if plan.kind == "corner"]
    if not corner:
        raise CalibrationError("no run with a slip angle; the figure needs one")
    middle = float(np.median([plan.load for plan in corner]))
    return min(
        corner,
        key=lambda p: abs(np.rad2deg(p.slip_angle) + 4.0) + 10.0 * abs(p.load / middle - 1.0),
    )


def _camber(camber: Trained | None) -> list[Picture]:
    if camber is None:
        return []
    return [
        Picture(
            "figure_4_14",
            "Lateral force under camber (Fig. 4-14)",
            "Six regressors refitted at each camber (left), one fit for all cambers (middle), and "
            "one estimator in use for all (right, held out).",
            lambda: figures.figure_4_14(camber),
        ),
        Picture(
            "figure_4_16",
            "Slip and camber together (Fig. 4-16)",
            "Contact lengths at the outer gages stop changing after a few degrees (saturation). "
            "CP1 changes a little longer, because it follows the lateral force.",
            lambda: figure_4_16(camber.means),
        ),
    ]


def _braking(seen: Mapping[str, Seen], calibration: Calibration) -> list[Picture]:
    unseen = "brake_drive-unseen" in seen
    part = seen["brake_drive-unseen" if unseen else "brake_drive"]
    plans = part.campaign.plans

    def turns() -> TypicalTurns:
        chosen = [min(plans, key=lambda p: abs(p.slip_ratio - slip)) for slip in (-0.05, 0.0, 0.05)]
        labels = [
            f"{word}, slip ratio {round(100.0 * plan.slip_ratio) or 0} %"
            for word, plan in zip(("Braking", "Free rolling", "Driving"), chosen, strict=True)
        ]
        return typical_turns(part.campaign, chosen, labels)

    return [
        Picture(
            "figure_4_17",
            "Braking, driving and free rolling (Fig. 4-17)",
            "Braking deepens CP2, driving CP1. Below: the balance of every turn; turns inside the "
            "band count as free rolling. The slip axis is linear up to 2 % and logarithmic "
            "beyond.",
            lambda: figure_4_17(turns(), part.observations, calibration.rolling),
        ),
        Picture(
            "figure_4_18",
            "Slip ratio (Fig. 4-18)",
            "From the turn rate in the strain, the rolling radius and the travel speed. "
            + ("Unseen day." if unseen else "The calibration was fitted to this campaign."),
            lambda: figure_4_18(part.observations, part.estimates),
        ),
    ]


def _cut_off(part: Seen) -> Picture:
    return Picture(
        "cut_off",
        "Why the low-pass is set by order of the turn rate",
        "Shift: change of a feature from its value at order 24. Scatter: standard deviation over "
        "the turns of a run. By order (left) the shifts agree at all speeds, so a calibration "
        "carries over. At a fixed 300 Hz (right) fast rolling is smeared and CP1 loses depth; "
        "slow rolling would hardly be filtered, and the cut-off is refused where its order leaves "
        "the allowed range.",
        lambda: figure_cut_off(study_cut_off(part.campaign, nearest_runs(part.campaign))),
    )
