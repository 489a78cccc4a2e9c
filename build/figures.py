"""Draw the dissertation's figures of the ring model (chapters 5 and 6) from the tires in `models`.

    .venv/bin/python build/figures.py
    .venv/bin/python build/figures.py --only 6-33   one of them
    .venv/bin/python build/figures.py --gallery     and the pictures of docs/theory/gallery.md

Everything lands in ``build/out/figures``; open its ``index.html``.
"""

import argparse
from functools import cache
from pathlib import Path

from pages.gallery import into_gallery
from rich.console import Console
from ring_figures import cases, contact, lateral, speed, static
from ring_figures import loads as over_load

from tirelib.core.parameters import Tire, read_tire
from tirelib.core.threads import one_thread
from tirelib.report.page import Part, Picture, draw_all, write_page
from tirelib.report.simulation import Simulation

ROOT = Path(__file__).resolve().parent.parent
ROLLING, TEST, LITERATURE_A, LITERATURE_B = "table-6-1", "table-6-2-195-65r15", "gong", "jenkins"


@cache
def tire(name: str) -> Tire:
    """Return a tire that comes with the library."""
    return read_tire(name).tire


@cache
def deflections(contact: str) -> Simulation:
    """Return the tire of Table 6-1 at three deflections."""
    return cases.by_deflection(tire(ROLLING), contact)


@cache
def loads(contact: str, damping: float, speed: float) -> Simulation:
    """Return the test tire at three loads."""
    return cases.by_load(tire(TEST), contact, damping, speed)


@cache
def inflations(damping: float, speed: float) -> Simulation:
    """Return the test tire at four inflation pressures."""
    return cases.by_inflation(tire(TEST), damping, speed)


@cache
def speeds() -> tuple[Simulation, ...]:
    """Return the test tire at every damping and speed."""
    return tuple(cases.by_speed(tire(TEST), damping) for damping in cases.DAMPINGS)


@cache
def standing(stiffness: float | None = None) -> cases.StaticRing:
    """Return the standing ring with the constants of Table 6-1, or another bending stiffness."""
    own = tire(ROLLING)
    return cases.standing(own.changed(bending_stiffness=stiffness) if stiffness else own)


def chapter_5() -> list[Picture]:
    """Return the figures of the standing ring."""
    lumped = cases.LUMPED_STIFFNESS
    stiff = (
        f"Standing ring of Table 6-1 with a bending stiffness of {lumped:g} N m^2 (assumed: it "
        "stands in for the belt's tension, which this ring lacks; the chapter's own constants are "
        "not printed)."
    )
    soft = "Standing ring of Table 6-1 as it is, without tension: the shape changes the other way."
    return [
        Picture(
            "5-10",
            "Figure 5-10",
            f"Radial deformation from the ring's own strain. {stiff}",
            lambda: static.figure_5_10(standing(lumped)),
        ),
        Picture(
            "5-22",
            "Figure 5-22 (a)",
            f"Static contact pressure by load. {stiff}",
            lambda: static.figure_5_22(standing(lumped)),
        ),
        Picture(
            "5-22-soft",
            "Figure 5-22 (a), soft belt",
            f"Static contact pressure. {soft}",
            lambda: static.figure_5_22(standing()),
        ),
        Picture(
            "5-24",
            "Figure 5-24 (b)",
            f"Static strain by load. {stiff}",
            lambda: static.figure_5_24(standing(lumped)),
        ),
        Picture(
            "5-24-soft",
            "Figure 5-24 (b), soft belt",
            f"Static strain by load. {soft}",
            lambda: static.figure_5_24(standing()),
        ),
    ]


def section_6_4() -> list[Picture]:
    """Return the figures that compare the two contacts."""
    both = ("shear", "radial")
    return [
        Picture(
            "6-7",
            "Figure 6-7",
            "Contact pressure by deflection (Gong's tire) and by "
            "inflation at one deflection (Jenkins' tire), Table 6-3.",
            lambda: contact.figure_6_7(
                cases.by_deflection(tire(LITERATURE_A)),
                cases.by_inflation_at_equal_deflection(tire(LITERATURE_B)),
            ),
        ),
        Picture(
            "6-9",
            "Figure 6-9",
            "Normal and horizontal traction of both contacts; Table 6-1 at 59 rad/s.",
            lambda: contact.figure_6_9(*map(deflections, both)),
        ),
        Picture(
            "6-10",
            "Figure 6-10",
            "Strain with both contacts; Table 6-1 at 59 rad/s.",
            lambda: contact.figure_6_10(*map(deflections, both)),
        ),
        Picture(
            "6-12",
            "Figure 6-12",
            "Peaks of the strain rate and edges of the contact; Table 6-1 at 59 rad/s.",
            lambda: contact.figure_6_12(*map(deflections, both)),
        ),
    ]


def section_6_5() -> list[Picture]:
    """Return the figures of the test tire without damping."""
    return [
        Picture(
            "6-22",
            "Figure 6-22",
            "Traction by load, no damping; Table 6-2.",
            lambda: over_load.figure_6_22(loads("radial", 0.0, 0.0)),
        ),
        Picture(
            "6-23",
            "Figure 6-23",
            "Traction by inflation, no damping; Table 6-2.",
            lambda: over_load.figure_6_23(inflations(0.0, 0.0)),
        ),
        Picture(
            "6-24",
            "Figure 6-24",
            "Traction by load with tread shear, no damping; Table 6-2.",
            lambda: over_load.figure_6_24(loads("shear", 0.0, 0.0)),
        ),
        Picture(
            "6-26",
            "Figure 6-26",
            "Strain and strain rate by load; Table 6-2. Fig. 6-25 is the measured counterpart.",
            lambda: over_load.figure_6_26(loads("radial", 0.0, 0.0)),
        ),
        Picture(
            "6-28",
            "Figure 6-28",
            "Strain and strain rate by inflation; Table 6-2. Fig. 6-27 "
            "is the measured counterpart.",
            lambda: over_load.figure_6_28(inflations(0.0, 0.0)),
        ),
    ]


def damping() -> list[Picture]:
    """Return the figures of the damped, rolling tire."""
    rolling = (cases.DYNAMIC_DAMPING, cases.DYNAMIC_SPEED)
    return [
        Picture(
            "6-29",
            "Figure 6-29",
            "Damping and speed; Table 6-2.",
            lambda: speed.figure_6_29(speeds()),
        ),
        Picture(
            "6-33",
            "Figure 6-33",
            "What moves with speed, and what Eq. (113) makes of it; Table 6-2.",
            lambda: speed.figure_6_33(speeds()),
        ),
        Picture(
            "6-34",
            "Figure 6-34",
            "Traction by load, damped; Table 6-2.",
            lambda: over_load.figure_6_34(loads("radial", *rolling)),
        ),
        Picture(
            "6-35",
            "Figure 6-35",
            "Traction by inflation at one load, damped; Table 6-2.",
            lambda: over_load.figure_6_35(inflations(*rolling)),
        ),
        Picture(
            "6-36",
            "Figure 6-36",
            "Traction by load with tread shear, damped; Table 6-2.",
            lambda: over_load.figure_6_36(loads("shear", *rolling)),
        ),
        Picture(
            "6-40",
            "Figure 6-40, 6-41",
            "Lateral traction and force at slip angles: pressure "
            "of the ring against a parabola; Table 6-2, damped.",
            lambda: lateral.figure_6_40(loads("radial", *rolling)),
        ),
    ]


CHAPTERS = {
    "The standing ring": chapter_5,
    "Two contacts": section_6_4,
    "Loads and inflation": section_6_5,
    "Damping, speed, lateral traction": damping,
}


def main() -> None:
    """Draw everything and write the page."""
    parser = argparse.ArgumentParser(description="Figures of chapters 5 and 6 from the ring model.")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/figures", metavar="DIR")
    parser.add_argument("--only", metavar="NAME", help="draw one figure, for instance 6-33")
    parser.add_argument("--gallery", action="store_true", help="renew docs/theory/gallery")
    given = parser.parse_args()
    folder = given.out.resolve()
    console, sections, missing = Console(), [], []
    for number, (title, drawings) in enumerate(CHAPTERS.items(), 1):
        wanted = [each for each in drawings() if given.only in (None, each.name)]
        with console.status(f"drawing: {title}"):
            pictures = draw_all(folder, wanted)
        missing += [picture for picture in pictures if not picture.file]
        if wanted:
            sections.append(Part(title, f"part-{number}", pictures=pictures))
    if not sections:
        parser.error(f"there is no figure {given.only}")
    page = write_page(
        folder,
        "base.html",
        title="The ring model: figures of chapters 5 and 6",
        sections=sections,
    )
    if given.gallery:
        into_gallery(folder / "figures")
    for picture in missing:
        console.print(f"not drawn: {picture.title}: {picture.reason}", highlight=False)
    console.print(f"open {page}", highlight=False, soft_wrap=True)


if __name__ == "__main__":
    with one_thread():
        main()
