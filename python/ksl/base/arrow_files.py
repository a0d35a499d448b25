"""Files for Arrow, whose names need not be UTF-8."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import pyarrow as pa


def arrow_file(path: str | os.PathLike[str], mode: Literal["rb", "wb"] = "rb") -> pa.NativeFile:
    """The open file, which the caller closes.  Arrow encodes paths as UTF-8, and refuses those that aren't; bytes it takes as they are.  Raises OSError."""
    import pyarrow as pa

    return pa.OSFile(os.fsencode(path), mode)


def with_text(table: pa.Table) -> pa.Table:
    """The table that is given, if its text is UTF-8.  Raises pyarrow.ArrowInvalid where text in it is no UTF-8: Arrow reads it as it stands, and Python fails where it asks for it."""
    import pyarrow as pa

    for name, column in zip(table.column_names, table.columns, strict=True):
        try:
            column.validate(full=True)
        except pa.ArrowInvalid:
            raise pa.ArrowInvalid(f"column {name!r} holds text that is no UTF-8") from None
    return table
