"""Sphinx settings."""

project = "tirelib"
author = "The tirelib developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "tirelib"
exclude_patterns = ["_build"]
autodoc_typehints = "none"
