"""Text of Arrow that is no UTF-8, as damage makes it."""

import numpy as np
import pyarrow as pa


def damaged_text(texts):
    """An array of these texts, the last of which begins with a byte that no character begins with."""
    data = [text.encode() for text in texts]
    data[-1] = b"\xba" + data[-1][1:]
    ends = np.cumsum([0, *map(len, data)]).astype(np.int32)
    return pa.Array.from_buffers(pa.string(), len(data), [None, pa.py_buffer(ends.tobytes()), pa.py_buffer(b"".join(data))])
