"""The files of results: wrenches as Parquet and CSV, block by block; and whether they may replace what a folder holds."""

from __future__ import annotations

import json
import os
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from ksl.base.arrow_files import arrow_file
from ksl.base.csv_cells import csv_table
from ksl.load_cases.load_case import Block
from ksl.load_cases.provenance import Provenance
from ksl.load_cases.summary_table import FIRST_LINE, SUMMARY
from ksl.load_cases.wrench_table import TableWriter
from ksl.output import OutputError, flush_early, refuse_unknown
from ksl.report import mat_file, mcap_file, rrd_file
from ksl.report.files import NAMES as REPORT_FILES
from ksl.report.workbook import WORKBOOK

if TYPE_CHECKING:
    import pyarrow as pa

DEFLECTION = "deflection.csv"
RESULTS = ("wrenches.parquet", "wrenches.csv", mcap_file.FILE, mat_file.FILE, rrd_file.FILE, SUMMARY, WORKBOOK, DEFLECTION, *REPORT_FILES)
"""Files that a run may write.  Those that it doesn't write are removed, since they are from an earlier run."""


def refuse_others(directory: Path, provenance: Provenance) -> None:
    """Raises OutputError if the folder holds results of another robot, or files of others with names of results."""
    earlier = _metadata(directory / "wrenches.parquet")
    if earlier is None:
        if not _is_summary(directory / SUMMARY):
            refuse_unknown(directory, RESULTS, "wrenches.parquet or summary.csv of KSL")
        return
    names = [j["name"] for j in earlier.get("joints", [])]
    if earlier.get("robot") != provenance.robot or names not in ([], [j["name"] for j in provenance.joints]):
        which = f"of another robot, {earlier.get('robot')}" if earlier.get("robot") != provenance.robot else "of a robot of this name with other joints"
        raise OutputError(f"{directory}: holds results {which}; give another folder with -o, or replace them with --force")


def _metadata(path: Path) -> dict[str, Any] | None:
    """What the results in a file say of themselves; None if there are none."""
    if not os.path.isfile(path):
        return None
    import pyarrow as pa
    import pyarrow.parquet

    try:
        with arrow_file(path) as opened:
            said = json.loads((pyarrow.parquet.read_schema(opened).metadata or {})[b"ksl"])
    except (OSError, pa.ArrowInvalid, KeyError, ValueError):  # no result of KSL, or one that was cut off
        return None
    return said if isinstance(said, dict) else None


def _is_summary(path: Path) -> bool:
    """Whether a file begins as a summary of KSL does."""
    try:
        with open(path, "rb") as f:
            return f.read(len(FIRST_LINE)) == FIRST_LINE.encode()
    except OSError:
        return False


class WrenchFiles:
    """wrenches.parquet, and wrenches.csv if it is wanted; a context manager that closes them."""

    def __init__(self, folder: Path, writer: TableWriter, with_csv: bool) -> None:
        import pyarrow.parquet

        self._writer = writer
        words = [f.name for f in writer.schema if _is_word(f)]
        numbers = [f.name for f in writer.schema if not _is_word(f)]
        # bytes of the same weight together: smaller than zstd of whole numbers, in half of the time
        how = {"compression": "lz4", "use_dictionary": words, "use_byte_stream_split": numbers}
        self._path = folder / "wrenches.parquet"
        self._open = ExitStack()
        file = self._open.enter_context(arrow_file(self._path, "wb"))
        self._parquet = self._open.enter_context(pyarrow.parquet.ParquetWriter(file, writer.schema, **how))
        self._csv: Any = None
        if with_csv:
            import pyarrow.csv

            options = pyarrow.csv.WriteOptions(quoting_style="needed")
            file = self._open.enter_context(arrow_file(folder / "wrenches.csv", "wb"))
            self._csv = self._open.enter_context(pyarrow.csv.CSVWriter(file, _plain(writer.schema), write_options=options))

    def write(self, block: Block, case: int) -> None:
        table = self._writer.table(block, case)
        self._parquet.write_table(table)
        if self._csv is not None:
            self._csv.write_table(csv_table(table).cast(_plain(self._writer.schema)))

    def __enter__(self) -> WrenchFiles:
        return self

    def __exit__(self, error: type[BaseException] | None, value: BaseException | None, traceback: TracebackType | None) -> None:
        self._open.close()
        if error is None:
            flush_early(self._path)  # while the report is made


def _is_word(field: pa.Field) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_dictionary(field.type))


def _plain(schema: pa.Schema) -> pa.Schema:
    """The schema with plain strings instead of dictionaries, as CSV needs."""
    import pyarrow as pa

    return pa.schema([pa.field(f.name, pa.string() if _is_word(f) else f.type) for f in schema])
