"""What compressed bytes give, piece by piece, so that a file that unpacks to gigabytes is found before it takes the memory."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator
from typing import Any, BinaryIO

PIECE = 1 << 20


def of_bz2(packed: bytes) -> Iterator[bytes]:
    from bz2 import BZ2Decompressor

    return _pieces(BZ2Decompressor, packed)


def of_lz4(packed: bytes) -> Iterator[bytes]:
    from lz4.frame import LZ4FrameDecompressor

    return _pieces(LZ4FrameDecompressor, packed)


def of_zstd(packed: BinaryIO | bytes) -> Iterator[bytes]:
    """The contents of all frames, whatever sizes they claim."""
    import zstandard

    source = io.BytesIO(packed) if isinstance(packed, bytes) else packed
    with zstandard.ZstdDecompressor().stream_reader(source, read_across_frames=True, closefd=False) as reader:
        while piece := reader.read(PIECE):
            yield piece


def size(pieces: Iterable[bytes], most: int) -> int:
    """Bytes of all pieces; counting stops where they are more than `most`."""
    total = 0
    for piece in pieces:
        total += len(piece)
        if total > most:
            break
    return total


def _pieces(decompressor: Callable[[], Any], packed: bytes) -> Iterator[bytes]:
    """By decompressors like those of the bz2 module; streams may follow each other.  Raises EOFError where the last one is cut."""
    while packed:
        stream = decompressor()
        piece = stream.decompress(packed, PIECE)
        yield piece
        while not stream.eof:
            if stream.needs_input and not piece:
                raise EOFError
            piece = stream.decompress(b"", PIECE)
            yield piece
        packed = stream.unused_data or b""
