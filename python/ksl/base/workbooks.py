"""Excel workbooks as they are written: sheets with names, units and rows.  Cells hold numbers and texts, and no formulas."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from ksl.base.printable import one_line

if TYPE_CHECKING:
    import os

    from openpyxl import Workbook
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

MOST_ROWS = (1 << 20) - 2
"""Rows of one sheet, below names and units."""
MOST_TEXT = 32767
"""Characters of a cell."""


def is_missing() -> str:
    """What brings the package that writes workbooks; empty where it is there."""
    return "" if find_spec("openpyxl") else "is written by the package openpyxl; install it: pip install 'ksl[xlsx]'"


def new_workbook() -> Workbook:
    """Without sheets.  Rows are written as they are added."""
    from openpyxl import Workbook

    return Workbook(write_only=True)


def add_table(book: Workbook, title: str, names: Sequence[str], units: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A sheet with names, units and rows; the first two stay in view.  Some 5 µs a cell."""
    sheet = book.create_sheet(title)
    sheet.freeze_panes = "A3"
    for head in (names, units):
        sheet.append(cells(sheet, head))
    for row in rows:
        sheet.append(cells(sheet, row))


def add_lines(book: Workbook, title: str, lines: Iterable[Sequence[str]]) -> None:
    """A sheet with names and texts beside each other."""
    sheet = book.create_sheet(title)
    sheet.column_dimensions["A"].width, sheet.column_dimensions["B"].width = 16, 100
    for line in lines:
        sheet.append(cells(sheet, line))


def save(book: Workbook, path: os.PathLike[str]) -> None:
    book.save(path)


def cells(sheet: WriteOnlyWorksheet, row: Iterable[Any]) -> Iterator[Any]:
    """Values as cells.  A text that begins with = is no formula, and control characters, which a workbook can't have, are shown by their numbers."""
    from openpyxl.cell import WriteOnlyCell

    for x in row:
        if not isinstance(x, str):
            yield x
            continue
        cell = WriteOnlyCell(sheet, value=one_line(x)[:MOST_TEXT])
        cell.data_type = "s"
        yield cell
