"""What every reader of files gives: named columns, which are read when it is known which ones are wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.mechanism.states import Array


@dataclass
class Recorded:
    """A table of a file whose numbers are in memory already.  Other files have classes of their own, which read on demand.

    Tables are read in two steps, names and then the numbers of those columns that are wanted.  So a fault in a column's
    name is found before its contents are judged, and columns that nobody wants cost nothing.
    """

    file: str
    """The file as messages name it."""
    format: str
    """For people: `CSV`, `ROS 1 bag`."""
    names: Sequence[str]
    columns: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    """What the file says of the units of its columns."""
    notes: list[str] = field(default_factory=list)
    """What was converted, chosen or dropped in reading, a line each."""
    doubts: list[str] = field(default_factory=list)
    """Why its numbers may be wrong; each forbids a green verdict."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """Columns that hold text, with a value."""
    groups: dict[str, list[str]] = field(default_factory=dict)
    """Names of matrices and lists in the file, each with the names of its columns: `state` with `state[0]`, `state[1]`."""
    aliases: Mapping[str, str] = field(default_factory=dict)
    """Names as they stand in the file, of columns that have another name here."""
    times_are_seconds: bool = False
    """Set by `read`: times were dates, clock times or numbers with a unit, which it has converted."""
    is_recording: bool = False
    """True for bags: their names are those of joints, and nobody can edit them."""

    def __post_init__(self) -> None:
        """Every reader comes here with the names that it has found.  Raises MotionError."""
        check_names(self.head, self.names)

    @property
    def has_parts(self) -> bool:
        """Whether it is one of several that the file may hold: a topic, a sheet."""
        return self.is_recording

    @property
    def head(self) -> str:
        """Where the names of columns are."""
        return self.file

    def place(self, row: int) -> str:
        """Where a row is, counted from 0."""
        return f"{self.file}: sample {row + 1}"

    def text_in(self, name: str) -> str | None:
        """A value of the column that is no number, as far as that is known from its first rows; None where there is none."""
        return self.texts.get(name)

    def holding(self, name: str) -> str:
        """What a column holds that can't be used, behind "which"; empty where it holds numbers."""
        text = self.text_in(name)
        return "" if text is None else f"holds {self.what_is_in(name)} ({text[:40]!r})"

    def what_is_in(self, name: str) -> str:
        """A word for what a column holds that holds no numbers."""
        return "text"

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        """The numbers of these columns, each (n); NaN where one is missing.  Raises MotionError.

        time: the one of them that holds times, which may be written as clock times or dates.
        """
        for name in names:
            if name in self.texts:
                what = self.what_is_in(name)
                raise MotionError(f"{self.file}: column {name!r} holds {what}: {self.texts[name][:40]!r}; expected {'real ' * what.endswith('numbers')}numbers")
        return {name: self.columns[name] for name in names}


def check_columns(where: str, columns: int) -> None:
    """Raises MotionError for more columns than are read.  where: the file, and the line where that is known."""
    if columns > limits.COLUMNS:
        raise MotionError(f"{where}: {columns:,} columns; at most {limits.COLUMNS:,} are read")


def check_names(where: str, names: Sequence[str]) -> None:
    """Raises MotionError for more columns, or longer names, than are read.  O(columns)."""
    check_columns(where, len(names))
    longest = max(names, key=len, default="")
    if len(longest) > limits.NAME_LENGTH:
        said = f"the name {longest[:20]!r}… of a column is {len(longest):,} characters long; at most {limits.NAME_LENGTH:,} are read"
        raise MotionError(f"{where}: {said}")


def check_numbers(file: str, numbers: int, about: str = "") -> None:
    """Raises MotionError for more numbers than are read; readers call it before they read them.  about: a word before the number."""
    if numbers > limits.MOTION_NUMBERS:
        raise MotionError(f"{file}: {about}{numbers:,} numbers; at most {limits.MOTION_NUMBERS:,} are read: thin it out, or give a part of it")


def check_finite(table: Recorded, columns: Mapping[str, Array], rows: NDArray[np.intp] | None = None, missing: bool = False) -> None:
    """Refuses the first number that is infinite, or missing unless `missing` is true.  rows: which rows of the file the columns hold."""
    for name, x in columns.items():
        bad = np.flatnonzero(np.isinf(x) if missing else ~np.isfinite(x))
        if len(bad):
            what = "is not a number or missing" if np.isnan(x[bad[0]]) else "is infinite"
            raise MotionError(
                f"{table.place(int(bad[0] if rows is None else rows[bad[0]]))}: column {name!r} {what}; every sample needs a finite number in every column"
            )
