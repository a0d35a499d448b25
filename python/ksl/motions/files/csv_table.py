"""CSV files, as programs and spreadsheets write them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.words import count
from ksl.mechanism.states import Array
from ksl.motions.columns.recorded import Recorded, check_numbers
from ksl.motions.files.arrow_memory import own_memory
from ksl.motions.files.csv_form import SEPARATORS, CsvForm, doubts_about_end, form_of, is_comma_number, is_number, no_table

if TYPE_CHECKING:
    import pyarrow as pa

SMALL = 1 << 20
"""Bytes of a file that one thread parses: less than a block, of which each is a thread's."""
NOT_GIVEN = ["", "NaN", "nan", "NAN", "NA", "N/A", "n/a", "#N/A", "<NA>", "null", "NULL", "None", "none"]
_TEXT_SIGNS = frozenset(b"\t\n\r\f\x0b\x1b") | frozenset(range(32, 256))


class CsvTable(Recorded):
    """A CSV file.  Its numbers are parsed by pyarrow, once, and only those of the columns that are wanted."""

    def __init__(self, file: str, data: bytes, how: str = "") -> None:
        """data: the file's content; how: what was done to get it (`gzip`), for the format's name."""
        self._data, encoding, notes = _as_utf8(file, data)
        self.form: CsvForm = form_of(file, self._data, encoding)
        self._how = how
        if not self.form.names:
            raise MotionError(f"{file}: holds no samples; give `time` and a column for each joint, a line for each sample")
        self.form.names[:] = ["" if re.fullmatch(r"Unnamed: \d+", n) else n for n in self.form.names]  # pandas calls columns without a name so
        repeated = [n for n, k in Counter(self.form.names).items() if n and k > 1]
        if repeated:
            raise MotionError(f"{file}:{self.form.header_line}: two columns are named {repeated[0]!r}; rename or remove one")
        words = ", ".join(x for x in (self.form.words, how) if x)
        names = [n for n in self.form.names if n]
        units = {n: u for n, u in zip(self.form.names, self.form.units) if u}
        super().__init__(file, f"CSV ({words})" if words else "CSV", names, {}, units, notes + self.form.notes)
        self.doubts = doubts_about_end(file, self._data)
        self._index = {n: i for i, n in enumerate(self.form.names) if n}
        self._lines: Array | None = None  # of each row, where comments lie between the rows

    @property
    def head(self) -> str:
        return f"{self.file}:{self.form.header_line}"

    def place(self, row: int) -> str:
        return f"{self.file}:{self._line(row)}"

    def _line(self, row: int) -> int:
        return self.form.first_line + row if self._lines is None else int(self._lines[row])

    def text_in(self, name: str) -> str | None:
        i = self._index[name]
        for row in self.form.rows:
            if i < len(row) and row[i] not in NOT_GIVEN and not is_number(row[i]):
                return row[i]
        return None

    def _begins_with_text(self, name: str) -> bool:
        """Whether the column's first value is text, as dates are; a text further down is a fault among numbers."""
        i = self._index[name]
        first = next((row[i] for row in self.form.rows if i < len(row) and row[i]), "0")
        return not is_number(first)

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        import pyarrow as pa

        text_time = time if time is not None and self._begins_with_text(time) else None
        table = self._parsed({n: pa.string() if n == text_time else pa.float64() for n in names})
        found = {n: table.column(_numbered(self._index[n])) for n in names}
        columns = {n: x.is_valid().to_numpy().astype(float) if n == text_time else _numbers(x) for n, x in found.items()}
        rows = len(table)
        while rows and all(np.isnan(x[rows - 1]) or (n == text_time and not x[rows - 1]) for n, x in columns.items()):
            rows -= 1  # blank lines at the end
        columns = {n: x[:rows] for n, x in columns.items()}
        if text_time is not None:
            from ksl.motions.files.clock_times import seconds_of_text

            columns[text_time], note = seconds_of_text(found[text_time].slice(0, rows), text_time, self.place)
            self.notes.append(note)
            self.times_are_seconds = True
        return columns

    def read_texts(self, names: Sequence[str]) -> list[list[str]]:
        """Columns of text, empty where there is none."""
        import pyarrow as pa

        table = self._parsed(dict.fromkeys(names, pa.string()))
        return [[x or "" for x in table.column(_numbered(self._index[n])).to_pylist()] for n in names]

    def read_integers(self, names: Sequence[str]) -> list[list[int]]:
        """Columns of whole numbers with all their digits, 0 where there is none."""
        import pyarrow as pa

        table = self._parsed(dict.fromkeys(names, pa.int64()))
        return [[x or 0 for x in table.column(_numbered(self._index[n])).to_pylist()] for n in names]

    def _parsed(self, types: dict[str, pa.DataType]) -> pa.Table:
        """The columns of these names, and those without a name, which must be empty.  Raises MotionError."""
        import pyarrow as pa

        self._check_numbers(len(types))
        unnamed = [i for i, n in enumerate(self.form.names) if not n]
        converted = {_numbered(self._index[n]): t for n, t in types.items()} | {_numbered(i): pa.binary() for i in unnamed}
        try:
            table = self._parsed_with(self.form.decimal, converted)
        except pa.ArrowInvalid as e:
            other = self._other_decimal(str(e))
            try:
                table = self._parsed_with(other, converted)
                self.format = "CSV (" + ", ".join(x for x in (self.form.words, "decimal commas", self._how) if x) + ")"
            except pa.ArrowInvalid as again:
                raise MotionError(self._what_arrow_says(str(again if other == self.form.decimal else e))) from None
        for i in unnamed:
            self._check_unnamed(i, table.column(_numbered(i)))
        return table

    def _check_numbers(self, columns: int) -> None:
        """Raises MotionError for more numbers than are read."""
        ends = self._data.count(b"\n") or self._data.count(b"\r")
        check_numbers(self.file, columns * (ends - self.form.first_line + 1), "about ")

    def _parsed_with(self, decimal: str, types: dict[str, pa.DataType]) -> pa.Table:
        import pyarrow as pa
        from pyarrow import csv

        data, separator = self._rows()

        def read(threads: bool) -> pa.Table:
            return csv.read_csv(
                own_memory(data),
                read_options=csv.ReadOptions(
                    column_names=[_numbered(i) for i in range(len(self.form.names))],
                    skip_rows=self._skipped,
                    use_threads=threads,
                    block_size=max(1 << 20, 128 * len(self.form.names)),  # a row must fit a block, and numbers have some twenty signs
                ),
                parse_options=csv.ParseOptions(delimiter=separator, ignore_empty_lines=False),
                convert_options=csv.ConvertOptions(
                    column_types=types, include_columns=list(types), null_values=NOT_GIVEN, strings_can_be_null=True, decimal_point=decimal
                ),
            )

        if len(data) < SMALL:
            return read(threads=False)
        try:
            return read(threads=True)
        except pa.ArrowInvalid:
            return read(threads=False)  # fails again, and then reports the row

    _skipped = 0

    def _rows(self) -> tuple[bytes, str]:
        """The content as pyarrow can parse it: without comments and blank lines between the rows, and with one character between values."""
        self._skipped = self.form.first_line - 1
        marks = any(mark in self._data for mark in (b"#", b"%", b"//"))  # much faster than the expression, and mostly false
        comments = marks and re.search(rb"[\r\n][ \t]*(#|%|//)", self._data) is not None
        blanks = self.form.separator == " "
        if not comments and not blanks and not _has_blank_lines(self._data):
            return self._data, self.form.separator
        lines = self._data.splitlines()[self.form.first_line - 1 :]
        kept = [(k, line) for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith((b"#", b"%", b"//"))]
        self._lines = np.array([k + self.form.first_line for k, _ in kept])
        self._skipped = 0
        rows = [b",".join(line.split()) for _, line in kept] if blanks else [line for _, line in kept]
        return b"\n".join(rows), "," if blanks else self.form.separator

    def _other_decimal(self, text: str) -> str:
        """The other decimal sign, if the value that pyarrow refused is a number with it, and no separator speaks against it."""
        found = re.search(r"invalid value '(.*)'", text)
        if found and self.form.decimal == "." and self.form.separator != "," and is_comma_number(found[1]):
            return ","
        return self.form.decimal

    def _check_unnamed(self, index: int, column: pa.ChunkedArray) -> None:
        if column.null_count == len(column):
            return  # spreadsheets leave columns without a name at the end
        row = int(np.flatnonzero(~column.is_null().to_numpy())[0])
        value = column[row].as_py().decode(errors="replace")
        if index == 0 and [column[k].as_py() for k in range(min(3, len(column)))] == [b"0", b"1", b"2"][: len(column)]:
            self.notes.append("the first column, which has no name, numbers the rows and is left out")
            return
        raise MotionError(
            f"{self.place(row)}: {value!r} in column {index + 1}, which has no name; name it in line {self.form.header_line}, or remove what it holds"
        )

    def _what_arrow_says(self, text: str) -> str:
        comma = self.form.decimal == ","
        number = "a number with a decimal " + ("comma, as other values have" if comma else "point")

        def line(row: str) -> int:
            return int(row) if self._lines is None else self._line(int(row) - 1)

        found = re.search(r"In CSV column #(\d+): (?:Row #(\d+): )?.*invalid value '(.*)'", text, re.DOTALL)
        if found:
            name = self.form.names[int(found[1])]
            where = f"{self.file}:{line(found[2])}" if found[2] else self.file
            if "\n" in found[3]:
                return f"{where}: column {name!r} holds several lines, from {found[3][:20]!r} on; a quotation mark is not closed"
            of_numpy = "; that is how NumPy shows a number: write float(x) instead" if re.match(r"np\.\w+\(", found[3]) else ""
            return f"{where}: column {name!r} holds {found[3]!r}; expected {number}{of_numpy}"
        found = re.search(r"Row #(\d+): Expected (\d+) columns, got (\d+)", text)
        if found:
            values, columns = count(int(found[3]), "value"), count(int(found[2]), "column")
            return (
                f"{self.file}:{line(found[1])}: {values} in a table of {columns}; "
                f"separate values by {SEPARATORS[self.form.separator]}, numbers with a decimal {'comma' if comma and self.form.separator != ',' else 'point'}"
            )
        if "Empty CSV" in text or "Could not skip" in text:
            return f"{self.file}: holds no samples; give `time` and a column for each joint, a line for each sample"
        return f"{self.file}: can't be read as CSV ({' '.join(text.split())[:200]}); give `time` and a column for each joint, separated by commas"


def _has_blank_lines(data: bytes) -> bool:
    """Whether a line holds nothing but blanks, other than those of no length at the end."""
    if not any(x in data for x in (b"\n\n", b"\n\r\n", b"\r\r", b"\n ", b"\n\t", b"\r ", b"\r\t")):  # much faster than the expression, and mostly so
        return False
    return re.search(rb"(?:\n\r?|\r)[ \t]*[\r\n]|[\r\n][ \t]+\Z", data.rstrip(b"\r\n")) is not None


def _numbered(index: int) -> str:
    return f"column {index}"


def _as_utf8(file: str, data: bytes) -> tuple[bytes, str, list[str]]:
    """The content in UTF-8, or in the encoding that its first lines turn out to have, and notes about it."""
    if data.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        raise MotionError(f"{file}: is in UTF-32; save it in UTF-8")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            return data.decode("utf-16").encode(), "utf-8", ["the file is in UTF-16"]
        except UnicodeDecodeError:
            raise no_table(f"{file}: line 1 is not text") from None
    head = data[: 1 << 16]
    if not _TEXT_SIGNS.issuperset(head):
        bad = next(i for i, byte in enumerate(head) if byte not in _TEXT_SIGNS)
        said = f"{file}: line {len(head[:bad].splitlines()) or 1} is not text"
        if any(set(head[k:64:2]) == {0} for k in (0, 1)):
            raise MotionError(f"{said}; it seems to be in UTF-16 without a mark: save it in UTF-8")
        raise no_table(said)
    try:
        head.decode()
    except UnicodeDecodeError as e:
        if e.end < len(head):  # and not a character that the end of the head cuts
            return data, "cp1252", ["the file is not in UTF-8, and was read as Windows-1252"]
    return data, "utf-8", []


def _numbers(column: pa.ChunkedArray) -> Array:
    """Numbers of a column, NaN where one is missing.  `to_numpy` would import pandas, where it is installed: 0.15 s."""
    if column.null_count:
        missing: Array = column.to_numpy()
        return missing
    return np.concatenate([np.from_dlpack(chunk) for chunk in column.chunks])
