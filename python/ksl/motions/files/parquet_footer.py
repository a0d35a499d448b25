"""Rows of a Parquet file and sizes of its columns, of the bytes of its footer.

pyarrow would say them, too, but where a footer is damaged some of its calls end the process.  Here what the format says of a column is read,
and all else is passed over: Apache Parquet's parquet.thrift, in Thrift's compact protocol.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

DEEPEST = 16
"""Structs in structs.  The format has six."""
_TRUE, _FALSE, _BYTE, _INTEGERS, _DOUBLE, _BINARY, _LISTS, _STRUCT = 1, 2, 3, (4, 5, 6), 7, 8, (9, 10), 12
_ROW_GROUPS, _COLUMNS, _NUM_ROWS, _META_DATA, _NUM_VALUES, _UNCOMPRESSED = 4, 1, 3, 3, 5, 6


class Chunk(NamedTuple):
    """A column in a row group."""

    values: int = 0
    unpacked: int = 0
    """Bytes."""


class RowGroup(NamedTuple):
    rows: int
    columns: list[Chunk]
    """In the order of the schema."""


def row_groups(footer: bytes) -> list[RowGroup]:
    """The row groups of a file.  Raises ValueError for what is no footer.  O(bytes)."""
    reader = _Reader(footer)
    found: list[RowGroup] = []

    def of_file(number: int, kind: int) -> bool:
        if number != _ROW_GROUPS or kind not in _LISTS:
            return False
        found[:] = [reader.row_group() for _ in range(reader.list_of(_STRUCT))]
        return True

    reader.struct(of_file)
    return found


class _Reader:
    """Reads from the start, and skips what nobody asks for."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at, self._depth = data, 0, 0

    def row_group(self) -> RowGroup:
        rows: list[int] = []
        found: list[Chunk] = []

        def of_group(number: int, kind: int) -> bool:
            if number == _COLUMNS and kind in _LISTS:
                found[:] = [self._chunk() for _ in range(self.list_of(_STRUCT))]
                return True
            if number == _NUM_ROWS and kind in _INTEGERS:
                rows[:] = [self._integer()]
                return True
            return False

        self.struct(of_group)
        return RowGroup(rows[0] if rows else 0, found)

    def _chunk(self) -> Chunk:
        sizes: dict[int, int] = {}

        def of_metadata(number: int, kind: int) -> bool:
            if number not in (_NUM_VALUES, _UNCOMPRESSED) or kind not in _INTEGERS:
                return False
            sizes[number] = self._integer()
            return True

        def of_chunk(number: int, kind: int) -> bool:
            if number != _META_DATA or kind != _STRUCT:
                return False
            self.struct(of_metadata)
            return True

        self.struct(of_chunk)
        return Chunk(sizes.get(_NUM_VALUES, 0), sizes.get(_UNCOMPRESSED, 0))

    def struct(self, take: Callable[[int, int], bool]) -> None:
        """Gives number and kind of each field to `take`, which says whether it has read it."""
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError("structs that are too deep")
        number = 0
        while head := self._byte():
            number = number + (head >> 4) if head >> 4 else self._integer()
            if not take(number, head & 15):
                self._skip(head & 15)
        self._depth -= 1

    def list_of(self, kind: int) -> int:
        """The number of elements of a list of this kind."""
        found, size = self._list()
        if found != kind and size:
            raise ValueError("a list of another kind")
        return size

    def _list(self) -> tuple[int, int]:
        head = self._byte()
        return head & 15, self._unsigned() if head >> 4 == 15 else head >> 4  # of a list that is longer than the footer an element is cut

    def _skip(self, kind: int, in_list: bool = False) -> None:
        if kind in (_TRUE, _FALSE):
            self._at += in_list
        elif kind == _BYTE:
            self._at += 1
        elif kind in _INTEGERS:
            self._unsigned()
        elif kind == _DOUBLE:
            self._at += 8
        elif kind == _BINARY:
            length = self._unsigned()
            self._at += length
        elif kind in _LISTS:
            inner, size = self._list()
            self._depth += 1
            if self._depth > DEEPEST:
                raise ValueError("lists that are too deep")
            for _ in range(size):
                self._skip(inner, True)
            self._depth -= 1
        elif kind == _STRUCT:
            self.struct(lambda number, kind: False)
        else:  # maps, which the format doesn't have, and what is no kind
            raise ValueError("a field of an unknown kind")
        if self._at > len(self._data):
            raise ValueError("a field behind the end")

    def _byte(self) -> int:
        if self._at >= len(self._data):
            raise ValueError("a footer that is cut")
        self._at += 1
        return self._data[self._at - 1]

    def _unsigned(self) -> int:
        value = shift = 0
        while shift < 70:
            byte = self._byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value
            shift += 7
        raise ValueError("a number that is too long")

    def _integer(self) -> int:
        """Signed, which is stored as 0, −1, 1, −2, …"""
        value = self._unsigned()
        return value >> 1 ^ -(value & 1)
