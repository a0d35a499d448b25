"""Limits of the files that the Python readers take.  docs/motions.md lists them; a file beyond one is refused with a sentence.

They are far above what robots and recordings have.  They are low enough that reading a file ends within seconds, and within the memory
of a common machine.  The loader of robot files has limits of its own: src/text/limits.hpp.
"""

from __future__ import annotations

MOTION_BYTES = 2 << 30
"""Bytes of a motion or a table of external wrenches, also from standard input.

Compressed files and archives are measured unpacked, and so are times that are text in Parquet files."""
MOTION_NUMBERS = 1 << 28
"""Numbers that are read from a table, rows × columns; from an NPZ file all that it holds.

They are 2 GiB as doubles: ten hours of 7 joints at 1 kHz with their rates."""
COLUMNS = 1 << 17
"""Columns of a table, or lines of a map of columns: 40,000 joints with their rates."""
WORKBOOK_BYTES = 1 << 28
"""Bytes of an Excel workbook, unpacked.  A cell has some 30 of them, and takes two microseconds to read."""
WORKBOOK_CELLS = 1 << 26
"""Cells of a sheet, empty ones before the last of each row too: a short text may name the last of 16,384 columns in each row."""
EMPTY_ROWS = 1 << 21
"""Rows without cells in a workbook, two sheets of Excel's length: a short text may name a row of any number, and all before it are given."""
LINE_BYTES = 64 << 20
"""Bytes of a line at the beginning of a CSV file, where names are, or of an array of names in an NPZ file."""
YAML_BYTES = 1 << 19
"""Bytes of YAML in a ROS 2 bag: `metadata.yaml`, and what databases and channels say of the quality of service.  Its parser takes some ten seconds a megabyte."""
TOML_BYTES = 4 << 20
"""Bytes of a file that people write: load cases, components, sweeps, poses, maps of columns."""
TOML_DEPTH = 32
"""Names with dots between them in one key.  The parser of the standard library takes quadratic time for them."""
NAME_LENGTH = 4096
"""Characters of the name of a column."""
ROBOT_BYTES = 64 << 20
"""Bytes of a robot file that `ksl check` reads.  The largest ones known have some hundred kilobytes; meshes are in files of their own."""
PART_BYTES = 1 << 28
"""Bytes of the mesh of a part, some four million nodes: more than a solver of this kind takes."""
USD_BYTES = 1 << 30
"""Bytes of a USD file, which may hold meshes."""
USD_PRIMS = 1 << 21
"""Prims of a USD stage, those of instances too: instances of instances make any number of a short text."""
USD_LAYERS = 1000
"""Sublayers of a layer of USD, those of sublayers too, each as often as it is named."""
USD_SECONDS = 300
"""Processor seconds that commands give Pixar's library for a stage, where the system can end what takes longer: short texts may ask it for any amount of work."""
HEIGHT_FIELD = 1 << 26
"""Numbers of the height fields of an MJCF file, whose sizes its text or a small picture gives: a few words may ask MuJoCo for any amount of memory."""
TEXTURE = 1 << 26
"""Points of the textures of an MJCF file, likewise: some 200 MB."""
PICTURE = 1 << 25
"""Points of a picture that a mesh file has, unpacked."""
MESH_ARCHIVE = 1 << 28
"""Bytes of a mesh file that is an archive, unpacked."""
MJCF_COPIES = 100_000
"""Elements that `replicate` makes of an MJCF file's, and points of its grids: as many as a model has links."""
ATTRIBUTES = 1000
"""Attributes of one element of a robot file.  The loader reads as many; `ksl check` doesn't look into the values of more."""
NAMESPACE_LENGTH = 1000
"""Bytes of a namespace in a robot file.  Each element has it in its name."""
MESSAGE_LENGTH = 4000
"""Characters of a message; longer ones are shortened in the middle."""
NEAR_NAMES = 2000
"""Known names that a misspelt one is compared with, to say which one may be meant."""


def megabytes(size: int) -> str:
    return f"{size / (1 << 20):.3g} MB" if size >= 1 << 20 else f"{size:,} bytes"
