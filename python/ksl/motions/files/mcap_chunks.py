"""How large the chunks of an MCAP file are when they are unpacked, by what the chunks themselves say and not by the file's index."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator
from typing import BinaryIO

from ksl.motions.files import unpacking

MAGIC = 8
RECORD = 9
"""Bytes before the contents of a record: what it is, and its length."""
FOOTER = RECORD + 20
CHANNEL = 0x04
CHUNK = 0x06
LAST = 0x02
LONGEST_NAME = 100
"""The longest name of a compression: `zstd`, `lz4`, or nothing."""


def summary_start(source: BinaryIO) -> int:
    """Where the summary is, as the footer says; 0 where there is none.  Raises struct.error or OSError for damaged files."""
    source.seek(-(FOOTER + MAGIC) + RECORD, io.SEEK_END)
    return _number(source)


def chunks_from(source: BinaryIO, start: int) -> Iterator[int]:
    """Where the contents of each chunk are, in the records from `start` up to a footer or the end.  Raises EOFError for a record beyond the end."""
    for kind, place, _ in _records(source, start):
        if kind == CHUNK:
            yield place


def bytes_of_channels(source: BinaryIO) -> int:
    """Bytes of the records of topics, from the file's beginning or from its summary, whichever are more.  Raises as `chunks_from`."""
    starts = {MAGIC, summary_start(source) or MAGIC}
    return max(sum(length for kind, _, length in _records(source, start) if kind == CHANNEL) for start in starts)


def _records(source: BinaryIO, start: int) -> Iterator[tuple[int, int, int]]:
    """Kind, place of the contents, and length of each record up to a footer or the end."""
    end = source.seek(0, io.SEEK_END)
    place = start
    while place + RECORD <= end:
        source.seek(place)
        kind, length = struct.unpack("<BQ", source.read(RECORD))
        if kind == LAST:
            return
        if place + RECORD + length > end:
            raise EOFError
        yield kind, place + RECORD, length
        place += RECORD + length


def unpacked_size(source: BinaryIO, chunks: Iterable[int], most: int) -> int:
    """Bytes of these chunks together, unpacked; counting stops where they are more than `most`.

    Raises struct.error, EOFError, ValueError, or an error of the compression, for damaged files.
    """
    total = 0
    for chunk in chunks:
        total += _size(source, chunk, most - total)
        if total > most:
            break
    return total


def _size(source: BinaryIO, chunk: int, most: int) -> int:
    end = source.seek(0, io.SEEK_END)
    source.seek(chunk + 16)  # after two times
    said, _, length = struct.unpack("<QII", source.read(16))
    if length > LONGEST_NAME:
        raise ValueError(length)
    compression = source.read(length)
    packed = _number(source)
    if source.tell() + packed > end:
        raise EOFError
    if compression not in (b"zstd", b"lz4"):
        return packed
    return max(int(said), size_of_chunk(compression, source.read(packed), most))  # the libraries allocate what the chunk says, or what comes out


def size_of_chunk(compression: bytes, packed: bytes, most: int) -> int:
    """Bytes to which a chunk unpacks, or which its frame says; counting stops where they are more than `most`."""
    if compression == b"zstd":
        import zstandard

        return max(zstandard.frame_content_size(packed), unpacking.size(unpacking.of_zstd(packed), most))
    return unpacking.size(unpacking.of_lz4(packed), most) if compression == b"lz4" else len(packed)


def _number(source: BinaryIO) -> int:
    (number,) = struct.unpack("<Q", source.read(8))
    return int(number)
