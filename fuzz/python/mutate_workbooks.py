"""Mutations of Excel workbooks and of MATLAB files: of what they hold, and of how it is packed."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from random import Random

import atheris
import numpy as np
import scipy.io
from mutate import BYTES, NAMES, of_xml
from mutate_tables import ARRAYS, another_column, zipped

COMPRESSED = 15
"""The type of an element of a MATLAB file that is compressed."""
MOST_UNPACKED = 1 << 20
_random = Random(1)


def of_xlsx(data: bytes, most: int, seed: int) -> bytes:
    """Elements of a sheet, or of another part, are changed; parts are removed, renamed, and packed again."""
    _random.seed(seed)
    if seed % BYTES:
        try:
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                parts = [(each.filename, archive.read(each)) for each in archive.infolist() if each.file_size < MOST_UNPACKED]
            _change_part(parts, seed)
            made = zipped(parts)
            if len(made) <= most:
                return made
        except Exception:  # of what is no archive any more
            pass
    return atheris.Mutate(data, most)


def _change_part(parts: list[tuple[str, bytes]], seed: int) -> None:
    """Mostly of a sheet, whose cells are what is read."""
    sheets = [i for i, (name, _) in enumerate(parts) if "sheet" in name.lower()]
    at = _random.choice(sheets) if sheets and _random.randrange(4) else _random.randrange(len(parts))
    name, inside = parts[at]
    way = _random.randrange(16)
    if way == 0:
        del parts[at]
    elif way == 1:
        parts[at] = (_random.choice([other for other, _ in parts]), inside)
    elif way == 2:
        parts[at] = (name, atheris.Mutate(inside, len(inside) + 8))
    else:
        parts[at] = (name, of_xml(inside, len(inside) + 400, seed * BYTES + 1))  # by elements


def of_mat(data: bytes, most: int, seed: int) -> bytes:
    """Variables are added, removed, repeated, changed; or bytes of the file are."""
    _random.seed(seed)
    if seed % BYTES and len(data) > 128:
        variables = _variables(data[128:])
        for _ in range(_random.randint(1, 3)):
            _change_variable(variables)
        made = data[:128] + b"".join(_packed(each) if _random.randrange(4) == 0 else each for each in variables)
        if len(made) <= most:
            return made
    return atheris.Mutate(data, most)


def _variables(data: bytes) -> list[bytes]:
    """The elements of a file, unpacked."""
    found: list[bytes] = []
    while len(data) >= 8:
        kind, size = struct.unpack("<II", data[:8])
        element, data = data[: 8 + size], data[8 + size :]
        if kind == COMPRESSED:
            try:
                element = zlib.decompressobj().decompress(element[8:], MOST_UNPACKED)
            except zlib.error:
                pass
        found.append(element)
    return found


def _packed(element: bytes) -> bytes:
    inside = zlib.compress(element)
    return struct.pack("<II", COMPRESSED, len(inside)) + inside


def _change_variable(variables: list[bytes]) -> None:
    way = _random.randrange(8)
    if way < 2 or not variables:
        variables.insert(_random.randint(0, len(variables)), _variable())
        return
    at = _random.randrange(len(variables))
    if way == 2:
        del variables[at]
    elif way == 3:
        variables[at] = _variable()
    elif way == 4:
        variables.append(variables[at])
    else:  # flags, shape and name are in the first bytes
        cut = _random.choice([8, 64, len(variables[at])])
        variables[at] = variables[at][:8] + atheris.Mutate(variables[at][8:cut], max(cut - 8, 8)) + variables[at][cut:]


def _variable() -> bytes:
    """A variable as MATLAB has them, of eight samples or not."""
    x = another_column(8)
    y = np.column_stack([x, x])
    made = _random.choice(
        [
            x,
            x[:, None],
            x,
            y,
            y.T,
            x.astype(np.float32),
            x.astype(np.int16),
            x + 1j,
            x[:1],
            x[:0],
            y.reshape(2, 4, 2),
            "hip",
            ["hip", "slide"],
            [["hip"], ["slide", "x"]],
            {"a": x},
        ]
        + [np.array(["hip", "slide"], dtype=object), np.array([x, "hip"], dtype=object), np.array([_random.choice(NAMES), 1.0], dtype=object)]
    )
    name = "".join(c for c in _random.choice([*ARRAYS, *NAMES]) if c.isalnum() and c.isascii())[:20]
    out = io.BytesIO()
    scipy.io.savemat(out, {name if name[:1].isalpha() else "x": made}, do_compression=False)
    return out.getvalue()[128:]
