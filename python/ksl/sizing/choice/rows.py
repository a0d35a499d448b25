"""Catalogues as tables: the rows of a CSV file or of a workbook's first sheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any

from ksl.base import limits
from ksl.base.csv_cells import text_of_cell
from ksl.base.errors import SizingError
from ksl.base.input_files import Unreadable, contents
from ksl.base.toml_files import read_text, toml_of

MOST_ROWS, MOST_COLUMNS = 100_000, 1_000


def rows_of_csv(file: str, mend: str) -> list[list[Any]]:
    """Cells between commas, or between semicolons where the line of names has no comma.  Raises SizingError; mend: what is said beside it."""
    text = read_text(file, SizingError, mend)
    names = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    try:
        return list(csv.reader(io.StringIO(text), delimiter=";" if ";" in names and "," not in names else ","))
    except csv.Error as e:
        raise SizingError(f"{file}: is no CSV file ({e}); {mend}") from None


def rows_of_workbook(file: str, mend: str) -> list[list[Any]]:
    """The cells of the first sheet.  Raises SizingError."""
    try:
        import openpyxl
    except ModuleNotFoundError:
        raise SizingError(f"{file}: is read by the package openpyxl; install it: pip install 'ksl[xlsx]'; or save the sheet as CSV") from None
    try:
        source = io.BytesIO(contents(file, limits.TOML_BYTES))
    except Unreadable as e:
        raise SizingError(f"{file}: {e}; {mend}") from None
    try:
        sheet = openpyxl.load_workbook(source, read_only=True, data_only=True, keep_links=False).worksheets[0]
        sheet.reset_dimensions()
        return [list(row) for row in sheet.iter_rows(max_row=MOST_ROWS, max_col=MOST_COLUMNS, values_only=True)]
    except MemoryError:
        raise
    except Exception as e:  # openpyxl lets errors of XML, of zip archives and of Python's own types through
        raise SizingError(f"{file}: is no workbook that can be read ({type(e).__name__}); save it again, or save the sheet as CSV") from None


def tables_of_rows(file: str, rows: Sequence[Sequence[Any]], mend: str) -> tuple[dict[str, Any], dict[Any, int]]:
    """The tables that a TOML file with the same entries would have, and their lines: the first row has the keys, those of inner tables with a dot; empty cells are no values, rows that begin with # are
    comments."""
    numbered = [(k, row) for k, row in enumerate(rows, 1) if any(not _empty(x) for x in row) and not str(row[0]).startswith("#")]
    if len(numbered) < 2:
        raise SizingError(f"{file}: holds no components; {mend}")
    names = ["" if _empty(x) else str(x).strip() for x in numbered[0][1]]
    twice = [name for k, name in enumerate(names) if name and name in names[:k]]
    if twice:
        raise SizingError(f"{file}:{numbered[0][0]}: two columns are named {twice[0]!r}")
    entries: list[dict[str, Any]] = []
    lines: dict[Any, int] = {}
    for line, row in numbered[1:]:
        lines["component", len(entries)] = line
        entry: dict[str, Any] = {}
        for name, x in zip(names, row, strict=False):
            if _empty(x):
                continue
            if not name:
                raise SizingError(f"{file}:{line}: {x!r} is in a column without a name; name it in the first row")
            table, _, key = name.rpartition(".")
            inside = entry.setdefault(table, {}) if table else entry
            if not isinstance(inside, dict):
                raise SizingError(f"{file}:{line}: the columns {table} and {name} exclude each other")
            inside[key] = _cell(x, f"{file}:{line}: {name}", key in ("kind", "name", "size"))
        entries.append(entry)
    return {"component": entries}, lines


def _empty(x: Any) -> bool:
    return x is None or (isinstance(x, str) and not x.strip())


def _cell(x: Any, where: str, is_text: bool) -> Any:
    """A number, a list in the form of TOML, or text."""
    if not isinstance(x, str):
        return str(x) if is_text else x
    text = text_of_cell(x.strip())
    if is_text:
        return text
    if text[:1] in "[{":
        return toml_of(f"x = {text}", where, SizingError)["x"]
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text
