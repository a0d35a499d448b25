"""Bytes as Arrow's own memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa


def own_memory(data: bytes) -> pa.BufferReader:
    """A reader of memory that is Arrow's own.

    Threads of Arrow may still hold it when the interpreter ends, as it does at once where a motion is refused: they could not release
    an object of Python any more, and the process would abort.
    """
    import pyarrow as pa

    sink = pa.BufferOutputStream()
    sink.write(data)
    return pa.BufferReader(sink.getvalue())
