"""Small copies of drawn figures for the page ``docs/theory/gallery.md``."""

from pathlib import Path

from PIL import Image

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "theory" / "gallery"
COLORS = 64
"""A figure of lines loses nothing to see with them, and a third of its size."""


def into_gallery(folder: Path) -> None:
    """Copy the figures of the dissertation (``6-7.png``, ``figure_4_2.png``) from a folder."""
    for png in folder.glob("*.png"):
        name = png.stem.removeprefix("figure_").replace("_", "-")
        if name[0].isdigit():
            small = Image.open(png).convert("RGB").quantize(COLORS)
            small.save(GALLERY / f"{name}.png", optimize=True)
