"""The version that every written file, report and FMU names."""

__version__ = "0.1.0"
WRITER = f"tirelib {__version__}"
"""What files state that have a field for the program which wrote them."""
