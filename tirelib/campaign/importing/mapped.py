"""The columns of a file that a map names, in SI and ISO; every fault is kept."""

from collections.abc import Sequence

import numpy as np

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.finding import RunFinding
from tirelib.campaign.importing.columns import Column, Table, did_you_mean
from tirelib.campaign.importing.mapheader import GAGE_TIME
from tirelib.campaign.importing.rules import ChannelRule, ImportMap
from tirelib.campaign.model import FloatArray
from tirelib.core.axes import sign
from tirelib.core.errors import UnitError
from tirelib.core.units import dimensions_of_unit, to_si


class MappedTable:
    """The table of a file under a map, with every fault found so far."""

    def __init__(self, table: Table, rules: ImportMap) -> None:
        self.table = table
        self.rules = rules
        self.found: list[RunFinding] = []

    def fault(self, key: str, where: str, given: str, allowed: str, remedy: str) -> None:
        """Note a fault; `where` is a column or empty."""
        place = f"{self.table.file}, {where}" if where else self.table.file
        problem = CampaignFault(place, given, allowed, remedy)
        self.found.append(RunFinding(f"{key} {where}", self.table.file, where, problem))

    def named(self, name: str, purpose: str) -> Column | None:
        """Return a column by its name, or None after noting the existing names."""
        column = self.table.columns.get(name)
        if column is not None:
            return column
        reason = self.table.left_out.get(name)
        if reason is not None:
            self.fault(
                "left out",
                f"column {name!r} ({purpose})",
                f"it cannot be used: {reason}",
                "one number a row is needed",
                "map another column, or export it as numbers",
            )
        else:
            known = [*self.table.columns, *self.table.left_out]
            self.fault(
                "missing",
                f"column {name!r} ({purpose})",
                "the file has no such column",
                did_you_mean(name, known),
                f"correct [channels] in {self.rules.file}, see `tirelib import FILE --list`",
            )
        return None

    def columns(self) -> dict[str, Column]:
        """Return the column of each quantity; note those missing and those of a wrong unit."""
        found: dict[str, Column] = {}
        for quantity, rule in self.rules.channels.items():
            column = self.named(rule.column, quantity) if rule.column else None
            before = len(self.found)
            if column is not None:
                self.check_unit(rule, column)
                found |= {quantity: column} if len(self.found) == before else {}
        if self.rules.run_column:
            self.named(self.rules.run_column, "run_column")
        for name, point in self.rules.set_points.items():
            if point.column:
                self.named(point.column, name)
        return found

    def check_unit(self, rule: ChannelRule, column: Column) -> None:
        """Note a missing unit, or one that file and map state differently."""
        where = f"column {column.name!r} ({rule.quantity})"
        if not rule.unit:
            try:
                to_si(1.0, column.unit, rule.dimension)
            except UnitError as error:
                (fault,) = error.faults
                given = f"the file's {fault.given}" if column.unit else "map and file state no unit"
                self.fault("unit", where, given, fault.allowed, f"state unit in {self.rules.file}")
        elif not rule.converts and not _same_unit(column.unit, rule):
            self.fault(
                "unit",
                where,
                f"the file states {column.unit!r}, the map {rule.unit!r}",
                "both must agree",
                f"correct unit in {self.rules.file}, or say "
                "override_unit = true where the file is wrong",
            )

    def times(
        self, columns: dict[str, Column], quantities: Sequence[str], clock: str
    ) -> FloatArray | None:
        """Return the times of some quantities, [s], or None after noting the reason."""
        varying = [columns[q] for q in quantities if not columns[q].constant]
        own = sorted({column.clock for column in varying if column.clock})
        rule = self.rules.channels.get(clock)
        if rule is None and (clock == "time" or not own):
            rule = self.rules.channels.get("time")
        if rule is None and len(own) == 1:
            rule = ChannelRule("time", own[0], "")
            column = self.named(own[0], "time")
            if column is not None:
                self.check_unit(rule, column)
        if rule is None:
            what = "the strain" if clock == GAGE_TIME else "the rig quantities"
            given = (
                f"{what} have {len(own)} clocks ({', '.join(own)})"
                if own
                else f"no time is mapped for {what}"
            )
            if not self.rules.sound:  # the map says what is wrong
                return None
            self.fault(
                "time",
                "",
                given,
                "one clock is needed",
                f"add time to [channels] in {self.rules.file}, or bring them to one rate",
            )
            return None
        column = self.table.columns.get(rule.column)
        if rule.column and column is None:
            return None
        count = (
            column.values.size
            if column is not None
            else max((item.values.size for item in varying), default=0)
        )
        self.check_lengths(varying, count, rule.column)
        if count < 2:
            self.fault(
                "rows", "", f"{count} row(s) of data", "at least two are needed", "export it again"
            )
        if column is None:
            return np.asarray(np.arange(count) / rule.rate, np.float64)
        return self.si("time", column, column.values, rule)

    def check_lengths(self, columns: Sequence[Column], count: int, clock: str) -> None:
        """Note the columns that are not as long as their clock."""
        against = f"the time column {clock!r}" if clock else "the longest"
        for column in columns:
            if column.values.size != count:
                self.fault(
                    "length",
                    f"column {column.name!r}",
                    f"it has {column.values.size} rows, {against} has {count}",
                    "every sample needs its time",
                    "export both together; gages at a rate of their own need gage_time",
                )

    def si(
        self, quantity: str, column: Column, clock: FloatArray, rule: ChannelRule | None = None
    ) -> FloatArray:
        """Return a column in SI and ISO."""
        rule = rule or self.rules.channels[quantity]
        given = rule.factor * column.rows(clock.size) + rule.offset
        turn = sign(quantity, self.rules.header.axes)
        return turn * to_si(given, rule.unit or column.unit, rule.dimension)

    def check_finite(
        self,
        columns: dict[str, Column],
        values: dict[str, FloatArray],
        spans: Sequence[tuple[int, slice]],
    ) -> None:
        """Note the rows in which a quantity is no number."""
        for quantity, samples in values.items():
            kept = np.zeros(samples.size, dtype=bool)
            for _, span in spans:
                kept[span] = True
            rows = np.flatnonzero(kept & ~np.isfinite(samples))
            if rows.size:
                self.fault(
                    "finite",
                    f"column {columns[quantity].name!r} ({quantity})",
                    f"{rows.size} value(s) are NaN or infinite, in {self.table.places(rows)}",
                    "finite numbers are needed",
                    'drop these rows or fill them with missing = "drop" or '
                    '"interpolate" in the map, or map another column',
                )


def _same_unit(stated: str, rule: ChannelRule) -> bool:
    """Return whether a unit that a file states agrees with the map, or is missing."""
    if stated == "none" or not dimensions_of_unit(stated):
        return True
    if rule.dimension not in dimensions_of_unit(stated):
        return False
    return all(
        to_si(value, stated, rule.dimension) == to_si(value, rule.unit, rule.dimension)
        for value in (0.0, 1.0)
    )
