"""Excel workbooks: one table on one sheet, read by the package openpyxl."""

from __future__ import annotations

import datetime
import re
import zipfile
from array import array
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate, chain, count, pairwise
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ksl.base import limits
from ksl.base.errors import MotionError, near_names
from ksl.base.input_files import failed_read
from ksl.base.library_messages import heard
from ksl.base.words import listed
from ksl.mechanism.states import Array
from ksl.motions.columns.recorded import Recorded, check_columns, check_names, check_numbers
from ksl.motions.columns.units import bare, unit_of
from ksl.motions.files.clock_times import through_midnight
from ksl.motions.files.csv_form import is_row_of_units

ONE_TABLE = "give each table a sheet of its own"
_ENDS_IN_UNIT = re.compile(r"[\[(<]([^\[\]()<>]{1,12})[\])>]\s*$")
_NUMBER_AS_TEXT = re.compile(r"\s*[+-]?\d[\d.,]*(e[+-]?\d+)?\s*", re.IGNORECASE)
AS_TEXT = ", and this is text: let the spreadsheet program make numbers of the column, or save the sheet as CSV, where decimal commas are read"
OF_LOOKS = ("Workbook contains no default style", "Conditional Formatting extension", "Data Validation extension", "Unknown extension", "Header or footer")
"""What openpyxl says of parts that hold no numbers of cells: formats, and which values may be typed."""
_ROW_OR_COLUMN = re.compile(rb"<(?:\w+:)?(row|col)\b([^<>]*)>")
_ATTRIBUTE = re.compile(rb"""\b(r|hidden|min|max)=["'](\w+)["']""")
PIECE, LONGEST_TAG = 1 << 20, 1 << 12
"""Bytes of a sheet that are looked at together, and of a tag in it."""
MOST_COLUMNS = 1 << 14
MOST_NOTES = 10
"""Remarks beside a table, and titles above it, that are named."""


class Row(NamedTuple):
    number: int
    """From 1, as the program shows it."""
    cells: tuple[Any, ...]


class WorkbookTable(Recorded):
    """The table of a sheet.  Its numbers are in memory."""

    def __init__(self, file: str, sheet: str, header: Row, columns: dict[str, _Column], units: dict[str, str], first_row: int, notes: list[str]) -> None:
        self.sheet, self.header_row, self.first_row, self.cells = sheet, header.number, first_row, columns
        numbers = {name: np.frombuffer(column.numbers, dtype=float).copy() for name, column in columns.items()}
        texts = {name: column.text for name, column in columns.items() if column.text is not None}
        super().__init__(file, "Excel workbook", list(columns), numbers, units, notes, texts=texts)

    @property
    def has_parts(self) -> bool:
        return True

    @property
    def head(self) -> str:
        return f"{self.file}: sheet {self.sheet!r}, row {self.header_row}"

    def place(self, row: int) -> str:
        return f"{self.file}: sheet {self.sheet!r}, row {self.first_row + row}"

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        for name in names:
            column = self.cells[name]
            if column.text is not None:
                mend = AS_TEXT if _NUMBER_AS_TEXT.fullmatch(column.text) else ""
                raise MotionError(
                    f"{self.file}: sheet {self.sheet!r}, cell {column.letter}{column.text_row}: column {name!r} holds {column.text[:40]!r}; expected a number{mend}"
                )
            if column.is_time and name != time:
                raise MotionError(f"{self.file}: sheet {self.sheet!r}: column {name!r} holds dates or clock times; expected numbers")
        found = super().read(names, time)
        if time is not None and self.cells[time].is_time:
            self.times_are_seconds = True
            found[time], midnight = through_midnight(found[time]) if self.cells[time].is_clock else (found[time], "")
            self.notes.append(
                f"times in column {time!r} are dates or clock times, converted to s since the first{midnight}; Excel keeps them to the millisecond"
            )
            found[time] = found[time] - found[time][:1]
        return found


class _Column:
    """Numbers of a column, NaN where a cell is empty, and the first cell that holds none."""

    def __init__(self, letter: str) -> None:
        self.letter = letter
        self.numbers = array("d")
        self.origin: datetime.datetime | None = None
        """The first date, from which others count: seconds since 1970 would have digits for 0.2 µs alone."""
        self.is_time: bool | None = None
        self.is_clock = False
        self.text: str | None = None
        self.text_row = 0

    def add(self, row: int, given: Any) -> None:
        cell = given
        if isinstance(cell, datetime.datetime):
            self.origin = self.origin or cell
            cell = cell - self.origin
        number, is_time = _number(cell)
        if cell is not None and (number is None or (self.is_time is not None and is_time != self.is_time)) and self.text is None:
            self.text, self.text_row = str(given), row
        elif cell is not None:
            self.is_time, self.is_clock = is_time, isinstance(cell, datetime.time)
        self.numbers.append(float("nan") if number is None else number)


def _number(cell: Any) -> tuple[float | None, bool]:
    """A cell as a number, and whether it is a time, in s; None for text and truth values."""
    if isinstance(cell, datetime.timedelta):
        return cell.total_seconds(), True
    if isinstance(cell, datetime.time):
        return cell.hour * 3600.0 + cell.minute * 60.0 + cell.second + cell.microsecond * 1e-6, True
    if isinstance(cell, (int, float)) and not isinstance(cell, bool):
        try:
            return float(cell), False
        except OverflowError:
            return None, False
    return None, False


def workbook_table(file: str, source: BinaryIO, sheet: str | None) -> WorkbookTable:
    """The table of a workbook, or of the sheet that is named.  Raises MotionError: for several tables, of which none is guessed."""
    try:
        import openpyxl
    except ModuleNotFoundError as e:
        if e.name != "openpyxl":
            raise
        raise MotionError(
            f"{file}: is an Excel workbook, which is read by the package openpyxl; install it: pip install 'ksl[xlsx]'; or save the sheet as CSV"
        ) from None
    with source, heard("openpyxl", harmless=OF_LOOKS) as said:
        _check_size(file, source)
        try:
            book = openpyxl.load_workbook(source, read_only=True, data_only=True, keep_links=False)
            empty, notes = count(1), list[str]()
            chosen = _sheet(file, book, sheet, empty, notes)
            table = _table(file, chosen.title, _rows(file, chosen, empty), notes)
            table.notes += _notes_of_hidden(source, chosen, table)
            _refuse_formulas(file, source, table)
        except (MotionError, MemoryError):
            raise
        except Exception as e:  # openpyxl lets errors of XML, of zip archives and of Python's own types through
            if failed := failed_read(e):
                raise failed from None
            raise MotionError(
                f"{file}: is an Excel workbook, but truncated or damaged ({type(e).__name__}); open and save it again, or save the sheet as CSV"
            ) from None
    table.notes += said
    return table


def _notes_of_hidden(source: BinaryIO, sheet: Any, table: WorkbookTable) -> list[str]:
    """What a filter, or a hand, has hidden of the table: the program doesn't show it, and it is read."""
    with zipfile.ZipFile(source) as archive, archive.open(sheet._worksheet_path.lstrip("/")) as text:
        rows, columns = hidden_parts(iter(lambda: text.read(PIECE), b""))
    rows = [number for number in rows if table.first_row <= number < table.first_row + len(next(iter(table.columns.values()), ()))]
    named = {column.letter: name for name, column in table.cells.items()}
    found = [f"{named[letter]!r} (column {letter})" for letter in columns if letter in named]
    notes = (
        [f"rows of sheet {table.sheet!r} that are hidden, by a filter say, are used like the others: {listed(_ranges(rows))}, {len(rows):,} in all"]
        if rows
        else []
    )
    return notes + ([f"columns of sheet {table.sheet!r} that are hidden are used like the others: {listed(found)}"] if found else [])


def hidden_parts(pieces: Iterable[bytes]) -> tuple[list[int], list[str]]:
    """The numbers of the rows of a sheet's XML that are hidden, and the letters of its columns.  openpyxl doesn't give them where it reads row by row."""
    rows, number, rest = list[int](), 0, b""
    begun = [0] * (MOST_COLUMNS + 1)  # tags that begin at a column, less those that end before it: there may be many, each for all columns
    for piece in pieces:
        text = rest + piece
        for tag in _ROW_OR_COLUMN.finditer(text):
            attributes = dict(_ATTRIBUTE.findall(tag[2]))
            hidden = attributes.get(b"hidden") in (b"1", b"true")
            if tag[1] == b"row":
                number = int(attributes.get(b"r", number + 1))
                rows += [number] * hidden
            elif hidden:
                first, last = (min(int(attributes.get(each, b"1")), MOST_COLUMNS) for each in (b"min", b"max"))
                begun[first - 1] += 1
                begun[last] -= 1
        rest = text[max(text.rfind(b"<"), text.rfind(b">"), len(text) - LONGEST_TAG) :]
    return rows, [letters(k) for k, covered in enumerate(accumulate(begun)) if covered > 0]


def _ranges(numbers: list[int]) -> list[str]:
    """Numbers that increase, as ranges."""
    breaks = [0, *(k for k in range(1, len(numbers)) if numbers[k] != numbers[k - 1] + 1), len(numbers)]
    return [f"{numbers[a]}" if b == a + 1 else f"{numbers[a]} to {numbers[b - 1]}" for a, b in pairwise(breaks)]


def _refuse_formulas(file: str, source: BinaryIO, table: WorkbookTable) -> None:
    """Raises MotionError for a formula whose value the workbook doesn't hold: programs that compute none write such ones."""
    import openpyxl

    missing = {column.letter: np.isnan(column.numbers) for column in table.cells.values()}
    if not any(each.any() for each in missing.values()):
        return
    source.seek(0)
    sheet = openpyxl.load_workbook(source, read_only=True, keep_links=False)[table.sheet]
    sheet.reset_dimensions()
    for row in sheet.iter_rows(min_row=table.first_row):
        for cell in row:
            if cell.data_type == "f" and (column := letters(cell.column - 1)) in missing and missing[column][cell.row - table.first_row]:
                raise MotionError(
                    f"{file}: sheet {table.sheet!r}, cell {column}{cell.row}: holds a formula without its value; open the workbook in a spreadsheet program and save it"
                )


def _check_size(file: str, source: BinaryIO) -> None:
    with zipfile.ZipFile(source) as archive:
        size = sum(each.file_size for each in archive.infolist())
    if size > limits.WORKBOOK_BYTES:
        raise MotionError(
            f"{file}: unpacked it has {limits.megabytes(size)}; at most {limits.megabytes(limits.WORKBOOK_BYTES)} of a workbook are read: save the sheet as CSV"
        )
    source.seek(0)


def _sheet(file: str, book: Any, wanted: str | None, empty: Iterator[int], notes: list[str]) -> Any:
    """The sheet that is named, or the only one that holds numbers, or else anything.  empty: as in `_rows`."""
    sheets = {sheet.title: sheet for sheet in book.worksheets}
    if wanted is not None:
        if wanted not in sheets:
            raise MotionError(f"{file}: --topic (topic=) is {wanted!r}, and no sheet has this name; {near_names(wanted, sheets)}sheets: {listed(sheets)}")
        return sheets[wanted]
    held = {title: _holds(_rows(file, sheet, empty)) for title, sheet in sheets.items()}
    texts, numbers = ([title for title, what in held.items() if what == kind] for kind in ("texts", "numbers"))
    filled = numbers or texts
    if not filled:
        raise MotionError(f"{file}: all sheets are empty; give `time` and a column for each joint, a row for each sample")
    if len(filled) > 1:
        raise MotionError(f"{file}: {len(filled)} sheets hold {held[filled[0]]}: {listed(filled)}; say which by --topic SHEET (topic=)")
    if numbers and texts:
        notes.append(f"left out, since they hold no numbers: sheets {listed(texts)}")
    return sheets[filled[0]]


def _holds(rows: Iterator[Row]) -> str:
    """Whether there are numbers or times ("numbers"), else "texts", or nothing: ""."""
    found = ""
    for row in rows:
        if any(not isinstance(x, str) for x in row.cells if x is not None):
            return "numbers"
        found = "texts" if row.cells else found
    return found


def _rows(file: str, sheet: Any, empty: Iterator[int]) -> Iterator[Row]:
    """Rows that have cells, without the empty ones at their ends.  empty: the numbers of the workbook's rows without cells, from 1 on."""
    sheet.reset_dimensions()  # programs write wrong ones
    seen = 0
    for number, cells in enumerate(sheet.iter_rows(values_only=True), 1):
        if not cells:
            if next(empty) > limits.EMPTY_ROWS:
                raise MotionError(
                    f"{file}: sheet {sheet.title!r}, row {number}: more than {limits.EMPTY_ROWS:,} empty rows in the workbook; save the table as CSV"
                )
            continue
        seen += len(cells)
        if seen > limits.WORKBOOK_CELLS:
            raise MotionError(f"{file}: sheet {sheet.title!r}, row {number}: {seen:,} cells; at most {limits.WORKBOOK_CELLS:,} are read: save the table as CSV")
        end = len(cells)
        while end and (cells[end - 1] is None or cells[end - 1] == ""):
            end -= 1
        yield Row(number, tuple(None if x == "" else x for x in cells[:end]))


def _table(file: str, sheet: str, rows: Iterator[Row], notes: list[str]) -> WorkbookTable:
    where = f"{file}: sheet {sheet!r}"
    header, rows = _header(where, sheet, rows, notes)
    start = next(i for i, x in enumerate(header.cells) if x is not None)
    names = _names(where, header, start)
    columns = {name: _Column(letters(start + i)) for i, name in enumerate(names)}
    units: dict[str, str] = {}
    first = end = 0
    for row in rows:
        if not row.cells:
            continue
        texts = [str(x or "").strip() for x in row.cells[start : start + len(names)]]
        if not first and not units and all(isinstance(x, str) for x in row.cells if x is not None) and is_row_of_units(texts):
            units = {name: bare(unit) for name, unit in zip(names, texts) if unit}
            continue
        if first and row.number != end + 1:
            raise MotionError(
                f"{where}, row {row.number}: the table ends in row {end}, and more follows: a second table? {ONE_TABLE}, and no rows between samples empty"
            )
        first, end = first or row.number, row.number
        _add(where, row, start, columns, notes)
        check_numbers(file, len(columns) * (end - first + 1))
    return WorkbookTable(file, sheet, header, columns, units, first, notes)


def _header(where: str, sheet: str, rows: Iterator[Row], notes: list[str]) -> tuple[Row, Iterator[Row]]:
    """The row with the names of columns, and the rows below it.

    Above it may be titles, and rows that begin with a text: names with their values, as programs write them before a measurement.  Two texts are such
    a pair where a row that begins with a text follows, unless that is of units or a number kept as text.
    """
    above: list[str] = []
    pair: Row | None = None
    for row in rows:
        filled = [x for x in row.cells if x is not None]
        if not filled:
            continue
        if pair and (not isinstance(filled[0], str) or _reads_as_number(filled[0]) or is_row_of_units([str(x) for x in filled])):
            rows = chain([row], rows)
            break
        if not isinstance(filled[0], str):
            raise MotionError(f"{where}, row {row.number}: no names of columns above this row; name them: time, and each joint")
        if pair:
            _refuse_unit(where, pair)
            above.append(_shown(pair))
        are_texts = all(isinstance(x, str) for x in filled)
        pair = row if are_texts and len(filled) > 1 else None
        if pair and len(filled) > 2:
            break
        if not pair:
            _refuse_unit(where, row)
            above.append(_shown(row))
    if pair is None:
        raise MotionError(f"{where}: no names of columns; give `time` and a column for each joint, a row for each sample")
    if above:
        notes.append(f"left out of sheet {sheet!r}: {listed(above[:MOST_NOTES])}, above the names of columns")
    return pair, rows


def _refuse_unit(where: str, row: Row) -> None:
    """Raises MotionError for a title of several columns with a unit to convert, since it can't be told which columns these are."""
    for i, x in enumerate(row.cells):
        found = _ENDS_IN_UNIT.search(x) if isinstance(x, str) else None
        unit = unit_of(found[1]) if found else None
        if unit and unit.quantity in ("angle", "length") and unit.factor != 1:
            raise MotionError(
                f"{where}, cell {letters(i)}{row.number}: {x[:40]!r} stands above the names of columns and gives a unit; write it into each name, or into a row below them"
            )


def _shown(row: Row) -> str:
    return repr(" ".join(str(x) for x in row.cells if x is not None)[:40])


def _reads_as_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
        return True
    except ValueError:
        return False


def _names(where: str, header: Row, start: int) -> list[str]:
    """Names of the columns, which have none without a name between them."""
    names = [None if x is None else str(x).strip() for x in header.cells[start:]]
    check_columns(f"{where}, row {header.number}", len(names))
    if None in names:
        gap = letters(start + names.index(None))
        raise MotionError(
            f"{where}, row {header.number}: column {gap} has no name, and columns with names stand on both sides of it: two tables? {ONE_TABLE}, or name the column"
        )
    found = [name or "" for name in names]
    check_names(f"{where}, row {header.number}", found)
    seen: set[str] = set()
    for name in found:
        if name in seen:
            raise MotionError(f"{where}, row {header.number}: two columns are named {name!r}; rename or remove one")
        seen.add(name)
    return found


def _add(where: str, row: Row, start: int, columns: dict[str, _Column], notes: list[str]) -> None:
    """The cells of a row to the columns.  A text beside the table is a remark; a number there is of another table."""
    for i, x in enumerate(row.cells):
        if x is not None and not start <= i < start + len(columns):
            if not isinstance(x, str):
                raise MotionError(
                    f"{where}, cell {letters(i)}{row.number}: holds {str(x)[:40]!r} beside the table, where no name is above: two tables? {ONE_TABLE}, or name the column"
                )
            if len(notes) < MOST_NOTES:
                notes.append(f"left out: {x[:40]!r} in cell {letters(i)}{row.number}, beside the table")
    for i, column in enumerate(columns.values()):
        column.add(row.number, row.cells[start + i] if start + i < len(row.cells) else None)


def letters(i: int) -> str:
    """The name of a column by its number from 0: A, B, …, Z, AA."""
    name = ""
    i += 1
    while i:
        i, rest = divmod(i - 1, 26)
        name = chr(65 + rest) + name
    return name
