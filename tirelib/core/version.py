"""The version that every written file, report and FMU names."""

__version__ = "0.1.0"
