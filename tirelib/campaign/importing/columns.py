"""A file as named columns of numbers, whatever its format, and the message about a wrong name."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

import numpy as np
import numpy.typing as npt

from tirelib.core.errors import FormatError

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.intp]

TEXT_TABLE = "text table"
"""Format of a file whose rows are lines."""
_SHOWN_ROWS = 5
_SHOWN_NAMES = 12


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One column as the file has it: no unit converted, no sign changed.

    Attributes
    ----------
    name : str
    values : array, shape (n_rows,)
        A single value, shape (1,), for a constant.
    unit : str
        As the file states it; empty when it states none.
    clock : str
        Name of the column with the times of these samples, when the file itself says so.
    constant : bool
        One number for the whole file.
    """

    name: str
    values: FloatArray
    unit: str = ""
    clock: str = ""
    constant: bool = False

    def rows(self, count: int) -> FloatArray:
        """Return the samples; a constant is repeated `count` times."""
        return np.repeat(self.values, count) if self.constant else self.values


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """The columns of one file.

    Attributes
    ----------
    file : str
        Path as it was given, for messages.
    form : str
        Format in words.
    columns : mapping of name to Column
        In the order of the file.
    left_out : mapping of name to str
        Columns that are no numbers, and why.
    notes : tuple of str
        What was found out about the file and should be said.
    numbers : array of int, shape (n_rows,), or None
        What a reader counts for each row, from 1: the line of a text table, else the row. None
        where the rows are the file's own.
    """

    file: str
    form: str
    columns: Mapping[str, Column]
    left_out: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    numbers: IntArray | None = None

    def kept(self, rows: BoolArray, columns: Mapping[str, Column]) -> "Table":
        """Return the table with other columns, from which all but `rows` were left out."""
        numbers = np.arange(1, rows.size + 1) if self.numbers is None else self.numbers
        one = numbers.size == rows.size and _on_one_clock(self.columns)
        return replace(self, columns=columns, numbers=numbers[rows] if one else self.numbers)

    def places(self, rows: npt.NDArray[np.intp]) -> str:
        """Return where rows, from 0, stand in the file: the first few, and how many more."""
        numbers = rows + 1 if self.numbers is None else self.numbers[rows]
        return number_list("line" if self.form == TEXT_TABLE else "row", numbers)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the near matches of a name as a half sentence, else all names that are known.

    Examples
    --------
    >>> did_you_mean("fz", ["ET", "SA", "FZ"])
    "did you mean 'FZ'?"
    >>> did_you_mean("abc", ["ET", "SA"])
    'there are ET, SA'
    """
    names = list(dict.fromkeys(known))
    folded: dict[str, list[str]] = {}
    for item in names:
        folded.setdefault(item.casefold(), []).append(item)
    near = get_close_matches(name.casefold(), list(folded), n=3, cutoff=0.6)
    close = [item for key in near for item in folded[key]]
    if close:
        return f"did you mean {', '.join(map(repr, close))}?"
    if not names:
        return "there are none"
    more = f" and {len(names) - _SHOWN_NAMES} more" if len(names) > _SHOWN_NAMES else ""
    return f"there are {', '.join(names[:_SHOWN_NAMES])}{more}"


def number_list(word: str, numbers: IntArray) -> str:
    """Return the first of some numbers behind a word, and how many more there are.

    Examples
    --------
    >>> number_list("row", np.array([1])), number_list("line", np.arange(11, 18))
    ('row 1', 'lines 11, 12, 13, 14, 15 and 2 more')
    """
    shown = ", ".join(str(int(number)) for number in numbers[:_SHOWN_ROWS])
    more = f" and {numbers.size - _SHOWN_ROWS} more" if numbers.size > _SHOWN_ROWS else ""
    return f"{word}{'s' if numbers.size > 1 else ''} {shown}{more}"


def _on_one_clock(columns: Mapping[str, Column]) -> bool:
    return len({(c.clock, c.values.size) for c in columns.values() if not c.constant}) == 1


def refusal(file: str, given: str, allowed: str, remedy: str) -> FormatError:
    """Return the error for a file that cannot be read, in the four parts of every error."""
    return FormatError(f"{file}: {given}; {allowed}; {remedy}")
