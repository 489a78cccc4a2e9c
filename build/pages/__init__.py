"""The pages of the demonstrations and of the co-simulations."""

from pathlib import Path

DEMO = Path(__file__).parent / "templates/demo.html"
"""Template of the page of a demonstration."""
