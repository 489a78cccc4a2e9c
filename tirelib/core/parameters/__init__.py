"""The numbers of a tire: values with unit, uncertainty, kind and source."""

from tirelib.core.parameters.tire import FIELDS, NUMBERS, Tire, offset_at
from tirelib.core.parameters.tire_file import Number, TireFile, find_tire, read_tire, write_tire

__all__ = [
    "FIELDS",
    "NUMBERS",
    "Number",
    "Tire",
    "TireFile",
    "find_tire",
    "offset_at",
    "read_tire",
    "write_tire",
]
