"""How much ROS bags unpack to.  The library that reads them unpacks chunks, files and messages whole, whatever comes out."""

from __future__ import annotations

import bz2
import sqlite3
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.motions.files import unpacking
from ksl.motions.files.bag_database import DATABASE, check_database, check_yaml
from ksl.motions.files.mcap_chunks import MAGIC, RECORD, bytes_of_channels, chunks_from, size_of_chunk, unpacked_size

if TYPE_CHECKING:
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

ZSTD = b"\x28\xb5\x2f\xfd"
SKIPPABLE = b"\x2a\x4d\x18"
"""Bytes 1 to 3 of frames of zstd that hold nothing, and may come first."""
MCAP = b"\x89MCAP"


def too_large(file: str, tool: str) -> MotionError:
    return MotionError(f"{file}: unpacked it is larger than {limits.megabytes(limits.MOTION_BYTES)}, the most that is read; cut it with `{tool}`")


def limit_chunks(file: str, bag: Reader1) -> None:
    """Lets an open ROS 1 bag unpack no more than is read.  A chunk that is unpacked again, for messages of other times, counts again."""
    from lz4.frame import decompress as of_lz4

    left = limits.MOTION_BYTES

    def limited(pieces: Callable[[bytes], Iterable[bytes]]) -> Callable[[bytes], bytes]:
        def unpack(packed: bytes) -> bytes:
            nonlocal left
            parts = []
            for piece in pieces(packed):
                left -= len(piece)
                if left < 0:
                    raise too_large(file, "rosbag filter")
                parts.append(piece)
            return b"".join(parts)

        return unpack

    by_library = {bz2.decompress: limited(unpacking.of_bz2), of_lz4: limited(unpacking.of_lz4)}
    for place, chunk in bag.chunks.items():
        bag.chunks[place] = chunk._replace(decompressor=by_library.get(chunk.decompressor, chunk.decompressor))


def check_files(folder: str, files: Iterable[Path]) -> None:
    """Raises MotionError if files of a ROS 2 bag unpack to more than is read: those that are compressed whole, and chunks of MCAP.  Checks databases.

    Files are told by their first bytes, since a bag may give them any names.  Errors of damaged files are those of the libraries.
    """
    left = limits.MOTION_BYTES
    for path in files:
        with path.open("rb") as source:
            first = source.read(len(DATABASE))
            source.seek(0)
            if first.startswith(ZSTD) or first[1:4] == SKIPPABLE:
                left -= _unpacked(folder, source, left)
            elif first.startswith(MCAP):
                left -= unpacked_size(source, chunks_from(source, MAGIC), left)
                check_yaml(folder, path.name, bytes_of_channels(source))
            elif path.name == "metadata.yaml":
                check_yaml(folder, path.name, path.stat().st_size)
            elif first == DATABASE:
                check_database(folder, path)
        if left < 0:
            raise too_large(folder, "ros2 bag convert")


def _unpacked(folder: str, source: BinaryIO, most: int) -> int:
    """The size of a file that is compressed whole; counting stops where it is more than `most`.  A database in it is checked."""
    pieces = unpacking.of_zstd(source)
    first = next(pieces, b"")
    if not first.startswith(DATABASE):
        return len(first) + unpacking.size(pieces, most - len(first))
    with tempfile.TemporaryDirectory() as other:
        with (path := Path(other) / "bag.db3").open("wb") as out:
            size = 0
            while first and size <= most:
                size += out.write(first)
                first = next(pieces, b"")
        if size <= most:
            check_database(folder, path)
    return size


def check_index(folder: str, bag: Reader2) -> None:
    """Raises MotionError if chunks of MCAP files that the index of an open ROS 2 bag names unpack to more than is read.

    The index may name a chunk often, or bytes that are none of the file's chunks; the library reads by it alone.
    """
    left = limits.MOTION_BYTES
    for storage in getattr(bag.storage, "storages", [bag.storage]):
        for chunk in getattr(storage, "chunks", ()):
            storage.bio.seek(chunk.chunk_start_offset + RECORD + 40 + len(chunk.compression))
            if chunk.compressed_size > limits.MOTION_BYTES:
                raise too_large(folder, "ros2 bag convert")
            packed = storage.bio.read(chunk.compressed_size)
            left -= size_of_chunk(chunk.compression.encode(), packed, left)
            if left < 0:
                raise too_large(folder, "ros2 bag convert")


def check_messages(folder: str, files: Iterable[Path]) -> None:
    """Refuses a bag whose messages, compressed one by one, are too large unpacked."""
    left = limits.MOTION_BYTES
    for path in files:
        if path.suffix != ".db3":
            raise MotionError(f"{folder}: messages are compressed one by one, which is read from .db3 files alone; use `ros2 bag convert` without compression")
        database = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)
        try:
            for (data,) in database.execute("SELECT data FROM messages"):
                left -= unpacking.size(unpacking.of_zstd(bytes(data)), left)
                if left < 0:
                    raise too_large(folder, "ros2 bag convert")
        finally:
            database.close()
