"""A tire as a sensor: innerliner strain to load, slip angle, slip ratio and lateral force."""

__version__ = "0.1.0"
