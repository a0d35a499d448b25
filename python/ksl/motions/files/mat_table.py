"""MATLAB's files of version 5 to 7.2: `time` and `q` (n, nq), or a variable for each column."""

from __future__ import annotations

import math
from typing import Any, BinaryIO

import numpy as np

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.base.words import listed
from ksl.motions.columns.recorded import check_columns, check_numbers
from ksl.motions.files.npz_table import NAMES, NpzTable, table_of_arrays

NUMBERS = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
"""MATLAB's classes of numbers, as scipy calls them."""
TEXTS = ("char", "cell")
MEND = "save arrays: save('motion.mat', 'time', 'q')"


def mat_table(file: str, source: BinaryIO) -> NpzTable:
    """The variables of a file.  Raises MotionError: for structs and objects too, before any number is loaded."""
    from scipy.io import loadmat, whosmat

    with source:
        try:
            found: list[tuple[str, tuple[int, ...], str]] = whosmat(source)
        except Exception as e:  # scipy lets errors of many types through
            raise _damaged(file, e) from None
        wanted = _wanted(file, found)
        try:
            source.seek(0)
            loaded: dict[str, Any] = loadmat(source, variable_names=list(wanted), mat_dtype=False, squeeze_me=False)
        except MemoryError:
            raise
        except Exception as e:
            raise _damaged(file, e) from None
    for name in wanted:
        if np.iscomplexobj(loaded[name]):
            raise MotionError(f"{file}: {name} holds complex numbers; expected real ones")
    lists = {name: _names(loaded[name]) for name in wanted if name in NAMES}
    arrays = {name: np.asarray(loaded[name]).astype(float) for name, kind in wanted.items() if name not in lists and kind in NUMBERS}
    others = {name: kind for name, _, kind in found if name not in lists}
    for name in [name for name, shape, kind in found if kind in NUMBERS and math.prod(shape) == 1]:
        others.pop(name, None)  # a number that holds for the whole motion, the rate say, is no column
    table = table_of_arrays(file, "MATLAB file", {name: f"a {kind}" if name not in arrays else "" for name, kind in others.items()}, arrays, lists)
    left = [name for name, shape, _ in found if math.prod(shape) == 1 and name not in table.names]
    if left:
        table.notes.append(f"left out, since they are single numbers: {listed(left)}")
    return table


def _damaged(file: str, error: Exception) -> MotionError:
    return MotionError(f"{file}: is a MATLAB file, but truncated or damaged ({type(error).__name__}); save it again, or write it by writetable(…, 'motion.csv')")


def _wanted(file: str, found: list[tuple[str, tuple[int, ...], str]]) -> dict[str, str]:
    """{variable: its class} of what is loaded."""
    check_columns(file, len(found))
    if not any(kind in NUMBERS for _, _, kind in found):
        held = listed([f"{name} ({kind})" for name, _, kind in found]) or "nothing"
        raise MotionError(f"{file}: holds no arrays of numbers, but {held}; {MEND}")
    check_numbers(file, sum(math.prod(shape) for _, shape, kind in found if kind in NUMBERS))
    for name, shape, kind in found:
        if name in NAMES and kind in TEXTS and math.prod(shape) > limits.COLUMNS * 64:
            raise MotionError(f"{file}: {name} holds {math.prod(shape):,} characters or cells, which are no names of joints")
    return {name: kind for name, _, kind in found if kind in NUMBERS or (name in NAMES and kind in TEXTS)}


def _names(x: Any) -> list[str]:
    """Names in a cell array of texts, or in rows of characters, which MATLAB fills with blanks."""
    rows = np.asarray(x, dtype=object).ravel()
    return ["".join(str(part) for part in np.asarray(row, dtype=object).ravel()).rstrip() for row in rows]
