"""The form of a CSV file, found from its first lines: separator, decimal point or comma, names of columns, a row of units."""

from __future__ import annotations

import csv
import re
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import islice

from ksl.base import limits
from ksl.base.csv_cells import text_of_cell
from ksl.base.errors import MotionError
from ksl.motions.columns.recorded import check_names
from ksl.motions.columns.units import bare, unit_of

COMMENTS = ("#", "%", "//")
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "vertical bars", " ": "blanks"}
SNIFFED_ROWS = 20
"""Rows of numbers that are looked at for their separator and their decimal point."""
COMMENTS_KEPT = 1000
"""Comments before the numbers in which names of columns are looked for."""
_SAID = {"sep=", *(f"sep={s}" for s in SEPARATORS)}
_LINE_END = re.compile(rb"\r\n|\n|\r")
_COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?|[-+]?\d+,")
_BRACKETED = re.compile(r"[\[(<][^\])>]*[\])>]")
MEND = "give a CSV file with `time` and a column for each joint"
NAMED = ", named in the first line"
_UNIT_TO_CONVERT = re.compile(r"\b(deg|degs|degrees?|mm|millimet(er|re)s?)\b|°", re.IGNORECASE)


class NoTable(MotionError):
    """A file holds no table that can be read.  `what` is the sentence without what is to be given instead, which depends on what is read."""

    what: str = ""
    more: str = ""


def no_table(what: str, more: str = "") -> NoTable:
    """more: what else a motion's file needs."""
    made = NoTable(f"{what}; {MEND}{more}")
    made.what, made.more = what, more
    return made


@dataclass(frozen=True)
class CsvForm:
    names: list[str]
    """The names of all columns; empty where a column has none."""
    header_line: int
    """Line of the names, from 1."""
    first_line: int
    """Line of the first row of numbers."""
    separator: str
    decimal: str
    units: list[str] = field(default_factory=list)
    """The units of all columns, empty where none is given; or an empty list."""
    rows: list[list[str]] = field(default_factory=list)
    """The first rows, as text."""
    notes: list[str] = field(default_factory=list)

    @property
    def words(self) -> str:
        """How the file is written, where that is not commas and decimal points."""
        said = [SEPARATORS[self.separator]] if self.separator != "," else []
        return ", ".join(said + (["decimal commas"] if self.decimal == "," else []))


@dataclass(frozen=True)
class _Line:
    number: int
    text: str


def form_of(file: str, data: bytes, encoding: str) -> CsvForm:
    """The form of a file with this content.  Raises MotionError if there are no names of columns."""
    comments: deque[_Line] = deque(maxlen=COMMENTS_KEPT)
    lines: list[_Line] = []
    separator = ""
    for line in _lines(file, data, encoding):
        text = line.text.strip()
        if not lines and text.lower() in _SAID:  # written by Excel, and for Excel
            separator = text[4:] or "\t"
        elif text.startswith(COMMENTS):
            comments.append(line)
        elif text or lines:
            lines.append(line)
        if len(lines) > SNIFFED_ROWS + 2:
            break
    if not lines:
        return CsvForm([], 1, 2, ",", ".")
    separator = separator or _separator(lines)
    _check_above_names(file, lines)
    fields = [_split(line.text, separator) for line in lines]
    start = 1
    header, header_line = fields[0], lines[0].number
    notes = []
    numbers = [is_number(x) for x in header if x]
    if any(numbers):  # names may stand in a comment, as numpy, MATLAB and rostopic write them
        found = _header_in_comment(comments, header_line, len(header), separator)
        if found is None and all(numbers):
            raise no_table(f"{file}:{header_line}: no names of columns, but numbers", NAMED)
        if found is not None:
            header, header_line, start = found[0], found[1], 0
            notes.append(f"names of the columns are taken from the comment in line {header_line}")
    check_names(f"{file}:{header_line}", header)  # columns without a name are counted, too
    header = [text_of_cell(name) for name in header]
    if not any(header):
        raise no_table(f"{file}:{header_line}: no names of columns", NAMED)
    units: list[str] = []
    if len(fields) > start and is_row_of_units(fields[start]):
        units = [bare(u) for u in fields[start]]
        start += 1
    elif not any("[" in name or "(" in name for name in header):
        told = ((c.number, match[0]) for c in comments if (match := _UNIT_TO_CONVERT.search(c.text)))
        for number, unit in islice(told, 1):
            notes.append(f"the comment in line {number} speaks of {unit}, and columns have no units: they are taken in rad and m")
    while len(fields) > start and not any(fields[start]):
        start += 1
    first = lines[start].number if len(lines) > start else lines[-1].number + 1
    form = CsvForm(header, header_line, first, separator, ".", units, fields[start:], notes)
    return replace(form, decimal=_decimal(form))


def _lines(file: str, data: bytes, encoding: str) -> Iterator[_Line]:
    """Lines of a file, whichever line ends it has.  Not all of it is split, since few are looked at."""
    position, number = 0, 1
    while position < len(data):
        end = _LINE_END.search(data, position, position + limits.LINE_BYTES)
        if end is None and len(data) - position > limits.LINE_BYTES:
            raise no_table(f"{file}:{number}: a line of more than {limits.LINE_BYTES >> 20} MB")
        stop, following = (end.start(), end.end()) if end else (len(data), len(data))
        yield _Line(number, data[position:stop].decode(encoding, "replace").removeprefix("\ufeff"))
        position, number = following, number + 1


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        line = " ".join(line.split())
    if '"' not in line:
        return line.split() if separator == " " else [field.strip() for field in line.split(separator)]
    try:
        return [n.strip() for n in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])] or [""]
    except csv.Error:  # a quoted field of more than 128 KiB, for example
        return [line.strip()]


def _separator(lines: list[_Line]) -> str:
    """The separator that splits the first line and the next ones into the most fields, as many in each."""

    def score(separator: str) -> tuple[bool, int]:
        counts = [len(_split(line.text, separator)) for line in lines if line.text.strip()]
        return counts[0] > 1 and len(set(counts)) == 1, counts[0]

    scores = {s: score(s) for s in ("\t", ";", ",", "|")}
    best = max(scores, key=lambda s: scores[s])
    if scores[best][1] == 1 and score(" ")[0]:
        return " "
    return best if scores[best][1] > 1 else ","


def _check_above_names(file: str, lines: list[_Line]) -> None:
    """Raises MotionError where a line of more texts, directly above numbers, looks like the names, and not the first one."""
    for separator in SEPARATORS:
        rows = [_split(line.text, separator) for line in lines]
        for line, texts, numbers in zip(lines[1:], rows[1:], rows[2:]):
            if len(texts) == len(numbers) > max(len(rows[0]), 1) and all(map(is_number, numbers)) and not any(map(is_number, texts)):
                raise MotionError(
                    f"{file}:{lines[0].number}: the names of columns seem to be in line {line.number}; remove the lines above it, or begin them with #"
                )


def _header_in_comment(comments: Iterable[_Line], before: int, columns: int, separator: str) -> tuple[list[str], int] | None:
    """Names in the last comment before the numbers that has as many as there are columns."""
    for line in reversed([c for c in comments if c.number < before]):
        text = line.text.strip().lstrip("#%/ ")
        for s in dict.fromkeys((separator, ",", ";", "\t", " ")):
            names = _split(text, s)
            if len(names) == columns and not any(is_number(n) for n in names):
                return names, line.number
    return None


def is_number(text: str) -> bool:
    try:
        float(text.replace(",", ".", 1))
    except ValueError:
        return False
    return True


def is_row_of_units(row: list[str]) -> bool:
    said = [x for x in row if x]
    return bool(said) and not any(is_number(x) for x in said) and all(_BRACKETED.fullmatch(x) or unit_of(x) for x in said)


def _decimal(form: CsvForm) -> str:
    cells = [x for row in form.rows for x in row]
    return "," if any(map(_COMMA_NUMBER.fullmatch, cells)) and not any("." in x and is_number(x) for x in cells) else "."


def is_comma_number(text: str) -> bool:
    return _COMMA_NUMBER.fullmatch(text.strip()) is not None


def doubts_about_end(file: str, data: bytes) -> list[str]:
    """A sentence if the last line has no end, though those before it have one: it may be cut, and 9 may have been 9.98."""
    last = data[max(data.rfind(b"\n"), data.rfind(b"\r")) + 1 :]
    if len(last) == len(data) or not last.strip() or last.lstrip().startswith((b"#", b"%", b"//")):
        return []
    line = (data.count(b"\n") or data.count(b"\r")) + 1
    return [f"the last line ({line}) of {file} has no line end, as those before it have: was the file cut there? Copy it again, or end the line"]
