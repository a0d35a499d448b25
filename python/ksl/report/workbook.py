"""Results as an Excel workbook: a sheet for each table, with a row of units, and one that says what made them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ksl.base.arrow_files import arrow_file
from ksl.base.printable import one_line
from ksl.load_cases.provenance import CONVENTIONS, UNITS, Provenance
from ksl.load_cases.quantities import UNITS as UNITS_OF_QUANTITIES
from ksl.load_cases.quantities import SummaryRow
from ksl.load_cases.summary_table import PEAKS, all_rows, columns_of_rows
from ksl.model.states import EFFORT_PARTS
from ksl.output import OutputError

if TYPE_CHECKING:
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

WORKBOOK = "results.xlsx"
MOST_ROWS = (1 << 20) - 2
"""Of samples and joints in one sheet, below names and units."""
MOST_TEXT = 32767
"""Characters of a cell."""
_WORDS = ("case", "joint", "kind", "on", "at", "axes", "undetermined")
_ENDS = re.compile(r"_(peak|rms|mean|lowest|highest|positive|negative)$")
_COMPONENT = re.compile(r"(?:constraint_)?([ft])[xyz]$")
_OF_KIND = {"position": "rad or m", "speed": "rad/s or m/s", "acceleration": "rad/s² or m/s²", "work": "J", "time": "s"}
_OF_KIND |= dict.fromkeys(("effort", "brake", "coupling", *EFFORT_PARTS), "N m or N")


def check_package() -> None:
    """Raises OutputError without the package that writes workbooks: before an hour of work rather than after it."""
    if find_spec("openpyxl") is None:
        raise OutputError(f"{WORKBOOK}: is written by the package openpyxl; install it: pip install 'ksl[xlsx]'")


def unit_of_column(name: str) -> str:
    """The unit of a column of the tables; empty for words."""
    if name in _WORDS or name.endswith("_case"):
        return ""
    if name.endswith("_time"):
        return "s"
    if found := _COMPONENT.match(name):
        return "N" if found[1] == "f" else "N m"
    quantity = _ENDS.sub("", name)
    return _OF_KIND.get(quantity) or UNITS_OF_QUANTITIES.get(quantity, "")


def write_workbook(path: Path, wrenches: Path, rows: Sequence[SummaryRow], provenance: Provenance) -> None:
    """results.xlsx: the summary, every wrench of a file wrenches.parquet, and what made them.  O(numbers), some 5 µs each.

    More rows of wrenches than a sheet has are left out, and the sheet says so.
    """
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    summary = all_rows(rows)
    names = columns_of_rows(summary)
    _add_table(book.create_sheet("Summary"), names, ([row.get(name) for name in names] for row in summary))
    _add_wrenches(book.create_sheet("Wrenches"), wrenches)
    about = book.create_sheet("About")
    about.column_dimensions["A"].width, about.column_dimensions["B"].width = 16, 100
    for name, text in [("robot", provenance.robot), *provenance.lines(), ("units", UNITS), ("peaks", PEAKS), ("conventions", CONVENTIONS)]:
        about.append(_cells(about, [name, text]))
    book.save(path)


def _add_wrenches(sheet: WriteOnlyWorksheet, wrenches: Path) -> None:
    import pyarrow.parquet as pq

    with arrow_file(wrenches) as opened:
        file = pq.ParquetFile(opened)
        rows = file.metadata.num_rows
        if rows > MOST_ROWS:
            sheet.append(_cells(sheet, [f"{rows:,} rows; a sheet has {MOST_ROWS:,}. wrenches.parquet has all of them."]))
            return
        _add_table(sheet, file.schema_arrow.names, (row for batch in file.iter_batches(4096) for row in zip(*(column.to_pylist() for column in batch.columns))))


def _add_table(sheet: WriteOnlyWorksheet, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Names, units and rows; the first two stay in view."""
    sheet.freeze_panes = "A3"
    for head in (names, [unit_of_column(name) for name in names]):
        sheet.append(_cells(sheet, head))
    for row in rows:
        sheet.append(_cells(sheet, row))


def _cells(sheet: WriteOnlyWorksheet, row: Iterable[Any]) -> Iterator[Any]:
    """Values as cells.  A text that begins with = is no formula, and control characters, which a workbook can't have, are shown by their numbers."""
    from openpyxl.cell import WriteOnlyCell

    for x in row:
        if not isinstance(x, str):
            yield x
            continue
        cell = WriteOnlyCell(sheet, value=one_line(x)[:MOST_TEXT])
        cell.data_type = "s"
        yield cell
