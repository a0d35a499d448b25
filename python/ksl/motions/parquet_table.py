"""Parquet files, as pandas, polars and pyarrow write them."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ksl import limits
from ksl.errors import MotionError
from ksl.motions.arrow_memory import own_memory
from ksl.motions.recorded import Recorded, check_numbers, count
from ksl.states import Array

if TYPE_CHECKING:
    import pyarrow as pa

INDEX = "__index_level_"
"""How pandas names the columns of an index that has no name."""


class ParquetTable(Recorded):
    def __init__(self, file: str, source: Path | bytes) -> None:
        """source: where the file is, or what it holds.  Raises MotionError if it is truncated, or holds wrenches instead of a motion.

        Never a file of Python's: threads of Arrow could still hold it when the interpreter ends, and the process would abort.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            self._source = own_memory(source) if isinstance(source, bytes) else pa.OSFile(os.fsencode(source))
            self._parquet = pq.ParquetFile(self._source)
            self._schema = self._parquet.schema_arrow
        except (pa.ArrowException, OSError, UnicodeError):
            raise MotionError(f"{file}: is a Parquet file, but truncated or damaged; copy or write it again") from None
        if b"ksl" in (self._schema.metadata or {}) and {"joint", "fx"} <= set(self._schema.names):
            raise MotionError(f"{file}: holds the wrenches that `ksl loads` has computed, not a motion; give the motion's file")
        names = [n for n in self._schema.names if not n.startswith(INDEX)]
        notes = [] if len(names) == len(self._schema.names) else ["an index without a name is left out"]
        repeated = [n for n, k in Counter(names).items() if k > 1]
        if repeated:
            raise MotionError(f"{file}: two columns are named {repeated[0]!r}; rename or remove one")
        units = {f.name: f.metadata[k].decode(errors="replace") for f in self._schema if f.metadata for k in (b"unit", b"units") if k in f.metadata}
        super().__init__(file, "Parquet", names, {}, units, notes)

    def text_in(self, name: str) -> str | None:
        import pyarrow.types as t

        kind = self._schema.field(name).type
        if t.is_integer(kind) or t.is_floating(kind) or t.is_decimal(kind) or t.is_null(kind):
            return None
        return str(kind)

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        import pyarrow as pa
        import pyarrow.parquet as pq

        for n in names:
            if n != time or not self._is_clock(n):
                self._check_kind(n)
        check_numbers(self.file, self._count(set(names)))  # a few bytes can stand for billions of equal ones
        try:
            if time is not None and self._is_text(time):  # of texts that are equal one is kept
                self._parquet = pq.ParquetFile(self._source, metadata=self._parquet.metadata, read_dictionary=[time])
            table = self._parquet.read(columns=list(names))
            self._parquet.close()
        except (pa.ArrowException, OSError, UnicodeError):
            raise MotionError(f"{self.file}: is a Parquet file, but truncated or damaged; copy or write it again") from None
        return {n: self._times(table.column(n), n) if n == time else self._numbers(table.column(n)) for n in names}

    def _count(self, names: set[str]) -> int:
        """Numbers of these columns, as many as the file says at any of the places where it counts them.  O(columns × groups of rows)."""
        metadata = self._parquet.metadata
        columns = [metadata.schema.column(i) for i in range(metadata.num_columns)]
        leaves = [i for i, c in enumerate(columns) if c.path in names or (c.path != c.name and not names.isdisjoint(_outer(c.path)))]
        groups = [metadata.row_group(k) for k in range(metadata.num_row_groups)]
        return sum(max(metadata.num_rows, sum(group.column(i).num_values for group in groups)) for i in leaves)

    def _is_clock(self, name: str) -> bool:
        """Whether the column may hold times that are no numbers."""
        import pyarrow.types as t

        kind = self._schema.field(name).type
        return bool(t.is_timestamp(kind) or t.is_duration(kind)) or self._is_text(name)

    def _is_text(self, name: str) -> bool:
        import pyarrow.types as t

        kind = self._schema.field(name).type
        return bool(t.is_string(kind) or t.is_large_string(kind))

    def _check_kind(self, name: str) -> None:
        """Raises MotionError for a column without numbers, before it is read: a few bytes can stand for any length of text."""
        kind = self.text_in(name)
        if kind is not None:
            raise MotionError(f"{self.file}: column {name!r} holds {kind}; expected numbers")

    def _numbers(self, column: object) -> Array:
        import pyarrow as pa

        assert isinstance(column, pa.ChunkedArray)
        numbers: Array = np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=float)
        return numbers

    def _times(self, column: object, name: str) -> Array:
        """Seconds; of dates since the first one, of durations as they are."""
        import pyarrow as pa
        import pyarrow.types as t

        from ksl.motions.clock_times import seconds_of_text

        assert isinstance(column, pa.ChunkedArray)
        if column.null_count and not t.is_floating(column.type):
            raise MotionError(f"{self.file}: {count(column.null_count, 'time')} in column {name!r} missing; every sample needs one")
        if t.is_timestamp(column.type) or t.is_duration(column.type):
            to = pa.timestamp("ns", column.type.tz) if t.is_timestamp(column.type) else pa.duration("ns")
            self.times_are_seconds = True
            ticks = column.cast(to).cast(pa.int64()).to_numpy()
            if t.is_timestamp(column.type):
                self.notes.append(f"times in column {name!r} are dates; time 0 is {column[0].as_py()}" if len(ticks) else "no times")
                ticks = ticks - ticks[:1]
            return np.asarray(ticks * 1e-9, dtype=float)
        if t.is_dictionary(column.type):
            self.times_are_seconds = True
            seconds, note = seconds_of_text(self._texts(column, name), name, self.place)
            self.notes.append(note)
            return seconds
        return self._numbers(column)

    def _texts(self, column: pa.ChunkedArray, name: str) -> pa.ChunkedArray:
        """The texts of a column of which equal ones are kept once.  Raises MotionError for more of them than are read."""
        import pyarrow as pa
        import pyarrow.compute as pc

        size = sum(len(chunk) * (pc.max(pc.binary_length(chunk.dictionary)).as_py() or 0) for chunk in column.chunks)
        if size > limits.MOTION_BYTES:
            holds, most = limits.megabytes(size), limits.megabytes(limits.MOTION_BYTES)
            raise MotionError(f"{self.file}: column {name!r} holds up to {holds} of text; at most {most} are read")
        return column.cast(column.type.value_type).cast(pa.string())


def _outer(path: str) -> Iterable[str]:
    """Columns in which the column `a.b.c` lies, `a` and `a.b`: their names select it, too."""
    return accumulate(path.split("."), "{}.{}".format)
