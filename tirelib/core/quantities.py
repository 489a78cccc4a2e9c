"""Conditions and forces as people say them: title, dimension, engineer's unit, sign.

Inside the library they are SI; documents, sentences, tables and plots say them by this table.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from tirelib.core.units import from_si, to_si


class Quantity(NamedTuple):
    """How a quantity is said.

    Attributes
    ----------
    title : str
    dimension : str
        Name of the dimension in `tirelib.core.units`.
    unit : str
        Engineer's unit; 1 for a ratio.
    signed : bool
        Whether its sign depends on the axis system.
    """

    title: str
    dimension: str
    unit: str
    signed: bool = False

    def told(self, value: Any) -> Any:
        """Return SI values, a number or an array, in the engineer's unit."""
        return from_si(value, self.unit, self.dimension)

    def measured(self, value: Any) -> Any:
        """Return values in the engineer's unit, a number or an array, in SI."""
        return to_si(value, self.unit, self.dimension)

    @property
    def words(self) -> str:
        """The unit in a sentence; empty for a ratio."""
        return "" if self.unit == "1" else self.unit

    @property
    def heading(self) -> str:
        """Title of a column: the quantity, and its unit if it has one."""
        return f"{self.title} [{self.unit}]" if self.words else self.title

    @property
    def label(self) -> str:
        """Title of an axis of a plot: quantity, unit and, where a sign matters, the axis system.

        Examples
        --------
        >>> QUANTITIES["slip_angle"].label, QUANTITIES["load"].label
        ('slip angle [deg] (ISO 8855)', 'load [N]')
        """
        return f"{self.title} [{self.words or '-'}]" + (" (ISO 8855)" if self.signed else "")


QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        "load": Quantity("load", "force", "N"),
        "pressure": Quantity("inflation pressure", "pressure", "bar"),
        "speed": Quantity("speed", "speed", "km/h"),
        "slip_angle": Quantity("slip angle", "angle", "deg", signed=True),
        "camber": Quantity("camber", "angle", "deg", signed=True),
        "slip_ratio": Quantity("slip ratio", "ratio", "1", signed=True),
        "temperature": Quantity("tread temperature", "temperature", "degC"),
        "Fx": Quantity("Fx", "force", "N", signed=True),
        "Fy": Quantity("Fy", "force", "N", signed=True),
        "Mz": Quantity("Mz", "moment", "Nm", signed=True),
    }
)
"""Conditions of a run and the forces that a model explains, by their name in the library."""
