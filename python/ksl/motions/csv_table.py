"""A table of numbers from a CSV file: {column: values}."""

from __future__ import annotations

import os
import re
import stat
from typing import TYPE_CHECKING

import numpy as np

from ksl.errors import MotionError
from ksl.states import Array

if TYPE_CHECKING:
    import pyarrow as pa


def read_table(file: str) -> dict[str, Array]:
    import pyarrow as pa
    from pyarrow import csv

    names = _read_header(file)
    numbered = [f"column {i}" for i in range(len(names))]  # spreadsheets leave columns without a name at the end
    types = {c: pa.float64() if n else pa.string() for c, n in zip(numbered, names, strict=True)}

    def read(threads: bool) -> pa.Table:
        return csv.read_csv(
            file,
            read_options=csv.ReadOptions(column_names=numbered, skip_rows=1, use_threads=threads),
            parse_options=csv.ParseOptions(ignore_empty_lines=False),
            convert_options=csv.ConvertOptions(column_types=types, null_values=["", "NaN", "nan", "NA"], strings_can_be_null=True),
        )

    try:
        try:
            table = read(threads=True)
        except pa.ArrowInvalid:
            table = read(threads=False)  # fails again, and then reports the row
    except pa.ArrowInvalid as e:
        raise MotionError(_what_arrow_says(file, names, str(e))) from None
    except OSError as e:
        what = os.strerror(e.errno) if e.errno else e
        raise MotionError(f"{file}: can't be read ({what}); give a CSV file with `time` and a column for each joint") from None
    columns = {}
    for i, n in enumerate(names):
        if n:
            columns[n] = table.column(i).to_numpy()
        else:
            _check_unnamed(file, i, table.column(i))
    rows = len(table)
    while rows and all(np.isnan(x[rows - 1]) for x in columns.values()):
        rows -= 1  # blank lines at the end
    return {n: x[:rows] for n, x in columns.items()}


def _read_header(file: str) -> list[str]:
    """Names of the columns; empty where a column has none."""
    mend = "give a CSV file with `time` and a column for each joint"
    try:
        mode = os.stat(file).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # read twice, which a pipe can't be
            raise MotionError(f"{file}: is a pipe or a device, and can't be read more than once; write the table to a file, and give that")
        with open(file, "rb") as f:
            line = f.readline()
        header = line.decode("utf-8-sig").strip("\r\n")
    except OSError as e:
        raise MotionError(f"{file}: can't be read ({e.strerror}); {mend}") from None
    except UnicodeDecodeError:
        raise MotionError(f"{file}: line 1 is not text; {mend}") from None
    names = _split(header, ",")
    if line and not any(names):
        raise MotionError(f"{file}:1: no names of columns; {mend}, named in the first line")
    if "time" not in names:
        for separator, word in ((";", "semicolons"), ("\t", "tabs")):
            if "time" in _split(header, separator):
                raise MotionError(f"{file}:1: columns are separated by {word}; separate them by commas, and write numbers with a decimal point")
    repeated = [n for i, n in enumerate(names) if n and n in names[:i]]
    if repeated:
        raise MotionError(f"{file}:1: two columns are named {repeated[0]!r}; rename or remove one")
    return names


def _split(header: str, separator: str) -> list[str]:
    import csv

    return [n.strip() for n in next(csv.reader([header], delimiter=separator, skipinitialspace=True), [])] or [""]


def _check_unnamed(file: str, index: int, column: pa.ChunkedArray) -> None:
    if column.null_count < len(column):
        row = int(np.flatnonzero(~column.is_null().to_numpy())[0])
        raise MotionError(f"{file}:{row + 2}: {column[row].as_py()!r} in column {index + 1}, which has no name; name it in line 1, or remove what it holds")


def count(n: int, what: str) -> str:
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def _what_arrow_says(file: str, names: list[str], text: str) -> str:
    found = re.search(r"In CSV column #(\d+): Row #(\d+): .*invalid value '(.*)'", text)
    if found:
        return f"{file}:{int(found[2])}: column {names[int(found[1])]!r} holds {found[3]!r}; expected a number with a decimal point"
    found = re.search(r"Row #(\d+): Expected (\d+) columns, got (\d+)", text)
    if found:
        values, columns = count(int(found[3]), "value"), count(int(found[2]), "column")
        return f"{file}:{int(found[1])}: {values} in a table of {columns}; separate values by commas, numbers with a decimal point"
    if "Empty CSV" in text or "Could not skip" in text:
        return f"{file}: holds no samples; give `time` and a column for each joint, a line for each sample"
    return f"{file}: can't be read as CSV ({text}); give `time` and a column for each joint, separated by commas"


def check_finite(file: str, table: dict[str, Array]) -> None:
    for name, x in table.items():
        bad = np.flatnonzero(~np.isfinite(x))
        if len(bad):
            what = "is not a number or missing" if np.isnan(x[bad[0]]) else "is infinite"
            raise MotionError(f"{file}:{bad[0] + 2}: column {name!r} {what}; every sample needs a finite number in every column")
