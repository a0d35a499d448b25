"""Elements of MATLAB's files of version 5 to 7.2.  scipy's reader ends the process where an element has a type that MATLAB doesn't know.

A file is a header of 128 bytes and an element for each variable, perhaps compressed.  That of an array holds others: flags, shape, name, contents.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ksl.base import limits
from ksl.base.errors import MotionError


HEADER_BYTES = 128
MATRIX, COMPRESSED = 14, 15
"""Types of elements."""
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
CLASSES = [
    "",
    "cell",
    "struct",
    "object",
    "char",
    "sparse",
    "double",
    "single",
    *(f"{s}int{n}" for n in (8, 16, 32, 64) for s in ("", "u")),
    "function",
    "opaque",
]
"""MATLAB's classes of arrays, by their numbers.  Opaque ones are objects: string, datetime, timetable."""
COMPLEX, LOGICAL = 8, 2
"""Bits of an array's flags."""


@dataclass(frozen=True)
class Variable:
    name: str
    kind: str
    """MATLAB's class."""
    shape: tuple[int, ...]
    is_complex: bool
    contents: list[tuple[int, memoryview]]
    """Types and bytes of the elements that follow the name."""
    order: str
    """The order of bytes: "<" or ">"."""

    def numbers(self) -> NDArray[np.float64]:
        """The real numbers of an array.  Raises ValueError if there are more or fewer than its shape says."""
        kind, data = self.contents[0]
        x = np.frombuffer(data, np.dtype(self.order + NUMBERS[kind]))
        if x.size != math.prod(self.shape):
            raise ValueError(f"{x.size} numbers of {math.prod(self.shape)}")
        return x.reshape(self.shape, order="F").astype(np.float64)

    def rows(self) -> list[str]:
        """The rows of an array of characters, without blanks at their ends; an array of texts has one dimension more than they.  Raises ValueError as `numbers`."""
        kind, data = self.contents[0] if self.contents else (2, memoryview(b""))
        encoding = TEXTS[kind]
        text = bytes(data).decode(encoding + ("" if encoding in ("latin-1", "utf-8") else "-le" if self.order == "<" else "-be"))
        letters = np.array(list(text)).reshape(self.shape, order="F")
        return ["".join(row).rstrip() for row in letters.reshape(-1, self.shape[-1])] if text else []  # there may be billions of rows of no length

    def cells(self) -> Iterator[Variable]:
        for kind, data in self.contents:
            yield _variable(kind, data, self.order)


def variables(file: str, data: bytes) -> list[Variable]:
    """The variables of a file.  Raises MotionError where it unpacks to more than is read, and ValueError, KeyError or struct.error where it is damaged."""
    order = {b"IM": "<", b"MI": ">"}[data[126:HEADER_BYTES]]
    found: list[Variable] = []
    left = limits.MOTION_BYTES
    for kind, inside in _elements(memoryview(data)[HEADER_BYTES:], order):
        if kind == COMPRESSED:
            unpacked = _unpacked(inside, left)
            left -= len(unpacked)
            if left < 0:
                raise MotionError(
                    f"{file}: unpacked it is larger than {limits.megabytes(limits.MOTION_BYTES)}, the most that is read; save fewer samples, or fewer variables"
                )
            kind, inside = next(_elements(memoryview(unpacked), order))
        made = _variable(kind, inside, order)
        if made.name:  # what belongs to objects has none
            found.append(made)
    return found


def _unpacked(packed: memoryview, most: int) -> bytes:
    try:
        return zlib.decompressobj().decompress(packed, most + 1)
    except zlib.error as e:
        raise ValueError(str(e)) from None


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Types and bytes.  Small ones have both in eight bytes; all but compressed ones are filled to eight."""
    at = 0
    while at < len(data):
        kind, size = struct.unpack_from(f"{order}II", data, at)
        begin = at + 8
        if kind >> 16:
            kind, size, begin = kind & 0xFFFF, kind >> 16, at + 4
        end = begin + size
        if end > len(data) or (begin == at + 4 and size > 4):
            raise ValueError("an element that is longer than the file")
        yield kind, data[begin:end]
        at = max(end if kind == COMPRESSED else -(-end // 8) * 8, at + 8)


def _variable(kind: int, data: memoryview, order: str) -> Variable:
    if kind != MATRIX:
        raise ValueError(f"an element of type {kind} in the place of an array")
    inside = _elements(data, order)
    flags = next(inside, None)
    if flags is None:  # [] in a cell
        return Variable("", "double", (0, 0), False, [], order)
    (bits,) = struct.unpack_from(f"{order}I", flags[1])
    of_class = CLASSES[bits & 0xFF] if 0 < bits & 0xFF < len(CLASSES) else ""
    if not of_class:
        raise ValueError(f"class {bits & 0xFF}")
    shape: tuple[int, ...] = ()
    if of_class != "opaque":
        sizes = next(inside)[1]
        shape = struct.unpack(f"{order}{len(sizes) // 4}i", sizes)
        if len(shape) < 2 or min(shape) < 0:
            raise ValueError(f"the shape {shape}")
    name = bytes(next(inside)[1]).decode("ascii")
    more = bits >> 8
    held = list(inside) if of_class in ("cell", "char") or of_class in CLASSES[6:16] else []
    return Variable(name, "logical" if more & LOGICAL else of_class, shape, bool(more & COMPLEX), held, order)
