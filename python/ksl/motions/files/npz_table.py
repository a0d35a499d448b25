"""NPZ files: `time` and `q` (n, nq), or an array for each column."""

from __future__ import annotations

import math
import struct
import sys
import zipfile
import zlib
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from types import MappingProxyType
from typing import BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.base.input_files import failed_read
from ksl.base.words import count, listed
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import Array
from ksl.motions.columns.columns_used import STATES
from ksl.motions.columns.recorded import Recorded, check_columns, check_names, check_numbers
from ksl.motions.columns.time_column import TIME

NUMBERS = "fiub"
"""Kinds of NumPy's types that are numbers."""
NAMES = ("joints", "joint_names", "names")
"""Arrays that may say to which joints the columns of q, v and a belong."""
SMALL = 512
"""Bytes of an array that is kept when its header is read: there may be 100,000 of them."""
HEADER_BYTES = 12 + 10_000
"""So many bytes of an array are looked at before it is loaded: NumPy reads no longer headers."""


OTHERS = {"O": "Python objects", "c": "complex numbers", "V": "records", "M": "dates", "m": "durations", "U": "text", "S": "text"}
"""What arrays of the other kinds of NumPy's types hold."""


class NpzTable(Recorded):
    """An NPZ file.  `matrices` has q, v and a where the file gives them as (n, nq) and (n, nv)."""

    matrices: dict[str, NDArray[np.float64]]
    joints: list[str]
    kinds: Mapping[str, str] = MappingProxyType({})
    """What arrays hold that can't be columns."""

    unusable: Mapping[str, tuple[str, str]] = MappingProxyType({})
    """Arrays that are no columns: what they are, and what to do."""

    def what_is_in(self, name: str) -> str:
        return self.kinds.get(name, "text")

    def holding(self, name: str) -> str:
        return self.unusable[name][0] if name in self.unusable else super().holding(name)

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        for name in names:
            if name in self.unusable:
                raise MotionError(f"{self.file}: array {name!r} {'; '.join(self.unusable[name])}")
        return super().read(names, time)


@dataclass(frozen=True)
class _Announced:
    """What an array of the file says of itself, before it is loaded."""

    name: str
    size: int
    dtype: np.dtype[np.generic]
    first: str
    """The array's first value as text, if it is short, or else its type; empty for numbers."""
    small: NDArray[np.generic] | None = None
    """The array, if it is small: then it is not opened a second time."""

    @property
    def holds_numbers(self) -> bool:
        return self.dtype.kind in NUMBERS

    @property
    def lists_names(self) -> bool:
        return self.dtype.kind in "US" and self.name in NAMES


def npz_table(file: str, source: BinaryIO) -> NpzTable:
    """The arrays of an NPZ file.  Raises MotionError: for more numbers or names than are read, before any of them is loaded.

    Of text, lists of joints are loaded, and of the rest the first value is kept for messages.
    """
    try:
        with source, zipfile.ZipFile(source) as archive:
            found = [_announced(file, archive, member) for member in dict.fromkeys(archive.namelist())]
            _check_sizes(file, found)
            arrays = {a.name: _loaded(archive, a).astype(float, copy=False) for a in found if a.holds_numbers}
            lists = {a.name: _texts(_loaded(archive, a)) for a in found if a.lists_names}
    except MotionError:
        raise
    except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, TypeError, ValueError, OverflowError, RuntimeError, MemoryError) as e:
        if failed := failed_read(e):
            raise failed from None
        raise MotionError(f"{file}: is an NPZ file, but truncated or damaged; copy or write it again") from None
    table = table_of_arrays(file, "NPZ", {a.name: a.first for a in found if a.name not in lists}, arrays, lists)
    table.kinds = {a.name: OTHERS[a.dtype.kind] for a in found if a.dtype.kind in OTHERS}
    return table


def table_of_arrays(
    file: str, form: str, others: dict[str, str], arrays: dict[str, NDArray[np.float64]], lists: dict[str, list[str]], squares_are_clear: bool = True
) -> NpzTable:
    """A table of arrays by their names.  others: {name: its first value or type} of all but lists of names, in order; those without numbers are texts.

    Matrices other than q, v and a, with a row for each sample, are columns NAME[0], NAME[1] and so on.  Arrays that are no columns stay under their names:
    who wants one is refused.  squares_are_clear: rows are samples also where a matrix has as many columns.
    Raises MotionError for q, v, a and times of different lengths.
    """
    n, by = _samples({name: arrays[name].shape for name in others if name in arrays})
    columns: dict[str, NDArray[np.float64]] = {}
    matrices: dict[str, NDArray[np.float64]] = {}
    texts: dict[str, str] = {}
    unusable: dict[str, tuple[str, str]] = {}
    groups: dict[str, list[str]] = {}
    for name, first in others.items():
        if name not in arrays:
            columns[name], texts[name] = np.empty(0), first
            continue
        x = arrays[name]
        if name in STATES and x.ndim == 2:
            fault = _of_another_length(name, x.shape, by, n) or (None if squares_are_clear else _square(x))
            if fault:
                raise MotionError(f"{file}: array {name!r} {'; '.join(fault)}")
            matrices[name] = x
            continue
        x = x.ravel() if x.ndim == 2 and 1 in x.shape else x  # columns as MATLAB users keep them
        if x.ndim == 1:
            columns[name], fault = x, _of_another_length(name, x.shape, by, n)
        elif x.ndim == 2 and len(x) == n and (squares_are_clear or not _square(x)):
            check_columns(file, len(columns) + x.shape[1])  # one without rows may have billions
            groups[name] = [f"{name}[{k}]" for k in range(x.shape[1])]
            columns |= dict(zip(groups[name], x.T))
            continue
        else:
            columns[name], fault = np.empty(0), _no_column(x.shape)
        if fault:
            unusable[name] = fault
    table = NpzTable(file, form, list(columns), columns, texts=texts, groups=groups)
    table.matrices, table.joints, table.unusable = matrices, _listed_joints(file, lists), unusable
    return table


def _samples(shapes: dict[str, tuple[int, ...]]) -> tuple[int, str]:
    """How many samples a file has, and the array that says it: the times, or q, v or a, or else the first of those of which most are as long."""
    lengths = {name: math.prod(shape) if len(shape) == 2 and 1 in shape and name not in STATES else shape[0] for name, shape in shapes.items() if shape}
    states = [name for name in STATES if len(shapes.get(name, ())) == 2]
    often = Counter(lengths.values())
    by = next((name for name in (TIME, *states) if name in lengths), None) or max(lengths, key=lambda name: (often[lengths[name]], lengths[name]), default="")
    return lengths.get(by, 0), by


def _of_another_length(name: str, shape: tuple[int, ...], by: str, n: int) -> tuple[str, str] | None:
    """What is wrong with an array whose length is not that of the samples, and what to do."""
    if shape[0] == n:
        return None
    lies = len(shape) == 2 and shape[1] == n
    return f"has {shape[0]} samples, but {by!r} has {n}", f"{name!r} has a column for each sample: transpose it" if lies else "give as many of each"


def _square(x: NDArray[np.float64]) -> tuple[str, str] | None:
    if x.shape[0] != x.shape[1]:
        return None
    return f"is {x.shape[0]} × {x.shape[1]}", "whether its rows or its columns are the samples can't be told: give more samples, or a variable for each joint"


def _no_column(shape: tuple[int, ...]) -> tuple[str, str]:
    return f"has the shape {shape}", "expected one number for each sample, or q, v and a with a row for each sample"


def _listed_joints(file: str, lists: dict[str, list[str]]) -> list[str]:
    """The joints of a file's list of them; of several, which must be the same."""
    named = [(key, lists[key]) for key in NAMES if lists.get(key)]
    for key, joints in named:
        if joints != named[0][1]:
            raise MotionError(f"{file}: arrays {named[0][0]!r} and {key!r} list different joints; remove one")
        twice = next((n for n, k in Counter(joints).items() if k > 1), None)
        if twice is not None:
            raise MotionError(f"{file}: array {key!r} lists {twice!r} more than once; give each joint once, in the order of the columns")
    return named[0][1] if named else []


def _announced(file: str, archive: zipfile.ZipFile, member: str) -> _Announced:
    """The header of an array.  Raises MotionError for what is never loaded, and ValueError if the array is damaged."""
    name, inside = member.removesuffix(".npy"), archive.getinfo(member)
    if inside.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # the others unpack more at once than they are asked for
        raise MotionError(f"{file}: array {name!r} is compressed by a method that NumPy doesn't write; save it by numpy.savez_compressed")
    with archive.open(inside) as opened:
        data = opened.read(HEADER_BYTES)
    shape, fortran, dtype, begin = _header(data[: 10 + int.from_bytes(data[8:10], "little")] if data[6:8] == b"\x01\x00" else data)
    if dtype.hasobject:  # reading them might run anything
        if name in STATES:
            raise MotionError(f"{file}: array {name!r} holds Python objects; save numbers only")
        return _Announced(name, 0, dtype, str(dtype))
    size = math.prod(shape)
    if min(shape, default=0) < 0 or begin + size * dtype.itemsize > inside.file_size:
        raise ValueError("an array that announces more than there is")
    if dtype.kind in NUMBERS:
        small = None
        if inside.file_size <= SMALL:
            small = np.frombuffer(data, dtype, size, begin).reshape(shape, order="F" if fortran else "C") if size else np.empty(shape, dtype)
        return _Announced(name, size, dtype, "", small)
    value = data[begin : begin + dtype.itemsize]
    short = 0 < len(value) == dtype.itemsize
    return _Announced(name, size, dtype, _texts(np.frombuffer(value, dtype, 1))[0] if short else str(dtype))


def _texts(x: NDArray[np.generic]) -> list[str]:
    """An array of text.  Raises ValueError for characters that Unicode doesn't have: NumPy makes strings of them that Python can't use."""
    if x.dtype.kind == "U" and x.size and int(np.frombuffer(x.tobytes(), x.dtype.byteorder.replace("|", "=") + "u4").max(initial=0)) > sys.maxunicode:
        raise ValueError("no text")
    return [n.decode("utf-8", "backslashreplace") if isinstance(n, bytes) else str(n) for n in x.ravel()]


@lru_cache(maxsize=64)
def _header(data: bytes) -> tuple[tuple[int, ...], bool, np.dtype[np.generic], int]:
    """Shape, order, type and where the numbers begin, of the bytes with which an array begins.  Raises ValueError."""
    head = BytesIO(data)
    try:  # versions 2 and 3 differ in the encoding of names inside of a type
        version = npy.read_magic(head)
        if version not in ((1, 0), (2, 0), (3, 0)):
            raise ValueError(f"version {version}")
        shape, fortran, dtype = npy.read_array_header_1_0(head) if version == (1, 0) else npy.read_array_header_2_0(head)
    except Exception as e:  # what is no shape or no type raises errors of many kinds
        raise ValueError(str(e)) from None
    return shape, fortran, dtype, head.tell()


def _check_sizes(file: str, arrays: list[_Announced]) -> None:
    """Raises MotionError for more than is read."""
    check_numbers(file, sum(a.size for a in arrays if a.holds_numbers))
    for a in arrays:
        if not a.lists_names:
            continue
        check_columns(file, a.size)
        if a.size * a.dtype.itemsize > limits.LINE_BYTES:
            holds, most = (limits.megabytes(n) for n in (a.size * a.dtype.itemsize, limits.LINE_BYTES))
            raise MotionError(f"{file}: array {a.name!r} holds {holds}; at most {most} of names are read")


def _loaded(archive: zipfile.ZipFile, array: _Announced) -> NDArray[np.generic]:
    if array.small is not None:
        return array.small.copy()
    with archive.open(f"{array.name}.npy") as opened:
        x: NDArray[np.generic] = npy.read_array(opened, allow_pickle=False)
        return x


def with_matrices(table: NpzTable, model: Mechanism, ignored: Collection[str] = ()) -> NpzTable:
    """The table with a column for each column of q, v and a, which are in the order of the model's joints, or of the file's list of them.

    ignored: which of the three are left out.
    """
    if not table.matrices:
        return table
    check_names(table.head, table.joints)
    joints = model.joints[: len(model.joint_names)]
    groups = [[c for j in joints for c in columns_of(j)[order]] for order in range(3)]
    if table.joints:
        groups = [[joint + end for joint in table.joints] for end in ("", ".v", ".a")]
        whose = f"the file lists {len(table.joints)} joints"
    columns = dict(table.columns)
    for name, group in zip(STATES, groups):
        if name not in table.matrices or name in ignored:
            table.groups |= {name: []} if name in table.matrices else {}
            continue
        matrix = table.matrices[name]
        if matrix.shape[1] != len(group):
            expected = whose if table.joints else f"{model.name} has {len(group)}: {listed(group)}"
            raise MotionError(f"{table.file}: array {name!r} has {count(matrix.shape[1], 'column')}, but {expected}")
        for i, column in enumerate(group):
            if column in columns:
                raise MotionError(f"{table.file}: column {column!r} is given twice, by {name!r} and by an array of its own; remove one")
            columns[column] = np.ascontiguousarray(matrix[:, i])
    table.columns, table.names = columns, list(columns)
    if not table.joints:
        which = ", ".join(n for n in STATES if n in table.matrices and n not in ignored)
        table.notes.append(f"columns of {which} are taken in the order of the robot's joints: {listed(model.joint_names)}")
    return table
