"""Sphinx settings.

Tutorials are scripts in ``docs/tutorials``: they run when the site is built, and are shown with
their figures. ``-D plot_gallery=0`` builds the site without running them. Tables of the reference
are made from the code by ``docs/tables.py``.
"""

import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
RIG = HERE / "tutorials" / "example_rig.py"
sys.path[:0] = [str(HERE), str(HERE / "tutorials")]

import equations
import plots
import tables

project = "tirelib"
author = "The tirelib developers"
copyright = "The tirelib developers, MIT licence"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "tirelib"
exclude_patterns = ["_build", "_generated", "tutorials"]
autodoc_typehints = "none"
autodoc_preserve_defaults = True
smartquotes = False  # two dashes are an option, not a dash
sphinx_gallery_conf = {
    "examples_dirs": "tutorials",
    "gallery_dirs": "_tutorials",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"example_rig\.py$",
    "within_subsection_order": "tables.in_order",
    "abort_on_example_error": True,
    "show_memory": False,
    "write_computation_times": False,
    "min_reported_time": 1e9,
    "download_all_examples": True,
}


def setup(app):
    """Write the generated tables before anything is read."""
    app.connect("config-inited", without_figures)
    app.connect("sphinx-click-process-epilog", as_printed)
    app.connect("builder-inited", lambda _: write_generated(HERE / "_generated"))
    app.connect("builder-inited", lambda _: complete(HERE / "_tutorials"), priority=900)


def write_generated(folder):
    """Write the tables and the equations, and draw their plots."""
    tables.write_all(folder)
    for name in [*equations.plots(), "plain_tires"]:
        plots.draw(name, folder / "plots")


def complete(folder):
    """Put the laboratory that tutorials import into every archive to be downloaded."""
    for file in folder.glob("*.zip"):
        with zipfile.ZipFile(file, "a") as archive:
            if RIG.name not in archive.namelist():
                archive.write(RIG, RIG.name)


def without_figures(app, config):
    """Let figures of tutorials be absent where these are not run."""
    if config.plot_gallery in ("0", "False", False):
        config.suppress_warnings.append("image.not_readable")


def as_printed(app, command, lines):
    """Show examples and tables below the options as the terminal does."""
    text = (command.command.epilog or "").replace("\b", "").strip("\n").splitlines()
    lines[:] = [".. code-block:: text", "", *(f"   {line}" for line in text), ""] if text else []
