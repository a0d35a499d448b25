"""NPZ files: `time` and `q` (n, nq), or an array for each column."""

from __future__ import annotations

import zipfile
import zlib
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ksl.errors import MotionError
from ksl.mechanism import Mechanism
from ksl.motions.columns import columns_of
from ksl.motions.recorded import Recorded, count, listed

STATES = ("q", "v", "a")
NAMES = ("joints", "joint_names", "names")
"""Arrays that may say to which joints the columns of q, v and a belong."""


class NpzTable(Recorded):
    """An NPZ file.  `matrices` has q, v and a where the file gives them as (n, nq) and (n, nv)."""

    matrices: dict[str, NDArray[np.float64]]
    joints: list[str]


def npz_table(file: str, source: BinaryIO) -> NpzTable:
    """The arrays of an NPZ file.  Raises MotionError."""
    arrays: dict[str, NDArray[np.generic]] = {}
    try:
        with np.load(source, allow_pickle=False) as archive:
            for name in archive.files:
                try:
                    arrays[name] = archive[name]
                except ValueError as e:
                    if "pickle" not in str(e):
                        raise
                    raise MotionError(f"{file}: array {name!r} holds Python objects; save numbers only") from None  # reading them might run anything
    except MotionError:
        raise
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, NotImplementedError, RuntimeError, MemoryError):
        raise MotionError(f"{file}: is an NPZ file, but truncated or damaged; copy or write it again") from None
    joints = [str(n) for key in NAMES if key in arrays and arrays[key].dtype.kind == "U" for n in arrays.pop(key).ravel()]
    columns: dict[str, NDArray[np.float64]] = {}
    matrices: dict[str, NDArray[np.float64]] = {}
    texts: dict[str, str] = {}
    for name, x in arrays.items():
        if x.dtype.kind not in "fiub":
            columns[name], texts[name] = np.empty(0), str(x.ravel()[0]) if x.size else str(x.dtype)
        elif name in STATES and x.ndim == 2:
            matrices[name] = x.astype(float)
        elif x.ndim == 2 and 1 in x.shape:  # columns as MATLAB users keep them
            columns[name] = x.ravel().astype(float)
        elif x.ndim != 1:
            raise MotionError(f"{file}: array {name!r} has the shape {x.shape}; expected one number for each sample, or q, v and a with a row for each sample")
        else:
            columns[name] = x.astype(float)
    _check_lengths(file, {n: len(x) for n, x in (columns | matrices).items() if n not in texts})
    table = NpzTable(file, "NPZ", list(columns), columns, texts=texts)
    table.matrices, table.joints = matrices, joints
    return table


def _check_lengths(file: str, lengths: dict[str, int]) -> None:
    first = next(iter(lengths), None)
    for name, n in lengths.items():
        if first is not None and n != lengths[first]:
            raise MotionError(f"{file}: array {name!r} has {n} samples, but {first!r} has {lengths[first]}; give as many of each")


def with_matrices(table: NpzTable, model: Mechanism) -> NpzTable:
    """The table with a column for each column of q, v and a, which are in the order of the model's joints, or of the file's list of them."""
    if not table.matrices:
        return table
    joints = model.joints[: len(model.joint_names)]
    groups = [[c for j in joints for c in columns_of(j)[order]] for order in range(3)]
    if table.joints:
        groups = [[joint + end for joint in table.joints] for end in ("", ".v", ".a")]
        whose = f"the file lists {len(table.joints)} joints"
    columns = dict(table.columns)
    for name, group in zip(STATES, groups):
        if name not in table.matrices:
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
        which = ", ".join(n for n in STATES if n in table.matrices)
        table.notes.append(f"columns of {which} are taken in the order of the robot's joints: {listed(model.joint_names)}")
    return table
