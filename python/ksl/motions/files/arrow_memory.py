"""Memory that Arrow allocates itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa


def own_memory(data: bytes) -> pa.BufferReader:
    """A reader of a copy of the bytes, in memory that Arrow allocates.

    When a motion is refused the interpreter may end while threads of Arrow still use the memory.  They could not release an object of
    Python then, and the process would abort.
    """
    import pyarrow as pa

    sink = pa.BufferOutputStream()
    sink.write(data)
    return pa.BufferReader(sink.getvalue())
