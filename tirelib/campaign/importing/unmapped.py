"""Columns of conditions that a map leaves out, over all files of an import."""

from collections.abc import Iterator

import numpy as np

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.importing.columns import Table
from tirelib.campaign.importing.rules import ImportMap, SetPointRule
from tirelib.campaign.importing.suggest import SET_POINTS, quantity_of


class Unmapped:
    """Ranges of the columns that are known as a condition which the map takes from nowhere."""

    def __init__(self, rules: ImportMap) -> None:
        points = rules.set_points
        self.rules = rules
        self.used = {rule.column for rule in rules.channels.values()}
        self.used |= {rule.column for rule in points.values()}
        self.given = {
            quantity
            for name, (quantity, _) in SET_POINTS.items()
            if quantity in rules.channels
            or points.get(name, SetPointRule()).column
            or any(name in entry.points for entry in rules.runs.values())
        }
        self.planned = {SET_POINTS[name][0] for name in points}
        self.known: dict[str, tuple[str, str, float, float]] = {}

    def look(self, table: Table) -> None:
        """Widen the ranges by those of one file."""
        conditions = {quantity for quantity, _ in SET_POINTS.values()} - self.given
        for column in table.columns.values():
            values = column.values[np.isfinite(column.values)]
            quantity = quantity_of(column.name)
            if quantity not in conditions or column.name in self.used or not values.size:
                continue
            _, _, low, high = self.known.get(column.name, ("", "", np.inf, -np.inf))
            self.known[column.name] = (
                quantity,
                column.unit,
                min(low, float(values.min())),
                max(high, float(values.max())),
            )

    def warnings(self) -> Iterator[CampaignFault]:
        """Yield a warning for each column that varies, or that stands at a value nowhere stated."""
        for name, (quantity, unit, low, high) in self.known.items():
            if low == high and (low == 0.0 or quantity in self.planned):
                continue
            varies = "varies" if low < high else "stands"
            ends = f"{low:g} .. {high:g} {unit}" if low < high else f"at {low:g} {unit}"
            yield CampaignFault(
                f"column {name!r}",
                f"it is known as {quantity}, {varies} ({ends.strip()}) and is not mapped",
                f"what is not mapped is lost, and runs at different {quantity} count as repeats",
                f'map it: {quantity} = {{ column = "{name}", unit = "{unit}" }} in '
                f"{self.rules.file}",
                "warning",
            )
