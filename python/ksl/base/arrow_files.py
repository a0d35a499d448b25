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
