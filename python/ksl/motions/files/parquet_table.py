"""Parquet files, as pandas, polars and pyarrow write them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ksl.base import limits
from ksl.base.arrow_files import arrow_file, with_text
from ksl.base.errors import MotionError
from ksl.base.input_files import failed_read
from ksl.base.words import count
from ksl.mechanism.states import Array
from ksl.motions.columns.recorded import Recorded, check_columns, check_numbers
from ksl.motions.files.arrow_memory import own_memory
from ksl.motions.files.parquet_footer import row_groups

if TYPE_CHECKING:
    import pyarrow as pa

INDEX = "__index_level_"
"""How pandas names the columns of an index that has no name."""
TIME_LENGTH = 100
"""Bytes of a time that is text.  A date with nanoseconds and a time zone has 35."""
TIMES_AT_ONCE = 4096
"""Times that are text are read in parts of this many, and each part is judged before the next is read."""
DAMAGED = "is a Parquet file, but truncated or damaged; copy or write it again"


class ParquetTable(Recorded):
    def __init__(self, file: str, source: Path | bytes) -> None:
        """source: where the file is, or what it holds.  Raises MotionError if it is truncated, or holds wrenches instead of a motion.

        Never a file of Python's: threads of Arrow could still hold it when the interpreter ends, and the process would abort.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        self._source = own_memory(source) if isinstance(source, bytes) else source
        try:
            self._parquet = pq.ParquetFile(self._opened())
            self._schema = self._parquet.schema_arrow
            self._groups = row_groups(self._footer())
            self._check_groups()
        except MemoryError:
            raise
        except (pa.ArrowException, OSError, ValueError) as e:
            if failed := failed_read(e):
                raise failed from None
            raise MotionError(f"{file}: {DAMAGED}") from None
        if b"ksl" in (self._schema.metadata or {}) and {"joint", "fx"} <= set(self._schema.names):
            raise MotionError(f"{file}: holds the wrenches that `ksl loads` has computed, not a motion; give the motion's file")
        names = [n for n in self._schema.names if not n.startswith(INDEX)]
        notes = [] if len(names) == len(self._schema.names) else ["an index without a name is left out"]
        self._of_list: dict[str, tuple[str, int]] = {}
        types = {f.name: f.type for f in self._schema}
        names = [each for n in names for each in self._elements(file, n, types)]
        repeated = [n for n, k in Counter(names).items() if k > 1]
        if repeated:
            raise MotionError(f"{file}: two columns are named {repeated[0]!r}; rename or remove one")
        units = {f.name: f.metadata[k].decode(errors="replace") for f in self._schema if f.metadata for k in (b"unit", b"units") if k in f.metadata}
        super().__init__(file, "Parquet", names, {}, units, notes)
        for element, (name, _) in self._of_list.items():
            self.groups.setdefault(name, []).append(element)

    def _elements(self, file: str, name: str, types: dict[str, pa.DataType]) -> list[str]:
        """The name of a column, or those of its elements, `state[0]` …, if it holds lists of numbers, as LeRobot writes them."""
        import pyarrow.types as t

        kind = types[name]
        if not (t.is_list(kind) or t.is_large_list(kind) or t.is_fixed_size_list(kind)) or not _is_number(kind.value_type):
            return [name]
        if t.is_fixed_size_list(kind):
            size = kind.list_size
        else:  # the mean, rounded up, as a short list or a missing one is less rare than a long one; that all have as many is seen when they are read
            metadata = self._parquet.metadata
            inner = next((i for i in range(metadata.num_columns) if metadata.schema.column(i).path.startswith(f"{name}.")), None)
            values = sum(group.columns[inner].values for group in self._groups) if inner is not None else 0
            size = -(-values // max(metadata.num_rows, 1))
        check_columns(file, len(self._of_list) + size)
        self._of_list |= {f"{name}[{k}]": (name, k) for k in range(size)}
        return [f"{name}[{k}]" for k in range(size)] or [name]

    def _opened(self) -> pa.NativeFile:
        return arrow_file(self._source) if isinstance(self._source, Path) else self._source

    def _footer(self) -> bytes:
        """What stands before its own length and the magic, with which the file ends, as pyarrow has seen."""
        source = self._opened()
        source.seek(source.size() - 8)
        end = source.tell()
        length = int.from_bytes(source.read(4), "little")
        source.seek(end - length)
        footer = bytes(source.read(length))
        if source is not self._source:
            source.close()
        return footer

    def _check_groups(self) -> None:
        """Raises ValueError unless each row group has all columns, and no more rows than values: Arrow takes memory for them before it looks at columns."""
        metadata = self._parquet.metadata
        if [len(group.columns) for group in self._groups] != [metadata.num_columns] * metadata.num_row_groups:
            raise ValueError("row groups that don't have the columns of the schema")
        if any(not 0 <= group.rows <= column.values for group in self._groups for column in group.columns):
            raise ValueError("row groups with more rows than values")

    def text_in(self, name: str) -> str | None:
        import pyarrow.types as t

        if name in self._of_list:
            return None
        kind = self._schema.field(name).type
        if t.is_integer(kind) or t.is_floating(kind) or t.is_decimal(kind) or t.is_null(kind):
            return None
        return str(kind)

    def what_is_in(self, name: str) -> str:
        """What a column holds that holds no numbers."""
        import pyarrow.types as t

        kind = self._schema.field(name).type
        if t.is_nested(kind):
            return "groups of columns" if t.is_struct(kind) else "lists"
        return "truth values" if t.is_boolean(kind) else "text"

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        """As Recorded.read.  What the columns hold, and how much, is judged before they are read: a few bytes can stand for billions of values."""
        import pyarrow as pa

        for n in names:
            kind = self.text_in(n)
            if kind is not None and not (n == time and self._are_times(n)):
                raise MotionError(f"{self.file}: column {n!r} holds {kind}; expected numbers")
        stored = {n: self._of_list[n][0] if n in self._of_list else n for n in names}
        self._check_size(list(stored.values()))
        try:
            texts = {time: self._texts(time)} if time is not None and time not in self._of_list and self._is_text(time) else {}
            rows = self._parquet.metadata.num_rows
            table = self._parquet.read(columns=list(dict.fromkeys(stored[n] for n in names if n not in texts)))
            self._parquet.close()
            if any(len(column) != rows for column in (*table.columns, *texts.values())):
                raise pa.ArrowInvalid("row groups that don't have the rows of the file")
        except MemoryError:
            raise
        except (pa.ArrowException, OSError, UnicodeError) as e:
            if failed := failed_read(e):
                raise failed from None
            raise MotionError(f"{self.file}: {DAMAGED}") from None
        lists = {n: self._lists(table.column(n), n) for n in {stored[e] for e in names if e in self._of_list}}
        found = {}
        for n in names:
            if n in self._of_list:
                found[n] = lists[stored[n]][:, self._of_list[n][1]]
                continue
            column = texts[n] if n in texts else table.column(n)
            found[n] = self._times(column, n) if n == time else self._numbers(column)
        return found

    def _is_text(self, name: str) -> bool:
        import pyarrow.types as t

        kind = self._schema.field(name).type
        return bool(t.is_string(kind) or t.is_large_string(kind))

    def _are_times(self, name: str) -> bool:
        import pyarrow.types as t

        kind = self._schema.field(name).type
        return self._is_text(name) or bool(t.is_timestamp(kind) or t.is_duration(kind))

    def _check_size(self, names: Sequence[str]) -> None:
        metadata = self._parquet.metadata
        wanted = set(names)
        columns = [metadata.schema.column(i) for i in range(metadata.num_columns)]
        leaves = [i for i, c in enumerate(columns) if c.path in wanted or (c.path != c.name and not wanted.isdisjoint(_outer(c.path)))]
        check_numbers(self.file, sum(max(metadata.num_rows, sum(group.columns[i].values for group in self._groups)) for i in leaves))
        if sum(max(group.columns[i].unpacked, 0) for group in self._groups for i in leaves) > limits.MOTION_BYTES:
            raise MotionError(
                f"{self.file}: unpacked it is larger than {limits.megabytes(limits.MOTION_BYTES)}, the most that is read; thin it out, or give a part of it"
            )

    def _texts(self, name: str) -> pa.ChunkedArray:
        """A column of times that are text.

        It is read as Parquet stores it, with each distinct text once: a long one that is repeated takes no memory before it is refused.
        """
        import pyarrow as pa
        import pyarrow.compute as pc
        import pyarrow.parquet as pq

        parts, bytes_read = [], 0
        parquet = pq.ParquetFile(self._opened(), metadata=self._parquet.metadata, read_dictionary=[name])
        for batch in parquet.iter_batches(batch_size=TIMES_AT_ONCE, columns=[name]):
            part = batch.column(0)
            distinct = part.dictionary if isinstance(part, pa.DictionaryArray) else part
            longest = pc.max(pc.binary_length(distinct)).as_py() or 0
            if longest > TIME_LENGTH:
                what = f"holds a time of {longest:,} bytes; at most {TIME_LENGTH} are read"
                raise MotionError(f"{self.file}: column {name!r} {what}: write times in seconds, or as dates")
            part = part.cast(pa.string())
            with_text(pa.table({name: part}))
            bytes_read += part.nbytes
            if bytes_read > limits.MOTION_BYTES:
                most = limits.megabytes(limits.MOTION_BYTES)
                raise MotionError(f"{self.file}: the times in column {name!r} are larger than {most}, the most that is read; write them in seconds")
            parts.append(part)
        return pa.chunked_array(parts, pa.string())

    def _lists(self, column: pa.ChunkedArray, name: str) -> Array:
        """Lists of numbers as a matrix (rows, elements).  Raises MotionError if their lengths differ."""
        import pyarrow.compute as pc

        size = sum(1 for of, _ in self._of_list.values() if of == name)
        lengths = pc.list_value_length(column).to_numpy()
        bad = np.flatnonzero(~(lengths == size))
        if len(bad):
            k = int(bad[0])
            found = "no list" if np.isnan(lengths[k]) else f"a list of {count(int(lengths[k]), 'number')}"
            raise MotionError(f"{self.place(k)}: column {name!r} holds {found}; expected {size} in each row")
        return self._numbers(pc.list_flatten(column)).reshape(-1, size)

    def _numbers(self, column: pa.ChunkedArray) -> Array:
        import pyarrow as pa

        numbers: Array = np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=float)
        return numbers

    def _times(self, column: pa.ChunkedArray, name: str) -> Array:
        """Seconds; of dates since the first one, of durations as they are."""
        import pyarrow.types as t

        from ksl.motions.files.clock_times import seconds_of_text

        if column.null_count and not t.is_floating(column.type):
            raise MotionError(f"{self.file}: {count(column.null_count, 'time')} in column {name!r} missing; every sample needs one")
        if t.is_timestamp(column.type) or t.is_duration(column.type):
            self.times_are_seconds = True
            return np.asarray(self._ticks(column, name) * 1e-9, dtype=float)
        if self._is_text(name):
            self.times_are_seconds = True
            seconds, note = seconds_of_text(column, name, self.place)
            self.notes.append(note)
            return seconds
        return self._numbers(column)

    def _zone(self, column: pa.ChunkedArray, name: str) -> str | None:
        """The time zone of dates."""
        try:
            zone: str | None = column.type.tz
        except UnicodeDecodeError:
            raise MotionError(f"{self.file}: the time zone of column {name!r} is no text; write times in seconds") from None
        return zone

    def _ticks(self, column: pa.ChunkedArray, name: str) -> np.ndarray:
        """Nanoseconds of dates since the first one, or of durations.  Raises MotionError where 64 bits don't hold them, or the time zone is unknown."""
        import pyarrow as pa
        import pyarrow.types as t

        dates = t.is_timestamp(column.type)
        try:
            nanoseconds = column.cast(pa.timestamp("ns", self._zone(column, name)) if dates else pa.duration("ns"))
        except pa.ArrowInvalid:
            what, known = ("dates", "those from 1678 to 2261") if dates else ("durations", "those of at most 292 years")
            raise MotionError(f"{self.file}: column {name!r} holds {what} that are too large, only {known} are read; write times in seconds") from None
        ticks = np.array(nanoseconds.cast(pa.int64()).to_numpy(), dtype=np.int64)
        if not dates:
            return ticks
        if not len(ticks):
            self.notes.append("no times")
            return ticks
        if int(ticks.max()) - int(ticks.min()) > np.iinfo(np.int64).max:
            raise MotionError(f"{self.file}: column {name!r} holds dates more than 292 years apart; write times in seconds")
        try:
            first = column[0].as_py()
        except (pa.ArrowException, ValueError, LookupError, OverflowError):
            zone = f"the time zone {self._zone(column, name)!r}, which is not known" if self._zone(column, name) else "a first date that can't be shown"
            raise MotionError(f"{self.file}: column {name!r} has {zone}; write dates in UTC, or times in seconds") from None
        self.notes.append(f"times in column {name!r} are dates; time 0 is {first}")
        ticks -= ticks[0]
        return ticks


def _is_number(kind: pa.DataType) -> bool:
    import pyarrow.types as t

    return bool(t.is_integer(kind) or t.is_floating(kind))


def _outer(path: str) -> Iterable[str]:
    """Columns in which the column `a.b.c` lies, `a` and `a.b`: their names select it, too."""
    return accumulate(path.split("."), "{}.{}".format)
