"""How large the files may be that the Python readers take.  docs/motions.md lists them; what is larger is refused by a sentence.

They are far above what robots and recordings have, and low enough that reading ends within seconds and within the memory
of a common machine.  Robot files have limits of their own in the loader.
"""

from __future__ import annotations

MOTION_BYTES = 2 << 30
"""Of a motion or of external wrenches, also from standard input; of compressed files and archives the size when unpacked."""
MOTION_NUMBERS = 1 << 28
"""Rows × columns that are read from a table: 2 GiB as doubles, ten hours of 7 joints at 1 kHz with their rates."""
COLUMNS = 1 << 17
"""Of a table, or of a map of columns: 40,000 joints with their rates."""
TOML_BYTES = 4 << 20
"""Of files that people write: load cases, components, sweeps, poses, maps of columns."""
TOML_DEPTH = 32
"""Names with dots between them in a key: the parser of the standard library takes quadratic time for them."""
NAME_LENGTH = 4096
"""Characters of a name of a column."""
ROBOT_BYTES = 64 << 20
"""Of a robot file that `ksl check` reads.  The largest ones known have some hundred kilobytes; meshes are in files of their own."""
MESSAGE_LENGTH = 4000
"""Characters of an error; longer ones are shortened in their middle."""
NEAR_NAMES = 2000
"""So many names of about the same length are compared with a misspelt one, to say which one may be meant."""


def megabytes(size: int) -> str:
    return f"{size / (1 << 20):.3g} MB" if size >= 1 << 20 else f"{size:,} bytes"
