"""Log messages of an FMU to its importer, so that a repeated fault does not flood the log."""

MOST_CAUSES = 50
"""Largest number of different causes in the log; the host's log and memory must not grow with a
run."""


class Journal:
    """Counts causes and decides which are worth a line.

    A cause is logged when it is new, and again at its 10th, 100th, 1000th .. occurrence, with the
    count. After `MOST_CAUSES` different ones, one line says that no further ones will come.

    Examples
    --------
    >>> journal = Journal()
    >>> [journal.line("gage lost") for _ in range(10)].count(None)
    8
    >>> journal.line("another")
    'another'
    """

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._full = False

    def line(self, cause: str) -> str | None:
        """Count a cause; return the line to log, or None."""
        if cause not in self._counts:
            if len(self._counts) >= MOST_CAUSES:
                return self._last_line()
            self._counts[cause] = 1
            return cause
        self._counts[cause] += 1
        count = self._counts[cause]
        return f"{cause} ({count} times by now)" if _is_power_of_ten(count) else None

    def _last_line(self) -> str | None:
        if self._full:
            return None
        self._full = True
        return (
            f"{MOST_CAUSES} different causes were reported; further causes are not reported until "
            "a reset"
        )


def _is_power_of_ten(count: int) -> bool:
    return str(count).strip("0") == "1"
