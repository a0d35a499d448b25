"""Results as an Excel workbook: a sheet for each table, with a row of units, and one that says what made them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ksl.base import workbooks
from ksl.base.arrow_files import arrow_file
from ksl.base.workbooks import MOST_ROWS
from ksl.load_cases.provenance import CONVENTIONS, UNITS, Provenance
from ksl.load_cases.quantities import UNITS as UNITS_OF_QUANTITIES
from ksl.load_cases.quantities import SummaryRow
from ksl.load_cases.summary_table import PEAKS, all_rows, columns_of_rows
from ksl.mechanism.states import EFFORT_PARTS
from ksl.output import OutputError

if TYPE_CHECKING:
    from openpyxl import Workbook

WORKBOOK = "results.xlsx"
_WORDS = ("case", "joint", "kind", "on", "at", "axes", "undetermined")
_ENDS = re.compile(r"_(at_peak|peak|rms|mean|lowest|highest|positive|negative)$")
_COMPONENT = re.compile(r"(?:constraint_)?([ft])[xyz]$")
_OF_KIND = {"position": "rad or m", "speed": "rad/s or m/s", "acceleration": "rad/s² or m/s²", "work": "J", "time": "s"}
_OF_KIND |= dict.fromkeys(("effort", "brake", "coupling", *EFFORT_PARTS), "N m or N")


def check_package() -> None:
    """Raises OutputError without the package that writes workbooks: before an hour of work rather than after it."""
    if missing := workbooks.is_missing():
        raise OutputError(f"{WORKBOOK}: {missing}")


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
    """results.xlsx: the summary, every wrench of a file wrenches.parquet, and what made them.  O(numbers).

    More rows of wrenches than a sheet has are left out, and the sheet says so.
    """
    book = workbooks.new_workbook()
    summary = all_rows(rows)
    names = columns_of_rows(summary)
    workbooks.add_table(book, "Summary", names, [unit_of_column(name) for name in names], ([row.get(name) for name in names] for row in summary))
    _add_wrenches(book, wrenches)
    workbooks.add_lines(book, "About", [("robot", provenance.robot), *provenance.lines(), ("units", UNITS), ("peaks", PEAKS), ("conventions", CONVENTIONS)])
    workbooks.save(book, path)


def _add_wrenches(book: Workbook, wrenches: Path) -> None:
    import pyarrow.parquet as pq

    with arrow_file(wrenches) as opened:
        file = pq.ParquetFile(opened)
        if file.metadata.num_rows > MOST_ROWS:
            workbooks.add_lines(book, "Wrenches", [(f"{file.metadata.num_rows:,} rows; a sheet has {MOST_ROWS:,}. wrenches.parquet has all of them.",)])
            return
        names = file.schema_arrow.names
        rows = (row for batch in file.iter_batches(4096) for row in zip(*(column.to_pylist() for column in batch.columns)))
        workbooks.add_table(book, "Wrenches", names, [unit_of_column(name) for name in names], rows)
